/* The help of a command: the options that most runs need, two examples, then the rest by subject. The lists of options
   are the declarations of the commands and of the classes. */
#include "driver.h"
#include <stdio.h>
#include <string.h>

#define N_USED 10

/* What a command's help begins with. Names without the dash, in this order. */
typedef struct {
  const char *command, *used[N_USED], *example[2];
} Page;

static const Page pages[] = {
    {"check",
     {"scene", "check_solve", "grid", "scatter", "values_", "report", "quiet", "hyco_memory"},
     {"hyco check -scene examples/pellet",
      "hyco check -scene examples/pellet -check_solve -values_radius 4.02,4.06,4.1 -values_load 0.2,0.6,1"}},
    {"solve",
     {"scene", "mu", "mu_", "grid", "values_", "output", "report", "table", "hyco_linear", "hyco_memory"},
     {"hyco solve -scene examples/pellet -mu 4.06,1.0 -output out.xdmf -report r.json",
      "hyco solve -scene examples/pellet -values_radius 4.06 -values_load 0.2,0.4,0.6,0.8,1 -table ramp.csv"}},
    {"train",
     {"scene", "model", "grid", "scatter", "values_", "target_u", "target_lambda", "target_max_added",
      "hyco_model_type", "report"},
     {"hyco train -scene examples/rope -grid 10,12 -model rope.h5",
      "mpiexec -n 4 hyco train -scene examples/rope -grid 6,6 -target_u 2e-3 -target_lambda 2e-2 -model rope.h5"}},
    {"predict",
     {"model", "mu", "mu_", "grid", "points", "output", "table", "report", "extrapolate", "hyco_fallback"},
     {"hyco predict -model rope.h5 -mu 0.07,0.17 -output p.xdmf",
      "hyco predict -model rope.h5 -grid 40,25 -table study.csv"}},
    {"compare",
     {"scene", "model", "grid", "scatter", "mu", "values_", "points", "table", "report", "quiet"},
     {"hyco compare -scene examples/rope -model rope.h5 -grid 20,24 -table c.csv",
      "hyco compare -scene examples/rope -model rope.h5 -scatter 200 -report c.json"}},
    {"fit",
     {"model", "target_", "hold_", "scene", "mu", "mu_", "starts", "fit_starts", "fit_type", "report"},
     {"hyco fit -model roller.h5 -target_push -6.5 -target_peak 1.1 -scene examples/roller",
      "hyco fit -model roller.h5 -target_push -6.5 -hold_place 0 -fit_type blmvm -report fit.json"}},
    {"export",
     {"model", "c", "quiet"},
     {"hyco export -model strip.h5 -c strip.c", "cc -std=c99 -O2 main.c strip.c -lm"}},
    {"view", {"model", "scene"}, {"hyco view -model rope.h5", "hyco view -scene examples/rope"}},
};

/* The subject of an option is that of the longest beginning of its name; in the order of the help. */
static const struct {
  const char *subject, *beginnings;
} subjects[] = {
    {"files and text", "scene model output report table c quiet progress"},
    {"points", "mu grid values_ points scatter extrapolate check_solve gradient"},
    {"accuracy of a training", "target_ hyco_validation validation_ hyco_search hyco_model_type"},
    {"fits", "fit_"},
    {"greedy training", "greedy training_grid target max_ hyco_greedy_"},
    {"solutions of a training", "hyco_groups hyco_snapshots"},
    {"modes", "hyco_pod_"},
    {"the reduced integration domain, hybrid models", "hyco_rid_ hyco_deim_ hyco_hybrid hyco_scan hyco_keep_"},
    {"models of bodies", "hyco_bodies_"},
    {"baselines", "hyco_dual hyco_nnmf_ hyco_cubature_ hyco_regression_"},
    {"predictions", "hyco_reconstruct hyco_fallback hyco_full_ hyco_residual hyco_rom_"},
    {"solver", "hyco_solver_ hyco_tao_ hyco_linear hyco_memory hyco_monitor"},
    {"histories", "hyco_newton hyco_step_ hyco_substeps hyco_checkpoint hyco_resume hyco_write_fclib"},
    {"others", ""},
};
#define N_SUBJECTS ((int)(sizeof(subjects) / sizeof(subjects[0])))

/* The length of the longest word of a list with which a name begins. Words of a list, separated by blanks; the
   length lets the most specific subject win. */
static size_t HelpPrefixLength(const char list[], const char name[])
{
  size_t longest = 0;

  for (const char *word = list; *word;) {
    const size_t n = strcspn(word, " ");

    if (n > longest && strncmp(word, name, n) == 0) longest = n;
    word += n + strspn(word + n, " ");
  }
  return longest;
}

