// Which options of a checkpoint a continued run takes. A checkpoint may come from another user: its options must not make
// this run write a file that the user did not name, or load a library.
#include <sys/stat.h>
#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>
#include <set>
#include "base/fault.hpp"
#include "checkpoint/checkpoint.hpp"
#include "output/claim.hpp"
#include "output/fresh_file.hpp"
#include "output/h5md.hpp"

namespace bs {
namespace {

std::set<std::string>& recalled() {
  static std::set<std::string> names;
  return names;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Options of one run that no other wants to know of.
bool of_this_run_only(const std::string& name) {
  static const std::set<std::string> names = {"bs_restart", "bs_overwrite", "options_file", "options_file_yaml",
                                              "help",       "bs_version",   "bs_trace",     "options_left"};
  return names.count(name) > 0;
}

bool harmless(const std::string& name) {
  for (const char* begin : {"bs_output", "bs_checkpoint", "bs_progress", "bs_report", "ts_max_time", "ts_max_steps", "log_"})
    if (name.rfind(begin, 0) == 0) return true;
  return name.find("monitor") != std::string::npos || name.find("view") != std::string::npos || of_this_run_only(name);
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
         lower(value).find("python") == std::string::npos;
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

/// Rank 0's verdict on one option that was not given anew.
bool taken(const std::string& name, const std::string& value, const std::string& restart, bool with_checkpoint) {
  if (!plain(name)) return false;
  if (name.rfind("bs_", 0) != 0) return chooses_method(name, value);
  if (name == "bs_report") return false;
  if (name == "bs_output") return beside(value, restart);
  if (name == "bs_checkpoint" || name == "bs_checkpoint_every" || name == "bs_checkpoint_minutes") return with_checkpoint;
  return true;
}

std::string shown(const std::string& name, const std::string& value) {
  constexpr std::size_t most = 60;
  return "-" + name.substr(0, most) + (value.empty() ? "" : " " + (value.size() > most ? value.substr(0, most) + "..." : value));
}

}  // namespace

bool is_recalled(const std::string& name) { return recalled().count(name) > 0; }

PetscErrorCode recall_options(MPI_Comm comm) {
  char file[PETSC_MAX_PATH_LEN] = "";
  PetscBool given = PETSC_FALSE, there = PETSC_FALSE;
  PetscMPIInt rank;
  std::string left_out;
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
    if (of_this_run_only(lower(name))) continue;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, key.c_str(), &there));
    if (there) continue;
    if (!take[k]) {
      left_out += (left_out.empty() ? "" : ", ") + shown(name, value);
      continue;
    }
    PetscCall(PetscOptionsSetValue(nullptr, key.c_str(), value.empty() ? nullptr : value.c_str()));
    recalled().insert(lower(name));
  }
  if (!left_out.empty())
    PetscCall(warn(comm, std::string(file) + ": not taken over from it: " + left_out +
                             ": options that write files or load libraries apply only if they are given again; those of the trajectory and the "
                             "checkpoint also if these lie beside it"));
  PetscFunctionReturn(0);
}

PetscErrorCode tell_changed_options(MPI_Comm comm, const CheckpointFile& file) {
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
