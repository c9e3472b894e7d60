#include <algorithm>
#include <vector>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/hash.hpp"
#include "base/vec_array.hpp"
#include "checkpoint/checkpoint.hpp"
#include "output/h5.hpp"

namespace bs {

namespace {

constexpr std::size_t longest_text = 65536;

/// Reads one scalar attribute into `facts`; attributes of other kinds are skipped.
herr_t keep_attribute(hid_t object, const char* name, const H5A_info_t*, void* data) {
  Facts& facts = *static_cast<Facts*>(data);
  const H5 attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute) return -1;
  const H5 type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (!type || !space || H5Sget_simple_extent_npoints(space) != 1) return 0;
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_INTEGER) return H5Aread(attribute, H5T_NATIVE_INT64, &facts.whole[name]);
  if (kind == H5T_FLOAT) return H5Aread(attribute, H5T_NATIVE_DOUBLE, &facts.real[name]);
  const std::size_t size = H5Tget_size(type);
  if (kind != H5T_STRING || H5Tis_variable_str(type) != 0 || size > longest_text) return 0;
  std::vector<char> text(size + 1, '\0');
  if (H5Aread(attribute, type, text.data()) < 0) return -1;
  facts.text[name] = text.data();
  return 0;
}

/// Reads the attributes of `group`; false if the group is missing or damaged.
bool attributes_of(const Hdf5File& file, const char* group, Facts* facts) {
  const H5 object = file.group(group);
  return object && H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, keep_attribute, facts) >= 0;
}

/// Reads the values of /options that are too long for attributes and stand in datasets of one text. `bytes` is the size of the file: a longer text is
/// a sign of damage.
bool long_texts_of(const Hdf5File& file, const std::string& group, std::int64_t bytes, Facts* facts) {
  for (const std::string& name : file.members(group)) {
    const H5 owner = file.group(group);
    H5L_info_t link;
    if (!owner || H5Lget_info(owner, name.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
    const H5 set(H5Dopen2(owner, name.c_str(), H5P_DEFAULT), H5Dclose);
    if (!set) return false;
    const H5 type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose), list(H5Dget_create_plist(set), H5Pclose);
    if (!type || !space || !list || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0) return false;
    const std::size_t size = H5Tget_size(type);
    if (H5Pget_layout(list) != H5D_CONTIGUOUS || H5Pget_external_count(list) != 0 || H5Sget_simple_extent_npoints(space) != 1 ||
        static_cast<std::int64_t>(size) > bytes)
      return false;
    std::vector<char> text(size + 1, '\0');
    if (H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0) return false;
    facts->text[name] = text.data();
  }
  return true;
}

template <class Map>
typename Map::mapped_type get(const Map& map, const char* name) {
  const auto at = map.find(name);
  return at == map.end() ? typename Map::mapped_type() : at->second;
}

}  // namespace

PetscErrorCode CheckpointFile::damaged(const std::string& what) const {
  return fail(comm_, Exit::input, name_ + ": " + what + ": give " + previous_checkpoint(name_) + ", if it exists, or start a new run");
}

PetscErrorCode CheckpointFile::open(MPI_Comm comm, const std::string& file) {
  Facts root, options;
  PetscFunctionBegin;
  comm_ = comm;
  name_ = file;
  PetscCall(file_.open(comm, file));
  // all ranks read the same file and so find the same errors
  if (!attributes_of(file_, "/", &root)) PetscCall(damaged("damaged"));
  if (get(root.text, "format") != "backspring checkpoint")
    PetscCall(fail(comm, Exit::input, file + ": is not a checkpoint: give -bs_restart a file that -bs_checkpoint wrote"));
  const std::int64_t version = get(root.whole, "version");
  if (version > CHECKPOINT_VERSION)
    PetscCall(fail(comm, Exit::input,
                   format("%s: a checkpoint of version %lld, written by %s; this program reads up to version %lld: use a newer one", file.c_str(),
                          static_cast<long long>(version), get(root.text, "program").c_str(), static_cast<long long>(CHECKPOINT_VERSION))));
  if (version < 1 || !attributes_of(file_, "/run", &run_) || !attributes_of(file_, "/options", &options) ||
      !long_texts_of(file_, "/options", file_.bytes(), &options))
    PetscCall(damaged("damaged"));
  for (const auto& [group, facts] : {std::pair<std::string, const Facts*>{"run", &run_}, {"options", &options}})
    if (get(root.whole, (group + "_checksum").c_str()) != checksum(*facts)) PetscCall(damaged("/" + group + " does not match its checksum"));
  options_.assign(options.text.begin(), options.text.end());
  PetscFunctionReturn(0);
}

