"""Cells of second order in 2D: patch tests, bending, the order of the error, contact with compressive forces, models, refusals."""
import os
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import PATIENCE, SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import LINEAR, Grid, graded, second  # noqa: E402

KINDS = ('tri6', 'quad8', 'quad9')
MODEL = """
scene: {mesh: mesh.msh, parameters: [push, stiff]}
parameter: {push: {range: [0.1, 0.4]}, stiff: {range: [150, 400]}}
body: {block: {young: stiff, poisson: 0.2}, seat: {young: 300, poisson: 0.3}}
fixed: {base: {y: 0}, wall: {x: 0}}
spring: {top: {normal: 2}}
pressure: {top: push*(1 + x^2)}
contact: {joint: {type: pair, slave: under, master: over}}
output: {hold: {reaction: y, group: base}, low: {min: u_y}}
"""


class Quadratic(Case):
    def displaced(self):
        with h5py.File(self.path('out.h5')) as f:
            return f['mesh/xyz'][()], f['nodes/displacement'][()]

    def test_bending(self):
        """Pure bending, plane stress: u_x = k x y, u_y = -k (x^2 + nu y^2) / 2 to round-off, on parallelograms too."""
        E, nu, k, length = 200, 0.3, 0.01, 3
        for kind, ranks in (('tri6', 2), ('quad8', 0), ('quad9', 3)):
            grid = Grid()
            grid.box(LINEAR[kind], [np.linspace(0, length, 5), np.linspace(-0.5, 0.5, 3)], lambda x: x, 'beam', {'x0': 'left', 'x1': 'right'})
            axis = next(i for i, x in enumerate(grid.nodes) if x[0] == x[1] == 0) + 1
            grid.elements.append((15, grid._tag('axis', 0), [axis]))
            text = (f'scene: {{mesh: mesh.msh, formulation: plane_stress}}\nbody: {{beam: {{young: {E}, poisson: {nu}}}}}\n'
                    f'fixed: {{left: {{x: 0}}, axis: {{y: 0}}}}\ntraction: {{right: {{x: {E * k}*y}}}}\n')
            with self.subTest(kind=kind):
                found = self.hyco('solve', '-scene', self.written(text, second(grid, kind)), '-output', 'out.xdmf', ranks=ranks)
                self.solved(found)
                self.assertLess(found['balance'], 1e-12)
                self.near(found['strain_energy'], E * k * k * length / 24, 1e-12)
                x, u = self.displaced()
                np.testing.assert_allclose(u[:, 0], k * x[:, 0] * x[:, 1], atol=1e-13)
                np.testing.assert_allclose(u[:, 1], -k * (x[:, 0]**2 + nu * x[:, 1]**2) / 2, atol=1e-13)
                with open(self.path('out.xdmf'), encoding='utf-8') as f:
                    self.assertIn({'tri6': 'Triangle_6', 'quad8': 'Quadrilateral_8', 'quad9': 'Quadrilateral_9'}[kind], f.read())

    def test_order(self):
        """A thick cylinder under pressure (Lame), plane strain and axisymmetric: the energy's error falls by 2^4, of first order by 2^2."""
        E, nu, a, b = 200, 0.3, 1, 2
        u_a = (1 + nu) / E * a * a / (b * b - a * a) * ((1 - 2 * nu) * a + b * b / a)
        for kind, least in (('tri6', 12), ('quad8', 12), ('quad9', 12)):
            errors = []
            for n in (2, 4):
                grid = Grid()
                grid.box(LINEAR[kind], [np.linspace(a, b, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1)],
                         lambda x: np.stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])], -1), 'ring', {'x0': 'bore', 'y0': 'y0', 'y1': 'y1'})
                def place(x, h=(b - a) / n):  # the middle of an arc, of a ray, of a cell's diagonal: radius to the next half step
                    r = np.hypot(x[0], x[1])
                    return x * (round((r + 0.02) * 2 / h) * h / 2) / r
                text = (f'scene: {{mesh: mesh.msh}}\nbody: {{ring: {{young: {E}, poisson: {nu}}}}}\npressure: {{bore: 1}}\nfixed: {{y0: {{y: 0}}, y1: {{x: 0}}}}\n')
                found = self.hyco('solve', '-scene', self.written(text, second(grid, kind, place)))
                self.solved(found)
                errors.append(abs(found['strain_energy'] / (np.pi / 4 * a * u_a) - 1))
            self.assertLess(errors[1], 1e-3)
            self.assertGreater(errors[0] / errors[1], least, f'{kind} {errors}')
        for kind in KINDS:  # of revolution: the section of a long tube, whose displacement is not polynomial
            grid = Grid()
            grid.box(LINEAR[kind], [np.linspace(a, b, 5), np.linspace(0, 0.5, 3)], lambda x: x, 'ring', {'x0': 'bore', 'y0': 'y0', 'y1': 'y1'})
            text = (f'scene: {{mesh: mesh.msh, formulation: axisymmetric}}\nbody: {{ring: {{young: {E}, poisson: {nu}}}}}\npressure: {{bore: 1}}\n'
                    'fixed: {"y0,y1": {y: 0}}\n')
            found = self.hyco('solve', '-scene', self.written(text, second(grid, kind)))
            self.near(found['strain_energy'], np.pi * a * u_a * 0.5, 1e-4)

    def blocks(self, kind, n=4):
        grid = Grid()
        x = np.linspace(0, 1, n + 1)
        grid.box(LINEAR[kind], [x, np.linspace(0, 1, 4)], lambda p: p, 'seat', {'y0': 'base', 'y1': 'over', 'x0': 'wall'})
        grid.box(LINEAR[kind], [x, np.linspace(1, 2, 3)], lambda p: p, 'block', {'y0': 'under', 'y1': 'top', 'x0': 'wall'})
        return second(grid, kind)

    def test_contact(self):
        """A contact transmits a uniform pressure exactly: the nodes' forces are those of the quadratic functions, none of which is tensile in 2D."""
        for kind in KINDS:
            for contact, body in (('{type: pair, slave: under, master: over}', ''), ('{group: under, normal: {y: -1}, gap: 0}', 'over: {y: 0}')):
                text = ('scene: {mesh: mesh.msh, formulation: plane_stress}\nbody: {block: {young: 200, poisson: 0.3}, seat: {young: 200, poisson: 0.3}}\n'
                        f'fixed: {{base: {{y: 0}}, wall: {{x: 0}}, {body}}}\npressure: {{top: 1.5}}\ncontact: {{joint: {contact}}}\n')
                for ranks in (0, 2):
                    with self.subTest(kind=kind, contact=contact, ranks=ranks):
                        found = self.hyco('solve', '-scene', self.written(text, self.blocks(kind)), '-output', 'out.xdmf', ranks=ranks)
                        self.solved(found)
                        self.near(found['total_contact_force'], 1.5, 1e-12)
                        self.near(found['contacts']['joint']['area'], 1, 1e-12)
                        self.near(found['contacts']['joint']['pressure_max'], 1.5, 1e-10)
                        with h5py.File(self.path('out.h5')) as f:
                            x, pressure, gap = (f[name][()] for name in ('mesh/xyz', 'nodes/contact_pressure', 'nodes/gap'))
                        active = np.isfinite(gap[:, 0]) & (pressure[:, 0] > 0)
                        self.assertEqual(np.sum(active), 9)
                        np.testing.assert_allclose(pressure[active, 0], 1.5, rtol=1e-10)

    def on_axis(self, kind, along, deep, lift):
        """Two cylinders of revolution, the upper one's lower side raised by lift(x): the mesh."""
        grid = Grid()
        grid.box(LINEAR[kind], [along, -deep[::-1]], lambda x: x, 'seat', {'y0': 'base', 'y1': 'over'})
        grid.box(LINEAR[kind], [along, deep], lambda x: x, 'block', {'y0': 'under', 'y1': 'top'})
        nodes, elements, names = second(grid, kind)
        block = next(tag for tag, name in names.items() if name[1] == 'block')
        for i in {n - 1 for _, tag, cell in elements if tag == block for n in cell}:
            nodes[i] = (nodes[i][0], nodes[i][1] + (1 - nodes[i][1] / deep[-1]) * lift(nodes[i][0]), 0)
        return nodes, elements, names

    def axis_fields(self):
        """Of the slave nodes by radius: radius, force, pressure, gap, the force's axial component in space."""
        with h5py.File(self.path('out.h5')) as f:
            x, tag, slave, force = (f[name][()] for name in ('mesh/xyz', 'mesh/node_id', 'contact/node_id', 'contact/lambda'))
            at = np.searchsorted(tag[:, 0], slave[:, 0])
            order = np.argsort(x[at, 0])
            at = at[order]
            return (x[at, 0], force[order, 0], *(f['nodes/' + name][()][at, 0] for name in ('contact_pressure', 'gap')), f['nodes/contact_force'][()][at, 1])

    def test_axis(self):
        """A node on the axis has no share of its facet's area (the integral of N r is 0). It is held off the other body all the same, along the axis, and
        has the pressure of the facet around it: p0 = 3 F / (2 pi a^2), a^3 = 3 F R / (4 E*) of Hertz; a uniform pressure exactly."""
        E, nu, R, a = 200, 0.3, 10, 0.5
        body = f'body: {{seat: {{young: {E}, poisson: {nu}}}, block: {{young: {E}, poisson: {nu}}}}}\n'
        joint = 'contact: {joint: {type: pair, slave: under, master: over, tolerance: 4}}\noutput: {peak: {max: contact_pressure, contact: joint}, least: {min: contact_pressure, contact: joint}}\n'
        for kind in KINDS:
            grid = self.on_axis(kind, np.linspace(0, 2, 5), np.linspace(0, 1, 4), lambda x: 0)
            text = f'scene: {{mesh: mesh.msh, formulation: axisymmetric}}\n{body}fixed: {{base: {{y: 0}}}}\npressure: {{top: 1.5}}\n{joint}'
            found = self.hyco('solve', '-scene', self.written(text, grid), '-output', 'out.xdmf')
            self.solved(found)
            self.near(found['contacts']['joint']['area'], 4 * np.pi, 1e-12)
            self.near(found['outputs']['peak'], 1.5, 1e-9)
            self.near(found['outputs']['least'], 1.5, 1e-9)
            np.testing.assert_allclose(self.axis_fields()[2], 1.5, rtol=1e-9)
            along = graded(a / 6, 1.5 * a, 8, 1.25)
            grid = self.on_axis(kind, along, along, lambda x: (x * x if x < 3 else 6 * x - 9) / 2 / R)  # a cone from x = 3 on
            text = text.replace('pressure: {top: 1.5}\n', '').replace('base: {y: 0}', f'base: {{y: 0}}, top: {{y: -{1.1 * a * a / R}}}')
            for ranks in (0, 2):
                found = self.hyco('solve', '-scene', self.written(text, grid), '-output', 'out.xdmf', ranks=ranks)
                with self.subTest(kind=kind, ranks=ranks):
                    self.solved(found)
                    self.assertLess(found['balance'], 1e-10)
                    r, force, pressure, gap, push = self.axis_fields()
                    total = found['contacts']['joint']['force'][1]
                    self.near(-found['supports']['top']['force'][1], total, 1e-9)
                    width = np.cbrt(3 * total * R / 4 / (E / (1 - nu**2) / 2))
                    p0 = 3 * total / 2 / np.pi / width**2
                    self.assertEqual(r[0], 0)
                    self.assertGreaterEqual(np.min(force), 0)
                    self.assertGreaterEqual(np.min(push), 0)  # on the upper body: upwards
                    self.assertGreater(np.min(gap), -1e-12)
                    self.near(pressure[0], p0, 0.005)
                    self.near(found['outputs']['peak'], p0, 0.005)
                    self.assertEqual(found['outputs']['peak'], found['contacts']['joint']['pressure_max'])
                    self.assertEqual(np.argmax(pressure), 0)

    def test_models(self):
        """Every type of model against full order, on one and two ranks."""
        for kind, types in (('tri6', ('hybrid', 'bodies')), ('quad9', ('hybrid',)), ('quad8', ('projection', 'cubature', 'regression'))):
            scene = self.written(MODEL, self.blocks(kind))
            full = [self.hyco('solve', '-scene', scene, '-mu', '0.27,310', ranks=ranks) for ranks in (0, 3)]
            self.near(full[1]['strain_energy'], full[0]['strain_energy'], 1e-10)
            for of in types:
                with self.subTest(kind=kind, type=of):
                    self.hyco('train', '-scene', scene, '-grid', '3,3', '-grid_type', 'centred', '-model', f'{kind}.h5', '-hyco_model_type', of, '-hyco_pod_tol', 1e-11,
                              *(('-hyco_rid_layers', 1, '-hyco_rid_modes', 'displacement,stress,force,dual') if of == 'hybrid' else ()))
                    found = self.hyco('compare', '-scene', scene, '-model', f'{kind}.h5', '-grid', '2,2', ranks=2)
                    self.assertLess(found['error_u']['max'], 0.02)
                    self.assertLess(found['error_u_h1']['max'], 0.05)
                    # modes of a projection that do not change the gaps give no forces, which do not balance the reactions
                    model = self.hyco('predict', '-model', f'{kind}.h5', '-mu', '0.27,310', status=3 * (of == 'projection'))
                    for name, value in full[0]['outputs'].items():
                        self.near(model['outputs'][name], value, 0.05, name)

    def test_refused(self):
        """Surfaces that do not match, refinement, bbar and writing as HDF5 are refused."""
        text = 'scene: {mesh: mesh.msh}\nbody: {block: {young: 200}, seat: {young: 200}}\nfixed: {base: {x: 0, y: 0}, wall: {x: 0}}\n'
        for more, said in (('contact: {c: {type: surface, slave: under, master: over}}', 'needs first-order cells'),
                           ('scene_refine: 1', 'needs first-order cells'), ('body_seat_element: bbar', 'is for quad4 and hex8'),
                           ('hyco_mesh_write: m.h5', 'cannot be written as a DMPlex')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(text + more + '\n', self.blocks('quad8')), ranks=ranks)
                with self.subTest(more=more, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)

    def test_other_cells(self):
        """Second-order cells that hyco does not support, or of two types: one line with the remedy."""
        drawing = ('Point(1) = {0,0,0,1}; Point(2) = {1,0,0,1}; Point(3) = {0,1,0,1}; Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,1}; Curve Loop(1) = {1,2,3};'
                   'Plane Surface(1) = {1}; e[] = Extrude {0,0,1} {Surface{1}; Layers{1}; Recombine;}; Physical Volume("block") = {e[1]};\n')
        with open(self.path('b.geo'), 'w', encoding='ascii') as f:
            f.write(drawing)
        subprocess.run(['gmsh', '-3', self.path('b.geo'), '-order', '2', '-v', '1', '-format', 'msh41', '-o', self.path('mesh.msh')], check=True, timeout=60 * PATIENCE)
        for ranks in (0, 2):
            run = self.run_raw('check', '-scene', self.written('scene: {mesh: mesh.msh}\nbody: {block: {young: 200}}\n'), ranks=ranks)
            with self.subTest(ranks=ranks):
                self.assertEqual(run.returncode, 1)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn('prisms of second order', run.stderr)
                self.assertIn('mesh the bodies with these', run.stderr)
        for bodies in (('block', 'block'), ('block', 'seat')):
            parts = []
            for kind, body, lo in (('quad8', bodies[0], 0), ('tri6', bodies[1], 1)):
                grid = Grid()
                grid.box(LINEAR[kind], [np.linspace(lo, lo + 1, 3)] * 2, lambda x: x, body, {})
                parts.append(second(grid, kind))
            (nodes, elements, names), (more, others, _) = parts
            tag = 1 if bodies[0] == bodies[1] else 2
            msh(self.path('mesh.msh'), nodes + more, elements + [(k, tag, [len(nodes) + v for v in c]) for k, _, c in others],
                {tag: (2, bodies[1]), **names})
            run = self.run_raw('check', '-scene', self.written('scene: {mesh: mesh.msh}\nbody: {block: {young: 200}%s}\n' % (', seat: {young: 1}' * (tag > 1))))
            self.assertEqual(run.returncode, 1)
            self.assertIn('only first-order cells may be of several types', run.stderr)


if __name__ == '__main__':
    unittest.main()
