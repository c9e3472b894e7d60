#include "output/output_locks.hpp"
#include <hdf5.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/h5_handle.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "base/text.hpp"
#include "output/fresh_file.hpp"
#include "output/h5.hpp"
#include "output/xdmf.hpp"

namespace bs {

namespace {

constexpr const char* MATRICES = "-bs_write_matrices";

/// One file under one of its names.
struct Named {
  std::string option, path;
  std::string given;     ///< the name that the option gave, where `path` is one the program makes of it
  bool restart = false;  ///< what a checkpoint may be: the one before it
  std::string text() const { return option + " " + (given.empty() ? path : given + " (with " + path + " beside it)"); }
};

/// What the program appends to a name that it is given, and what to append for the file whose lock covers it.
constexpr const char* ENDINGS[][2] = {
    {".checkpoint.previous", ""}, {".checkpoint", ""},  {".previous", ""},      {".xdmf", ""},          {".lock", ""},
    {"_K.mtx", "_M.mtx"},         {"_D.mtx", "_M.mtx"}, {"_M.petsc", "_M.mtx"}, {"_K.petsc", "_M.mtx"}, {"_D.petsc", "_M.mtx"}};

/// The same for every spelling of one place, also of a file that is still to be made.
std::string place_of(const std::string& path) {
  std::error_code none;
  const auto place = std::filesystem::weakly_canonical(std::filesystem::absolute(path, none), none);
  return none ? path : place.string();
}

bool same_file(const std::string& a, const std::string& b) {
  FileIdentity first, second;
  if (identity_of(a, true, &first) && identity_of(b, true, &second)) return first == second;
  return place_of(a) == place_of(b);
}

std::vector<Named> written(const RunFiles& files) {
  std::vector<Named> all;
  const auto add = [&all](const char* option, const std::string& path, std::initializer_list<const char*> beside, bool restart) {
    if (path.empty()) return;
    all.push_back({option, path, "", restart});
    all.push_back({option, path + ".lock", path, false});
    for (const char* ending : beside) all.push_back({option, path + ending, path, restart});
  };
  add("-bs_output", files.output, {}, false);
  if (files.xdmf && !files.output.empty()) all.push_back({"-bs_output", files.output + ".xdmf", files.output, false});
  if (files.checkpoint.empty() && !files.output.empty())
    for (const char* ending : {".checkpoint", ".checkpoint.previous"}) all.push_back({"-bs_output", files.output + ending, files.output, true});
  add("-bs_checkpoint", files.checkpoint, {".previous"}, true);
  add("-bs_report", files.report, {}, false);
  if (!files.matrices.empty()) all.push_back({MATRICES, files.matrix_files[0] + ".lock", files.matrices, false});
  for (const std::string& path : files.matrix_files) all.push_back({MATRICES, path, files.matrices, false});
  return all;
}

/// Files that PETSc's viewers write, as -log_view :FILE and -snes_view ascii:FILE:... name them.
std::vector<Named> viewed() {
  std::vector<std::pair<std::string, std::string>> options;
  std::vector<Named> all;
  if (options_in_force(&options)) return all;
  for (const auto& [name, value] : options) {
    const std::vector<std::string> words = split(value, ':');
    const bool own = strncasecmp(name.c_str(), "bs_", 3) == 0 || strcasecmp(name.c_str(), "info") == 0;
    if (!own && words.size() > 1 && !words[1].empty()) all.push_back({"-" + name, words[1], "", false});
  }
  return all;
}

/// Option files, wherever they are named, and the inputs read so far.
std::vector<Named> read_files(const RunFiles& files) {
  std::vector<Named> all;
  std::vector<std::string> words;
  int argc = 0;
  char** argv = nullptr;
  if (PetscGetArgs(&argc, &argv) == 0) words.assign(argv, argv + argc);
  for (const std::string& word : words_of_environment()) words.push_back(word);
  for (std::size_t k = 0; k + 1 < words.size(); ++k)
    if (words[k] == "-options_file" || words[k] == "-options_file_yaml") all.push_back({words[k], words[k + 1], "", false});
  for (const auto& [option, path] : files.inputs) all.push_back({option, path, "", false});
  if (!files.restart.empty()) all.push_back({"-bs_restart", files.restart, "", true});
  return all;
}

/// A file that a viewer would write over; empty if there is none.
std::string viewer_clash(const std::vector<Named>& outputs, const std::vector<Named>& inputs) {
  for (const Named& view : viewed())
    for (const std::vector<Named>* some : {&outputs, &inputs})
      for (const Named& one : *some)
        if (same_file(view.path, one.path)) return view.text() + " and " + one.text() + " are one file: give another " + view.option;
  return {};
}

/// Two names for one file; empty if there are none.
std::string clash(const RunFiles& files) {
  const std::vector<Named> outputs = written(files), inputs = read_files(files);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (const Named& input : inputs)
      if (!(outputs[i].restart && input.restart) && same_file(outputs[i].path, input.path))
        return outputs[i].text() + " and " + input.text() + " are one file: the run would destroy what it reads: give another " + outputs[i].option;
    for (std::size_t k = 0; k < i; ++k) {
      const Named &one = outputs[i], &other = outputs[k];
      const bool same_option = one.option == other.option;
      // a run killed while a checkpoint takes its place leaves one file under both names
      const bool may_be_one = same_option && (one.path == other.path || one.path == other.path + ".previous");
      if (!may_be_one && same_file(one.path, other.path)) return one.text() + " and " + other.text() + " are one file: give another " + one.option;
    }
  }
  return viewer_clash(outputs, inputs);
}

/// Whether another run writes one of the names that this one makes, or makes one of those that this one writes.
std::string claimed_by_others(const RunFiles& files, RunLock* lock) {
  for (const Named& one : written(files)) {
    const std::string path = real_name(one.path);
    std::string fault = lock->held_elsewhere(path, one.option.c_str());
    for (const auto& [ending, locked] : ENDINGS)
      if (fault.empty() && ends_with(path, ending))
        fault = lock->held_elsewhere(path.substr(0, path.size() - std::strlen(ending)) + locked, one.option.c_str());
    if (!fault.empty()) return fault;
  }
  return {};
}

/// A name that is too long for the temporary one under which its file is made; empty if there is none. Found at the start: a checkpoint is first
/// written when much has been computed. Of checkpoints MPI-IO makes names of its own ("_cid-6-12345.sm", Open MPI), which must find room as well.
std::string too_long(const RunFiles& files) {
  for (const Named& one : written(files)) {
    if (!one.given.empty() && ends_with(one.path, ".lock")) continue;
    std::string made;
    int handle = -1;
    if (create_fresh(real_name(one.path), ".tmp_cid-1000000-4194304.sm", &made, &handle) == ENAMETOOLONG)
      return one.text() + ": the name is too long for this file system: give a shorter " + one.option;
    if (handle < 0) continue;  // another fault, which unwritable() tells
    close(handle);
    (void)unlink(made.c_str());
  }
  return {};
}

bool is_regular(const std::string& path, bool* there) {
  struct stat status;
  *there = lstat(path.c_str(), &status) == 0;
  return *there && S_ISREG(status.st_mode);
}

/// Something that the program would replace without being asked, and did not write; empty if there is none.
std::string not_ours(const RunFiles& files) {
  const auto fault = [](const std::string& path, const char* what, const std::string& option, const std::string& remedy) {
    return path + " exists and is not " + what + " of this program's: move it away, or give another " + option + remedy;
  };
  bool there = false;
  const std::string sidecar = files.output + ".xdmf";
  if (!files.output.empty() && files.xdmf && !(is_regular(sidecar, &there) && is_sidecar(sidecar)) && there)
    return fault(sidecar, "a sidecar", "-bs_output", ", or -bs_output_xdmf false");
  std::vector<Named> kept;
  if (!files.checkpoint.empty()) kept.push_back({"-bs_checkpoint", real_name(files.checkpoint) + ".previous", "", false});
  else if (!files.output.empty())
    for (const char* ending : {".checkpoint", ".checkpoint.previous"}) kept.push_back({"-bs_output", files.output + ending, "", false});
  for (const Named& one : kept)
    if (!(is_regular(one.path, &there) && is_checkpoint(one.path)) && there) return fault(one.path, "a checkpoint", one.option, "");
  return {};
}

struct Output {
  const char* option;
  std::string path;
  bool overwrite;
};

/// What the options name, and the matrices.
std::vector<Output> outputs_of(const RunFiles& files) {
  const bool continued = !files.restart.empty() && is_checkpoint(files.checkpoint);
  std::vector<Output> all = {{"-bs_output", files.output, files.overwrite || files.resumes},
                             {"-bs_report", files.report, files.overwrite},
                             {"-bs_checkpoint", files.checkpoint, files.overwrite || continued}};
  for (const std::string& path : files.matrix_files) all.push_back({MATRICES, path, files.overwrite});
  all.erase(std::remove_if(all.begin(), all.end(), [](const Output& one) { return one.path.empty(); }), all.end());
  return all;
}

/// Takes the lock of every name that was given; one lock for all matrices.
std::string acquire_locks(const RunFiles& files, RunLock* lock, std::vector<std::string>* warnings) {
  std::string fault;
  for (const auto& [option, path] : {std::pair<const char*, std::string>{"-bs_output", files.output},
                                     {"-bs_report", files.report},
                                     {"-bs_checkpoint", files.checkpoint},
                                     {MATRICES, files.matrix_files.empty() ? "" : files.matrix_files[0]}}) {
    std::string warning;
    if (fault.empty() && !path.empty()) fault = lock->acquire(path, option, &warning);
    if (!warning.empty()) warnings->push_back(warning);
  }
  return fault;
}

/// Rank 0's part: what is wrong, or nothing.
std::string objection(const RunFiles& files, RunLock* lock, std::vector<std::string>* warnings) {
  const std::vector<Output> all = outputs_of(files);
  std::string fault = clash(files);
  for (const Output& one : all)
    if (fault.empty()) fault = unwritable(one.path, one.option, true);
  if (fault.empty()) fault = too_long(files);
  // whether they exist is asked with the locks in hand: another run may be about to make them, and says who it is
  if (fault.empty()) fault = acquire_locks(files, lock, warnings);
  if (fault.empty()) fault = claimed_by_others(files, lock);
  for (const Output& one : all)
    if (fault.empty()) fault = unwritable(one.path, one.option, one.overwrite);
  if (fault.empty()) fault = not_ours(files);
  if (fault.empty() && warnings->empty())
    for (const Output& one : all) remove_stale(real_name(one.path));
  return fault;
}

}  // namespace

