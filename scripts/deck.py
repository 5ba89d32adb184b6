"""A deck of Abaqus or CalculiX as a draft of scene.yaml (scripts/convert --scene): what has a counterpart is converted; each keyword that changes
the mechanics and has none is listed with its line."""
import bisect
import collections
import math
import re

from facing import Surface, adjusted
from keywords import PROCEDURES, WHY

STRUCTURAL = re.compile(r"(S[3-9]|STRI|SAX|SC\d|CSS|M3D|SFM|B[23]|PIPE|ELBOW|T[23]D|CONN|SPRING|DASHPOT|MASS|ROTARYI|GAP|ITS|R3D|R2D|RAX|RB|D$|COH|DCOUP|F3D|U\d|MCL|CMD)")
VARIANTS = ((r"(C3D|CP[ES]G?|CAX)\d+[A-Z]*R", "cells are fully integrated, without hourglass control"), (r"(C3D8|CP[ES]4|CAX4)I", "no incompatible modes: bending of such cells is stiffer"),
            (r"(C3D|CP[ES]G?|CAX)\d+[A-Z]*H", "no hybrid cells: nearly incompressible ones of first order do not lock (element: bbar)"),
            (r"(C3D|CP[ES]G?|CAX)\d+[A-Z]*M", "cells are the ordinary ones of second order"), ("CPEG", "plane strain, without strain across the plane"))
AXES = "xyz"
NAMED = {"ENCASTRE": (1, 2, 3, 4, 5, 6), "PINNED": (1, 2, 3), "XSYMM": (1, 5, 6), "YSYMM": (2, 4, 6), "ZSYMM": (3, 4, 5), "XASYMM": (2, 3, 4), "YASYMM": (1, 3, 5),
         "ZASYMM": (1, 2, 6), "NOWARP": (), "NOOVAL": (), "NODEFORM": ()}


class DeckError(Exception):
    """A user's error, in one line."""


def structural(name):
    """Whether elements of this type are no solids: shells, beams, springs, rigid facets."""
    return bool(STRUCTURAL.match(name.upper()))


def real(word, default=0.0):
    """A number; D for the exponent is Fortran's."""
    return float(word.upper().replace("D", "E")) if word else default


def item(row, k, default=0.0):
    return real(row[k], default) if k < len(row) else default


def said(value):
    """A number as text."""
    return f"{value + 0.0:.12g}"  # not -0


def product(value, name):
    """An expression for a value times a function of time."""
    return said(value) if not name else name if value == 1 else f"-{name}" if value == -1 else f"{said(value)}*{name}"


# What a step says of a load or support: its value (None: it ends; HELD: it keeps its present value), the value of an absolute amplitude's 1, the
# amplitude's name
Given = collections.namedtuple("Given", "step value unit amplitude block")
HELD = "held"
ADDED = ("force", "body force", "pressure", "traction", "gravity", "rotation")  # given twice in one step they are added


def value_at(rows, t, after):
    """The value of a function [(t, value)], linear between rows and constant outside; at a jump (two rows of one time) before or after it."""
    k = (bisect.bisect_right if after else bisect.bisect_left)([row[0] for row in rows], t)
    if k == 0 or k == len(rows):
        return rows[min(k, len(rows) - 1)][1]
    (a, v), (b, w) = rows[k - 1:k + 1]
    return v if a == t else w if b == t else v + (w - v) * (t - a) / (b - a)


def summed(parts, begin, end):
    """The sum of functions [(factor, rows)] from one time to another, as rows."""
    near, out = 1e-9 * (end - begin), []
    for t in sorted({begin, end, *(t for _, rows in parts for t, _ in rows if begin + near < t < end - near)}):
        for after in (False, True):
            if (after or t > begin) and (t < end or not after):
                row = (t, sum(factor * value_at(rows, t, after) for factor, rows in parts))
                if not out or out[-1] != row:
                    out.append(row)
    return out


def bare(rows):
    """The rows without those within a constant part."""
    rows = [row for k, row in enumerate(rows) if not 0 < k < len(rows) - 1 or not rows[k - 1][1] == row[1] == rows[k + 1][1]]
    return rows[:-1] if len(rows) > 1 and rows[-1][1] == rows[-2][1] and (len(rows) == 2 or rows[-2][0] > rows[-3][0]) else rows


def steep(rows):
    """The rows with increasing times: a jump becomes a line over a millionth of what follows."""
    out = [(t + max(1e-6 * (rows[k + 1][0] - t), 1e-13 * t) if k and t == rows[k - 1][0] else t, v) for k, (t, v) in enumerate(rows)]
    return bare(out)


def moment(t):
    """A time as text, with the digits of a steep line."""
    return f"{t + 0.0:.15g}"


def quoted(text):
    return f'"{text}"' if re.search(r"[:#,\[\]{}?&*!|>'%@`]|^[-\s]|^$", text) and not re.fullmatch(r"-?[\d.e+-]+", text) else text


def piecewise(rows, at):
    """A quantity given at temperatures, linear between them, as an expression: rows (value, temperature)."""
    rows = sorted(rows, key=lambda r: r[1])
    text = said(rows[-1][0])
    for (v, t), (w, u) in reversed(list(zip(rows, rows[1:]))):
        text = f"({at} < {said(u)} ? {said(v)}+{said((w - v) / (u - t))}*({at}-{said(t)}) : {text})"
    return f"({at} < {said(rows[0][1])} ? {said(rows[0][0])} : {text})" if len(rows) > 1 else text


