// How one frame reaches the file. Order (README.md): room for all of it; observables, log, edges; then the fields, each
// followed by PETSc's flush; step and time last, and a flush. So whoever trusts len(time) finds every row of every dataset.
#include "output/frame_file.hpp"

#include <cstdio>
#include <iterator>

#include "base/fault.hpp"
#include "output/h5md.hpp"

namespace bs {

PetscErrorCode Trajectory::Impl::begin(MPI_Comm on, const TrajectoryOptions& given, int dim) {
  PetscFunctionBegin;
  comm = on;
  options = given;
  target = real_name(given.file);
  columns = dim == 0 || given.pad == 0 ? dim : given.pad;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0 && given.xdmf && dim > 0) xdmf = Xdmf(given.file);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::open(const std::string& name) {
  PetscFunctionBegin;
  PetscCall(PetscViewerCreate(comm, viewer.out()));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERHDF5));
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_UPDATE));
  PetscCall(PetscViewerHDF5SetBaseDimension2(viewer, PETSC_TRUE));  // d = 1: (T, N, 1)
  PetscCall(PetscViewerSetFromOptions(viewer));                     // -viewer_hdf5_collective, -viewer_hdf5_sp_output
  PetscCall(PetscViewerFileSetName(viewer, name.c_str()));
  PetscCall(PetscViewerHDF5GetFileId(viewer, &file));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::create(std::string* reason) {
  PetscFunctionBegin;
  PetscCall(create_fresh_hdf5(comm, target, &made, &identity, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  PetscCall(open(made));
  PetscCall(confirm_identity(comm, made, identity, reason));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::check(const std::vector<Field>& fields, const std::vector<Observable>& given) const {
  PetscFunctionBegin;
  PetscCheck(fields.size() == groups.size() && given.size() == names.size(), PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "a frame needs the fields and observables of the first one");
  for (std::size_t i = 0; i < fields.size(); ++i)
    PetscCheck(fields[i].group == groups[i], PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "field %s where %s was", fields[i].group.c_str(),
               groups[i].c_str());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::size_t width = observables[i].width() > 0 ? static_cast<std::size_t>(observables[i].width()) : 1;
    PetscCheck(given[i].name == names[i] && given[i].value.size() == width, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "observable %s where %s was",
               given[i].name.c_str(), names[i].c_str());
  }
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
  if (width_of(groups[index], block) == block) PetscFunctionReturn(0);
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
  for (std::size_t k = 0; k < std::size(REJECTION_REASONS); ++k) {
    for (std::size_t i = 0; i < records.size(); ++i) whole[i] = records[i].reasons[k];
    PetscCall(log[std::size(STEP_COLUMNS) + k].append(count, whole.data()));
  }
  records.clear();
  log_rows += count;
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write(std::int64_t at, double now, const std::vector<Field>& fields, const std::vector<Observable>& given) {
  const std::vector<double> open_box(static_cast<std::size_t>(columns), 0.0);
  std::int64_t bytes = 0;

  PetscFunctionBegin;
  if (!laid_out) PetscCall(frames == 0 ? lay_out(fields, given) : find_layout(fields, given));
  laid_out = true;
  PetscCall(check(fields, given));
  PetscCall(cut_tail());
  PetscCall(frame_bytes(fields, given, &bytes));
  PetscCall(make_room(1, bytes));
  for (std::size_t i = 0; i < given.size(); ++i) PetscCall(observables[i].append(1, given[i].value.data()));
  if (edges.id() >= 0) PetscCall(edges.append(1, open_box.data()));
  PetscCall(write_log());
  if (fields.empty()) BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  for (std::size_t i = 0; i < fields.size(); ++i) PetscCall(write_field(i, fields[i]));
  if (step.id() >= 0) {
    // Their length says that the frame is whole, so they could not be lengthened before.
    if (frames % frame_chunk == 0) PetscCall(leave_room(bytes));
    PetscCall(step.append(1, &at));
    PetscCall(time.append(1, &now));
  }
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  ++frames;
  last_time = now;
  PetscCall(publish());
  PetscCall(drop_kept());
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
  values.clear();
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
    if (!published && rank == 0 && !made.empty()) (void)std::remove(made.c_str());
    PetscCall(PetscViewerDestroy(&last));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
