/* Files that are written either completely or not at all. */
#include <hycofile.h>
#include <hycoimpl.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define OLD (7 * 24 * 3600) /* seconds after which a temporary file of another machine is considered unused */

struct _n_HycoFile {
  FILE *stream;
  HycoFileKind kind;
  PetscBool direct;                                     /* written in place: a device, a pipe, an open descriptor */
  char path[PETSC_MAX_PATH_LEN], shown[HYCO_FILE_NAME]; /* as given, and as shown in messages */
  char place[PETSC_MAX_PATH_LEN], temporary[HYCO_FILE_NAME];
};

/* Identifies the machine since its last start, and the space of its process ids: each container has its own. A process
   id alone would match another machine's process on a shared disk. */
static unsigned FileNode(void)
{
  static unsigned node;
  char text[512] = "";
  size_t n;
  ssize_t m;
  FILE *boot;

  if (node) return node;
  (void)!gethostname(text, 256);
  n = strnlen(text, 256);
  boot = fopen("/proc/sys/kernel/random/boot_id", "r");
  if (boot) {
    n += fread(text + n, 1, 64, boot);
    fclose(boot);
  }
  m = readlink("/proc/self/ns/pid", text + n, sizeof(text) - n);
  if (m > 0) n += (size_t)m;
  /* Never 0, which says that it has not been computed. */
  node = (unsigned)HycoHash(HYCO_HASH_START, text, n) | 1u;
  return node;
}

/* The position of ".hyco-NODE-PID-NUMBER." in a file's name, with its numbers; NULL: not found. Names may contain
   ".hyco-" themselves: the next occurrence is tried. Node, process and number make temporary names unique. */
static const char *FindTag(const char name[], unsigned *node, long *pid)
{
  unsigned number;

  for (const char *dot = strstr(name, ".hyco-"); dot; dot = strstr(dot + 1, ".hyco-")) {
    int length = 0;

    if (sscanf(dot, ".hyco-%8x-%ld-%u.%n", node, pid, &number, &length) == 3 && length > 0) return dot;
  }
  return NULL;
}

void HycoFileOwner(const char name[], char owner[HYCO_FILE_NAME])
{
  unsigned node;
  long pid;
  const char *base, *tag;

  if (!name || !owner) return;
  base = strrchr(name, '/');
  tag = FindTag(base ? base : name, &node, &pid);
  snprintf(owner, HYCO_FILE_NAME, "%.*s", (int)(tag ? (size_t)(tag - name) : strlen(name)), name);
}

/* In the folder of the final file: rename() is atomic only within a file system. */
static void FileTemporary(const char place[], const char kind[], char name[HYCO_FILE_NAME])
{
  static unsigned number;

  snprintf(name, HYCO_FILE_NAME, "%s.hyco-%08x-%ld-%u.%s", place, FileNode(), (long)getpid(), number++, kind);
}

/* Whether the file of that name was left by a process that no longer exists. kill() with signal 0 only asks
   whether the process exists; process ids of another machine cannot be asked, so age decides. */
static PetscBool IsLeft(const char path[], unsigned node, long pid)
{
  struct stat info;

  if (node == FileNode()) return (PetscBool)(pid > 0 && kill((pid_t)pid, 0) != 0 && errno == ESRCH);
  return (PetscBool)(stat(path, &info) == 0 && S_ISREG(info.st_mode) && time(NULL) - info.st_mtime > OLD);
}

/* Called before writing: a killed run leaves its temporary file, which has the size of a model. An empty name sweeps
   the folder. Failures are ignored, since another process may sweep too. Only files of processes of this machine that
   do not run any more are removed. */
