"""Broken meshes and scenes, made here from a sound one: one line, status 1, soon, on one rank and on two or three."""
import os
import subprocess
import unittest
from concurrent.futures import ThreadPoolExecutor

from common import PATIENCE, Case, msh, said
from rows import Rows

# two squares of 2 x 2 cells, one over the other; groups by tag
NAMES = {1: (2, 'low'), 2: (2, 'up'), 3: (1, 'floor'), 4: (1, 'top'), 5: (1, 'under'), 6: (1, 'over')}
ROWS = Rows('meshes')
SCENE = '''scene:
  mesh: two.msh
  parameters: [load]
parameter: {load: {range: [0.001, 0.1]}}
body:
  low: {young: 1, poisson: 0.3}
  up: {young: 2, poisson: 0.3}
fixed:
  floor: {x: 0, y: 0}
  top: {x: 0, y: -load}
contact:
  c: {type: pair, slave: over, master: under}
'''


def sound():
    """Nodes and elements of the two squares; the gap is 0."""
    nodes, elements = [], []
    for body in range(2):
        first = len(nodes) + 1
        nodes += [(i / 2, body + j / 2, 0.0) for j in range(3) for i in range(3)]
        at = lambda i, j, first=first: first + 3 * j + i
        elements += [(3, body + 1, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]) for j in range(2) for i in range(2)]
        for tag, j in (((3, 0), (5, 2)) if body == 0 else ((6, 0), (4, 2))):
            elements += [(1, tag, [at(i, j), at(i + 1, j)]) for i in range(2)]
    return nodes, elements


def moved(nodes, k, x):
    return nodes[:k] + [x] + nodes[k + 1:]


