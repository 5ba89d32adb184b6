"""A body's whole skin as the slave gives the results of the group that touches: in the scenes of tests/drawn, in the solves of tests/contact, and in kinds that these lack. With HYCO_LONG all of them."""
import glob
import importlib
import importlib.machinery
import importlib.util
import os
import re
import subprocess
import sys
import traceback
import unittest

import numpy as np

from common import SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid, second  # noqa: E402
from skins import add_skins  # noqa: E402

LONG = 'HYCO_LONG' in os.environ
# scenes of tests/drawn in the suite: a pair of second order far from the other faces, surfaces on slopes, a mortar on a moved body, obstacles round a ring
QUICK = ('valveseat', 'vpad', 'lensring', 'oring')
SHARED = {'leafpunch': ('mid', 'stop'), 'snapplastic': ('stop',)}  # contacts that keep their groups: how far an obstacle reaches along a face only the group says
SLOW = ('gasket3d', 'loadpress', 'yieldpress')  # paths of half a minute, whose contacts are those of other scenes
# tests of tests/contact without a skin, and why
WITHOUT = {'test_slot': 'both groups are of one body, whose skin has the master', 'test_hertz': 'an obstacle as a line of text in one entry'}


def listed(text):
    """The contacts of a scene: the entry of the slave and its group by name."""
    body = re.split(r'\n(?=[^\s#])', text[text.index('contact:'):], maxsplit=1)[0].split('contact:', 1)[1]
    return {m[1]: (m[2], m[3]) for m in re.finditer(r'(\w+): *(?:\{|\n\s+)(?:[^{}]|\{[^{}]*\})*?\b(slave|group): ([\w-]+)', body)}


class Twins(Case):
    def same(self, found, right, what):
        """Outputs, and the contacts' forces, areas and pressures."""
        outputs = {k: v for k, v in right.get('outputs', {}).items() if isinstance(v, float)}
        for key, value in outputs.items():
            self.assertAlmostEqual(found['outputs'][key], value, delta=1e-9 * max(map(abs, outputs.values())), msg=f'{what} {key}')
        for key in ('force', 'area', 'pressure_max'):
            sizes = [np.max(np.abs(c[key] or 0)) for c in right['contacts'].values()]
            for c, one in right['contacts'].items():
                np.testing.assert_allclose(found['contacts'][c][key] or 0, one[key] or 0, rtol=0, atol=1e-9 * max(sizes), err_msg=f'{what} {c} {key}')

    def twins(self, what, scene, mesh, *args, without=(), **options):
        """Solves with the groups of the scene, and with the skins of their bodies."""
        with open(os.path.join(scene, 'scene.yaml') if os.path.isdir(scene) else scene, encoding='utf-8') as file:
            contacts = {c: of for c, of in listed(file.read()).items() if c not in without}
        skins = os.path.join(self.folder, 'skins.msh')
        subprocess.run(['gmsh', mesh, '-save', '-format', 'msh22', '-v', '1', '-o', skins], check=True, capture_output=True)
        add_skins(skins, [group for _, group in contacts.values()])
        run = lambda *more: Twins.hyco.__func__(self, 'solve', '-scene', scene, '-scene_mesh', skins, *args, *more, **options)
        self.same(run(*(word for c, (key, group) in contacts.items() for word in (f'-contact_{c}_{key}', f'skin_{group}'))), run(), what)


class Drawn(Twins):
    def test_drawn(self):
        """Scenes drawn from the documents, at the middle of the ranges; with HYCO_LONG all but three slow paths."""
        loader = importlib.machinery.SourceFileLoader('run', os.path.join(SOURCE, 'tests', 'drawn', 'run'))
        run = importlib.util.module_from_spec(importlib.util.spec_from_loader('run', loader))
        loader.exec_module(run)
        for name in [n for n in run.SCENES if n not in SLOW] if LONG else QUICK:
            scene = run.make_scene(name, self.folder)
            middle = ','.join(repr((a + b) / 2) for a, b in run.ranges(name)[1])
            with self.subTest(scene=name):
                self.twins(name, scene, os.path.join(scene, f'{name}.msh'), '-mu', middle, without=SHARED.get(name, ()))


