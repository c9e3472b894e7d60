#include <unistd.h>
#include <cerrno>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/hash.hpp"
#include "base/option_names.hpp"
#include "base/recalled_options.hpp"
#include "base/version.hpp"
#include "checkpoint/checkpoint.hpp"
#include "output/fresh_file.hpp"
#include "output/h5.hpp"
#include "output/tables.hpp"
#include "systems/frame_rows.hpp"
#include "systems/mechanics.hpp"

namespace bs {

std::string previous_checkpoint(const std::string& file) { return file + ".previous"; }

namespace {

/// GROUP/<part> of every part, GROUP's attribute `checksum`.
PetscErrorCode write_parts(MPI_Comm comm, hid_t file, const std::string& name, const std::vector<StatePart>& parts) {
  H5 group;
  RowSum sum;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    PetscInt first, last, total, columns;
    std::vector<double> rows;
    PetscCall(VecGetOwnershipRange(parts[k].vec, &first, &last));
    PetscCall(VecGetSize(parts[k].vec, &total));
    PetscCall(VecGetBlockSize(parts[k].vec, &columns));
    PetscCall(own_numbers(parts[k].vec, &rows));
    sum.add(k, first / columns, static_cast<int>(columns), rows);
    PetscCall(write_table(file, {name + "/" + parts[k].name, first / columns, total / columns, static_cast<int>(columns), std::move(rows)}));
  }
  std::uint64_t all = sum.value();
  PetscCall(sum_over_ranks(comm, &all));
  PetscCall(open_group(file, name, &group));
  PetscCall(put_attribute(group, "checksum", static_cast<std::int64_t>(all)));
  PetscFunctionReturn(0);
}

/// /options: a value that an attribute cannot hold (64 kB) is a dataset of one text.
PetscErrorCode write_options(hid_t file, MPI_Comm comm, const Facts& table) {
  constexpr std::size_t longest = 60000;
  H5 given;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  PetscCall(open_group(file, "/options", &given));
  for (const auto& [name, value] : table.text) {
    if (value.size() <= longest) {
      PetscCall(put_text(given, name.c_str(), value));
      continue;
    }
    PetscCall(write_table(file, {"/options/" + name, 0, 1, 0, Words{value.size(), rank == 0 ? value : std::string()}}));
  }
  PetscFunctionReturn(0);
}

}  // namespace

bool forced_outside(Model& model) {
  Mechanics* const mechanics = model.mechanics();
  return mechanics && mechanics->forced_outside();
}

namespace {

PetscErrorCode write_facts(hid_t file, Model& model, const Facts& run) {
  H5 root, group;
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
  PetscCall(put_text(root, "program", std::string("backspring ") + version()));
  PetscCall(open_group(file, "/system", &group));
  PetscCall(put_text(group, "model", model.name()));
  PetscCall(put_attribute(group, "dimension", static_cast<std::int64_t>(model.dim())));
  PetscCall(put_attribute(group, "unknowns", static_cast<std::int64_t>(size)));
  PetscCall(put_attribute(group, "fingerprint", static_cast<std::int64_t>(fingerprint)));
  if (forced_outside(model)) PetscCall(put_attribute(group, FORCED_OUTSIDE, std::int64_t{1}));
  PetscCall(open_group(file, "/run", &group));
  for (const auto& [name, value] : run.real) PetscCall(put_attribute(group, name.c_str(), value));
  for (const auto& [name, value] : run.whole) PetscCall(put_attribute(group, name.c_str(), value));
  for (const auto& [name, value] : run.text) PetscCall(put_text(group, name.c_str(), value));
  PetscCall(options_in_force(&options));
  for (const auto& [name, value] : options)
    if (!of_this_run_only(name)) table.text[name] = value_to_save(model.comm(), "-" + name, value);
  PetscCall(write_options(file, model.comm(), table));
  PetscCall(put_attribute(root, "run_checksum", checksum(run)));
  PetscCall(put_attribute(root, "options_checksum", checksum(table)));
  PetscFunctionReturn(0);
}

/// Puts `made` in the place of `file`, which goes on as `before`. errno; 0: done.
int replace_checkpoint(const std::string& made, const std::string& file, const std::string& before) {
  // a second name for the old one, under which it takes the place of the one before: both are there at every moment. Where a
  // file system has no links the old one is renamed, with a moment in which only `before` is there.
  std::string second;
  int handle = -1;
  if (const int why = create_fresh(before, ".tmp", &second, &handle)) return why;
  close(handle);
  (void)unlink(second.c_str());  // the name is free and was unpredictable
  if (link(file.c_str(), second.c_str()) == 0) {
    const int why = rename(second.c_str(), before.c_str()) == 0 ? 0 : errno;
    (void)unlink(second.c_str());  // renaming one name of a file to another of its names leaves both
    if (why) return why;
  } else if (errno != ENOENT && rename(file.c_str(), before.c_str()) != 0) {
    return errno;
  }
  if (rename(made.c_str(), file.c_str()) != 0) return errno;
  (void)bring_to_disk(folder_of(file));  // some file systems refuse
  return 0;
}

}  // namespace

PetscErrorCode write_checkpoint(Model& model, const std::string& file, const Facts& run, const std::vector<NamedState>& states) {
  const std::string target = real_name(file);
  PetscInt size;
  std::vector<StatePart> memory;
  PetscFunctionBegin;
  PetscCall(VecGetSize(model.initial_state(), &size));
  std::int64_t bytes = 262144 + 8 * static_cast<std::int64_t>(states.size()) * size;
  PetscCall(model.gather_memory(&memory));
  for (const StatePart& part : memory) {
    PetscCall(VecGetSize(part.vec, &size));
    bytes += std::int64_t{8} * size;
  }
  const auto fill = [&](hid_t file) {
    std::vector<StatePart> parts;
    PetscFunctionBegin;
    PetscCall(write_facts(file, model, run));
    for (const NamedState& state : states) {
      PetscCall(model.gather_state(state.vec, &parts));
      for (const StatePart& part : parts) PetscCall(require_finite(model.comm(), state.group + "/" + part.name, part.vec));
      PetscCall(write_parts(model.comm(), file, state.group, parts));
    }
    for (const StatePart& part : memory) PetscCall(require_finite(model.comm(), "/memory/" + part.name, part.vec));
    if (!memory.empty()) PetscCall(write_parts(model.comm(), file, "/memory", memory));
    PetscFunctionReturn(PetscErrorCode(0));
  };
  const IoWatch watch(model.comm(), "cannot write the checkpoint " + file, ": the one before it is intact");
  PetscCall(write_whole_hdf5(model.comm(), watch, target, bytes, fill,
                             [&](const std::string& made) { return replace_checkpoint(made, target, previous_checkpoint(target)); }));
  PetscFunctionReturn(0);
}

}  // namespace bs
