// The datasets of a trajectory, made once with no rows.
#include <iterator>

#include "base/error.hpp"
#include "output/frame_file.hpp"
#include "output/h5md.hpp"

namespace bs {

namespace {

/// While it lives, datasets get the chunk index of HDF5 1.10 (an extensible array): it grows at its end, where the older
/// B-tree moves entries of finished frames from node to node, and a run killed between two nodes' writes would lose them.
class ModernDatasets {
 public:
  explicit ModernDatasets(hid_t file) : file_(file) { (void)H5Fset_libver_bounds(file, H5F_LIBVER_V110, H5F_LIBVER_LATEST); }
  ModernDatasets(const ModernDatasets&) = delete;
  ModernDatasets& operator=(const ModernDatasets&) = delete;
  ~ModernDatasets() { (void)H5Fset_libver_bounds(file_, H5F_LIBVER_EARLIEST, H5F_LIBVER_LATEST); }

 private:
  hid_t file_;
};

}  // namespace

PetscErrorCode Trajectory::Impl::put_unit(const std::string& dataset, const std::string& quantity, const Powers& powers) {
  std::string unit = unit_of(powers, options.units);

  PetscFunctionBegin;
  if (unit.empty()) unit = unit_of_quantity(quantity, options.units);
  if (unit.empty()) PetscFunctionReturn(0);
  H5 set(H5Dopen2(file, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  PetscCall(put_attribute(set, "unit", unit));
  PetscFunctionReturn(0);
}

std::vector<std::string> log_columns() {
  std::vector<std::string> names(std::begin(STEP_COLUMNS), std::end(STEP_COLUMNS));
  for (const RejectionReason& reason : REJECTION_REASONS) names.push_back(std::string("rejected_") + reason.key);
  return names;
}

PetscErrorCode Trajectory::Impl::create_log() {
  H5 group;

  PetscFunctionBegin;
  PetscCall(open_group(file, "/backspring/log", &group));
  const ModernDatasets modern(file);
  for (const std::string& name : log_columns()) {
    const bool real = name == "time" || name == "dt";
    log.emplace_back();
    PetscCall(log.back().create(io, file, "/backspring/log/" + name, !real, 0, column_chunk));
    if (real && options.units != OutputUnits::none) PetscCall(put_attribute(log.back().id(), "unit", unit_of_quantity("time", options.units)));
  }
  PetscFunctionReturn(0);
}

/// GROUP/step and GROUP/time: made in the first group, hard links to those in the others.
PetscErrorCode Trajectory::Impl::link_clock(const std::string& group) {
  H5 owner;

  PetscFunctionBegin;
  PetscCall(open_group(file, group, &owner));
  if (step.id() < 0) {
    const int chunk = shared ? shared_clock_chunk : column_chunk;
    PetscCall(step.create(io, file, group + "/step", true, 0, chunk));
    PetscCall(time.create(io, file, group + "/time", false, 0, chunk));
    if (options.units != OutputUnits::none) PetscCall(put_attribute(time.id(), "unit", unit_of_quantity("time", options.units)));
  } else {
    BS_H5(H5Lcreate_hard(step.id(), ".", owner, "step", H5P_DEFAULT, H5P_DEFAULT));
    BS_H5(H5Lcreate_hard(time.id(), ".", owner, "time", H5P_DEFAULT, H5P_DEFAULT));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::lay_out() {
  PetscFunctionBegin;
  const ModernDatasets modern(file);
  for (FieldColumn& field : fields) {
    PetscCall(link_clock(field.group()));
    PetscCall(field.create(file, single));
    PetscCall(put_unit(field.group() + "/value", field.group().substr(field.group().rfind('/') + 1), field.powers()));
  }
  for (ObservableColumn& o : observables) {
    const std::string group = o.group();
    PetscCall(link_clock(group));
    PetscCall(o.column.create(io, file, group + "/value", false, o.width == 1 && o.columns == 0 && o.name != BOX_EDGES ? 0 : o.width, column_chunk,
                              o.columns));
    PetscCall(put_unit(group + "/value", o.name, {}));
  }
  if (columns > 0 && !fields.empty() && options.boundary.empty()) {
    PetscCall(link_clock("/particles/trajectory/box/edges"));
    PetscCall(edges.create(io, file, "/particles/trajectory/box/edges/value", false, columns, column_chunk));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
