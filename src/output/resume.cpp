// A trajectory that exists is opened again and goes on behind a mark.
#include "base/fault.hpp"
#include "output/frame_file.hpp"
#include "output/io_watch.hpp"
#include "output/space.hpp"

namespace bs {

namespace {

bool ends_in(const std::string& path, const std::string& tail) {
  return path.size() >= tail.size() && path.compare(path.size() - tail.size(), tail.size(), tail) == 0;
}

/// Every link of the file, in the same order on every rank.
std::vector<std::string> paths_of(hid_t file) {
  std::vector<std::string> paths;
  const auto keep = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->push_back(std::string("/") + name);
    return 0;
  };
  (void)H5Lvisit(file, H5_INDEX_NAME, H5_ITER_INC, keep, &paths);
  return paths;
}

/// A dataset that grows, and the rows it had at the mark.
struct Growing {
  std::string path;
  bool clock;  ///< its length tells how many frames are whole
  std::int64_t rows;
};

std::vector<Growing> growing_of(hid_t file, const TrajectoryMark& mark) {
  std::vector<Growing> found;
  for (const std::string& path : paths_of(file)) {
    const bool log = path.rfind("/backspring/log/", 0) == 0;
    const bool clock = !log && (ends_in(path, "/time") || ends_in(path, "/step"));
    if (log || clock || ends_in(path, "/value")) found.push_back({path, clock, log ? mark.log_rows : mark.frames});
  }
  return found;
}

/// Rows of a dataset.
PetscErrorCode count_rows(hid_t file, const std::string& path, std::int64_t* rows) {
  hsize_t extent[H5S_MAX_RANK] = {0};

  PetscFunctionBegin;
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose);
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  *rows = static_cast<std::int64_t>(extent[0]);
  PetscFunctionReturn(0);
}

PetscErrorCode shorten(hid_t file, const std::string& path, std::int64_t rows) {
  hsize_t extent[H5S_MAX_RANK];

  PetscFunctionBegin;
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose);
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  if (static_cast<std::int64_t>(extent[0]) <= rows) PetscFunctionReturn(0);
  extent[0] = static_cast<hsize_t>(rows);
  BS_H5(H5Dset_extent(set, extent));
  PetscFunctionReturn(0);
}

/// The time of frame `frame`, read by every rank.
PetscErrorCode time_of_frame(hid_t file, const std::string& path, std::int64_t frame, double* time) {
  const hsize_t at = static_cast<hsize_t>(frame), one = 1;

  PetscFunctionBegin;
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose), memory(H5Screate_simple(1, &one, nullptr), H5Sclose);
  BS_H5(H5Sselect_hyperslab(space, H5S_SELECT_SET, &at, nullptr, &one, nullptr));
  BS_H5(H5Dread(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, time));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode Trajectory::Impl::recognise(const TrajectoryMark& mark, std::string* fault) const {
  std::string clock;
  double there = 0;

  PetscFunctionBegin;
  for (const Growing& set : growing_of(file, mark)) {
    std::int64_t found = 0;
    PetscCall(count_rows(file, set.path, &found));
    if (found < set.rows) {
      *fault = format("has %lld rows in %s where %lld were written", (long long)found, set.path.c_str(), (long long)set.rows);
      PetscFunctionReturn(0);
    }
    if (set.clock && ends_in(set.path, "/time")) clock = set.path;
  }
  if (mark.frames > 0 && clock.empty()) *fault = "holds no frame";
  if (mark.frames == 0 || clock.empty()) PetscFunctionReturn(0);
  PetscCall(time_of_frame(file, clock, mark.frames - 1, &there));
  if (there != mark.last_time)
    *fault = format("has frame %lld at t = %.17g s where it was written at %.17g s", (long long)mark.frames - 1, there, mark.last_time);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::cut_back(const TrajectoryMark& mark) {
  PetscFunctionBegin;
  // The clock first, and on disk: whoever trusts its length then finds every row, also if the run ends here.
  for (const bool clock : {true, false}) {
    for (const Growing& set : growing_of(file, mark))
      if (set.clock == clock) PetscCall(shorten(file, set.path, set.rows));
    BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::open_log() {
  PetscFunctionBegin;
  for (const char* name : log_entries) {
    log.emplace_back();
    PetscCall(log.back().open(comm, file, std::string("/backspring/log/") + name, log_rows));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::find_layout(const std::vector<Field>& fields, const std::vector<Observable>& given) {
  PetscFunctionBegin;
  for (const Field& field : fields) {
    groups.push_back(field.group);
    padded.emplace_back();
    values.emplace_back(H5Dopen2(file, (field.group + "/value").c_str(), H5P_DEFAULT), H5Dclose);
    BS_H5(values.back());
  }
  for (const Observable& observable : given) {
    names.push_back(observable.name);
    observables.emplace_back();
    PetscCall(observables.back().open(comm, file, "/observables/" + observable.name + "/value", frames));
  }
  if (columns > 0 && !fields.empty()) PetscCall(edges.open(comm, file, "/particles/trajectory/box/edges/value", frames));
  if (fields.empty() && given.empty()) PetscFunctionReturn(0);
  const std::string owner = fields.empty() ? "/observables/" + given[0].name : fields[0].group;
  PetscCall(step.open(comm, file, owner + "/step", frames));
  PetscCall(time.open(comm, file, owner + "/time", frames));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::resume(MPI_Comm comm, const TrajectoryOptions& options, int dim, const TrajectoryMark& mark,
                                  std::unique_ptr<Trajectory>* out) {
  std::string fault;

  PetscFunctionBegin;
  out->reset();
  PetscCall(require_writable(comm, options.file, "-bs_output", true));
  const IoWatch watch("cannot open " + options.file + " again", ": give another -bs_output, and the run goes on there");
  std::unique_ptr<Trajectory> made(new Trajectory());
  Impl& impl = *made->impl_;
  PetscCall(impl.begin(comm, options, dim));
  impl.frames = mark.frames;
  impl.log_rows = mark.log_rows;
  impl.last_time = mark.last_time;
  impl.published = true;
  PetscErrorCode code = impl.open(options.file, true);
  if (!code) code = impl.recognise(mark, &fault);
  if (!code && !fault.empty())
    code = tell(comm, Exit::input, options.file + ": is not the trajectory this run wrote: it " + fault + ": give the one it wrote, or a new name");
  if (!code) code = impl.cut_back(mark);
  if (!code) code = impl.open_log();
  if (!code && H5Fflush(impl.file, H5F_SCOPE_GLOBAL) < 0) code = tell_alone(Exit::io, watch.sentence(h5_reason()));
  if (code) impl.usable = false;
  PetscCall(watch.settle(comm, code));
  *out = std::move(made);
  PetscFunctionReturn(0);
}

TrajectoryMark Trajectory::mark() const { return {impl_->frames, impl_->log_rows, impl_->last_time}; }

}  // namespace bs
