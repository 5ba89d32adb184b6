"""A deck of Abaqus or CalculiX as a draft of scene.yaml (scripts/convert --scene): what has a counterpart is converted; each keyword that changes
the mechanics and has none is listed with its line."""
import bisect
import math
import re

STRUCTURAL = re.compile(r"(S[3-9]|STRI|SAX|SC\d|CSS|M3D|SFM|B[23]|PIPE|ELBOW|T[23]D|CONN|SPRING|DASHPOT|MASS|ROTARYI|GAP|ITS|R3D|R2D|RAX|RB|D$|COH|DCOUP|F3D|U\d|MCL|CMD)")
# What a result is written of, what only affects how it is reached, and what the mesh has been read from
QUIET = {"HEADING", "PREPRINT", "RESTART", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "ENERGY OUTPUT", "NODE FILE", "EL FILE", "ELEMENT FILE",
         "CONTACT FILE", "FILE FORMAT", "NODE PRINT", "EL PRINT", "CONTACT PRINT", "ENERGY PRINT", "SECTION PRINT", "PRINT", "MONITOR", "FIELD", "CONTROLS",
         "CONDUCTIVITY", "SPECIFIC HEAT", "ASSEMBLY", "END ASSEMBLY", "END STEP", "SURFACE BEHAVIOR", "SECTION CONTROLS", "ORIENTATION", "INTEGRATED OUTPUT",
         "INCREMENTATION OUTPUT", "PHYSICAL CONSTANTS", "FILTER", "DIAGNOSTICS", "TIME POINTS", "CONTACT PROPERTY ASSIGNMENT", "KINEMATIC", "DISTRIBUTING"}
AXES = "xyz"
NAMED = {"ENCASTRE": (1, 2, 3, 4, 5, 6), "PINNED": (1, 2, 3), "XSYMM": (1, 5, 6), "YSYMM": (2, 4, 6), "ZSYMM": (3, 4, 5), "XASYMM": (2, 3, 4), "YASYMM": (1, 3, 5),
         "ZASYMM": (1, 2, 6), "NOWARP": (), "NOOVAL": (), "NODEFORM": ()}
