"""hyco: full-order and reduced models of parametrised unilateral contact, from Python.

    import hyco

    with hyco.Scene('examples/pellet') as scene:
        full = scene.solve([4.06, 1.0])                  # full order
        scene.train('pellet.h5', grid=[6, 4])
    with hyco.Model('pellet.h5') as model:               # needs the file alone
        p = model.predict([[4.06, 1.0], [4.07, 0.8]])    # many points at once
        print(p.outputs, p.estimates)

Arrays in, arrays out; only NumPy is needed. Under mpiexec every process runs the same program: scenes are solved and trained by all
together, and many points are divided over them. Errors are hyco.Error with hyco's one line; some are also ValueError or FileNotFoundError.
"""
import ctypes
import os
import tempfile
import threading
import warnings
import weakref
from functools import cached_property

import numpy as np

from . import _library as c
from ._library import Error, NotConverged, WrongValue, World

__all__ = ['Scene', 'Model', 'Solution', 'Prediction', 'Gradient', 'Fit', 'Error', 'NotConverged', 'version', 'rank', 'size']


def version():
    """The library's version."""
    return c.lib.HycoVersion().decode()


def rank():
    """The number of this process, from 0."""
    c.begin()
    return World.rank


def size():
    """The number of processes."""
    c.begin()
    return World.size


def _parameters(scene):
    """{name: (lo, hi)} in the scene's order."""
    n, names, lo, hi = c.count(), *(ctypes.c_void_p() for _ in range(3))
    c.call('HycoSceneGetParameters', scene, *(ctypes.byref(x) for x in (n, names, lo, hi)))
    names = c.copied(names, n.value, np.uintp)
    return {c.text(w): (float(a), float(b)) for w, a, b in zip(names, c.copied(lo, n.value), c.copied(hi, n.value))}


def _names(function, scene):
    """Names that a function of the scene gives."""
    n, names = c.count(), (ctypes.c_char_p * 1024)()
    c.call(function, scene, ctypes.byref(n), names)
    return [w.decode() for w in names[:n.value]]


def _points(mu, parameters):
    """Parameter values as an array (..., parameters): a sequence, or values (or columns of a table) by name."""
    if hasattr(mu, 'keys'):
        lacking = [name for name in parameters if name not in mu.keys()]
        if lacking:
            raise WrongValue(f'the values have no {", ".join(lacking)}; the parameters are {", ".join(parameters)}')
        unknown = [] if hasattr(mu, 'columns') else [str(name) for name in mu.keys() if name not in parameters]  # a table may have other columns
        if unknown:
            raise WrongValue(f'the values name {", ".join(unknown)}; the parameters are {", ".join(parameters)}')
        values = np.broadcast_arrays(*(c.numbers(mu[name]) for name in parameters))
        return np.ascontiguousarray(np.stack(values, -1)) if parameters else np.zeros(0)
    mu = np.atleast_1d(c.numbers(mu))
    if mu.shape[-1] != len(parameters):
        raise WrongValue(f'parameter values of shape {mu.shape} were given; the last dimension must be {len(parameters)}, for '
                    f'{", ".join(parameters) or "no parameters"}')
    return mu


def _one(mu, parameters):
    mu = _points(mu, parameters)
    if mu.ndim != 1:
        raise WrongValue(f'parameter values of shape {mu.shape} were given; one point is expected here: {", ".join(parameters)}')
    return mu


def _records(function, handle, name, *more):
    """A list of {member: value} of an array of structs."""
    n, pointer = c.count(), ctypes.c_void_p()
    c.call(function, handle, ctypes.byref(n), ctypes.byref(pointer), *more)
    texts = [member for member, (_, _, kind) in c.layout(name)[1].items() if kind == 'z']
    rows = c.copied(pointer, n.value, c.struct(name))
    return [{member: c.text(row[member]) if member in texts else row[member].copy() for member in rows.dtype.names} for row in rows]


def _history(function, handle, outputs):
    """The listed times of a path as a structured array: the members of HycoStep, but those with the name of an output, then the outputs;
    None without a history."""
    head = np.zeros(1, c.struct('HycoHistory'))
    c.call(function, handle, c.address(head))
    if not head['n'][0]:
        return None
    steps = c.copied(ctypes.c_void_p(int(head['step'][0])), int(head['n'][0]), c.struct('HycoStep'))
    kinds = [(name, steps.dtype[name]) for name in steps.dtype.names if name != 'quantity' and name not in outputs]
    table = np.zeros(len(steps), kinds + [(name, float) for name in outputs])
    for name, _ in kinds:
        table[name] = steps[name]
    for k, name in enumerate(outputs):
        table[name] = steps['quantity'][:, k]
    return table


