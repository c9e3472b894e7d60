// The datasets of a trajectory, made once with no rows.
#include <algorithm>

#include "base/fault.hpp"
#include "output/frame_file.hpp"
#include "output/h5md.hpp"

namespace bs {

namespace {

constexpr hsize_t chunk_numbers = hsize_t(1) << 26;  // of a field; HDF5 takes less than 4 GB

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

PetscErrorCode Trajectory::Impl::put_unit(const std::string& dataset, const std::string& quantity) {
  const std::string unit = unit_of_quantity(quantity, options.units);

  PetscFunctionBegin;
  if (unit.empty()) PetscFunctionReturn(0);
  H5 set(H5Dopen2(file, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  PetscCall(put_attribute(set, "unit", unit));
  PetscFunctionReturn(0);
}

PetscInt Trajectory::Impl::width_of(const std::string& group, PetscInt block) const {
  return group.rfind("/particles/trajectory/", 0) == 0 ? std::max<PetscInt>(block, columns) : block;
}

/// GROUP/value as PETSc's viewer would make it, (T, rows, width) with a chunk a frame, but not filled with zeros first.
PetscErrorCode Trajectory::Impl::create_values(const Field& field) {
  PetscInt size, block;
  PetscBool single;

  PetscFunctionBegin;
  PetscCall(VecGetSize(field.vec, &size));
  PetscCall(VecGetBlockSize(field.vec, &block));
  PetscCall(PetscViewerHDF5GetSPOutput(viewer, &single));
  const hsize_t rows = static_cast<hsize_t>(size / block), width = static_cast<hsize_t>(width_of(field.group, block));
  const hsize_t extent[3] = {1, rows, width}, most[3] = {H5S_UNLIMITED, rows, width};
  const hsize_t chunk[3] = {1, std::max<hsize_t>(1, std::min(rows, chunk_numbers / width)), width};
  const int axes = field.flat && block == 1 ? 2 : 3;
  const std::string path = field.group + "/value";
  H5 space(H5Screate_simple(axes, extent, most), H5Sclose), list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  BS_H5(space);
  BS_H5(H5Pset_chunk(list, axes, chunk));
  BS_H5(H5Pset_fill_time(list, H5D_FILL_TIME_NEVER));
  values.emplace_back(H5Dcreate2(file, path.c_str(), single ? H5T_IEEE_F32LE : H5T_IEEE_F64LE, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose);
  BS_H5(values.back());
  PetscCall(put_unit(path, field.group.substr(field.group.rfind('/') + 1)));
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
    PetscCall(log.back().create(comm, file, "/backspring/log/" + name, !real, 0, log_chunk));
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
    PetscCall(step.create(comm, file, group + "/step", true, 0, frame_chunk));
    PetscCall(time.create(comm, file, group + "/time", false, 0, frame_chunk));
    if (options.units != OutputUnits::none) PetscCall(put_attribute(time.id(), "unit", unit_of_quantity("time", options.units)));
  } else {
    BS_H5(H5Lcreate_hard(step.id(), ".", owner, "step", H5P_DEFAULT, H5P_DEFAULT));
    BS_H5(H5Lcreate_hard(time.id(), ".", owner, "time", H5P_DEFAULT, H5P_DEFAULT));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::lay_out(const std::vector<Field>& fields, const std::vector<Observable>& given) {
  PetscFunctionBegin;
  const ModernDatasets modern(file);
  for (const Field& field : fields) {
    PetscCall(link_clock(field.group));
    groups.push_back(field.group);
    padded.emplace_back();
    PetscCall(create_values(field));
  }
  for (const Observable& observable : given) {
    const std::string group = "/observables/" + observable.name;
    const int width = observable.value.size() == 1 ? 0 : static_cast<int>(observable.value.size());
    PetscCall(link_clock(group));
    names.push_back(observable.name);
    observables.emplace_back();
    PetscCall(observables.back().create(comm, file, group + "/value", false, width, frame_chunk));
    PetscCall(put_unit(group + "/value", observable.name));
  }
  if (columns > 0 && !fields.empty()) {
    PetscCall(link_clock("/particles/trajectory/box/edges"));
    PetscCall(edges.create(comm, file, "/particles/trajectory/box/edges/value", false, columns, frame_chunk));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
