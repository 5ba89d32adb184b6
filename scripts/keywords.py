"""The keywords of Abaqus's and CalculiX's decks that scripts/convert knows, and the blocks of a deck. What is not in the table is never silent: unread() names each
keyword, parameter and value that it does not have."""
import os
import re

# Keywords that are read, with their parameters: NAME is read, -NAME does not change the mechanics, NAME=A|B is read with these values. Another value, and a parameter
# that is not here, is listed; with !NAME the keyword is then left out as a whole.
MESH = """
ASSEMBLY: -NAME, -LIBRARY
ELEMENT: TYPE, ELSET
ELSET: ELSET, GENERATE, INSTANCE, -INTERNAL, -UNSORTED
END ASSEMBLY:
END INSTANCE:
END PART:
INSTANCE: NAME, PART, !INSTANCE, !LIBRARY
NODE: NSET, !SYSTEM=R
NSET: NSET, ELSET, GENERATE, INSTANCE, -INTERNAL, -UNSORTED
PART: NAME
SURFACE: NAME, TYPE=ELEMENT|NODE, -INTERNAL, -NO OFFSET, -NO THICKNESS, !COMBINE=UNION
"""
READ = """
AMPLITUDE: NAME, BEGIN, !DEFINITION=TABULAR|EQUALLY SPACED|SMOOTH STEP, FIXED INTERVAL, SHIFTX, SHIFTY, TIME=STEP TIME|TOTAL TIME, !USER, VALUE=RELATIVE|ABSOLUTE
BOUNDARY: AMPLITUDE, FIXED, -LOAD CASE, OP=MOD|NEW, -REGION TYPE, !SUBMODEL, !TYPE=DISPLACEMENT, !USER
CLEARANCE: MASTER, SLAVE, !TABULAR, VALUE
CLOAD: AMPLITUDE, -FOLLOWER, -LOAD CASE, OP=MOD|NEW, -REGION TYPE, !SUBMODEL, !USER
CONTACT: OP=MOD|NEW
CONTACT INCLUSIONS: !ALL EXTERIOR
CONTACT PAIR: ADJUST, -CPSET, -EXTENSION ZONE, -HCRIT, INTERACTION, -MECHANICAL CONSTRAINT, -MINIMUM DISTANCE, -NO THICKNESS, -SLIDING TRANSITION, -SMALL SLIDING, -SUPPLEMENTARY CONSTRAINTS, TIED, -TRACKING, TYPE=NODE TO SURFACE|SURFACE TO SURFACE|MORTAR|LINMORTAR
COUPLED TEMPERATURE-DISPLACEMENT: CREEP, -DELTMX, -DIRECT, -SOLVER, STEADY STATE
COUPLING: -CONSTRAINT NAME, REF NODE, SURFACE
CREEP: !LAW=NORTON|STRAIN|TIME
DENSITY:
DLOAD: AMPLITUDE, -FOLLOWER, -LOAD CASE, OP=MOD|NEW, -REGION TYPE, !USER
DSLOAD: AMPLITUDE, -CONSTANT RESULTANT, -FOLLOWER, -LOAD CASE, OP=MOD|NEW, -REGION TYPE, !SUBMODEL, !USER
ELASTIC: !TYPE=ISO|ISOTROPIC
EXPANSION: !TYPE=ISO|ISOTROPIC, ZERO
FRICTION: -ELASTIC SLIP, -LAGRANGE, !ROUGH, -SLIP TOLERANCE, !USER
INITIAL CONDITIONS: !FILE, !TYPE=TEMPERATURE, !USER
KINEMATIC:
MATERIAL: NAME
PLASTIC: HARDENING=ISOTROPIC, RATE
RESTART: -FREQUENCY, -NUMBER INTERVAL, -OVERLAY, -TIME MARKS, -WRITE
RIGID BODY: !ANALYTICAL SURFACE, ELSET, -ISOTHERMAL, NSET, PIN NSET, REF NODE, ROT NODE, TIE NSET
SOLID SECTION: !COMPOSITE, -CONTROLS, ELSET, MATERIAL, -ORIENTATION
SPRING: ELSET, !NONLINEAR, !ORIENTATION
STATIC: -ALLSDTOL, -CONTINUE, -DIRECT, -FACTOR, -SOLVER
STEP: AMPLITUDE=STEP|RAMP, -CONVERT SDI, -EXTRAPOLATION, -INC, -INCF, -NAME, NLGEOM=NO|OFF, -SOLVER, -UNSYMM
SURFACE BEHAVIOR: -AUGMENTED LAGRANGE, -DIRECT, -PENALTY, PRESSURE-OVERCLOSURE=HARD|LINEAR|TIED
SURFACE INTERACTION: NAME
TEMPERATURE: AMPLITUDE, !FILE, OP=MOD|NEW, !USER
TIE: ADJUST=YES|NO, -CONSTRAINT RATIO, !CYCLIC SYMMETRY, !FLUID PERIODIC, !MULTISTAGE, NAME, -NO ROTATION, -NO THICKNESS, POSITION TOLERANCE, -TYPE
VISCO: -ALLSDTOL, -CETOL, -CONTINUE, CREEP, -DIRECT, -EXPLICIT, -FACTOR, -SOLVER
"""
# What is of the output or the way to the solution alone; what static mechanics of isotropic solids does not need
QUIET = {"HEADING", "PREPRINT", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "ENERGY OUTPUT", "NODE FILE", "EL FILE", "ELEMENT FILE", "CONTACT FILE",
         "FILE FORMAT", "FILE OUTPUT", "NODE PRINT", "EL PRINT", "CONTACT PRINT", "ENERGY PRINT", "ENERGY FILE", "SECTION PRINT", "SECTION FILE", "FACE PRINT", "PRINT",
         "MONITOR", "CONTROLS", "CONDUCTIVITY", "SPECIFIC HEAT", "END STEP", "SECTION CONTROLS", "ORIENTATION", "INTEGRATED OUTPUT", "INCREMENTATION OUTPUT", "PHYSICAL CONSTANTS",
         "FILTER", "DIAGNOSTICS", "TIME POINTS", "CONTACT PROPERTY ASSIGNMENT", "DISTRIBUTING", "INTEGRATED OUTPUT SECTION", "FIELD",
         "ELECTRICAL CONDUCTIVITY", "LATENT HEAT", "SOLUBILITY", "DIFFUSIVITY", "USER OUTPUT VARIABLES", "SOLUTION TECHNIQUE"}
