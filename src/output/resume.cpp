// A trajectory that exists is opened again and goes on behind a mark.
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "output/frame_file.hpp"
#include "output/fresh_file.hpp"
#include "output/h5.hpp"

namespace bs {

namespace {

struct Links {
  std::vector<std::string> paths;
  std::string foreign;  ///< one that is no part of the file
};

/// Every link of the file, in the same order on every rank.
Links links_of(hid_t file) {
  Links links;
  const auto keep = [](hid_t, const char* name, const H5L_info_t* info, void* data) -> herr_t {
    Links& found = *static_cast<Links*>(data);
    if (info->type == H5L_TYPE_HARD) found.paths.push_back(std::string("/") + name);
    else found.foreign = std::string("/") + name;
    return 0;
  };
  (void)H5Lvisit(file, H5_INDEX_NAME, H5_ITER_INC, keep, &links);
  return links;
}

/// Whether a dataset's numbers lie in chunks of the file itself, as those of every growing dataset do.
bool in_chunks(hid_t file, const std::string& path) {
  const H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (set < 0) return false;
  const H5 list(H5Dget_create_plist(set), H5Pclose);
  return list >= 0 && H5Pget_layout(list) == H5D_CHUNKED && H5Pget_external_count(list) == 0;
}

}  // namespace

std::vector<Growing> growing_of(hid_t file, const TrajectoryMark& mark, std::string* fault) {
  std::vector<Growing> found;
  const Links links = links_of(file);
  fault->clear();
  if (!links.foreign.empty()) *fault = "has a link to elsewhere, " + links.foreign;
  for (const std::string& path : links.paths) {
    if (path.rfind("/events/", 0) == 0) continue;  // written at a run's end, as a whole
    const bool log = path.rfind("/backspring/log/", 0) == 0;
    const bool clock = !log && (ends_with(path, "/time") || ends_with(path, "/step"));
    if (!log && !clock && !ends_with(path, "/value")) continue;
    if (fault->empty() && !in_chunks(file, path)) *fault = "keeps " + path + " outside chunks of the file itself";
    found.push_back({path, log, clock, log ? mark.log_rows : mark.frames});
  }
  return found;
}

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

namespace {

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

PetscErrorCode Trajectory::Impl::match(const TrajectoryMark& at, std::string* fault) {
  std::string clock;
  double there = 0;
  PetscFunctionBegin;
  const std::vector<Growing> sets = growing_of(file, at, fault);
  if (!fault->empty()) PetscFunctionReturn(0);
  for (const Growing& set : sets) {
    std::int64_t found = 0;
    PetscCall(count_rows(file, set.path, &found));
    if (found < set.rows) {
      *fault = "has " + how_many(found, "row") + " in " + set.path + " where " + how_many(set.rows, "{was|were} written");
      PetscFunctionReturn(0);
    }
    if (found > set.rows) tail = true;
    if (set.times()) clock = set.path, old_frames = found;
  }
  if (at.frames > 0 && clock.empty()) *fault = "holds no frame";
  if (at.frames == 0 || clock.empty()) PetscFunctionReturn(0);
  PetscCall(time_of_frame(file, clock, at.frames - 1, &there));
  if (there != at.last_time)
    *fault = format("has frame %lld at t = %s s where it was written at %s s", (long long)at.frames - 1, plain_number(there).c_str(),
                    plain_number(at.last_time).c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::recognise(const TrajectoryMark& at, std::string* fault) {
  PetscFunctionBegin;
  if (writer) PetscCall(match(at, fault));
  tail = ask_rank_0(comm, [this] { return tail; });
  PetscCallMPI(MPI_Bcast(&old_frames, 1, MPI_INT64_T, 0, comm));
  PetscCall(share_text(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::open_log() {
  PetscFunctionBegin;
  for (const std::string& name : log_columns()) {
    log.emplace_back();
    PetscCall(log.back().open(io, file, "/backspring/log/" + name, log_rows));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::find_layout() {
  PetscFunctionBegin;
  for (FieldColumn& field : fields) {
    if (h5_exists(file, field.group() + "/value")) PetscCall(field.open(file));
    else field.leave_out();
  }
  for (ObservableColumn& o : observables) {
    const std::string path = o.group() + "/value";
    o.left_out = !h5_exists(file, path);
    if (o.left_out) continue;
    PetscCall(o.column.open(io, file, path, frames));
    PetscCheck(std::max(1, o.column.width()) == o.width, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s has rows of %d numbers, the run writes %d",
               path.c_str(), std::max(1, o.column.width()), o.width);
  }
  if (columns > 0 && !fields.empty() && options.boundary.empty()) PetscCall(edges.open(io, file, "/particles/trajectory/box/edges/value", frames));
  if (fields.empty() && observables.empty()) PetscFunctionReturn(0);
  const std::string owner = fields.empty() ? observables[0].group() : fields[0].group();
  PetscCall(step.open(io, file, owner + "/step", frames));
  PetscCall(time.open(io, file, owner + "/time", frames));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::resume(MPI_Comm comm, const TrajectoryOptions& options, int dim, std::int64_t numbers, const TrajectoryMark& at,
                                  std::unique_ptr<Trajectory>* out) {
  std::string fault;
  PetscFunctionBegin;
  out->reset();
  PetscCall(require_writable(comm, options.file, "-bs_output", true));
  const IoWatch watch(comm, "cannot open " + options.file + " again", ": give another -bs_output, and the run goes on there");
  std::unique_ptr<Trajectory> made(new Trajectory());
  Impl& impl = *made->impl_;
  PetscCall(impl.begin(comm, options, dim, numbers));
  impl.mark = at;
  impl.frames = at.frames;
  impl.log_rows = at.log_rows;
  impl.last_time = at.last_time;
  impl.published = true;
  PetscErrorCode code = 0;
  if (!ask_rank_0(comm, [&] { return H5Fis_hdf5(impl.target.c_str()) > 0; })) fault = "is not an HDF5 file";
  else if (impl.writer) code = impl.open(impl.target);
  if (!code && fault.empty()) code = impl.recognise(at, &fault);
  if (!code && !fault.empty())
    code = fail(comm, Exit::input, options.file + ": is not the trajectory this run wrote: it " + fault + ": give the one it wrote, or a new name");
  if (!code && impl.writer) code = impl.open_log();
  if (!code) impl.draws = ask_rank_0(comm, [&] { return h5_exists(impl.file, "/backspring/drawn/value"); });
  if (code) impl.usable = false;
  PetscCall(watch.report(comm, code));
  *out = std::move(made);
  PetscFunctionReturn(0);
}

TrajectoryMark Trajectory::mark() const { return {impl_->frames, impl_->log_rows, impl_->last_time}; }

}  // namespace bs
