#include <set>
#include <vector>
#include "base/fault.hpp"
#include "checkpoint/checkpoint.hpp"
#include "checkpoint/row_sum.hpp"
#include "output/h5.hpp"
#include "output/h5md.hpp"

namespace bs {
namespace {

constexpr std::size_t longest_text = 65536;

/// One scalar attribute into `facts`; others are passed over.
herr_t keep_attribute(hid_t object, const char* name, const H5A_info_t*, void* data) {
  Facts& facts = *static_cast<Facts*>(data);
  const Hdf5Id attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute) return -1;
  const Hdf5Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
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

/// The attributes of `group`; false if it is not there or damaged.
bool attributes_of(hid_t file, const char* group, Facts* facts) {
  const Hdf5Id object(H5Gopen2(file, group, H5P_DEFAULT), H5Gclose);
  return object && H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, keep_attribute, facts) >= 0;
}

template <class Map>
typename Map::mapped_type get(const Map& map, const char* name) {
  const auto at = map.find(name);
  return at == map.end() ? typename Map::mapped_type() : at->second;
}

/// Options that say where a run reads and writes, not what it computes.
bool of_this_run_only(const std::string& name) {
  static const std::set<std::string> names = {"bs_restart", "bs_overwrite", "options_file", "help", "bs_version", "bs_trace", "options_left"};
  return names.count(name) > 0;
}

bool harmless(const std::string& name) {
  for (const char* begin : {"bs_output", "bs_checkpoint", "bs_progress", "bs_report", "ts_max_time", "ts_max_steps", "log_"})
    if (name.rfind(begin, 0) == 0) return true;
  return name.find("monitor") != std::string::npos || name.find("view") != std::string::npos || of_this_run_only(name);
}

}  // namespace

PetscErrorCode CheckpointFile::damaged(const std::string& what) const {
  PetscFunctionBegin;
  PetscCall(tell(comm_, Exit::input, name_ + ": " + what + ": give " + previous_checkpoint(name_) + ", if it is there, or start anew"));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckpointFile::open(MPI_Comm comm, const std::string& file) {
  Facts root, options;
  PetscFunctionBegin;
  comm_ = comm;
  name_ = file;
  PetscCall(file_.open(comm, file));
  // what the ranks find is the same: they read one file
  if (!attributes_of(file_.id(), "/", &root)) PetscCall(damaged("damaged"));
  if (get(root.text, "format") != "backspring checkpoint")
    PetscCall(tell(comm, Exit::input, file + ": is no checkpoint: give -bs_restart a file that -bs_checkpoint wrote"));
  const std::int64_t version = get(root.whole, "version");
  if (version > CHECKPOINT_VERSION)
    PetscCall(tell(comm, Exit::input, format("%s: a checkpoint of version %lld, by %s; this program reads up to version %lld: use a newer one",
                   file.c_str(), static_cast<long long>(version), get(root.text, "program").c_str(), static_cast<long long>(CHECKPOINT_VERSION))));
  if (version < 1 || !attributes_of(file_.id(), "/run", &run_) || !attributes_of(file_.id(), "/options", &options)) PetscCall(damaged("damaged"));
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
  if (!attributes_of(file_.id(), "/system", &system)) PetscCall(damaged("damaged"));
  PetscCall(VecGetSize(model.initial_state(), &size));
  PetscCall(model.fingerprint(&fingerprint));
  if (get(system.text, "model") != model.name())
    what = "of a model of kind " + get(system.text, "model") + ", not " + model.name();
  else if (get(system.whole, "dimension") != model.dim())
    what = format("of a lattice in %lld dimensions, not %d", static_cast<long long>(get(system.whole, "dimension")), model.dim());
  else if (get(system.whole, "unknowns") != size)
    what = model.dim() > 0 ? format("of %lld particles, not %lld", static_cast<long long>(get(system.whole, "unknowns") / (std::int64_t{2} * model.dim())),
                                    static_cast<long long>(size / (std::int64_t{2} * model.dim())))
                           : format("of a system of %lld unknowns, not %lld", static_cast<long long>(get(system.whole, "unknowns")), static_cast<long long>(size));
  else if (static_cast<std::uint64_t>(get(system.whole, "fingerprint")) != fingerprint)
    what = model.dim() > 0 ? "of another lattice of the same size: a particle, spring or law of the springs has changed"
                           : "of another system of the same size: G, C, B or a source's column has changed";
  if (!what.empty())
    PetscCall(tell(comm_, Exit::input, name_ + ": is the checkpoint " + what + ": continue with the input it was written for, or start anew"));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckpointFile::read(Model& model, const std::string& group, Vec y) const {
  std::vector<StatePart> parts;
  RowSum sum;
  Facts facts;
  PetscFunctionBegin;
  PetscCall(model.gather_state(y, &parts));  // for their vectors
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
    PetscScalar* ay = nullptr;
    PetscCall(VecGetArrayWrite(parts[k].vec, &ay));
    std::copy(rows.begin(), rows.end(), ay);
    PetscCall(VecRestoreArrayWrite(parts[k].vec, &ay));
  }
  std::uint64_t all = sum.value();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_UINT64_T, MPI_SUM, comm_));
  if (!attributes_of(file_.id(), group.c_str(), &facts)) PetscCall(damaged("damaged"));
  if (static_cast<std::uint64_t>(get(facts.whole, "checksum")) != all) PetscCall(damaged(group + " does not match its checksum"));
  PetscCall(model.scatter_state(y));
  PetscFunctionReturn(0);
}

PetscErrorCode recall_options(MPI_Comm comm) {
  char file[PETSC_MAX_PATH_LEN] = "";
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-bs_restart", file, sizeof file, &given));
  if (!given || !*file) PetscFunctionReturn(0);
  CheckpointFile checkpoint;
  PetscCall(checkpoint.open(comm, file));
  for (const auto& [name, value] : checkpoint.options()) {
    PetscBool there = PETSC_FALSE;
    const std::string key = "-" + name;
    if (of_this_run_only(name)) continue;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, key.c_str(), &there));
    if (!there) PetscCall(PetscOptionsSetValue(nullptr, key.c_str(), value.empty() ? nullptr : value.c_str()));
  }
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
    PetscCall(warn(comm, "the run goes on with -" + name + " " + value + "; it was " + (old.empty() ? "given without a value" : old) + " when " + file.name() + " was written"));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