PetscErrorCode CheckpointFile::require_same(Model& model) const {
  Facts system;
  PetscInt size;
  std::uint64_t fingerprint;
  std::string what;
  PetscFunctionBegin;
  if (!attributes_of(file_, "/system", &system)) PetscCall(damaged("damaged"));
  PetscCall(VecGetSize(model.initial_state(), &size));
  PetscCall(model.fingerprint(&fingerprint));
  if (get(system.text, "model") != model.name()) what = "of a model of kind " + get(system.text, "model") + ", not " + model.name();
  else if (get(system.whole, "dimension") != model.dim())
    what = "of a lattice in " + how_many(get(system.whole, "dimension"), "dimension") + format(", not %d", model.dim());
  else if (get(system.whole, "unknowns") != size)
    what = model.dim() > 0
               ? "of " + how_many(get(system.whole, "unknowns") / (std::int64_t{2} * model.dim()), "particle") +
                     format(", not %lld", static_cast<long long>(size / (std::int64_t{2} * model.dim())))
               : "of a system of " + how_many(get(system.whole, "unknowns"), "unknown") + format(", not %lld", static_cast<long long>(size));
  else if (static_cast<std::uint64_t>(get(system.whole, "fingerprint")) != fingerprint)
    what = model.dim() > 0 ? "of another lattice of the same size: a particle, spring or law of the springs has changed"
                           : "of another system of the same size: G, C, B or a source's column has changed";
  else if (get(system.whole, FORCED_OUTSIDE) != 0 && !forced_outside(model))
    what = "of a run with forces that a caller of the library computed, which are in no file and not given now";
  if (!what.empty())
    PetscCall(fail(comm_, Exit::input, name_ + ": is the checkpoint " + what + ": continue with the input it was written for, or start a new run"));
  PetscFunctionReturn(0);
}

PetscErrorCode Checkpoint::read(Model& model, const std::string& group, Vec y) const {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(model.gather_state(y, &parts));  // only for the vectors that are read into
  PetscCall(read_parts(model.comm(), group, parts));
  PetscCall(model.scatter_state(y));
  PetscFunctionReturn(0);
}

/// Ends the run with exit code 2 where this run has histories, or parts that may break, that the run of the checkpoint did not have.
PetscErrorCode CheckpointFile::require_memory(const std::vector<StatePart>& parts) const {
  std::vector<ChangedOption> changed;
  std::vector<std::string> options;
  std::string joined;
  PetscFunctionBegin;
  const std::vector<std::string> kept = file_.has("/memory") ? file_.members("/memory") : std::vector<std::string>{};
  const auto lost =
      std::find_if(parts.begin(), parts.end(), [&](const StatePart& part) { return std::find(kept.begin(), kept.end(), part.name) == kept.end(); });
  if (lost == parts.end()) PetscFunctionReturn(0);
  PetscCall(changed_options(*this, &changed));
  for (const ChangedOption& option : changed)
    if (option.name.rfind("bs_break", 0) == 0 && option.was == NOT_GIVEN) options.push_back("-" + option.name);
  for (const std::string& one : options) joined += (joined.empty() ? "" : ", ") + one;
  const std::string it = options.size() > 1 ? "them" : "it";
  if (!options.empty() && lost->name.rfind("break", 0) == 0)
    PetscCall(fail(comm_, Exit::input,
                   "option " + joined + ": " + name_ + " is the checkpoint of a run without " + it + ", in which that could not break: leave " + it +
                       " out, or start a new run"));
  PetscCall(fail(comm_, Exit::input,
                 name_ + ": is the checkpoint of a run that did not remember " + lost->name +
                     ", as this one does: continue with the input it was written for, or start a new run"));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckpointFile::read_memory(Model& model) const {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(model.gather_memory(&parts));  // only for the vectors that are read into
  PetscCall(require_memory(parts));
  if (parts.empty()) PetscFunctionReturn(0);
  PetscCall(read_parts(model.comm(), "/memory", parts));
  PetscCall(model.scatter_memory());
  PetscFunctionReturn(0);
}

PetscErrorCode CheckpointFile::read_parts(MPI_Comm, const std::string& group, const std::vector<StatePart>& parts) const {
  RowSum sum;
  Facts facts;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    PetscInt first, last, total, columns;
    PetscCall(VecGetOwnershipRange(parts[k].vec, &first, &last));
    PetscCall(VecGetSize(parts[k].vec, &total));
    PetscCall(VecGetBlockSize(parts[k].vec, &columns));
    TableShape shape;
    shape.rows = total / columns;
    shape.columns = static_cast<int>(columns);
    Table table;
    std::vector<double> rows;
    PetscCall(file_.find(group + "/" + parts[k].name, shape, &table));
    PetscCall(file_.require_data(table));
    PetscCall(file_.read(table, first / columns, (last - first) / columns, 0, &rows));
    sum.add(k, first / columns, static_cast<int>(columns), rows);
    std::copy(rows.begin(), rows.end(), WriteArray(parts[k].vec).data());
  }
  std::uint64_t all = sum.value();
  PetscCall(sum_over_ranks(comm_, &all));
  if (!attributes_of(file_, group.c_str(), &facts)) PetscCall(damaged("damaged"));
  if (static_cast<std::uint64_t>(get(facts.whole, "checksum")) != all) PetscCall(damaged(group + " does not match its checksum"));
  PetscFunctionReturn(0);
}

PetscErrorCode KeptCheckpoint::keep(Model& model, const Facts& run, const std::vector<NamedState>& states) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  name_ = "the saved state";
  run_ = run;
  states_.clear();
  for (const NamedState& one : states) {
    PetscCall(model.gather_state(one.vec, &parts));
    PetscCall(bs::read_parts(model.comm(), parts, false, &states_[one.group]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode KeptCheckpoint::read_parts(MPI_Comm comm, const std::string& group, const std::vector<StatePart>& parts) const {
  PetscFunctionBegin;
  PetscCall(put_parts(comm, states_.at(group), false, parts));
  PetscFunctionReturn(0);
}

}  // namespace bs
