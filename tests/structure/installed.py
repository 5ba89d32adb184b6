"""The files installed by cmake --install are sufficient to build the ladder, by pkg-config and by CMake; no private symbol is exported."""
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

from common import PATIENCE, library_path

BUILD = os.path.dirname(os.environ['HYCO'])
SOURCE = os.path.dirname(os.path.realpath(os.path.join(os.environ['HYCO_SOURCE'], 'CMakeLists.txt')))
LADDER = [os.path.basename(name)[:-2] for name in sorted(glob.glob(os.path.join(SOURCE, 'examples', 'ladder', '*.c')))]


def run(*command, **more):
    done = subprocess.run(command, capture_output=True, text=True, timeout=500 * PATIENCE, check=False, **more)
    assert done.returncode == 0, ' '.join(command) + '\n' + done.stdout + done.stderr
    return done.stdout


@unittest.skipIf(os.environ.get('HYCO_SANITIZE') == '1', 'who links the library would want its flags')
class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix='a b ')
        cls.prefix = os.path.join(cls.folder.name, 'prefix')
        run('cmake', '--install', BUILD, '--prefix', cls.prefix)
        if library_path():
            os.environ['LD_LIBRARY_PATH'] = library_path()  # hyco's own library is found without it
        cls.library, = glob.glob(os.path.join(cls.prefix, '**', 'libhyco.so'), recursive=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def found(self, pattern):
        return glob.glob(os.path.join(self.prefix, pattern), recursive=True)

    def predicts(self, program):
        """`program` loads a model of the tests and predicts."""
        model = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4-table.h5')
        self.assertIn('force', run(program, '-model', model, '-points', '3'))

    def test_files(self):
        """Command, headers, manual pages, documents and scripts are installed."""
        for pattern in ('bin/hyco', 'include/hyco.h', 'share/man/man1/hyco.1', 'share/man/man1/hyco-predict.1',
                        'share/bash-completion/completions/hyco', 'share/doc/hyco/LICENSE', 'share/doc/hyco/docs/scenes.md',
                        'share/doc/hyco/docs/tutorial/solution.png', 'share/doc/hyco/scripts/plot', 'share/doc/hyco/scripts/convert', 'share/doc/hyco/scripts/deck.py', 'share/doc/hyco/scripts/keywords.py',
                        'share/doc/hyco/examples/rope/scene.yaml', 'share/hyco/report.schema.json', 'share/doc/hyco/docs/report.schema.json', 'share/doc/hyco/examples/ladder/Makefile'):
            self.assertTrue(self.found(pattern), pattern)
        self.assertFalse(self.found('**/private'))
        self.assertFalse(self.found('**/*impl.h'))
        soname = re.search(r'soname: \[(\S+)\]', run('readelf', '-d', self.library)).group(1)
        self.assertTrue(os.path.exists(os.path.join(os.path.dirname(self.library), soname)))

    def test_fmu(self):
        """The installed scripts/fmu finds the installed command and its wrapper: an FMU of a model of bodies."""
        scene = """scene: {title: bar, mesh: mesh.msh, parameters: [p]}
parameter: {p: {range: [0.25, 1]}}
body: {bar: {young: 1, poisson: 0}}
fixed: {left: {x: 0}}
force: {right: {x: p}}
contact: {stop: {type: obstacle, group: right, normal: {x: 1}, gap: 0.5}}
output: {push: {force: x, contact: stop}}
"""
        sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
        from grids import Grid  # pylint: disable=import-outside-toplevel
        with tempfile.TemporaryDirectory() as folder:
            grid = Grid()
            grid.box('line2', [[0, 0.5, 1]], lambda x: x, 'bar', {'x0': 'left', 'x1': 'right'})
            grid.write(os.path.join(folder, 'mesh.msh'))
            with open(os.path.join(folder, 'scene.yaml'), 'w', encoding='ascii') as f:
                f.write(scene)
            model, fmu = os.path.join(folder, 'm.h5'), os.path.join(folder, 'm.fmu')
            hyco, = self.found('bin/hyco')
            run(hyco, 'train', '-scene', folder, '-hyco_model_type', 'bodies', '-scatter', '2', '-model', model, '-quiet', cwd=folder)
            script, = self.found('share/doc/hyco/scripts/fmu')
            run(sys.executable, script, model, fmu, env={k: v for k, v in os.environ.items() if k != 'HYCO'})
            with zipfile.ZipFile(fmu) as made:
                self.assertIn('modelDescription.xml', made.namelist())

    def test_symbols(self):
        """The library exports the declarations of the installed headers, all of them and nothing else."""
        text = ''.join(open(name, encoding='utf-8').read() for name in self.found('include/*.h'))
        text = re.sub(r'/\*.*?\*/', '', text, flags=re.S)
        shown = {line.split()[-1].split('@')[0] for line in run('nm', '-D', '--defined-only', self.library).splitlines()
                 if ' A ' not in line}
        private = sorted(name for name in shown if not re.search(rf'\b{name}\b', text))
        self.assertEqual(private, [])
        declared = set(re.findall(r'^(?:PetscErrorCode|const char \*|void|PetscBool) ?\*?(Hyco[A-Z]\w*)\(', text, flags=re.M))
        self.assertGreater(len(declared), 100)
        self.assertEqual(sorted(declared - shown), [])

    def test_manual(self):
        """Each option of the help is in its manual page and in the completion."""
        options = re.findall(r'^  (-[a-z]\w*) ', run(os.path.join(self.prefix, 'bin', 'hyco'), 'predict', '-help'), flags=re.M)
        with open(os.path.join(self.prefix, 'share', 'man', 'man1', 'hyco-predict.1'), encoding='utf-8') as file:
            page = file.read().replace('\\-', '-')
        self.assertGreater(len(options), 30)
        for option in options:
            self.assertRegex(page, rf'\n\.B {option}( <|\n)')
        completion = os.path.join(self.prefix, 'share', 'bash-completion', 'completions', 'hyco')
        words = run('bash', '-c', 'source "$1"; COMP_WORDS=(hyco predict -mo); COMP_CWORD=2; _hyco; echo "${COMPREPLY[@]}"', '-', completion)
        self.assertEqual(words.split(), ['-model'])
        values = 'source "$1"; COMP_WORDS=(hyco train -hyco_model_type b); COMP_CWORD=3; _hyco; echo "${COMPREPLY[@]}"'
        self.assertEqual(run('bash', '-c', values, '-', completion).split(), ['bodies'])
        for heading in ('EXAMPLES', 'FILES', 'ENVIRONMENT', 'MOST USED OPTIONS'):
            self.assertIn(f'\n.SH {heading}\n', page)
        for shell, name, line in (('zsh', 'share/zsh/site-functions/_hyco', '-model) _files; return ;;'),
                                  ('fish', 'share/fish/vendor_completions.d/hyco.fish', '-o hyco_linear -x -a \'auto direct iterative\'')):
            with open(os.path.join(self.prefix, name), encoding='utf-8') as file:
                self.assertIn(line, file.read())
            if shutil.which(shell):
                run(shell, '-n', os.path.join(self.prefix, name))

    def test_pkg_config(self):
        """The ladder builds by make and pkg-config from the installed files."""
        ladder = os.path.join(self.folder.name, 'make')
        run('cp', '-r', os.path.join(self.prefix, 'share', 'doc', 'hyco', 'examples', 'ladder'), ladder)
        path = os.path.join(os.path.dirname(self.library), 'pkgconfig') + ':' + os.environ.get('PKG_CONFIG_PATH', '')
        run('make', '-s', '-C', ladder, env={**os.environ, 'PKG_CONFIG_PATH': path})
        for name in LADDER:
            self.assertTrue(os.access(os.path.join(ladder, name), os.X_OK), name)
        self.predicts(os.path.join(ladder, 'batch'))

    def test_cmake(self):
        """The ladder builds by CMake from the installed files."""
        build = os.path.join(self.folder.name, 'cmake')
        run('cmake', '-S', os.path.join(self.prefix, 'share', 'doc', 'hyco', 'examples', 'ladder'), '-B', build,
            '-DCMAKE_PREFIX_PATH=' + self.prefix)
        run('cmake', '--build', build, '-j', '2')
        for name in LADDER:
            self.assertTrue(os.access(os.path.join(build, name), os.X_OK), name)
        self.predicts(os.path.join(build, 'batch'))

    def test_python(self):
        """The installed Python package finds its library, from anywhere, and predicts."""
        self.imports(os.path.join(self.prefix, 'lib', 'python3', 'dist-packages'))

    def imports(self, packages, **environment):
        model = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4-table.h5')
        program = f"import hyco; print('force', hyco.Model({model!r}).predict([0.07, 0.17]).total_contact_force)"
        self.assertIn('force 0.3', run(sys.executable, '-c', program, cwd='/', env={**os.environ, 'PYTHONPATH': packages, **environment}))

    @unittest.skipUnless(shutil.which('dpkg-shlibdeps') and shutil.which('file'), 'cpack requires dpkg-dev and file')
    def test_package(self):
        """The Debian package depends on the libraries that hyco links, but not on gmsh's; its command runs from wherever it is unpacked."""
        made = os.path.join(self.folder.name, 'package')
        run('cpack', '-B', made, cwd=BUILD)
        package, = glob.glob(os.path.join(made, '*.deb'))
        needs = re.split(r'[, |]+', run('dpkg-deb', '-f', package, 'Depends'))
        for name in ('openmpi-bin', 'libpetsc-real', 'libslepc-real', 'libhdf5-openmpi', 'libmetis', 'libmumps', 'libmuparser', 'libqhull', 'libcjson'):
            self.assertTrue(any(word.startswith(name) for word in needs), f'{name} is not in {needs}')
        self.assertFalse([word for word in needs if re.search('gmsh|fltk|x11', word)])
        root = os.path.join(made, 'root')
        run('dpkg-deb', '-x', package, root)
        self.assertEqual(os.listdir(root), ['usr'])
        library, = glob.glob(os.path.join(root, '**', 'libhyco.so'), recursive=True)
        paths = os.pathsep.join([os.path.dirname(library), *filter(None, [library_path()])])
        model = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4-table.h5')
        said = run(os.path.join(root, 'usr', 'bin', 'hyco'), 'predict', '-model', model, '-mu', '0.07,0.17',
                   env={**os.environ, 'LD_LIBRARY_PATH': paths})
        self.assertIn('force', said)
        self.imports(os.path.join(root, 'usr', 'lib', 'python3', 'dist-packages'), LD_LIBRARY_PATH=paths)

    def test_version(self):
        """One version, CMakeLists.txt's."""
        with open(os.path.join(SOURCE, 'CMakeLists.txt'), encoding='utf-8') as file:
            version = re.search(r'project\(hyco VERSION (\S+)', file.read()).group(1)
        self.assertEqual(run(os.path.join(self.prefix, 'bin', 'hyco'), '-version').strip(), 'hyco ' + version)
        for name, pattern in (('CITATION.cff', r'^version: (\S+)'), ('CHANGELOG.md', r'^## (\d\S*)'),
                              ('packaging/spack/packages/hyco/package.py', r'^    version\("(\S+)"\)')):
            with open(os.path.join(SOURCE, name), encoding='utf-8') as file:
                self.assertEqual(re.search(pattern, file.read(), flags=re.M).group(1), version, name)


if __name__ == '__main__':
    unittest.main()
