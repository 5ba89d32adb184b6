/* Common code of the unit tests: checks that print expected and found values, and a fixed sequence of numbers. */
#ifndef CHECK_H
#define CHECK_H

#include <hycoimpl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int check_failures;

/* CHECK(condition, format, ...): on failure prints the place, the condition, and the given text (expected and
   found). */
#define CHECK(condition, ...)                                                                                          \
  do {                                                                                                                 \
    if (!(condition)) {                                                                                                \
      fprintf(stderr, "%s:%d: %s: ", __FILE__, __LINE__, #condition);                                                  \
      fprintf(stderr, __VA_ARGS__);                                                                                    \
      fprintf(stderr, "\n");                                                                                           \
      check_failures++;                                                                                                \
    }                                                                                                                  \
  } while (0)

/* |found - expected| <= tol; a NaN fails. */
#define CHECK_NEAR(found, expected, tol)                                                                               \
  do {                                                                                                                 \
    const double found_ = (double)(found), expected_ = (double)(expected);                                             \
    CHECK(PetscAbsReal(found_ - expected_) <= (tol), "%s: expected %.17g, found %.17g", #found, expected_, found_);    \
  } while (0)

/* `call` fails and its message contains `text`. */
#define CHECK_FAILS(call, text)                                                                                        \
  do {                                                                                                                 \
    char line_[HYCO_LINE];                                                                                             \
    PetscErrorCode code_;                                                                                              \
    PetscCall(HycoCatchBegin());                                                                                       \
    code_ = (call);                                                                                                    \
    PetscCall(HycoCatchEnd(code_, line_));                                                                             \
    CHECK(code_ &&strstr(line_, (text)), "expected the message \"%s\", found \"%s\"", (text), line_);                  \
  } while (0)

/* Uniform in [-1, 1]: the generator of POSIX drand48, the same everywhere. */
static inline double Draw(unsigned long long *state)
{
  *state = (*state * 0x5DEECE66DULL + 0xBULL) & ((1ULL << 48) - 1);
  return 2 * ((double)*state / (double)(1ULL << 48)) - 1;
}

/* Runs Test() under hyco; 0 if every check passed. */
#define TEST_RUN(argc, argv)                                                                                           \
  do {                                                                                                                 \
    PetscErrorCode code;                                                                                               \
    if (HycoInitialize(&(argc), &(argv))) return 2;                                                                    \
    code = Test();                                                                                                     \
    if (code) fprintf(stderr, "the test itself ended with error %d\n", (int)code);                                     \
    if (HycoFinalize()) return 2;                                                                                      \
    return code || check_failures ? 1 : 0;                                                                             \
  } while (0)

#define TEST_MAIN                                                                                                      \
  int main(int argc, char **argv)                                                                                      \
  {                                                                                                                    \
    TEST_RUN(argc, argv);                                                                                              \
  }

/* The same for a test that reads PetscMallocGetCurrentUsage(): PETSc records its memory only if this is requested before
   it starts. -malloc_debug would also check all of it at each call, which takes twenty times as long as the tests. */
#define TEST_MAIN_MEMORY                                                                                               \
  int main(int argc, char **argv)                                                                                      \
  {                                                                                                                    \
    static char books[] = "-malloc_dump";                                                                              \
    char *mine[3] = {argv[0], books, NULL}, **given = mine;                                                            \
    int n = 2;                                                                                                         \
    (void)argc;                                                                                                        \
    TEST_RUN(n, given);                                                                                                \
  }

#endif