class Kinds(Twins):
    def blocks(self, kind, n, m, second_order=''):
        """A block on a wider one, of n and m cells along them."""
        dim = 3 if kind in ('hex8', 'tet4') else 2
        grid = Grid()
        wide, high, away = [np.linspace(-0.5, 1.5, 2 * m + 1)] * (dim - 1), np.linspace(0, 1, n + 1), np.eye(dim)
        place = lambda axes: [axes[0], high, *axes[1:]]
        grid.box(kind, place(wide), lambda x: x + 0.5 * away[0] - away[1], 'low', {'y1': 'seat', 'y0': 'ground'})
        grid.box(kind, place([np.linspace(0, 1, n + 1)] * (dim - 1)), lambda x: x + 0.5 * away[0], 'up', {'y0': 'under', 'y1': 'top', 'x0': 'side'})
        mesh = self.path('mesh.msh')
        grid.tool(kind, [np.linspace(4, 5, 2)] * dim)
        if second_order:
            msh(mesh, *second(grid, second_order))
        else:
            grid.write(mesh)
        return dim, mesh

    def test_kinds(self):
        """Cells of second order, rigid tools and obstacles, axisymmetric, friction, times, moved bodies, on 1 to 3 ranks."""
        first = {'hex20': 'hex8', 'tet10': 'tet4', 'quad8': 'quad4', 'tri6': 'tri3', 'quad9': 'quad4', 'hex27': 'hex8'}
        kinds = (('tet10', 'mortar', '', '', 0), ('quad8', 'mortar', '', ', map: {x: "x + 0.3*shift"}', 0), ('quad8', 'axisymmetric', '', '', 0), ('quad4', 'mortar', ', friction: 0.3', '', 2),
                 ('hex20', 'mortar', '', '', 2), ('quad8', 'mortar', '', '', 3), ('tri6', 'mortar', '', '', 0), ('quad9', 'pair', '', '', 0), ('quad4', 'mortar', '', ', map: {x: "x + 0.3*shift"}', 3),
                 ('hex8', 'surface', '', ', map: {x: "x + 0.1*shift", y: "y + 0.01*shift"}', 2), ('hex8', 'surface', ', friction: 0.3', '', 2), ('tri6', 'obstacle', '', '', 0), ('hex20', 'obstacle', '', '', 2),
                 ('hex27', 'mortar', ', normal: {y: -1}', '', 0), ('tri3', 'rigid', '', '', 2), ('hex8', 'rigid', '', '', 0))
        for kind, type_, more, body, ranks in kinds if LONG else kinds[:4]:
            dim, mesh = self.blocks(first.get(kind, kind), 2, 2 if type_ == 'pair' else 3, second_order=kind if kind in first else '')
            fixed = ', '.join(f'{a}: 0' for a in 'xyz'[:dim])
            contact = f'slave: under, master: seat{more}'
            if type_ in ('obstacle', 'rigid'):
                contact = '%s, gap: "y + 0.001 + 0.002*(x - 0.4)^2", normal: {y: -1}' % ('group: under' if type_ == 'obstacle' else 'slave: under, master: tip')
            text = ('scene: {mesh: mesh.msh, parameters: [shift]%s}\nparameter: {shift: {range: [0, 1]}}\nbody: {low: {young: 1000, poisson: 0.3}, up: {young: 700, poisson: 0.2%s}, tool: {young: 1000}}\nfixed: {ground: {%s}, tool: {%s}%s}\n'
                    'pressure: {top: "9 + x%s"}\ncontact: {c: {type: %s, %s}}\noutput: {f: {force: %s, contact: c}, peak: {max: contact_pressure, contact: c}, low: {min: sigma_yy, group: up}}\n'
                    % (', formulation: axisymmetric' if type_ == 'axisymmetric' else '', body, fixed, fixed, ', side: {x: 0%s}' % (', z: 0' if dim == 3 else '') if 'friction' not in more else '',
                       ' + 4*t' if 'friction' in more else '', type_.replace('axisymmetric', 'mortar'), contact, 'y' if type_ == 'axisymmetric' else 'x'))
            if 'friction' in more:
                text += 'history: {times: [0, 1, 2], tables: {p: [[0, 0], [2, 1]]}}\ntraction: {top: {x: "1.5*p"}}\n'
            with self.subTest(kind=kind, type=type_, more=more, body=body, ranks=ranks):
                self.twins(f'{kind} {type_}', os.path.join(self.written(text), 'scene.yaml'), mesh, '-mu', 0.5, ranks=ranks)


class Solves(Twins):
    def test_solves(self):
        """Every solve of the tests in tests/contact; without HYCO_LONG the first of each test of pairing.py."""
        plain, case, seen = Case.run_raw.__func__, self, {}

        def replayed(cls, *args, **options):
            run = plain(cls, *args, **options)
            name = next((f.name for f in traceback.extract_stack() if f.name.startswith('test_') and f.name != 'test_solves'), 'setUp')
            seen[name] = seen.get(name, 0) + 1
            if args[0] == 'solve' and '-scene' in args and not run.returncode and name not in WITHOUT and seen[name] <= (9 if LONG else 1):
                words = [str(a) for a in args]
                for option in ('-report', '-output', '-table'):
                    if option in words:
                        del words[words.index(option):][:2]
                at = words.index('-scene')
                scene = os.path.join(options.get('cwd') or cls.folder, words[at + 1])
                scene = os.path.join(scene, 'scene.yaml') if os.path.isdir(scene) else scene
                with open(scene, encoding='utf-8') as file:
                    mesh = re.search(r'\bmesh: *"?([^\s,}"]+)', file.read())[1]
                Case.run_raw = classmethod(plain)
                try:
                    with case.subTest(test=name):
                        case.twins(name, scene, os.path.join(os.path.dirname(scene), mesh), *words[1:at], *words[at + 2:], **options)
                finally:
                    Case.run_raw = classmethod(replayed)
            return run

        names = sorted(os.path.basename(f)[:-3] for f in glob.glob(os.path.join(SOURCE, 'tests', 'contact', '*.py')))
        Case.run_raw = classmethod(replayed)
        sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))  # before modules of tests/verify with the same names
        try:
            for name in [n for n in names if n not in ('edges', 'whole_skins')] if LONG else ('pairing',):
                unittest.defaultTestLoader.loadTestsFromModule(importlib.import_module(name)).run(unittest.TestResult())
        finally:
            Case.run_raw = classmethod(plain)


if __name__ == '__main__':
    unittest.main()