class Gradient:
    """Derivatives of the outputs with respect to the parameters, in the unit of the output over that of the parameter; those of many
    points have the shape of the points in front.

    value      (..., outputs, parameters), in the orders of the scene's outputs and parameters
    kink       the same shape: the derivatives to the two sides differ, and value is that towards larger parameter values
    undecided  (...) number of contacts with neither force nor gap
    outputs    {name: value} of the outputs there
    lacking    of a set {index of a point: why it has no gradient}: there value is nan
    times, path  of a path (else None), whose value is that of the last listed time: (..., times, outputs, parameters), at each listed
               time; (..., outputs, parameters), of the largest over the listed times (for min the smallest)
    gradient['lift'] is that of one output, (..., parameters)
    """

    def __init__(self, mu, outputs, value, kink, undecided, times, path, lacking=None):
        self.mu, self.outputs, self.value, self.kink, self.undecided, self.times, self.path = mu, outputs, value, kink, undecided, times, path
        self.lacking = lacking or {}

    def __getitem__(self, name):
        return self.value[..., list(self.outputs).index(name), :]

    def __repr__(self):
        return _shown(self, f'{_several(self.value.shape[:-2])}', **{name: self[name].tolist() if self.value.ndim == 2 else 'array' for name in self.outputs})


class Fit:
    """An answer of Model.fit().

    mu           parameter values, an array; parameters: the same by name
    outputs      {name: value} there
    misfit       root mean square of the relative differences from the targets
    converged    it is a minimum within the ranges, by its slope
    kink         derivatives there are one-sided
    free, determined  parameters that are not held; those (or combinations) that the targets determine: with fewer mu is one of many answers
    starts, at_least  minimisations, and those that ended at the least misfit
    evaluations  predictions
    """

    def __init__(self, mu, outputs, names, found):
        self.mu, self.outputs, self.parameters = mu, outputs, dict(zip(names, mu.tolist()))
        self.misfit, self.converged, self.kink = float(found['misfit']), bool(found['converged']), bool(found['kink'])
        self.starts, self.at_least, self.evaluations = (int(found[name]) for name in ('n_starts', 'n_least', 'evaluations'))
        self.free, self.determined = int(found['n_free']), int(found['n_determined'])

    def __repr__(self):
        return _shown(self, _where(self.mu, self.parameters), **self.outputs, misfit=self.misfit, converged=self.converged)


def _gradient(function, handle):
    """value, kink, undecided, times, path of the last solution or prediction."""
    g = np.zeros(1, c.struct('HycoGradient'))
    c.call(function, handle, c.address(g))
    at = [ctypes.c_void_p(int(g[name][0])) for name in ('value', 'kink', 'times', 'path')]
    g = g[0]
    shape = int(g['n_outputs']), int(g['n_parameters'])
    n_times = int(g['n_times'])
    return (c.copied(at[0], shape), c.copied(at[1], shape, f"i{c.layout('PetscBool')[0]}").astype(bool), int(g['n_undecided']),
            c.copied(at[2], (n_times, *shape)) if n_times else None, c.copied(at[3], shape) if n_times else None)


class _Owned:
    """A handle of the library, which is destroyed with its owner."""

    def __init__(self, destroy, collective):
        self.handle, self._destroy, self._collective = ctypes.c_void_p(), destroy, collective

    def __del__(self):
        if c is not None and c.running and not (self._collective and World.size > 1):
            self.close()

    def close(self):
        """Frees the object. Closing twice is allowed."""
        if c.running and self.handle and self._collective:
            c.free(self._destroy, self.handle)
        elif c.running and self.handle:
            c.call(self._destroy, ctypes.byref(self.handle))
        self.handle = ctypes.c_void_p()


