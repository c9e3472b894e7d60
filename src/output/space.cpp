#include "output/space.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "base/error.hpp"
#include "output/fresh_file.hpp"

namespace bs {

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
  PetscMPIInt rank;
  Error fault;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
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
  PetscMPIInt rank;
  int result = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) result = try_reserve(file, from, bytes);
  PetscCallMPI(MPI_Bcast(&result, 1, MPI_INT, 0, comm));
  *reason = result ? std::strerror(result) : "";
  PetscFunctionReturn(0);
}

}  // namespace bs
