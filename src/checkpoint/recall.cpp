// Which options of a checkpoint a continued run takes. A checkpoint may come from another user: its options must not make
// this run write a file that the user did not name, or load a library.
#include <sys/stat.h>
#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>
#include <set>
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/recalled.hpp"
#include "checkpoint/checkpoint.hpp"
#include "output/claim.hpp"
#include "output/fresh_file.hpp"

namespace bs {
namespace {

bool harmless(const std::string& name) {
  for (const char* begin : {"bs_output", "bs_checkpoint", "bs_progress", "bs_report", "ts_max_time", "ts_max_steps", "log_"})
    if (name.rfind(begin, 0) == 0) return true;
  return name.find("monitor") != std::string::npos || name.find("view") != std::string::npos || of_this_run_only(name);
}

/// The kinds of viewers by which PETSc's options print (-ksp_compute_eigenvalues binary writes the file binaryoutput).
bool names_viewer(const std::string& value) {
  static const std::set<std::string> kinds = {"ascii",  "binary", "draw",   "exodusii", "glvis", "hdf5", "mathematica",
                                              "matlab", "saws",   "socket", "string",   "adios", "vtk",  "vu"};
  return kinds.count(value) > 0;
}

/// PETSc's options that choose and tune methods. Of its thousands these are let in, not others kept out: any viewer can write
/// (-ksp_view ascii:F, -snes_monitor F, -ts_converged_reason hdf5:F), and other names load code or keep state in files.
bool chooses_method(const std::string& name, const std::string& value) {
  static const char* const begins[] = {"ts_", "snes_", "ksp_",        "pc_",  "mat_",    "vec_",     "condensed_",  "sub_",
                                       "mg_", "npc_",  "fieldsplit_", "est_", "esteig_", "matptap_", "matmatmult_", "matproduct_"};
  static const char* const never[] = {"view",   "monitor", "reason",  "file",  "dirname", "directory", "tmpdir",     "path",    "dump",
                                      "print",  "log",     "info",    "debug", "trace",   "save",      "trajectory", "load",    "library",
                                      "plugin", "python",  "draw",    "plot",  "record",  "history",   "ascii",      "binary",  "hdf5",
                                      "socket", "saws",    "command", "exec",  "script",  "matlab",    "ooc",        "icntl_22"};
  if (std::none_of(std::begin(begins), std::end(begins), [&](const char* begin) { return name.rfind(begin, 0) == 0; })) return false;
  if (std::any_of(std::begin(never), std::end(never), [&](const char* part) { return name.find(part) != std::string::npos; })) return false;
  // a type's name or numbers: nothing that names a file, viewer or library
  return std::all_of(value.begin(), value.end(), [](unsigned char c) { return std::isalnum(c) || std::strchr("_-+., ()", c); }) &&
         lower(value).find("python") == std::string::npos && !names_viewer(lower(value));
}

/// Names of letters, digits and underscores: as they are printed, so they are.
bool plain(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == '.'; });
}

/// Whether `file`, which a checkpoint names, is a file (no link) in the folder of `checkpoint`.
bool beside(const std::string& file, const std::string& checkpoint) {
  FileIdentity its, folder;
  struct stat status;
  return lstat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode) && identity_of(folder_of(file), true, &its) &&
         identity_of(folder_of(checkpoint), true, &folder) && its == folder;
}

/// Whether the run may go on with the checkpoint `file`, which `restart` names as its own.
bool own_checkpoint(const std::string& file, const std::string& restart) {
  struct stat status;
  if (restart == previous_checkpoint(file) && lstat(file.c_str(), &status) != 0) return true;  // a file system without links
  return beside(file, restart) && is_checkpoint(file);
}

/// Options that name the run's own files: taken where these lie beside the checkpoint.
bool names_own_file(const std::string& name) { return name == "bs_output" || name == "bs_checkpoint"; }

/// Rank 0's verdict on one option that was not given anew. Which of the program's own name files, their readers know (Section::path, find_input).
bool taken(const std::string& name, const std::string& value, const std::string& restart, bool with_checkpoint) {
  if (!plain(name)) return false;
  if (name.rfind("bs_", 0) != 0) return chooses_method(name, value);
  if (name == "bs_output") return beside(value, restart);
  if (name == "bs_checkpoint" || name == "bs_checkpoint_every" || name == "bs_checkpoint_minutes") return with_checkpoint;
  return true;
}

}  // namespace

bool of_this_run_only(const std::string& option) {
  static const std::set<std::string> names = {"bs_restart", "bs_overwrite", "options_file", "options_file_yaml",
                                              "help",       "bs_version",   "bs_trace",     "options_left"};
  return names.count(lower(option)) > 0;
}

PetscErrorCode recall_options(MPI_Comm comm) {
  char file[PETSC_MAX_PATH_LEN] = "";
  PetscBool given = PETSC_FALSE, there = PETSC_FALSE;
  PetscMPIInt rank;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-bs_restart", file, sizeof file, &given));
  if (!given || !*file) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  CheckpointFile checkpoint;
  PetscCall(checkpoint.open(comm, file));
  const auto& options = checkpoint.options();
  bool with_checkpoint = false;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-bs_checkpoint", &there));
  if (there) with_checkpoint = true;
  else if (rank == 0)
    for (const auto& [name, value] : options)
      if (lower(name) == "bs_checkpoint") with_checkpoint = own_checkpoint(value, file);
  std::vector<char> take(options.size(), 0);
  for (std::size_t k = 0; k < options.size() && rank == 0; ++k) take[k] = taken(lower(options[k].first), options[k].second, file, with_checkpoint);
  PetscCallMPI(MPI_Bcast(take.data(), static_cast<PetscMPIInt>(take.size()), MPI_CHAR, 0, comm));
  for (std::size_t k = 0; k < options.size(); ++k) {
    const auto& [name, value] = options[k];
    const std::string key = "-" + name;
    if (of_this_run_only(name)) continue;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, key.c_str(), &there));
    if (there && !is_recalled(comm, key)) continue;
    if (there || !take[k]) {  // there: under another spelling, which no checkpoint of this program's has
      PetscCall(leave_out(comm, file, key, value));
      continue;
    }
    PetscCall(PetscOptionsSetValue(nullptr, key.c_str(), value.empty() ? nullptr : value.c_str()));
    note_recalled(comm, key, file, names_own_file(lower(name)));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode warn_changed_options(MPI_Comm comm, const CheckpointFile& file) {
  std::vector<std::pair<std::string, std::string>> now;
  PetscFunctionBegin;
  PetscCall(options_in_force(&now));
  const std::map<std::string, std::string> before(file.options().begin(), file.options().end());
  const std::map<std::string, std::string> present(now.begin(), now.end());
  for (const auto& [name, value] : present) {
    const auto was = before.find(name);
    if (harmless(name) || (was != before.end() && was->second == value)) continue;
    const std::string old = was == before.end() ? "not given" : was->second;
    PetscCall(warn(comm, "the run continues with -" + name + " " + value + "; it was " + (old.empty() ? "given without a value" : old) + " when " +
                             file.name() + " was written"));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
