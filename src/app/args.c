/* Options of the command line: checks, values. Each page declares its own where it reads them. */
#include "driver.h"
#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* Options of PETSc and SLEPc: recognised by their beginning, checked by the code that reads them. */
static const char *const foreign[] = {"log_",
                                      "info",
                                      "malloc",
                                      "memory_view",
                                      "objects_",
                                      "options_",
                                      "prefix_",
                                      "mat_",
                                      "vec_",
                                      "on_error_",
                                      "start_in_debugger",
                                      "stop_for_debugger",
                                      "fp_trap",
                                      "error_output",
                                      "check_pointer",
                                      "get_total_flops",
                                      "nox",
                                      "viewer_",
                                      "citations",
                                      "use_gpu",
                                      "skip_petscrc",
                                      "no_signal",
                                      "petsc_",
                                      "device_",
                                      NULL};
/* Those of them that PETSc reads at its end. */
static const char *const at_end[] = {"options_", "citations", "malloc",   "objects_",        "log_", "memory_view",
                                     "nox",      "skip_",     "on_error", "get_total_flops", NULL};
/* Of objects that have a prefix in hyco. */
static const struct {
  const char *beginning, *with;
} prefixed[] = {{"ksp_", "-hyco_primal_ or -hyco_tao_"},
                {"pc_", "-hyco_primal_ or -hyco_tao_"},
                {"tao_", "-hyco_"},
                {"svd_", "-hyco_pod_"},
                {"bv_", "-hyco_pod_"},
                {"ds_", "-hyco_pod_"},
                {"st_", "-hyco_pod_"}};

/* PETSc compares names of options without regard to case. PETSc's own objects have options by prefix, which no table
   lists. */