MAKES = "the reader makes no nodes and elements, and no turned axes for them: write the mesh in full (cgx: send all abq; CAE: Write Input)"
WHY = {"FRICTION": "only a constant coefficient of a surface interaction is friction: in the draft", "EQUATION": "no equations between displacements",
       "MPC": "no constraints of this kind", "COUPLING": "no couplings of a reference point, unless it does not move", "COUPLING, ORIENTATION": "the axes are x, y and z",
       "DISTRIBUTING COUPLING": "no couplings of a reference point", "KINEMATIC COUPLING": "no couplings of a reference point",
       "HOURGLASS STIFFNESS": "cells are fully integrated", "TRANSFORM": "supports and loads in turned axes: see fixed: direction in scenes.md",
       "SHELL SECTION": "no shells", "BEAM SECTION": "no beams", "MEMBRANE SECTION": "no membranes", "CONNECTOR SECTION": "no connectors", "SPRING": "only SPRING1 of one stiffness; see spring: in scenes.md",
       "MASS": "no point masses", "DASHPOT": "no dampers", "CONTACT": "general contact: name the pairs of surfaces as contacts", "CONTACT INCLUSIONS": "general contact: name the pairs of surfaces as contacts",
       "CONTACT INCLUSIONS, ALL EXTERIOR": "general contact: name the pairs of surfaces as contacts",
       "DYNAMIC": "no inertia", "DAMPING": "no inertia", "PRE-TENSION SECTION": "no pretension: prescribe a displacement of one side",
       "CYCLIC SYMMETRY MODEL": "no cyclic symmetry", "TIE, CYCLIC SYMMETRY": "no cyclic symmetry", "TIE, MULTISTAGE": "no cyclic symmetry",
       "MODEL CHANGE": "bodies and contacts stay", "CHANGE FRICTION": "the first coefficient stays", "CHANGE SURFACE BEHAVIOR": "the first law stays",
       "CONTACT CONTROLS": "no stabilisation is needed", "CONTACT STABILIZATION": "no stabilisation is needed", "STATIC, STABILIZE": "no stabilisation is needed",
       "VISCO, STABILIZE": "no stabilisation is needed", "STATIC, RIKS": "loads follow the time, not an arc length",
       "STEP, NLGEOM": "displacements and rotations are small", "STEP, PERTURBATION": "the step is taken as an ordinary one",
       "ELASTIC, TYPE": "elasticity is isotropic, or a law of a program", "EXPANSION, TYPE": "expansion is isotropic",
       "PLASTIC, HARDENING": "hardening is isotropic", "CREEP, LAW": "see norton and strain_hardening in materials.md",
       "SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE": "contact is hard", "SURFACE BEHAVIOR, NO SEPARATION": "contacts open; see tie in scenes.md",
       "BOUNDARY, TYPE": "prescribe the displacement, as a number or an expression", "BOUNDARY, SUBMODEL": "prescribe the displacement, as a number or an expression",
       "BOUNDARY, USER": "prescribe the displacement, as a number or an expression", "TEMPERATURE, FILE": "write the field as an expression of x, y, z and t",
       "FRICTION, SHEAR TRACTION SLOPE": "contacts stick without elastic slip", "INITIAL CONDITIONS, TYPE": "bodies are without stress and at rest at first",
       "SURFACE, TYPE": "a rigid surface is a contact of type obstacle (normal and gap as expressions), or a solid that is held",
       "NODE, SYSTEM": MAKES, "SURFACE, COMBINE": "name the sides of the surface, or the surfaces of a union",
       **{f"AMPLITUDE, {p}": "its loads are as without an amplitude; write the function as a table of the history" for p in ("DEFINITION", "USER")},
       **{word: "only static steps and *VISCO have a counterpart" for word in ("FREQUENCY", "BUCKLE", "HEAT TRANSFER", "MODAL DYNAMIC", "STEADY STATE DYNAMICS", "SUBSTRUCTURE GENERATE",
                                                                           "DYNAMIC", "GEOSTATIC", "SOILS", "COMPLEX FREQUENCY", "RESPONSE SPECTRUM", "RANDOM RESPONSE",
                                                                           "UNCOUPLED TEMPERATURE-DISPLACEMENT", "GREEN", "SENSITIVITY", "ELECTROMAGNETICS")},
       **{word: MAKES for word in ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "IMPORT", "IMPORT NSET", "IMPORT ELSET", "SYMMETRIC MODEL GENERATION", "REFINE MESH", "TRANSFORM NODES")}}
