// The settings of a run from the options, and the files that it may write.
#include "tasks/run_options.hpp"
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/options.hpp"
#include "base/recalled_options.hpp"
#include "checkpoint/checkpoint.hpp"
#include "tasks/matrices.hpp"

namespace bs {

namespace {

PetscErrorCode read_step_options(MPI_Comm comm, RunOptions* out) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Stepping", [&](Section& o) {
    o.real("-bs_step_cut", "factor by which the step is multiplied after a failed solve, between 0 and 1", out->step.length.cut, Range::positive);
    o.integer("-bs_step_grow_after",
              "number of accepted steps after which a reduced step grows back toward -ts_dt; twice as many each time the longer step is rejected "
              "at once, up to 32 times",
              out->step.length.grow_after, Range::positive);
    o.real("-bs_step_min", "shortest step tried after a rejection; if a shorter one is needed, the run ends with exit code 3; 0: no limit [s]",
           out->step.length.least, Range::nonnegative);
    o.integer("-bs_step_max_cuts", "rejections allowed per step; one more ends the run with exit code 3", out->step.max_cuts, Range::nonnegative);
    o.real("-bs_step_first",
           "length of the first step, also after a jump of what is given over time; 0: -ts_dt, or a thousandth of it where -ts_adapt_type has no "
           "error estimate for the first step (beuler, cn, "
           "theta) [s]",
           out->step.length.first, Range::nonnegative);
    if (out->step.length.cut >= 1) o.fail("option -bs_step_cut: give a number between 0 and 1, e.g. 0.25");
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode read_motion_options(MPI_Comm comm, RunOptions* out) {
  PetscFunctionBegin;
  PetscCall(read_advise(comm, &out->advise));
  PetscCall(read_section(comm, "Motion in time", [&](Section& o) {
    o.real("-bs_stop_at_rest",
           "end the run when the forces on the free particles and their velocities (2-norms, the latter weighted by sqrt(mass)) have fallen to this "
           "fraction of their largest values since the run, or its continuation, began; 0: never [1]",
           out->rest, Range::nonnegative);
    o.real("-bs_energy_growth",
           "warn once, without ending the run, when the kinetic and elastic energy exceeds the energy supplied by the initial state, external "
           "fields, driven anchors and groups and the fluid by this factor (explicit types: by ten times this factor); 0: never [1]",
           out->energy_growth, Range::nonnegative);
    if (out->rest >= 1) o.fail("option -bs_stop_at_rest: give a number between 0 and 1, e.g. 1e-8");
  }));
  PetscCall(read_tolerances(comm, &out->tolerances));
  PetscFunctionReturn(0);
}

PetscErrorCode read_output_settings(MPI_Comm comm, Steps steps, OutputSettings* settings) {
  TrajectoryOptions& file = settings->trajectory;
  std::int64_t pad = file.pad;
  int units = static_cast<int>(file.units);
  PetscFunctionBegin;
  PetscCall(read_file_options(comm, settings));
  PetscCall(read_section(comm, "Form of the trajectory", [&](Section& section) {
    section.integer("-bs_output_pad",
                    "number of components written per particle, padded with zeros (3: for programs that expect x, y, z); 0: as many as the lattice "
                    "has dimensions",
                    pad, Range::nonnegative);
    section.choice("-bs_output_units",
                   "unit attributes of the trajectory; the numbers are not converted: none; SI (kg, m, s); real (u, Angstrom, fs), metal (u, "
                   "Angstrom, ps) and nano (ag, nm, ns), whose units of length MDAnalysis recognises",
                   {"none", "SI", "real", "metal", "nano"}, units);
    section.flag("-bs_output_xdmf",
                 "write TRAJECTORY.xdmf beside the trajectory, with which ParaView opens it (not written in one dimension without -bs_output_pad)",
                 file.xdmf);
    if (pad > 1024) section.fail("option -bs_output_pad: " + std::to_string(pad) + " is too large: give 3");
  }));
  if (steps != Steps::none)
    PetscCall(read_section(comm, "Frames and progress", [&](Section& section) {
      section.real("-bs_output_interval",
                   "simulated time between frames; 0: a frame at every step; default: 0, and for linear systems of more than 2000 steps of one "
                   "length as many steps as give at most 2000 frames [s]",
                   settings->interval, Range::nonnegative);
      section.real("-bs_output_flush",
                   "longest wall-clock time for which frames and the log of steps wait in memory before they are written and brought to disk, beside "
                   "the time of a step; 0: every frame at once [s]",
                   file.flush, Range::nonnegative);
      section.real("-bs_progress_interval", "wall-clock time between progress lines; 0: a line at every step; negative: no lines [s]",
                   settings->progress_interval);
    }));
  file.pad = static_cast<int>(pad);
  file.units = static_cast<OutputUnits>(units);
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_file_options(MPI_Comm comm, OutputSettings* settings) {
  TrajectoryOptions& file = settings->trajectory;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Output options", [&](Section& section) {
    section.path(
        "-bs_output",
        "trajectory file to write, in the H5MD format of HDF5 (suffix .h5md), or the lattice file of -bs_task generate (.h5); default: none is "
        "written",
        file.file);
    section.flag("-bs_overwrite", "replace an existing trajectory, lattice file, checkpoint or report", file.overwrite);
    section.path("-bs_report", "file for the closing report, in JSON; default: none is written", settings->report);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode read_program_options(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Program", [&](Section& o) {
    bool version = false, trace = false;
    o.flag("-bs_version", "print the version and exit", version);
    o.flag("-bs_trace", "report errors with PETSc's full traceback, for developers", trace);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode read_run_options(MPI_Comm comm, Steps steps, RunOptions* out) {
  PetscFunctionBegin;
  PetscCall(read_output_settings(comm, steps, &out->output));
  PetscCall(read_program_options(comm));
  PetscCall(read_matrix_options(comm));
  if (steps == Steps::none) PetscFunctionReturn(0);
  if (steps == Steps::time) PetscCall(read_motion_options(comm, out));
  PetscCall(read_step_options(comm, out));
  PetscCall(read_saving_options(comm, &out->saving));
  out->step.output_interval = out->output.interval;
  out->step.every_step = out->output.interval == 0 && !out->output.trajectory.file.empty();
  out->step.save_every = out->saving.every;
  out->step.save_minutes = out->saving.minutes;
  out->step.flush_seconds = out->output.trajectory.flush;
  PetscFunctionReturn(0);
}

namespace {

/// Files of an earlier run that this run will replace by its own.
struct EarlierResults {
  std::vector<std::string> files;
};

}  // namespace

PetscErrorCode lock_outputs(MPI_Comm comm, const RunOptions& options, OutputLocks* locks) {
  RunFiles files;
  CheckpointFile checkpoint;
  PetscFunctionBegin;
  PetscCall(warn_left_out(comm));
  files.output = options.output.trajectory.file;
  files.xdmf = options.output.trajectory.xdmf;
  files.overwrite = options.output.trajectory.overwrite;
  files.report = options.output.report;
  files.checkpoint = options.saving.file;
  files.matrices = matrix_prefix(comm);
  files.matrix_files = matrix_files(comm);
  files.restart = options.saving.restart;
  files.inputs = input_files(comm);
  if (!files.restart.empty()) {
    PetscCall(checkpoint.open(comm, files.restart));
    files.resumes = mark_of(checkpoint).frames > 0;
  }
  PetscCall(locks->acquire(comm, files));
  std::vector<std::string>& earlier = held_by<EarlierResults>(comm).files;
  if (files.overwrite) earlier = files.matrix_files;
  if (files.overwrite && !files.report.empty()) earlier.push_back(files.report);
  PetscFunctionReturn(0);
}

PetscErrorCode remove_earlier_results(MPI_Comm comm) {
  Error fault;
  std::vector<std::string>& earlier = held_by<EarlierResults>(comm).files;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  for (const std::string& file : earlier)
    if (rank == 0 && unlink(file.c_str()) != 0 && errno != ENOENT)
      fault.note(0, "cannot remove " + file + " of an earlier run: " + std::strerror(errno), Exit::io);
  earlier.clear();
  fault.exit = Exit::io;
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