class _Handle:
    """An object of the library: closed by close() or at the end of a with block. `_last` is what solves or predicts, with its last result: each
    thread has its own."""
    _destroy = ''
    _collective = True  # all processes must close it together

    def __init__(self):
        c.begin()
        self._own = _Owned(self._destroy, self._collective)
        self._handle, self._threads, self._solvers, self._latest = self._own.handle, threading.local(), weakref.WeakSet(), None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    @c.whole
    def close(self):
        """Frees the object. Closing twice is allowed."""
        for solver in list(self._solvers):
            solver.close()
        self._latest, self._threads = None, threading.local()
        self._own.close()
        self._handle = self._own.handle

    @property
    def _open(self):
        if not self._handle:
            raise Error(f'this {type(self).__name__} is closed; make a new one')
        return self._handle

    def _solver(self, destroy, create, *arguments):
        """This thread's object that solves, made at its first solve; until then getters are about the latest of any."""
        own = getattr(self._threads, 'solver', None)
        if not own:
            own = _Owned(destroy, self._collective)
            c.call(create, *arguments, ctypes.byref(own.handle))
            self._threads.solver = own
            self._solvers.add(own)
        self._latest = own
        return own.handle

    @property
    def _last(self):
        own = getattr(self._threads, 'solver', None) or self._latest
        return self._open and own and own.handle


class Solution:
    """A full-order solution, in the scene's units. It is a copy, independent of later solves.

    mu                parameter values
    outputs           {name: value} of the scene's `output:` entries
    displacement      (nodes, dim)        on process 0, in the mesh file's order; no rows elsewhere
    contact_forces    (contacts,)         the same; compression positive
    stress            (cells, components) the same; xx / xx yy zz xy / xx yy zz xy yz xz
    contacts          list of {name, n, n_active, force, moment, area, pressure}: force on the slave's side
    reactions         list of {kind, group, force, moment} on the bodies; kind 0 support, 1 spring, 2 loads, 3 contact
    history           of a scene with a history its listed times, a structured array; else None
    converged, reason whether the KKT conditions hold, in words
    summary           everything else of HycoSummary (hycofom.h): solution.summary['strain_energy']
    """

    def __init__(self, fom, mu, outputs, parameters=()):
        self.mu, self._parameters = mu.copy(), tuple(parameters)
        self.summary = np.zeros(1, c.struct('HycoSummary'))
        c.call('HycoFOMGetSummary', fom, c.address(self.summary))
        self.summary = self.summary[0]
        self.reason = c.reason(self.summary['reason'])
        self.converged = bool(self.summary['reason'] > 0)
        self.outputs = {name: float(self.summary['quantity'][k]) for k, name in enumerate(outputs)}
        n = [c.count() for _ in range(3)]
        at = [ctypes.c_void_p() for _ in range(3)]
        c.call('HycoFOMGetSolution', fom, *(ctypes.byref(x) for pair in zip(n, at) for x in pair))
        dim = int(self.summary['dim'])
        self.displacement = c.copied(at[0], (n[0].value, dim))
        self.contact_forces = c.copied(at[1], n[1].value)
        self.stress = c.copied(at[2], (n[2].value, (1, 4, 6)[dim - 1]))
        self.contacts = _records('HycoFOMGetContacts', fom, 'HycoContactResult')
        self.balance = ctypes.c_double()
        self.reactions = _records('HycoFOMGetReactions', fom, 'HycoReaction', ctypes.byref(self.balance))
        self.balance = self.balance.value
        self.history = _history('HycoFOMGetHistory', fom, outputs)

    def __repr__(self):
        return _shown(self, _where(self.mu, self._parameters), **self.outputs, total_contact_force=self.total_contact_force, reason=self.reason)

    @property
    def total_contact_force(self):
        """Sum of the contact forces."""
        return float(self.summary['total_contact_force'])


