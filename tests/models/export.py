"""hyco export: C99 programs of models of bodies in 2D, 3D and with an axis, with floating bodies, gaps, loads and moduli, and of their paths with friction, creep and yield: they
compile without a warning, have the model's results in two threads at once, say what is outside the ranges; what cannot be exported is named in one line."""
import os
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import PATIENCE, ROPE, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

FLOATING = f"""
scene:
  title: a block that a foundation alone holds
  mesh: {os.path.join(SOURCE, 'examples', 'blocks', 'blocks.msh')}
  parameters: [soft, press, tip]
  unit: {{length: mm, force: N/mm, stress: MPa}}
parameter: {{soft: {{range: [1, 4]}}, press: {{range: [50, 400], unit: MPa}}, tip: {{range: [-1.9, 2]}}}}  # at -2 the load has no resultant
body:
  block: {{young: 2e5, poisson: 0.3, expansion: 1e-5, temperature: 5*soft, reference_temperature: 0}}
  foundation: {{young: 1e5/soft, poisson: 0.3}}
fixed: {{block_sym: {{x: 0}}, foundation_sym: {{x: 0}}, foundation_base: {{y: 0}}}}
pressure: {{block_top: press*(1 + tip*x/20)}}
contact: {{under: {{type: surface, slave: block_under, master: foundation_top, tolerance: 0.3}}}}
output:
  peak: {{max: mises, group: block_under}}
  sink: {{mean: u_y, group: block_top}}
  corner: {{max: u, group: block_top}}
  spread: {{mean: u, group: block_top}}
  base: {{reaction: y, group: foundation_base}}
  turn: {{moment: z, contact: under}}
  most: {{max: contact_pressure}}
  least: {{min: contact_pressure}}
  tension: {{max: principal_1, group: block_top}}
  hoop: {{min: sigma_rr, group: foundation_base}}
"""
PAD = ("""
scene: {title: a pad on two plates, mesh: drawn_pad.msh, parameters: [press, lift, soft, weight]}
parameter: {press: {range: [0.01, 0.05]}, lift: {range: [0, 0.02]}, soft: {range: [1, 2]}, weight: {range: [0, 1]}}
constant: {half: 4^-2^-1, pressure: "min(half, half*weight^2, 2) - -2^2*1e-2*(weight > 0.5 && rint(weight) == 1 ? exp(-weight) : log10(1 + weight)) + 1e-3*(hypot(weight, 1) + atan2(weight, 2) + sign(weight + 9) + floor(weight/99) + ceil(weight/99) + mod(weight/99, 9))"}
body:
  plate: {young: "soft < 1.5 ? 500*soft : 10^(soft + 1)", poisson: 0.3}
  pad: {young: 100, poisson: 0.3, map: {x: 1.1*x + 0.1, y: 0.9*y, z: z}}
fixed: {base: {x: 0, y: 0, z: 0}, press: {x: 0, y: 0, z: -press}}
pressure: {side: pressure}
contact: {under: {type: surface, slave: sole, master: top, gap: "lift + 0.01*(x^2 + y^2)"}}
output: {stress: {max: mises, group: sole}, push: {reaction: z, group: base}, mean: {mean: sigma_zz, group: pad}, area: {area: under}}
""".replace('{area: under}', '{contact: under, force: z}'), """SetFactory("OpenCASCADE"); Box(1) = {-2, -2, -1, 4, 4, 1}; Box(2) = {-1, -1, 0, 2, 2, 1};
Transfinite Curve{:} = 7; Transfinite Curve{1, 3, 5, 7} = 2; Transfinite Curve{13:24} = 5; Transfinite Surface{:}; Recombine Surface{:};
Transfinite Volume{:};
Physical Volume("plate") = {1}; Physical Volume("pad") = {2}; Physical Surface("base") = {5}; Physical Surface("top") = {6};
Physical Surface("sole") = {11}; Physical Surface("press") = {12}; Physical Surface("side") = {7};
""")
PUNCH = ("""
scene: {title: a punch over a disc, mesh: drawn_punch.msh, formulation: axisymmetric, parameters: [clear, load, ratio]}
parameter: {clear: {range: [0, 0.01]}, load: {range: [0.5, 2]}, ratio: {range: [-1, 1]}}
body: {disc: {young: 1000, poisson: 0.3}, punch: {young: 1000*10^ratio, poisson: 0.2}}
fixed: {base: {y: 0}, punch_top: {y: -0.01*load}}
pressure: {rim: 3*load}
contact: {face: {type: pair, slave: sole, master: top, gap: "clear + 0.002*x^2", tolerance: 0.01}}
output: {deep: {min: u_y, group: top}, hard: {max: contact_pressure, contact: face}, hoop: {max: sigma_tt, group: disc}, base: {reaction: y, group: base}}
""", """Point(1) = {0, 0, 0}; Point(2) = {2, 0, 0}; Point(3) = {2, 1, 0}; Point(4) = {0, 1, 0}; Point(5) = {0, 2, 0}; Point(6) = {2, 2, 0};
Point(7) = {2, 1, 0}; Point(8) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Line(5) = {8, 7}; Line(6) = {7, 6}; Line(7) = {6, 5}; Line(8) = {5, 8};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Curve Loop(2) = {5:8}; Plane Surface(2) = {2};
Transfinite Curve{1, 3, 5, 7} = 9; Transfinite Curve{2, 4, 6, 8} = 5; Transfinite Surface{:}; Recombine Surface{:};
Physical Surface("disc") = {1}; Physical Surface("punch") = {2}; Physical Curve("base") = {1}; Physical Curve("top") = {3};
Physical Curve("sole") = {5}; Physical Curve("punch_top") = {7}; Physical Curve("rim") = {2};
""")
TURN = ("""
scene: {title: a crowned pad that turns on a plate, mesh: drawn_turn.msh, parameters: [place, turn, load, soft], unit: {length: mm, force: N, stress: MPa}}
parameter: {place: {range: [-2.9, 2.9]}, turn: {range: [-0.5, 1]}, load: {range: [0.1, 1]}, soft: {range: [1, 3]}}  # at +-2.9 the pad is past the plate's edge
body:
  plate: {young: 500/soft, poisson: 0.3}
  pad: {young: 100, poisson: 0.3, map: {x: "place + x*cos(turn) - y*sin(turn)", y: "x*sin(turn) + y*cos(turn)", z: "z + 0.02*(x^2 + y^2)*(1 - z)"}}
fixed: {base: {x: 0, y: 0, z: 0}, press: {x: 0, y: 0}}
pressure: {press: load}
contact: {under: {type: surface, slave: sole, master: top}}
output:
  stress: {max: mises, group: sole}
  push: {reaction: z, group: base}
  mean: {mean: sigma_xx, group: pad}
  sink: {min: u_z, group: press}
  along: {max: u_x, group: sole}
  roll: {moment: y, contact: under}
  touch: {area: closed, contact: under}
""", """SetFactory("OpenCASCADE"); Box(1) = {-4, -2, -1, 8, 4, 1}; Box(2) = {-1, -1, 0, 2, 2, 1};
Transfinite Curve{:} = 2; Transfinite Curve{9:12} = 13; Transfinite Curve{2, 4, 6, 8} = 7; Transfinite Curve{13:24} = 4; Transfinite Surface{:};
Recombine Surface{:}; Transfinite Volume{:};
Physical Volume("plate") = {1}; Physical Volume("pad") = {2}; Physical Surface("base") = {5}; Physical Surface("top") = {6};
Physical Surface("sole") = {11}; Physical Surface("press") = {12};
""")
SHAPE = ("""
scene: {title: a tool whose radius changes, mesh: drawn_shape.msh, parameters: [place, radius, push]}
parameter: {place: {range: [-2, 3.5]}, radius: {range: [3, 6]}, push: {range: [0.01, 0.04]}}
body:
  plate: {young: 100, poisson: 0.3}
  tool: {young: 200, poisson: 0.3, map: {x: x + place, y: "y + x^2/2/radius*(1 - y)"}}
fixed: {corner: {x: 0}, base: {y: 0}, end: {x: 0.2*push}, grip: {x: 0, y: -push}}
contact: {under: {type: surface, slave: sole, master: top}}
output:
  force: {reaction: y, group: base}
  hold: {reaction: y, group: grip}
  most: {max: contact_pressure}
  stress: {max: mises, group: top}
  sink: {min: u_y, group: sole}
  touch: {area: closed, contact: under}
""", """Point(1) = {-4, -1, 0}; Point(2) = {4, -1, 0}; Point(3) = {4, 0, 0}; Point(4) = {-4, 0, 0};
Point(5) = {-1, 0, 0}; Point(6) = {1, 0, 0}; Point(7) = {1, 1, 0}; Point(8) = {-1, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 5};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Curve Loop(2) = {5:8}; Plane Surface(2) = {2};
Transfinite Curve{1, 3} = 29; Transfinite Curve{2, 4, 6, 8} = 5; Transfinite Curve{5, 7} = 9; Transfinite Surface{:}; Recombine Surface{:};
Physical Surface("plate") = {1}; Physical Surface("tool") = {2}; Physical Curve("base") = {1}; Physical Curve("end") = {2};
Physical Curve("top") = {3}; Physical Curve("corner") = {4}; Physical Curve("sole") = {5}; Physical Curve("grip") = {7};
""")
DISPLACED = f"""
scene: {{title: a cylinder that rolls on a block, mesh: {os.path.join(SOURCE, 'examples', 'roller', 'roller.msh')}, parameters: [roll, press, side, lift, tilt, soft]}}
parameter: {{roll: {{range: [-0.1, 0.1]}}, press: {{range: [0.2, 1]}}, side: {{range: [-0.1, 0.1]}}, lift: {{range: [-0.1, 0.1]}}, tilt: {{range: [-0.01, 0.01]}}, soft: {{range: [5, 20]}}}}
body:
  block: {{young: soft, poisson: 0.4}}
  cylinder: {{young: 100, poisson: 0.3, map: {{x: "x*cos(roll) - (y - 10)*sin(roll)", y: "10 + x*sin(roll) + (y - 10)*cos(roll)"}}}}
fixed: {{block_base: {{x: 0, y: lift}}, cylinder_top: {{x: "side + tilt*x", y: "-press + tilt*y"}}}}
contact: {{under: {{type: surface, slave: cylinder_round, master: block_top}}}}
output: {{base: {{reaction: y, group: block_base}}}}
"""
# A block that friction alone holds on a plane, of any size, pressed and pushed to and fro until most of it slips, and unloaded; a table has a row between listed times
HELD = """
scene: {mesh: held.msh, parameters: [m, press, push, soft, size], unit: {length: mm, force: N/mm}}
parameter: {m: {range: [0.3, 0.6]}, press: {range: [1, 2]}, push: {range: [0.1, 0.25]}, soft: {range: [1, 3]}, size: {range: [0.9, 1.1]}}
body: {block: {young: 1000/soft, poisson: 0.3, map: {x: size*x, y: size*y}}}
traction: {top: {x: "push*press*h", y: "-press*v"}}
contact: {plane: {group: base, normal: {y: -1}, gap: "0.0001*(x - 1)^2", friction: "m*(1 + 0.2*x)"}}
history: {times: [0, 1, 2, 3, 4, 5], tables: {v: [[0, 0], [1, 1], [3, 1], [4, 0.5], [5, 1]], h: [[1, 0], [2, 1], [2.6, -1], [4, 0]]}}
output: {T: {friction: x, contact: plane}, W: {friction: work}, N: {force: y}, P: {max: contact_pressure}, peak: {max: mises, group: top}, turn: {moment: z, contact: plane}}
"""
# 3D: two blocks under a shear that turns; a gap that opens
ROUND = """
scene: {mesh: round.msh, parameters: [m, hard, lift]}
parameter: {m: {range: [0.1, 0.3]}, hard: {range: [0, 3]}, lift: {range: [0, 0.002]}}
body: {low: {young: 1000*(1 + hard), poisson: 0.3}, high: {young: 500, poisson: 0.2}}
fixed: {base: {x: 0, y: 0, z: 0}, top: {x: "0.01*r*cos(3*t)", y: "0.01*r*sin(3*t)", z: "-0.01*min(t, 1)"}}
contact: {joint: {type: KIND, slave: face, master: back, gap: "lift*x^2", friction: m}}
history: {times: [0, 1, 1.5, 2, 3], tables: {r: [[0, 0], [1, 0], [2, 1]]}}
output: {T: {friction: x, contact: joint}, U: {friction: y, contact: joint}, W: {friction: work}, R: {reaction: y, group: base}, A: {area: closed, contact: joint}}
"""
# The same body without friction, on its supports
LIFTED = HELD.replace(', friction: "m*(1 + 0.2*x)"', '').replace('traction:', 'fixed: {side: {x: 0}}\ntraction:').replace('T: {friction: x, contact: plane}, W: {friction: work}, ', '')
# HELD of a fixed size, which creeps
CREEPING = HELD.replace(', soft, size]', ', soft]').replace(', size: {range: [0.9, 1.1]}', '').replace(
    'young: 1000/soft, poisson: 0.3, map: {x: size*x, y: size*y}', 'law: norton, young: 1000/soft, poisson: 0.3, rate: 1e-4*soft, exponent: 2')
