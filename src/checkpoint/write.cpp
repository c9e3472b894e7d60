#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include "base/fault.hpp"
#include "checkpoint/checkpoint.hpp"
#include "checkpoint/row_sum.hpp"
#include "output/h5.hpp"
#include "output/h5md.hpp"
#include "output/io_watch.hpp"
#include "output/space.hpp"
#include "output/tables.hpp"

namespace bs {

std::string previous_checkpoint(const std::string& file) { return file + ".previous"; }

namespace {

/// GROUP/<part> of every part, GROUP's attribute `checksum`.
PetscErrorCode write_state(Model& model, hid_t file, const NamedState& state) {
  std::vector<StatePart> parts;
  H5 group;
  RowSum sum;
  PetscFunctionBegin;
  PetscCall(model.gather_state(state.vec, &parts));
  for (std::size_t k = 0; k < parts.size(); ++k) {
    PetscInt first, last, total, columns;
    const PetscScalar* ay = nullptr;
    PetscCall(VecGetOwnershipRange(parts[k].vec, &first, &last));
    PetscCall(VecGetSize(parts[k].vec, &total));
    PetscCall(VecGetBlockSize(parts[k].vec, &columns));
    PetscCall(VecGetArrayRead(parts[k].vec, &ay));
    Dataset table{state.group + "/" + parts[k].name, first / columns, total / columns, static_cast<int>(columns),
                  std::vector<double>(ay, ay + (last - first))};
    PetscCall(VecRestoreArrayRead(parts[k].vec, &ay));
    sum.add(k, first / columns, static_cast<int>(columns), std::get<std::vector<double>>(table.rows));
    PetscCall(write_table(file, table));
  }
  std::uint64_t all = sum.value();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_UINT64_T, MPI_SUM, model.comm()));
  PetscCall(open_group(file, state.group, &group));
  PetscCall(put_attribute(group, "checksum", static_cast<std::int64_t>(all)));
  PetscFunctionReturn(0);
}

PetscErrorCode write_facts(hid_t file, Model& model, const Facts& run) {
  H5 root, group, given;
  Facts table;
  std::uint64_t fingerprint;
  std::vector<std::pair<std::string, std::string>> options;
  PetscInt size;
  PetscFunctionBegin;
  PetscCall(model.fingerprint(&fingerprint));
  PetscCall(VecGetSize(model.initial_state(), &size));
  PetscCall(open_group(file, "/", &root));
  PetscCall(put_text(root, "format", "backspring checkpoint"));
  PetscCall(put_attribute(root, "version", CHECKPOINT_VERSION));
  PetscCall(put_text(root, "program", std::string("backspring ") + BS_VERSION));
  PetscCall(open_group(file, "/system", &group));
  PetscCall(put_text(group, "model", model.name()));
  PetscCall(put_attribute(group, "dimension", static_cast<std::int64_t>(model.dim())));
  PetscCall(put_attribute(group, "unknowns", static_cast<std::int64_t>(size)));
  PetscCall(put_attribute(group, "fingerprint", static_cast<std::int64_t>(fingerprint)));
  PetscCall(open_group(file, "/run", &group));
  for (const auto& [name, value] : run.real) PetscCall(put_attribute(group, name.c_str(), value));
  for (const auto& [name, value] : run.whole) PetscCall(put_attribute(group, name.c_str(), value));
  for (const auto& [name, value] : run.text) PetscCall(put_text(group, name.c_str(), value));
  PetscCall(options_in_force(&options));
  for (const auto& option : options) table.text[option.first] = option.second.substr(0, 60000);
  PetscCall(open_group(file, "/options", &given));
  for (const auto& [name, value] : table.text) PetscCall(put_text(given, name.c_str(), value));
  PetscCall(put_attribute(root, "run_checksum", checksum(run)));
  PetscCall(put_attribute(root, "options_checksum", checksum(table)));
  PetscFunctionReturn(0);
}

PetscErrorCode write_file(Model& model, const std::string& name, const Facts& run, const std::vector<NamedState>& states,
                          std::string* full) {
  PetscInt size;
  PetscFunctionBegin;
  PetscCall(VecGetSize(model.initial_state(), &size));
  H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  BS_H5(H5Pset_fapl_mpio(access, model.comm(), MPI_INFO_NULL));
  H5 file(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  BS_H5(file);
  const std::int64_t bytes = 262144 + 8 * static_cast<std::int64_t>(states.size()) * size;
  PetscCall(reserve_space(model.comm(), name, bytes, full));
  if (!full->empty()) PetscFunctionReturn(0);
  PetscCall(write_facts(file, model, run));
  for (const NamedState& state : states) PetscCall(write_state(model, file, state));
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  PetscFunctionReturn(0);
}

int sync(const std::string& path, int flags) {
  const int handle = open(path.c_str(), flags | O_CLOEXEC);
  if (handle < 0) return errno;
  const int result = fsync(handle) ? errno : 0;
  close(handle);
  return result;
}

/// Puts `made` in the place of `file`, which goes on as `before`. errno; 0: done.
int take_place(const std::string& made, const std::string& file, const std::string& before) {
  const auto slash = file.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : slash == 0 ? "/" : file.substr(0, slash);
  if (const int why = sync(made, O_RDWR)) return why;
  // a second name for the old one: `file` is there at every moment. Where a file system has no links it is copied by
  // renaming, with a moment in which only `before` is there.
  unlink(before.c_str());
  if (link(file.c_str(), before.c_str()) != 0 && errno != ENOENT && rename(file.c_str(), before.c_str()) != 0) return errno;
  if (rename(made.c_str(), file.c_str()) != 0) return errno;
  (void)sync(folder, O_RDONLY | O_DIRECTORY);  // some file systems refuse
  return 0;
}

}  // namespace

PetscErrorCode write_checkpoint(Model& model, const std::string& file, const Facts& run, const std::vector<NamedState>& states) {
  const std::string made = file + ".tmp";
  std::string full;
  PetscMPIInt rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm(), &rank));
  const IoWatch watch("cannot write the checkpoint " + file, ": the one before it is intact");
  PetscErrorCode code = write_file(model, made, run, states, &full);
  int why = 0;
  if (!code && full.empty() && rank == 0) why = take_place(made, file, previous_checkpoint(file));
  if (rank == 0 && (code || !full.empty() || why)) unlink(made.c_str());
  PetscCallMPI(MPI_Bcast(&why, 1, MPI_INT, 0, model.comm()));
  if (why) full = std::strerror(why);
  if (!code && !full.empty()) code = tell(model.comm(), Exit::io, watch.sentence(full));
  PetscCall(watch.settle(model.comm(), code));
  PetscFunctionReturn(0);
}

}  // namespace bs