class Scene(_Handle):
    """A scene: a folder with scene.yaml, or a YAML file. `entries` replace those of the file, as on the command line without the dash:
    Scene('examples/pellet', scene_mesh='fine.msh', body_pellet_young=2e5, hyco_model_type='hybrid').

    parameters  {name: (lo, hi)} in the order of the points' components
    outputs     names of the outputs
    units       {name: unit} of the outputs, of the scene's `unit:`; '' where it is not known
    contacts    names of the contacts
    times       the listed times of its history; empty without one
    """
    _destroy = 'HycoSceneDestroy'

    @c.whole
    def __init__(self, path, **entries):
        super().__init__()
        self.path = str(path)
        c.free_aside()
        _check_options(entries)
        try:
            for name, value in entries.items():
                c.call('PetscOptionsSetValue', None, f'-{name}'.encode(), _word(value))
            c.call('HycoSceneLoad', World.comm, str(path).encode(), ctypes.byref(self._handle))
        finally:
            self._solvers_read = {name for name in entries if self._handle and name.startswith('hyco_') and _of_solver(name)}
            self._forget(name for name in entries if name not in self._solvers_read)
        self.parameters = _parameters(self._handle)
        self.outputs = _names('HycoSceneGetQuantities', self._handle)
        self.units = dict(zip(self.outputs, _names('HycoSceneGetQuantityUnits', self._handle)))
        self.contacts = _names('HycoSceneGetContacts', self._handle)
        n, times = c.count(), ctypes.c_void_p()
        c.call('HycoSceneGetHistory', self._handle, ctypes.byref(n), ctypes.byref(times))
        self.times = c.copied(times, n.value)

    def __repr__(self):
        return _shown(self, repr(self.path), parameters=_ranges(self.parameters), outputs=', '.join(self.outputs))

    @staticmethod
    def _forget(names):
        for name in names:
            c.call('PetscOptionsClearValue', None, f'-{name}'.encode())

    @c.whole
    def close(self):
        if c.running and self._handle:
            self._forget(self._solvers_read)  # PETSc's solvers read them when they are made
        super().close()

    @c.whole
    def solve(self, mu=(), check=True):
        """The full-order Solution at mu. check: raise NotConverged if it does not converge."""
        handle, mu = self._open, _one(mu, self.parameters)
        fom = self._solver('HycoFOMDestroy', 'HycoFOMCreate', World.comm, handle)
        c.call('HycoFOMSolve', fom, c.count(len(mu)), c.address(mu))
        solution = Solution(fom, mu, self.outputs, self.parameters)
        if check and not solution.converged:
            why = solution.summary['why'].decode('utf-8', 'replace')
            raise NotConverged(f'full order at {_where(mu, self.parameters)}: {why or solution.reason}', solution)
        return solution

    @c.whole
    def gradient(self, mu=()):
        """The Gradient of the outputs at full order at mu, and what solve(mu) finds. All processes call it together."""
        solution = self.solve(mu)
        return Gradient(solution.mu, solution.outputs, *_gradient('HycoFOMGetGradient', self._last))

    @c.whole
    def write(self, path):
        """Writes this thread's last solution to PATH.xdmf with PATH.h5, or PATH.vtkhdf."""
        if not self._last:
            raise Error('there is no solution to write; solve first')
        c.call('HycoFOMWrite', self._last, str(path).encode())

    @c.whole
    def train(self, path, grid=None, points=None, scatter=None, validation=None, progress=None):
        """Trains a model, writes it to `path` and returns it. Training points: `grid` of so many values per parameter, ends included;
        `points` (n, parameters); or `scatter` points over the ranges. validation: held-out points
        (n, parameters). progress(done, n): called as points are solved. Ctrl-C ends it between two solves; solutions are kept. Settings are those of hyco train, as entries of the Scene:
        hyco_model_type, hyco_pod_tol, ... Solutions are kept in PATH.snapshots."""
        handle, interrupted = self._open, []
        reducer, samples, held = ctypes.c_void_p(), self._samples(grid, points, scatter), self._samples(None, validation, None, 'validation')
        report = np.zeros(1, c.struct('HycoTraining'))

        def told(done, n, _):
            try:
                progress(done, n)
            except BaseException as error:  # pylint: disable=broad-except
                interrupted.append(error)
                return 83  # PETSC_ERR_USER
            return 0

        told = ctypes.CFUNCTYPE(ctypes.c_int, c.integer()[0], c.integer()[0], ctypes.c_void_p)(told) if progress else None
        try:
            c.call('HycoReducerCreate', World.comm, handle, ctypes.byref(reducer))
            c.call('HycoReducerSetFromOptions', reducer)
            if held:
                c.call('HycoReducerSetValidation', reducer, held)
            c.call('HycoReducerSetProgress', reducer, told, None)
            c.call('HycoReducerRun', reducer, samples, str(path).encode(), c.address(report))
        except Error:
            if interrupted:
                raise interrupted[0] from None
            raise
        finally:
            c.free('HycoReducerDestroy', reducer)
            for each in (samples, held):
                c.call('HycoSamplesDestroy', ctypes.byref(each))
        model = Model(path)
        model.training = report[0]
        return model

    def _samples(self, grid, points, scatter, name='points'):
        """HycoSamples of one of them; NULL without any."""
        given = [x is not None for x in (grid, points, scatter)]
        if sum(given) > 1:
            raise WrongValue('several sets of points were given; give one of grid, points, scatter')
        samples = ctypes.c_void_p()
        if not any(given):
            return samples
        c.call('HycoSamplesCreate', self._open, ctypes.byref(samples))
        try:
            if grid is not None:
                counts = c.numbers(grid, c.integer()[1]).ravel()
                if len(counts) != len(self.parameters):
                    raise WrongValue(f'a grid of {len(counts)} numbers was given; {len(self.parameters)} are expected, for {", ".join(self.parameters)}')
                c.call('HycoSamplesAddTrainingGrid', samples, c.address(counts))
            elif points is not None:
                for k, mu in enumerate(_points(points, self.parameters).reshape(-1, len(self.parameters))):
                    try:
                        c.call('HycoSamplesAddPoint', samples, c.address(mu))
                    except Error as error:
                        raise type(error)(f'{name}[{k}]: {error}') from None
            else:
                c.call('HycoSamplesAddScattered', samples, c.count(scatter))
        except Error:
            c.call('HycoSamplesDestroy', ctypes.byref(samples))
            raise
        return samples


