// Which options of a checkpoint a continued run takes. A checkpoint may come from another user: its options must not make
// this run write a file that the user did not name, or load a library.
#include <sys/stat.h>
#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "base/recalled_options.hpp"
#include "checkpoint/checkpoint.hpp"
#include "output/fresh_file.hpp"
#include "output/output_locks.hpp"

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

/// The folder in which the run was started that wrote the checkpoint `restart` under the name `written`; this folder where that name does not tell.
std::string folder_of_run(const std::string& written, const std::string& restart) {
  const std::filesystem::path below = std::filesystem::path(written).parent_path().lexically_normal();
  std::string folder = folder_of(restart);
  if (written.empty() || below.is_absolute()) return ".";
  for (const std::filesystem::path& part : below) {
    if (part == "..") return ".";
    if (!part.empty() && part != ".") folder += "/..";
  }
  return folder;
}

/// A file of the run that was started in `folder`, as it is named from here.
std::string from_here(const std::string& file, const std::string& folder, const std::string& restart) {
  const bool there = file.empty() || file[0] == '/' || folder == "." || beside(file, restart);
  return there ? file : (std::filesystem::path(folder) / file).lexically_normal().string();
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

/// Collective. Names the run's own files as they are named from here; `folder` is where the run was started.
PetscErrorCode name_from_here(MPI_Comm comm, const std::string& restart, std::vector<std::pair<std::string, std::string>>* options,
                              std::string* folder) {
  std::map<std::string, std::string> own;
  PetscFunctionBegin;
  for (const auto& [name, value] : *options)
    if (names_own_file(lower(name))) own[lower(name)] = value;
  *folder = folder_of_run(own.count("bs_checkpoint") ? own["bs_checkpoint"] : own["bs_output"], restart);
  const PetscMPIInt rank = rank_of(comm);
  for (auto& [name, value] : *options) {
    if (!names_own_file(lower(name))) continue;
    if (rank == 0) value = from_here(value, *folder, restart);
    PetscCall(share_text(comm, &value));
  }
  PetscFunctionReturn(0);
}

}  // namespace

bool of_this_run_only(const std::string& option) {
  static const std::set<std::string> names = {"bs_restart", "bs_overwrite", "options_file", "options_file_yaml",
                                              "help",       "bs_version",   "bs_trace",     "options_left"};
  return names.count(lower(option)) > 0;
}

PetscErrorCode recall_options(MPI_Comm comm) {
  const std::string file = value_of("-bs_restart");
  PetscFunctionBegin;
  if (file.empty()) PetscFunctionReturn(0);
  const PetscMPIInt rank = rank_of(comm);
  CheckpointFile checkpoint;
  PetscCall(checkpoint.open(comm, file));
  auto options = checkpoint.options();
  std::string folder;
  bool with_checkpoint = is_given("-bs_checkpoint");
  PetscCall(name_from_here(comm, file, &options, &folder));
  for (const auto& [name, value] : options)
    if (rank == 0 && !with_checkpoint && lower(name) == "bs_checkpoint") with_checkpoint = own_checkpoint(value, file);
  std::vector<char> take(options.size(), 0);
  for (std::size_t k = 0; k < options.size() && rank == 0; ++k) take[k] = taken(lower(options[k].first), options[k].second, file, with_checkpoint);
  PetscCallMPI(MPI_Bcast(take.data(), static_cast<PetscMPIInt>(take.size()), MPI_CHAR, 0, comm));
  for (std::size_t k = 0; k < options.size(); ++k) {
    const auto& [name, value] = options[k];
    const std::string key = "-" + name;
    if (of_this_run_only(name)) continue;
    const bool there = is_given(key);
    if (there && !is_recalled(comm, key)) continue;
    if (there || !take[k]) {  // there: under another spelling, which no checkpoint of this program's has
      PetscCall(leave_out(comm, file, key, value));
      continue;
    }
    PetscCall(PetscOptionsSetValue(nullptr, key.c_str(), value.empty() ? nullptr : value.c_str()));
    note_recalled(comm, key, {file, folder, key, checkpoint.options()[k].second, names_own_file(lower(name))});
  }
  PetscFunctionReturn(0);
}

namespace {

/// Whether the option says what stands in every frame: the others of the trajectory's say when it is written, and what lies beside it.
bool forms_trajectory(const std::string& name) {
  static const std::set<std::string> others = {"bs_output_interval", "bs_output_flush", "bs_output_xdmf"};
  return name == "viewer_hdf5_sp_output" || (name.rfind("bs_output_", 0) == 0 && others.count(name) == 0);
}

}  // namespace

