"""The settings of the sweep: the scenes' training and test points, and the options of training."""
import itertools
import math
import random
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Setting:
    """One set of options: the model's type, and its options by name (without -hyco_)."""
    type: str
    training: str          # the case's training set
    options: tuple = ()

    @property
    def label(self):
        words = [self.type, self.training, *(f"{name} {value}" for name, value in self.options)]
        return ", ".join(w for w in words if w)

    def arguments(self):
        return ["-hyco_model_type", self.type, *itertools.chain(*((f"-hyco_{n}", str(v)) for n, v in self.options))]


@dataclass
class Case:
    name: str
    scene: list            # arguments that name the scene and its mesh
    training: dict         # name: arguments of the training points
    test: list  # arguments of the unseen points, in runs that share a stiffness where the scene has such points
    names: list            # the parameters
    single: list  # points, each with its own stiffness
    wanted: list = field(default_factory=list)  # (text, {error: bound}): combined requirements of an engineer
    settings: list = field(default_factory=list)
    batch: list = None     # the set that is timed; None: test
    ramp: tuple = ()  # a parameter and its value at which the set has a ramp of the others, after another value


def combine(type_, training, **choices):
    names = list(choices)
    for values in itertools.product(*choices.values()):
        yield Setting(type_, training, tuple(zip(names, values)))


def rope(nodes, mesh, quick):
    draw = random.Random(1)
    points = [[draw.uniform(0.05, 0.25), draw.uniform(-0.05, 0.5)] for _ in range(20)]
    case = Case(f"rope, {nodes} nodes", ["-scene", "examples/rope/paper.yaml", "-scene_mesh", mesh],
                {"10 x 12": ["-grid", "10,12", "-grid_type", "centred"], "12 x 12 Chebyshev": ["-grid", "12,12", "-grid_type", "chebyshev"],
                 "20 x 8 Chebyshev": ["-grid", "20,8", "-grid_type", "chebyshev"]},
                ["-grid", "8,10" if quick or nodes > 1000 else "20,24"], ["mu1", "mu2"], points,
                [("u 0.01 % and the RID's forces 1 %, means", {"u_mean": 1e-4, "lambda_rid_mean": 1e-2})])
    if quick:
        case.settings = [*combine("hybrid", "10 x 12", pod_tol=["1e-7", "1e-11"], hybrid=["all"]),
                         *combine("projection", "10 x 12", pod_tol=["1e-7"]), Setting("bodies", "20 x 8 Chebyshev")]
        return case
    tolerances = ["1e-5", "1e-7", "1e-9", "1e-11", "1e-13"]
    deim, hybrid = ["deim", "qdeim"], ["all", "rank"] if nodes <= 1000 else ["all"]
    case.settings = [*combine("hybrid", "10 x 12", pod_tol=tolerances, rid_layers=[0, 1, 2, 4], deim_type=deim, hybrid=hybrid),
                     *combine("projection", "10 x 12", pod_tol=tolerances),
                     *combine("projection", "10 x 12", pod_tol=tolerances, dual=["snapshots"])]
    if nodes <= 1000:
        case.settings += [Setting("bodies", name) for name in list(case.training)[1:]]
    return case


def pellet(name, mesh, quick):
    loads = [k / 25 for k in range(1, 26)]
    listed = ["-values_load", ",".join(f"{v:g}" for v in loads)]

    def radii(*values):
        return ["-values_radius", ",".join(f"{v:g}" for v in values), *listed]

    def chebyshev(n):
        nodes = [4.06 - 0.04 * math.cos((2 * k + 1) * math.pi / (2 * n)) for k in range(n)]
        return ["-values_radius", ",".join(f"{v:.17g}" for v in nodes), "-values_load", "0.2,0.4,0.5,0.6,0.7,0.8,0.9,1"]

    draw = random.Random(1)
    points = [[draw.uniform(4.025, 4.095), draw.uniform(0.6, 1)] for _ in range(3 if quick or name == "C" else 10)]
    case = Case(f"pellet, mesh {name}", ["-scene", "examples/pellet/paper.yaml", "-scene_mesh", mesh],
                {"5 radii": radii(4.02, 4.04, 4.055, 4.075, 4.1),
                 "9 radii": radii(4.02, 4.03, 4.04, 4.05, 4.065, 4.07, 4.08, 4.09, 4.1),
                 **{f"{n} Chebyshev radii": chebyshev(n) for n in (2, 4, 6, 8)}},  # even numbers, so that 4.06 is not a node
                radii(*((4.06,) if name == "C" or quick else (4.06, 4.033))), ["radius", "load"], points,
                [("largest errors on the RID: u 1 %, sigma_11 5 %", {"u_rid_max": 0.01, "sigma_11_max": 0.05}),
                 ("largest errors on the RID: u 0.15 %, sigma_11 0.25 %", {"u_rid_max": 0.0015, "sigma_11_max": 0.0025}),
                 ("largest error of all forces: 1e-6", {"lambda_max": 1e-6})])
    case.batch, case.ramp = radii(4.033, 4.06, 4.045, 4.087), ("radius", 4.06)
    if quick:
        case.training["5 radii"] = ["-values_radius", "4.02,4.04,4.07,4.1", "-values_load", "0.2,0.5,0.7,0.85,1"]
        case.settings = [*combine("hybrid", "5 radii", pod_tol=["1e-7", "1e-10"]), Setting("bodies", "4 Chebyshev radii")]
        return case
    bodies = [Setting("bodies", f"{n} Chebyshev radii") for n in (2, 4, 6, 8)]
    tolerances = ["1e-5", "1e-7", "1e-9", "1e-10", "1e-12"]
    if name == "C":
        case.settings = [*combine("hybrid", "9 radii", pod_tol=["1e-10", "1e-12"], rid_layers=[1]),
                         *combine("hybrid", "9 radii", pod_tol=["1e-12"], rid_layers=[2]), bodies[1]]
        return case
    case.settings = [
        *combine("hybrid", "9 radii", pod_tol=tolerances, rid_layers=[1, 2]),
        *combine("hybrid", "9 radii", pod_tol=tolerances[1::2], rid_layers=[3]),
        *combine("hybrid", "9 radii", pod_tol=tolerances[1::2], rid_contact_extension=["0", "0.3"]),
        *combine("hybrid", "9 radii", pod_tol=tolerances[1::2], deim_type=["qdeim"]),
        *combine("hybrid", "9 radii", pod_tol=tolerances[1::2], hybrid=["rank"]),
        *combine("hybrid", "5 radii", pod_tol=tolerances[1::2]),
        *combine("projection", "9 radii", pod_tol=tolerances[1::2]), *bodies]
    return case