OTHER = "what this parameter says is not taken"


class KeywordError(Exception):
    """A user's error, in one line."""


def solid(text):
    """A text without blanks, which CalculiX ignores."""
    return "".join(text.upper().split())


def rows_of(table):
    """{keyword: {parameter: (mark, values)}}"""
    found = {}
    for line in table.strip().splitlines():
        word, _, rest = line.partition(":")
        found[word] = {m[2]: (m[1], m[3].split("|") if m[3] else None) for m in (re.fullmatch(r"([-!]?)([^=]+)(?:=(.+))?", p.strip()) for p in rest.split(",") if p.strip())}
    return found


MESH, READ = rows_of(MESH), rows_of(READ)
SPELLED = {solid(word): word for word in (*MESH, *READ, *QUIET, *WHY)}
PROCEDURES = {word for word, why in WHY.items() if why.startswith("only static steps")}


class Block:
    """A *KEYWORD with its parameters and rows, and where it stands. Words of the table are spelled as there."""

    def __init__(self, text, file, line, main):
        word, *rest = words_of(text[1:])
        self.word, self.rows, self.file, self.line, self.taken = SPELLED.get(solid(word), " ".join(word.upper().split())), [], file, line, True
        known = {solid(name): (name, {solid(value): value for value in values or ()}) for name, (_, values) in {**MESH, **READ}.get(self.word, {}).items()}
        self.parameters = {}
        for name, _, value in (r.partition("=") for r in rest if r):
            name, values = known.get(solid(name), (" ".join(name.upper().split()), {}))
            self.parameters[name] = values.get(solid(value), value.strip())
        self.place = f"line {line}" if file == main else f"{os.path.basename(file)}, line {line}"
        self.instance = ""  # that of a section of a part

    def __iter__(self):
        return iter((self.word, self.parameters, self.rows))


