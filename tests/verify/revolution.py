"""Scenes of revolution and of plane stress.

Shrink fit of two rings (bore a = 1, common radius c = 2, rim b = 3; lame.py has the formulas): between plates that hold
the axis it is the plane-strain one; under plane stress delta = p c [((b^2 + c^2)/(b^2 - c^2) + nu2)/E2 + ((c^2 + a^2)/(c^2 - a^2) - nu1)/E1].
Thick sphere under the pressure p inside: u = p a^3/(E (b^3 - a^3)) [(1 - 2 nu) r + (1 + nu) b^3/(2 r^2)].
Disc with the temperature T (1 - r^2/b^2), free, plane stress: sigma_r = alpha E T/4 (r^2/b^2 - 1), sigma_t = alpha E T/4 (3 r^2/b^2 - 1)
(Timoshenko and Goodier, Theory of Elasticity, 3rd ed. 1970, chapters 4, 13). Hertz's ball and the creeping ring: hertz.py, ring.py.
Forces of a scene of revolution are those of the full circle.
"""
import math
import os
import unittest

import numpy as np

import lame
from common import PELLET
from grids import Grid
from hertz import axes, under
from ring import relaxing
from verify import Verify, order

FIT = """
scene: {{title: shrink fit, mesh: mesh.msh, formulation: {formulation}}}
body: {{inner: {{young: 2e5, poisson: 0.25}}, outer: {{young: 1e5, poisson: 0.35}}}}
fixed: {{{fixed}}}
contact: {{fit: {{type: pair, slave: shaft, master: sleeve, tolerance: 1e-6, normal: {{{normal}}}, gap: -1e-3}}}}
"""
SPHERE = """
scene: {{title: thick sphere, mesh: mesh.msh, formulation: axisymmetric}}
body: {{shell: {{young: 1e5, poisson: {poisson}, element: {element}}}}}
fixed: {{equator: {{y: 0}}}}
pressure: {{inside: 100}}
"""
BALL = """
scene: {{title: ball on a rigid plane, mesh: mesh.msh, formulation: axisymmetric}}
body: {{ball: {{young: 1, poisson: 0.3}}}}
fixed: {{top: {{y: -{press}}}}}
contact: {{plane: {{type: obstacle, group: under, normal: {{y: -1}}, gap: y + 1}}}}
"""
HOT = """
scene: {title: disc hot inside, mesh: mesh.msh, formulation: plane_stress}
body: {disc: {young: 1e5, poisson: 0.3, temperature: 300 + 100*(1 - (x^2 + y^2)/9), reference_temperature: 300, expansion: 1e-5}}
fixed: {y0: {y: 0}, x0: {x: 0}}
"""
CREEP = """
scene: {{title: ring on a core, mesh: mesh.msh, formulation: axisymmetric}}
body:
  core: {{young: 1e5, poisson: 0.3}}
  ring: {{law: norton, young: 1e5, poisson: 0.3, rate: 2e-6, exponent: 1}}
fixed: {{ends: {{y: 0}}}}
contact: {{fit: {{type: pair, slave: shaft, master: sleeve, tolerance: 1e-6, normal: {{x: 1}}, gap: -0.01}}}}
history: {{times: [{times}]}}
"""
PELLET_SECTION = """
scene: {title: the section of examples/pellet, mesh: mesh.msh, formulation: axisymmetric}
body: {pellet: {young: 1e5, poisson: 0.3, map: {x: x*4.06/4.1}}, cladding: {young: 1e5, poisson: 0.3}}
fixed: {middle: {y: 0}}
pressure: {pellet_top: 5, outer: "y < 2 ? 250 : 50"}
contact: {gap: {type: pair, slave: shaft, master: sleeve, tolerance: 1e-3, normal: {x: 1}, gap: 0.04}}
"""
SQUEEZED = """
scene: {title: cylinder under the same pressure everywhere, mesh: mesh.msh, formulation: axisymmetric}
body: {rod: {young: 1e5, poisson: 0.3}}
fixed: {bottom: {y: 0}}
pressure: {side: 7, top: 7}
"""


def same(x):
    return x


