/*
  The checksum: the last 24 bytes of a file: "hyco-sum", the length and the checksum of the bytes before it, 8 bytes
  each, little-endian. HDF5 1.10 checks the structure of a file but not its numbers: a flipped bit there would change a
  result unnoticed.
*/
#include <hycoimpl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static const char magic[8] = {'h', 'y', 'c', 'o', '-', 's', 'u', 'm'};

/* FNV-1a; also used to continue a hash. */
unsigned long long HycoHash(unsigned long long hash, const void *data, size_t bytes)
{
  const unsigned char *byte = (const unsigned char *)data;

  for (size_t k = 0; k < bytes; k++) hash = (hash ^ byte[k]) * 1099511628211ULL;
  return hash;
}

/* By bytes, so that files are the same on any machine. */
static unsigned long long LoadWord(const unsigned char byte[8])
{
  unsigned long long word = 0;

  for (int k = 7; k >= 0; k--) word = word << 8 | byte[k];
  return word;
}

/* Little endian on any machine: seals are compared between machines. */
static void StoreWord(unsigned long long word, unsigned char byte[8])
{
  for (int k = 0; k < 8; k++, word >>= 8) byte[k] = (unsigned char)(word & 255);
}

/* FNV-1a by words instead of bytes (eight times as fast), the rest by bytes. Each step is a bijection of the hash and
   of the word: damage within one word is always detected. `bytes` is a multiple of 8, except in the last call. No
   protection against intent, only against damage: truncated copies, bad disks. */
static unsigned long long ChecksumSum(unsigned long long sum, const unsigned char *data, size_t bytes)
{
  size_t k = 0;

  for (; k + 8 <= bytes; k += 8) {
    sum = (sum ^ LoadWord(data + k)) * 1099511628211ULL;
    sum ^= sum >> 29; /* mixes high bits into low ones, otherwise damage in two high bits could cancel */
  }
  return HycoHash(sum, data + k, bytes - k);
}

/* Magic number, length, checksum: a file that was cut, extended or changed in any bit does not match. */
void HycoChecksumMake(const void *data, size_t bytes, unsigned char seal[HYCO_CHECKSUM])
{
  memcpy(seal, magic, 8);
  StoreWord((unsigned long long)bytes, seal + 8);
  StoreWord(ChecksumSum(HYCO_HASH_START, (const unsigned char *)data, bytes), seal + 16);
}

/* The seal at the end of an open file of `size` bytes, if it has one. */
static PetscBool ReadChecksum(FILE *file, long long size, unsigned char seal[HYCO_CHECKSUM])
{
  return (PetscBool)(size >= HYCO_CHECKSUM && fseek(file, (long)(size - HYCO_CHECKSUM), SEEK_SET) == 0 &&
                     fread(seal, 1, HYCO_CHECKSUM, file) == HYCO_CHECKSUM && memcmp(seal, magic, 8) == 0);
}

/* The checksum of the first `left` bytes of an open file. In pieces, since a model may be larger than the memory
   left; the piece's size is a multiple of 8, as ChecksumSum() needs. */
static unsigned long long SumFile(FILE *file, size_t left)
{
  unsigned char buffer[65536];
  unsigned long long sum = HYCO_HASH_START;
  size_t n = 1;

  rewind(file);
  /* A file that became shorter ends the loop; its sum then differs. */
  while (left && n) {
    n = fread(buffer, 1, PetscMin(left, sizeof(buffer)), file);
    sum = ChecksumSum(sum, buffer, n);
    left -= n;
  }
  return sum;
}

/* Folders and devices can be opened too; only a file has a size and a seal. */
static PetscErrorCode ChecksumOpen(const char path[], FILE **file, size_t *size)
{
  struct stat info;

  PetscFunctionBegin;
  *file = fopen(path, "rb");
  HycoCheckFile(*file, "%s cannot be opened: no such file, or not readable", path);
  if (fstat(fileno(*file), &info) != 0 || !S_ISREG(info.st_mode)) {
    fclose(*file);
    HycoFail("%s is not a file; give a file that hyco has written, for example a model (.h5) of hyco train", path);
  }
  *size = (size_t)info.st_size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Magic word, size, checksum: the size alone finds most truncated files at once. */
PetscErrorCode HycoChecksumFile(const char path[], size_t *size, unsigned char seal[HYCO_CHECKSUM])
{
  FILE *file;

  PetscFunctionBegin;
  PetscCall(ChecksumOpen(path, &file, size));
  memcpy(seal, magic, 8);
  StoreWord((unsigned long long)*size, seal + 8);
  StoreWord(SumFile(file, *size), seal + 16);
  fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file without a seal is valid here: HycoH5Open() decides whether it should have one. */
PetscErrorCode HycoChecksumCheck(const char path[], size_t *size, PetscBool *sealed)
{
  unsigned char seal[HYCO_CHECKSUM];
  unsigned long long sum = 0;
  FILE *file;

  PetscFunctionBegin;
  PetscCall(ChecksumOpen(path, &file, size));
  *sealed = ReadChecksum(file, (long long)*size, seal);
  if (*sealed) sum = SumFile(file, *size - HYCO_CHECKSUM);
  fclose(file);
  if (*sealed && (LoadWord(seal + 8) != *size - HYCO_CHECKSUM || LoadWord(seal + 16) != sum))
    HycoFail("%s is damaged: its checksum does not match", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}
