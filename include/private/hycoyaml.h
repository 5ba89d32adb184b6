/* Problems of YAML files, with their lines. */
#ifndef HYCOYAML_H
#define HYCOYAML_H

#include <hycoimpl.h>

/* Whether a text is no YAML, is nested too deeply, or has two documents; problem: "line 3: ...", "" if it has none. It
   needs no PETSc. */
PetscBool HycoYAMLHasProblem(const char text[], char problem[HYCO_LINE]);

#endif