# (what, change of (nodes, elements, names) -> the same, expected text); nodes count from 0 here, from 1 in elements
MESHES = [
    ('a node is missing', lambda n, e, g: (n[:-1], e, g), 'refers to node 18, which the file does not define'),
    ('node 0', lambda n, e, g: (n, [(3, 1, [0, 2, 5, 4])] + e[1:], g), 'refers to node 0, which the file does not define'),
    ('NaN', lambda n, e, g: (moved(n, 4, (float('nan'), 0, 0)), e, g), 'node 5 has a coordinate that is not finite'),
    ('infinite', lambda n, e, g: (moved(n, 4, (0, float('inf'), 0)), e, g), 'node 5 has a coordinate that is not finite'),
    ('inverted cell', lambda n, e, g: (moved(n, 4, (-1.0, -1.0, 0)), e, g), 'is inverted: its volume element changes sign'),
    ('degenerate cell', lambda n, e, g: (n, [(3, 1, [1, 1, 1, 1])] + e[1:], g), 'element 1 has a node twice'),
    ('all nodes in one place', lambda n, e, g: ([(0, 0, 0)] * len(n), e, g), 'cell 1 is degenerate: its volume vanishes'),
    ('flat cells', lambda n, e, g: ([(x, 0.0, 0) for x, y, z in n], e, g), 'is degenerate: its volume vanishes'),
    ('out of the plane', lambda n, e, g: (moved(n, 4, (0.5, 0.5, 1)), e, g), 'z coordinates run from 0 to 1'),
    ('huge coordinates', lambda n, e, g: (moved(n, 4, (1e308, -1e308, 0)), e, g), 'is degenerate: its volume vanishes'),
    ('one cell in two groups', lambda n, e, g: (n, e + [(3, 2, e[0][2])], g), 'have the same nodes; a cell must belong to one body'),
    ('an empty group', lambda n, e, g: (n, [x for x in e if x[1] != 6], g), 'the mesh has no group "over"; its groups are: floor, top'),
    ('a body without cells', lambda n, e, g: (n, [x for x in e if x[1] != 2], g), 'body "up" has no cells'),
    ('a triangle in a quadrilateral', lambda n, e, g: (n, e + [(2, 1, [1, 2, 4])], g), 'cell 17 has only nodes of cell 1'),
    ('a cell with a node on two corners', lambda n, e, g: (n, [(3, 1, [1, 2, 1, 4])] + e[1:], g), 'element 1 has a node twice'),
    ('second order', lambda n, e, g: (n, [(10, 1, [1, 3, 9, 7, 2, 6, 8, 4, 5])] + e, g), 'mixes elements of 9 and 4 nodes'),
    ('an unknown type', lambda n, e, g: (n, [(77, 1, [1, 2, 3])] + e, g), 'gmsh type 77'),
    ('a facet of no cell', lambda n, e, g: (n, e + [(1, 5, [1, 9])], g), 'is not a facet of any cell of a body'),
    ('unpaired surfaces', lambda n, e, g: ([(x, y + 5 if k > 8 else y, z) for k, (x, y, z) in enumerate(n)], e, g), 'have no node of under within'),
    ('names twice', lambda n, e, g: (n, e, {**g, 7: (2, 'low')}), None),
    ('a cell twice', lambda n, e, g: (n, e + [(3, 1, [2, 5, 4, 1])], g), 'cells 1 and 17 have the same nodes'),
    ('a cell that collapses to a triangle', lambda n, e, g: (n, [(3, 1, [1, 2, 5, 5])] + e[1:], g), None),
    ('a facet twice', lambda n, e, g: (n, e + [(1, 6, [10, 11])], g), None),
    ('a body of triangles', lambda n, e, g: (n, [x for x in e if x[1] != 2] + [(2, 2, [10, 11, 14])], g), 'is not a facet of any cell of a body'),
    ('two nodes on one', lambda n, e, g: ([(0.001 * x, y, z) if k == 10 else (x, y, z) for k, (x, y, z) in enumerate(n)], e, g),
     'contact c: 1 of the 3 nodes of over have no node of under'),
    ('no elements', lambda n, e, g: (n, [], g), 'has no physical groups'),
    ('no nodes', lambda n, e, g: ([], [], g), 'has no physical groups'),
    ('no names', lambda n, e, g: (n, e, {}), 'body "low" has no cells'),
]
# a mesh and a scene that do not go together: (what, change of the mesh, change of the scene, expected text)
HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
HEX_SCENE = '''scene: {mesh: m.msh, parameters: [load]}
parameter: {load: {range: [0.001, 0.1]}}
body: {b: {young: 1}}
fixed: {f: {x: 0, y: 0, z: 0}}
'''
TOGETHER = [
    ('a load between two cells', lambda n, e, g: (n, e + [(1, 7, [4, 5])], {**g, 7: (1, 'mid')}),
     lambda s: s.replace('body:\n', 'pressure: {mid: 1}\nbody:\n'), 'the load on mid: 1 of its facets lie between two cells'),
    ('a body without an entry', lambda n, e, g: (n, e, g), lambda s: s.replace('  up: {young: 2, poisson: 0.3}\n', ''),
     'on the cells of "up", which is no body of the scene (facet 15); add the entry body: {up: {young: ...}}'),
    ('a master between two cells', lambda n, e, g: (n, e + [(1, 7, [4, 5])], {**g, 7: (1, 'mid')}),
     lambda s: s.replace('type: pair', 'type: surface').replace('master: under', 'master: mid'), 'contact c: the group mid is empty'),
    ('bodies that share nodes', lambda n, e, g: (n, [(k, t, [{10: 7, 11: 8, 12: 9}.get(v, v) for v in of]) for k, t, of in e], g),
     lambda s: s.replace('young: 1,', 'map: {x: 2*x}, young: 1,'), 'the bodies low and up share node 7 and have different maps'),
    ('two nodes on one, a large tolerance', lambda n, e, g: ([(0.001 * x, y, z) if k == 10 else (x, y, z) for k, (x, y, z) in enumerate(n)], e, g),
     lambda s: s.replace('master: under', 'master: under, tolerance: 10'), 'nodes 10 and 11 of over are both nearest to node 7 of under'),
    ('triangles on a hexahedron', lambda n, e, g: (HEX, [(5, 1, [1, 2, 3, 4, 5, 6, 7, 8]), (2, 2, [1, 2, 3])], {1: (3, 'b'), 2: (2, 'f')}),
     lambda s: HEX_SCENE, 'group "f" has facets of 3 nodes, and those of the cells have 4'),
]
TEXTS = [
    ('a count too large', lambda t: t.replace('$Nodes\n18', '$Nodes\n4000000000'), 'declares 4000000000 nodes, more than the file contains'),
    ('a negative count', lambda t: t.replace('$Elements\n16', '$Elements\n-1'), 'declares -1 elements'),
    ('a count too small', lambda t: t.replace('$Nodes\n18', '$Nodes\n17'), 'refers to node 18, which the file does not define'),
    ('a node twice', lambda t: t.replace('\n18 1 2', '\n17 1 2'), 'node 17 occurs twice'),
    ('a name of dimension 21', lambda t: t.replace('2 1 "low"', '21 1 "low"'), 'a name of a group is "21 1 "low""'),
    ('a name without its quotes', lambda t: t.replace('2 1 "low"', '2 1 "low'), 'a name of a group is'),
    ('letters', lambda t: t.replace('\n5 0.5', '\n5 a.5'), 'the coordinates of node 5 are not numbers'),
    ('another version', lambda t: t.replace('2.2 0 8', '3 0 8'), "has gmsh's format 3 (0, 8); hyco reads 2.2 and 4.1"),
    ('binary that is text', lambda t: t.replace('2.2 0 8', '2.2 1 8'), 'was written on a machine with another byte order'),
    ('four tags', lambda t: t.replace('1 3 2 1 1', '1 3 4 1 1'), 'has an element with 4 tags, and 2 are expected'),
    ('a negative group', lambda t: t.replace('1 3 2 1 1', '1 3 2 -1 1'), "an element's group is -1"),
    ('a negative element', lambda t: t.replace('\n1 3 2 1 1', '\n-1 3 2 1 1'), 'it has an element of the tag -1'),
    ('a negative node', lambda t: t.replace('\n18 1 2', '\n-18 1 2'), 'has a node of the tag -18'),
    ('two formats', lambda t: t.replace('$PhysicalNames', '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames'), 'has a section $MeshFormat that'),
    ('a .geo', lambda t: 'SystemCall "touch ran";\n' + t, 'is not a gmsh mesh'),
    ('a .geo behind a mark', lambda t: t.split('$PhysicalNames')[0] + 'SystemCall "touch ran";\n', 'cannot be read'),
    ('cut', lambda t: t[:len(t) // 2], ''),
    ('nothing', lambda t: '', 'is not a gmsh mesh, or cannot be read'),
]


def swap(old, new):
    return lambda t: t.replace(old, new, 1)


# the same mesh in format 4.1, as gmsh writes it
LOW, FLOOR, BLOCKS = '1 0 0 0 1 1 0 1 1 0', '1 3 0 3\n1\n2\n3\n', '$Nodes\n6 18 1 18'
TEXTS_41 = [
    ('a cell in two bodies', swap(LOW, '1 0 0 0 1 1 0 2 1 2 0'), 'cell 1 belongs to two bodies'),
    ('a group without elements', lambda t: t.replace('1 6 1 2\n13 10 11 \n14 11 12 \n', '').replace('$Elements\n6 16 1 16', '$Elements\n5 14 1 16'), 'contact c: the group over is empty'),
    ('a group 0', swap(LOW, '1 0 0 0 1 1 0 1 0 0'), 'is damaged: its entities'),
    ('groups without end', swap(LOW, '1 0 0 0 1 1 0 99999 1 0'), 'declares 99999 groups of an entity'),
    ('a negative entity', swap('\n' + LOW, '\n-' + LOW), 'there is no entity of dimension 2 and number -1'),
    ('entities after nodes', swap('$EndElements\n', '$EndElements\n$Entities\n0 0 0 0\n$EndEntities\n'), 'a section $Entities after its nodes'),
    ('a negative number of names', swap('$PhysicalNames\n6', '$PhysicalNames\n-6'), 'declares -6 names'),
    ('too many names', swap('$PhysicalNames\n6', '$PhysicalNames\n60'), 'a name of a group is "$EndPhysicalNames"'),
    ('names without end', lambda t: t[:t.index('$EndPhysicalNames')].replace('$PhysicalNames\n6', '$PhysicalNames\n7'), 'it ends among its names'),
    ('letters for a node', swap('\n7\n8\n9\n', '\n7\nx\n9\n'), 'it ends among its nodes'),
    ('a negative node', swap('\n7\n8\n9\n', '\n7\n-8\n9\n'), 'has a node of the tag -8'),
    ('a node beyond the last', swap('\n7\n8\n9\n', '\n7\n88\n9\n'), 'node 88 lies outside its range of tags, 1 to 18'),
    ('a node twice', swap('\n7\n8\n9\n', '\n7\n7\n9\n'), 'node 7 occurs twice'),
    ('a block of dimension 7', swap(FLOOR, '7' + FLOOR[1:]), 'there is no entity of dimension 7 and number 3'),
    ('parameters of another kind', swap(FLOOR, FLOOR.replace('1 3 0 3', '1 3 2 3')), 'a block of nodes'),
    ('a block without end', swap(FLOOR, FLOOR.replace('1 3 0 3', '1 3 0 9999')), 'declares 9999 nodes of a block'),
    ('more nodes than counted', swap(BLOCKS, '$Nodes\n6 17 1 18'), 'contain more nodes than it declares'),
    ('fewer nodes than counted', swap(BLOCKS, '$Nodes\n6 19 1 18'), 'contain fewer nodes than it declares'),
    ('too many blocks', swap(BLOCKS, '$Nodes\n600 18 1 18'), 'declares 600 blocks of nodes'),
    ('letters for a coordinate', swap('\n0.5 1 0\n', '\n0.5 y 0\n'), 'the coordinates of node 8 are not numbers'),
    ('NaN', swap('\n0.5 1 0\n', '\n0.5 nan 0\n'), 'node 8 has a coordinate that is not finite'),
    ('two $Nodes', swap('$EndNodes\n', '$EndNodes\n$Nodes\n0 0 0 0\n$EndNodes\n'), 'has two sections $Nodes'),
    ('a negative element', swap('\n5 1 2 \n', '\n-5 1 2 \n'), 'it has an element of the tag -5'),
    ('letters for a node of an element', swap('\n16 17 18 \n', '\n16 17 z \n'), 'it ends among its elements'),
    ('a missing node', swap('\n16 17 18 \n', '\n16 17 19 \n'), 'refers to node 19, which the file does not define'),
    ('lines on a surface', swap('1 3 1 2\n5 1 2', '2 3 1 2\n5 1 2'), 'elements of gmsh type 1 on an entity of dimension 2'),
    ('an unknown type', swap('1 3 1 2\n5 1 2', '1 3 77 2\n5 1 2'), 'gmsh type 77'),
    ('more elements than counted', swap('$Elements\n6 16', '$Elements\n6 15'), 'contain more elements than it declares'),
    ('fewer elements than counted', swap('$Elements\n6 16', '$Elements\n6 17'), 'contain fewer elements than it declares'),
    ('an element beyond the last', swap('$Elements\n6 16 1 16', '$Elements\n6 16 1 12'), 'lies outside its range of tags, 1 to 12'),
    ('two $Elements', swap('$EndElements\n', '$EndElements\n$Elements\n0 0 0 0\n$EndElements\n'), 'must have one section $Nodes and then one $Elements'),
    ('if it is partitioned', swap('$Entities', '$PartitionedEntities'), 'has a section $PartitionedEntities that'),
    ('ghosts', swap('$EndElements\n', '$EndElements\n$GhostElements\n0\n$EndGhostElements\n'), 'has a section $GhostElements that'),
    ('no entities', lambda t: t.split('$Entities')[0] + t.split('$EndEntities\n')[1], 'has no physical groups'),
    ('cut', lambda t: t[:len(t) // 2], ''),
]
# replacements in the scene, and what is expected
SCENES = [
    (('young: 1,', 'young: 2*(load,'), 'is not an expression'),
    (('young: 1,', 'young: 1/(load-load),'), 'is not finite'),
    (('young: 1,', 'young: sqrt(-1),'), 'is not finite'),
    (('young: 1,', 'young: laod,'), 'uses laod, which is unknown; the known names are x, y, z, load, pi'),
    (('young: 1,', 'young: -1,'), "Young's modulus must be positive"),
    (('young: 1,', 'young: 0,'), "Young's modulus must be positive"),
    (('young: 1,', 'young: "",'), 'is empty; give a number or an expression'),
    (('young: 1, ', ''), 'body low has no young'),
    (('young: 1,', 'young: 1e400,'), 'is not finite'),
    (('young: 1,', 'young: .inf,'), 'is not an expression'),
    (('young: 1,', 'young: log(-load),'), 'is not finite'),
    (('young: 1,', 'qqqqqqqqq: 1,'), 'body_low_qqqqqqqqq is unknown; a body of law elastic has: young, poisson, element, map_x, map_y, map_z, law'),
    (('young: 1,', 'element: soft, young: 1,'), 'it must be standard or bbar'),
    (('young: 1,', '"you\\tng": 1,'), 'has a blank in its name'),
    (('young: 1,', 'map: {z: 1}, young: 1,'), 'body_low_map_z: the mesh has 2 space dimensions and no component z'),
    (('young: 1,', 'map: {x: 1/(x-x)}, young: 1,'), 'body_low_map_x: "1/(x-x)" is not finite'),
    (('young: 1,', 'map: {x: 0}, young: 1,'), 'is degenerate: its volume vanishes'),
    (('body:\n  low: {young: 1, poisson: 0.3}\n  up: {young: 2, poisson: 0.3}\n', ''), 'the scene has no body'),
    (('poisson: 0.3}\n  up', 'poisson: 0.3}\n  top: {young: 1}\n  up'), 'body top is a group of dimension 1; the other bodies have dimension 2'),
    (('scene:\n', 'scene:\n# \0\n'), 'it contains a zero byte'),
    (('  mesh: two.msh\n', ''), 'the scene has no mesh'),
    (('floor: {x: 0, y: 0}', 'floor: {x: 0, y: 0}\n  low: {y: 1}'), 'is fixed twice in y, to 0 and to 1'),
    (('top: {x: 0, y: -load}', 'top: {x: 0, y: 1/(load-load)}'), 'fixed_top_y: "1/(load-load)" is not finite'),
    (('body:\n', 'pressure: {low: 1}\nbody:\n'), 'the load on low needs a group of dimension 1'),
    (('slave: over', 'slave: up'), 'the group up is not a surface and has no normal'),
    (('slave: over', 'tolerance: -1, slave: over'), 'it must be a length, 0 or more'),
    (('slave: over', 'tolerance: a, slave: over'), 'it must be a length, 0 or more'),
    (('slave: over, ', ''), 'contact c, type pair, has no slave'),
    ((', master: under', ''), 'contact c, type pair, has no master'),
    (('type: pair, slave: over, master: under', 'type: surface, slave: over, master: low'), 'a group of dimension 1 is needed'),
    (('type: pair, slave: over, master: under', 'type: obstacle, group: over'), 'contact c, type obstacle, has no gap'),
    (('type: pair, slave: over, master: under', 'type: obstacle, group: over, gap: 1, master: under'), 'contact_c_master is unknown; a contact of type obstacle has: group, normal_x'),
    (('contact:\n', 'contact:\n  d: {type: obstacle, group: over, normal: {x: 0, y: 1}, gap: 1}\n'), 'node 10 is a slave of the contacts c and d'),
    (('master: under}', 'master: under, gap: 0/0}'), 'contact_c_gap: "0/0" is not finite'),
    (('master: under}', 'master: under, normal: {x: 0, y: 0}}'), 'the normal at node 10 has length zero'),
    (('parameter: {', 'parameter: {weight: {unit: N}, '), 'is for a parameter that scene: parameters: does not list'),
    (('parameter: {load: {', 'parameter: {load: {unt: N, '), 'a parameter has: range, unit, title; did you mean unit?'),
    (('parameters: [load]', 'parameters: [load, "a b"]'), '"a b" cannot name a parameter'),
    (('parameters: [load]', 'parmeters: [load]'), 'uses load, which is unknown'),
    (('contact:\n', 'hyco: {pod_tool: 1}\ncontact:\n'), 'the option hyco_pod_tool is unknown; did you mean hyco_pod_tol?'),
    (('contact:\n', 'hyco: {zzzzzzzz: 1}\ncontact:\n'), 'the option hyco_zzzzzzzz is unknown; hyco -help'),
    (('poisson: 0.3', 'poisson: 0.5'), "Poisson's ratio must lie between -1 and 0.5"),
    (('poisson: 0.3', 'poisson: -1'), "Poisson's ratio must lie between -1 and 0.5"),
    (('poisson: 0.3', 'poisson: x/0'), 'is not finite'),
    (('{x: 0, y: 0}', '{x: 0, y: 0, z: 0}'), 'no component z'),
    (('{x: 0, y: 0}', '{x: 0, y: 0, w: 0}'), 'a fixed group has: x, y, z'),
    (('floor:', 'flor:'), 'did you mean floor?'),
    (('slave: over', 'slave: oven'), 'did you mean over?'),
    (('slave: over', 'slave: under'), 'the two surfaces must not share nodes'),
    (('type: pair', 'type: glue'), 'it must be mortar, obstacle, pair, rigid or surface'),
    (('range: [0.001, 0.1]', 'range: [1, 0]'), 'its range is missing or wrong'),
    (('range: [0.001, 0.1]', 'range: [a, 1]'), 'its range is missing or wrong'),
    (('range: [0.001, 0.1]', 'range: [1]'), 'its range is missing or wrong'),
    (('range: [0.001, 0.1]', 'range: [0, .inf]'), 'its range is missing or wrong'),
    (('parameters: [load]', 'parameters: [x]'), 'cannot name a parameter'),
    (('parameters: [load]', 'parameters: [load, load]'), 'occurs twice'),
    (('body:\n', 'bodies:\n'), 'is unknown; the entries are scene, parameter,'),
    (('body:\n', 'log_view: here\nbody:\n'), '"log_view" is unknown'),
    (('young: 1,', '"young ": 1,'), 'unknown'),
    (('scene:\n', 'scene: {\n'), 'is not valid YAML for hyco'),
    (('  floor: {x: 0, y: 0}\n  top: {x: 0, y: -load}\n', '  top: {x: 0, y: -load}\n'), 'keeps body low from moving along (1, 0, 0); fix a component'),
    (('  top: {x: 0, y: -load}', '  top: {y: -load}'), 'keeps body up from moving along (1, 0, 0); fix a component'),
    (('mesh: two.msh', 'mesh: none.msh'), 'none.msh cannot be opened'),
]


# errors in the cells, facets or contacts of one rank only, while the others have none: on 2 and 3 ranks
ONE_RANK = [
    (('body:\n', 'force:\n  up: {y: sqrt(x-0.9)}\nbody:\n'), 'is not finite'),
    (('body:\n', 'force:\n  low: {x: 1/(load-load)}\nbody:\n'), 'is not finite'),
    (('body:\n', 'pressure:\n  over: sqrt(x-0.9)\nbody:\n'), 'is not finite'),
    (('body:\n', 'pressure:\n  over: 1/(load-load)\nbody:\n'), 'is not finite'),
    (('body:\n', 'traction:\n  over: {x: sqrt(x-0.9)}\nbody:\n'), 'is not finite'),
    (('young: 1,', 'young: sqrt(0.8-x),'), 'is not finite'),
    (('young: 2,', 'young: sqrt(0.3-x),'), 'is not finite'),
    (('young: 2,', 'map: {y: "x > 0.9 && y > 1.9 ? 1.1 : y"}, young: 2,'), 'is inverted: its volume element changes sign'),
    (('young: 1,', 'map: {y: "x < 0.1 && y < 0.1 ? 0.9 : y"}, young: 1,'), 'is inverted: its volume element changes sign'),
    (('young: 2,', 'young: 0.8-x,'), "Young's modulus must be positive"),
    (('poisson: 0.3', 'poisson: x'), "Poisson's ratio must lie between -1 and 0.5"),
    (('{x: 0, y: -load}', '{x: 0, y: sqrt(0.9-x)}'), 'is not finite'),
    (('master: under}', 'master: under, gap: sqrt(0.9-x)}'), 'is not finite'),
    (('master: under}', 'master: under, normal: {x: 0, y: "x < 0.6 ? -1 : 0"}}'), 'has length zero'),
]


class Meshes(Case):
    def setUp(self):
        self.nodes, self.elements = sound()
        msh(self.path('two.msh'), self.nodes, self.elements, NAMES)
        self.write('scene.yaml', SCENE)
        self.count = 0

    def write(self, name, text):
        with open(self.path(name), 'w', encoding='ascii', newline='') as f:
            f.write(text)

    def run_ranks(self, ranks, mesh):
        return self.run_raw('solve', '-scene', 'scene.yaml', '-mu', '0.05', '-report', 'r.json', '-output', 'o.xdmf',
                            *(['-scene_mesh', mesh] if mesh else []), ranks=ranks, timeout=30)

    def one_line(self, run, text):
        lines = said(run)
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertEqual(len(lines), 1, run.stderr)
        self.assertTrue(lines[0].startswith('hyco: error: '), lines[0])
        self.assertNotIn('internal error', lines[0])
        self.assertIn(text, lines[0])

    def all_one_line(self, runs):
        """Runs of (what, ranks, arguments, expected text), some at a time: starting ranks is mostly waiting."""
        with ThreadPoolExecutor(4) as pool:
            started = [pool.submit(self.run_raw, *args, ranks=ranks, timeout=60) for _, ranks, args, _ in runs]
            for (what, ranks, _, text), run in zip(runs, started, strict=True):
                with self.subTest(what=what, ranks=ranks):
                    self.one_line(run.result(), text)

    def refused(self, text, mesh=None, often=3):
        """On one rank; every third one also on two or three ranks: an error found on one rank reaches the others."""
        self.count += 1
        for ranks in (0, 2 + self.count // often % 2) if self.count % often == 1 else (0,):
            self.one_line(self.run_ranks(ranks, mesh), text)
        self.assertEqual({f for f in os.listdir(self.folder) if f in ('r.json', 'o.xdmf', 'o.h5') or 'partial' in f}, set(), 'a file is left')

    def test_meshes(self):
        """Broken nodes, elements and groups of a mesh: each is refused in one line."""
        for what, change, text in MESHES:
            with self.subTest(what=what):
                msh(self.path('bad.msh'), *change(self.nodes, self.elements, NAMES))
                if text is None:
                    self.assertEqual(self.run_ranks(0, 'bad.msh').returncode, 0)
                    os.remove(self.path('r.json'))
                    os.remove(self.path('o.xdmf'))
                    os.remove(self.path('o.h5'))
                else:
                    self.refused(text, 'bad.msh')
        ROWS.add(f'broken meshes ({len(MESHES)})', 'one line, status 1, no file left; every third one also on 2 or 3 ranks')

    def test_train(self):
        """The same meshes given to train, which reads them on rank 0 for itself."""
        broken = [(change, text) for _, change, text in MESHES if text]
        runs = []
        for k, (change, text) in enumerate(broken):
            msh(self.path(f'train{k}.msh'), *change(self.nodes, self.elements, NAMES))
            runs.append((text, 2, ['train', '-scene', 'scene.yaml', '-scene_mesh', f'train{k}.msh', '-model', f'm{k}.h5', '-grid', '2'], text))
        self.all_one_line(runs)
        self.assertEqual([f for f in os.listdir(self.folder) if f.startswith('m') and f.endswith(('.h5', '.partial', '.candidate'))], [])
        ROWS.add(f'the same meshes in training ({len(broken)}), on 2 ranks', 'one line, status 1, no model')

    def test_together(self):
        """Meshes and scenes that do not match each other are refused."""
        for what, mesh, scene, text in TOGETHER:
            with self.subTest(what=what):
                msh(self.path('bad.msh'), *mesh(self.nodes, self.elements, NAMES))
                self.write('scene.yaml', scene(SCENE))
                self.refused(text, 'bad.msh')
        ROWS.add(f'meshes and scenes that are inconsistent ({len(TOGETHER)})', 'one line, status 1, no file left; every third one also on 2 or 3 ranks')

    def test_texts_41(self):
        """Broken text of a mesh file of format 4.1 is refused."""
        subprocess.run(['gmsh', '-save', '-format', 'msh41', self.path('two.msh'), '-o', self.path('good.msh'), '-v', '1'], check=True,
                       timeout=30 * PATIENCE)
        with open(self.path('good.msh'), encoding='ascii') as f:
            good = f.read()
        for what, change, text in TEXTS_41:
            with self.subTest(what=what):
                self.assertNotEqual(change(good), good)
                self.write('bad.msh', change(good))
                self.refused(text, 'bad.msh', 12)
        ROWS.add(f'broken mesh files of format 4.1 ({len(TEXTS_41)})', 'one line, status 1, no file left; every twelfth one also on 2 or 3 ranks')

    def test_texts(self):
        """Broken text of a mesh file of format 2.2 is refused."""
        with open(self.path('two.msh'), encoding='ascii') as f:
            good = f.read()
        for what, change, text in TEXTS:
            with self.subTest(what=what):
                self.assertNotEqual(change(good), good)
                self.write('bad.msh', change(good))
                self.refused(text, 'bad.msh')
        ROWS.add(f'broken mesh files ({len(TEXTS)})', 'one line, status 1, no file left; every third one also on 2 or 3 ranks')

    def test_scenes(self):
        """Broken entries of a scene are refused."""
        for (old, new), text in SCENES:
            with self.subTest(new=new):
                self.assertIn(old, SCENE)
                self.write('scene.yaml', SCENE.replace(old, new, 1))
                self.refused(text)
        ROWS.add(f'broken scenes ({len(SCENES)})', 'one line, status 1, no file left; every third one also on 2 or 3 ranks')

    def test_one_rank_only(self):
        """Errors that one rank alone meets end all ranks with one line."""
        runs = []
        for k, ((old, new), text) in enumerate(ONE_RANK):
            self.write(f'one{k}.yaml', SCENE.replace(old, new, 1))
            runs += [(new, ranks, ['solve', '-scene', f'one{k}.yaml', '-mu', '0.05'], text) for ranks in (2, 3)]
        self.all_one_line(runs)
        ROWS.add(f'errors in the cells, facets or contacts of one rank only ({len(ONE_RANK)}), on 2 and 3 ranks', 'one line, status 1, no rank left waiting')

    def test_same_in_every_format(self):
        """2.2 and 4.1, text and binary, line ends of Windows in the mesh and the scene: the same result."""
        expected = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.05')
        self.solved(expected)
        for kind in ('msh22', 'msh41'):
            for binary in ([], ['-bin']):
                subprocess.run(['gmsh', '-save', '-format', kind, *binary, self.path('two.msh'), '-o', self.path('b.msh'), '-v', '1'],
                               check=True, timeout=30 * PATIENCE)
                forms = ['b.msh']
                if not binary:
                    with open(self.path('b.msh'), encoding='ascii', newline='') as f:
                        self.write('crlf.msh', f.read().replace('\n', '\r\n'))
                    forms.append('crlf.msh')
                for form in forms:
                    with self.subTest(kind=kind, binary=binary, form=form):
                        report = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.05', '-scene_mesh', form)
                        self.near(report['total_contact_force'], expected['total_contact_force'], 1e-12)
        self.write('scene.yaml', SCENE.replace('\n', '\r\n'))
        report = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.05')
        self.near(report['total_contact_force'], expected['total_contact_force'], 1e-12)

    def test_duplicate_nodes(self):
        """Two cells of a body that meet in two nodes at the same position are two parts: unconstrained, and reported."""
        nodes = self.nodes + [self.nodes[k] for k in (6, 7, 8)]  # the upper cells of the lower body, nodes 4 to 6 of its own
        twin = {4: 19, 5: 20, 6: 21}
        nodes[18:21] = [self.nodes[k - 1] for k in (4, 5, 6)]
        elements = [(kind, tag, [twin.get(k, k) for k in of] if index in (2, 3) else of)
                    for index, (kind, tag, of) in enumerate(self.elements)]
        msh(self.path('bad.msh'), nodes, elements, NAMES)
        self.refused('keeps body low from', 'bad.msh')


if __name__ == '__main__':
    unittest.main()
