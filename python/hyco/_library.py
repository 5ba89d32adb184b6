"""The C library by ctypes: where it is, its start and end, its errors, and its structs as NumPy types."""
import atexit
import ctypes
import functools
import operator
import os
import signal
import sys
import threading

import numpy as np


class Error(Exception):
    """A call failed; str() is hyco's one line: what was found, what was expected, what to do."""


class WrongValue(Error, ValueError):
    """An argument, a parameter value or an entry is wrong: an Error that is also a ValueError."""


class NoFile(Error, FileNotFoundError):
    """A file does not exist: an Error that is also a FileNotFoundError."""


class NotConverged(Error):
    """A solve did not converge; `result` is what would have been returned (check=False returns it instead)."""

    def __init__(self, line, result):
        super().__init__(line, result)
        self.result = result

    def __str__(self):
        return self.args[0]


class Field(ctypes.Structure):
    """HycoMember of hycobindings.h."""
    _fields_ = [('name', ctypes.c_char_p), ('kind', ctypes.c_char), ('offset', ctypes.c_size_t), ('size', ctypes.c_size_t),
                ('count', ctypes.c_size_t)]


def find():
    """The path of libhyco: HYCO_LIBRARY, or beside this package as it was built or installed."""
    named = os.environ.get('HYCO_LIBRARY')
    if named:
        return named
    try:
        from ._where import LIBRARY  # pylint: disable=import-outside-toplevel
    except ImportError:
        raise ImportError('hyco is imported from its source tree, where the library is not known; use the package in the build folder '
                          '(PYTHONPATH=build/python) or an installed one, or name the library: HYCO_LIBRARY=.../libhyco.so') from None
    return os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), LIBRARY))


try:
    lib = ctypes.CDLL(find())  # not among the global names: h5py may have an HDF5 of its own
except OSError as error:
    raise ImportError(f'hyco: {error}; HYCO_LIBRARY names the shared library libhyco.so') from None
lib.HycoKeptError.restype = ctypes.c_char_p
lib.HycoVersion.restype = ctypes.c_char_p
lib.HycoReasonName.restype = ctypes.c_char_p
lib.HycoNearest.restype = ctypes.c_char_p
lib.HycoKeptErrorKind.restype = ctypes.c_char
# As a process that no launcher started: neither a daemon nor a network is needed. As the command does (hyco/src/app/launch.c).
ALONE = {'OMPI_MCA_ess_singleton_isolated': '1', 'OMPI_MCA_orte_create_session_dirs': '0', 'OMPI_MCA_btl': 'self', 'OMPI_MCA_pml': 'ob1',
         'OMPI_MCA_if': '^posix_ipv4', 'PMIX_MCA_pif': '^posix_ipv4', 'HWLOC_HIDE_ERRORS': '2'}
LAUNCHED = ('OMPI_COMM_WORLD_SIZE', 'PMIX_RANK', 'PMI_RANK', 'PMI_FD', 'PMI_ID')
READERS = ('HycoSceneLoad', 'HycoROMLoad')  # of files that the user gives
running = False
lock = threading.RLock()


class World:
    """The processes: all of PETSC_COMM_WORLD."""
    comm, rank, size = None, 0, 1


def begin():
    """Starts PETSc, SLEPc and hyco once; the settings for MPI are not left to the user's own children."""
    global running  # pylint: disable=global-statement
    if running:
        return
    alone = {} if any(name in os.environ for name in LAUNCHED) else {k: v for k, v in ALONE.items() if k not in os.environ}
    os.environ.update(alone)
    lib.HycoBLASChooseKernels()
    begin.words = (ctypes.c_char_p * 3)(b'hyco', b'-no_signal_handler', None)  # Python keeps its own handlers
    begin.count, begin.list = ctypes.c_int(2), ctypes.cast(begin.words, ctypes.POINTER(ctypes.c_char_p))
    failed = lib.HycoInitialize(ctypes.byref(begin.count), ctypes.byref(begin.list))
    for name in alone:
        del os.environ[name]
    if failed:
        raise Error(f'PETSc, SLEPc and hyco could not be started (error {failed})')
    running = True
    wide = layout('MPI_Comm')[0] == 8
    World.comm = (ctypes.c_void_p if wide else ctypes.c_int).in_dll(lib, 'PETSC_COMM_WORLD')
    number = ctypes.c_int()
    lib.MPI_Comm_rank(World.comm, ctypes.byref(number))
    World.rank = number.value
    lib.MPI_Comm_size(World.comm, ctypes.byref(number))
    World.size = number.value
    if World.size > 1:
        sys.excepthook = leave
    atexit.register(end)


def end():
    """Handles that are still open end with the process."""
    global running  # pylint: disable=global-statement
    if running:
        running = False
        lib.HycoFinalize()


def leave(kind, value, trace, report=sys.excepthook):
    """An exception that nothing caught ends all processes: the others would wait for this one."""
    report(kind, value, trace)
    sys.stdout.flush()
    sys.stderr.flush()
    lib.MPI_Abort(World.comm, 1)


def whole(method):
    """A method that no other thread interrupts: its calls, and what they leave behind, belong together."""
    @functools.wraps(method)
    def alone(*arguments, **named):
        with lock:
            return method(*arguments, **named)
    return alone


