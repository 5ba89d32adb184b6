/*
  Runs a fuzz target without the fuzzer: replay COUNT FILE...; first over the files, which have failed once, then over
  COUNT inputs made from them by changing, removing, truncating and joining bytes, with the same pseudo-random numbers
  in every run. It prints the current input, so that a crash can be attributed.
*/
#include "fuzz.h"

#define ROOM 65536 /* size of a generated input in bytes */

typedef struct {
  uint8_t *data;
  size_t size;
} Input;

static size_t Draw(unsigned short state[3], size_t below)
{
  return (size_t)nrand48(state) % below;
}

static Input Read(const char path[])
{
  FILE *file = fopen(path, "rb");
  Input in = {NULL, 0};

  if (!file) exit(2);
  fseek(file, 0, SEEK_END);
  in.size = (size_t)ftell(file);
  rewind(file);
  in.data = malloc(in.size + 1);
  if (!in.data || fread(in.data, 1, in.size, file) != in.size) exit(2);
  fclose(file);
  return in;
}

/* Inserts `size` bytes into `out` before its byte `at`, as far as there is room. */
static void Insert(Input *out, size_t at, const uint8_t *data, size_t size)
{
  if (size > ROOM - out->size) size = ROOM - out->size;
  memmove(out->data + at + size, out->data + at, out->size - at);
  memcpy(out->data + at, data, size);
  out->size += size;
}

static void CutOut(Input *out, size_t at, size_t size)
{
  if (size > out->size - at) size = out->size - at;
  memmove(out->data + at, out->data + at + size, out->size - at - size);
  out->size -= size;
}

/* One change of `out`; `other` is an input to take bytes from. */
static void Change(Input *out, const Input *other, unsigned short state[3])
{
  static const char explanatory[] = "\0\377\1 \n-.9e/\":{[$x";
  const size_t at = Draw(state, out->size + 1), from = Draw(state, other->size + 1);

  switch (Draw(state, 6)) {
  case 0:
    if (at < out->size) out->data[at] ^= (uint8_t)(1 << Draw(state, 8));
    break;
  case 1:
    if (at < out->size) out->data[at] = (uint8_t)explanatory[Draw(state, sizeof(explanatory) - 1)];
    break;
  case 2:
    CutOut(out, at, 1 + Draw(state, 40));
    break;
  case 3:
    Insert(out, at, other->data + from, Draw(state, (other->size - from < 60 ? other->size - from : 60) + 1));
    break;
  case 4:
    Insert(out, at, (const uint8_t *)explanatory + Draw(state, sizeof(explanatory) - 1), 1);
    break;
  default:
    if (Draw(state, 8) == 0) out->size = at;
  }
}

static void RunMade(size_t count, size_t n, const Input in[])
{
  unsigned short state[3] = {2018, 7, 1};
  Input out = {malloc(ROOM), 0};

  if (!out.data) exit(2);
  for (size_t k = 0; k < count; k++) {
    const Input *start = &in[Draw(state, n)];
    const size_t changes = 1 + Draw(state, 6);

    out.size = start->size < ROOM ? start->size : ROOM;
    memcpy(out.data, start->data, out.size);
    for (size_t c = 0; c < changes; c++) Change(&out, &in[Draw(state, n)], state);
    fprintf(stderr, "made %zu\n", k);
    LLVMFuzzerTestOneInput(out.data, out.size);
  }
  free(out.data);
}

int main(int argc, char **argv)
{
  const size_t n = (size_t)(argc > 2 ? argc - 2 : 0);
  Input *in = malloc((n + 1) * sizeof(*in));
  size_t count;

  if (!n || !in) return 2;
  count = (size_t)strtoul(argv[1], NULL, 10);
  LLVMFuzzerInitialize(&argc, &argv);
  for (size_t k = 0; k < n; k++) {
    in[k] = Read(argv[k + 2]);
    fprintf(stderr, "%s\n", argv[k + 2]);
    LLVMFuzzerTestOneInput(in[k].data, in[k].size);
  }
  RunMade(count, n, in);
  printf("%zu inputs kept, %zu made of them\n", n, count);
  for (size_t k = 0; k < n; k++) free(in[k].data);
  free(in);
  return HycoFinalize() ? 1 : 0;
}
