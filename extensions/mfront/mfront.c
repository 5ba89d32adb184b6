/*
  A user's law from a shared library with the generic C interface of MFront (https://tfel.sourceforge.net), version 1:
  TFEL 3.4.1 and later, 4.x, 5.x. Nothing of TFEL is linked. The declarations follow the public headers of the
  MFrontGenericInterfaceSupport: include/MGIS/Behaviour/BehaviourDataView.hxx and StateView.hxx for the structs,
  LibrariesManager.cxx for the symbols.

  Small strain: a strain is the input and a stress the output; symmetric tensors as xx, yy, zz, xy, xz, yz with shear
  times sqrt(2).
*/
#include <hycoextensions.h>
#include <hycomaterialimpl.h>
#include <dlfcn.h>
#include <setjmp.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

#define API_VERSION 1
/* Temperature in K given to laws that do not depend on it, for a body without one: a room's. */
#define NO_TEMPERATURE 293.15
#define MESSAGE        512 /* size required by the interface */
/* Value of K[0]: integrate, and return the consistent tangent (MFront's generic interface). */
#define CONSISTENT   4.
#define ELASTIC      -1. /* value of K[0]: return only the elastic tangent (MFront's generic interface) */
#define MAX_INTERNAL 64

/* The interface's structs: pointers to the state at the begin of a step, to that at its end, and both with the
   request. */
typedef struct {
  const double *gradients, *forces, *density, *properties, *internal, *stored, *dissipated, *external;
} StateBegin;
typedef struct {
  const double *gradients;
  double *forces;
  const double *density, *properties;
  double *internal, *stored, *dissipated;
  const double *external;
} StateEnd;
typedef struct {
  char *message;
  double dt, *K, *rdt, *speed_of_sound;
  StateBegin s0;
  StateEnd s1;
} Data;

typedef struct {
  void *library;
  int (*integrate)(Data *);
  char *behaviour; /* its name */
  PetscInt n_properties;
  PetscBool stores; /* whether it computes the stored energy */
  char message[MESSAGE];
} MFront;

