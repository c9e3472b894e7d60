#include "output/fresh_file.hpp"
#include <dirent.h>
#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <vector>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "output/h5.hpp"

namespace bs {

namespace {

constexpr std::size_t digits = 16;

/// Writes all of it. errno, or 0.
int write_all(int handle, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t done = write(handle, data, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return done < 0 ? errno : EIO;
    data += done;
    size -= static_cast<std::size_t>(done);
  }
  return 0;
}

/// The bytes of an HDF5 file without content, made in memory: no name is opened for it. Empty if that fails.
std::vector<char> empty_hdf5() {
  std::vector<char> image;
  const H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (H5Pset_fapl_core(access, 4096, 0) < 0) return image;
  const H5 file(H5Fcreate("empty", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  if (file < 0 || H5Fflush(file, H5F_SCOPE_GLOBAL) < 0) return image;
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  if (size <= 0) return image;
  image.resize(static_cast<std::size_t>(size));
  if (H5Fget_file_image(file, image.data(), image.size()) != size) image.clear();
  return image;
}

/// Rank 0's part of create_fresh_hdf5. errno, or 0.
int create_empty_hdf5(const std::string& file, std::string* name, FileIdentity* identity) {
  const std::vector<char> image = empty_hdf5();
  struct stat status;
  int handle = -1;
  if (image.empty()) return EIO;
  if (const int why = create_fresh(file, ".tmp", name, &handle)) return why;
  int why = write_all(handle, image.data(), image.size());
  if (!why && fstat(handle, &status) != 0) why = errno;
  if (!why) *identity = {status.st_dev, status.st_ino};
  if (close(handle) != 0 && !why) why = errno;
  if (why) (void)unlink(name->c_str());
  return why;
}

}  // namespace

std::string real_name(const std::string& file) {
  struct stat status;
  if (lstat(file.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) return file;
  std::error_code none;
  const auto target = std::filesystem::canonical(file, none);
  return none ? file : target.string();
}

bool identity_of(const std::string& name, bool follow, FileIdentity* identity) {
  struct stat status;
  if ((follow ? stat(name.c_str(), &status) : lstat(name.c_str(), &status)) != 0) return false;
  *identity = {status.st_dev, status.st_ino};
  return true;
}

int create_fresh(const std::string& file, const char* ending, std::string* name, int* handle) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    std::uint64_t chance = 0;
    char text[digits + 1];
    if (getrandom(&chance, sizeof chance, 0) != static_cast<ssize_t>(sizeof chance)) return errno ? errno : EIO;
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(chance));
    *name = file + "." + text + ending;
    *handle = open(name->c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (*handle >= 0) return 0;
    if (errno != EEXIST) return errno;
  }
  return EEXIST;
}

int give_name(const std::string& made, const std::string& file, bool replace) {
  if (replace) return rename(made.c_str(), file.c_str()) == 0 ? 0 : errno;
  if (renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, file.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  // a file system that cannot do it at once (NFS): a second name is never put in the place of another file
  if (link(made.c_str(), file.c_str()) == 0) return unlink(made.c_str()) == 0 ? 0 : errno;
  if (errno == EEXIST) return EEXIST;
  if (access(file.c_str(), F_OK) == 0) return EEXIST;
  return rename(made.c_str(), file.c_str()) == 0 ? 0 : errno;
}

int write_whole(const std::string& file, const std::string& text, bool replace) {
  std::string made;
  int handle = -1;
  if (const int why = create_fresh(file, ".tmp", &made, &handle)) return why;
  int why = write_all(handle, text.data(), text.size());
  if (close(handle) != 0 && !why) why = errno;
  if (!why) why = give_name(made, file, replace);
  if (why) (void)unlink(made.c_str());
  return why;
}

int bring_to_disk(const std::string& path) {
  const int handle = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) return errno;
  const int result = fsync(handle) ? errno : 0;
  close(handle);
  return result;
}

void remove_stale(const std::string& file) {
  const std::string folder = folder_of(file), begin = file.substr(file.rfind('/') + 1) + ".", end = ".tmp";
  DIR* entries = opendir(folder.c_str());
  if (!entries) return;
  while (const dirent* entry = readdir(entries)) {
    const std::string name = entry->d_name;
    if (name.size() != begin.size() + digits + end.size() || name.compare(0, begin.size(), begin) != 0) continue;
    if (name.compare(begin.size() + digits, end.size(), end) != 0) continue;
    if (name.find_first_not_of("0123456789abcdef", begin.size()) != begin.size() + digits) continue;
    struct stat status;
    const std::string path = folder + "/" + name;
    if (lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid()) (void)unlink(path.c_str());
  }
  closedir(entries);
}

PetscErrorCode create_fresh_hdf5(MPI_Comm comm, const std::string& file, std::string* name, FileIdentity* identity, std::string* reason) {
  PetscFunctionBegin;
  const int why = ask_rank_0(comm, [&] { return create_empty_hdf5(file, name, identity); });
  PetscCall(share_text(comm, name));
  *reason = why ? std::strerror(why) : "";
  PetscFunctionReturn(0);
}

PetscErrorCode confirm_identity(MPI_Comm comm, const std::string& name, const FileIdentity& identity, std::string* reason) {
  PetscFunctionBegin;
  FileIdentity present;
  const int same = ask_rank_0(comm, [&] { return identity_of(name, false, &present) && present == identity; });
  *reason = same ? "" : "another file has been put in the place of " + name;
  PetscFunctionReturn(0);
}

static const char* kind_of(mode_t mode) {
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  if (S_ISFIFO(mode)) return "a pipe";
  return S_ISSOCK(mode) ? "a socket" : "no regular file";
}

/// Why the name of something that exists cannot be used; empty if it can.
static std::string objection_to(const std::string& file, mode_t mode, const std::string& name, bool overwrite) {
  if (S_ISDIR(mode)) return file + " is a folder: give the name of a file to " + name;
  if (!S_ISREG(mode)) return file + " is " + kind_of(mode) + ": give the name of a file to " + name;
  if (!overwrite) return file + " exists: give another " + name + " or add -bs_overwrite";
  return {};
}

std::string unwritable(const std::string& file, const char* name, bool overwrite) {
  const std::string folder = folder_of(file);
  struct stat status;
  const bool exists = stat(file.c_str(), &status) == 0;
  if (exists) {
    const std::string fault = objection_to(file, status.st_mode, name, overwrite);
    if (!fault.empty()) return fault;
  } else if (lstat(file.c_str(), &status) == 0) {
    return file + " is a dangling symbolic link: remove it, or give another " + name;
  } else if (stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) {
    return "folder " + folder + " of " + name + " " + file + " does not exist: make it, or give another " + name;
  }
  const std::string real = real_name(file);
  std::string probe;
  int handle = exists ? open(real.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC) : 0;
  int why = handle < 0 ? errno : 0;
  if (exists && handle >= 0) close(handle);
  if (!why && !(why = create_fresh(real, ".tmp", &probe, &handle))) {
    close(handle);
    (void)unlink(probe.c_str());
  }
  if (!why) return {};
  return "cannot write " + file + " into folder " + folder + ": " + std::strerror(why) + ": give another " + name;
}

PetscErrorCode require_writable(MPI_Comm comm, const std::string& file, const char* name, bool overwrite) {
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0) fault.text = unwritable(file, name, overwrite);
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

/// errno of the attempt to reserve; 0 if there is room.
static int try_reserve(const std::string& file, std::int64_t from, std::int64_t bytes) {
  struct stat status;
  struct statvfs room;
  const int handle = open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (handle < 0) return errno;
  int result = fstat(handle, &status) ? errno : 0;
  if (!result && fallocate(handle, FALLOC_FL_KEEP_SIZE, from < 0 ? status.st_size : from, bytes)) result = errno;
  if (result == EOPNOTSUPP || result == ENOSYS) {
    result = 0;
    if (fstatvfs(handle, &room) == 0 && static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize) < static_cast<double>(bytes))
      result = ENOSPC;
  }
  close(handle);
  return result;
}

PetscErrorCode reserve_space(MPI_Comm comm, const std::string& file, std::int64_t from, std::int64_t bytes, std::string* reason) {
  PetscFunctionBegin;
  const int result = ask_rank_0(comm, [&] { return try_reserve(file, from, bytes); });
  *reason = result ? std::strerror(result) : "";
  PetscFunctionReturn(0);
}

/// `made`: its name, empty where none was made; `reason`: why the system does not let it be written, or nothing.
static PetscErrorCode fill_fresh_hdf5(MPI_Comm comm, const std::string& target, std::int64_t bytes, const std::function<PetscErrorCode(hid_t)>& fill,
                                      std::string* made, std::string* reason) {
  FileIdentity identity;
  PetscFunctionBegin;
  PetscCall(create_fresh_hdf5(comm, target, made, &identity, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  BS_H5(H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL));
  H5 file(H5Fopen(made->c_str(), H5F_ACC_RDWR, access), H5Fclose);
  BS_H5(file);
  PetscCall(confirm_identity(comm, *made, identity, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  PetscCall(reserve_space(comm, *made, -1, bytes, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  PetscCall(fill(file));
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  PetscFunctionReturn(0);
}

PetscErrorCode write_whole_hdf5(MPI_Comm comm, const IoWatch& watch, const std::string& target, std::int64_t bytes,
                                const std::function<PetscErrorCode(hid_t)>& fill, const std::function<int(const std::string&)>& put) {
  std::string made, reason;
  PetscFunctionBegin;
  PetscErrorCode code = fill_fresh_hdf5(comm, target, bytes, fill, &made, &reason);
  const int why = ask_rank_0(comm, [&] {
    const bool good = !code && reason.empty();
    int failed = good ? bring_to_disk(made) : 0;
    if (good && !failed) failed = put(made);
    if (!made.empty() && (!good || failed)) (void)unlink(made.c_str());
    return failed;
  });
  if (why) reason = std::strerror(why);
  if (!code && !reason.empty()) code = fail(comm, Exit::io, watch.sentence(reason));
  PetscCall(watch.report(comm, code));
  PetscFunctionReturn(0);
}

}  // namespace bs