PetscErrorCode HycoFileSweep(const char path[])
{
  char place[PETSC_MAX_PATH_LEN], file[2 * PETSC_MAX_PATH_LEN];
  const char *base;
  size_t n;
  struct dirent *entry;
  DIR *folder;

  PetscFunctionBegin;
  HycoFileFollow(path, place);
  base = strrchr(place, '/');
  base = base ? base + 1 : place;
  n = strlen(base);
  snprintf(file, sizeof(file), "%.*s", base > place ? (int)(base - place) : 1, base > place ? place : ".");
  folder = opendir(file);
  while (folder && (entry = readdir(folder))) {
    unsigned node;
    long pid;
    const char *tag = FindTag(entry->d_name, &node, &pid);

    /* Only temporary files of this very output: the tag stands after its whole name. */
    if (!tag || (n && ((size_t)(tag - entry->d_name) != n || strncmp(entry->d_name, base, n)))) continue;
    snprintf(file, sizeof(file), "%.*s%s", (int)(base - place), place, entry->d_name);
    /* A process that runs may be a training on the same folder: its file stays. */
    if (IsLeft(file, node, pid)) (void)unlink(file);
  }
  if (folder) closedir(folder);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One name for all ranks, made on rank 0. In the folder of the output: a rename works within one file system only. */
PetscErrorCode HycoFileScratch(MPI_Comm comm, const char path[], const char kind[], char scratch[HYCO_FILE_NAME])
{
  char place[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(kind);
  HycoCheckGiven(scratch);
  if (HycoRank(comm) == 0) {
    HycoFileFollow(path, place);
    FileTemporary(place, kind, scratch);
  }
  PetscCallMPI(MPI_Bcast(scratch, HYCO_FILE_NAME, MPI_CHAR, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rename() is atomic: a reader sees the old file or the new one. */
PetscErrorCode HycoFileKeep(const char scratch[], const char path[])
{
  char place[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  HycoFileFollow(path, place);
  /* errno is saved: unlink() may change it. */
  if (rename(scratch, place) != 0) {
    const int failed = errno;

    (void)unlink(scratch);
    HycoFail("%s could not be written (%s)", path, strerror(failed));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before long work. A file that does not exist is checked when it is opened. *direct: it is written to as it is,
   without a temporary file. */
PetscErrorCode HycoFileCheckPlace(const char option[], const char path[], HycoFileKind kind, PetscBool *direct)
{
  const char *dash = option && option[0] ? "-" : "", *blank = option && option[0] ? " " : "";
  char place[PETSC_MAX_PATH_LEN];
  struct stat info;

  PetscFunctionBegin;
  HycoCheckGiven(option);
  HycoCheckGiven(path);
  HycoCheckGiven(direct);
  *direct = PETSC_FALSE;
  if (stat(path, &info) != 0) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(!S_ISDIR(info.st_mode), "%s%s%s%s is a folder; give the name of a file", dash, option, blank, path);
  HycoCheck(S_ISREG(info.st_mode) || S_ISCHR(info.st_mode) || S_ISFIFO(info.st_mode),
            "%s%s%s%s is not a regular file and cannot be written; give the name of a file", dash, option, blank, path);
  HycoFileFollow(path, place);
  *direct = (PetscBool)(!S_ISREG(info.st_mode) || strncmp(place, "/proc/", 6) == 0);
  HycoCheck(!*direct || kind == HYCO_FILE_TEXT,
            "%s%s%s%s is a device or a pipe, and HDF5 needs a file; give the name of a file", dash, option, blank,
            path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* errno is that of the caller's failed call. */
static PetscErrorCode CheckOpen(const char path[], PetscBool good)
{
  PetscFunctionBegin;
  HycoCheck(good, "%s cannot be written (%s); check that the folder exists, is writable and has free space", path,
            strerror(errno));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* O_EXCL: a temporary name belongs to one process. Another one of this name would be a run that shares the process
   number, and must not be overwritten. */
PetscErrorCode HycoFileOpenScratch(const char scratch[], const char path[], int *fd)
{
  PetscFunctionBegin;
  HycoCheckGiven(scratch);
  HycoCheckGiven(path);
  HycoCheckGiven(fd);
  *fd = open(scratch, O_WRONLY | O_CREAT | O_EXCL, 0666);
  PetscCall(CheckOpen(path, (PetscBool)(*fd >= 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* O_EXCL: a temporary name that exists belongs to another process, and must not be written to. Permissions are those of
   the user's umask. */
static PetscErrorCode OpenPlace(HycoFile f)
{
  int fd;

  PetscFunctionBegin;
  PetscCall(HycoFileCheckPlace("", f->path, f->kind, &f->direct));
  if (!f->direct) FileTemporary(f->place, "partial", f->temporary);
  fd = f->direct ? open(f->path, O_WRONLY | O_APPEND) : open(f->temporary, O_WRONLY | O_CREAT | O_EXCL, 0666);
  f->stream = fd >= 0 ? fdopen(fd, "w") : NULL;
  PetscCall(CheckOpen(f->path, (PetscBool)(f->stream != NULL)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Follows links: a link in place of the output stays, and its target is replaced. */
PetscErrorCode HycoFileCreate(const char path[], HycoFileKind kind, HycoFile *file)
{
  HycoFile f;

  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(file);
  *file = NULL;
  HycoCheck(strlen(path) < PETSC_MAX_PATH_LEN, "the file name %.40s... is too long", path);
  PetscCall(PetscNew(&f));
  f->kind = kind;
  HycoFileOwner(path, f->shown);
  PetscCall(PetscStrncpy(f->path, path, sizeof(f->path)));
  HycoFileFollow(path, f->place);
  HycoOnError(OpenPlace(f), PetscCall(PetscFree(f)));
  *file = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

FILE *HycoFileStream(HycoFile file)
{
  return file ? file->stream : NULL;
}

/* Flushes everything written to the file. Returns 0, or errno. Only numbers are forced to the disk: text is
   written again in seconds. */
static int FileFlush(HycoFile f)
{
  errno = 0;
  if (fflush(f->stream) != 0 || ferror(f->stream) || (f->kind == HYCO_FILE_NUMBERS && fsync(fileno(f->stream)) != 0))
    return errno ? errno : EIO;
  return 0;
}

/* pwrite() may write less than asked, for example at a limit of 2 GB. At a place of its own: ranks write to one file at
   the same time. */
PetscErrorCode HycoFilePut(int fd, const char path[], const void *data, size_t bytes, size_t place)
{
  PetscFunctionBegin;
  while (bytes) {
    const ssize_t n = pwrite(fd, data, bytes, (off_t)place);

    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) PetscCall(HycoFileComplain(path, n < 0 ? errno : EIO));
    data = (const char *)data + n;
    bytes -= (size_t)n;
    place += (size_t)n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFileComplain(const char shown[], int failed)
{
  PetscFunctionBegin;
  HycoCheck(!failed, "%s could not be written completely (%s); check the free space", shown, strerror(failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bytes that were given to the stream may still be in its buffer: a full disk shows here. */
PetscErrorCode HycoFileFlush(HycoFile file)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(HycoFileComplain(file->shown, FileFlush(file)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without commit the temporary file is removed, and a former file of the name stays as it was. fclose() can fail
   too: the last bytes are written there. */
PetscErrorCode HycoFileClose(HycoFile *file, PetscBool commit)
{
  HycoFile f = file ? *file : NULL;
  char shown[HYCO_FILE_NAME];
  int failed;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  *file = NULL;
  failed = commit ? FileFlush(f) : 0;
  if (fclose(f->stream) != 0 && commit && !failed) failed = errno ? errno : EIO;
  if (!f->direct) {
    if (commit && !failed && rename(f->temporary, f->place) != 0) failed = errno;
    if (!commit || failed) (void)unlink(f->temporary);
  }
  snprintf(shown, sizeof(shown), "%s", f->shown);
  PetscCall(PetscFree(f));
  PetscCall(HycoFileComplain(shown, failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}
