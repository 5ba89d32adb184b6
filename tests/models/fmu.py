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
from export import PAD

WARNING, ERROR = 1, 3
FMPY = os.environ.get('HYCO_FMPY', sys.executable)
SIMULATE = """import json, sys, fmpy, numpy as np
from fmpy.validation import validate_fmu
assert validate_fmu(sys.argv[1]) == []
ramp = np.array([(0, 0.01), (1, 0.05)], dtype=[('time', 'f8'), ('press', 'f8')])
r = fmpy.simulate_fmu(sys.argv[1], start_values={'lift': 0.0, 'soft': 1.2, 'weight': 0.0}, input=ramp, stop_time=1, output_interval=0.25)
print(json.dumps([r[k].tolist() for k in ('push', 'kkt_residual')]))
"""


class FMU(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drawn('drawn_pad', 3, PAD[1], PAD[0])
        cls.hyco('train', '-scene', cls.path('drawn_pad'), '-hyco_model_type', 'bodies', '-scatter', '2', '-model', 'pad.h5')
        cls.run_raw('predict', '-model', 'pad.h5', '-scatter', '20', '-table', 't.h5')
        with h5py.File(cls.path('t.h5')) as t:
            cls.table = {key: np.array(t[key]) for key in t}
        cls.made = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'fmu'), 'pad.h5', 'pad.fmu'], cwd=cls.folder, env={**os.environ, 'HYCO': HYCO},
                                  capture_output=True, text=True, timeout=60 * PATIENCE, check=False)
        with zipfile.ZipFile(cls.path('pad.fmu')) as f:
            f.extractall(cls.path('fmu'))
        cls.root = xml.parse(cls.path('fmu', 'modelDescription.xml')).getroot()

    def test_functions(self):
        """An importer by ctypes: inputs and outputs of modelDescription.xml, steps, a wrong token, a value outside the ranges, unknown variables."""
        self.assertEqual((self.made.returncode, self.made.stderr), (0, ''))
        lib = ctypes.CDLL(glob.glob(self.path('fmu', 'binaries', '*', 'pad.*'))[0])
        lib.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
        said = []
        log = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(lambda _, status, __, text: said.append((status, text.decode())))

        def instantiate(token):
            return lib.fmi3InstantiateCoSimulation(b'pad', token.encode(), None, False, False, False, False, None, ctypes.c_size_t(0), None, log, None)

        self.assertIsNone(instantiate('another'))
        instance = ctypes.c_void_p(instantiate(self.root.get('instantiationToken')))
        self.assertTrue(instance)
        found = {kind: [(v.get('name'), int(v.get('valueReference'))) for v in self.root.find('ModelVariables') if v.get('causality') == kind]
                 for kind in ('input', 'output')}

        def move(function, references, values):
            n = len(references)
            data = (ctypes.c_double * n)(*values)
            return function(instance, (ctypes.c_uint32 * n)(*references), ctypes.c_size_t(n), data, ctypes.c_size_t(n)), list(data)

        inputs, outputs = ([r for _, r in found[kind]] for kind in ('input', 'output'))
        self.assertEqual(lib.fmi3EnterInitializationMode(instance, False, ctypes.c_double(0), ctypes.c_double(0), False, ctypes.c_double(0)), 0)
        self.assertEqual(lib.fmi3ExitInitializationMode(instance), 0)
        last = ctypes.c_double()
        flags = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
        for k in range(20):
            self.assertEqual(move(lib.fmi3SetFloat64, inputs, [self.table[name][k] for name, _ in found['input']])[0], 0)
            self.assertEqual(lib.fmi3DoStep(instance, ctypes.c_double(k), ctypes.c_double(1), True, *flags, ctypes.byref(last)), 0)
            self.assertEqual(last.value, k + 1)
            status, values = move(lib.fmi3GetFloat64, outputs, [0] * len(outputs))
            self.assertEqual(status, 0)
            for (name, _), value in zip(found['output'][:-1], values):
                self.assertLessEqual(abs(value - self.table[name][k]), 1e-10 * abs(self.table[name]).max(), name)
            self.assertLess(values[-1], 1e-10)
        self.assertEqual(said, [])
        move(lib.fmi3SetFloat64, inputs[:1], [9.0])
        self.assertEqual(move(lib.fmi3GetFloat64, outputs[:1], [0])[0], WARNING)
        self.assertEqual(move(lib.fmi3SetFloat64, outputs[:1], [0])[0], ERROR)
        before = move(lib.fmi3GetFloat64, inputs, [0] * len(inputs))[1]
        self.assertEqual(move(lib.fmi3SetFloat64, [inputs[0], outputs[0]], [before[0] + 1, 0])[0], ERROR)  # all or none is set
        self.assertEqual(move(lib.fmi3GetFloat64, inputs, [0] * len(inputs))[1], before)
        self.assertEqual([status for status, _ in said], [WARNING, ERROR, ERROR])
        self.assertIn('range', said[0][1])
        lib.fmi3FreeInstance(instance)

    def test_importer(self):
        """fmpy finds no fault in it, and simulates it: an input that grows with the time."""
        if subprocess.run([FMPY, '-c', 'import fmpy'], capture_output=True, check=False).returncode:
            self.skipTest('HYCO_FMPY names no Python with fmpy')
        run = subprocess.run([FMPY, '-c', SIMULATE, 'pad.fmu'], cwd=self.folder, capture_output=True, text=True, timeout=60 * PATIENCE, check=True)
        push, kkt = json.loads(run.stdout.splitlines()[-1])
        self.assertEqual(len(push), 5)
        self.assertLess(max(kkt), 1e-10)
        again = self.hyco('predict', '-model', 'pad.h5', '-mu_lift', '0', '-mu_soft', '1.2', '-mu_weight', '0', '-mu_press', '0.04')
        self.near(push[-1], again['outputs']['push'], 1e-9)  # the input at the beginning of the last step


if __name__ == '__main__':
    unittest.main()