def _word(value):
    """A value as the command line would have it."""
    if isinstance(value, (bool, np.bool_)):
        return b'true' if value else b'false'
    if isinstance(value, (list, tuple, np.ndarray)):
        return ','.join(_word(v).decode() for v in value).encode()
    return repr(float(value)).encode() if isinstance(value, (float, np.floating)) else str(value).encode()


class _Option(ctypes.Structure):
    """HycoOption of hycosys.h."""
    _fields_ = [(name, ctypes.c_char_p) for name in ('name', 'value', 'initial', 'meaning', 'owner', 'only')]


SECTIONS = ('scene', 'parameter', 'constant', 'body', 'fixed', 'pressure', 'traction', 'force', 'spring', 'gravity', 'rotation', 'contact', 'output', 'history',
            'tie', 'hyco')


def _check_options(entries):
    """Refuses what is neither an entry of a scene nor an option of the library: it would have no effect."""
    n, table = c.count(), ctypes.POINTER(_Option)()
    c.call('HycoGetOptionTable', ctypes.byref(n), ctypes.byref(table))
    known = sorted(o.name for o in table[:n.value])
    for name in entries:
        if not name.startswith(tuple(f'{section}_' for section in SECTIONS)):
            raise WrongValue(f'{name} is not an entry of a scene; these begin with {", ".join(f"{section}_" for section in SECTIONS)}')
        if name.startswith('hyco_') and name.encode() not in known and not _of_solver(name):
            near = c.lib.HycoNearest(name.encode(), c.count(len(known)), (ctypes.c_char_p * len(known))(*known))
            raise WrongValue(f'there is no option {name}' + (f'; did you mean {near.decode()}?' if near else ' (hyco train -help lists them)'))


def _of_solver(name):
    """Whether one of PETSc's solvers in the library reads the option."""
    prefix, reads = ctypes.c_int(), ctypes.c_int()
    c.call('HycoOptionsOfSolver', name.encode(), ctypes.byref(prefix), ctypes.byref(reads))
    return bool(reads.value)


def _where(mu, parameters):
    return ', '.join(f'{name} {value:g}' for name, value in zip(parameters, mu)) or 'no parameters'


def _several(shape):
    return f'{" x ".join(map(str, shape))} points' if shape else 'one point'


def _ranges(parameters):
    return ', '.join(f'{name} {lo:g} to {hi:g}' for name, (lo, hi) in parameters.items()) or 'none'


def _shown(thing, what, **members):
    """<hyco.Kind what; name: value; ...>"""
    members = [f'{name}: {value:g}' if isinstance(value, float) else f'{name}: {value}' for name, value in members.items()]
    return f'<hyco.{type(thing).__name__} {"; ".join([what] + members)}>'


def _stamp(path):
    """Changes with a file."""
    found = os.stat(path)
    return found.st_mtime_ns, found.st_size, found.st_ino


def _unpickled(path, file, contents):
    """The Model of these contents: `file`, if it has them, or a copy."""
    try:
        with open(file, 'rb') as there:
            same = there.read() == contents
    except OSError:
        same = False
    if not same:
        number, file = tempfile.mkstemp('.h5', 'hyco-')
        with os.fdopen(number, 'wb') as copy:
            copy.write(contents)
    model = Model(file)
    model.path = path
    if not same:
        weakref.finalize(model, os.remove, file)
    return model