raised = []  # by the program's handler of Ctrl-C during a call


@ctypes.CFUNCTYPE(ctypes.c_int)
def ask():
    """Between two solves, after Ctrl-C: what the program's own handler does; an exception ends the call."""
    try:
        signal.getsignal(signal.SIGINT)(signal.SIGINT, sys._getframe())  # pylint: disable=protected-access
    except BaseException as error:  # pylint: disable=broad-except
        raised.append(error)
    return len(raised)


def interruptible():
    """Whether Ctrl-C is Python's: in its main thread, with a handler. Of several processes the launcher ends all."""
    return World.size == 1 and threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT))


def call(name, *arguments):
    """Calls a function of the library; its error becomes an exception, and so does Ctrl-C meanwhile."""
    with lock:  # PETSc knows nothing of threads; a callback may call again
        noted = interruptible()
        if noted:
            lib.HycoInterruptBegin(ask)
        lib.HycoKeepErrors(1)
        threads = lib.HycoBLASSetThreads(1)  # of the program's BLAS, which NumPy may share
        try:
            failed = getattr(lib, name)(*arguments)
            line, kind = (bytes(lib.HycoKeptError()), lib.HycoKeptErrorKind()) if failed else (b'', b'')
        finally:
            lib.HycoBLASSetThreads(threads)
            lib.HycoKeepErrors(0)
            if noted and lib.HycoInterruptEnd():
                ask()
    if raised:
        raise raised.pop()
    if failed:
        kind = NoFile if kind == b'f' else WrongValue if kind == b'v' or name in READERS else Error
        raise kind(line.decode('utf-8', 'replace') or f'{name} failed with PETSc error {failed}')


def layout(name):
    """(size in bytes, {member: (numpy type, offset, kind)})"""
    size, n, fields = ctypes.c_size_t(), ctypes.c_int64(0), ctypes.POINTER(Field)()
    call('HycoGetLayout', name.encode(), ctypes.byref(size), ctypes.byref(n), ctypes.byref(fields))
    members = {}
    for f in fields[:n.value] if n.value else ():
        if f.kind in b'zp':
            kind = np.dtype(np.uintp)
        elif f.kind == b'S':
            kind = np.dtype(('S', f.count))
        else:
            kind = np.dtype((f'{f.kind.decode()}{f.size}', (f.count,) if f.count > 1 else ()))
        members[f.name.decode()] = (kind, f.offset, f.kind.decode())
    return size.value, members


aside = []  # destroy functions and handles


def free(destroy, handle):
    """Destroys an object of all processes. While an exception passes, which the others may not have, it is set aside instead: all meet again
    at the next Scene, or the exception ends them."""
    if World.size > 1 and sys.exc_info()[0]:
        aside.append((destroy, type(handle)(handle.value)))
    elif running:
        call(destroy, ctypes.byref(handle))


def free_aside():
    """Destroys what was set aside, in its order."""
    while aside:
        call(aside[0][0], ctypes.byref(aside.pop(0)[1]))


types = {}


def struct(name):
    """The NumPy type of a public struct, with the names of its members."""
    if name not in types:
        size, members = layout(name)
        types[name] = np.dtype({'names': list(members), 'formats': [m[0] for m in members.values()],
                                'offsets': [m[1] for m in members.values()], 'itemsize': size})
    return types[name]


def integer():
    """PETSc's integers."""
    if 'PetscInt' not in types:
        size = layout('PetscInt')[0]
        types['PetscInt'] = (ctypes.c_int32 if size == 4 else ctypes.c_int64, np.dtype(f'i{size}'))
    return types['PetscInt']


def count(n=0):
    """A PetscInt of C."""
    try:
        return integer()[0](operator.index(n))
    except TypeError:
        raise WrongValue(f'{n!r} was given; a whole number is expected') from None


def numbers(values, kind=float):
    """Values as an array of real numbers; of whole ones for a kind of integers."""
    try:
        given = np.asarray(values)
        given = given.astype(float) if given.dtype == object else given
        if given.dtype.kind not in 'biuf' or (np.dtype(kind).kind == 'i' and not np.array_equal(given, np.round(np.nan_to_num(given)))):
            raise ValueError
    except (TypeError, ValueError):
        raise WrongValue(f'{values!r:.80} was given; {"whole" if np.dtype(kind).kind == "i" else "real"} numbers are expected') from None
    return np.array(given, kind, order='C')


def address(array):
    """An array's data as C's pointer; None: NULL."""
    return None if array is None else ctypes.c_void_p(array.ctypes.data)


def copied(pointer, shape, kind=float):
    """A copy of an array of the library."""
    n = int(np.prod(shape))
    if not n or not pointer:
        return np.zeros(shape, kind)
    kind = np.dtype(kind)
    return np.frombuffer((ctypes.c_char * (n * kind.itemsize)).from_address(pointer.value), kind).reshape(shape).copy()


def text(where):
    """The text at an address (a member of kind 'z'); '' for NULL."""
    return ctypes.string_at(int(where)).decode('utf-8', 'replace') if where else ''


def reason(code):
    """The words of a HycoReason."""
    return lib.HycoReasonName(ctypes.c_int(int(code))).decode()
