#include "input/text_file.hpp"
#include <sys/stat.h>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"

namespace bs {

namespace {

constexpr long long max_text_bytes = 1000000000;

/// Reads what rank 0 is to share; what went wrong goes to `fault`.
void read_here(MPI_Comm comm, const std::string& path, std::string* text, Error* fault) {
  const FileStatus look = examine_file(comm, path);
  if (!look.error.empty()) return fault->note(0, look.error);
  if (look.bytes > max_text_bytes)
    return fault->note(0,
                       format("%s: %lld bytes, more than the 1 GB a text file may have; write the lattice as HDF5 (.h5)", path.c_str(), look.bytes));
  try {
    text->resize(static_cast<std::size_t>(look.bytes));
  } catch (const std::bad_alloc&) {
    return fault->note(0, path + ": not enough memory for its " + how_many(look.bytes, "byte"));
  }
  std::ifstream in(path, std::ios::binary);
  in.read(text->data(), look.bytes);
  if (in.gcount() != look.bytes)
    fault->note(0, format("%s: read %lld of its %s; check the disk", path.c_str(), static_cast<long long>(in.gcount()),
                          how_many(look.bytes, "byte").c_str()));
}

}  // namespace

FileStatus examine_file(MPI_Comm comm, const std::string& path) {
  FileStatus look;
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0)
    look.error = errno == ENOENT ? path + ": no such file; " + input_places(comm, path)
                                 : format("%s: cannot be read (%s)", path.c_str(), std::strerror(errno));
  else if (S_ISDIR(info.st_mode)) look.error = format("%s: is a folder; name a file in it", path.c_str());
  else if (!S_ISREG(info.st_mode)) look.error = format("%s: is not a regular file", path.c_str());
  else if (!std::ifstream(path)) look.error = format("%s: cannot be opened; check its permissions (chmod +r)", path.c_str());
  look.bytes = static_cast<long long>(info.st_size);
  return look;
}

PetscErrorCode read_text_file(MPI_Comm comm, const std::string& path, std::string* text) {
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  text->clear();
  if (rank == 0) read_here(comm, path, text, &fault);
  PetscCall(fail_if_any(comm, fault));
  PetscCall(share_text(comm, text));
  PetscFunctionReturn(0);
}

}  // namespace bs