class Prediction:
    """The answers of a model at one point or at many; values have the shape of the points, `shape`: () for one point.

    mu              (*shape, parameters)
    outputs         {name: value} of the scene's outputs; of a path at its last listed time
    path            {name: value} over the listed times of a path: the largest, or as the output's entry `path` says; else {}
    estimates       {name: estimated absolute error of that output}; NaN: the model has none
    error_u, error_stress, error_forces   estimated relative errors of the fields; NaN: none
    unseen          how far beyond the held-out points' regime (above 3 the estimates are not tested)
    converged       whether the KKT conditions of the reduced system hold
    contact_forces  (*shape, contacts), if they were asked for; else None
    displacement    (*shape, nodes, dim) of the model's nodes (Model.node_tags), if asked for
    data            all members of HycoPrediction (hycorom.h), a structured array; prediction['lambda_max'] is an output or a member
    """

    def __init__(self, mu, data, outputs, parameters, contact_forces=None, displacement=None, paths=False):
        self._paths = paths
        self.mu, self.data, self.shape = mu, data, data.shape
        self.contact_forces, self.displacement = contact_forces, displacement
        self._outputs, self._parameters = outputs, parameters
        self.converged = data['reason'] > 0 if self.shape else bool(data['reason'] > 0)

    def __repr__(self):
        if self.shape:
            return _shown(self, _several(self.shape), outputs=', '.join(self._outputs), converged=f'{np.sum(self.converged)} of {np.size(self.converged)}')
        return _shown(self, _where(self.mu, self._parameters), **self.outputs, total_contact_force=self.total_contact_force, reason=self.reason)

    def _value(self, name, k=None):
        """A member, or item k of one that is an array; a number for one point."""
        value = self.data[name] if k is None else self.data[name][..., k]
        return value if self.shape else value.item()

    def _known(self, name, k=None):
        value = self._value(name, k)
        return np.where(value < 0, np.nan, value) if self.shape else value if value >= 0 else np.nan

    @cached_property
    def outputs(self):
        return {name: self._value('quantity', k) for k, name in enumerate(self._outputs)}

    @cached_property
    def path(self):
        return {name: self._value('path_quantity', k) for k, name in enumerate(self._outputs) if self._paths}

    @cached_property
    def estimates(self):
        return {name: self._known('estimated_error_quantity', k) for k, name in enumerate(self._outputs)}

    error_u = property(lambda self: self._known('estimated_error_u'))
    error_stress = property(lambda self: self._known('estimated_error_sigma'))
    error_forces = property(lambda self: self._known('estimated_error_lambda'))
    unseen = property(lambda self: self._value('unseen'))

    @property
    def total_contact_force(self):
        """Sum of the contact forces."""
        return self['total_contact_force']

    @property
    def reason(self):
        """Why each solve ended, in words."""
        words = np.vectorize(c.reason, otypes=[object])(self.data['reason'])
        return words if self.shape else str(words)

    def __getitem__(self, name):
        return self.outputs[name] if name in self.outputs else self.data[name][()]

    def table(self):
        """{column: values}, a row per point: parameters, outputs, over a path as path_NAME, estimates as NAME_estimate, total_contact_force, converged.
        pandas.DataFrame(prediction.table()) is a table of it."""
        columns = {name: self.mu[..., k] for k, name in enumerate(self._parameters)}
        columns.update(self.outputs)
        columns.update({f'path_{name}': value for name, value in self.path.items()})
        columns.update({f'{name}_estimate': value for name, value in self.estimates.items()})
        columns.update(total_contact_force=self.data['total_contact_force'], converged=self.converged)
        return {name: np.ravel(value) for name, value in columns.items()}


