/*
  HDF5 files. A file written by one process is built in memory and then written to the disk in one piece, sealed: if a
  disk is full, HDF5 itself can neither finish a file nor close it. If several processes write, each its rows, rank 0's
  HDF5 creates the datasets on the disk one by one, after checking that there is space; the processes then write the
  numbers to their positions without HDF5, because parallel HDF5 cannot report a full disk.
*/
#include <hycofile.h>
#include <hycoimpl.h>
#include <hycoh5.h>
#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <string.h>
#include <unistd.h>

struct _n_HycoH5 {
  hid_t id, access; /* the file; property list with which datasets are opened */
  HycoFile out;     /* while writing; else NULL */
  size_t size;      /* size of the file that is read */
  size_t written;   /* bytes of the data that this process has written */
  PetscBool reads, table;
  char path[PETSC_MAX_PATH_LEN];
  /* data of a file that several processes write */
  PetscBool shared;
  MPI_Comm comm; /* owned by the caller */
  int fd;        /* of the file on the disk, until it is renamed */
  char scratch[HYCO_FILE_NAME];
};

/* Upper bounds for the bytes of a dataset's description, and of the file's first one. */
#define ROOM 4096

/* A dataset, in a table an attribute of the file, stating that the file ends with a seal: a file that has lost its seal
   is then damaged, not old. */
#define HYCO_H5_SEALED "sealed"
#define NATIVE_INT     (sizeof(PetscInt) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32)

/* Refuses links to other files. */
static herr_t RefuseLink(const char *parent_file, const char *parent_group, const char *child_file,
                         const char *child_object, unsigned *flags, hid_t access, void *ctx)
{
  (void)parent_file, (void)parent_group, (void)child_file, (void)child_object, (void)flags, (void)access, (void)ctx;
  return -1;
}

/* HDF5's own error printing is off, since errors are reported in one line. External links are refused when they are
   followed: a file could otherwise read any other. */
