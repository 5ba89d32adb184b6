"""scripts/fmu: the model as an FMU has predict's results through the functions of FMI 3.0, says what is outside the ranges, and is simulated by fmpy where that
is installed."""
import ctypes
import glob
import json
import os
import subprocess
import sys
import unittest
import xml.etree.ElementTree as xml
import zipfile

import h5py
import numpy as np

from common import HYCO, PATIENCE, SOURCE, Case
from export import CREEPING, PAD, grids

WARNING, DISCARD, ERROR = 1, 2, 3
FMPY = os.environ.get('HYCO_FMPY', sys.executable)
SIMULATE = """import json, sys, fmpy, numpy as np
from fmpy.validation import validate_fmu
assert validate_fmu(sys.argv[1]) == []
ramp = np.array([(0, 0.01), (1, 0.05)], dtype=[('time', 'f8'), ('press', 'f8')])
r = fmpy.simulate_fmu(sys.argv[1], start_values={'lift': 0.0, 'soft': 1.2, 'weight': 0.0}, input=ramp, stop_time=1, output_interval=0.25)
assert validate_fmu('held.fmu') == []
path = fmpy.simulate_fmu('held.fmu', start_values=json.loads(sys.argv[2]), output_interval=1)
print(json.dumps([r[k].tolist() for k in ('push', 'kkt_residual')] + [path['W'].tolist()]))
"""


