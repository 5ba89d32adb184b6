"""scripts/plot: pictures of solutions in 1D, 2D and 3D, of a path and a study, with and without zoom: written, small, not blank; errors give one
line."""
import csv
import os
import subprocess
import sys
import unittest

from common import PATIENCE, ROPE, SOURCE, Case

PLOT = os.path.join(SOURCE, 'scripts', 'plot')
EXAMPLES = os.path.join(SOURCE, 'examples')


class Plot(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('solve', '-scene', os.path.join(EXAMPLES, 'hertz'), '-mu', '0.06,1,10', '-output', 'hertz.xdmf', '-scene_unit_stress', 'MPa')
        cls.hyco('solve', '-scene', os.path.join(EXAMPLES, 'pellet'), '-mu', '4.06,1', '-output', 'pellet.xdmf')
        cls.hyco('solve', '-scene', os.path.join(EXAMPLES, 'ring'), '-mu', '0.01,1', '-history_times', '0,1,2', '-output', 'ring.xdmf')
        cls.hyco('solve', '-scene', ROPE, '-grid', '4,5', '-table', 'study.csv', '-output', 'points.xdmf')

    def plot(self, *args, status=0):
        """Runs the script; of an error its line."""
        run = subprocess.run([sys.executable, PLOT, *args], cwd=self.folder, capture_output=True, text=True, timeout=60 * PATIENCE)
        self.assertEqual(run.returncode, status, f'{args}: {run.stdout}{run.stderr}')
        if status:
            self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
        return run.stderr

    def test_pictures(self):
        """Every kind of picture is drawn."""
        from PIL import Image
        for k, args in enumerate((['solution', 'hertz.h5'], ['solution', 'hertz.h5', '--zoom', 'contact', '--field', 'nodal_mises'],
                                  ['solution', 'pellet.h5'], ['solution', 'pellet.h5', '--zoom', 'contact', '--field', 'principal_stress', '--component', '3'],
                                  ['solution', 'ring.h5', '--step', '1', '--field', 'inelastic', '--scale', '20', '--no-pressure'],
                                  ['solution', 'points.h5', '--step', '3'], ['compare', 'pellet.h5', 'pellet.h5', '--field', 'displacement'],
                                  ['study', 'study.csv', '--x', 'mu2', '--y', 'lambda_max', '--colour', 'mu1'])):
            name = f'{k}.png'
            self.plot(*args, '-o', name)
            self.assertLess(os.path.getsize(self.path(name)), 200000, args)
            with Image.open(self.path(name)) as picture:
                self.assertGreater(len(picture.convert('RGB').getcolors(1 << 24)), 20, args)

    def test_contacts(self):
        """Contact nodes: a row for each slave in order along the surface, forces that add up to the report's; one line for each contact; named in refusals."""
        report = self.hyco('solve', '-scene', os.path.join(EXAMPLES, 'blocks'), '-mu', '0.05,0.05', '-output', 'blocks.xdmf')
        self.plot('contacts', 'blocks.h5', '-o', 'blocks.csv')
        with open(self.path('blocks.csv'), encoding='utf-8') as f:
            rows = list(csv.DictReader(f))
        along = [float(row['along']) for row in rows]
        self.assertEqual(along, sorted(along))
        self.assertEqual({row['contact'] for row in rows}, {'under'})
        self.assertEqual(len(rows), report['contacts']['under']['n'])
        for axis, force in zip('xy', report['contacts']['under']['force']):
            self.near(sum(float(row['force_' + axis]) for row in rows), force, 1e-9)
        self.near(max(float(row['pressure']) for row in rows), report['contacts']['under']['pressure_max'], 1e-9)
        self.assertEqual([float(row['pressure']) > 0 for row in rows], [float(row['gap']) < 1e-9 for row in rows])
        for k, name in enumerate(('blocks.h5', 'pellet.h5')):
            self.plot('contacts', name, '-o', f'c{k}.png')
            self.assertGreater(os.path.getsize(self.path(f'c{k}.png')), 3000)
        self.assertIn('contacts are under', self.plot('contacts', 'blocks.h5', '--contact', 'top', '-o', 'no.csv', status=1))
        self.assertFalse(os.path.exists(self.path('no.csv')))

    def test_refused(self):
        """Fields, components and times that a file does not have are named."""
        for words, *args in (('it has xx, xy', 'solution', 'hertz.h5', '--field', 'stress', '--component', 'q'), ('there is no field heat', 'solution', 'hertz.h5', '--field', 'heat'),
                             ('the times 0 to', 'solution', 'ring.h5', '--step', '7'), ('takes lowest and highest', 'solution', 'hertz.h5', '--zoom', '1,0,0,1'),
                             ('contact surfaces: 1', 'solution', 'pellet.h5', '--surface', '2'), ('beside an .xdmf', 'solution', 'pellet.vtkhdf'),
                             ('no column hoop', 'study', 'study.csv', '--y', 'hoop'),
                             ('no table', 'study', 'hertz.xdmf')):
            self.assertIn(words, self.plot(*args, '-o', 'no.png', status=1), args)
        self.assertFalse(os.path.exists(self.path('no.png')))


if __name__ == '__main__':
    unittest.main()