WHY = {"FRICTION": "only a constant coefficient of a surface interaction is friction: in the draft", "EQUATION": "no equations between displacements",
       "MPC": "no constraints of this kind", "COUPLING": "no couplings of a reference point, unless it does not move",
       "DISTRIBUTING COUPLING": "no couplings of a reference point",
       "HOURGLASS STIFFNESS": "cells are fully integrated", "TRANSFORM": "supports and loads in turned axes: see fixed: direction in scenes.md",
       "SHELL SECTION": "no shells", "BEAM SECTION": "no beams", "MEMBRANE SECTION": "no membranes", "CONNECTOR SECTION": "no connectors", "SPRING": "see spring: in scenes.md",
       "MASS": "no point masses", "DASHPOT": "no dampers", "CONTACT": "general contact: name the pairs of surfaces as contacts", "DYNAMIC": "no inertia", "DAMPING": "no inertia",
       "PRE-TENSION SECTION": "no pretension: prescribe a displacement of one side", "CYCLIC SYMMETRY MODEL": "no cyclic symmetry", "MODEL CHANGE": "bodies and contacts stay",
       "CONTACT CONTROLS": "no stabilisation is needed", "CONTACT STABILIZATION": "no stabilisation is needed"}


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

    def __init__(self, m, name, facets_of, plain, frictionless=False):
        self.m, self.deck, self.name, self.facets_of, self.plain = m, m.deck, name, facets_of, plain
        self.left, self.notes = {}, []
        self.bodies, self.materials, self.body_of, self.thickness = {}, {}, {}, 1.0
        self.interactions, self.contacts, self.ties, self.rigids, self.loose = {}, {}, {}, [], {}
        self.amplitudes, self.steps, self.values, self.initial, self.reference = {}, [], {}, {}, {}
        self.held = {}  # by nodes and degree of freedom: the group that holds them
        self.groups, self.tables, self.skipped, self.frictionless = set(), {}, False, frictionless

    def leave(self, block, what, why=None):
        """Notes what is not converted, once for each keyword and reason."""
        self.left.setdefault((what, why), [block, 0])[1] += 1

    def told(self):
        """A line for each entry that is not converted."""
        for (what, why), (block, n) in sorted(self.left.items(), key=lambda e: (e[1][0].file, e[1][0].line)):
            yield f"line {block.line}: {what}: {why or 'has no counterpart'}" + (f" ({n} times)" if n > 1 else "")

    # ------------------------------------------------------------------------------------------------ sets

    def members(self, word, kinds):
        """The keys of a set's name or number, of nodes or cells; None: there is none."""
        word = word.strip('"').upper()
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
            raise DeckError(f"line {block.line}: *{block.word} names {word}, which is no set of nodes")
        return found

    def cells(self, word, block):
        found = self.members(word, [self.deck.elsets])
        if found is None:
            raise DeckError(f"line {block.line}: *{block.word} names {word}, which is no set of elements")
        return [c for c in found if c in self.m.cells]

    def free_name(self, name, taken):
        name, k = self.plain(name), 1
        while name in taken and k < 10000:
            name, k = re.sub(r"_\d+$", "", name) + f"_{k}", k + 1
        return name

    def alone(self, word):
        """Whether a word is the number of a node or cell, not the name of a set."""
        word = word.strip('"').upper()
        return bool(re.fullmatch(r"(.*\.)?\d+", word)) and word not in self.deck.nsets and word not in self.deck.elsets

    def node_group(self, word, block, what, points=False):
        """The name of a group of these nodes; single nodes of one block with the same `what` are one group. points: on which forces act."""
        name = self.plain(f"{block.word}_{block.line}_{what}" if self.alone(word) else word.strip('"').upper())
        if points:
            name += "_points"
        elif name in self.bodies or name in map(self.plain, self.deck.surfaces):
            name += "_nodes"  # the name of other groups too
        groups = self.m.point_groups if points else self.m.node_groups
        if self.alone(word):
            groups.setdefault(name, []).extend(self.nodes(word, block))
        else:
            groups[name] = self.nodes(word, block)
        self.groups.add(name)
        return name

    def facet_group(self, word, block):
        word = word.strip('"').upper()
        if word not in self.deck.surfaces and word in self.deck.nsets:
            self.m.node_groups[self.plain(word)] = self.deck.nsets[word]
        elif word not in self.deck.surfaces:
            raise DeckError(f"line {block.line}: *{block.word} names {word}, which is no surface (only those of elements and nodes are read)")
        self.groups.add(self.plain(word))
        return self.plain(word)

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
            if structural(name):
                self.leave(block, f"*ELEMENT, TYPE={name}", "these elements are left out; a scene has solids only")
            elif re.search(r"(8|4|20)[A-Z]*R", name) and name.startswith(("C3D8R", "CPE4R", "CPS4R", "CAX4R")):
                self.leave(block, f"*ELEMENT, TYPE={name}", "cells are fully integrated, without hourglass control")
            elif name.startswith("C3D8I") or name in ("CPE4I", "CPS4I", "CAX4I"):
                self.leave(block, f"*ELEMENT, TYPE={name}", "no incompatible modes: bending of such cells is stiffer")
        material = interaction = None
        for block in self.deck.rest:
            word, parameters, rows = block
            if word == "MATERIAL":
                material = self.materials.setdefault(parameters["NAME"].upper(), {})
            elif word == "SURFACE INTERACTION":
                interaction = self.interactions.setdefault(parameters["NAME"].upper(), {})
            elif word in ("ELASTIC", "EXPANSION", "DENSITY", "PLASTIC", "CREEP") and material is not None:
                getattr(self, "read_" + word.lower())(material, block)
            elif word == "FRICTION":
                self.read_friction(interaction, block)
            elif word == "SURFACE BEHAVIOR" and interaction is not None:
                if parameters.get("PRESSURE-OVERCLOSURE", "HARD").upper() == "TIED":
                    interaction["tied"] = True
            elif hasattr(self, "on_" + re.sub(r"\W", "_", word).lower()):
                getattr(self, "on_" + re.sub(r"\W", "_", word).lower())(block)
            elif word not in QUIET:
                self.leave(block, f"*{word}", WHY.get(word))
        self.finish()

    # ---- materials

    def read_elastic(self, material, block):
        if block.parameters.get("TYPE", "ISO").upper() not in ("ISO", "ISOTROPIC"):
            self.leave(block, f"*ELASTIC, TYPE={block.parameters['TYPE'].upper()}", "elasticity is isotropic, or a law of a program")
            return
        material["elastic"] = [(item(r, 0), item(r, 1), item(r, 2)) for r in block.rows]

    def read_expansion(self, material, block):
        if block.parameters.get("TYPE", "ISO").upper() not in ("ISO", "ISOTROPIC"):
            self.leave(block, f"*EXPANSION, TYPE={block.parameters['TYPE'].upper()}", "expansion is isotropic")
            return
        material["expansion"] = ([(item(r, 0), item(r, 1)) for r in block.rows], real(block.parameters.get("ZERO")), block)

    def read_density(self, material, block):
        material["density"] = item(block.rows[0], 0)

    def read_plastic(self, material, block):
        if block.parameters.get("HARDENING", "ISOTROPIC").upper() != "ISOTROPIC":
            self.leave(block, f"*PLASTIC, HARDENING={block.parameters['HARDENING'].upper()}", "hardening is isotropic")
        rows = [(item(r, 0), item(r, 1)) for r in block.rows]
        if len({item(r, 2) for r in block.rows}) > 1:
            self.leave(block, "*PLASTIC that depends on the temperature", "the rows of the first temperature are taken")
            rows = [(item(r, 0), item(r, 1)) for r in block.rows if item(r, 2) == item(block.rows[0], 2)]
        if len(rows) > 2:
            self.leave(block, "*PLASTIC with more than two rows", "the draft hardens linearly from the first row to the last; see j2 in materials.md")
        elif len(rows) == 2:
            self.notes.append(f"line {block.line}: *PLASTIC: hardening continues beyond the last row, where the deck is perfectly plastic")
        material["plastic"] = rows

    def read_creep(self, material, block):
        law = block.parameters.get("LAW", "STRAIN").upper()
        row = block.rows[0] if block.rows else []
        a, n, m = item(row, 0), item(row, 1), item(row, 2)
        if law not in ("STRAIN", "TIME", "NORTON") or len(block.rows) > 1 or not row:
            self.leave(block, f"*CREEP, LAW={law}" + (" that depends on the temperature" if len(block.rows) > 1 else ""), "see norton and strain_hardening in materials.md")
            return
        if m and law != "STRAIN":
            self.notes.append(f"line {block.line}: *CREEP in time: under changing stress strain_hardening differs from it")
        material["creep"] = (a, n, m)

    # ---- sections and bodies

    def on_solid_section(self, block):
        p = block.parameters
        name = p["ELSET"].upper()
        keys = self.cells(f"{block.instance}.{name}" if block.instance else name, block)
        if block.rows and item(block.rows[0], 0) not in (0, 1) and self.dim() == 2 and not any(t.startswith("CAX") for t in self.deck.types):
            self.thickness = item(block.rows[0], 0)
            self.notes.append(f"line {block.line}: *SOLID SECTION: the thickness {said(self.thickness)} is 1 here: forces of *CLOAD are divided by it, and so are reactions and contact forces")
        alone = sum(b.word == "SOLID SECTION" and b.instance == block.instance for b in self.deck.rest) == 1
        title = self.free_name((block.instance if alone else f"{block.instance}.{name}") if block.instance else name, self.bodies)
        self.bodies[title] = (keys, p.get("MATERIAL", "").upper(), block)
        for key in keys:
            self.body_of[key] = title

    # ---- contact, ties, rigid bodies

    def surfaces(self, row, block):
        """The groups of a slave and a master; None, with a note, if one of them has no solid behind it."""
        if len(row) < 2:
            raise DeckError(f"line {block.line}: *{block.word} needs two surfaces, the slave first")
        for word in row[:2]:
            found = self.deck.surfaces.get(word.strip('"').upper())
            if found == [] or any(cell not in self.m.cells for cell, _ in found or ()) or any(b.word == "SURFACE" and b.parameters.get("NAME", "").upper() == word.upper() for b in self.deck.rest):
                self.leave(block, f"*{block.word} with a surface without solids", "a rigid surface is a contact of type obstacle (normal and gap as expressions), or a solid that is held")
                return None
        return [self.facet_group(w, block) for w in row[:2]]

    def on_contact_pair(self, block):
        p = block.parameters
        interaction = p.get("INTERACTION", "").upper()
        for row in block.rows:
            row = [w for w in row if w]
            both = self.surfaces(row, block)
            if not both:
                continue
            slave, master = both
            if "TIED" in p or self.interactions.get(interaction, {}).get("tied"):
                self.ties[self.free_name(f"{slave}_{master}", self.ties)] = (slave, master, None)
                continue
            reach = max(real(p["ADJUST"]) if re.fullmatch(r"[\d.eEdD+-]+", p.get("ADJUST", "")) else 0, 0)
            self.contacts[self.free_name(f"{slave}_{master}".lower(), self.contacts)] = (slave, master, interaction, reach, row, block)

    def on_contact_inclusions(self, block):
        if "ALL EXTERIOR" in block.parameters or not block.rows or not all(len(r) > 1 and r[0] and r[1] for r in block.rows):
            self.leave(block, "*CONTACT INCLUSIONS", WHY["CONTACT"])
            return
        for row in block.rows:
            both = self.surfaces(row, block)
            if not both:
                continue
            slave, master = both
            self.contacts[self.free_name(f"{slave}_{master}".lower(), self.contacts)] = (slave, master, "", 0, row, block)

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
        if "CYCLIC SYMMETRY" in block.parameters or "MULTISTAGE" in block.parameters:
            self.leave(block, "*TIE, CYCLIC SYMMETRY", WHY["CYCLIC SYMMETRY MODEL"])
            return
        both = self.surfaces([w for w in block.rows[0] if w], block)
        if not both:
            return
        slave, master = both
        reach = block.parameters.get("POSITION TOLERANCE")
        self.ties[self.free_name(block.parameters.get("NAME", "tie"), self.ties)] = (slave, master, real(reach) if reach else None)

    def on_rigid_body(self, block):
        p = block.parameters
        found = [self.nodes(p[k], block) for k in ("NSET", "TIE NSET", "PIN NSET") if k in p]
        if "ELSET" in p:
            found.append([n for c in self.cells(p["ELSET"], block) for n in self.m.cells[c][1]])  # rigid facets are left out
        at = p.get("REF NODE", "")
        self.rigids.append((block, sorted({n for keys in found for n in keys}, key=str), self.nodes(at, block)[0] if at else None,
                            self.nodes(p["ROT NODE"], block)[0] if "ROT NODE" in p else None))

    def on_coupling(self, block):
        p, place = block.parameters, self.deck.rest.index(block)
        after = self.deck.rest[place + 1].word if place + 1 < len(self.deck.rest) else ""
        surface = p.get("SURFACE", "").upper()
        if after != "KINEMATIC" or surface not in self.deck.surfaces and surface not in self.deck.nsets:
            self.leave(block, "*COUPLING", WHY["COUPLING"])
            return
        nodes = self.deck.nsets.get(surface) or [n for facet in self.facets_of(self.m, self.deck.surfaces[surface]) for n in facet]
        self.rigids.append((block, sorted(set(nodes), key=str), self.nodes(p["REF NODE"], block)[0], None))

    # ---- steps

    def on_step(self, block):
        self.skipped = False
        self.steps.append({"block": block, "period": 1.0, "kind": "", "ramp": block.parameters.get("AMPLITUDE", "").upper() != "STEP"})
        if "NLGEOM" in block.parameters and block.parameters["NLGEOM"].upper() != "NO":
            self.leave(block, "*STEP, NLGEOM", "displacements and rotations are small")
        if "PERTURBATION" in block.parameters:
            self.leave(block, "*STEP, PERTURBATION", "the step is taken as an ordinary one")

    def procedure(self, block):
        step = self.steps[-1] if self.steps else {}
        step.update(kind=block.word, period=item(block.rows[0], 1, 1.0) if block.rows else 1.0)

    on_static = on_visco = procedure

    def on_coupled_temperature_displacement(self, block):
        self.leave(block, f"*{block.word}", "temperatures are given, not solved for")
        self.procedure(block)

    def other(self, block):
        self.leave(block, f"*{block.word}", "only static steps and *VISCO have a counterpart")
        if self.steps and not self.skipped:
            self.steps.pop()
        self.skipped = True  # the loads of this step too

    on_dynamic = on_frequency = on_buckle = on_heat_transfer = on_modal_dynamic = on_steady_state_dynamics = on_substructure_generate = other

    def on_amplitude(self, block):
        p = block.parameters
        if p.get("DEFINITION", "TABULAR").upper() != "TABULAR" or p.get("VALUE", "RELATIVE").upper() != "RELATIVE":
            self.leave(block, f"*AMPLITUDE, DEFINITION={p.get('DEFINITION', 'TABULAR').upper()}", "its loads are ramps; write the function as a table of the history")
            return
        numbers = [real(w) for row in block.rows for w in row if w]
        self.amplitudes[p["NAME"].upper()] = (list(zip(numbers[::2], numbers[1::2])), "TIME" in p and p["TIME"].upper().startswith("TOTAL"))

    def put(self, key, value, block):
        """The value of a load or support from this step on."""
        if self.skipped:
            return
        self.values.setdefault(key, []).append((len(self.steps), value, block.parameters.get("AMPLITUDE", "").upper()))

    def renewed(self, block, kinds):
        """OP=NEW: loads of earlier steps end."""
        if block.parameters.get("OP", "MOD").upper() != "NEW" or len(self.steps) < 2:
            return
        mark = (len(self.steps), block.word)
        if mark in self.steps[-1].setdefault("renewed", set()):
            return
        self.steps[-1]["renewed"].add(mark)
        for key, history in self.values.items():
            if key[0] in kinds and history[-1][0] < len(self.steps):
                if key[0] == "fixed":
                    self.leave(block, "*BOUNDARY, OP=NEW", "a support that ends: supports last for the whole history")
                else:
                    history.append((len(self.steps), 0.0, ""))

    def on_boundary(self, block):
        self.renewed(block, ("fixed",))
        p, dim = block.parameters, self.dim()
        if "TYPE" in p and p["TYPE"].upper() != "DISPLACEMENT" or "FIXED" in p or "SUBMODEL" in p or "USER" in p:
            self.leave(block, "*BOUNDARY, " + ", ".join(w for w in ("TYPE", "FIXED", "SUBMODEL", "USER") if w in p), "prescribe the displacement, as a number or an expression")
            return
        for row in block.rows:
            row = row + [""] * (4 - len(row))
            if row[1].upper() in NAMED:
                dofs, value = NAMED[row[1].upper()], 0.0
            else:
                first = int(row[1] or 1)
                dofs, value = range(first, int(row[2] or first) + 1), real(row[3])
            nodes = self.nodes(row[0], block)
            held = [n for n in nodes if n in self.used]
            for n in set(nodes) - set(held):
                self.reference.setdefault(n, {}).update({d: (value, block) for d in dofs})
            if not held:
                continue
            group = None
            for d in dofs:
                if d <= dim:
                    # a later value for the same nodes replaces the earlier one, as in the deck
                    before = self.held.get((frozenset(held), d))
                    if not before:
                        group = group or self.node_group(row[0], block, "_".join(map(str, dofs)) + (f"_{said(value)}" if value else ""))
                        self.held[frozenset(held), d] = group
                    self.put(("fixed", before or group, AXES[d - 1]), value, block)
                elif d > 6:
                    self.leave(block, f"*BOUNDARY of degree of freedom {d}", "only displacements are prescribed")

    def on_cload(self, block):
        self.renewed(block, ("force",))
        for row in block.rows:
            nodes, d = self.nodes(row[0], block), int(row[1])
            held = [n for n in nodes if n in self.used]
            if len(held) < len(nodes) or d > self.dim():
                self.leave(block, "*CLOAD on a reference point or a rotation", "a load on a rigid or coupled body: see contact type rigid, or a traction")
                continue
            self.put(("force", self.node_group(row[0], block, f"{d}_{said(item(row, 2))}", True), AXES[d - 1]), item(row, 2) / self.thickness, block)

    def pressure_group(self, word, face, value, block):
        """The group of a face of cells; faces of single cells with one pressure in one block are one group."""
        name = self.plain(f"PRESSURE_{block.line}_{said(value)}" if self.alone(word) else f"{word.strip(chr(34)).upper()}_P{face}")
        mine = self.m.facet_groups.setdefault(name, [])
        mine += [(c, face - 1) for c in self.cells(word, block) if (c, face - 1) not in mine]
        self.groups.add(name)
        return name

    def body_groups(self, word, block):
        """The bodies that a set of elements consists of; None if it divides one."""
        keys = set(self.cells(word, block)) if word else set(self.body_of)
        mine = [title for title, (cells, _, _) in self.bodies.items() if keys.intersection(cells)]
        return mine if mine and all(keys.issuperset(self.bodies[t][0]) for t in mine) else None

    def on_dload(self, block):
        self.renewed(block, ("pressure", "gravity", "rotation", "body force"))
        for row in block.rows:
            kind = row[1].upper()
            face = re.fullmatch(r"P(\d)", kind)
            if kind == "GRAV":
                size = math.hypot(*(item(row, k) for k in (3, 4, 5))) or 1.0
                if self.body_groups(row[0], block) != list(self.bodies):
                    self.notes.append(f"line {block.line}: *DLOAD, GRAV: gravity acts on all bodies with a density, not on {row[0]} alone")
                for c in range(self.dim()):
                    if item(row, 3 + c):
                        self.put(("gravity", "", AXES[c]), item(row, 2) * item(row, 3 + c) / size, block)
            elif kind == "CENTRIF":
                self.put(("rotation", "", "speed"), math.sqrt(max(item(row, 2), 0)), block)
                self.axis = ([item(row, k) for k in (3, 4, 5)], [item(row, k) for k in (6, 7, 8)])
            elif kind in ("BX", "BY", "BZ") and self.body_groups(row[0], block):
                for title in self.body_groups(row[0], block):
                    self.put(("force", title, kind[1].lower()), item(row, 2), block)
            elif face and not any(c in self.body_of for c in self.cells(row[0], block)):
                self.leave(block, "*DLOAD on elements that are no solids")
            elif face:
                self.put(("pressure", self.pressure_group(row[0], int(face[1]), item(row, 2), block), ""), item(row, 2), block)
            else:
                self.leave(block, f"*DLOAD of type {kind}")

    def on_dsload(self, block):
        self.renewed(block, ("pressure", "traction"))
        for row in block.rows:
            kind = row[1].upper()
            if kind in ("P", "P1", "PNOR"):
                self.put(("pressure", self.facet_group(row[0], block), ""), item(row, 2), block)
            elif kind == "TRVEC":
                size = math.hypot(*(item(row, k) for k in (3, 4, 5))) or 1.0
                for c in range(self.dim()):
                    if item(row, 3 + c):
                        self.put(("traction", self.facet_group(row[0], block), AXES[c]), item(row, 2) * item(row, 3 + c) / size, block)
            else:
                self.leave(block, f"*DSLOAD of type {kind}")

    def of_bodies(self, word, block):
        """The bodies all of whose nodes are in a set."""
        keys = set(self.nodes(word, block))
        return [title for title, (cells, _, _) in self.bodies.items() if all(keys.issuperset(self.m.cells[c][1]) for c in cells)]

    def on_initial_conditions(self, block):
        if block.parameters.get("TYPE", "").upper() != "TEMPERATURE":
            self.leave(block, f"*INITIAL CONDITIONS, TYPE={block.parameters.get('TYPE', '').upper()}")
            return
        for row in block.rows:
            for title in self.of_bodies(row[0], block):
                self.initial[title] = item(row, 1)

    def on_temperature(self, block):
        if not block.rows or "FILE" in block.parameters:
            self.leave(block, "*TEMPERATURE from a file", "write the field as an expression of x, y, z and t")
            return
        for row in block.rows:
            mine = self.of_bodies(row[0], block)
            if not mine:
                self.leave(block, "*TEMPERATURE of a part of a body", "write the field as an expression of x, y, z")
            for title in mine:
                self.put(("temperature", title, ""), item(row, 1), block)

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
        for block, nodes, at, turn in self.rigids:
            self.hold(block, nodes, at, turn)
        keep = {"facet_groups": {}, "node_groups": {}}
        for kind, found in keep.items():
            for name, members in getattr(self.m, kind).items():
                if self.plain(name) in self.groups:
                    found[self.plain(name)] = members
            setattr(self.m, kind, found)
        self.m.cell_groups = {title: keys for title, (keys, _, _) in self.bodies.items()}

    def hold(self, block, nodes, at, turn):
        """A rigid set whose reference point is held is one of prescribed nodes; else it has no counterpart."""
        dim, given = self.dim(), self.reference.get(at, {})
        own = {n: v for n, v in (self.reference.get(turn) or {}).items()}
        turns = [own.get(k - 3) if turn is not None else given.get(k) for k in ((6,) if dim == 2 else (4, 5, 6))]
        if any(d not in given for d in range(1, dim + 1)) or any(v is None or v[0] for v in turns):
            self.leave(block, f"*{block.word}", "only a rigid part whose reference point is held in all displacements and rotations (then: fixed); see contact type rigid for one under a load")
            return
        if not any(n in self.used for n in nodes):
            return  # rigid facets: their contacts are listed
        name = self.free_name(f"rigid_{block.line}", self.groups)
        self.m.node_groups[name] = [n for n in nodes if n in self.used]
        self.groups.add(name)
        for d in range(1, dim + 1):
            value, source = given[d]
            self.put(("fixed", name, AXES[d - 1]), value, source)

    def read_friction(self, interaction, block):
        """The coefficient of an interaction, of which other forms and changes within a step are left."""
        given = bool(block.rows) and interaction is not None and not self.steps
        if given:
            interaction["friction"] = item(block.rows[0], 0)
        if self.frictionless:
            self.leave(block, "*FRICTION", "left out by --frictionless; the coefficient stands beside the contact")
        elif not given or len(block.rows) > 1 or any(word in block.parameters for word in ("ROUGH", "EXPONENTIAL DECAY", "USER", "TAUMAX", "ANISOTROPIC")):
            self.leave(block, "*FRICTION", WHY["FRICTION"])

    def friction(self, interaction):
        return self.interactions.get(interaction, {}).get("friction", 0.0)

    def rubs(self):
        """Whether a contact of the draft has friction, which depends on the path: it needs a history."""
        return not self.frictionless and any(self.friction(contact[2]) > 0 for contact in self.contacts.values())

    def inelastic(self):
        return any("plastic" in m or "creep" in m for m in (self.materials.get(b[1], {}) for b in self.bodies.values()))

    def expression(self, key):
        """The value of a load or support, over time if the scene has a history."""
        history = self.values[key]
        start = self.initial.get(key[1], 0.0) if key[0] == "temperature" else 0.0
        if not self.history:
            step, value, amplitude = history[-1]
            if amplitude in self.amplitudes:
                value *= self.amplitudes[amplitude][0][-1][1]
            return said(value)
        rows, now, begin = [[0.0, start]], start, 0.0
        for k, step in enumerate(self.steps, 1):
            end = begin + step["period"]
            for _, value, amplitude in [h for h in history if h[0] == k or (k == 1 and h[0] == 0)]:
                if amplitude in self.amplitudes:
                    table, total = self.amplitudes[amplitude]
                    rows += [[t + (0 if total else begin), value * f] for t, f in table if t + (0 if total else begin) <= end * (1 + 1e-12)]
                elif not step["ramp"] or step["kind"] == "VISCO" and key[0] != "temperature":
                    rows += [[begin + 1e-6 * step["period"] if begin else 0.0, value]]
                else:
                    rows += [[begin, now], [end, value]]
                now = rows[-1][1]
            begin = end
        table = {}
        for t, v in rows:
            table[round(t, 12)] = v
        table = sorted(table.items())
        if len({v for _, v in table}) == 1:
            return said(table[0][1])
        scale = max((abs(v) for _, v in table), default=0)
        if key[0] == "temperature":
            scale = 1
        shape = tuple((t, v / scale) for t, v in table)
        if shape[-1][1] < 0 and scale != 1:
            shape, scale = tuple((t, -v) for t, v in shape), -scale
        name = self.tables.setdefault(shape, f"{'heat' if key[0] == 'temperature' else 'ramp'}{len(self.tables) + 1}")
        return product(scale, name)

    def material(self, title):
        """The entries of a body: {name: text}."""
        _, name, block = self.bodies[title]
        m, out = self.materials.get(name), {}
        if not m or "elastic" not in m:
            self.leave(block, f"material {name or '(none)'} of {title}", "it has no isotropic *ELASTIC: give young and poisson in the draft")
            m = m or {}
        rows = m.get("elastic", [(1.0, 0.0, 0.0)])
        hot = ("temperature", title, "") in self.values or title in self.initial
        out["young"] = piecewise([(e, t) for e, _, t in rows], "temperature") if hot else said(rows[0][0])
        out["poisson"] = piecewise([(n, t) for _, n, t in rows], "temperature") if hot else said(rows[0][1])
        if len(rows) > 1 and not hot:
            self.notes.append(f"{name} depends on the temperature, which the deck does not give: its first row is taken")
        if "density" in m:
            out["density"] = said(m["density"])
        if hot and ("expansion" in m or len(rows) > 1):
            out["temperature"] = self.expression(("temperature", title, "")) if ("temperature", title, "") in self.values else said(self.initial[title])
        if "expansion" in m and "temperature" in out:
            alpha, zero, source = m["expansion"]
            start = self.initial.get(title, 0.0)
            out["expansion"] = piecewise(alpha, "temperature")
            out["reference_temperature"] = said(start if len(alpha) == 1 else zero)
            if len(alpha) > 1 and start != zero:
                self.leave(source, "*EXPANSION that depends on the temperature, from an initial one that is not ZERO", "subtract its strain at the initial temperature")
        if "creep" in m:
            a, n, power = m["creep"]
            out["law"] = "strain_hardening" if power else "norton"
            out.update(rate=said(a / (1 + power)), exponent=said(n), **({"time_exponent": said(1 + power)} if power else {}))
        if "plastic" in m:
            rows = m["plastic"]
            out["law"] = "norton" if "creep" in m else "j2"
            out["yield"] = said(rows[0][0])
            if len(rows) > 1:
                out["hardening"] = said((rows[-1][0] - rows[0][0]) / (rows[-1][1] - rows[0][1]))
        if "law" in out and any(self.m.cells[c][0] in ("tri3", "tet4") for c in self.bodies[title][0]):
            out["element"] = "standard"
        return out

    def reach(self, slave, master):
        """How far any slave node is from the nearest master node, and the shortest slave edge; by boxes of this size."""
        def nodes(name):
            if name in self.m.node_groups:
                return set(self.m.node_groups[name]), []
            keys, edges = set(), []
            for facet in self.facets_of(self.m, self.m.facet_groups.get(name, [])):
                keys.update(facet)
                edges += [math.dist(self.m.nodes[a], self.m.nodes[b]) for a, b in zip(facet, facet[1:])]
            return keys, edges
        (mine, edges), (others, theirs) = nodes(slave), nodes(master)
        edges = edges or theirs  # a slave of nodes has none
        if not mine or not others or not edges:
            return None
        place = sorted(self.m.nodes[n] for n in others)
        first = [x[0] for x in place]
        far = 0.0
        for n in mine:
            x, best, at = self.m.nodes[n], math.inf, bisect.bisect(first, self.m.nodes[n][0])
            for way in (range(at, len(place)), range(at - 1, -1, -1)):
                for k in way:
                    if abs(first[k] - x[0]) >= best:
                        break
                    best = min(best, math.dist(x, place[k]))
            far = max(far, best)
        return far, min(edges)

    def entries(self):
        """The sections of the scene: [(section, [(key, text, comment)])]."""
        groups = {}
        for key in self.values:
            groups.setdefault(key[0], {}).setdefault(key[1], []).append(key)
        yield "body", [(t, "{" + ", ".join(f"{k}: {quoted(v)}" for k, v in self.material(t).items()) + "}", "") for t in self.bodies]
        for kind in ("fixed", "force", "traction"):
            yield kind, [(g, "{" + ", ".join(f"{k[2]}: {quoted(self.expression(k))}" for k in keys) + "}", "") for g, keys in groups.get(kind, {}).items()]
        yield "pressure", [(g, quoted(self.expression(keys[0])), "") for g, keys in groups.get("pressure", {}).items()]
        if "gravity" in groups:
            yield "gravity", [(k[2], quoted(self.expression(k)), "") for k in groups["gravity"][""]]
        if "rotation" in groups:
            more = [("axis", "{" + ", ".join(f"{a}: {said(v)}" for a, v in zip(AXES, self.axis[1])) + "}", ""),
                    ("through", "{" + ", ".join(f"{a}: {said(v)}" for a, v in zip(AXES, self.axis[0])) + "}", "")] if self.dim() == 3 else []
            yield "rotation", [("speed", quoted(self.expression(groups["rotation"][""][0])), ""), *more]
        yield "tie", [(name, f"{{slave: {s}, master: {m}" + (f", tolerance: {said(t)}" if t else "") + "}", "") for name, (s, m, t) in self.ties.items()]
        yield "contact", [self.contact(name) for name in self.contacts]

    def contact(self, name):
        slave, master, interaction, reach, row, _ = self.contacts[name]
        kind = "mortar" if self.quadratic() else "surface"
        text, far = f"type: {kind}, slave: {slave}, master: {master}", self.reach(slave, master)
        if far and max(far[0], reach) > 0.099 * far[1]:
            least = max(far[0], reach)
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
            self.notes.append("friction is solved at full order and by models of bodies, with *TIE by hybrid models; --frictionless leaves it out. More listed times follow its path more closely.")
        self.steps = self.steps or [{"period": 1.0, "kind": "", "ramp": True}]
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
            lines += ["history:", "  times: [" + ", ".join(said(t) for t in times) + "]"]
            if self.tables:
                lines.append("  tables:")
                lines += [f"    {name}: [" + ", ".join(f"[{said(t)}, {said(v)}]" for t, v in shape) + "]" for shape, name in self.tables.items()]
        return "\n".join(lines) + "\n"