/* Signals that may occur while a library is loaded: they end the loading, not the process. */
static const int deadly[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
#define N_DEADLY ((int)(sizeof(deadly) / sizeof(deadly[0])))
static sigjmp_buf alive;

/* Back to MfrontOpen(): a static initialiser of the library has crashed. */
static void MfrontEscape(int signal)
{
  siglongjmp(alive, signal);
}

/* dlopen(); *died: the signal by which it ended, or 0. */
static void *MfrontOpen(const char path[], int *died)
{
  struct sigaction mine, before[N_DEADLY];
  void *volatile library = NULL;

  memset(&mine, 0, sizeof(mine));
  mine.sa_handler = MfrontEscape;
  sigemptyset(&mine.sa_mask);
  for (int k = 0; k < N_DEADLY; k++) sigaction(deadly[k], &mine, &before[k]);
  *died = sigsetjmp(alive, 1);
  if (!*died) library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  for (int k = 0; k < N_DEADLY; k++) sigaction(deadly[k], &before[k], NULL);
  return library;
}

/* The object of a law has the name of its body. */
static const char *BodyName(HycoMaterial law)
{
  return ((PetscObject)law)->name;
}

/* Loads the library. A name with a slash is a path relative to the scene's folder, or else to the working folder;
   one without a slash is searched in the scene's folder, and else in the system's library path. */
static PetscErrorCode MfrontLoad(HycoMaterial law, const char name[], MFront *m)
{
  char path[HYCO_LINE];
  const char *why;
  int died;

  PetscFunctionBegin;
  HycoFormat(path, "%s/%s", law->folder ? law->folder : ".", name);
  if (name[0] == '/' || access(path, F_OK)) HycoFormat(path, "%s", name);
  (void)dlerror();
  m->library = MfrontOpen(path, &died);
  why = died ? NULL : dlerror();
  HycoCheck(!died, "body %s: the library %s crashes when it is loaded (signal %d)", BodyName(law), path, died);
  HycoCheck(m->library, "body %s: the library %s cannot be loaded: %s", BodyName(law), path,
            why ? why : "no reason given");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The symbol BEHAVIOUR_HYPOTHESIS_what, or BEHAVIOUR_what; hypothesis NULL: the latter alone. NULL: there is none. */
static const void *MfrontFind(const MFront *m, const char hypothesis[], const char what[])
{
  char symbol[HYCO_LINE];
  const void *found = NULL;

  if (hypothesis) {
    HycoFormat(symbol, "%s_%s_%s", m->behaviour, hypothesis, what);
    found = dlsym(m->library, symbol);
  }
  if (!found) {
    HycoFormat(symbol, "%s_%s", m->behaviour, what);
    found = dlsym(m->library, symbol);
  }
  return found;
}

/* Symbols of numbers are unsigned short in the interface. */
static unsigned MfrontReadNumber(const MFront *m, const char hypothesis[], const char what[], unsigned absent)
{
  const unsigned short *value = (const unsigned short *)MfrontFind(m, hypothesis, what);

  return value ? *value : absent;
}

/* Reads a list of names; their number is the symbol of the same name preceded by n. */
static PetscErrorCode MfrontList(HycoMaterial law, const MFront *m, const char hypothesis[], const char what[],
                                 PetscInt *n, const char *const **names)
{
  char count[HYCO_LINE];

  PetscFunctionBegin;
  HycoFormat(count, "n%s", what);
  HycoCheck(MfrontFind(m, hypothesis, count),
            "body %s: the library has no symbol %s_%s; check that %s is a behaviour of MFront's generic interface",
            BodyName(law), m->behaviour, count, m->behaviour);
  *n = (PetscInt)MfrontReadNumber(m, hypothesis, count, 0);
  *names = (const char *const *)MfrontFind(m, hypothesis, what);
  HycoCheck(!*n || *names, "body %s: the library has no symbol %s_%s", BodyName(law), m->behaviour, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that the behaviour is of a kind that the finite elements can use. */
static PetscErrorCode CheckKind(HycoMaterial law, const MFront *m)
{
  const char *const *interface = (const char *const *)MfrontFind(m, NULL, "mfront_interface");
  const unsigned version = MfrontReadNumber(m, NULL, "api_version", 0);

  PetscFunctionBegin;
  HycoCheck(interface && MfrontFind(m, NULL, "mfront_mkt"),
            "body %s: the library has no behaviour %s of MFront's interfaces (no symbol %s_mfront_interface)",
            BodyName(law), m->behaviour, m->behaviour);
  HycoCheck(strcmp(*interface, "Generic") == 0 && MfrontReadNumber(m, NULL, "mfront_mkt", 0) == 1,
            "body %s: %s is made for MFront's interface \"%s\"; build the library by mfront --interface=generic",
            BodyName(law), m->behaviour, *interface);
  HycoCheck(version == API_VERSION,
            "body %s: %s has version %u of MFront's generic interface; hyco supports version %d (TFEL 3.4.1 and later)",
            BodyName(law), m->behaviour, version, API_VERSION);
  HycoCheck(MfrontReadNumber(m, NULL, "BehaviourType", 0) == 1 &&
                MfrontReadNumber(m, NULL, "BehaviourKinematic", 0) == 1,
            "body %s: %s is not a small-strain law", BodyName(law), m->behaviour);
  HycoCheck(!MfrontReadNumber(m, NULL, "SymmetryType", 0),
            "body %s: %s is orthotropic, and hyco supports isotropic behaviours only", BodyName(law), m->behaviour);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After both texts are read: declares the material properties as constants, H[1] under the name H_1. */
static PetscErrorCode MfrontDeclare(HycoMaterial law)
{
  MFront *m = (MFront *)law->data;
  const char *library, *const *names, *name;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoMaterialGetText(law, "library", &library));
  PetscCall(HycoMaterialGetText(law, "behaviour", &name));
  HycoCheck(library && name, "body %s: law mfront needs library: (a file) and behaviour: (its name)", BodyName(law));
  PetscCall(PetscFree(m->behaviour));
  PetscCall(PetscStrallocpy(name, &m->behaviour));
  PetscCall(MfrontLoad(law, library, m));
  PetscCall(CheckKind(law, m));
  PetscCall(MfrontList(law, m, "Tridimensional", "MaterialProperties", &n, &names));
  HycoCheck(n <= HYCO_MAX_DECLARED - 2, "body %s: %s has %d material properties; hyco accepts at most %d",
            BodyName(law), name, (int)n, HYCO_MAX_DECLARED - 2);
  for (PetscInt j = 0; j < n; j++) {
    char constant[HYCO_LINE];
    size_t at = 0;

    for (const char *c = names[j]; *c && at + 1 < sizeof(constant); c++) {
      if (*c != ']') constant[at++] = *c == '[' ? '_' : *c;
    }
    constant[at] = '\0';
    PetscCall(HycoMaterialDeclare(law, constant, names[j], HYCO_REQUIRED, -PETSC_INFINITY, PETSC_INFINITY));
  }
  m->n_properties = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of components of an internal variable by its type: scalar, symmetric tensor, vector, tensor. */
static PetscInt TypeSize(int type, PetscInt dim)
{
  static const PetscInt size[4][2] = {{1, 1}, {4, 6}, {2, 3}, {5, 9}};

  return type >= 0 && type < 4 ? size[type][dim - 2] : 0;
}

/* Tensors are split into their components, so that outputs have a name for each number. */
static PetscErrorCode SetState(HycoMaterial law, const MFront *m, const char hypothesis[], PetscInt dim)
{
  const char *const *names, *list[MAX_INTERNAL];
  char text[MAX_INTERNAL][64];
  const int *type;
  PetscInt n, total = 0;

  PetscFunctionBegin;
  PetscCall(MfrontList(law, m, hypothesis, "InternalStateVariables", &n, &names));
  type = (const int *)MfrontFind(m, hypothesis, "InternalStateVariablesTypes");
  HycoCheck(!n || type, "body %s: the library has no symbol %s_InternalStateVariablesTypes", BodyName(law),
            m->behaviour);
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt size = TypeSize(type[k], dim);

    HycoCheck(size && total + size <= MAX_INTERNAL,
              "body %s: %s has internal variables of an unsupported kind, or more than %d of them", BodyName(law),
              m->behaviour, MAX_INTERNAL);
    for (PetscInt c = 0; c < size; c++, total++) {
      list[total] = text[total];
      if (size == 1)
        PetscCall(PetscSNPrintf(text[total], sizeof(text[total]), "%.50s", names[k]));
      else
        PetscCall(PetscSNPrintf(text[total], sizeof(text[total]), "%.50s_%d", names[k], (int)c));
    }
  }
  PetscCall(HycoMaterialSetStateNames(law, total, list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The hypothesis is known only here, with the mesh's dimension; plane stress has been refused by the class. */
static PetscErrorCode SetUp(HycoMaterial law, PetscInt dim)
{
  MFront *m = (MFront *)law->data;
  const char *plane = law->formulation == HYCO_AXISYMMETRIC ? "Axisymmetrical" : "PlaneStrain";
  const char *hypothesis = dim == 2 ? plane : "Tridimensional", *const * names;
  char symbol[HYCO_LINE];
  PetscInt n;

  PetscFunctionBegin;
  HycoCheck(dim > 1, "body %s: laws of MFront are for 2D and 3D", BodyName(law));
  HycoFormat(symbol, "%s_%s", m->behaviour, hypothesis);
  *(void **)(&m->integrate) = dlsym(m->library, symbol);
  HycoCheck(m->integrate, "body %s: %s does not support the hypothesis %s (no symbol %s)", BodyName(law), m->behaviour,
            hypothesis, symbol);
  PetscCall(MfrontList(law, m, hypothesis, "MaterialProperties", &n, &names));
  HycoCheck(n == m->n_properties, "body %s: %s has other material properties in 2D than in 3D", BodyName(law),
            m->behaviour);
  PetscCall(MfrontList(law, m, hypothesis, "ExternalStateVariables", &n, &names));
  for (PetscInt k = 0; k < n; k++)
    HycoCheck(strcmp(names[k], "Temperature") == 0,
              "body %s: %s needs the external variable %s; hyco provides the temperature only", BodyName(law),
              m->behaviour, names[k]);
  HycoCheck(!MfrontReadNumber(m, hypothesis, "requiresStiffnessTensor", 0) &&
                !MfrontReadNumber(m, hypothesis, "requiresThermalExpansionCoefficientTensor", 0),
            "body %s: %s requires the stiffness or the thermal expansion as input; let it compute them", BodyName(law),
            m->behaviour);
  m->stores = (PetscBool)(MfrontReadNumber(m, hypothesis, "ComputesInternalEnergy", 0) == 1);
  PetscCall(SetState(law, m, hypothesis, dim));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The interface's index of our components; shear has a factor. */
static const PetscInt theirs[6] = {0, 1, 2, 3, 5, 4};
static PetscReal MfrontRoot(PetscInt c)
{
  return c < 3 ? 1 : PetscSqrtReal(2);
}

/* Integrates one point; false, with the behaviour's message, if it has no solution. */
static PetscBool MfrontIntegrate(const MFront *m, HycoMaterialPoints *p, PetscInt i, PetscInt n_state,
                                 char message[MESSAGE])
{
  const PetscInt ns = p->n_strain;
  const PetscBool at_rest = (PetscBool)(p->strain0 == p->strain);
  double e0[6], e1[6], s0[6], s1[6], K[36] = {0}, properties[HYCO_MAX_DECLARED], rdt = 1, stored0 = 0, stored1 = 0,
                                     dissipated0 = 0, dissipated1 = 0, density = 0;
  double T0 = p->temperature0 ? p->temperature0[i] : NO_TEMPERATURE,
         T1 = p->temperature ? p->temperature[i] : NO_TEMPERATURE;
  Data d = {.message = message, .dt = p->dt, .K = K, .rdt = &rdt};

  for (PetscInt j = 0; j < m->n_properties; j++) properties[j] = p->constant[2 + j][i];
  for (PetscInt c = 0; c < ns; c++) {
    e0[theirs[c]] = p->strain0[i * ns + c] / MfrontRoot(c);
    e1[theirs[c]] = p->strain[i * ns + c] / MfrontRoot(c);
    s0[theirs[c]] = s1[theirs[c]] = p->stress0[i * ns + c] * MfrontRoot(c);
  }
  /* The interface updates the state at the end in place, starting from that at the begin. */
  for (PetscInt k = 0; k < n_state; k++) p->state[i * n_state + k] = p->state0[i * n_state + k];
  /* At rest the class asks for the elastic tangent alone, and nothing is integrated. */
  K[0] = at_rest ? ELASTIC : p->tangent ? CONSISTENT : 0;
  d.s0 = (StateBegin){e0, s0, &density, properties, p->state0 + i * n_state, &stored0, &dissipated0, &T0};
  d.s1 = (StateEnd){e1, s1, &density, properties, p->state + i * n_state, &stored1, &dissipated1, &T1};
  message[0] = '\0';
  if ((*m->integrate)(&d) < 0) return PETSC_FALSE;
  p->dt_factor = PetscMin(p->dt_factor, rdt);
  for (PetscInt r = 0; r < ns; r++) {
    p->stress[i * ns + r] = s1[theirs[r]] / MfrontRoot(r);
    for (PetscInt c = 0; p->tangent && c < ns; c++)
      p->tangent[(i * ns + r) * ns + c] = K[theirs[r] * ns + theirs[c]] / (MfrontRoot(r) * MfrontRoot(c));
  }
  if (p->stored && m->stores) p->stored[i] = stored1;
  return PETSC_TRUE;
}

/* The first point that fails ends the batch: the step is repeated with a smaller time anyway. */
static PetscErrorCode MfrontUpdate(HycoMaterial law, HycoMaterialPoints *p)
{
  MFront *m = (MFront *)law->data;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < p->n; i++) {
    if (MfrontIntegrate(m, p, i, law->n_state, m->message)) continue;
    m->message[MESSAGE - 1] = '\0';
    p->failed = i;
    p->why = m->message[0] ? m->message : "the behaviour did not converge";
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MfrontDestroy(HycoMaterial law)
{
  MFront *m = (MFront *)law->data;

  PetscFunctionBegin;
  if (m->library) dlclose(m->library);
  HycoFreeAll(&m->behaviour, &law->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constants of the behaviour are declared later, by MfrontDeclare(), when the scene has named the library. */
static PetscErrorCode MfrontCreate(HycoMaterial law)
{
  static const struct _HycoMaterialOps ops = {
      .declare = MfrontDeclare, .setup = SetUp, .update = MfrontUpdate, .destroy = MfrontDestroy};
  MFront *m;

  PetscFunctionBegin;
  PetscCall(PetscNew(&m));
  /* First, so that MfrontDestroy() finds it also after an error below. */
  PetscCall(HycoMaterialSetData(law, m));
  PetscCall(HycoMaterialDeclareText(law, "library", "the file of a shared library"));
  PetscCall(HycoMaterialDeclareText(law, "behaviour", "the behaviour's name"));
  PetscCall(HycoMaterialSetLinear(law, PETSC_FALSE));
  PetscCall(HycoMaterialSetOps(law, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineExtension(mfront, HycoMaterialRegister(HYCO_MATERIAL_MFRONT, MfrontCreate))