# 3D, with friction: two laws of creep, heat that varies in space and in time, unloading
HEATED = """
scene: {mesh: round.msh, parameters: [q, push], unit: {length: mm, force: N, stress: MPa}}
parameter: {q: {range: [0, 10]}, push: {range: [0.5, 1.5]}}
body:
  low: {law: limback_andersson, young: 8e4, poisson: 0.3, temperature: "640+4*q*min(t, 1)+5*x", reference_temperature: 293, expansion: 5e-6}
  high: {law: strain_hardening, young: 2e5-50*temperature, poisson: 0.3, temperature: 600+q, rate: 1e-9, exponent: 2, time_exponent: 0.4}
fixed: {base: {x: 0, y: 0, z: 0}, top: {x: 0, y: 0, z: "-0.001*push*r"}}
traction: {back: {x: 3*q*r}}
contact: {joint: {type: surface, slave: face, master: back, friction: 0.3}}
history: {times: [0, 1, 10, 50, 60], tables: {r: [[0, 1], [1, 2], [50, 2], [60, 0.5]]}}
output: {S: {max: mises, group: back}, M: {mean: sigma_zz, group: back}, R: {reaction: x, group: top}, W: {friction: work}}
"""
# 2D, without: yield, unloading and yield again, under a support that moves the block as a whole, which strains nothing alone
YIELDING = """
scene: {mesh: held.msh, parameters: [press, soft]}
parameter: {press: {range: [1, 2]}, soft: {range: [0.8, 1.2]}}
body: {block: {law: j2, young: 1000, poisson: 0.3, yield: 0.9*soft + 0.1*y, hardening: 50}}
fixed: {side: {x: 0}, top: {y: -0.001*press*v}}
contact: {plane: {group: base, normal: {y: -1}, gap: "0.0001*(x - 1)^2"}}
history: {times: [0, 1, 2, 3, 4], tables: {v: [[0, 0], [1, 1], [2, 0.2], [3, 1.1], [4, 0]]}}
output: {P: {max: contact_pressure}, peak: {max: mises, group: top}, R: {reaction: y, group: top}, first: {min: sigma_xx, group: block}}
"""

