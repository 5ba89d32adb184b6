"""Rules of the sources: printing, dependences between folders, declaration of options, the public header."""
import glob
import os
import re
import shutil
import subprocess
import unittest

from common import PATIENCE

SOURCE = os.environ['HYCO_SOURCE']


def text(path):
    with open(path, encoding='utf-8') as f:
        return f.read()


def code(path):
    """Without comments and string literals."""
    return re.sub(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', lambda m: '""' if m[0][0] == '"' else ' ', text(path),
                  flags=re.S)


def sources(folder='*'):
    found = sorted(glob.glob(os.path.join(SOURCE, 'src', folder, '*.[ch]')) +
                   glob.glob(os.path.join(SOURCE, 'src', folder, 'impls', '*', '*.[ch]')) +
                   (extensions() if folder == '*' else []))
    assert found, folder
    return found


def extensions():
    return sorted(glob.glob(os.path.join(SOURCE, 'extensions', '*', '*.[ch]')))


def calls():
    """By file of the library: the files whose functions or data with external linkage it names."""
    head = re.compile(r'^(?!static|extern|typedef|return|else|struct|#)[A-Za-z_][\w \*]*?\b(Hyco\w+)\s*(?:\((?:[^;{}]|\n)*?\)\s*\{|\[[^;]*?=|=)', re.M)
    macro = re.compile(r'^HycoDefineMethod\((Hyco\w+),', re.M)
    of, body = {}, {}
    for path in sources():
        if path.endswith('.c') and os.sep + 'app' + os.sep not in path:
            body[path] = code(path)
            for name in head.findall(body[path]) + macro.findall(body[path]):
                of[name] = path
    assert len(of) > 1000, len(of)
    return {path: {of[word] for word in set(re.findall(r'\bHyco\w+', text)) if of.get(word, path) != path} for path, text in body.items()}


def circles(graph):
    """The sets of nodes that reach each other (Tarjan), those of more than one."""
    number, least, stack, found = {}, {}, [], []

    def visit(node):
        number[node] = least[node] = len(number)
        stack.append(node)
        for other in graph[node]:
            if other not in number:
                visit(other)
            if other in stack:
                least[node] = min(least[node], least[other])
        if least[node] == number[node]:
            at = stack.index(node)
            if len(stack) - at > 1:
                found.append(sorted(stack[at:]))
            del stack[at:]

    for node in graph:
        if node not in number:
            visit(node)
    return found