class Revolution(Verify):
    name = 'revolution'

    def fit(self, kind, formulation, n):
        """The rings' pressure at its worst node, and the fields."""
        grid, plane = Grid(), formulation == 'plane_stress'
        across = np.linspace(0, np.pi / 2, 2 * n + 1) if plane else np.linspace(0, 0.5, n // 2 + 1)
        ends = {'y0': 'y0', 'y1': 'x0'} if plane else {'y0': 'ends', 'y1': 'ends'}
        for body, low, faces in (('inner', 1, {'x1': 'shaft'}), ('outer', 2, {'x0': 'sleeve'})):
            grid.box(kind, [np.linspace(low, low + 1, n + 1), across], lame.polar if plane else same, body, {**faces, **ends})
        text = FIT.format(formulation=formulation, fixed='x0: {x: 0}, y0: {y: 0}' if plane else 'ends: {y: 0}',
                          normal='x: x, y: y' if plane else 'x: 1')
        return self.solve(self.scene(text, grid))

    def test_fit(self):
        """A shrink fit, axisymmetric and in plane stress: pressure and order of the error."""
        sizes = (8, 16, 32)
        held = lame.pressure(1, 2, 3, (2e5, 0.25), (1e5, 0.35), 1e-3)
        free = 1e-3 / (2 * ((13 / 5 + 0.35) / 1e5 + (5 / 3 - 0.25) / 2e5))
        for title, kind, formulation, exact in (('of revolution', 'quad4', 'axisymmetric', held),
                                                ('of revolution', 'tri3', 'axisymmetric', held),
                                                ('plane stress', 'quad4', 'plane_stress', free)):
            found = []
            for n in sizes:
                report, out = self.fit(kind, formulation, n)
                found.append(lame.worst(out['pressure'], exact))
            if formulation == 'axisymmetric':
                self.row(f'{kind} {title}: force over the full circle', report['total_contact_force'], exact * 2 * math.pi * 2 * 0.5, 0.1)
                centre = out['mesh/xyz'][out['mesh/cells']].mean(axis=1)
                r, inside = centre[:, 0], centre[:, 0] < 2
                mean, rim = np.where(inside, -exact * 4 / 3, exact * 4 / 5), np.where(inside, 1, 3)
                hoop = mean * (1 + rim**2 / r**2)
                stress = out['cells/stress']
                self.row(f'{kind} {title}: largest error of the hoop stress, over the pressure', abs(stress[:, 5] - hoop).max() / exact, 0, 0.03 if kind == 'tri3' else 1e-3)
            else:
                self.row(f'{kind} {title}: largest stress across the plane', abs(out['cells/stress'][:, 5]).max() / exact, 0, 1e-12)
            if kind == 'quad4':  # of triangles the nodes at the ends have one or two cells
                self.row(f'{kind} {title}: order of the pressure', order(1 / np.array(sizes), abs(np.array(found) - exact)), 2, 5)
                self.row(f'{kind} {title}: pressure at its worst node', found[-1], exact, 0.1)

    def test_sphere(self):
        """A quarter of the section; the other end of the arc lies on the axis, where nothing need be fixed."""
        for title, poisson, element, bound in (('thick sphere', 0.3, 'standard', 0.2), ('thick sphere, bbar', 0.4999, 'bbar', 0.2)):
            off = []
            for n in (6, 12, 24):
                grid = Grid()
                grid.box('quad4', [np.linspace(1, 2, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1)], lame.polar, 'shell',
                         {'x0': 'inside', 'y0': 'equator'})
                out = self.solve(self.scene(SPHERE.format(poisson=poisson, element=element), grid))[1]
                u = out['nodes/displacement']
                r = np.linalg.norm(out['mesh/xyz'], axis=1)
                exact = 100 / (1e5 * 7) * ((1 - 2 * poisson) * r + (1 + poisson) * 8 / (2 * r**2))
                off.append(np.max(abs(np.sum(u * out['mesh/xyz'], axis=1) / r - exact)) / exact.max())
            self.row(f'{title}: order of the displacement', order(1 / np.array((6, 12, 24)), off), 1.5 if element == 'bbar' else 1.9, 0, least=True)
            self.row(f'{title}: largest error of the displacement, %', 100 * off[-1], 0, bound)

    def test_uniform(self):
        """All stresses are the pressure, exactly, next to the axis too."""
        for kind in ('quad4', 'tri3'):
            grid = Grid()
            grid.box(kind, [np.linspace(0, 1, 5), np.linspace(0, 2, 7)], lambda x: x + 0.05 * np.sin(3 * x) * (x[:, :1] * (1 - x[:, :1])), 'rod',
                     {'x1': 'side', 'y0': 'bottom', 'y1': 'top'})
            stress = self.solve(self.scene(SQUEEZED, grid))[1]['cells/stress']
            self.row(f'{kind}: uniform pressure, largest error', abs(stress - [-7, 0, 0, -7, 0, -7]).max(), 0, 1e-10)

    def test_ball(self):
        """Hertz's pressure under a ball, on half of its section."""
        cells, forces, peaks, widths = (6, 12, 24), [], [], []
        width = 0.01
        press = width**2  # of a ball on a plane: a^2 = R d
        for n in cells:
            grid = Grid()
            along, down = axes(width, n, 1, 1.6)
            grid.box('quad4', [along, down], under, 'ball', {'y1': 'under', 'y0': 'top'})
            report, out = self.solve(self.scene(BALL.format(press=press), grid))
            force, stiffness = report['total_contact_force'], 1 / (1 - 0.3**2)
            a = (3 * force / (4 * stiffness))**(1 / 3)
            forces.append(force)
            moment = np.sum(out['lambda'] * out['at'][:, 0]**2) / force
            widths.append(math.sqrt(5 * moment / 2) / a)
            # the pressure near the middle: the node on the axis has half a facet, with a third of its circle's share
            near = np.argsort(out['at'][:, 0])[2]
            peaks.append(out['pressure'][near] / math.sqrt(1 - (out['at'][near, 0] / a)**2) / (3 * force / (2 * math.pi * a**2)))
        self.row('ball: half-width by its second moment', widths[-1], 1, 0.5)
        self.row('ball: pressure near the middle', peaks[-1], 1, 1)

    def test_pellet(self):
        """The paper's pellet, whose 3D mesh is an eighth, and a section with as many layers: four times the forces."""
        grid, z = Grid(), np.concatenate([np.linspace(0, 2, 13)[:-1], np.linspace(2, 6.75, 29)])
        for body, r, faces in (('pellet', np.linspace(0, 4.1, 17), {'x1': 'shaft', 'y1': 'pellet_top'}),
                               ('cladding', np.linspace(4.1, 4.7, 5), {'x0': 'sleeve', 'x1': 'outer'})):
            grid.box('quad4', [r, z], same, body, {**faces, 'y0': 'middle'})
        report, out = self.solve(self.scene(PELLET_SECTION, grid))
        whole, fields = self.solve(PELLET, '-scene_mesh', os.path.join(PELLET, 'B.msh'), '-mu', '4.06,1', timeout=200)
        self.row('pellet: contact force in 3D, four eighths, against the section', 4 * whole['total_contact_force'], report['total_contact_force'], 1)
        radial = np.linalg.norm(fields['nodes/displacement'][:, :2], axis=1)
        self.row('pellet: largest radial displacement', radial.max(), abs(out['nodes/displacement'][:, 0]).max(), 1)
        closed = max(out['at'][out['lambda'] > 0][:, 1])
        self.row('pellet: end of the closed gap, to a layer', max(fields['at'][fields['lambda'] > 0][:, 2]), closed, 100 * 0.17 / closed)

    def test_hot(self):
        """A hot disc: the stresses of Timoshenko and Goodier."""
        grid = Grid()
        n = 24
        grid.box('quad4', [np.linspace(0.03, 3, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1)], lame.polar, 'disc', {'y0': 'y0', 'y1': 'x0'})
        out = self.solve(self.scene(HOT, grid))[1]
        centre = out['mesh/xyz'][out['mesh/cells']].mean(axis=1)
        r, stress = np.hypot(centre[:, 0], centre[:, 1]), out['cells/stress']
        scale = 1e-5 * 1e5 * 100 / 4
        away = r > 0.5  # of the bore, which is there for the mesh
        trace, exact = stress[:, 0] + stress[:, 3], scale * (4 * r**2 / 9 - 2)
        self.row('hot disc: largest error of sigma_r + sigma_t', abs(trace - exact)[away].max() / scale, 0, 0.02)
        self.row('hot disc: stress across the plane', abs(stress[:, 5]).max() / scale, 0, 1e-12)

    def test_creep(self):
        """ring.py's shrink fit as a scene of revolution, held along the axis."""
        grid = Grid()
        for body, r, faces in (('core', np.linspace(0, 4.1, 21), {'x1': 'shaft'}), ('ring', np.linspace(4.1, 4.7, 9), {'x0': 'sleeve'})):
            grid.box('quad4', [r, np.linspace(0, 0.3, 3)], same, body, {**faces, 'y0': 'ends', 'y1': 'ends'})
        times = np.linspace(0, 2, 161)
        scene = self.scene(CREEP.format(times=', '.join(f'{t:g}' for t in times)), grid)
        h = self.hyco('solve', '-scene', scene)['history']
        p = np.array(h['total_contact_force']) / (2 * math.pi * 4.1 * 0.3)
        for k in (0, 80, 160):
            self.row(f'creeping ring of revolution: p at t = {times[k]:g}', p[k], float(relaxing(times[k])), 0.2)
        self.row('creeping ring of revolution: largest defect of energy', max(h['energy_defect']), 0, 1e-8)


if __name__ == '__main__':
    unittest.main()