# nothing but friction holds it along x, and its coefficient may be 0
FREE = """
scene: {mesh: held.msh, parameters: [mu]}
parameter: {mu: {range: [0, 0.3]}}
body: {block: {young: 1000, poisson: 0.3}}
traction: {top: {y: -v}}
contact: {plane: {group: base, normal: {y: -1}, gap: 0, friction: mu}}
history: {times: [0, 1], tables: {v: [[0, 0], [1, 1]]}}
"""


def grids(folder):
    """The meshes of HELD, ROUND."""
    grid = Grid()
    grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x, 'block', {'y0': 'base', 'y1': 'top', 'x0': 'side'})
    grid.write(os.path.join(folder, 'held.msh'))
    grid, flat = Grid(), lambda n: [np.linspace(0, 1, n)] * 2
    grid.box('hex8', [*flat(5), np.linspace(-0.5, 0, 3)], lambda x: x, 'low', {'z0': 'base', 'z1': 'back'})
    grid.box('hex8', [*flat(4), np.linspace(0, 0.5, 3)], lambda x: x, 'high', {'z0': 'face', 'z1': 'top'})
    grid.write(os.path.join(folder, 'round.msh'))


# Two threads predict all points, one with its own memory; a line for each point, from the first thread. Of a path each listed time is a point.
MAIN = """#include "NAME.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 200 };
static double mu[MOST][NAME_N_PARAMETERS];
static NAME_result result[2][MOST];
static int status[2][MOST], n;

static void *all(void *which)
{
  const int k = *(const int *)which;
  void *work = k ? NULL : malloc(NAME_work_size());

  STATE
  for (int i = 0; i < n; i++) status[k][i] = CALL;
  free(work);
  return NULL;
}

int main(void)
{
  int which[2] = {0, 1}, at = 0;
  pthread_t thread[2];

  while (scanf("%lf", &mu[at / NAME_N_PARAMETERS][at % NAME_N_PARAMETERS]) == 1) at++;
  n = at / NAME_N_PARAMETERS * TIMES;
  for (int k = 0; k < 2; k++) pthread_create(&thread[k], NULL, all, &which[k]);
  for (int k = 0; k < 2; k++) pthread_join(thread[k], NULL);
  if (memcmp(status[0], status[1], sizeof(int) * (size_t)n)) return 1;
  for (int k = 0; k < NAME_N_OUTPUTS; k++) printf("%s ", NAME_output_name[k]);
  for (int i = 0; i < n; i++) {
    printf("\\n%d %.17g", status[0][i], result[0][i].kkt);
    for (int k = 0; k < NAME_N_OUTPUTS; k++) {
      if (memcmp(&result[0][i].output[k], &result[1][i].output[k], sizeof(double))) return 2;
      printf(" %.17g", result[0][i].output[k]);
    }
  }
  return 0;
}
"""
# What MAIN has of predictions and of steps: a time before the last one is refused, and leaves the state.
PREDICT = {'TIMES': '1', 'STATE': '', 'CALL': 'NAME_predict(mu[i], &result[k][i], work)'}
STEP = {'TIMES': 'NAME_N_TIMES', 'STATE': 'NAME_state state, kept;', 'CALL': """0;
  for (int i = 0; i < n; i++) {
    const int j = i % NAME_N_TIMES;

    if (!j) NAME_start(&state);
    kept = state;
    if (j && NAME_step(mu[i / NAME_N_TIMES], NAME_time[0], &state, &result[k][i], work) != NAME_DIVERGED) exit(3);
    if (memcmp(&kept, &state, sizeof(kept))) exit(4);
    status[k][i] = NAME_step(mu[i / NAME_N_TIMES], NAME_time[j], &state, &result[k][i], work);
  }"""}