class Sources(unittest.TestCase):
    def test_library_is_silent(self):
        """No printing and no world communicator outside the driver."""
        word = re.compile(r'\b(PETSC_COMM_WORLD|MPI_COMM_WORLD|printf|puts|putchar|vprintf|PetscPrintf|'
                          r'PetscSynchronizedPrintf|stdout|stderr)\b')
        for folder in ('algorithms', 'linear', 'complementarity'):
            for path in sources(folder):
                self.assertNotRegex(text(path), r'#include\s*[<"](hycosystem|hycosolver|hycosolverimpl)\.h', path)
        for path in sources():
            if os.sep + 'app' + os.sep in path or path.endswith(os.path.join('package', 'init.c')):
                continue
            self.assertEqual(word.findall(code(path)), [], path)

    def test_layers(self):
        """Algorithms, linear solves, complementarity and the solver do not include scene, mesh or cells; only the command includes driver.h."""
        above = ('hycoscene', 'hycosceneimpl', 'hycomesh', 'hycofe', 'hycofom', 'hycodomain', 'hycorom', 'hycoreducer',
                 'hycosnapshots', 'hycosamples', 'hycofields', 'hyco')
        for folder in ('algorithms', 'solver', 'linear', 'complementarity'):
            for path in sources(folder):
                names = re.findall(r'#include\s*[<"](\w+)\.h[>"]', text(path))
                self.assertEqual([n for n in names if n in above], [], path)
        for path in sources():
            if os.sep + 'app' + os.sep not in path:
                self.assertNotIn('driver.h', text(path), path)
        for name in ('hycoalgorithms.h', 'hycosolverimpl.h', 'hycolinear.h', 'hycolcp.h'):
            path = os.path.join(SOURCE, 'include', 'private', name)
            names = re.findall(r'#include\s*[<"](\w+)\.h[>"]', text(path))
            self.assertEqual([n for n in names if n in above], [], name)

    def test_one_solver(self):
        """Every contact problem is a contact system solved by HycoSolver: nothing else in the library calls the dense problem's solver, but what is not yet
        moved, a list that only gets shorter."""
        waiting = {'src/rom/impls/bodies/bodies_friction.c'}
        own = {'src/complementarity/tao.c', 'src/complementarity/tao_nnls.c', 'src/solver/impls/condensed/condensed.c', 'src/solver/impls/dual/dual.c'}
        found = {os.path.relpath(path, SOURCE) for path in sources() if re.search(r'\bHyco(TaoSolveLCP|LCP(ActiveSet|Semidefinite|Proximal|Lemke|Semismooth)) *\(', code(path))}
        self.assertEqual({path for path in found if not path.startswith('src/complementarity/')} | own, own | waiting)

    def test_command(self):
        """The command includes public headers and its own alone."""
        public = {os.path.basename(path) for path in glob.glob(os.path.join(SOURCE, 'include', '*.h'))}
        for path in sources('app'):
            names = set(re.findall(r'#include\s*<(hyco\w*\.h)>', text(path)))
            self.assertEqual(names - public, set(), path)
            self.assertNotRegex(text(path), r'#include\s*"(?!(driver|check)\.h")', path)

    def test_circles(self):
        """Folders call each other in no circle, files in circles of at most five; only the package calls extensions."""
        graph = calls()
        folder = {path: os.path.dirname(os.path.relpath(path, SOURCE)) for path in graph}
        rooms = {room: set() for room in folder.values()}
        for path, others in graph.items():
            rooms[folder[path]] |= {folder[other] for other in others} - {folder[path]}
        self.assertEqual(circles(rooms), [])
        self.assertEqual([circle for circle in circles(graph) if len(circle) > 5], [])
        for path, others in graph.items():
            for other in others:
                if 'extensions' in os.path.relpath(other, SOURCE):
                    self.assertEqual(os.path.dirname(other), os.path.dirname(path), path)

    def test_online(self):
        """What loads and predicts (rom/) includes no header of the training, directly or through others, and calls no function of offline/."""
        header = {os.path.basename(p): p for p in glob.glob(os.path.join(SOURCE, 'include', '**', '*.h'), recursive=True)}
        included = {}

        def closure(path):
            if path not in included:
                included[path] = set()
                for name in re.findall(r'#include\s*[<"](hyco\w*\.h)[>"]', text(path)):
                    if name in header:
                        included[path] |= {name} | closure(header[name])
            return included[path]

        training = {name for name in header if re.match(r'hyco(reducer|trainer|snapshots)|hyco\w*training\.h|hycoinelasticmodes', name)}
        self.assertGreater(len(training), 6)
        for path in sources('rom'):
            self.assertEqual(closure(path) & training, set(), path)
        for path, others in calls().items():
            if os.sep + 'rom' + os.sep in path:
                self.assertEqual([other for other in others if os.sep + 'offline' + os.sep in other], [], path)

    def test_types(self):
        """Laws and discretisations of contact are named only in their own folders and in the package, which registers all types; a scene
        names the default one."""
        for path in sources():
            if os.sep + 'package' + os.sep in path:
                continue
            if os.sep + 'material' + os.sep not in path and path not in extensions():
                self.assertNotRegex(code(path), r'\b(young|poisson)\b', path)
            if os.sep + 'contact' + os.sep not in path:
                self.assertNotRegex(code(path), r'\bHYCO_CONTACT_(PAIR|SURFACE)\b', path)

    def test_model_types(self):
        """A type of reduced model is named only in its own folder, and no code queries a type by name."""
        own = re.compile(r'#include\s*[<"](hybrid|hycoprojection|hycobodies|hycogalerkin|table)\.h')
        for path in sources():
            if os.sep + 'impls' + os.sep in path or path in extensions():
                continue
            self.assertNotRegex(text(path), own, path)
            self.assertNotRegex(code(path), r'[=!]=\s*HYCO_ROM_[A-Z]+|str(case)?cmp\([^;]*HYCO_ROM_(HYBRID|PROJECTION|BODIES|CUBATURE|REGRESSION)\)\s*[=!]', path)

    def test_registration(self):
        """Only the package, which registers all types, and its own file name the function that creates a type; nothing calls the package."""
        create = re.compile(r'\bHyco(?:Material|Contact|Cone|ROM|Trainer|SolverForm)Create_\w+')
        own = {}
        for path in sources():
            if os.sep + 'package' + os.sep in path:
                continue
            for name in create.findall(code(path)):
                own.setdefault(name, set()).add(os.path.relpath(path, SOURCE))
            self.assertNotRegex(code(path), r'\bHycoInitializePackage\b', path)
        self.assertGreater(len(own), 15)
        self.assertEqual({name: paths for name, paths in own.items() if len(paths) > 1}, {})

    def test_options(self):
        """hyco -help lists the declarations of the code, once each; options queried by name elsewhere are declared."""
        declared, asked = [], set()
        for path in sources():
            body = re.sub(r'/\*.*?\*/', ' ', text(path), flags=re.S)
            declared += re.findall(r'\bHycoOptions(?:Real|Int|Bool|Flag|Word|String|List|Name)\(\s*"-(\w+)"', body)
            asked |= set(re.findall(r'\bPetscOptions\w+\([^;"]*"-(hyco_\w*[a-z])"', body))
        help_text = subprocess.run([os.environ['HYCO'], '-help'], capture_output=True, text=True, check=True,
                                   timeout=20 * PATIENCE).stdout
        listed = re.findall(r'^  -(\w+?)(?:NAME)? ', help_text, flags=re.M)
        self.assertGreater(len(declared), 50)
        self.assertEqual(len(set(listed)), len(listed), 'listed twice')
        self.assertEqual(len(set(declared)), len(declared), 'declared twice')
        self.assertEqual(set(declared) - set(listed), set(), 'declared, but not in -help')
        self.assertEqual({n for n in listed if n.startswith('hyco_')} - set(declared), set(), 'in -help, but not declared')
        self.assertEqual(asked - set(declared), set(), 'asked, but not declared')

    def test_help_of_a_command(self):
        """The help of a command begins with its most used options, which it has, and two examples; it lists each option once."""
        for command in ('check', 'solve', 'train', 'predict', 'compare', 'view'):
            said = subprocess.run([os.environ['HYCO'], 'help', command], capture_output=True, text=True, check=True, timeout=20 * PATIENCE).stdout
            listed = re.findall(r'^  -(\w+) ', said, flags=re.M)
            self.assertEqual(len(set(listed)), len(listed), command)
            used = re.search(r'^Most used options\n((?:  .*\n)+)\nExamples\n((?:    hyco .*\n|    mpiexec .*\n){2})', said, flags=re.M)
            named = re.search(rf'{{"{command}",\s*{{([^}}]*)}}', text(os.path.join(SOURCE, 'src', 'app', 'help.c')))[1].count('"') // 2
            self.assertEqual(used[1].count('\n'), named, command)
            for option in re.findall(r' -(\w+)', used[2]):
                self.assertTrue(option in listed or re.sub('_[^_]+$', '_NAME', option) in listed or option == 'n', f'{command}: {option}')

    def test_names(self):
        """A static function has a name of two words or more, which a backtrace and a profile can tell apart; lines end at column 120."""
        for path in sources() + glob.glob(os.path.join(SOURCE, 'include', '**', '*.h'), recursive=True):
            self.assertEqual(re.findall(r'^static [\w *]*[ *]([A-Za-z][a-z0-9]*)\(', code(path), flags=re.M), [], path)
            self.assertEqual([line for line in text(path).splitlines() if len(line) > 120], [], path)

    def test_public_header(self):
        """include/hyco.h compiles alone, in C and in C++, without the private headers."""
        flags = subprocess.run(['pkg-config', '--cflags', 'petsc', 'slepc'], capture_output=True, text=True, check=True,
                               timeout=20 * PATIENCE).stdout.split()
        mpi = subprocess.run(['mpicc', '--showme:compile'], capture_output=True, text=True, timeout=20 * PATIENCE).stdout.split()
        for compiler in (['gcc', '-std=c11', '-x', 'c'], ['g++', '-x', 'c++']):
            if not shutil.which(compiler[0]):
                print(f'{compiler[0]} is not there: the header is not compiled with it')
                continue
            run = subprocess.run([*compiler, '-fsyntax-only', '-Wall', '-Werror', *flags, *mpi, '-I',
                                  os.path.join(SOURCE, 'include'), '-'], input='#include <hyco.h>\n', text=True,
                                 capture_output=True, timeout=50 * PATIENCE)
            self.assertEqual(run.returncode, 0, f'{compiler[0]}: {run.stderr}')

    def test_public_headers_hide(self):
        """Public headers include no private one, and those with functions compile in C++."""
        for path in glob.glob(os.path.join(SOURCE, 'include', '*.h')):
            self.assertNotIn('impl.h', text(path), path)
            if re.search(r'^PetscErrorCode Hyco', text(path), flags=re.M):
                self.assertIn('extern "C"', text(path), path)


if __name__ == '__main__':
    unittest.main()