bool is_checkpoint(const std::string& file) {
  bool there = false;
  if (file.empty() || !is_regular(real_name(file), &there)) return false;
  ReadingFile reading;
  reading.begin(file);
  if (H5Fis_hdf5(file.c_str()) <= 0) return false;
  const H5 opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  return opened >= 0 && fixed_text(opened, "/", "format") == "backspring checkpoint";
}

std::string OutputLocks::taken(const std::string& file) const {
  for (const std::vector<Named>& some : {written(files_), read_files(files_)})
    for (const Named& one : some)
      if (!one.restart && same_file(file, one.path)) return file + " and " + one.text() + " are one file: give another name";
  return {};
}

PetscErrorCode OutputLocks::acquire(MPI_Comm comm, const RunFiles& files) {
  Error fault;
  std::vector<std::string> warnings;
  PetscFunctionBegin;
  files_ = files;
  if (is_given("-help")) PetscFunctionReturn(0);
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0) fault.text = objection(files, &lock_, &warnings);
  const PetscErrorCode code = fail_if_any(comm, fault);
  if (code)  // PETSc writes some of them when the program ends, whyever it does
    for (const Named& view : viewed()) PetscCall(PetscOptionsClearValue(nullptr, view.option.c_str()));
  PetscCall(code);
  for (const std::string& warning : warnings) PetscCall(warn_here(comm, "unlocked_files", warning));
  PetscFunctionReturn(0);
}

}  // namespace bs