static PetscBool BeginsAs(const char *const beginnings[], const char name[])
{
  for (PetscInt k = 0; beginnings[k]; k++) {
    if (strncasecmp(name, beginnings[k], strlen(beginnings[k])) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Whether an option is a scene's entry other than those under hyco:. */
static PetscBool IsSceneEntry(const char name[])
{
  return (PetscBool)(HycoIsSceneKey(name) && strncasecmp(name, "hyco_", 5));
}

/* The commands that have an option that this one lacks: "solve, predict"; "" if none has. Each command's Declare
   function says what it reads: there is no second list that could differ. */
static PetscErrorCode ListTakers(const char name[], char list[DRIVER_LINE])
{
  PetscFunctionBegin;
  list[0] = '\0';
  for (PetscInt c = 0; commands[c].name; c++) {
    HycoOptionList own = {0};

    /* Recorded in a list of its own: the table of the running command stays as it is. */
    PetscCall(HycoOptionsRecord(&own, commands[c].declare));
    if (HycoOptionListFind(&own, name)) PetscCall(HycoListAdd(list, ", ", commands[c].name));
    PetscCall(HycoOptionListDestroy(&own));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The most helpful reason first: an option of another command, then a near name, then that there is none. */
static PetscErrorCode OptionUnknown(const Command *command, const HycoOptionList *own, const char name[])
{
  const char *near;
  char takers[DRIVER_LINE];

  PetscFunctionBegin;
  /* A renamed option first: its new name is the answer, whoever has it. */
  PetscCall(HycoOptionsCheckName(name));
  PetscCall(ListTakers(name, takers));
  HycoCheck(!takers[0], "hyco %s has no option -%s; these commands have it: hyco %s", command->name, name, takers);
  near = HycoOptionNearest(name, own);
  if (near)
    HycoFail("hyco %s has no option -%s; did you mean -%s%s? (hyco %s -help lists them)", command->name, name, near,
             near[strlen(near) - 1] == '_' ? "NAME" : "", command->name);
  HycoFail("hyco %s has no option -%s (hyco %s -help lists them)", command->name, name, command->name);
}

/* By the class that declares it; options of HycoROM also say for which commands (HycoOption.only). */
PetscBool DriverReads(const Command *command, const HycoOption *option)
{
  if (!strstr(command->classes, option->owner)) return PETSC_FALSE;
  return (PetscBool)(strcmp(option->owner, "HycoROM") || !option->only[0] || strstr(option->only, command->name));
}

/* Fails for an option of the library that no object of the command reads. Options of the hyco: section are not checked
   by command: one scene serves all of them. */
static PetscErrorCode CheckReaders(const Command *command, const HycoOption *option)
{
  char readers[DRIVER_LINE] = "";

  PetscFunctionBegin;
  if (DriverReads(command, option)) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; commands[c].name; c++) {
    if (DriverReads(&commands[c], option)) PetscCall(HycoListAdd(readers, ", ", commands[c].name));
  }
  HycoFail("hyco %s does not use -%s; these commands do: hyco %s%s", command->name, option->name, readers,
           strcmp(readers, "train") ? "" : " (it sets the model in training)");
}

/* A dash and a letter: "-1.5" is a value. */
static PetscBool IsKey(const char word[])
{
  return (PetscBool)(word[0] == '-' &&
                     (isalpha((unsigned char)word[1]) || (word[1] == '-' && isalpha((unsigned char)word[2]))));
}

/* `previous`: the word before it; NULL: none. */
static PetscErrorCode CheckName(const Command *command, const HycoOptionList *own, const char name[], const char word[],
                                const char previous[])
{
  const HycoOption *option = HycoOptionFind(name);
  PetscBool solvers, reads;

  PetscFunctionBegin;
  if (option) PetscCall(CheckReaders(command, option));
  if (!option) {
    PetscCall(HycoOptionsOfSolver(name, &solvers, &reads));
    HycoCheck(!solvers || reads,
              "the option %s has no effect: no solver in hyco reads it; docs/petsc.md lists their prefixes", word);
    HycoCheck(!solvers || strncasecmp(name, "hyco_pod_", 9) || !strcmp(command->name, "train"),
              "hyco %s does not use %s; this command does: hyco train", command->name, word);
    if (solvers) PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (size_t k = 0; k < sizeof(prefixed) / sizeof(prefixed[0]); k++) {
    if (strncasecmp(name, prefixed[k].beginning, strlen(prefixed[k].beginning))) continue;
    HycoFail("the option %s has no effect: hyco's solvers have prefixes, %s in place of the dash (docs/petsc.md)", word,
             prefixed[k].with);
  }
  if (option || HycoOptionListFind(own, name) || BeginsAs(foreign, name) ||
      (IsSceneEntry(name) && HycoOptionListFind(own, "scene")))
    PetscFunctionReturn(PETSC_SUCCESS);
  /* "-title -x" would be read as two options: an expression may begin with a dash and a letter. */
  HycoCheck(!previous || !IsKey(previous) || !IsSceneEntry(previous + 1),
            "%s follows %s, which expects a value, and looks like an option; write a value that begins with a dash and "
            "a letter with a blank first, %s \" %s\", or in scene.yaml",
            word, previous, previous, word);
  PetscCall(OptionUnknown(command, own, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before anything is read or solved, so that a typing error costs no time. */
PetscErrorCode DriverCheckArguments(const Command *command, int argc, char **argv)
{
  HycoOptionList own = {0};
  char prefix[DRIVER_LINE] = "", full[2 * DRIVER_LINE];
  size_t end[8] = {0};
  PetscInt depth = 0;

  PetscFunctionBegin;
  PetscCall(HycoOptionsRecord(&own, command->declare));
  for (int k = 2; k < argc; k++) {
    const char *name = argv[k] + (argv[k][1] == '-' ? 2 : 1);

    if (!IsKey(argv[k]))
      HycoFail("\"%s\" is not an option; options begin with a dash and take one value (separate several numbers by "
               "commas, without spaces)",
               argv[k]);
    /* As PETSc does: up to 5 prefixes for what follows. */
    if (strcasecmp(name, "prefix_push") == 0 && k + 1 < argc && depth < 7) {
      end[++depth] = strlen(prefix) + strlen(argv[k + 1]);
      PetscCall(PetscStrlcat(prefix, argv[++k], sizeof(prefix)));
      continue;
    }
    if (strcasecmp(name, "prefix_pop") == 0 && depth) {
      prefix[end[--depth]] = '\0';
      continue;
    }
    snprintf(full, sizeof(full), "-%s%s", prefix, name);
    PetscCall(CheckName(command, &own, full + 1, prefix[0] ? full : argv[k], k > 2 && !prefix[0] ? argv[k - 1] : NULL));
    /* The value, which is not checked here. */
    if (k + 1 < argc && !IsKey(argv[k + 1])) k++;
  }
  PetscCall(HycoOptionListDestroy(&own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the command line alone: an option of the scene's hyco: section may serve other commands. */
PetscErrorCode DriverRefuseOnly(const char only[], const char reason[])
{
  int argc;
  char **argv;

  PetscFunctionBegin;
  PetscCall(PetscGetArgs(&argc, &argv));
  /* From 2: the program and the command come first. */
  for (int k = 2; k < argc; k++) {
    const HycoOption *option = IsKey(argv[k]) ? HycoOptionFind(argv[k] + (argv[k][1] == '-' ? 2 : 1)) : NULL;

    HycoCheck(!option || strcmp(option->only, only), "-%s has no effect here: %s; remove it", option->name, reason);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of the command line and of the files that it names: others, of ~/.petscrc and PETSC_OPTIONS, are for all
   programs. */
static PetscErrorCode CreateGivenLoads(PetscOptions *given)
{
  int argc;
  char **argv;

  PetscFunctionBegin;
  PetscCall(PetscGetArgs(&argc, &argv));
  PetscCall(PetscOptionsCreate(given));
  PetscCall(PetscOptionsInsertArgs(*given, argc - 1, argv + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether it is an error that this rank has not read an option. Early: what solvers read with the first solve counts as
   read. */
static PetscErrorCode IsMissed(const char name[], PetscOptions given, PetscBool early, PetscBool *missed)
{
  char dashed[2 * DRIVER_LINE];
  PetscBool solvers, reads, mine;

  PetscFunctionBegin;
  PetscCall(HycoOptionsOfSolver(name, &solvers, &reads));
  snprintf(dashed, sizeof(dashed), "-%s", name);
  PetscCall(PetscOptionsHasName(given, NULL, dashed, &mine));
  *missed = (PetscBool)(mine && !BeginsAs(at_end, name) && !(early && solvers && reads && !strstr(name, "_pod_")));
  /* A name of hyco's that nothing has is a typing error anywhere. */
  if (!mine && strncasecmp(name, "hyco_", 5) == 0) *missed = (PetscBool)(!reads && !HycoOptionFind(name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An option that no rank has read is a typing error or has no effect here; both would go unnoticed. The ranks' options
   are the same. */
static PetscErrorCode CheckLeft(PetscBool early)
{
  PetscInt n;
  PetscOptions given;
  char **names, **values, all[DRIVER_LINE], first[DRIVER_LINE] = "";

  PetscFunctionBegin;
  PetscCall(CreateGivenLoads(&given));
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt k = 0, most = n; !first[0]; k++) {
    PetscBool missed = PETSC_FALSE, shows;

    HycoBcast(&most, 1, MPIU_INT, PETSC_COMM_WORLD);
    if (k >= most) break;
    all[0] = '\0';
    if (HycoRank(PETSC_COMM_WORLD) == 0) PetscCall(PetscStrncpy(all, names[k], sizeof(all)));
    HycoBcast(all, DRIVER_LINE, MPI_CHAR, PETSC_COMM_WORLD);
    shows = (PetscBool)(strstr(all, "view") || strstr(all, "reason") || strstr(all, "error"));
    for (PetscInt l = 0; l < n && !missed; l++) {
      if (strcasecmp(names[l], all) == 0 && !(early && shows)) PetscCall(IsMissed(all, given, early, &missed));
    }
    HycoAllreduce(&missed, 1, HYCO_MPI_BOOL, MPI_LAND, PETSC_COMM_WORLD);
    if (missed) PetscCall(PetscStrncpy(first, all, sizeof(first)));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  PetscCall(PetscOptionsDestroy(&given));
  HycoCheck(!first[0], "the option -%s has no effect in this command; remove it, or see hyco -help", first);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverCheckLeft(void)
{
  PetscFunctionBegin;
  PetscCall(CheckLeft(PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before long work: what a solver reads at its first solve is not counted yet. */
PetscErrorCode DriverCheckLeftEarly(void)
{
  PetscFunctionBegin;
  PetscCall(CheckLeft(PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also declares it: the same call reads an option and lists it in the help. A margin of 32 is left for suffixes. */
PetscErrorCode DriverGet(const char name[], const char text[], char value[PETSC_MAX_PATH_LEN])
{
  char dashed[DRIVER_LINE];

  PetscFunctionBegin;
  value[0] = '\0';
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", name));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsString(dashed, text, value, PETSC_MAX_PATH_LEN - 32, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL: the command has no such file. The texts are those of the help, in one place for all commands. */
PetscErrorCode DriverReadFiles(char scene[], char model[], char output[], char report[], char table[])
{
  PetscFunctionBegin;
  if (scene)
    PetscCall(DriverGet("scene",
                        "<folder> folder with scene.yaml, or the YAML file; every entry can be overridden: "
                        "-body_NAME_young 2e5",
                        scene));
  if (model)
    PetscCall(DriverGet("model", "<file.h5> the reduced model: train writes it, the other commands read it", model));
  if (output)
    PetscCall(DriverGet(
        "output",
        "<file.xdmf> fields for ParaView, with the numbers in a .h5 file beside it; or <file.vtkhdf>, a single file",
        output));
  if (report) PetscCall(DriverGet("report", "<file.json> the result as one JSON object", report));
  if (table)
    PetscCall(
        DriverGet("table", "<file.csv> a table with a row per point; or <file.h5>, with a dataset per column", table));
  /* Every command that reports also prints, which -quiet is for. */
  if (report) PetscCall(DriverReadQuiet());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options whose absence has no sensible default. Text is empty where an option is absent or has no value. */
PetscErrorCode DriverRequire(const char name[], const char value[])
{
  PetscFunctionBegin;
  HycoCheck(value[0], "the option -%s is missing; hyco -help explains it", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}