/* Options without a subject of their own go to the last one. */
static int SubjectOf(const char name[])
{
  size_t longest = 0;
  int best = N_SUBJECTS - 1;

  for (int k = 0; k < N_SUBJECTS; k++) {
    const size_t n = HelpPrefixLength(subjects[k].beginnings, name);

    /* The longest beginning wins: hyco_pod_ is another subject than hyco_. */
    if (n > longest) {
      longest = n;
      best = k;
    }
  }
  return best;
}

/* A name that ends with an underscore stands for many: a NAME follows. */
static void HelpLine(const HycoOption *o)
{
  char left[128];

  snprintf(left, sizeof(left), "-%s%s %s", o->name, o->name[strlen(o->name) - 1] == '_' ? "NAME" : "", o->value);
  printf("  %-46s %s%s%s%s\n", left, o->meaning, o->initial[0] ? " [" : "", o->initial, o->initial[0] ? "]" : "");
}

/* All options that a command reads (all commands: NULL). `own` holds the commands', which the list borrows. */
static PetscErrorCode HelpCollect(const Command *command, const HycoOptionList *own, PetscInt *n,
                                  const HycoOption ***list)
{
  const HycoOption *table;
  PetscInt m;

  PetscFunctionBegin;
  PetscCall(HycoGetOptionTable(&m, &table));
  PetscCall(PetscMalloc1((size_t)(own->n + m), list));
  *n = 0;
  /* The command's own options first, then those of the classes that it uses. */
  for (PetscInt k = 0; k < own->n; k++) (*list)[(*n)++] = &own->option[k];
  for (PetscInt k = 0; k < m; k++) {
    if (!command || DriverReads(command, &table[k])) (*list)[(*n)++] = &table[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The most used options and the examples; prints each option once: what is printed leaves the list. */
static void PrintPage(const Page *page, PetscInt n, const HycoOption *list[])
{
  printf("\nMost used options\n");
  for (int i = 0; i < N_USED && page->used[i]; i++) {
    for (PetscInt k = 0; k < n; k++) {
      if (!list[k] || strcmp(list[k]->name, page->used[i])) continue;
      HelpLine(list[k]);
      list[k] = NULL;
    }
  }
  printf("\nExamples\n");
  for (int i = 0; i < 2; i++) printf("    %s\n", page->example[i]);
}

/* What PrintPage() has printed is NULL in the list. */
static void PrintSubjects(PetscInt n, const HycoOption *list[])
{
  for (int s = 0; s < N_SUBJECTS; s++) {
    PetscBool begun = PETSC_FALSE;

    for (PetscInt k = 0; k < n; k++) {
      if (!list[k] || SubjectOf(list[k]->name) != s) continue;
      if (!begun) printf("\nOptions: %s\n", subjects[s].subject);
      begun = PETSC_TRUE;
      HelpLine(list[k]);
    }
  }
}

static void PrintNotes(void)
{
  printf("\nOptions that begin with hyco_ may stand in a scene too, in its hyco: section without the prefix.\n");
  printf("PETSc's options work too: -log_view, -info, -hyco_mumps_icntl_14 100 (MUMPS, solver of K), "
         "-hyco_primal_..., -hyco_tao_monitor, -hyco_pod_svd_view.\n");
  printf("Exit status: 0 success; 1 an error, in one line; 3 a model is written, but it misses a target or the default "
         "limits; 130 a training was interrupted (Ctrl-C; 143: terminated); the same command continues it.\n");
  printf("Under MPI: mpiexec -n 2 hyco ...\n");
}

/* command NULL: all commands. Rank 0. */
PetscErrorCode DriverHelp(const Command *command)
{
  HycoOptionList own = {0};
  const HycoOption **list = NULL;
  PetscInt n = 0;

  PetscFunctionBegin;
  printf("hyco %s: reduced and full-order models of parametrised unilateral contact\n\n", HycoVersion());
  for (PetscInt k = 0; commands[k].name; k++) {
    if (command && command != &commands[k]) continue;
    printf("  %s\n      %s\n", commands[k].usage, commands[k].meaning);
    /* Of all commands into one list, in which an option of several appears once. */
    PetscCall(HycoOptionsRecord(&own, commands[k].declare));
  }
  PetscCall(HelpCollect(command, &own, &n, &list));
  for (size_t k = 0; command && k < sizeof(pages) / sizeof(pages[0]); k++) {
    if (strcmp(pages[k].command, command->name) == 0) PrintPage(&pages[k], n, list);
  }
  PrintSubjects(n, list);
  PetscCall(PetscFree(list));
  PetscCall(HycoOptionListDestroy(&own));
  PrintNotes();
  PetscFunctionReturn(PETSC_SUCCESS);
}
