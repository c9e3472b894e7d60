#include "output/space.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "base/fault.hpp"

namespace bs {

static std::string folder_of(const std::string& file) {
  const auto slash = file.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : file.substr(0, slash);
}

/// What is wrong with writing `file`; empty if nothing.
static std::string objection(const std::string& file, const char* name, bool overwrite) {
  const std::string folder = folder_of(file);
  struct stat status;
  const bool exists = stat(file.c_str(), &status) == 0;
  if (exists) {
    if (S_ISDIR(status.st_mode)) return file + " is a folder: give the name of a file to " + name;
    if (!overwrite) return file + " exists: give another " + name + " or add -bs_overwrite";
  } else if (stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) {
    return "folder " + folder + " of " + name + " " + file + " does not exist: make it, or give another " + name;
  }
  const int handle = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (handle >= 0) {
    close(handle);
    if (!exists) unlink(file.c_str());
    return {};
  }
  return "cannot write " + file + " into folder " + folder + ": " + std::strerror(errno) + ": give another " + name;
}

PetscErrorCode require_writable(MPI_Comm comm, const std::string& file, const char* name, bool overwrite) {
  PetscMPIInt rank;
  Fault fault;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) fault.text = objection(file, name, overwrite);
  PetscCall(agree(comm, fault));
  PetscFunctionReturn(0);
}

/// errno of the attempt to reserve; 0 if there is room.
static int try_reserve(const std::string& file, std::int64_t bytes) {
  struct stat status;
  struct statvfs room;
  const int handle = open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (handle < 0) return errno;
  int result = fstat(handle, &status) ? errno : 0;
  if (!result && fallocate(handle, FALLOC_FL_KEEP_SIZE, status.st_size, bytes)) result = errno;
  if (result == EOPNOTSUPP || result == ENOSYS) {
    result = 0;
    if (fstatvfs(handle, &room) == 0 &&
        static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize) < static_cast<double>(bytes))
      result = ENOSPC;
  }
  close(handle);
  return result;
}

PetscErrorCode reserve_space(MPI_Comm comm, const std::string& file, std::int64_t bytes, std::string* reason) {
  PetscMPIInt rank;
  int result = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) result = try_reserve(file, bytes);
  PetscCallMPI(MPI_Bcast(&result, 1, MPI_INT, 0, comm));
  *reason = result ? std::strerror(result) : "";
  PetscFunctionReturn(0);
}

}  // namespace bs