static PetscErrorCode H5New(const char path[], HycoH5 *file)
{
  HycoH5 f;

  PetscFunctionBegin;
  HycoCheck(strlen(path) < PETSC_MAX_PATH_LEN, "the file name %.40s... is too long", path);
  PetscCall(PetscNew(&f));
  PetscCall(PetscStrncpy(f->path, path, sizeof(f->path)));
  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  f->access = H5Pcreate(H5P_DATASET_ACCESS);
  H5Pset_elink_cb(f->access, RefuseLink, NULL);
  *file = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Closing the file is the caller's. */
static PetscErrorCode H5Free(HycoH5 *file)
{
  PetscFunctionBegin;
  H5Pclose((*file)->access);
  PetscCall(PetscFree(*file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of files that are only created: readers take what they find. */
static hid_t H5Access(void)
{
  hid_t access = H5Pcreate(H5P_FILE_ACCESS);

  /* one format for all library versions: the default of HDF5 2 stores the time in each group, so that no two files
     would be equal */
  H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_LATEST);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG); /* closing the file closes what a refusal left open in it */
  return access;
}

/* A property list for files in memory, which are not written to the disk automatically. */
static hid_t InMemory(void)
{
  hid_t access = H5Access();

  H5Pset_fapl_core(access, (size_t)1 << 18, 0);
  return access;
}

/* The file says that it has a seal, so that a truncated one, whose seal is missing, is recognised. */
static PetscErrorCode MarkSealed(HycoH5 f)
{
  const PetscInt yes = 1;

  PetscFunctionBegin;
  PetscCall(f->table ? HycoH5WriteAttributeInt(f, "/", HYCO_H5_SEALED, 1, &yes)
                     : HycoH5WriteInt(f, HYCO_H5_SEALED, 1, 1, &yes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file in memory: HDF5 cannot close a file on a full disk, but memory can be discarded. Nothing reaches the disk:
   backing store is off in InMemory(). `table`: a file for other programs, whose mark is an attribute and no dataset. */
static PetscErrorCode CreateImage(const char name[], PetscBool table, HycoH5 *file)
{
  hid_t access;
  HycoH5 f;

  PetscFunctionBegin;
  PetscCall(H5New(name, &f));
  f->table = table;
  access = InMemory();
  f->id = H5Fcreate(f->path, H5F_ACC_TRUNC, H5P_DEFAULT, access);
  H5Pclose(access);
  PetscCheck(f->id >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "HDF5 cannot create a file in memory");
  *file = f;
  PetscCall(MarkSealed(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoH5CreateImage(const char name[], HycoH5 *file)
{
  PetscFunctionBegin;
  HycoCheckGiven(name);
  HycoCheckGiven(file);
  PetscCall(CreateImage(name, PETSC_FALSE, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The output is opened first: a place that cannot be written to is an error before the numbers are computed. The file
   on the disk is written when it is closed. */
static PetscErrorCode H5Create(const char path[], PetscBool table, HycoH5 *file)
{
  HycoFile out;

  PetscFunctionBegin;
  PetscCall(HycoFileCreate(path, HYCO_FILE_NUMBERS, &out));
  HycoOnError(CreateImage(path, table, file), PetscCall(HycoFileClose(&out, PETSC_FALSE)));
  (*file)->out = out;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoH5Create(const char path[], HycoH5 *file)
{
  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(file);
  PetscCall(H5Create(path, PETSC_FALSE, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that there is space for the description of one more dataset, and for a file with `bytes` of numbers. Rank 0.
   HDF5 cannot close a file on a full disk: better to find out before. */
static PetscErrorCode MakeRoom(HycoH5 f, size_t bytes)
{
  static const char zeros[ROOM];
  const off_t end = lseek(f->fd, 0, SEEK_END);

  PetscFunctionBegin;
  /* Really written: a sparse file of that length would not reserve the blocks on every file system. */
  PetscCall(HycoFilePut(f->fd, f->path, zeros, ROOM, (size_t)end));
  if (ftruncate(f->fd, end + (off_t)bytes + ROOM) != 0) PetscCall(HycoFileComplain(f->path, errno));
  (void)!ftruncate(f->fd, end);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0. O_EXCL in HycoFileOpenScratch() claims the name, then HDF5 truncates the same file. HDF5 and this program
   have the file open at the same time, for metadata and numbers. */
static PetscErrorCode BeginShared(HycoH5 f)
{
  PetscBool direct;
  hid_t access;

  PetscFunctionBegin;
  PetscCall(HycoFileCheckPlace("", f->path, HYCO_FILE_NUMBERS, &direct));
  PetscCall(HycoFileOpenScratch(f->scratch, f->path, &f->fd));
  PetscCall(MakeRoom(f, 0));
  access = H5Access();
  f->id = H5Fcreate(f->scratch, H5F_ACC_TRUNC, H5P_DEFAULT, access);
  H5Pclose(access);
  PetscCheck(f->id >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "HDF5 cannot create the file %s", f->scratch);
  PetscCall(MarkSealed(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the other ranks. Rank 0 already has it open. On a cluster whose ranks do not share the folder, this fails
   with a message. */
static PetscErrorCode JoinShared(HycoH5 f)
{
  PetscFunctionBegin;
  if (f->fd < 0) f->fd = open(f->scratch, O_WRONLY);
  HycoCheck(f->fd >= 0, "%s cannot be written (%s); check that all ranks have access to its folder", f->path,
            strerror(errno));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 creates the file before the others open it. An error of either is that of all. */
static PetscErrorCode OpenShared(HycoH5 f)
{
  PetscFunctionBegin;
  HycoOnRoot(f->comm, BeginShared(f));
  HycoOnEach(f->comm, JoinShared(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One rank needs no shared file. With several, rank 0 allocates the datasets under a temporary name, and all write to
   it. HDF5 need not be built for MPI. */
static PetscErrorCode CreateShared(MPI_Comm comm, const char path[], PetscBool table, HycoH5 *file)
{
  HycoH5 f;

  PetscFunctionBegin;
  if (HycoSize(comm) == 1) {
    PetscCall(H5Create(path, table, file));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(H5New(path, &f));
  f->shared = PETSC_TRUE;
  f->table = table;
  f->comm = comm;
  f->fd = -1;
  f->id = H5I_INVALID_HID;
  PetscCall(HycoFileScratch(comm, path, "partial", f->scratch));
  HycoOnError(OpenShared(f), PetscCall(HycoH5Close(&f, PETSC_FALSE)));
  *file = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective. Datasets are then created by all ranks in the same order. */
PetscErrorCode HycoH5CreateShared(MPI_Comm comm, const char path[], HycoH5 *file)
{
  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(file);
  PetscCall(CreateShared(comm, path, PETSC_FALSE, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file whose datasets are the columns of a table and nothing else: that it is complete is said by an attribute.
   Collective. */
PetscErrorCode HycoH5CreateTable(MPI_Comm comm, const char path[], HycoH5 *file)
{
  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(file);
  PetscCall(CreateShared(comm, path, PETSC_TRUE, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HDF5 copies the image: the caller may free it. For models that are broadcast: other ranks read no file. */
PetscErrorCode HycoH5OpenImage(const char name[], void *image, size_t size, HycoH5 *file)
{
  hid_t access;
  HycoH5 f;

  PetscFunctionBegin;
  HycoCheckGiven(name);
  HycoCheckGiven(image);
  HycoCheckGiven(file);
  access = InMemory();
  PetscCall(H5New(name, &f));
  f->size = size;
  f->reads = PETSC_TRUE;
  H5Pset_file_image(access, image, size);
  f->id = H5Fopen(f->path, H5F_ACC_RDONLY, access);
  H5Pclose(access);
  PetscCheck(f->id >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "HDF5 cannot open a file in memory");
  *file = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The checksum is verified before HDF5 parses anything: a damaged structure can crash it. Files of other programs, such
   as meshes, have no seal, and are opened as well. */
PetscErrorCode HycoH5Open(const char path[], HycoH5 *file)
{
  HycoH5 f;
  hid_t access;
  size_t size;
  PetscBool sealed;

  PetscFunctionBegin;
  PetscCall(HycoChecksumCheck(path, &size, &sealed));
  PetscCall(H5New(path, &f));
  f->size = size;
  f->reads = PETSC_TRUE;
  access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG); /* closing the file closes what a refusal left open in it */
  f->id = H5Fopen(path, H5F_ACC_RDONLY, access);
  H5Pclose(access);
  if (f->id < 0) {
    PetscCall(H5Free(&f));
    HycoFail("%s is not an HDF5 file, or it is damaged", path);
  }
  if (!sealed && (HycoH5Has(f, HYCO_H5_SEALED) || H5Aexists_by_name(f->id, "/", HYCO_H5_SEALED, H5P_DEFAULT) > 0)) {
    PetscCall(HycoH5Close(&f, PETSC_FALSE));
    HycoFail("%s is damaged: its end is missing", path);
  }
  *file = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What cannot be opened is not hyco's; a model has `kind`, a snapshot a fingerprint. Asked before a file is
   overwritten. */
PetscErrorCode HycoH5IsPrecious(const char path[], PetscBool *precious)
{
  HycoH5 h = NULL;
  PetscErrorCode caught;
  char message[HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(precious);
  *precious = PETSC_FALSE;
  HycoCatch(HycoH5Open(path, &h), caught, message);
  if (caught) PetscFunctionReturn(PETSC_SUCCESS);
  *precious = (PetscBool)(HycoH5Has(h, "kind") || HycoH5Has(h, "fingerprint"));
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* remedy: appended if the file is damaged, not if it is missing. */
PetscErrorCode HycoH5OpenOr(const char path[], const char remedy[], HycoH5 *file)
{
  PetscErrorCode caught;
  char message[HYCO_LINE];

  PetscFunctionBegin;
  HycoCatch(HycoH5Open(path, file), caught, message);
  if (message[0])
    HycoFailAs(caught > PETSC_ERR_MAX_VALUE ? caught : PETSC_ERR_USER, "%s%s%s", message,
               strstr(message, "damaged") ? "; " : "", strstr(message, "damaged") ? remedy : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The caller frees *image. The first call gives the size. */
PetscErrorCode HycoH5GetImage(HycoH5 f, void **image, size_t *size)
{
  ssize_t bytes;
  PetscBool made;

  PetscFunctionBegin;
  HycoCheckGiven(f);
  bytes = H5Fflush(f->id, H5F_SCOPE_GLOBAL) < 0 ? -1 : H5Fget_file_image(f->id, NULL, 0);
  HycoCheck(bytes >= 0, "%s could not be written: HDF5 has no image of it in memory", f->path);
  PetscCall(PetscMalloc((size_t)bytes, image));
  made = (PetscBool)(H5Fget_file_image(f->id, *image, (size_t)bytes) >= 0);
  if (!made) PetscCall(PetscFree(*image));
  HycoCheck(made, "%s could not be written: HDF5 has no image of it in memory", f->path);
  *size = (size_t)bytes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the image of the file in memory, followed by its seal. Fails if there is no memory for a copy; a full disk is
   reported when the file is closed. The checksum is of exactly what is written. */
static PetscErrorCode WriteImage(HycoH5 f)
{
  unsigned char seal[HYCO_CHECKSUM];
  void *image;
  size_t bytes;

  PetscFunctionBegin;
  PetscCall(HycoH5GetImage(f, &image, &bytes));
  HycoChecksumMake(image, bytes, seal);
  (void)!fwrite(image, 1, bytes, HycoFileStream(f->out));
  (void)!fwrite(seal, 1, HYCO_CHECKSUM, HycoFileStream(f->out));
  PetscCall(PetscFree(image));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Waits until every rank's numbers are on the disk. */
static PetscErrorCode H5Sync(HycoH5 f)
{
  int failed = 0;

  PetscFunctionBegin;
  if (fsync(f->fd) != 0) failed = errno;
  if (close(f->fd) != 0 && !failed) failed = errno;
  f->fd = -1;
  PetscCall(HycoFileComplain(f->path, failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Seals the file and renames it. On rank 0. Sealed last: a file with a seal is complete. */
static PetscErrorCode H5Position(HycoH5 f)
{
  unsigned char seal[HYCO_CHECKSUM];
  size_t bytes;
  FILE *end;
  int failed = 0;

  PetscFunctionBegin;
  PetscCall(HycoChecksumFile(f->scratch, &bytes, seal));
  end = fopen(f->scratch, "ab");
  if (!end || fwrite(seal, 1, HYCO_CHECKSUM, end) != HYCO_CHECKSUM || fflush(end) != 0 || fsync(fileno(end)) != 0)
    failed = errno ? errno : EIO;
  if (end && fclose(end) != 0 && !failed) failed = errno;
  PetscCall(HycoFileComplain(f->path, failed));
  PetscCall(HycoFileKeep(f->scratch, f->path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0's HDF5 has created all datasets. Before the other ranks' data are synced, because HDF5 writes its metadata at
   the close. From here on the file's structure does not change any more. */
static PetscErrorCode EndLayout(HycoH5 f)
{
  /* Cleared first: after a failed close CloseShared() must not close it again. */
  const hid_t id = f->id;

  PetscFunctionBegin;
  f->id = H5I_INVALID_HID;
  if (H5Fclose(id) < 0) PetscCall(HycoFileComplain(f->path, EIO));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order matters: layout, then all numbers, then the checksum over both. */
static PetscErrorCode H5Commit(HycoH5 f)
{
  PetscFunctionBegin;
  HycoOnRoot(f->comm, EndLayout(f));
  HycoOnEach(f->comm, H5Sync(f));
  HycoOnRoot(f->comm, H5Position(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Renames the file once it is complete and sealed; otherwise nothing stays. */
static PetscErrorCode CloseShared(HycoH5 f, PetscBool commit)
{
  PetscErrorCode ierr = commit ? H5Commit(f) : PETSC_SUCCESS;

  PetscFunctionBegin;
  if (f->id >= 0) H5Fclose(f->id);
  if (f->fd >= 0) close(f->fd);
  if (ierr || !commit) (void)unlink(f->scratch);
  PetscCall(H5Free(&f));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frees *file on errors too, and sets it to NULL. commit false: nothing stays on the disk. */
PetscErrorCode HycoH5Close(HycoH5 *file, PetscBool commit)
{
  HycoH5 f = file ? *file : NULL;
  HycoFile out;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  *file = NULL;
  if (f->shared) {
    PetscCall(CloseShared(f, commit));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  out = f->out;
  ierr = out && commit ? WriteImage(f) : PETSC_SUCCESS;
  H5Fclose(f->id);
  PetscCall(H5Free(&f));
  if (ierr) PetscCall(HycoFileClose(&out, PETSC_FALSE));
  PetscCall(ierr);
  PetscCall(HycoFileClose(&out, commit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoH5Written(HycoH5 f)
{
  return f ? (PetscReal)f->written : 0;
}

/* The number of bytes of a row. HYCO_H5_LINE is a dataset of one dimension. */
static size_t H5Width(hid_t type, PetscInt cols)
{
  return (cols == HYCO_H5_LINE ? 1 : (size_t)cols) * H5Tget_size(type);
}

/* Creates a dataset of rows x cols numbers, or of one dimension. For a shared file, reserves its space on the disk. */
static PetscErrorCode CreateSet(HycoH5 f, const char name[], hid_t type, PetscInt rows, PetscInt cols, hid_t *set)
{
  /* For a line the second one is not read. */
  hsize_t dims[2] = {(hsize_t)rows, (hsize_t)cols};
  hid_t space, links, made;

  PetscFunctionBegin;
  if (f->shared) PetscCall(MakeRoom(f, (size_t)rows * H5Width(type, cols)));
  space = H5Screate_simple(cols == HYCO_H5_LINE ? 1 : 2, dims, NULL);
  links = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(links, 1);
  made = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_obj_track_times(made, 0); /* the same model must give the same file, byte for byte */
  /* Its offset must be known before anything is written, and HDF5 must not overwrite it with fill values. */
  if (f->shared) H5Pset_alloc_time(made, H5D_ALLOC_TIME_EARLY);
  if (f->shared) H5Pset_fill_time(made, H5D_FILL_TIME_NEVER);
  *set = H5Dcreate2(f->id, name, type, space, links, made, H5P_DEFAULT);
  H5Pclose(made);
  H5Pclose(links);
  H5Sclose(space);
  HycoCheck(*set >= 0, "%s: writing %s failed; check the free memory", f->path, name);
  HycoCheck(!f->shared || H5Fflush(f->id, H5F_SCOPE_GLOBAL) >= 0, "%s: writing %s failed; check the free disk space",
            f->path, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The dataset of that name, created if it does not exist. For a shared file, its position on the disk. An empty
   dataset has no offset. */
static PetscErrorCode FindSet(HycoH5 f, const char name[], hid_t type, PetscInt rows, PetscInt cols, hid_t *set,
                              long long *place)
{
  PetscFunctionBegin;
  *set = HycoH5Has(f, name) ? H5Dopen2(f->id, name, f->access) : H5I_INVALID_HID;
  if (*set < 0) PetscCall(CreateSet(f, name, type, rows, cols, set));
  *place = f->shared && rows && cols ? (long long)H5Dget_offset(*set) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the rows first .. first + n - 1 of a dataset into the file in memory. Writes to parts of a dataset one after
   another: rows of several times, or of several points. Negative: HDF5 has failed. */
static herr_t PutRows(hid_t set, hid_t type, PetscInt cols, PetscInt first, PetscInt n, const void *data)
{
  const hsize_t start[2] = {(hsize_t)first, 0}, count[2] = {(hsize_t)n, (hsize_t)cols};
  hid_t memory = H5Screate_simple(cols == HYCO_H5_LINE ? 1 : 2, count, NULL), file = H5Dget_space(set);
  herr_t failed;

  H5Sselect_hyperslab(file, H5S_SELECT_SET, start, NULL, count, NULL);
  failed = H5Dwrite(set, type, memory, file, H5P_DEFAULT, data);
  H5Sclose(file);
  H5Sclose(memory);
  return failed;
}

/* Writes the rows first .. first + n - 1 of a dataset with `rows` rows; creates the dataset if it does not exist. A
   shared file's dataset has a place, at which numbers are written without HDF5. */
static PetscErrorCode H5Write(HycoH5 f, const char name[], hid_t type, PetscInt rows, PetscInt cols, PetscInt first,
                              PetscInt n, const void *data)
{
  const size_t width = H5Width(type, cols);
  long long place = 0;
  herr_t failed = 0;
  hid_t set;

  PetscFunctionBegin;
  PetscCall(FindSet(f, name, type, rows, cols, &set, &place));
  if (!f->shared && n && cols) failed = PutRows(set, type, cols, first, n, data);
  H5Dclose(set);
  HycoCheck(failed >= 0, "%s: writing %s failed; check the free memory", f->path, name);
  if (f->shared) PetscCall(HycoFilePut(f->fd, f->path, data, (size_t)n * width, (size_t)place + (size_t)first * width));
  f->written += (size_t)n * width;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The HDF5 type for PetscReal (MPIU_REAL), PetscInt (MPIU_INT) or bytes. */
static hid_t NumberType(MPI_Datatype type)
{
  return type == MPIU_REAL ? H5T_NATIVE_DOUBLE : type == MPI_UNSIGNED_CHAR ? H5T_NATIVE_UCHAR : NATIVE_INT;
}

/* On rank 0. */
static PetscErrorCode LayOut(HycoH5 f, const char name[], MPI_Datatype type, PetscInt rows, PetscInt cols,
                             long long *place)
{
  hid_t set;

  PetscFunctionBegin;
  PetscCall(FindSet(f, name, NumberType(type), rows, cols, &set, place));
  H5Dclose(set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective if the file is shared: first and n are this rank's, all else equal on all. Only rank 0 has HDF5's
   file open. */
PetscErrorCode HycoH5WriteRows(HycoH5 f, const char name[], MPI_Datatype type, PetscInt rows, PetscInt cols,
                               PetscInt first, PetscInt n, const void *data)
{
  const size_t width = H5Width(NumberType(type), cols);
  long long place = 0;

  PetscFunctionBegin;
  HycoCheckGiven(f);
  if (!f->shared) {
    PetscCall(H5Write(f, name, NumberType(type), rows, cols, first, n, data));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoOnRoot(f->comm, LayOut(f, name, type, rows, cols, &place));
  PetscCallMPI(MPI_Bcast(&place, 1, MPI_LONG_LONG, 0, f->comm));
  HycoOnEach(f->comm, HycoFilePut(f->fd, f->path, data, (size_t)n * width, (size_t)place + (size_t)first * width));
  f->written += (size_t)n * width;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoH5WriteReal(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const PetscReal *data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(H5Write(file, name, NumberType(MPIU_REAL), rows, cols, 0, rows, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half the bytes, for data whose error is far above 1e-7. */
PetscErrorCode HycoH5WriteSingle(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const float *data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(H5Write(file, name, H5T_NATIVE_FLOAT, rows, cols, 0, rows, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoH5WriteInt(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const PetscInt *data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(H5Write(file, name, NumberType(MPIU_INT), rows, cols, 0, rows, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Arrays of bytes: HDF5's strings have variants that not every reader knows. */
PetscErrorCode HycoH5WriteText(HycoH5 file, const char name[], const char text[])
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(H5Write(file, name, H5T_NATIVE_CHAR, (PetscInt)strlen(text), 1, 0, (PetscInt)strlen(text), text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes an attribute; an existing one is kept. Kept, because a dataset of several times is described at each of
   them. */
static PetscErrorCode WriteAttribute(HycoH5 f, const char at[], const char name[], hid_t type, hid_t space,
                                     const void *value)
{
  herr_t failed = 0;
  hid_t made;

  PetscFunctionBegin;
  if (H5Aexists_by_name(f->id, at, name, H5P_DEFAULT) <= 0) {
    made = H5Acreate_by_name(f->id, at, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    failed = made < 0 ? -1 : H5Awrite(made, type, value);
    if (made >= 0) H5Aclose(made);
  }
  HycoCheck(failed >= 0, "%s: writing the attribute %s of %s failed; check the free memory", f->path, name, at);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HDF5 has no strings of length 0: an empty one is a single zero byte. */
PetscErrorCode HycoH5WriteAttribute(HycoH5 f, const char at[], const char name[], const char text[])
{
  hid_t space = H5Screate(H5S_SCALAR), type = H5Tcopy(H5T_C_S1);

  PetscFunctionBegin;
  HycoCheckGiven(f);
  H5Tset_size(type, PetscMax(strlen(text), 1));
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  HycoFinally(WriteAttribute(f, at, name, type, space, text), H5Tclose(type); H5Sclose(space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One number is a scalar, as VTK expects. */
PetscErrorCode HycoH5WriteAttributeInt(HycoH5 f, const char at[], const char name[], PetscInt n, const PetscInt value[])
{
  const hsize_t size = (hsize_t)n;
  hid_t space = n == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &size, NULL);

  PetscFunctionBegin;
  HycoCheckGiven(f);
  HycoFinally(WriteAttribute(f, at, name, NATIVE_INT, space, value), H5Sclose(space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the dataset's numbers are stored in this file, without a filter: a filter could load code that the file
   names. */
static PetscBool IsPlain(hid_t set)
{
  hid_t made = H5Dget_create_plist(set);
  PetscBool plain;

  plain = (PetscBool)(made >= 0 && H5Pget_external_count(made) == 0 && H5Pget_nfilters(made) == 0 &&
                      H5Pget_layout(made) != H5D_VIRTUAL);
  if (made >= 0) H5Pclose(made);
  return plain;
}

/* Opens a two-dimensional dataset of the wanted class and returns its size. The caller closes the set. Files may come
   from anywhere: nothing in them is trusted before it is checked. */
static PetscErrorCode OpenSet(HycoH5 f, const char name[], H5T_class_t wanted, hid_t *set, hsize_t dims[2])
{
  const hsize_t most = PetscMin((hsize_t)PETSC_MAX_INT, (hsize_t)f->size);
  hid_t space, type;
  H5T_class_t class;
  hsize_t size;
  int rank;

  PetscFunctionBegin;
  *set = H5Dopen2(f->id, name, f->access);
  HycoCheck(*set >= 0, "%s has no %s: it was not written by this version of hyco, or it is damaged", f->path, name);
  space = H5Dget_space(*set);
  type = H5Dget_type(*set);
  rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : -1;
  class = type >= 0 ? H5Tget_class(type) : H5T_NO_CLASS;
  size = type >= 0 && H5Tget_size(type) == sizeof(float) ? sizeof(float) : sizeof(PetscReal);
  if (rank == 2) H5Sget_simple_extent_dims(space, dims, NULL);
  if (space >= 0) H5Sclose(space);
  if (type >= 0) H5Tclose(type);
  /* The declared size must fit in the file: a damaged size must not cause a huge allocation. */
  if (rank != 2 || class != wanted || !IsPlain(*set) || dims[0] > most || dims[1] > most ||
      (dims[1] && dims[0] > most / dims[1]) ||
      H5Dget_storage_size(*set) < dims[0] * dims[1] * (wanted == H5T_FLOAT ? size : 1)) {
    H5Dclose(*set);
    HycoFail("%s: %s is damaged (its shape or type differs from what hyco writes)", f->path, name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Closes the set on errors too. */
static PetscErrorCode ReadSet(HycoH5 f, const char name[], hid_t set, hid_t type, hid_t memory, hid_t space, void *data)
{
  herr_t status = H5Dread(set, type, memory, space, H5P_DEFAULT, data);

  PetscFunctionBegin;
  H5Dclose(set);
  HycoCheck(status >= 0, "%s: %s cannot be read: the file is damaged", f->path, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A size of -1 is not known beforehand, and is printed as n. */
static PetscErrorCode CheckSize(HycoH5 f, const char name[], const hsize_t dims[2], PetscInt rows, PetscInt cols)
{
  char wanted[2][24];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(wanted[0], sizeof(wanted[0]), rows < 0 ? "n" : "%" PetscInt_FMT, rows));
  PetscCall(PetscSNPrintf(wanted[1], sizeof(wanted[1]), cols < 0 ? "n" : "%" PetscInt_FMT, cols));
  HycoCheck((rows < 0 || dims[0] == (hsize_t)rows) && (cols < 0 || dims[1] == (hsize_t)cols),
            "%s: %s is %ld x %ld, and %s x %s was expected: the file is damaged", f->path, name, (long)dims[0],
            (long)dims[1], wanted[0], wanted[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H5Lexists() fails, and is no error, if a folder of the name is missing. */
PetscBool HycoH5Has(HycoH5 file, const char name[])
{
  return (PetscBool)(file && name && H5Lexists(file->id, name, file->access) > 0);
}

/* From the header of a dataset of reals: nothing is read. */
PetscErrorCode HycoH5GetSize(HycoH5 file, const char name[], PetscInt *rows, PetscInt *cols)
{
  hid_t set;
  hsize_t dims[2];

  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(OpenSet(file, name, H5T_FLOAT, &set, dims));
  H5Dclose(set);
  *rows = (PetscInt)dims[0];
  *cols = (PetscInt)dims[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Once here, so that no later check is needed: not a number would pass through every comparison. */
static PetscErrorCode CheckFinite(HycoH5 f, const char name[], size_t n, const PetscReal data[])
{
  PetscFunctionBegin;
  for (size_t k = 0; k < n; k++)
    HycoCheck(!PetscIsInfOrNanReal(data[k]), "%s: %s contains a value that is not finite: the file is damaged", f->path,
              name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Into an array of the caller, of the size asked for. */
PetscErrorCode HycoH5ReadReal(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, PetscReal *data)
{
  hid_t set;
  hsize_t dims[2];

  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(OpenSet(file, name, H5T_FLOAT, &set, dims));
  PetscCall(CheckSize(file, name, dims, rows, cols));
  PetscCall(ReadSet(file, name, set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, data));
  PetscCall(CheckFinite(file, name, dims[0] * dims[1], data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a dataset into new memory (*data), `size` bytes per number, with room for one more. *rows and *cols are -1 if
   any size is right, and become that of the file. */
static PetscErrorCode LoadSet(HycoH5 f, const char name[], H5T_class_t class, hid_t type, size_t size, PetscInt *rows,
                              PetscInt *cols, void *data)
{
  hid_t set;
  hsize_t dims[2];

  PetscFunctionBegin;
  PetscCall(OpenSet(f, name, class, &set, dims));
  PetscCall(CheckSize(f, name, dims, *rows, *cols));
  *rows = (PetscInt)dims[0];
  *cols = (PetscInt)dims[1];
  PetscCall(PetscMalloc((dims[0] * dims[1] + 1) * size, (void **)data));
  HycoOnError(ReadSet(f, name, set, type, H5S_ALL, H5S_ALL, *(void **)data), PetscCall(PetscFree(*(void **)data)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Infinite numbers and not a number in a file are damage. */
PetscErrorCode HycoH5LoadReal(HycoH5 file, const char name[], PetscInt *rows, PetscInt *cols, PetscReal **data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(LoadSet(file, name, H5T_FLOAT, H5T_NATIVE_DOUBLE, sizeof(PetscReal), rows, cols, data));
  HycoOnError(CheckFinite(file, name, (size_t)*rows * (size_t)*cols, *data), PetscCall(PetscFree(*data)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lo, hi: the permitted range. Indices from a file are used without further checks. */
PetscErrorCode HycoH5LoadInt(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt *rows, PetscInt *cols,
                             PetscInt **data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(LoadSet(file, name, H5T_INTEGER, NATIVE_INT, sizeof(PetscInt), rows, cols, data));
  for (size_t k = 0; k < (size_t)*rows * (size_t)*cols; k++) {
    const PetscInt value = (*data)[k];

    if (value >= lo && value <= hi) continue;
    PetscCall(PetscFree(*data));
    HycoFail("%s: %s contains %d, outside %d to %d: the file is damaged", file->path, name, (int)value, (int)lo,
             (int)hi);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No row: the ranks that have none need not open the dataset. A contiguous part, as each rank reads its own. */
PetscErrorCode HycoH5ReadRows(HycoH5 file, const char name[], PetscInt start, PetscInt n, PetscInt cols,
                              PetscReal *data)
{
  hid_t set, space, memory;
  hsize_t dims[2], offset[2] = {(hsize_t)start, 0}, count[2] = {(hsize_t)n, (hsize_t)cols};

  PetscFunctionBegin;
  HycoCheckGiven(file);
  if (n == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(OpenSet(file, name, H5T_FLOAT, &set, dims));
  PetscCall(CheckSize(file, name, dims, -1, cols));
  HycoCheck((hsize_t)(start + n) <= dims[0], "%s: %s has %ld rows, and %d are needed: the file is damaged", file->path,
            name, (long)dims[0], (int)(start + n));
  space = H5Dget_space(set);
  H5Sselect_hyperslab(space, H5S_SELECT_SET, offset, NULL, count, NULL);
  memory = H5Screate_simple(2, count, NULL);
  PetscCall(ReadSet(file, name, set, H5T_NATIVE_DOUBLE, memory, space, data));
  H5Sclose(memory);
  H5Sclose(space);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoH5LoadText(HycoH5 file, const char name[], char **text)
{
  PetscInt length = -1, one = 1;

  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(LoadSet(file, name, H5T_INTEGER, H5T_NATIVE_CHAR, 1, &length, &one, text));
  (*text)[length] = '\0';
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoH5Reads(HycoH5 file)
{
  return (PetscBool)(file && file->reads);
}

/* One function reads and writes, so that both directions of a format are the same code; see HycoH5Reads(). */
PetscErrorCode HycoH5Real(HycoH5 file, const char name[], PetscInt *rows, PetscInt cols, PetscReal **data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(file->reads ? HycoH5LoadReal(file, name, rows, &cols, data)
                        : HycoH5WriteReal(file, name, *rows, cols, *data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One call for both directions: code that moves an object writes and reads it by the same lines. Read values lie
   in lo to hi, or the file is refused. */
PetscErrorCode HycoH5Int(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt *rows, PetscInt cols,
                         PetscInt **data)
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(file->reads ? HycoH5LoadInt(file, name, lo, hi, rows, &cols, data)
                        : HycoH5WriteInt(file, name, *rows, cols, *data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoH5Reals(HycoH5 file, const char name[], PetscInt n, PetscReal data[])
{
  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(file->reads ? HycoH5ReadReal(file, name, n, 1, data) : HycoH5WriteReal(file, name, n, 1, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads into the caller's array, after the range check in memory of its own. Writes or reads, by the direction of the
   file. */
PetscErrorCode HycoH5Ints(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt n, PetscInt data[])
{
  PetscInt *read = data;

  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(HycoH5Int(file, name, lo, hi, &n, 1, &read));
  if (!file->reads) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(data, read, n));
  PetscCall(PetscFree(read));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Offsets of a compressed list: ascending from 0, else its users would read beyond their arrays. The last one is
   the caller's to check. */
PetscErrorCode HycoH5Starts(HycoH5 file, const char name[], PetscInt n, PetscInt **start)
{
  PetscInt rows = n + 1;

  PetscFunctionBegin;
  HycoCheckGiven(file);
  PetscCall(HycoH5Int(file, name, 0, PETSC_MAX_INT, &rows, 1, start));
  for (PetscInt k = 0; k < n; k++)
    HycoCheck((*start)[0] == 0 && (*start)[k] <= (*start)[k + 1], "%s: %s is damaged", file->path, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}