def unread(block):
    """What of a block is not taken: [(text, reason)]; and whether the rest of it is."""
    known = {**MESH, **READ}.get(block.word)
    if known is None:
        return ([] if block.word in QUIET else [(f"*{block.word}", WHY.get(block.word, "the reader does not know this keyword"))]), False
    listed, taken = [], True
    for name, value in block.parameters.items():
        mark, values = known.get(name, ("?", None))  # blocks_of() has read the data lines of INPUT
        if name == "INPUT" or mark == "-" or mark == "" and values is None or values is not None and value in values:
            continue
        listed.append((f"*{block.word}, {name}" + (f"={value.upper()}" if value else ""), WHY.get(f"{block.word}, {name}", OTHER)))
        taken = taken and mark != "!"
    return listed, taken


def words_of(line):
    """The words between commas, without the quotes around names, which may have commas."""
    return [w.replace('"', "").strip() for w in (re.findall(r'(?:^|,)((?:"[^"]*"|[^,"])*)', line) if '"' in line else line.split(","))]


def lines_of(path, main, within=()):
    """The lines of a file and, in their place, of those that it includes: (file, number, text). The line of a keyword may be continued after a comma."""
    if os.path.realpath(path) in within:
        raise KeywordError(f"{path} includes itself")
    keyword, start = "", 0
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, 1):
            line = line.strip()
            if line.startswith("**") or not line:
                continue
            start = start if keyword else number
            if line.startswith("*") or keyword:
                keyword += line
                if keyword.endswith(","):
                    continue
                line, keyword = keyword, ""
            if re.match(r"\*\s*INCLUDE\s*(,|$)", line, re.I):
                yield from lines_of(beside(path, main, Block(line, path, start, main)), main, (*within, os.path.realpath(path)))
            else:
                yield path, start, line


def beside(path, main, block):
    """The file that a block names, beside the file that names it or the deck."""
    name = block.parameters.get("INPUT", "")
    found = [other for other in (os.path.join(os.path.dirname(p), name) for p in (path, main)) if os.path.isfile(other)]
    if not found:
        raise KeywordError(f"{path}, line {block.line}: there is no file {os.path.join(os.path.dirname(path), name)} to be included")
    return found[0]


def blocks_of(path):
    """The blocks of a deck. Data lines belong to the keyword before them, in whichever file they stand. A line of an element that ends with a comma is continued."""
    found, open_row = [], False
    lines = lines_of(path, path)
    stack = [lines]
    while stack:
        file, number, line = next(stack[-1], (None, 0, ""))
        if file is None:
            stack.pop()
        elif line.startswith("*"):
            found.append(Block(line, file, number, path))
            open_row = False
            if "INPUT" in found[-1].parameters:  # its data lines
                stack.append(lines_of(beside(file, path, found[-1]), path, (os.path.realpath(file),)))
        elif found:
            row = words_of(line) if keeps_blanks(found[-1].word) else [w for w in words_of(line) if w]
            if open_row:
                found[-1].rows[-1] += row
            else:
                found[-1].rows.append(row)
            open_row = line.endswith(",") and found[-1].word == "ELEMENT"
    return found


def keeps_blanks(word):
    """Empty fields have a meaning in rows other than lists of numbers."""
    return word not in ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "INSTANCE")