class Model(_Handle):
    """A reduced model from its file; nothing else is needed. It can be pickled, with the file's contents: where the file is not the same, a
    copy is made until the process ends.

    parameters  {name: (lo, hi)} of its training
    outputs     names of the outputs
    units       {name: unit} of the outputs, '' where it is not known
    contacts    names of the contacts
    type        'hybrid', 'bodies', ...
    n_contacts  number of contact forces
    path        the file
    """
    _destroy = 'HycoROMDestroy'
    _collective = False
    training = None  # of Scene.train(): numbers and texts of HycoTraining (hycoreducer.h)

    @c.whole
    def __init__(self, path):
        super().__init__()
        self.path, self._file, self._extrapolate = str(path), os.path.abspath(path), False
        c.call('HycoROMLoad', str(path).encode(), ctypes.byref(self._handle))
        scene, kind = ctypes.c_void_p(), ctypes.c_char_p()
        c.call('HycoROMGetScene', self._handle, ctypes.byref(scene))
        c.call('HycoROMGetType', self._handle, ctypes.byref(kind))
        self.type = kind.value.decode()
        self.parameters = _parameters(scene)
        self.outputs = _names('HycoSceneGetQuantities', scene)
        self.units = dict(zip(self.outputs, _names('HycoSceneGetQuantityUnits', scene)))
        self.contacts = _names('HycoSceneGetContacts', scene)
        times = c.count()
        c.call('HycoSceneGetHistory', scene, ctypes.byref(times), None)
        self._times = times.value
        sizes = [c.count() for _ in range(3)]
        c.call('HycoROMGetSizes', self._handle, *(ctypes.byref(n) for n in sizes))
        self.n_contacts, self._n_nodes, self._dim = (n.value for n in sizes)
        self._stamp = _stamp(self._file)

    def __repr__(self):
        return _shown(self, repr(self.path), type=self.type, parameters=_ranges(self.parameters), outputs=', '.join(self.outputs))

    def __reduce__(self):
        with self._open and open(self._file, 'rb') as file:
            contents = file.read()
        if _stamp(self._file) != self._stamp:
            raise Error(f'{self.path} has changed since the model was loaded; load it again')
        return _unpickled, (self.path, self._file, contents)

    @c.whole
    def predict(self, mu, contact_forces=False, displacement=False, extrapolate=False, check=True):
        """The Prediction at mu: one point (parameters,) or many (..., parameters); or {parameter: values}, a pandas.DataFrame too.
        Under mpiexec all processes must call it together for many points: the same points of all are divided over them, and every process gets
        all answers; other points of each are its own. Ctrl-C ends it between two points. contact_forces, displacement: return these arrays too. extrapolate: accept points outside the ranges. check: raise
        NotConverged if a solve does not converge."""
        handle, mu = self._open, _points(mu, self.parameters)
        handle = self._solver('HycoROMDestroy', 'HycoROMClone', handle)
        shape, n_par = mu.shape[:-1], mu.shape[-1]
        n = int(np.prod(shape))
        data = np.zeros(shape, c.struct('HycoPrediction'))
        forces = np.zeros((*shape, self.n_contacts)) if contact_forces else None
        u = np.zeros((*shape, self._n_nodes, self._dim)) if displacement else None
        if extrapolate != self._extrapolate:
            c.call('HycoROMSetExtrapolate', handle, ctypes.c_int(bool(extrapolate)))
            self._extrapolate = extrapolate
        if shape or contact_forces or displacement:
            where = ('HycoROMSolveShared', World.comm) if shape and World.size > 1 else ('HycoROMSolveMany',)
            c.call(*where, handle, c.count(n), c.count(n_par), c.address(mu), c.address(data), c.address(forces), c.address(u))
        if not shape:  # the one that contacts(), history(), write() are about
            c.call('HycoROMPredict', handle, c.count(n_par), c.address(mu))
            c.call('HycoROMGetPrediction', handle, c.address(data))
        result = Prediction(mu, data, self.outputs, self.parameters, forces, u, self._times > 0)
        if check and not (np.all(result.converged) if shape else result.converged):
            bad = np.flatnonzero(~np.atleast_1d(result.converged).ravel())
            at = mu.reshape(-1, n_par)[bad[0]]
            first = f'points[{bad[0]}], ' if n > 1 else ''
            raise NotConverged(f'{len(bad)} of {n} predictions, the first at {first}{_where(at, self.parameters)}: '
                               f'{c.reason(data.ravel()[bad[0]]["reason"])}', result)
        return result

    @c.whole
    def gradient(self, mu, extrapolate=False):
        """The Gradient of the outputs at mu: one point (parameters,) or many (..., parameters), which this process solves one by one. A
        point of a set without a gradient has nan, and a warning says which; without any the first one's Error is raised."""
        mu = _points(mu, self.parameters)
        shape, points = mu.shape[:-1], mu.reshape(-1, mu.shape[-1])
        size = (len(self.outputs), len(self.parameters))
        outputs, found, lacking, first = np.zeros((len(points), size[0])), {}, {}, None
        for k, point in enumerate(points):
            try:
                outputs[k] = list(self.predict(point, extrapolate=extrapolate, check=bool(not shape)).outputs.values())
            except WrongValue as error:
                raise WrongValue(f'points[{k}]: {error}' if shape else str(error)) from None
            try:
                found[k] = _gradient('HycoROMGetGradient', self._last)
            except Error as error:
                lacking[np.unravel_index(k, shape) if len(shape) > 1 else k] = str(error)
                first = first or (k, error)
        if first and not found:
            raise first[1]
        if first:
            warnings.warn(f'{len(lacking)} of {len(points)} points have no gradient, the first at {_where(points[first[0]], self.parameters)}: {first[1]}',
                          stacklevel=3)

        def spread(column, empty, of):
            """A result of all points, `empty` at those without; its shape at a point is `of`."""
            rows = [found[k][column] if k in found else np.full(of, empty) for k in range(len(points))]
            return np.reshape(rows, shape + of) if rows else np.full(shape + of, empty)

        times, path = (spread(k, np.nan, of) if self._times and found else None for k, of in ((3, (self._times, *size)), (4, size)))
        named = {name: outputs[:, k].reshape(shape)[()] for k, name in enumerate(self.outputs)}
        return Gradient(mu, named, spread(0, np.nan, size), spread(1, False, size), spread(2, 0, ())[()], times, path, lacking)

    @c.whole
    def fit(self, targets, start=None, starts=1, samples=64, kind='brgn', hold=None):
        """The Fit of {output: target}: the parameters within the ranges at which the outputs are closest to the targets, as hyco fit; of
        a path at its last time, and path_OUTPUT over its listed times (the largest, or as the output's entry `path` says).
        It minimises from the `starts` best of `samples` predictions over the ranges, or from `start` alone, by the TAO type `kind`
        (brgn, blmvm); hold: {parameter: value} that are kept. Under mpiexec each process does the same."""
        handle, known = self._solver('HycoROMDestroy', 'HycoROMClone', self._open), self.outputs + ([f'path_{name}' for name in self.outputs] if self._times else [])
        lacking = [name for name in targets if name not in known]
        if lacking or not targets:
            raise WrongValue(f'the targets name {", ".join(lacking) or "no output"}; the outputs are {", ".join(self.outputs)}')
        output = np.array([known.index(name) for name in targets], c.integer()[1])
        target = c.numbers(list(targets.values()))
        mu, found = np.zeros(len(self.parameters)), np.zeros(1, c.struct('HycoFit'))
        start = None if start is None else _one(start, self.parameters)
        lacking = [name for name in hold or {} if name not in self.parameters]
        if lacking:
            raise WrongValue(f'hold names {", ".join(lacking)}; the parameters are {", ".join(self.parameters)}')
        held = c.numbers([(hold or {}).get(name, np.nan) for name in self.parameters])
        c.call('HycoROMFit', handle, c.count(len(output)), c.address(output), c.address(target), c.address(start), c.address(held), c.count(samples),
               c.count(starts), kind.encode(), c.address(mu), c.address(found))
        fit = Fit(mu, self.predict(mu, check=False).outputs, self.parameters, found[0])
        if fit.determined < fit.free:
            warnings.warn(f'{fit.free} parameters are free, and the targets determine {fit.determined} of them or of their combinations: the answer is one of '
                          'many; hold parameters (hold=) or give more targets', stacklevel=3)
        return fit

    # ---- of the last prediction at one point, of this thread

    @c.whole
    def contact_results(self):
        """Of the last single prediction: list of {name, n, n_active, force, moment, area, pressure}, as Solution.contacts."""
        return _records('HycoROMGetContacts', self._last or self._open, 'HycoContactResult')

    @c.whole
    def history(self):
        """Of the last single prediction of a path: its listed times, a structured array; None for other models."""
        return _history('HycoROMGetHistory', self._last or self._open, self.outputs)

    @c.whole
    def whole_displacement(self):
        """Of the last single prediction: (nodes, dim) of the whole mesh, in the mesh file's order."""
        n, at = c.count(), ctypes.c_void_p()
        c.call('HycoROMGetWholeU', self._last or self._open, ctypes.byref(n), ctypes.byref(at))
        return c.copied(at, (n.value, self._dim))

    @c.whole
    def node_tags(self):
        """Of the last single prediction: the mesh file's tags of the nodes of Prediction.displacement."""
        n, tags = c.count(), ctypes.c_void_p()
        c.call('HycoROMGetRID', self._last or self._open, ctypes.byref(n), ctypes.byref(tags), None, None, None, None)
        return c.copied(tags, n.value, c.integer()[1])

    @c.whole
    def write(self, path):
        """Writes the last single prediction on the whole mesh to PATH.xdmf with PATH.h5, or PATH.vtkhdf."""
        c.call('HycoROMWrite', self._last or self._open, str(path).encode())