PetscErrorCode changed_options(const CheckpointFile& file, std::vector<ChangedOption>* found) {
  std::vector<std::pair<std::string, std::string>> now;
  PetscFunctionBegin;
  PetscCall(options_in_force(&now));
  const std::map<std::string, std::string> before(file.options().begin(), file.options().end());
  const std::map<std::string, std::string> present(now.begin(), now.end());
  found->clear();
  for (const auto& [name, value] : present) {
    const auto was = before.find(name);
    if (was != before.end() && was->second == value) continue;
    const std::string old = was == before.end() ? NOT_GIVEN : was->second;
    found->push_back({name, value, old.empty() ? "given without a value" : old});
  }
  PetscFunctionReturn(0);
}

PetscErrorCode warn_changed_options(MPI_Comm comm, const CheckpointFile& file, std::vector<std::string>* form) {
  std::vector<ChangedOption> changed;
  PetscFunctionBegin;
  PetscCall(changed_options(file, &changed));
  form->clear();
  for (const auto& [name, value, was] : changed) {
    const std::string given = "-" + name + (value.empty() ? "" : " " + value);
    if (forms_trajectory(lower(name))) form->push_back(given);
    else if (!harmless(name))
      PetscCall(warn(comm, "continued_otherwise", "the run continues with " + given + "; it was " + was + " when " + file.name() + " was written"));
  }
  PetscFunctionReturn(0);
}

// Whether the tables and texts that options name still say what they said: lattices and matrices are compared by the
// model's fingerprint, everything else by its bytes.

namespace {

const std::string begin = "input_";

/// What the model's fingerprint covers. The text of a scene (.xsp) also sets options.
bool known_to_model(const std::string& option, const std::string& path) {
  if (option == "-bs_lattice_file") return !ends_with(path, ".xsp");
  return option == "-bs_linear_G" || option == "-bs_linear_C" || option == "-bs_linear_B";
}

/// FNV-1a of all bytes; false if it cannot be read.
bool hash_of(const std::string& path, std::uint64_t* sum) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> piece(1 << 16);
  *sum = 0xcbf29ce484222325u;
  if (!in) return false;
  while (in) {
    in.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    for (std::streamsize k = 0; k < in.gcount(); ++k) *sum = (*sum ^ static_cast<unsigned char>(piece[static_cast<std::size_t>(k)])) * 0x100000001b3u;
  }
  return in.eof();
}

}  // namespace

PetscErrorCode fingerprint_inputs(MPI_Comm comm, Facts* run) {
  Error fault;
  std::map<std::string, std::uint64_t> sums;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  for (const auto& [option, path] : input_files(comm)) {
    if (path.empty() || known_to_model(option, path)) continue;
    std::uint64_t sum = 0;
    if (rank == 0 && !hash_of(path, &sum)) fault.note(0, "option " + option + ": " + path + " cannot be read any more: put it back");
    PetscCallMPI(MPI_Bcast(&sum, 1, MPI_UINT64_T, 0, comm));
    const auto [at, first] = sums.try_emplace(option, sum);
    if (!first) at->second = 3 * at->second + sum;  // tables of several components: their order counts
  }
  for (const auto& [option, sum] : sums) run->whole[begin + option.substr(1)] = static_cast<std::int64_t>(sum);
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode require_same_inputs(MPI_Comm comm, const CheckpointFile& file, const Facts& now) {
  PetscFunctionBegin;
  for (const auto& [name, sum] : now.whole) {
    if (name.compare(0, begin.size(), begin) != 0) continue;
    const std::string option = "-" + name.substr(begin.size());
    const auto was = file.run().whole.find(name);
    if (was == file.run().whole.end() || was->second == sum) continue;
    std::string paths;
    for (const auto& [of, path] : input_files(comm))
      if (of == option) paths += (paths.empty() ? "" : ", ") + path;
    if (is_recalled(comm, option))
      PetscCall(fail(comm, Exit::input,
                     option + " " + paths + ": its contents have changed since " + file.name() + " was written: restore them, or give " + option +
                         " again to continue with the present contents"));
    PetscCall(warn(comm, "continued_otherwise",
                   "the run continues with other contents of " + option + " " + paths + " than when " + file.name() + " was written"));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
