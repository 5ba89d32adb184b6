/* Resolves paths, whether or not the file exists. */
#include <hycofile.h>
#include <hycoimpl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define LINKS 40 /* the system's limit on links */

/* The target of a link at `at`, relative to the same folder as `at`; false: it is not a link. `at` and `end` may
   be the same array, hence the copy of the target. */
static PetscBool ReadLink(const char at[], char end[PETSC_MAX_PATH_LEN])
{
  char target[PETSC_MAX_PATH_LEN];
  const ssize_t n = readlink(at, target, sizeof(target) - 1);
  const char *slash = strrchr(at, '/');
  size_t before;

  if (n < 0) return PETSC_FALSE;
  target[n] = '\0';
  before = target[0] == '/' || !slash ? 0 : (size_t)(slash - at) + 1;
  if (before + (size_t)n >= PETSC_MAX_PATH_LEN) return PETSC_FALSE;
  memmove(end, at, before);
  memcpy(end + before, target, (size_t)n + 1);
  return PETSC_TRUE;
}

/* Links in /proc name open descriptors, which must not be replaced by a name. */
void HycoFileFollow(const char path[], char end[PETSC_MAX_PATH_LEN])
{
  if (!path || !end) return;
  snprintf(end, PETSC_MAX_PATH_LEN, "%s", path);
  for (int k = 0; k < LINKS && strncmp(end, "/proc/", 6); k++) {
    if (!ReadLink(end, end)) return;
  }
}

/* A file that does not exist is identified by its folder and name, so that two options that would create the same file
   are found. Device and inode: two names of one file are equal, whatever links there are. */
void HycoFileIdentify(const char path[], HycoFileIdentity *identity)
{
  char end[PETSC_MAX_PATH_LEN];
  struct stat info;
  char *slash;

  if (!path || !identity) return;
  memset(identity, 0, sizeof(*identity));
  identity->exists = (PetscBool)(stat(path, &info) == 0);
  /* /dev/null, a terminal: no file that could be overwritten. */
  identity->open_device = (PetscBool)(identity->exists && S_ISCHR(info.st_mode));
  if (!identity->exists) {
    HycoFileFollow(path, end);
    slash = strrchr(end, '/');
    snprintf(identity->name, sizeof(identity->name), "%s", slash ? slash + 1 : end);
    /* The root folder keeps its slash. */
    if (slash) slash[slash == end] = '\0';
    if (stat(slash ? end : ".", &info) != 0) {
      snprintf(identity->name, sizeof(identity->name), "%s", path);
      return;
    }
  }
  identity->device = (unsigned long long)info.st_dev;
  identity->inode = (unsigned long long)info.st_ino;
}

/* Two outputs may go to one open device, such as /dev/null. */
PetscBool HycoFileSame(const HycoFileIdentity *a, const HycoFileIdentity *b)
{
  return (PetscBool)(a && b && a->exists == b->exists && a->device == b->device && a->inode == b->inode &&
                     !a->open_device && strcmp(a->name, b->name) == 0);
}