FLAGS = ['-std=c99', '-Wall', '-Wextra', '-Werror', '-pedantic']


class Export(Case):
    def compiled(self, name, of=PREDICT, level='-O1'):
        """The program of NAME.c, compiled with the strictest usual flags; the main program needs POSIX for its threads alone."""
        with open(self.path('main.c'), 'w', encoding='ascii') as f:
            text = MAIN
            for key, value in of.items():
                text = text.replace(key, value)
            f.write(text.replace('NAME', name))
        for words in (['-c', name + '.c'], ['-D_POSIX_C_SOURCE=200809L', 'main.c', name + '.o', '-o', name, '-lm', '-pthread']):
            run = subprocess.run(['cc', *FLAGS, level, *words], cwd=self.folder, timeout=60 * PATIENCE, capture_output=True, text=True, check=False)
            self.assertEqual((run.returncode, run.stderr), (0, ''))
        return self.path(name)

    def ran(self, name, points):
        """(names of the outputs, rows of status, KKT residual, outputs) at the points."""
        text = '\n'.join(' '.join(repr(float(v)) for v in p) for p in points)
        run = subprocess.run([self.path(name)], input=text, timeout=60 * PATIENCE, capture_output=True, text=True, check=True)
        names, *rows = run.stdout.splitlines()
        return names.split(), np.array([[float(v) for v in row.split()] for row in rows])

    def judge(self, name, scene, outputs, level='-O0'):
        """The program of a model of the scene against predict, at 64 points with corners and faces; its outputs begin with those of the scene."""
        self.hyco('train', '-scene', scene, '-hyco_model_type', 'bodies', '-scatter', '2', '-model', name + '.h5')
        said = self.run_raw('export', '-model', name + '.h5', '-c', name + '.c')
        self.assertEqual((said.returncode, said.stderr), (0, ''))
        self.run_raw('predict', '-model', name + '.h5', '-scatter', '64', '-table', 't.h5')
        self.compiled(name, level=level)
        with h5py.File(self.path('t.h5')) as t:
            table = {key: np.array(t[key]) for key in t}
        with open(self.path(name + '.h'), encoding='ascii') as f:
            parameters = [line.split()[1] for line in f.read().split('Parameters:\n')[1].split('   Outputs:')[0].splitlines()]
        points = np.array([table[p] for p in parameters]).T
        names, rows = self.ran(name, points)
        self.assertEqual(sorted(names[:len(outputs)]), sorted(outputs))
        self.assertTrue(table['converged'].all() and not rows[:, 0].any())
        self.assertLess(rows[:, 1].max(), 1e-10)
        for k, of in enumerate(names):
            size = abs(table[of]).max()
            self.assertLessEqual(abs(rows[:, 2 + k] - table[of]).max(), 1e-10 * size, of)
            self.assertIn(of, said.stdout)
            if k < len(outputs):
                self.assertGreater(size, 0, of)
        closed = table['n_active']
        self.assertLess(closed.min(), closed.max())  # the set of closed contacts changes over the points
        return points, names

    def difference(self, name):
        """That of the program of NAME.h5 from the model, as the export says."""
        run = self.run_raw('export', '-model', name + '.h5', '-c', name + '.c')
        self.assertEqual(run.returncode, 0, run.stderr)
        return float(run.stdout.split('largest difference from the model ')[1].split()[0])

    def judge_path(self, name, scene, points, level='-O0', most=1e-9, tight=()):
        """The program of a model of paths against predict at each listed time, beside corners of the ranges; returns the outputs by name."""
        with open(self.path(name + '.yaml'), 'w', encoding='ascii') as f:
            f.write(scene)
        self.hyco('train', '-scene', name + '.yaml', '-hyco_model_type', 'bodies', '-scatter', '2', '-hyco_validation', '0', '-model', name + '.h5')
        said = self.run_raw('export', '-model', name + '.h5', '-c', name + '.c')
        self.assertEqual((said.returncode, said.stderr), (0, ''))
        self.compiled(name, STEP, level)
        names, rows = self.ran(name, points)
        self.assertFalse(rows[:, 0].any())
        self.assertLess(rows[:, 1].max(), 1e-10)
        history = [self.hyco('predict', '-model', name + '.h5', '-mu', ','.join(map(repr, p)), *tight)['history'] for p in points]
        outputs = {of: np.concatenate([h['outputs'][of] for h in history]) for of in history[0]['outputs']}
        for of, values in outputs.items():
            self.assertGreater(abs(values).max(), 0, of)
            self.assertLessEqual(abs(rows[:, 2 + names.index(of)] - values).max(), most * abs(values).max(), of)
        return {of: rows[:, 2 + k] for k, of in enumerate(names)}

    def test_paths(self):
        """Steps of paths: with friction in 2D, of a body that nothing else holds, in 3D, and without; the state alone goes from step to step."""
        grids(self.folder)
        held = self.judge_path('held', HELD, ((0.4, 1.3, 0.22, 1.7, 0.93), (0.31, 1.9, 0.25, 2.9, 1.08)), '-O1')
        self.assertGreater(held['W'][5], 0)
        self.assertLess(held['T'].min(), 0)
        turned = self.judge_path('round', ROUND.replace('KIND', 'mortar'), ((0.22, 1.7, 0.0), (0.11, 0.4, 0.0017)))
        self.assertGreater(turned['W'][4], 0)
        lifted = self.judge_path('lifted', LIFTED, ((0.4, 1.3, 0.22, 1.7, 1.02),))
        self.assertGreater(lifted['N'].max(), 0)

    def test_flows(self):
        """Bodies that creep, two laws in 3D with friction, or yield, again after unloading: the steps of predict, its outputs to 1e-8. No variables."""
        grids(self.folder)
        tight = {'most': 1e-8, 'tight': ('-hyco_newton_rtol', '1e-12')}  # what Newton's method leaves adds up over the steps
        creeps = self.judge_path('heated', HEATED, ((7.0, 1.4),), **tight)
        self.assertLess(creeps['S'][3], 0.9 * creeps['S'][1])
        yields = self.judge_path('yielding', YIELDING, ((1.9, 0.83),), **tight)
        self.assertGreater(yields['peak'][4], 1e-2 * yields['peak'].max())  # what is left without loads
        self.assertNotRegex(subprocess.run(['nm', self.path('yielding.o')], capture_output=True, text=True, check=True).stdout, r' [bBC] ')

    def test_floating(self):
        """A block that contact alone holds, under a load that varies in space with the parameters, heated; each kind of output; a state outside the ranges is said."""
        with open(self.path('float.yaml'), 'w', encoding='ascii') as f:
            f.write(FLOATING)
        points, names = self.judge('floating', self.path('float.yaml'),
                                   ['peak', 'sink', 'corner', 'spread', 'base', 'turn', 'most', 'least', 'tension', 'hoop'], '-O1')
        mu = points[0].copy()
        for value, status in ((2, 0), (4.001, 1), (float('nan'), 2), (float('inf'), 2)):
            mu[0] = value
            self.assertEqual(self.ran('floating', [mu])[1][0, 0], status)
        with open(self.path('floating.h'), encoding='ascii') as f:
            self.assertIn(f'{names.index("under.force_y")} under.force_y N/mm', f.read())
        self.assertEqual(subprocess.run(['nm', '-g', '--defined-only', self.path('floating.o')], capture_output=True, text=True, check=True)
                         .stdout.count(' floating_'), 8)  # no other names
        self.assertNotRegex(subprocess.run(['nm', self.path('floating.o')], capture_output=True, text=True, check=True).stdout, r' [bBC] ')  # no variables

    def test_pad(self):
        """3D: an opening gap under a body that a map without parameters places, a modulus with a kink, a pressure by a constant of the scene."""
        self.drawn('drawn_pad', 3, PAD[1], PAD[0])
        self.judge('pad', self.path('drawn_pad'), ['stress', 'push', 'mean', 'area'])

    def test_punch(self):
        """A body of revolution with a gap, a given displacement, a pressure and the logarithm of a modulus as parameters."""
        self.drawn('drawn_punch', 2, PUNCH[1], PUNCH[0])
        self.judge('punch', self.path('drawn_punch'), ['deep', 'hard', 'hoop', 'base'])

    def test_turning(self):
        """3D: a pad that contact alone holds travels and turns on a plate, past its edge: the program searches the masters itself, and turns the bodies."""
        self.drawn('drawn_turn', 3, TURN[1], TURN[0])
        self.judge('turn', self.path('drawn_turn'), ['stress', 'push', 'mean', 'sink', 'along', 'roll', 'touch'])
        # hardly turned, so that a component of the force is round-off by symmetry
        straight = ('-scene', self.path('drawn_turn'), '-parameter_turn_range', '-1e-14,1e-14')
        self.hyco('train', *straight, '-hyco_model_type', 'bodies', '-scatter', '2', '-model', 'straight.h5')
        self.assertEqual(self.run_raw('export', '-model', 'straight.h5', '-c', 'straight.c').stderr, '')

    def test_shape(self):
        """2D: the radius of a tool that travels over a plate, to beyond its edge, whose end is drawn aside: flexibilities between samples, moved normals and areas."""
        self.drawn('drawn_shape', 2, SHAPE[1], SHAPE[0])
        self.judge('shape', self.path('drawn_shape'), ['force', 'hold', 'most', 'stress', 'sink', 'touch'])
        # two parameters of its shape, under a load
        scene = SHAPE[0]
        for old, new in (('push]', 'push, tall]'), ('radius: {range: [3, 6]}', 'radius: {range: [5, 6]}, tall: {range: [1, 1.1]}'), ('"y + x^2', '"y*tall + x^2'),
                         (', y: -push}}', '}}\npressure: {grip: 100*push}'), ('reaction: y, group: grip', 'reaction: x, group: grip')):
            self.assertIn(old, scene)
            scene = scene.replace(old, new)
        with open(self.path('drawn_shape', 'two.yaml'), 'w', encoding='ascii') as f:
            f.write(scene)
        self.hyco('train', '-scene', self.path('drawn_shape', 'two.yaml'), '-hyco_model_type', 'bodies', '-scatter', '2', '-hyco_validation', '0', '-model', 'two.h5')
        self.assertLess(self.difference('two'), 1e-9)

    def test_displaced(self):
        """Four parameters of given displacements that vary in space on a body that turns by a small angle: found whatever the number of expressions."""
        with open(self.path('displaced.yaml'), 'w', encoding='ascii') as f:
            f.write(DISPLACED)
        self.hyco('train', '-scene', 'displaced.yaml', '-hyco_model_type', 'bodies', '-scatter', '12', '-hyco_validation', '0', '-model', 'displaced.h5')
        self.assertLess(self.difference('displaced'), 1e-11)

    def test_refused(self):
        """One line names what cannot be exported, and no file is written."""
        roller = ('-scene', os.path.join(SOURCE, 'examples', 'roller'))
        self.hyco('train', *roller, '-contact_under_gap', '0.01', '-hyco_model_type', 'bodies', '-scatter', '2', '-model', 'given.h5')
        self.hyco('train', '-scene', ROPE, '-grid', '4,5', '-model', 'hybrid.h5')
        grids(self.folder)
        with open(self.path('flows.yaml'), 'w', encoding='ascii') as f:
            f.write(HELD.replace('young: 1000/soft', 'law: norton, young: 1000, rate: 1e-4*soft, exponent: 2').replace('times: [0, 1, 2, 3, 4, 5]', 'times: [0, 0.5, 1]'))
        self.hyco('train', '-scene', 'flows.yaml', '-hyco_model_type', 'bodies', '-scatter', '2', '-hyco_validation', '0', '-model', 'flows.h5', '-hyco_snapshots', 'flows')
        with open(self.path('free.yaml'), 'w', encoding='ascii') as f:
            f.write(FREE)
        self.hyco('train', '-scene', 'free.yaml', '-hyco_model_type', 'bodies', '-scatter', '2', '-hyco_validation', '0', '-model', 'free.h5')
        for words, args in ((('motion', 'free', 'ranges'), ('-model', 'free.h5', '-c', 'no.c')), (('block', 'creeps', 'shape'), ('-model', 'flows.h5', '-c', 'no.c')), (('under', 'gap', 'travel'), ('-model', 'given.h5', '-c', 'no.c')),
                            (('hybrid', 'bodies'), ('-model', 'hybrid.h5', '-c', 'no.c')), (('-c', '.c'), ('-model', 'given.h5', '-c', 'no.txt')),
                            (('-c',), ('-model', 'given.h5'))):
            run = self.run_raw('export', *args)
            self.assertEqual((run.returncode, len(run.stderr.strip().splitlines())), (1, 1), run.stderr)
            for word in words:
                self.assertIn(word, run.stderr)
            self.assertFalse([f for f in os.listdir(self.folder) if f.startswith('no.')])

    def test_existing(self):
        """A file of another origin is not overwritten, neither FILE.c nor FILE.h; own ones are. A gap that a parameter closes just so presses nothing without loads."""
        self.hyco('train', '-scene', os.path.join(SOURCE, 'examples', 'pellet'), '-hyco_model_type', 'bodies', '-scatter', '2', '-hyco_validation', '0', '-model', 'pellet.h5')
        for name in ('mine.h', 'mine.c'):
            with open(self.path(name), 'w', encoding='ascii') as f:
                f.write('int mine;\n')
            run = self.run_raw('export', '-model', 'pellet.h5', '-c', 'mine.c')
            self.assertEqual((run.returncode, len(run.stderr.strip().splitlines())), (1, 1), run.stderr)
            self.assertIn(name, run.stderr)
            with open(self.path(name), encoding='ascii') as f:
                self.assertEqual(f.read(), 'int mine;\n')
            os.remove(self.path(name))
        for _ in range(2):
            self.assertEqual(self.run_raw('export', '-model', 'pellet.h5', '-c', 'mine.c').stderr, '')


if __name__ == '__main__':
    unittest.main()