class Importer:
    """The functions of an FMU that is unpacked in a folder, by ctypes; `said` has the messages of its log."""

    def __init__(self, folder):
        root = xml.parse(os.path.join(folder, 'modelDescription.xml')).getroot()
        self.lib, self.token, self.said = ctypes.CDLL(glob.glob(os.path.join(folder, 'binaries', '*', '*'))[0]), root.get('instantiationToken'), []
        self.lib.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
        self.log = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(
            lambda _, status, __, text: self.said.append((status, text.decode())))
        self.variables = {kind: {v.get('name'): int(v.get('valueReference')) for v in root.find('ModelVariables') if v.get('causality') == kind}
                          for kind in ('input', 'output')}

    def instantiate(self, token):
        return self.lib.fmi3InstantiateCoSimulation(b'model', token.encode(), None, False, False, False, False, None, ctypes.c_size_t(0), None, self.log, None)

    def start(self, inputs):
        self.instance = ctypes.c_void_p(self.instantiate(self.token))
        self.set(inputs)
        return [self.lib.fmi3EnterInitializationMode(self.instance, False, ctypes.c_double(0), ctypes.c_double(0), False, ctypes.c_double(0)),
                self.lib.fmi3ExitInitializationMode(self.instance)]

    def move(self, function, references, values):
        n = len(references)
        data = (ctypes.c_double * n)(*values)
        return function(self.instance, (ctypes.c_uint32 * n)(*references), ctypes.c_size_t(n), data, ctypes.c_size_t(n)), list(data)

    def set(self, inputs):
        return self.move(self.lib.fmi3SetFloat64, [self.variables['input'][name] for name in inputs], inputs.values())[0]

    def get(self, kind='output'):
        status, values = self.move(self.lib.fmi3GetFloat64, list(self.variables[kind].values()), [0] * len(self.variables[kind]))
        return status, dict(zip(self.variables[kind], values))

    def step(self, time, step):
        last, flags = ctypes.c_double(), [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
        status = self.lib.fmi3DoStep(self.instance, ctypes.c_double(time), ctypes.c_double(step), True, *flags, ctypes.byref(last))
        return status, last.value


class FMU(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drawn('drawn_pad', 3, PAD[1], PAD[0])
        cls.hyco('train', '-scene', cls.path('drawn_pad'), '-hyco_model_type', 'bodies', '-scatter', '2', '-model', 'pad.h5')
        cls.run_raw('predict', '-model', 'pad.h5', '-scatter', '20', '-table', 't.h5')
        with h5py.File(cls.path('t.h5')) as t:
            cls.table = {key: np.array(t[key]) for key in t}
        grids(cls.folder)
        with open(cls.path('held.yaml'), 'w', encoding='ascii') as f:
            f.write(CREEPING)
        cls.hyco('train', '-scene', 'held.yaml', '-hyco_model_type', 'bodies', '-scatter', '2', '-hyco_validation', '0', '-hyco_snapshots', 'held', '-model', 'held.h5')
        cls.point = {'m': 0.4, 'press': 1.3, 'push': 0.22, 'soft': 1.7}
        cls.history = cls.hyco('predict', '-model', 'held.h5', '-mu', ','.join(map(repr, cls.point.values())))['history']['outputs']
        for name in ('pad', 'held'):
            made = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'fmu'), name + '.h5', name + '.fmu'], cwd=cls.folder, env={**os.environ, 'HYCO': HYCO},
                                  capture_output=True, text=True, timeout=60 * PATIENCE, check=False)
            assert (made.returncode, made.stderr) == (0, ''), made.stderr
            with zipfile.ZipFile(cls.path(name + '.fmu')) as f:
                f.extractall(cls.path(name))

    def test_functions(self):
        """An importer by ctypes: inputs and outputs of modelDescription.xml, steps, a wrong token, a value outside the ranges, unknown variables."""
        of = Importer(self.path('pad'))
        self.assertIsNone(of.instantiate('another'))
        self.assertEqual(of.start({}), [0, 0])
        inputs, outputs = (list(of.variables[kind].values()) for kind in ('input', 'output'))
        for k in range(20):
            self.assertEqual(of.set({name: self.table[name][k] for name in of.variables['input']}), 0)
            self.assertEqual(of.step(k, 1), (0, k + 1))
            status, values = of.get()
            self.assertEqual(status, 0)
            self.assertLess(values.pop('kkt_residual'), 1e-10)
            for name, value in values.items():
                self.assertLessEqual(abs(value - self.table[name][k]), 1e-10 * abs(self.table[name]).max(), name)
        self.assertEqual(of.said, [])
        of.move(of.lib.fmi3SetFloat64, inputs[:1], [9.0])
        self.assertEqual(of.get()[0], WARNING)
        self.assertEqual(of.move(of.lib.fmi3SetFloat64, outputs[:1], [0])[0], ERROR)
        before = of.get('input')[1]
        self.assertEqual(of.move(of.lib.fmi3SetFloat64, [inputs[0], outputs[0]], [1, 0])[0], ERROR)  # all or none is set
        self.assertEqual(of.get('input')[1], before)
        self.assertEqual([status for status, _ in of.said], [WARNING, ERROR, ERROR])
        self.assertIn('range', of.said[0][1])
        of.lib.fmi3FreeInstance(of.instance)

    def test_path(self):
        """A path with friction and creep: the state goes from step to step, inputs belong to the next one, a step without a solution leaves all as it was."""
        of = Importer(self.path('held'))
        self.assertEqual(of.start(self.point), [0, 0])
        for k in range(6):
            if k:
                self.assertEqual(of.step(k - 1, 1), (0, k))
            status, values = of.get()
            self.assertEqual(status, 0)
            for name, path in self.history.items():
                self.assertLessEqual(abs(values[name] - path[k]), 1e-8 * max(map(abs, path)), (name, k))
        self.assertEqual(of.set({'push': 0.5}), 0)  # outside the ranges
        self.assertEqual(of.get(), (0, values))
        self.assertEqual(of.step(5, -1), (ERROR, 5))
        self.assertEqual(of.set({'push': float('nan')}), 0)
        self.assertEqual(of.step(5, 1), (DISCARD, 5))
        self.assertEqual(of.get(), (0, values))
        self.assertEqual(of.set({'push': 0.5}), 0)
        self.assertEqual(of.step(5, 1), (WARNING, 6))
        of.lib.fmi3FreeInstance(of.instance)

    def test_importer(self):
        """fmpy finds no fault in them, and simulates them: an input that grows with the time; a path."""
        if subprocess.run([FMPY, '-c', 'import fmpy'], capture_output=True, check=False).returncode:
            self.skipTest('HYCO_FMPY names no Python with fmpy')
        run = subprocess.run([FMPY, '-c', SIMULATE, 'pad.fmu', json.dumps(self.point)], cwd=self.folder, capture_output=True, text=True, timeout=60 * PATIENCE, check=True)
        push, kkt, work = json.loads(run.stdout.splitlines()[-1])
        np.testing.assert_allclose(work, self.history['W'], rtol=1e-8)
        self.assertEqual(len(push), 5)
        self.assertLess(max(kkt), 1e-10)
        again = self.hyco('predict', '-model', 'pad.h5', '-mu_lift', '0', '-mu_soft', '1.2', '-mu_weight', '0', '-mu_press', '0.04')
        self.near(push[-1], again['outputs']['push'], 1e-9)  # the input at the beginning of the last step


if __name__ == '__main__':
    unittest.main()
