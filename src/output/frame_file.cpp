// How frames reach the file. Order (README.md): room for all of them; observables, log, edges and fields, and a flush; step and
// time last, and a flush. So whoever trusts len(time) finds every row of every dataset.
#include "output/frame_file.hpp"
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iterator>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/log_event.hpp"
#include "output/h5.hpp"

namespace bs {

namespace {

constexpr std::int64_t most_gathered = 1 << 17;  // numbers of a state that rank 0 writes for all

}  // namespace

PetscErrorCode Trajectory::Impl::begin(MPI_Comm on, const TrajectoryOptions& given, int dim, std::int64_t numbers) {
  PetscBool sp = PETSC_FALSE;
  PetscFunctionBegin;
  comm = on;
  options = given;
  target = real_name(given.file);
  columns = dim == 0 || given.pad == 0 ? dim : given.pad;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  const PetscMPIInt ranks = size_of(comm);
  shared = ranks > 1 && numbers > most_gathered;
  gathers = ranks > 1 && !shared;
  writer = shared || rank == 0;
  io = shared ? comm : PETSC_COMM_SELF;
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-viewer_hdf5_sp_output", &sp, nullptr));
  single = sp;
  draws = given.xdmf && columns > 1;
  if (draws && !fits_xml(given.file.substr(given.file.rfind('/') + 1))) {
    PetscCall(warn(comm, "no_xdmf",
                   "the trajectory's name " + printable(given.file) +
                       " is not UTF-8: its sidecar for ParaView is not written: give -bs_output another name, or -bs_output_xdmf false"));
    options.xdmf = draws = false;
  }
  if (rank == 0 && options.xdmf && dim > 0) xdmf = Xdmf(given.file);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::open(const std::string& name) {
  PetscFunctionBegin;
  H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (shared) BS_H5(H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL));
  else PetscCall(use_last_write(access));
  BS_H5(H5Pset_file_locking(access, 0, 1));  // readers open it while the run goes on; RunLock keeps other runs out
  file = H5(H5Fopen(name.c_str(), H5F_ACC_RDWR, access), H5Fclose);
  BS_H5(file);
  transfer = H5(H5Pcreate(H5P_DATASET_XFER), H5Pclose);
  if (shared) BS_H5(H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::create(std::string* reason) {
  PetscFunctionBegin;
  PetscCall(create_fresh_hdf5(comm, target, &made, &identity, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  if (writer) PetscCall(open(made));
  PetscCall(confirm_identity(comm, made, identity, reason));
  named = false;
  PetscFunctionReturn(0);
}

std::vector<Field> Trajectory::Impl::written(const std::vector<Field>& given) const {
  std::vector<Field> out;
  std::copy_if(given.begin(), given.end(), std::back_inserter(out), [this](const Field& field) { return draws || !field.drawing; });
  return out;
}

/// Edges of a box get zeros where positions do.
std::vector<double> Trajectory::Impl::padded(const Observable& o) const {
  if (o.name != BOX_EDGES) return o.value;
  const std::size_t D = static_cast<std::size_t>(columns);
  if (o.columns == 0) {
    std::vector<double> row = o.value;
    row.resize(D, 0.0);
    return row;
  }
  const std::size_t d = static_cast<std::size_t>(o.columns);
  std::vector<double> row(D * D, 0.0);
  for (std::size_t k = 0; k < d; ++k)
    std::copy_n(o.value.begin() + static_cast<std::ptrdiff_t>(k * d), d, row.begin() + static_cast<std::ptrdiff_t>(k * D));
  return row;
}

PetscErrorCode Trajectory::Impl::describe(const std::vector<Field>& given, const std::vector<Observable>& observed) {
  PetscFunctionBegin;
  fields.resize(given.size());
  for (std::size_t i = 0; i < given.size(); ++i) PetscCall(fields[i].describe(given[i], columns));
  for (const Observable& o : observed) {
    const int columns_of = o.name == BOX_EDGES && o.columns > 0 ? columns : o.columns;
    observables.push_back({o.name, static_cast<int>(padded(o).size()), columns_of, o.powers, {}, {}, false});
  }
  frame_size = 16;
  for (const FieldColumn& field : fields) frame_size += field.size();
  for (const ObservableColumn& o : observables) frame_size += std::int64_t{8} * o.width;
  described = true;
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::check(const std::vector<Field>& given, const std::vector<Observable>& observed) const {
  PetscFunctionBegin;
  PetscCheck(given.size() == fields.size() && observed.size() == observables.size(), PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "a frame needs the fields and observables of the first one");
  for (std::size_t i = 0; i < given.size(); ++i)
    PetscCheck(given[i].group == fields[i].group(), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "field %s where %s was", given[i].group.c_str(),
               fields[i].group().c_str());
  for (std::size_t i = 0; i < observed.size(); ++i)
    PetscCheck(observed[i].name == observables[i].name && padded(observed[i]).size() == static_cast<std::size_t>(observables[i].width),
               PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "observable %s where %s was", observed[i].name.c_str(), observables[i].name.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::hold_frame(std::int64_t at, double now, const std::vector<Field>& given, const std::vector<Observable>& observed) {
  PetscFunctionBegin;
  if (!described) PetscCall(describe(given, observed));
  PetscCall(check(given, observed));
  const bool large = steps.empty() && 2 * frame_size > most_waiting && !gathers;
  for (std::size_t i = 0; i < given.size(); ++i) PetscCall(fields[i].hold(given[i], !large));
  for (std::size_t i = 0; i < observed.size(); ++i) {
    const std::vector<double> row = padded(observed[i]);
    observables[i].waiting.insert(observables[i].waiting.end(), row.begin(), row.end());
  }
  steps.push_back(at);
  times.push_back(now);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::put_log(std::int64_t rows) {
  std::vector<std::int64_t> whole(records.size());
  std::vector<double> real(records.size());
  PetscFunctionBegin;
  if (rows == 0) PetscFunctionReturn(0);
  const auto append = [&](std::size_t column, auto member, auto& buffer) {
    for (std::size_t i = 0; i < records.size(); ++i) buffer[i] = records[i].*member;
    return log[column].append(rows, buffer.data());
  };
  PetscCall(append(0, &StepRecord::step, whole));
  PetscCall(append(1, &StepRecord::time, real));
  PetscCall(append(2, &StepRecord::dt, real));
  PetscCall(append(3, &StepRecord::newton, whole));
  PetscCall(append(4, &StepRecord::krylov, whole));
  PetscCall(append(5, &StepRecord::rejected, whole));
  for (std::size_t k = 0; k < std::size(REJECTION_REASONS); ++k) {
    for (std::size_t i = 0; i < records.size(); ++i) whole[i] = records[i].reasons[k];
    PetscCall(log[std::size(STEP_COLUMNS) + k].append(rows, whole.data()));
  }
  PetscFunctionReturn(0);
}

/// Those that come from a source in turns, piece by piece: a piece is still in the processor's cache when the system copies it.
PetscErrorCode Trajectory::Impl::put_fields(std::int64_t first, std::int64_t count) {
  constexpr PetscInt piece = 20000;  // rows: half a megabyte of three numbers each
  PetscInt most = 0;
  PetscFunctionBegin;
  for (FieldColumn& field : fields) {
    if (field.in_pieces()) most = std::max(most, field.rows());
    else PetscCall(field.write(frames, first, count, transfer));
  }
  for (PetscInt row = 0; row < most; row += piece)
    for (FieldColumn& field : fields)
      if (field.in_pieces()) PetscCall(field.write_piece(frames, row, piece, transfer));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::put(std::int64_t first, std::int64_t count, std::int64_t rows) {
  const std::vector<double> open_box(static_cast<std::size_t>(count * columns), 0.0);
  PetscFunctionBegin;
  if (count > 0 && !laid_out) PetscCall(frames == 0 ? lay_out() : find_layout());
  if (count > 0 && !laid_out && !shared && time.id() >= 0) PetscCall(write_header(file, time.id(), Order::last));
  laid_out = laid_out || count > 0;
  PetscCall(make_room(count, rows));
  for (ObservableColumn& o : observables)
    if (count > 0 && !o.left_out) PetscCall(o.column.append(count, o.waiting.data() + first * o.width));
  if (edges.id() >= 0) PetscCall(edges.append(count, open_box.data()));
  PetscCall(put_log(rows));
  if (count > 0) PetscCall(put_fields(first, count));
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  if (count == 0 || step.id() < 0) PetscFunctionReturn(0);
  // Their length says that the frames are whole, so they could not be lengthened before.
  PetscCall(step.extend(count));
  PetscCall(time.extend(count));
  PetscCall(leave_room(0));
  PetscCall(step.append(count, steps.data() + first));
  PetscCall(time.append(count, times.data() + first));
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::forget(std::int64_t count) {
  PetscFunctionBegin;
  for (FieldColumn& field : fields) PetscCall(field.done(count));
  for (ObservableColumn& o : observables) o.waiting.erase(o.waiting.begin(), o.waiting.begin() + count * o.width);
  steps.erase(steps.begin(), steps.begin() + count);
  times.erase(times.begin(), times.begin() + count);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write_out(std::string* full) {
  std::int64_t rows = static_cast<std::int64_t>(records.size()), done = 0;
  const std::int64_t waiting = static_cast<std::int64_t>(steps.size());
  PetscFunctionBegin;
  full->clear();
  PetscCallMPI(MPI_Bcast(&rows, 1, MPI_INT64_T, 0, comm));
  if (waiting == 0 && rows == 0) PetscFunctionReturn(0);
  const LoggedTime logged(LogEvent::write);
  if (gathers && waiting > 0)
    for (FieldColumn& field : fields) PetscCall(field.gather(comm, waiting));
  while (done < waiting || rows > 0) {
    std::int64_t count = waiting - done;
    PetscCall(reserve(count, rows, full));
    if (!full->empty() && count > 1) PetscCall(reserve(count = 1, rows, full));  // those for which there is room
    if (!full->empty()) break;
    PetscCall(cut_tail());
    if (writer) PetscCall(put(done, count, rows));
    log_rows += rows;
    frames += count;
    done += count;
    if (count > 0) last_time = times[static_cast<std::size_t>(done - 1)];
    records.clear();
    rows = 0;
    unsynced = !shared;
  }
  PetscCall(forget(done));
  if (frames > 0) PetscCall(publish());
  if (done > 0) PetscCall(drop_kept());
  if (done > 0) PetscCall(write_xdmf(false));
  if (done > 0 && rank == 0 && !options.xdmf && columns > 0) remove_sidecar(options.file);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::synchronise(bool name) {
  PetscFunctionBegin;
  const int why = ask_rank_0(comm, [this] { return unsynced ? bring_to_disk(path()) : 0; });
  if (name && published && !named) {
    if (rank == 0) (void)bring_to_disk(folder_of(target));  // some file systems refuse
    named = true;
  }
  PetscCheck(why == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", std::strerror(why));
  unsynced = false;
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write_xdmf(bool last) {
  std::string reason;
  PetscFunctionBegin;
  if (!xdmf || file < 0) PetscFunctionReturn(0);
  PetscCall(xdmf.update(file, last, &reason));
  if (reason.empty()) PetscFunctionReturn(0);
  PetscCall(warn_here(comm, "no_xdmf", "cannot write " + xdmf.name() + ": " + reason + ": the trajectory itself is intact"));
  xdmf = Xdmf();
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::close() {
  std::int64_t end = 0;
  PetscFunctionBegin;
  if (usable) PetscCall(write_xdmf(true));
  for (FieldColumn& field : fields) field.close();
  for (ObservableColumn& o : observables) o.column = GrowingColumn();
  log.clear();
  step = GrowingColumn();
  time = GrowingColumn();
  edges = GrowingColumn();
  if (holds()) {
    end = usable ? allocated() : 0;
    // A handle drops errors; here the last words of the file are at stake.
    const hid_t last = file;
    BS_H5(H5Iinc_ref(last));
    file.reset();
    if (usable && rank == 0 && end > 0) (void)store_end(path(), end);
    BS_H5(H5Fclose(last));
    if (usable && rank == 0) (void)cut_behind_end(path());
  }
  if (!published && rank == 0 && !made.empty()) (void)std::remove(made.c_str());
  if (published && usable) PetscCall(synchronise(false));
  usable = false;
  PetscFunctionReturn(0);
}

}  // namespace bs
