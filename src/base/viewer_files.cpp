#include "base/viewer_files.hpp"
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <set>
#include <string>
#include <vector>
#include "base/fault.hpp"
#include "base/option_names.hpp"

namespace bs {
namespace {

/// The file that a viewer's description names; empty where it names none.
std::string viewer_file(const std::string& value) {
  static const std::set<std::string> kinds = {"", "ascii", "binary", "hdf5", "vtk", "exodusii", "matlab", "mathematica", "adios"};
  const std::size_t kind = value.find(':');
  if (kind == std::string::npos || kinds.count(value.substr(0, kind)) == 0) return {};
  const std::string file = value.substr(kind + 1, value.find(':', kind + 1) - kind - 1);
  return file == "stdout" || file == "stderr" || file == "-" ? "" : file;
}

/// Options whose whole value is the name of a file.
bool names_file(const std::string& option) { return option == "citations" || option == "malloc_view"; }

/// Why a file cannot be written; 0 where it can. Nothing is made or changed.
int reason_against(const std::string& file) {
  struct stat status;
  const std::size_t slash = file.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : slash == 0 ? "/" : file.substr(0, slash);
  if (stat(file.c_str(), &status) == 0) return S_ISDIR(status.st_mode) ? EISDIR : access(file.c_str(), W_OK) == 0 ? 0 : errno;
  if (errno != ENOENT) return errno;
  if (stat(folder.c_str(), &status) != 0) return errno;
  if (!S_ISDIR(status.st_mode)) return ENOTDIR;
  return access(folder.c_str(), W_OK | X_OK) == 0 ? 0 : errno;
}

}  // namespace

PetscErrorCode check_viewers(MPI_Comm comm) {
  std::vector<std::pair<std::string, std::string>> options;
  PetscMPIInt rank;
  Fault fault;
  PetscBool value = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(options_in_force(&options));
  for (const auto& [name, text] : options) {
    const std::string file = name.rfind("bs_", 0) == 0 ? "" : names_file(name) ? text : viewer_file(text);
    if (rank != 0 || file.empty()) continue;
    if (const int why = reason_against(file))
      fault.note(0, "option -" + name + " " + text + ": cannot write " + file + ": " + std::strerror(why), Exit::io);
  }
  fault.exit = Exit::io;
  PetscCall(agree(comm, fault));
  for (const char* name : {"-options_view", "-options_left"}) PetscCall(PetscOptionsGetBool(nullptr, nullptr, name, &value, nullptr));
  PetscFunctionReturn(0);
}

}  // namespace bs