class Draft:
    """The scene of a deck. The mesh m gets the groups that the scene names; `left` has what is not converted: (block, text)."""

    def __init__(self, m, name, sides_of, plain, frictionless=False):
        self.m, self.deck, self.name, self.sides_of, self.plain = m, m.deck, name, sides_of, plain
        self.axes = m.deck.axes  # the deck's axes that are x, y and z of the draft
        self.left, self.notes = {}, []
        self.bodies, self.materials, self.body_of, self.thickness = {}, {}, {}, 1.0
        self.interactions, self.contacts, self.ties, self.rigids, self.loose, self.springs = {}, {}, {}, [], {}, {}
        self.material_now = self.interaction_now = None
        self.amplitudes, self.steps, self.initial = {}, [], {}
        self.given = {}    # by kind and keyword: what steps say of each degree of freedom, face or body
        self.targets = {}  # likewise, by name: the axes, and their nodes or faces, that the deck names together
        self.entry = {}    # by section, group and axis: factors and functions of time
        self.kept = {"facet_groups": {}, "node_groups": {}, "point_groups": {}}
        self.ways, self.axis, self.differs, self.early = {}, None, {}, set()  # early: blocks of supports before the first step
        self.groups, self.tables, self.skipped, self.frictionless = set(), {}, False, frictionless

    def leave(self, block, what, why="has no counterpart"):
        """Notes what is not converted, once for each keyword and reason."""
        self.left.setdefault((what, why), [block, 0])[1] += 1

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)

    def told(self):
        """A line for each entry that is not converted."""
        for (what, why), (block, n) in sorted(self.left.items(), key=lambda e: (len(e[1][0].place.split(",")), e[1][0].file, e[1][0].line)):
            yield f"{block.place}: {what}: {why}" + (f" ({n} times)" if n > 1 else "")

    # ------------------------------------------------------------------------------------------------ sets

    def members(self, word, kinds):
        """The keys of a set's name or number, of nodes or cells; None: there is none."""
        word = word.upper()
        for sets in kinds:
            if word in sets:
                return sets[word]
        instance, dot, number = word.rpartition(".")
        number = number if dot else word
        if re.fullmatch(r"\d+", number):
            return [(instance, int(number)) if dot else int(number)]
        return None

    def nodes(self, word, block):
        """Keys of the nodes of a set or a number; a set of elements or a surface has those of its cells."""
        found = self.members(word, [self.deck.nsets])
        if found is None:
            raise DeckError(f"{block.place}: *{block.word} names {word}, which is no set of nodes")
        return found

    def cells(self, word, block):
        found = self.members(word, [self.deck.elsets])
        if found is None:
            raise DeckError(f"{block.place}: *{block.word} names {word}, which is no set of elements")
        return [c for c in found if c in self.m.cells]

    def free_name(self, name, taken):
        name, k = self.plain(name), 1
        while name in taken and k < 10000:
            name, k = re.sub(r"_\d+$", "", name) + f"_{k}", k + 1
        return name

    def alone(self, word):
        """Whether a word is the number of a node or cell, not the name of a set."""
        word = word.upper()
        return bool(re.fullmatch(r"(.*\.)?\d+", word)) and word not in self.deck.nsets and word not in self.deck.elsets

    def node_name(self, word, block, what, points=False):
        """The name of a group of these nodes; single nodes of one block with the same `what` are one group. points: on which forces act."""
        name = self.plain(f"{block.word}_{block.line}_{what}" if self.alone(word) else word.upper())
        if points:
            return name + "_points"
        return name + "_nodes" if name in self.bodies or name in map(self.plain, self.deck.surfaces) else name  # the name of other groups too

    def facet_group(self, word, block, other):
        """The group of a surface; of one that goes round an edge, as the free skin of a set of elements does, the facets that face the other surface."""
        word, other = word.upper(), self.deck.surfaces.get(other.upper(), [])
        members = self.deck.surfaces.get(word, [])
        sides = self.sides_of(self.m, members)
        mine = Surface(self.m, sides, self.dim()) if sides and other else None
        if mine and mine.turns():
            faces = mine.facing(Surface(self.m, self.sides_of(self.m, other), self.dim()))
            if 0 < len(faces) < len(sides):
                self.note(f"{block.place}: *{block.word}: the {len(faces)} of {len(sides)} facets of {word} that face the other surface are taken")
                return self.group("contact", self.plain(word), [sides[k][:2] for k in faces], True)
        if members or word in self.deck.surfaces:
            self.kept["facet_groups"][self.plain(word)] = members
        elif word in self.deck.nsets:
            self.kept["node_groups"][self.plain(word)] = self.deck.nsets[word]
        else:
            raise DeckError(f"{block.place}: *{block.word} names {word}, which is no surface (only those of elements and nodes are read)")
        self.groups.add(self.plain(word))
        return self.plain(word)

    def axis_of(self, d):
        """The axis of the draft of a degree of freedom of displacement; rotations are numbers."""
        return AXES[self.axes.index(d - 1)] if d <= 3 else d

    def dim(self):
        return 3 if any(t.startswith("C3D") for t in self.deck.types) else 2

    def quadratic(self):
        """Whether there are cells of second order, for which node-to-surface contact is not available."""
        sizes = [int(re.match(r"(?:C3D|CP[SE]|CAX)(\d+)", t)[1]) for t in self.deck.types if re.match(r"(?:C3D|CP[SE]|CAX)\d", t)]
        return max(sizes, default=0) > (8 if self.dim() == 3 else 4)

    # ------------------------------------------------------------------------------------------------ reading

    def make(self):
        """Reads the blocks in order and sets the mesh's groups."""
        for name, block in self.deck.types.items():
            if structural(name) and (name != "SPRING1" or all(b.word != "SPRING" for b in self.deck.rest)):
                self.leave(block, f"*ELEMENT, TYPE={name}", "these elements are left out; a scene has solids only" +
                           ("; a bar is a solid of its section, or spring: with EA over its length where it holds a point" if re.match(r"T[23]D", name) else ""))
            for pattern, why in VARIANTS:
                if re.match(pattern, name):
                    self.leave(block, f"*ELEMENT, TYPE={name}", why)
        for entry in self.deck.left:
            self.leave(*entry)
        for block in self.deck.rest:
            try:
                self.read(block)
            except (KeyError, ValueError, IndexError) as error:
                raise DeckError(f"{block.place}: *{block.word} is not as it should be ({type(error).__name__}: {error})") from None
        self.finish()

    def read(self, block):
        """What keywords.READ has is read by the method on_KEYWORD; what is not taken stands in the list of the reader already."""
        name = "on_" + re.sub(r"\W", "_", block.word).lower()
        if block.word in PROCEDURES:
            if self.steps and not self.skipped:
                self.steps.pop()
            self.skipped = True  # the loads of this step too
        elif block.word == "AMPLITUDE" and not block.taken:
            self.amplitudes[block.parameters["NAME"].upper()] = None
        elif block.taken and hasattr(self, name):
            getattr(self, name)(block)

    def on_material(self, block):
        self.material_now = self.materials.setdefault(block.parameters["NAME"].upper(), {})

    def on_surface_interaction(self, block):
        self.interaction_now = self.interactions.setdefault(block.parameters["NAME"].upper(), {})

    # ---- materials

    def on_elastic(self, block):
        self.material_now["elastic"] = [(item(r, 0), item(r, 1), item(r, 2)) for r in block.rows]

    def on_expansion(self, block):
        self.material_now["expansion"] = ([(item(r, 0), item(r, 1)) for r in block.rows], real(block.parameters.get("ZERO")), block)

    def on_density(self, block):
        self.material_now["density"] = item(block.rows[0], 0)
        if len({item(r, 0) for r in block.rows}) > 1:
            self.leave(block, "*DENSITY that depends on the temperature", "the first row is taken")

    def on_plastic(self, block):
        rate, given = real(block.parameters.get("RATE")), self.material_now.get("plastic")
        if rate > 0:
            self.leave(block, f"*PLASTIC, RATE={said(rate)}", "yielding does not depend on the rate: the table of the lowest rate is taken")
        if given and rate > given[2]:
            return
        rows = [(item(r, 0), item(r, 1)) for r in block.rows]
        if len({item(r, 2) for r in block.rows}) > 1:
            self.leave(block, "*PLASTIC that depends on the temperature", "the rows of the first temperature are taken")
            rows = [(item(r, 0), item(r, 1)) for r in block.rows if item(r, 2) == item(block.rows[0], 2)]
        self.material_now["plastic"] = (rows, block, rate)

    def harden(self, rows, block):
        """What linear hardening is of the rows of *PLASTIC."""
        if len(rows) > 2:
            self.leave(block, "*PLASTIC with more than two rows", "the draft hardens linearly from the first row to the last; see j2 in materials.md")
        elif len(rows) == 2:
            self.note(f"{block.place}: *PLASTIC: hardening continues beyond the last row, where the deck is perfectly plastic")

    def on_creep(self, block):
        material = self.material_now
        law = block.parameters.get("LAW", "STRAIN").upper()
        row = block.rows[0] if block.rows else []
        a, n, m = item(row, 0), item(row, 1), item(row, 2)
        if len(block.rows) > 1 or not row:
            self.leave(block, f"*CREEP, LAW={law} of {len(block.rows)} rows", WHY["CREEP, LAW"])
            return
        if m and law != "STRAIN":
            self.note(f"{block.place}: *CREEP in time: under changing stress strain_hardening differs from it")
        material["creep"] = (a, n, m)
        if "plastic" in material:
            self.note(f"{block.place}: *CREEP beside *PLASTIC: both act at any stress, as in Abaqus; in CalculiX creep acts above the yield stress alone")

    # ---- sections and bodies

    def on_solid_section(self, block):
        p = block.parameters
        name = p["ELSET"].upper()
        keys = self.cells(f"{block.instance}.{name}" if block.instance else name, block)
        thick = (item(block.rows[0], 0) if block.rows else 0) or 1.0
        if self.dim() == 2 and not any(t.startswith("CAX") for t in self.deck.types):
            if self.bodies and thick != self.thickness:
                self.leave(block, "*SOLID SECTION of another thickness", "all bodies have one thickness, which is 1")
            elif thick != 1:
                self.note(f"{block.place}: *SOLID SECTION: the thickness {said(thick)} is 1 here: forces of *CLOAD are divided by it, and so are reactions and contact forces")
            self.thickness = thick if not self.bodies else self.thickness
        alone = sum(b.word == "SOLID SECTION" and b.instance == block.instance for b in self.deck.rest) == 1
        title = self.free_name((block.instance if alone else f"{block.instance}.{name}") if block.instance else name, self.bodies)
        self.bodies[title] = (keys, p.get("MATERIAL", "").upper(), block)
        for key in keys:
            self.body_of[key] = title

    def on_spring(self, block):
        """Springs from points to the ground, of elements SPRING1."""
        name, rows = block.parameters["ELSET"].upper(), [row for row in block.rows if any(row)]
        nodes = self.deck.nsets.get(f"{block.instance}.SPRING1 {name}" if block.instance else "SPRING1 " + name, [])
        axis = self.axis_of(int(item(rows[0], 0))) if len(rows) == 2 else ""
        if not nodes or self.formulation() == "axisymmetric" or len(set(nodes)) < len(nodes) or not self.used.issuperset(nodes) or axis not in tuple(AXES[:self.dim()]):
            self.leave(block, "*SPRING", WHY["SPRING"])
            return
        self.springs.setdefault(self.group("force", self.plain(name) + "_points", nodes, True), {})[axis] = item(rows[1], 0)

    # ---- contact, ties, rigid bodies

    def surfaces(self, row, block):
        """The groups of a slave and a master; None, with a note, if one of them has no solid behind it."""
        if len(row) < 2:
            raise DeckError(f"{block.place}: *{block.word} needs two surfaces, the slave first")
        for word in row[:2]:
            found = self.deck.surfaces.get(word.upper())
            if found == [] or any(cell not in self.m.cells for cell, _ in found or ()) or any(b.word == "SURFACE" and b.parameters.get("NAME", "").upper() == word.upper() for b in self.deck.rest):
                self.leave(block, f"*{block.word} with a surface without solids", WHY["SURFACE, TYPE"])
                return None
        return [self.facet_group(w, block, other) for w, other in (row[:2], row[1::-1])]

    def on_contact_pair(self, block):
        p = block.parameters
        interaction = p.get("INTERACTION", "").upper()
        if self.steps:
            self.leave(block, "*CONTACT PAIR in a step", "contacts act from the beginning")
        for row in block.rows:
            row = [w for w in row if w]
            both = self.surfaces(row, block)
            if not both:
                continue
            slave, master = both
            if "TIED" in p:
                self.ties[self.free_name(f"{slave}_{master}", self.ties)] = (slave, master, None)
                continue
            if "ADJUST" in p:
                self.adjust(block, slave, master)
            whole = p.get("TYPE", "NODE TO SURFACE").upper() != "NODE TO SURFACE"
            self.contacts[self.free_name(f"{slave}_{master}".lower(), self.contacts)] = (slave, master, interaction, whole)

    def surface(self, name):
        """The facets of a group of the draft; None of a group of nodes."""
        sides = self.sides_of(self.m, self.kept["facet_groups"].get(name, []))
        return Surface(self.m, sides, self.dim()) if sides else None

    def nodes_of(self, name):
        """The nodes of a group of the draft, in the order of its facets."""
        sides = self.sides_of(self.m, self.kept["facet_groups"].get(name, []))
        return list(dict.fromkeys(n for *_, nodes in sides for n in nodes)) or self.kept["node_groups"].get(name, [])

    def adjust(self, block, slave, master):
        """*CONTACT PAIR, ADJUST: nodes of the slave nearer than a clearance, or of a set, are moved onto the master."""
        given, nodes = block.parameters["ADJUST"], self.nodes_of(slave)
        near = real(given) if re.fullmatch(r"[\d.eEdD+-]+", given) else None
        chosen = set(self.nodes(given, block)) if near is None else ()
        moved = adjusted(self.m, nodes, self.surface(master), lambda n, clearance: clearance <= near if near is not None else n in chosen)
        self.note(f"{block.place}: *CONTACT PAIR, ADJUST: {moved} of {len(nodes)} slave nodes are moved onto the master, in mesh.msh")

    def on_contact_inclusions(self, block):
        if not block.rows or not all(len(r) > 1 and r[0] and r[1] for r in block.rows):
            self.leave(block, "*CONTACT INCLUSIONS", WHY["CONTACT"])
            return
        for row in block.rows:
            both = self.surfaces(row, block)
            if not both:
                continue
            slave, master = both
            self.contacts[self.free_name(f"{slave}_{master}".lower(), self.contacts)] = (slave, master, "", True)

    def on_contact(self, block):
        if not any(b.word == "CONTACT INCLUSIONS" for b in self.deck.rest):
            self.leave(block, "*CONTACT", WHY["CONTACT"])

    def on_clearance(self, block):
        pair = {self.plain(block.parameters.get(k, "").upper()) for k in ("MASTER", "SLAVE")}
        for contact in self.contacts.values():
            if set(contact[:2]) == pair and "VALUE" in block.parameters:
                self.loose[contact[:2]] = real(block.parameters["VALUE"])
                return
        self.leave(block, "*CLEARANCE")

    def on_tie(self, block):
        for row in block.rows:
            both = self.surfaces([w for w in row if w], block)
            reach = block.parameters.get("POSITION TOLERANCE")
            if both:
                self.ties[self.free_name(block.parameters.get("NAME", "tie"), self.ties)] = (*both, real(reach) if reach else None)
                far = self.reach(*both) if block.parameters.get("ADJUST", "").upper() == "NO" else None
                if far and far[0] > 1e-6 * far[1]:
                    self.leave(block, "*TIE, ADJUST=NO of surfaces with a gap", "tied nodes are moved onto the master, without strain")

    def on_rigid_body(self, block):
        p = block.parameters
        found = [self.nodes(p[k], block) for k in ("NSET", "TIE NSET", "PIN NSET") if k in p]
        if "ELSET" in p:
            found.append([n for c in self.cells(p["ELSET"], block) for n in self.m.cells[c][1]])  # rigid facets are left out
        at = p.get("REF NODE", "")
        self.rigids.append((block, sorted({n for keys in found for n in keys}, key=str), self.nodes(at, block)[0] if at else None,
                            self.nodes(p["ROT NODE"], block)[0] if "ROT NODE" in p else None, {1, 2, 3}))

    def on_coupling(self, block):
        p, place = block.parameters, self.deck.rest.index(block)
        after = self.deck.rest[place + 1] if place + 1 < len(self.deck.rest) else block
        surface = p.get("SURFACE", "").upper()
        if after.word != "KINEMATIC" or surface not in self.deck.surfaces and surface not in self.deck.nsets:
            self.leave(block, "*COUPLING", WHY["COUPLING"])
            return
        nodes = self.deck.nsets.get(surface) or [n for *_, facet in self.sides_of(self.m, self.deck.surfaces[surface]) for n in facet]
        held = {d for row in after.rows for d in range(int(row[0]), int(item(row, 1, int(row[0]))) + 1)} or {1, 2, 3}
        self.rigids.append((block, sorted(set(nodes), key=str), self.nodes(p["REF NODE"], block)[0], None, held))

    # ---- steps

    def on_step(self, block):
        self.skipped = False
        self.steps.append({"period": 1.0, "ramp": True, "creeps": False, "variation": block.parameters.get("AMPLITUDE", "").upper(), "seen": set()})

    def procedure(self, block):
        at_once = block.word == "VISCO" or block.word != "STATIC" and "STEADY STATE" not in block.parameters
        if self.steps:
            step = self.steps[-1]
            step.update(period=item(block.rows[0], 1) or 1.0 if block.rows else 1.0, ramp=(step["variation"] or ("STEP" if at_once else "RAMP")) == "RAMP",
                        creeps=at_once and block.parameters.get("CREEP", "").upper() != "NONE")

    on_static = on_visco = procedure

    def on_coupled_temperature_displacement(self, block):
        self.leave(block, f"*{block.word}", "temperatures are given, not solved for")
        self.procedure(block)

    def on_amplitude(self, block):
        """(rows, whether in total time, whether its values replace those of the loads); None: its loads follow the step's default."""
        p, name = block.parameters, block.parameters["NAME"].upper()
        kind = p.get("DEFINITION", "TABULAR").upper()
        numbers = [real(w) for row in block.rows for w in row if w]
        if not numbers:
            self.amplitudes[name] = None
            self.leave(block, "*AMPLITUDE without rows", WHY["AMPLITUDE, USER"])
            return
        rows = [(real(p.get("BEGIN")) + real(p["FIXED INTERVAL"]) * k, v) for k, v in enumerate(numbers)] if kind == "EQUALLY SPACED" else list(zip(numbers[::2], numbers[1::2]))
        if any(b[0] < a[0] for a, b in zip(rows, rows[1:])):
            raise DeckError(f"{block.place}: the times of *AMPLITUDE {name} do not increase")
        if kind == "SMOOTH STEP":
            self.leave(block, "*AMPLITUDE, DEFINITION=SMOOTH STEP", "it is linear between its rows, at which it is as in the deck")
        self.amplitudes[name] = ([(t + real(p.get("SHIFTX")), v + real(p.get("SHIFTY"))) for t, v in rows], p.get("TIME", "").upper().startswith("TOTAL"),
                                 p.get("VALUE", "").upper() == "ABSOLUTE")

    # ---- loads and supports, step by step

    def begun(self, block, *kinds):
        """Whether the loads of a block count; OP=NEW of the first block of its keyword in a step ends those of the steps before."""
        if self.skipped:
            return False
        new = block.parameters.get("OP", "MOD").upper() == "NEW"
        if self.steps and block.word in self.steps[-1]["seen"]:
            if new and ("new", block.word) not in self.steps[-1]["seen"]:
                self.leave(block, f"*{block.word}, OP=NEW after one without it in a step", "only the first of a step ends earlier loads")
        elif self.steps:
            self.steps[-1]["seen"].update({block.word, *([("new", block.word)] if new else [])})
            if new and block.word == "DLOAD" and any(self.given.get((kind, "DSLOAD")) for kind in kinds):
                self.note(f"{block.place}: *DLOAD, OP=NEW: loads of *DSLOAD stay, as in Abaqus; CalculiX ends them too")
            for kind in kinds if new else ():
                given = self.given.get((kind, block.word), {})
                for atom, specs in given.items():
                    given[atom] = specs + (Given(len(self.steps), None, 0, "", block),) if len(self.steps) > 1 and specs else ()
        return True

    def put(self, kind, atoms, value, block, unit=1.0):
        """What loads or supports are from this step on: of nodes and axes, faces or bodies."""
        given, now, known = self.given.setdefault((kind, block.word), {}), max(len(self.steps), 1), {}
        said_now = Given(now, value, unit, block.parameters.get("AMPLITUDE", "").upper(), block)
        if not self.steps:
            self.early.add(block)
        for atom in atoms:
            before = given.get(atom, ())
            if before not in known:
                kept = before if kind in ADDED else tuple(g for g in before if g.step < now or g.value is None)
                twice = [g for g in before if g.step == now and g.value not in (None, HELD) and (g.block in self.early) == (block in self.early)]
                if kind in ADDED and any(g.amplitude != said_now.amplitude for g in twice):
                    self.leave(block, f"*{block.word} twice in a step, with several amplitudes", "the sum is taken")
                elif kind not in ADDED and any(g.value != value or value and g.amplitude != said_now.amplitude for g in twice):
                    self.leave(block, f"*{block.word} twice in a step, with several values", "the last one counts")
                known[before] = (*kept, said_now)
            given[atom] = known[before]

    def aim(self, kind, block, name, axis, members):
        """Names nodes or faces that have a value in common, at present."""
        self.targets.setdefault((kind, block.word), {}).setdefault(name, {}).setdefault(axis, []).extend(members)

    def on_boundary(self, block):
        if not self.begun(block, "fixed"):
            return
        p, dim = block.parameters, self.dim()
        for row in block.rows:
            row = row + [""] * (4 - len(row))
            if row[1].upper() in NAMED:
                dofs, value = NAMED[row[1].upper()], 0.0
            else:
                first = int(row[1] or 1)
                dofs, value = range(first, int(row[2] or first) + 1), real(row[3])
            nodes = self.nodes(row[0], block)
            if any(d > 6 for d in dofs):
                self.leave(block, f"*BOUNDARY of degree of freedom {max(dofs)}", "only displacements are prescribed")
            name = self.node_name(row[0], block, "_".join(map(str, dofs)) + (f"_{said(value)}" if value else ""))
            for d in dofs:
                axis = self.axis_of(d)
                moves = axis in tuple(AXES[:dim])
                mine = nodes if moves else [n for n in nodes if n not in self.used]
                if "FIXED" in p:
                    mine = [n for n in nodes if self.given.get(("fixed", "BOUNDARY"), {}).get((n, axis))]
                    if moves and self.used.intersection(nodes) - set(mine):
                        self.leave(block, "*BOUNDARY, FIXED of what was free", "prescribe the displacement, as a number or an expression")
                self.put("fixed", [(n, axis) for n in mine], HELD if "FIXED" in p else value, block)
                held = [n for n in mine if n in self.used]
                if moves and held:
                    self.aim("fixed", block, name, axis, held)

    def on_cload(self, block):
        if not self.begun(block, "force"):
            return
        for row in block.rows:
            nodes, d = list(dict.fromkeys(self.nodes(row[0], block))), int(row[1])
            axis = self.axis_of(d)
            if not self.used.issuperset(nodes) or axis not in tuple(AXES[:self.dim()]):
                self.leave(block, "*CLOAD on a reference point or a rotation", "a load on a rigid or coupled body: see contact type rigid, or a traction")
                continue
            self.put("force", [(n, axis) for n in nodes], item(row, 2) / self.thickness, block, 1 / self.thickness)
            self.aim("force", block, self.node_name(row[0], block, f"{d}_{said(item(row, 2))}", True), axis, nodes)

    def body_groups(self, word, block):
        """The bodies that a set of elements consists of; None if it divides one."""
        keys = set(self.cells(word, block)) if word else set(self.body_of)
        mine = [title for title, (cells, _, _) in self.bodies.items() if keys.intersection(cells)]
        return mine if mine and all(keys.issuperset(self.bodies[t][0]) for t in mine) else None

    def direction(self, row, block, kind, mine):
        """The direction of a load, of length 1."""
        size = math.hypot(*(item(row, k) for k in (3, 4, 5))) or 1.0
        way, now = [item(row, 3 + c) / size for c in range(3)], len(self.steps)
        for key in mine:
            step, before, _ = self.ways.get((kind, key), (now, way, None))
            if step < now and before != way and ("new", block.word) not in self.steps[-1]["seen"]:
                self.leave(block, f"*{block.word}, {row[1].upper()} whose direction changes", "it replaces the load of the step before" + ("; CalculiX adds it" if kind == "gravity" else ""))
            self.ways[kind, key] = (now, way, row)
        return [way[c] for c in self.axes[:self.dim()]]

    def on_dload(self, block):
        if not self.begun(block, "pressure", "gravity", "rotation", "body force"):
            return
        for row in block.rows:
            kind, size = row[1].upper(), item(row, 2)
            face = re.fullmatch(r"P(\d)", kind)
            if face and not any(c in self.body_of for c in self.cells(row[0], block)):
                self.leave(block, "*DLOAD on elements that are no solids")
            elif face:
                name = self.plain(f"PRESSURE_{block.line}_{said(size)}" if self.alone(row[0]) else f"{row[0].upper()}_P{face[1]}")
                self.press(block, name, [(c, int(face[1]) - 1) for c in self.cells(row[0], block)], size, row[0])
            elif kind not in ("GRAV", "CENTRIF", "BX", "BY", "BZ"):
                self.leave(block, f"*DLOAD of type {kind}")
            elif not self.body_groups(row[0], block):
                self.leave(block, f"*DLOAD of type {kind} on a part of a body", "write it as a force of the body, an expression of x, y and z")
            elif kind == "GRAV":
                mine = self.body_groups(row[0], block)
                for axis, c in zip(AXES, self.direction(row, block, "gravity", mine)):
                    self.put("gravity", [(title, axis) for title in mine], size * c, block, c)
            elif kind == "CENTRIF":
                self.put("rotation", self.body_groups(row[0], block), size, block)
                turns = ([item(row, k) for k in (3, 4, 5)], [item(row, k) for k in (6, 7, 8)])
                if self.axis not in (None, turns):
                    self.leave(block, "*DLOAD, CENTRIF about several axes", "the last axis is taken")
                self.axis = turns
            else:
                self.put("body force", [(title, self.axis_of("XYZ".index(kind[1]) + 1)) for title in self.body_groups(row[0], block)], size, block)

    def press(self, block, name, faces, size, word):
        """A pressure on faces of cells."""
        now, faces = len(self.steps), list(dict.fromkeys(faces))
        mine, others = self.given.get(("pressure", block.word), {}), self.given.get(("pressure", "DLOAD" if block.word == "DSLOAD" else "DSLOAD"), {})
        fresh = {f: mine.get((f, ""), ()) for f in faces}
        if any(any(g.step < now for g in others.get((f, ""), ())) for f in faces):
            self.note(f"{block.place}: *{block.word}: its pressure and that of *DLOAD or *DSLOAD of an earlier step are added; CalculiX replaces it")
        if block.word == "DSLOAD" and any(specs and specs[-1].value is not None and specs[-1].step < now and self.ways[f] != word for f, specs in fresh.items()):
            self.leave(block, "*DSLOAD on faces that another surface loads in an earlier step", "it replaces that load there")
        self.put("pressure", [(f, "") for f in faces], size, block)
        self.ways.update((f, word) for f in faces)
        self.aim("pressure", block, name, "", faces)

    def on_dsload(self, block):
        if not self.begun(block, "pressure", "traction"):
            return
        for row in block.rows:
            kind, size, word = row[1].upper(), item(row, 2), row[0].upper()
            if word not in self.deck.surfaces:
                raise DeckError(f"{block.place}: *DSLOAD names {word}, which is no surface of elements")
            faces, name = self.deck.surfaces[word], self.plain(word)
            if kind in ("P", "P1", "PNOR"):
                self.press(block, name, faces, size, word)
            elif kind == "TRVEC":
                for axis, c in zip(AXES, self.direction(row, block, "traction", [word])):
                    self.put("traction", [(f, axis) for f in dict.fromkeys(faces)], size * c, block, c)
                    self.aim("traction", block, name, axis, faces)
            else:
                self.leave(block, f"*DSLOAD of type {kind}")

    def of_bodies(self, word, block):
        """The bodies all of whose nodes are in a set; the rest of which is listed."""
        keys = set(self.nodes(word, block))
        mine = [title for title, (cells, _, _) in self.bodies.items() if all(keys.issuperset(self.m.cells[c][1]) for c in cells)]
        if (keys & self.used) - {n for title in mine for c in self.bodies[title][0] for n in self.m.cells[c][1]}:
            self.leave(block, f"*{block.word} of a part of a body", "write the temperature as an expression of x, y, z")
        return mine

    def on_initial_conditions(self, block):
        for row in block.rows:
            for title in self.of_bodies(row[0], block):
                self.initial[title] = item(row, 1)

    def on_temperature(self, block):
        if not self.begun(block, "temperature"):
            return
        for row in block.rows:
            self.put("temperature", self.of_bodies(row[0], block), item(row, 1), block)

    def course(self, kind, specs, start=0.0):
        """A load or support over time: rows (time, value), linear between them, with two rows at a jump."""
        rows, begin, follow, rest = [(0.0, start)], 0.0, [], 0.0
        for k, step in enumerate(self.steps, 1):
            end, now, mine, piece = begin + step["period"], rows[-1][1], [g for g in specs if g.step == k], []
            values = [g for g in mine if g.value not in (None, HELD)]
            if mine:
                read = [(g, *self.amplitudes[g.amplitude]) for g in values if self.amplitudes.get(g.amplitude)]
                curves = [(g.unit if absolute else g.value, table if total else [(t + begin, v) for t, v in table], total) for g, table, total, absolute in read]
                default = [g.value for g in values if not self.amplitudes.get(g.amplitude)]
                follow = [curve[:2] for curve in curves if curve[2]]  # an amplitude in total time goes on in later steps
                if values or kind != "fixed":
                    goal, parts = sum(default) if values else start, [curve[:2] for curve in curves]
                    if (default or not values) and (step["ramp"] or kind == "fixed"):  # displacements are ramps also where loads act at once
                        parts.append((1, [(begin, 0.0 if curves else now), (end, goal)]))
                        if not step["ramp"] and abs(goal - now) > 0:
                            self.differs.setdefault(values[0].block.line, f"{values[0].block.place}: *BOUNDARY without an amplitude is a ramp also here, as in Abaqus; CalculiX applies it at once")
                    elif default or not values:
                        parts.append((1, [(begin, goal)]))
                    piece = summed(parts, begin, end)
                    rest = piece[-1][1] - sum(factor * value_at(table, end, False) for factor, table in follow)
            elif follow:
                piece = summed([*follow, (rest, [(begin, 1.0)])], begin, end)
            if piece:
                same = abs(piece[0][1] - now) <= 1e-12 * max(abs(v) for _, v in (*piece, rows[-1]))
                rows = [*(rows if begin else ()), *([(begin, now)] if begin > rows[-1][0] else ()), *(piece[1:] if same and begin else piece)]
            begin = end
        return tuple(bare(rows))

    def lasting(self, specs):
        """Lists what a support does that supports of a scene cannot."""
        if specs[0].step > 1:
            self.once(specs[0].block, "*BOUNDARY of what was free in the steps before", "supports last for the whole history: it holds 0 in those steps")
        for k, g in enumerate(specs):
            if g.value is None and not any(other.step == g.step for other in specs[k + 1:]):
                self.once(g.block, "*BOUNDARY, OP=NEW", "a support that ends: supports last for the whole history")

    def once(self, block, what, why):
        if (what, why) not in self.left or self.left[what, why][0] is not block:
            self.leave(block, what, why)

    def gather(self, kind, word):
        """Groups of what has one value at all times: those of the deck where they have, parts of them where steps divide them."""
        given, courses, done = self.given[kind, word], {}, set()
        for specs in {specs for specs in given.values() if specs}:
            courses[specs] = self.course(kind, specs)
        targets = [(name, axis, list(dict.fromkeys(members))) for name, axes in self.targets[kind, word].items() for axis, members in axes.items()]
        for whole in (True, False):
            for name, axis, members in targets:
                found = {}
                for n in members:
                    if given[n, axis] and (whole or (n, axis) not in done):
                        found.setdefault(courses[given[n, axis]], []).append(n)
                mine = [n for of_one in found.values() for n in of_one]
                divided = len(found) > 1 or len(mine) < len(members) or kind != "fixed" and any((n, axis) in done for n in mine)
                if not whole or not divided and not done.issuperset((n, axis) for n in mine):
                    for course, part in found.items():
                        if kind != "traction" or any(v for _, v in course):
                            self.enter(kind, self.group(kind, name, part, whole), axis, 1.0, course)
                        done.update((n, axis) for n in part)
        if kind == "fixed":
            for specs in {given[n, axis] for name, axis, members in targets for n in members if given[n, axis]}:
                self.lasting(specs)

    def group(self, kind, name, members, whole):
        """The name of the group of these nodes or faces: that of the deck, or a new one."""
        place = {"fixed": "node_groups", "force": "point_groups"}.get(kind, "facet_groups")
        known = self.kept[place].get(name)
        if known is not None and set(known) != set(members) or not whole:
            same = next((other for other, of in self.kept[place].items() if other.startswith(name) and set(of) == set(members)), None)
            name = same or self.free_name(name + "_1", self.groups | set(self.bodies) | set(map(self.plain, self.deck.surfaces)))
        self.kept[place][name] = members
        self.groups.add(name)
        return name

    def enter(self, section, group, axis, factor, course):
        """Adds a function of time to an entry of the scene."""
        self.entry.setdefault("force" if section == "body force" else section, {}).setdefault(group, {}).setdefault(axis, []).append((factor, course))

    def load_bodies(self):
        """Gravity and rotation where they act on all bodies with a density, else forces of the bodies; other forces; temperatures."""
        density = {t: self.materials.get(b[1], {}).get("density") for t, b in self.bodies.items()}
        heavy = [t for t in self.bodies if density[t]] or list(self.bodies)
        for kind in ("gravity", "body force"):
            for (title, axis), specs in self.given.get((kind, "DLOAD"), {}).items():
                course = self.course(kind, specs) if specs else ()
                given = self.given[kind, "DLOAD"]
                if not any(v for _, v in course) or kind == "gravity" and title not in heavy:
                    continue
                if kind == "gravity" and all(given.get((t, axis)) and self.course(kind, given[t, axis]) == course for t in heavy):
                    if title == heavy[0]:
                        self.enter("gravity", "", axis, 1.0, course)
                else:
                    self.enter("body force", title, axis, density[title] or 0.0 if kind == "gravity" else 1.0, course)
        spins = {t: self.course("rotation", specs) for t, specs in self.given.get(("rotation", "DLOAD"), {}).items() if specs}
        if spins:
            if any(spins.get(t) != next(iter(spins.values())) for t in heavy):
                last = next(specs for specs in self.given["rotation", "DLOAD"].values() if specs)[-1].block
                self.leave(last, "*DLOAD, CENTRIF on some bodies", "all bodies with a density turn, as the first of these")
            self.enter("rotation", "", "speed", 1.0, next(iter(spins.values())))
        for title, specs in self.given.get(("temperature", "TEMPERATURE"), {}).items():
            if specs:
                self.enter("temperature", title, "", 1.0, self.course("temperature", specs, self.initial.get(title, 0.0)))

    # ------------------------------------------------------------------------------------------------ writing

    @property
    def used(self):
        if not hasattr(self, "_used"):
            self._used = {n for _, corners in self.m.cells.values() for n in corners}
        return self._used

    def finish(self):
        """Rigid bodies; the groups of the mesh."""
        if not self.bodies:
            raise DeckError("no *SOLID SECTION gives elements a material")
        rest = [c for c in self.m.cells if c not in self.body_of]
        if rest:
            raise DeckError(f"{len(rest)} elements are in no *SOLID SECTION, the first is {rest[0]}")
        self.steps = self.steps or [{"period": 1.0, "ramp": True, "creeps": False}]
        for g in (g for given in self.given.values() for specs in given.values() for g in specs):
            if g.amplitude and g.amplitude not in self.amplitudes:
                raise DeckError(f"{g.block.place}: *{g.block.word} names the amplitude {g.amplitude}, which is not there")
        for rigid in self.rigids:
            self.hold(*rigid)
        named = {interaction for *_, interaction, _ in self.contacts.values()}
        for name, (slave, master, interaction, _) in list(self.contacts.items()):
            if self.interactions.get(interaction, {}).get("tied"):  # the interaction may stand after the contact
                self.ties[self.free_name(f"{slave}_{master}", self.ties)] = (slave, master, None)
                del self.contacts[name]
        for kind, word in self.targets:
            self.gather(kind, word)
        for name, (slave, master, tolerance) in self.ties.items():
            fixed = {n for group in self.entry.get("fixed", {}) for n in self.kept["node_groups"].get(group, ())}
            mine, others = (fixed.intersection(self.nodes_of(group)) for group in (slave, master))
            if mine and not others and self.surface(slave):  # a tied node follows its masters, which must have its supports
                self.ties[name] = (master, slave, tolerance)
                self.note(f"tie {name}: slave and master are exchanged: nodes of {slave} have supports")
        self.load_bodies()
        self.soften(named)
        for kind, groups in self.kept.items():
            setattr(self.m, kind, groups)
        self.m.cell_groups = {title: keys for title, (keys, _, _) in self.bodies.items()}

    def hold(self, block, nodes, at, turn, coupled):
        """A rigid set whose reference point is held, in the coupled directions, is one of prescribed nodes; else it has no counterpart."""
        dim, given = self.dim(), self.given.setdefault(("fixed", "BOUNDARY"), {})
        moves = {axis: given.get((at, axis)) for d, axis in enumerate(AXES[:dim], 1) if self.axes[d - 1] + 1 in coupled}
        turns = [given.get((at if turn is None else turn, d if turn is None else AXES[d - 4])) for d in ((4 + self.axes[2],) if dim == 2 else (4, 5, 6))]
        if not all(moves.values()) or not all(turns) or any(g.value not in (0.0, None, HELD) for specs in turns for g in specs):
            self.leave(block, f"*{block.word}", "only a rigid part whose reference point is held in all displacements and rotations (then: fixed); see contact type rigid for one under a load")
            return
        for specs in turns:
            self.lasting(specs)
        mine = [n for n in nodes if n in self.used]
        name = self.free_name(f"rigid_{block.line}", self.groups)
        for axis, specs in moves.items() if mine else ():  # rigid facets alone: their contacts are listed
            given.update({(n, axis): specs for n in mine})
            self.targets.setdefault(("fixed", "BOUNDARY"), {}).setdefault(name, {})[axis] = mine

    def on_surface_behavior(self, block):
        if self.steps or self.interaction_now is None:
            self.leave(block, "*SURFACE BEHAVIOR in a step", WHY["CHANGE SURFACE BEHAVIOR"])
            return
        law = block.parameters.get("PRESSURE-OVERCLOSURE", "HARD").upper()
        self.interaction_now["tied"] = law == "TIED"
        if law in ("LINEAR", "TIED") and block.rows:
            self.interaction_now["slope"] = (item(block.rows[0], 0), block)

    def soften(self, interactions):
        """Lists contact whose pressure rises so slowly with its overclosure that it is no penalty: not ten times as stiff as a body of the mesh's length."""
        length = max(max(c) - min(c) for c in zip(*(self.m.nodes[n] for n in self.used)))
        stiff = max((row[0] for m in self.materials.values() for row in m.get("elastic", ())), default=0.0)
        for name in sorted(interactions):
            slope, block = self.interactions.get(name, {}).get("slope", (math.inf, None))
            law = block and f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={block.parameters['PRESSURE-OVERCLOSURE'].upper()}"
            hard = "ties are rigid" if block and self.interactions[name]["tied"] else "contact is hard"
            if slope * length < 10 * stiff:
                self.leave(block, law, hard)
            elif block:
                self.note(f"{block.place}: {law}: taken as a penalty; {hard}")

    def on_friction(self, block):
        """The coefficient of an interaction, of which other forms and changes within a step are left."""
        interaction = self.interaction_now
        given = bool(block.rows) and interaction is not None and not self.steps
        if given:
            interaction["friction"] = item(block.rows[0], 0)
            if item(block.rows[0], 1) and not self.frictionless:
                self.note(f"{block.place}: *FRICTION: the stiffness {block.rows[0][1]} of contacts that stick is taken as a penalty; they stick without slip")
        if self.frictionless:
            self.leave(block, "*FRICTION", "left out by --frictionless; the coefficient stands beside the contact")
        elif not given or len(block.rows) > 1:
            self.leave(block, "*FRICTION", WHY["FRICTION"])

    def friction(self, interaction):
        return self.interactions.get(interaction, {}).get("friction", 0.0)

    def rubs(self):
        """Whether a contact of the draft has friction, which depends on the path: it needs a history."""
        return not self.frictionless and any(self.friction(contact[2]) > 0 for contact in self.contacts.values())

    def creeps(self):
        """The factor of the rate of creep over time, which is 0 in static steps, as rows; none if there is no creep."""
        rows, begin = [], 0.0
        for step in self.steps:
            on, end = float(step["creeps"]), begin + step["period"]
            rows += [(begin, on)] * (not rows or rows[-1][1] != on) + [(end, on)]
            begin = end
        return rows if any(on for _, on in rows) else []

    def inelastic(self):
        return self.formulation() != "plane_stress" and any("plastic" in m or "creep" in m and self.creeps() for m in (self.materials.get(b[1], {}) for b in self.bodies.values()))

    def over_time(self, parts, kind="ramp"):
        """The sum of functions of time (factor, rows) as text: numbers, and in a history factors of its tables."""
        out = ""
        for factor, rows in parts:
            rows = steep(rows) if self.history else rows[-1:]
            if len({v for _, v in rows}) == 1:
                text = said(factor * rows[0][1])
            else:
                scale = max((v for _, v in rows), key=abs) if kind == "ramp" else 1.0
                shape = tuple((moment(t), said(v / scale)) for t, v in rows)
                text = product(factor * scale, self.tables.setdefault(shape, f"{kind}{len(self.tables) + 1}"))
            out += text if not out or text.startswith("-") else "+" + text
        return out

    def material(self, title):
        """The entries of a body: {name: text}."""
        _, name, block = self.bodies[title]
        m, out = self.materials.get(name), {}
        if not m or "elastic" not in m:
            self.leave(block, f"material {name or '(none)'} of {title}", "it has no isotropic *ELASTIC: give young and poisson in the draft")
            m = m or {}
        rows = m.get("elastic", [(1.0, 0.0, 0.0)])
        heat = self.entry.get("temperature", {}).get(title)
        hot = heat or title in self.initial
        out["young"] = piecewise([(e, t) for e, _, t in rows], "temperature") if hot else said(rows[0][0])
        out["poisson"] = piecewise([(n, t) for _, n, t in rows], "temperature") if hot else said(rows[0][1])
        if len(rows) > 1 and not hot:
            self.note(f"{name} depends on the temperature, which the deck does not give: its first row is taken")
        if "density" in m:
            out["density"] = said(m["density"])
        if hot and ("expansion" in m or len(rows) > 1):
            out["temperature"] = self.over_time(heat[""], "heat") if heat else said(self.initial[title])
        if "expansion" in m and "temperature" in out:
            alpha, zero, source = m["expansion"]
            start = self.initial.get(title, 0.0)
            out["expansion"] = piecewise(alpha, "temperature")
            out["reference_temperature"] = said(start if len(alpha) == 1 else zero)
            if len(alpha) > 1 and start != zero:
                self.leave(source, "*EXPANSION that depends on the temperature, from an initial one that is not ZERO", "subtract its strain at the initial temperature")
        if self.formulation() == "plane_stress" and {"plastic", "creep"} & set(m):
            self.leave(block, f"*{' and *'.join(law.upper() for law in ('plastic', 'creep') if law in m)} in plane stress", "inelastic laws need plane strain, axisymmetry or 3D: the body is elastic")
            m = {k: v for k, v in m.items() if k not in ("plastic", "creep")}
        creeps = "creep" in m and self.creeps()
        if creeps:
            a, n, power = m["creep"]
            out["law"] = "strain_hardening" if power else "norton"
            out.update(rate=self.over_time([(a / (1 + power), creeps)], "creep"), exponent=said(n), **({"time_exponent": said(1 + power)} if power else {}))
        if "plastic" in m:
            rows, block, _ = m["plastic"]
            self.harden(rows, block)
            out["law"] = "norton" if creeps else "j2"
            out["yield"] = said(rows[0][0])
            if len(rows) > 1:
                out["hardening"] = said((rows[-1][0] - rows[0][0]) / (rows[-1][1] - rows[0][1]))
        kinds = {self.m.cells[c][0] for c in self.bodies[title][0]}
        if "law" in out and kinds & {"tri3", "tet4"}:
            out["element"] = "standard"
        elif kinds <= {"quad4", "hex8"} and self.formulation() != "plane_stress" and ("law" in out or max(row[1] for row in m.get("elastic", [(0, 0)])) > 0.49):
            out.update({} if "law" in out else {"element": "bbar"})
            self.note(f"{block.place}: {title}: {'inelastic' if 'law' in out else 'nearly incompressible'}: its cells do not lock, as those of Abaqus; CalculiX's do (element: standard)")
        return out

    def reach(self, slave, master):
        """How far any slave node is from the master's facets, and the shortest slave edge."""
        mine, other, nodes = self.surface(slave), self.surface(master), self.nodes_of(slave)
        if not nodes or not other:
            return None
        edges = [math.dist(self.m.nodes[a], self.m.nodes[b]) for f in (mine or other).facets for a, b in zip(f.nodes, f.nodes[1:])]  # a slave of nodes has none
        return max(other.nearest(self.m.nodes[n])[0] for n in nodes), min(edges)

    def entries(self):
        """The sections of the scene: [(section, [(key, text, comment)])]."""
        def axes(kind):
            return {group: "{" + ", ".join(f"{axis}: {quoted(self.over_time(parts))}" for axis, parts in of.items()) + "}" for group, of in self.entry.get(kind, {}).items()}

        yield "body", [(t, "{" + ", ".join(f"{k}: {quoted(v)}" for k, v in self.material(t).items()) + "}", "") for t in self.bodies]
        for kind in ("fixed", "force", "traction"):
            yield kind, [(group, text, "") for group, text in axes(kind).items()]
        yield "spring", [(group, "{" + ", ".join(f"{axis}: {said(k / self.thickness)}" for axis, k in of.items()) + "}", "") for group, of in self.springs.items()]
        yield "pressure", [(group, quoted(self.over_time(of[""])), "") for group, of in self.entry.get("pressure", {}).items()]
        yield "gravity", [(axis, quoted(self.over_time(parts)), "") for axis, parts in self.entry.get("gravity", {}).get("", {}).items()]
        if "rotation" in self.entry:
            more = [("axis", "{" + ", ".join(f"{a}: {said(v)}" for a, v in zip(AXES, self.axis[1])) + "}", ""),
                    ("through", "{" + ", ".join(f"{a}: {said(v)}" for a, v in zip(AXES, self.axis[0])) + "}", "")] if self.dim() == 3 else []
            square = self.over_time(self.entry["rotation"][""]["speed"])
            yield "rotation", [("speed", quoted(f"sqrt({square})" if re.search("[a-z]", square) else said(math.sqrt(max(float(square), 0)))), ""), *more]
        yield "tie", [(name, f"{{slave: {s}, master: {m}" + (f", tolerance: {said(t)}" if t else "") + "}", "") for name, (s, m, t) in self.ties.items()]
        yield "contact", [self.contact(name) for name in self.contacts]

    def contact(self, name):
        slave, master, interaction, whole = self.contacts[name]
        kind = "mortar" if self.quadratic() or whole and slave in self.kept["facet_groups"] else "surface"
        text, far = f"type: {kind}, slave: {slave}, master: {master}", self.reach(slave, master)
        if far and far[0] > 0.099 * far[1]:
            least = far[0]
            short = float(f'{1.001 * least:.3g}')
            text += f", tolerance: {said(short if short > 1.0005 * least else float(f'{1.001 * least:.5g}'))}"
        if (slave, master) in self.loose:
            text += f", gap: {said(self.loose[slave, master])}"
        friction = self.friction(interaction)
        if friction and not self.frictionless:
            text += f", friction: {said(friction)}"
        return name, "{" + text + "}", f"friction: {said(friction)} in the deck" if friction and self.frictionless else ""

    def formulation(self):
        return next((name for start, name in (("CPS", "plane_stress"), ("CAX", "axisymmetric"), ("CPE", "plane_strain")) if any(t.startswith(start) for t in self.deck.types)), "")

    def text(self):
        """The draft; afterwards `left` is complete."""
        self.history = self.inelastic() or self.rubs() or len(self.steps) > 1
        if self.rubs():
            self.note("friction is solved at full order and by models of bodies, with *TIE by hybrid models; --frictionless leaves it out. More listed times follow its path more closely.")
        creep = next((b for b in self.deck.rest if b.word == "CREEP"), None)
        if creep and not all(step["creeps"] for step in self.steps):
            self.note(f"{creep.place}: *CREEP acts in *VISCO steps alone" + (": its rate is 0 in the others" if self.creeps() else ", of which there is none: it is left out"))
        self.notes += self.differs.values()
        sections = list(self.entries())
        lines = [f"# Draft from {self.name}. Displacements are small; bodies are in the deck's units.",
                 "# For a model, name what varies: `parameters: [p]` under scene, `parameter: {p: {range: [LOW, HIGH]}}`, and p in any value."]
        if self.left:
            lines += ["#", "# Not converted:"] + [f"#   {line}" for line in self.told()]
        if self.notes:
            lines += ["#", "# Note:"] + [f"#   {line}" for line in self.notes]
        lines += ["scene:", f"  title: {quoted(self.name)}", "  mesh: mesh.msh"]
        if self.dim() == 2 and self.formulation() not in ("", "plane_strain"):
            lines.append(f"  formulation: {self.formulation()}")
        for name, rows in sections:
            if rows:
                lines.append(f"{name}:")
                lines += [f"  {key}: {value}" + (f"   # {comment}" if comment else "") for key, value, comment in rows]
        if self.contacts:
            lines.append("output:")
            taken = set()
            for name in self.contacts:
                output = self.free_name(("" if name[0].isalpha() else "contact_") + re.sub("[^A-Za-z0-9_]", "_", name), taken)
                taken.add(output)
                axes = "y" if self.formulation() == "axisymmetric" else AXES[:self.dim()]
                lines += [f"  {output}_peak: {{max: contact_pressure, contact: {name}}}", *(f"  {output}_{c}: {{force: {c}, contact: {name}}}" for c in axes)][:16 // len(self.contacts)]
        if self.history:
            times, t = [0.0], 0.0
            for step in self.steps:
                t += step["period"]
                times.append(t)
            lines += ["history:", "  times: [" + ", ".join(moment(t) for t in times) + "]"]
            if self.tables:
                lines.append("  tables:")
                lines += [f"    {name}: [" + ", ".join(f"[{t}, {v}]" for t, v in shape) + "]" for shape, name in self.tables.items()]
        return "\n".join(lines) + "\n"
