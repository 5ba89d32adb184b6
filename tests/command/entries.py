"""Entries of a scene and the messages for invalid ones: repeated keys, too many, long expressions, values with a dash; sources of options."""
import json
import os
import resource
import shutil
import subprocess
import unittest
import xml.etree.ElementTree

from common import HYCO, PATIENCE, ROPE, SOURCE, Case

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
POINT = ('-mu', '0.05,0.06')


class Entries(Case):
    def setUp(self):
        shutil.rmtree(self.path('scene'), ignore_errors=True)
        shutil.copytree(BLOCKS, self.path('scene'))
        with open(self.path('scene', 'scene.yaml'), encoding='utf-8') as f:
            self.text = f.read()

    def write(self, text):
        with open(self.path('scene', 'scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)

    def refused(self, *words, args=('view', '-scene', 'scene'), **options):
        run = self.run_raw(*args, **options)
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
        for word in words:
            self.assertIn(word, run.stderr)

    def test_twice(self):
        """In a mapping, in braces, over sections, in two spellings of one entry, in another letter case."""
        for old, new, key, lines in (('    poisson: 0.3\n', '    poisson: 0.3\n    poisson: 0.4\n', 'body_block_poisson', (12, 13)),
                                     ('{young: 1e5, poisson: 0.3}', '{young: 1e5, poisson: 0.3, young: 2e5}', 'body_foundation_young', (14, 14)),
                                     ('  rid_layers: 1\n', '  rid_layers: 1\nbody:\n  block: {young: 3}\n', 'body', (9, 31)),
                                     ('  foundation:', '  block_young: 7\n  foundation:', 'body_block_young', (11, 14)),
                                     ('{young: 1e5, poisson: 0.3}', '{young: 1e5, "Young": 2}', 'body_foundation_Young', (14, 14))):
            with self.subTest(new=new):
                self.assertIn(old, self.text)
                self.write(self.text.replace(old, new, 1))
                self.refused('scene.yaml', f'{key} occurs twice', f'in line {lines[0]} and in line {lines[1]}')
                self.refused(f'{key} occurs twice', args=('solve', '-scene', 'scene', *POINT), ranks=2)

    def test_long_keys(self):
        """Two keys that differ after the first thousand characters are not repeated; their length is named."""
        group, key = 'k' * 480, 'k' * 600  # PETSc and libyaml take these
        self.write(self.text.replace('  foundation:', f'  {group}:\n    {key}a: 1\n    {key}b: 2\n  foundation:', 1))
        self.refused('scene.yaml', 'the key in line 15 is longer than')

    def test_not_twice(self):
        """Quotes, comments, block scalars, lists, and the same name in two places are no repetition."""
        self.write(self.text.replace('scene:\n', '%YAML 1.1\n---\nscene:  # scene: {title: x}\n', 1).replace(
            'title: block with a crowned underside on a foundation, right half',
            'title: |\n    mesh: no\n    mesh: no\n\n    young: "\n').replace('parameters: [crown, press]', 'parameters:\n  - crown\n  - press'))
        run = self.run_raw('view', '-scene', 'scene')
        self.assertEqual(run.returncode, 0, run.stderr)
        for example in ('rope', 'pellet', 'plate', 'blocks'):
            self.assertEqual(self.run_raw('view', '-scene', os.path.join(SOURCE, 'examples', example)).returncode, 0)

    def test_too_many(self):
        """More parameters or loads than a scene may have are refused."""
        names = [f'p{k}' for k in range(33)]
        self.write(self.text.replace('[crown, press]', f'[{", ".join(names)}]'))
        self.refused('lists 33 parameters; a scene has at most 32')
        loads = ''.join(f'  group{k}: 1\n' for k in range(600))
        self.write(self.text + 'pressure:\n' + loads)
        run = self.run_raw('view', '-scene', 'scene')
        self.assertEqual(run.returncode, 1)  # PETSc keeps 512 before it learned to grow
        self.assertRegex(run.stderr, 'more than 512 entries|the mesh has no group "group0"')

    def test_long_expression(self):
        """The message contains the reason however long the expression is."""
        long = ' + '.join(f'{k}*x' for k in range(400))
        for value, words in ((long + ' + ) 1', 'is not an expression: '), (long + ' + nosuch', 'uses nosuch, which is unknown'),
                             (long + ' + 1/(x - x)', 'is not finite at x =')):
            self.write(self.text.replace('young: 2e5', f'young: "{value}"'))  # 4 kB
            self.refused('body_block_young', words, args=('solve', '-scene', 'scene', *POINT))

    def test_dash(self):
        """A value that begins with a dash and a letter: in scene.yaml as it is, on the command line after a blank."""
        expected = self.hyco('solve', '-scene', 'scene', *POINT)['total_contact_force']
        self.near(self.hyco('solve', '-scene', 'scene', *POINT, '-fixed_block_top_y', ' -press')['total_contact_force'], expected, 1e-12)
        self.refused('-press follows -fixed_block_top_y, which expects a value', 'a blank first, -fixed_block_top_y " -press"',
                     args=('solve', '-scene', 'scene', *POINT, '-fixed_block_top_y', '-press'))

    def test_xml(self):
        """The names of an output are XML, whatever is in them."""
        name = 'a&b<c>"d\'.xdmf'
        self.hyco('solve', '-scene', 'scene', *POINT, '-output', name)
        items = xml.etree.ElementTree.parse(self.path(name)).iter('DataItem')
        self.assertEqual({item.text.split(':/')[0] for item in items}, {'a&b<c>"d\'.h5'})

    def test_options_from(self):
        """Options that are not on the command line are in the report, and nothing if there are none."""
        def report(*args, **environment):
            run = subprocess.run([HYCO, 'solve', '-scene', ROPE, '-mu', '0.07,0.17', '-report', 'r.json', *args], cwd=self.folder,
                                 env={**os.environ, 'HOME': self.path('home'), **environment}, capture_output=True, text=True, check=False,
                                 timeout=100 * PATIENCE)
            self.assertEqual(run.returncode, 0, run.stderr)
            with open(self.path('r.json'), encoding='utf-8') as f:
                return json.load(f).get('options_from')

        os.makedirs(self.path('home'), exist_ok=True)
        self.assertIsNone(report())
        self.assertEqual(report(PETSC_OPTIONS='-hyco_solver_rtol 1e-9'), {'PETSC_OPTIONS': '-hyco_solver_rtol 1e-9'})
        for name, args in (('.petscrc', ()), ('my.options', ('-options_file', 'my.options'))):
            with open(self.path(name), 'w', encoding='ascii') as f:
                f.write('-hyco_solver_rtol 1e-7\n')
            try:
                self.assertEqual(report(*args), {name: '-hyco_solver_rtol 1e-7\n'})
                if name == '.petscrc':
                    self.assertIsNone(report('-skip_petscrc'))
            finally:
                os.remove(self.path(name))

    def test_petsc_options(self):
        """Options of PETSc: those that no solver in hyco has are refused before a solve, in each command; those that only this run does not read after
        its results are written. PETSc's own, prefixes, the environment and a scene's options of solvers behave as in PETSc."""
        shutil.copytree(ROPE, self.path('rope'), dirs_exist_ok=True)
        solve, grid = ('solve', '-scene', 'rope', '-mu', '0.07,0.17', '-report', 'r.json'), ('-scene', 'rope', '-grid', '3,3')

        def run(args, *more, status=0, word='', written=True, **environment):
            if os.path.exists(self.path('r.json')):
                os.remove(self.path('r.json'))
            done = subprocess.run([HYCO, *args, *more], cwd=self.folder, env={**os.environ, 'HOME': self.path('home'), **environment}, capture_output=True,
                                  text=True, check=False, timeout=100 * PATIENCE)
            self.assertEqual(done.returncode, status, (more, done.stderr))
            self.assertEqual(done.stderr.count('hyco: error'), status, done.stderr)
            self.assertIn(word, done.stdout + done.stderr)
            self.assertEqual(os.path.exists(self.path('r.json')), written, more)
            return done.stdout

        for option in ('-ksp_monitor', '-tao_monitor', '-hyco_tao_foo', '-hyco_mumps_icntl_99', '-hyco_primal_ksp_foo'):
            run(solve, option, status=1, word=option, written=False)
        for option in ('-hyco_tao_foo', '-hyco_mumps_icntl_99'):
            run(('train', *grid, '-model', 'm.h5', '-report', 'r.json'), option, '3', status=1, word=option, written=False)
            run(('check', *grid, '-report', 'r.json'), option, '3', status=1, word=option, written=False)
            self.assertFalse(os.path.exists(self.path('m.h5')))
        run(solve, '-hyco_mumps_icntl_14', '90', status=1, word='-hyco_mumps_icntl_14')  # a small matrix: no MUMPS
        run(('check', *grid, '-report', 'r.json'), '-hyco_mumps_icntl_14', '90')
        run(solve, '-options_view', word='-mu 0.07,0.17')
        run(solve, '-options_left', word='no unused options')
        run(solve, '-citations', word='petsc')
        run(solve, '-fp_trap')
        run(solve, '-prefix_push', 'hyco_solver_', '-max_its', '50', '-prefix_push', 'warm_', '-start', '0', '-prefix_pop', '-prefix_pop')
        run(solve, '-prefix_push', 'hyco_solver_', '-maxits', '5', '-prefix_pop', status=1, word='-hyco_solver_max_its', written=False)
        run(solve, PETSC_OPTIONS='-ksp_monitor -hyco_pod_svd_view')
        run(solve, PETSC_OPTIONS='-hyco_pod_tool 1', status=1, word='hyco_pod_tool', written=False)
        run(solve, '-hyco_solver_view', 'foo:bar', status=1, word='-hyco_solver_view', written=False)
        run(solve, '-hyco_tao_type', 'tron', '-hyco_tao_ksp_monitor', '-hyco_solver_form', 'dual', word='Residual norm')
        run(solve, '-hyco_tao_type', 'gpcg', '-hyco_tao_ksp_type', 'stcg', '-hyco_solver_form', 'dual')
        run(solve, '-hyco_tao_type', 'gpcg', '-hyco_tao_ksp_type', 'foo', '-hyco_solver_form', 'dual', status=1, word='foo', written=False)
        with open(self.path('rope', 'scene.yaml'), 'a', encoding='utf-8') as file:
            file.write('hyco: {mumps_icntl_14: 100}\n')
        run(solve)
        with open(self.path('rope', 'scene.yaml'), 'a', encoding='utf-8') as file:
            file.write('hyco_mumps_icntl_99: 1\n')
        run(solve, status=1, word='hyco_mumps_icntl_99', written=False)

    def test_little_memory(self):
        """Too little address space for BLAS: a clear error, where OpenBLAS would try without end. The amount depends on the libraries."""
        failed = 0
        for megabytes in (400, 320, 250, 190, 140):
            def limit(size=megabytes << 20):
                resource.setrlimit(resource.RLIMIT_AS, (size, size))

            run = subprocess.run([HYCO, 'solve', '-scene', ROPE, '-mu', '0.07,0.17'], cwd=self.folder, preexec_fn=limit, capture_output=True,
                                 text=True, timeout=60 * PATIENCE, check=False)
            failed += run.returncode != 0
            if run.returncode:
                self.assertTrue(run.stderr.strip())
        self.assertTrue(failed)


if __name__ == '__main__':
    unittest.main()
