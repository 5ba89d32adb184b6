/* Runs a fuzz target over files: replay FILE...; what the fuzzer found once stays found, without the fuzzer. */
#include "fuzz.h"

int main(int argc, char **argv)
{
  if (argc < 2) return 2;
  LLVMFuzzerInitialize(&argc, &argv);
  for (int k = 1; k < argc; k++) {
    FILE *file = fopen(argv[k], "rb");
    uint8_t *data;
    long size;

    if (!file) return 2;
    fseek(file, 0, SEEK_END);
    size = ftell(file);
    rewind(file);
    data = malloc((size_t)size + 1);
    if (!data || fread(data, 1, (size_t)size, file) != (size_t)size) return 2;
    fclose(file);
    fprintf(stderr, "%s\n", argv[k]);
    LLVMFuzzerTestOneInput(data, (size_t)size);
    free(data);
  }
  printf("%d inputs\n", argc - 1);
  return HycoFinalize() ? 1 : 0;
}
