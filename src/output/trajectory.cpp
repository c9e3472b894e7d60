#include "output/trajectory.hpp"
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "output/frame_file.hpp"
#include "output/fresh_file.hpp"
#include "output/h5.hpp"
#include "output/tables.hpp"

namespace bs {

Trajectory::Trajectory() : impl_(std::make_unique<Impl>()) {}

Trajectory::~Trajectory() {
  (void)PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  std::string full;
  if (impl_->usable && impl_->comm != MPI_COMM_NULL && !impl_->tail) (void)impl_->write_out(&full);
  (void)impl_->close();
  (void)PetscPopErrorHandler();
}

std::int64_t Trajectory::frames() const {
  const std::int64_t waiting = impl_->usable ? static_cast<std::int64_t>(impl_->steps.size()) : 0;
  return impl_->tail && waiting == 0 ? impl_->old_frames : impl_->frames + waiting;
}

static PetscErrorCode write_constants(hid_t file, const std::vector<Dataset>& constants, OutputUnits units) {
  PetscFunctionBegin;
  for (const Dataset& table : constants) {
    PetscCall(write_table(file, table));
    std::string unit = unit_of(table.powers, units);
    if (unit.empty()) unit = unit_of_quantity(table.path.substr(table.path.rfind('/') + 1), units);
    const bool bonds = table.path.rfind("/connectivity/", 0) == 0 && table.columns > 1;  // or angles
    if (!bonds && unit.empty() && table.attributes.empty()) continue;
    H5 set(H5Dopen2(file, table.path.c_str(), H5P_DEFAULT), H5Dclose);
    BS_H5(set);
    if (bonds && H5Lexists(file, "/particles", H5P_DEFAULT) > 0) PetscCall(put_reference(file, set, "particles_group", "/particles/trajectory"));
    if (!unit.empty()) PetscCall(put_attribute(set, "unit", unit));
    for (const auto& [name, text] : table.attributes) PetscCall(put_text(set, name.c_str(), text));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::write_head(std::vector<Dataset> constants) {
  PetscFunctionBegin;
  const PetscMPIInt ranks = size_of(comm);
  if (gathers)
    for (Dataset& table : constants) PetscCall(gather_table(comm, &table));
  if (!writer) PetscFunctionReturn(0);
  PetscCall(write_h5md(file, io, options.units != OutputUnits::none));
  if (columns > 0) PetscCall(write_box(file, columns, options.boundary));
  PetscCall(write_parameters(file, ranks));
  PetscCall(write_constants(file, constants, options.units));
  PetscCall(create_log());
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::replace_table(Dataset table) {
  H5 group;
  PetscFunctionBegin;
  if (gathers) PetscCall(gather_table(comm, &table));
  if (!writer) PetscFunctionReturn(0);
  PetscCall(open_group(file, table.path.substr(0, table.path.rfind('/')), &group));
  htri_t there = H5Lexists(file, table.path.c_str(), H5P_DEFAULT);
  BS_H5(there);
  if (there && mark.frames > 0) {  // that of the run before it may be another one
    BS_H5(H5Ldelete(file, table.path.c_str(), H5P_DEFAULT));
    there = 0;
  }
  if (there) PetscCall(refill_table(file, table));
  else PetscCall(write_constants(file, {table}, options.units));
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::publish() {
  std::string reason;
  Error fault;
  PetscFunctionBegin;
  if (published) PetscFunctionReturn(0);
  PetscCall(confirm_identity(comm, made, identity, &reason));
  if (rank == 0 && reason.empty() && options.overwrite && access(target.c_str(), F_OK) == 0)
    if (const int why = bring_to_disk(made)) reason = std::strerror(why);  // before what it takes the place of is gone
  if (rank == 0 && reason.empty())
    if (const int why = give_name(made, target, options.overwrite))
      reason = why == EEXIST ? target + " has been created meanwhile" : std::string(std::strerror(why));
  if (rank == 0 && !reason.empty()) {
    fault.text = "cannot give the trajectory the name " + options.file + ": " + reason + ": the run ends, what it wrote is in " + made;
    published = true;  // it is kept
  }
  fault.exit = Exit::io;
  PetscCall(fail_if_any(comm, fault));
  published = true;
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::create(MPI_Comm comm, const TrajectoryOptions& options, int dim, std::int64_t numbers,
                                  const std::vector<Dataset>& constants, std::unique_ptr<Trajectory>* out) {
  std::string full;
  PetscErrorCode code;
  PetscFunctionBegin;
  out->reset();
  if (options.file.empty()) PetscFunctionReturn(0);
  if (options.pad != 0 && options.pad < dim) {
    const std::string text = "option -bs_output_pad: " + how_many(options.pad, "column{ does|s do} not hold ") + how_many(dim, "component") +
                             format(": give 0 or a number >= %d", dim);
    PetscFunctionReturn(fail(comm, Exit::input, text));
  }
  PetscCall(require_writable(comm, options.file, "-bs_output", options.overwrite));
  const IoWatch watch(comm, "cannot create " + options.file, "");
  std::unique_ptr<Trajectory> made(new Trajectory());
  Impl& impl = *made->impl_;
  PetscCall(impl.begin(comm, options, dim, numbers));
  code = impl.create(&full);
  if (!code && full.empty()) code = reserve_space(comm, impl.made, -1, table_bytes(constants), &full);
  if (!code && !full.empty()) code = fail(comm, Exit::io, watch.sentence(full));
  if (!code) code = impl.write_head(constants);
  if (code) impl.usable = false;
  PetscCall(watch.report(comm, code));
  *out = std::move(made);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::write_pages(const std::string& path, std::int64_t count, const std::function<PetscErrorCode(std::int64_t, Vec*)>& page) {
  std::string full;
  PetscErrorCode code = 0;
  PetscInt size = 0, block = 1;
  H5 set;
  Vec vec;
  PetscFunctionBegin;
  PetscCheck(!impl_->gathers, impl_->comm, PETSC_ERR_ORDER, "rank 0 alone has the file open");
  const IoWatch watch(impl_->comm, "cannot write " + path + " to " + impl_->options.file, "");
  for (std::int64_t k = 0; (k < count || k == 0) && !code; ++k) {
    PetscCall(page(k, &vec));
    PetscCall(require_finite(impl_->comm, path, vec));
    if (k == 0) {
      PetscCall(VecGetSize(vec, &size));
      PetscCall(VecGetBlockSize(vec, &block));
      code = reserve_space(impl_->comm, impl_->path(), -1, 8 * count * size + 65536, &full);
      if (!code && !full.empty()) code = fail(impl_->comm, Exit::io, watch.sentence(full));
      if (!code) code = create_pages(impl_->file, path, count, size / block, block, &set);
    }
    if (!code && k < count) code = write_page(set, k, vec);
  }
  if (code) impl_->usable = false;
  impl_->xdmf.renew();  // shapes of modes are shown, too
  PetscCall(watch.report(impl_->comm, code));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::write_frame(std::int64_t step, double time, const std::vector<Field>& fields, const std::vector<Observable>& observables) {
  PetscErrorCode code;
  PetscFunctionBegin;
  PetscCheck(impl_->usable, PETSC_COMM_SELF, PETSC_ERR_ORDER, "the file is closed");
  const IoWatch watch(impl_->comm, format("cannot keep frame %lld for %s", (long long)frames(), impl_->options.file.c_str()),
                      ": earlier frames are intact");
  code = impl_->hold_frame(step, time, impl_->written(fields), observables);
  if (code) impl_->usable = false;
  PetscCall(watch.report(impl_->comm, code));
  if (impl_->options.flush == 0) PetscCall(flush());
  else if (impl_->frames == 0 || !impl_->has_space()) PetscCall(write_waiting());
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::write_table(const Dataset& table) {
  std::string full;
  PetscErrorCode code;
  PetscFunctionBegin;
  PetscCall(require_finite(impl_->comm, table));
  PetscCall(write_waiting());
  if (!impl_->usable) PetscFunctionReturn(0);
  const IoWatch watch(impl_->comm, "cannot write " + table.path + " to " + impl_->options.file, ": all frames are intact");
  code = reserve_space(impl_->comm, impl_->path(), -1, table_bytes({table}), &full);
  if (!code && !full.empty()) code = fail(impl_->comm, Exit::io, watch.sentence(full));
  if (!code) code = impl_->replace_table(table);
  if (code) impl_->usable = false;
  else impl_->unsynced = !impl_->shared;
  PetscCall(watch.report(impl_->comm, code));
  PetscFunctionReturn(0);
}

void Trajectory::log_step(const StepRecord& record) {
  if (impl_->rank == 0) impl_->records.push_back(record);
}

PetscErrorCode Trajectory::write_waiting() {
  std::string full;
  PetscErrorCode code;
  PetscFunctionBegin;
  if (!impl_->usable) PetscFunctionReturn(0);
  const std::string& file = impl_->options.file;
  const bool frames = !impl_->steps.empty();
  const auto number = [&] { return format("cannot write frame %lld to %s", (long long)impl_->frames, file.c_str()); };
  const std::string rest = !frames              ? ": all frames are intact"
                           : impl_->frames == 0 ? ": this run leaves no trajectory"
                                                : ": earlier frames are intact";
  const IoWatch watch(impl_->comm, frames ? number() : "cannot write the log of steps to " + file, rest);
  code = impl_->write_out(&full);
  if (!code && !full.empty()) code = fail(impl_->comm, Exit::io, frames ? number() + ": " + full + rest : watch.sentence(full));
  if (code) impl_->usable = false;
  PetscCall(watch.report(impl_->comm, code));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::flush() {
  PetscErrorCode code = 0;
  PetscFunctionBegin;
  PetscCall(write_waiting());
  if (!impl_->usable) PetscFunctionReturn(0);
  const IoWatch watch(impl_->comm, "cannot bring " + impl_->options.file + " to disk", "");
  code = impl_->synchronise(true);
  if (code) impl_->usable = false;
  PetscCall(watch.report(impl_->comm, code));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::close() {
  PetscFunctionBegin;
  PetscCall(write_waiting());
  const IoWatch watch(impl_->comm, "cannot close " + impl_->options.file, "");
  const PetscErrorCode code = impl_->close();
  PetscCall(watch.report(impl_->comm, code));
  PetscFunctionReturn(0);
}

}  // namespace bs
