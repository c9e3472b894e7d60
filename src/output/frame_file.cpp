// How one frame reaches the file. Order (README.md): observables, log, edges; then the fields, each followed by
// PETSc's flush; step and time last, and a flush. So whoever trusts len(time) finds every row of every dataset.
#include "output/frame_file.hpp"

#include <iterator>

#include "base/fault.hpp"
#include "output/h5md.hpp"

namespace bs {

namespace {

constexpr int frame_chunk = 256;  // rows allocated at a time in datasets with one row a frame
constexpr int log_chunk = 512;

std::string last_part(const std::string& path) { return path.substr(path.rfind('/') + 1); }

bool of_particles(const std::string& group) { return group.rfind("/particles/trajectory/", 0) == 0; }

}  // namespace

PetscErrorCode Trajectory::Impl::begin(MPI_Comm on, const TrajectoryOptions& given, int dim) {
  PetscFunctionBegin;
  comm = on;
  options = given;
  columns = dim == 0 || given.pad == 0 ? dim : given.pad;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0 && given.xdmf && dim > 0) xdmf = Xdmf(given.file);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::open(const std::string& path, bool again) {
  PetscFunctionBegin;
  PetscCall(PetscViewerCreate(comm, viewer.out()));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERHDF5));
  PetscCall(PetscViewerFileSetMode(viewer, again ? FILE_MODE_UPDATE : FILE_MODE_WRITE));
  PetscCall(PetscViewerHDF5SetBaseDimension2(viewer, PETSC_TRUE));  // d = 1: (T, N, 1)
  PetscCall(PetscViewerSetFromOptions(viewer));                    // -viewer_hdf5_collective, -viewer_hdf5_sp_output
  PetscCall(PetscViewerFileSetName(viewer, path.c_str()));
  PetscCall(PetscViewerHDF5GetFileId(viewer, &file));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::create_log() {
  H5 group;

  PetscFunctionBegin;
  PetscCall(open_group(file, "/backspring/log", &group));
  for (const char* name : log_entries) {
    const bool real = std::string(name) == "time" || std::string(name) == "dt";
    log.emplace_back();
    PetscCall(log.back().create(comm, file, std::string("/backspring/log/") + name, !real, 0, log_chunk));
    if (real && options.units) PetscCall(put_attribute(log.back().id(), "unit", std::string("s")));
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
    if (options.units) PetscCall(put_attribute(time.id(), "unit", unit_of_quantity("time")));
  } else {
    BS_H5(H5Lcreate_hard(step.id(), ".", owner, "step", H5P_DEFAULT, H5P_DEFAULT));
    BS_H5(H5Lcreate_hard(time.id(), ".", owner, "time", H5P_DEFAULT, H5P_DEFAULT));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::lay_out(const std::vector<Field>& fields, const std::vector<Observable>& given) {
  PetscFunctionBegin;
  for (const Field& field : fields) {
    PetscCall(link_clock(field.group));
    groups.push_back(field.group);
    padded.emplace_back();
  }
  for (const Observable& observable : given) {
    const std::string group = "/observables/" + observable.name;
    const int width = observable.value.size() == 1 ? 0 : static_cast<int>(observable.value.size());
    PetscCall(link_clock(group));
    names.push_back(observable.name);
    observables.emplace_back();
    PetscCall(observables.back().create(comm, file, group + "/value", false, width, frame_chunk));
    if (options.units) PetscCall(put_unit(group + "/value", observable.name));
  }
  if (columns > 0 && !fields.empty()) {
    PetscCall(link_clock("/particles/trajectory/box/edges"));
    PetscCall(edges.create(comm, file, "/particles/trajectory/box/edges/value", false, columns, frame_chunk));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::check(const std::vector<Field>& fields, const std::vector<Observable>& given) const {
  PetscFunctionBegin;
  PetscCheck(fields.size() == groups.size() && given.size() == names.size(), PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "a frame needs the fields and observables of the first one");
  for (std::size_t i = 0; i < fields.size(); ++i)
    PetscCheck(fields[i].group == groups[i], PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "field %s where %s was",
               fields[i].group.c_str(), groups[i].c_str());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::size_t width = observables[i].width() > 0 ? static_cast<std::size_t>(observables[i].width()) : 1;
    PetscCheck(given[i].name == names[i] && given[i].value.size() == width, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
               "observable %s where %s was", given[i].name.c_str(), names[i].c_str());
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::frame_bytes(const std::vector<Field>& fields, const std::vector<Observable>& given,
                                             std::int64_t* bytes) const {
  std::int64_t pending = static_cast<std::int64_t>(records.size()), width = 0;

  PetscFunctionBegin;
  // Metadata, and a new chunk of the small datasets at once.
  *bytes = 131072 + 48 * (pending + log_chunk);
  for (const Observable& observable : given) width += static_cast<std::int64_t>(observable.value.size());
  *bytes += std::int64_t{8} * frame_chunk * (width + columns + 2);
  for (const Field& field : fields) {
    PetscInt size, block;
    PetscCall(VecGetSize(field.vec, &size));
    PetscCall(VecGetBlockSize(field.vec, &block));
    const std::int64_t rows = size / block;
    *bytes += 8 * rows * (of_particles(field.group) && columns > block ? columns : block);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::put_unit(const std::string& dataset, const std::string& quantity) {
  const std::string unit = unit_of_quantity(quantity);

  PetscFunctionBegin;
  if (unit.empty()) PetscFunctionReturn(0);
  H5 set(H5Dopen2(file, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  PetscCall(put_attribute(set, "unit", unit));
  PetscFunctionReturn(0);
}

/// `vec` with zero components appended to each row, where the file has more columns than it has components.
PetscErrorCode Trajectory::Impl::pad(std::size_t index, Vec vec, Vec* out) {
  PetscInt block, local;
  const PetscScalar* from;
  PetscScalar* to;

  PetscFunctionBegin;
  *out = vec;
  PetscCall(VecGetBlockSize(vec, &block));
  if (!of_particles(groups[index]) || block >= columns) PetscFunctionReturn(0);
  PetscCall(VecGetLocalSize(vec, &local));
  const PetscInt rows = local / block, wide = columns;
  if (!padded[index]) {
    PetscCall(VecCreate(comm, padded[index].out()));
    PetscCall(VecSetSizes(padded[index], rows * wide, PETSC_DETERMINE));
    PetscCall(VecSetBlockSize(padded[index], wide));
    PetscCall(VecSetType(padded[index], VECSTANDARD));
    PetscCall(VecSet(padded[index], 0));
  }
  PetscCall(VecGetArrayRead(vec, &from));
  PetscCall(VecGetArray(padded[index], &to));
  for (PetscInt i = 0; i < rows; ++i)
    for (PetscInt c = 0; c < block; ++c) to[i * wide + c] = from[i * block + c];
  PetscCall(VecRestoreArray(padded[index], &to));
  PetscCall(VecRestoreArrayRead(vec, &from));
  *out = padded[index];
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write_field(std::size_t index, const Field& field) {
  const char* name;
  Vec vec;

  PetscFunctionBegin;
  PetscCall(pad(index, field.vec, &vec));
  PetscCall(PetscObjectGetName(reinterpret_cast<PetscObject>(vec), &name));
  const std::string before = name;
  PetscCall(PetscObjectSetName(reinterpret_cast<PetscObject>(vec), "value"));
  PetscCall(PetscViewerHDF5PushGroup(viewer, field.group.c_str()));
  PetscCall(PetscViewerHDF5PushTimestepping(viewer));
  PetscCall(PetscViewerHDF5SetTimestep(viewer, static_cast<PetscInt>(frames)));
  PetscCall(PetscViewerHDF5SetBaseDimension2(viewer, field.flat ? PETSC_FALSE : PETSC_TRUE));
  PetscCall(VecView(vec, viewer));
  PetscCall(PetscViewerHDF5PopTimestepping(viewer));
  PetscCall(PetscViewerHDF5PopGroup(viewer));
  PetscCall(PetscObjectSetName(reinterpret_cast<PetscObject>(vec), before.c_str()));
  if (frames == 0 && options.units) PetscCall(put_unit(field.group + "/value", last_part(field.group)));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write_log() {
  std::vector<std::int64_t> whole(records.size());
  std::vector<double> real(records.size());
  std::int64_t count = static_cast<std::int64_t>(records.size());

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&count, 1, MPI_INT64_T, 0, comm));
  if (count == 0) PetscFunctionReturn(0);
  const auto append = [&](std::size_t column, auto member, auto& buffer) {
    for (std::size_t i = 0; i < records.size(); ++i) buffer[i] = records[i].*member;
    return log[column].append(count, buffer.data());
  };
  PetscCall(append(0, &StepRecord::step, whole));
  PetscCall(append(1, &StepRecord::time, real));
  PetscCall(append(2, &StepRecord::dt, real));
  PetscCall(append(3, &StepRecord::newton, whole));
  PetscCall(append(4, &StepRecord::krylov, whole));
  PetscCall(append(5, &StepRecord::rejected, whole));
  for (std::size_t k = 0; k < std::size(REJECTION_KEYS); ++k) {
    for (std::size_t i = 0; i < records.size(); ++i) whole[i] = records[i].reasons[k];
    PetscCall(log[6 + k].append(count, whole.data()));
  }
  records.clear();
  log_rows += count;
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write(std::int64_t at, double now, const std::vector<Field>& fields,
                                       const std::vector<Observable>& given) {
  const std::vector<double> open_box(static_cast<std::size_t>(columns), 0.0);

  PetscFunctionBegin;
  if (!laid_out) PetscCall(frames == 0 ? lay_out(fields, given) : find_layout(fields, given));
  laid_out = true;
  PetscCall(check(fields, given));
  for (std::size_t i = 0; i < given.size(); ++i) PetscCall(observables[i].append(1, given[i].value.data()));
  if (edges.id() >= 0) PetscCall(edges.append(1, open_box.data()));
  PetscCall(write_log());
  if (fields.empty()) BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  for (std::size_t i = 0; i < fields.size(); ++i) PetscCall(write_field(i, fields[i]));
  if (step.id() >= 0) {
    PetscCall(step.append(1, &at));
    PetscCall(time.append(1, &now));
  }
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  ++frames;
  last_time = now;
  PetscCall(write_xdmf(false));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write_xdmf(bool last) {
  std::string reason;

  PetscFunctionBegin;
  if (!xdmf || file < 0) PetscFunctionReturn(0);
  PetscCall(xdmf.update(file, last, &reason));
  if (reason.empty()) PetscFunctionReturn(0);
  PetscCall(warn(PETSC_COMM_SELF, "cannot write " + xdmf.name() + ": " + reason + ": the trajectory itself is intact"));
  xdmf = Xdmf();
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::close() {
  PetscFunctionBegin;
  if (usable) PetscCall(write_xdmf(true));
  observables.clear();
  log.clear();
  step = Column();
  time = Column();
  edges = Column();
  file = -1;
  if (viewer) {
    // A handle drops errors; here the last words of the file are at stake.
    PetscViewer last = viewer;
    PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(last)));
    viewer.reset();
    PetscCall(PetscViewerDestroy(&last));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
