// The HDF5 trajectory, H5MD 1.1: frames, observables, a log of steps, the options in force.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>
#include "solvers/step_record.hpp"
#include "systems/model.hpp"

namespace bs {

/// -bs_output_units: the units stated for the numbers. The program never converts.
enum class OutputUnits { none, SI, real, metal, nano };

struct TrajectoryOptions {
  std::string file;                       ///< -bs_output; empty: none is written
  int pad = 0;                            ///< -bs_output_pad: components written per particle (0: the lattice's d)
  OutputUnits units = OutputUnits::none;  ///< -bs_output_units: unit attributes
  bool overwrite = false;                 ///< -bs_overwrite
  double flush = 2;                       ///< -bs_output_flush: longest wall-clock time between flushes [s]; 0: a flush every frame
  std::vector<std::string> boundary;      ///< of the box along each edge (System::boundary); empty: none
  bool xdmf = true;                       ///< -bs_output_xdmf: FILE.xdmf beside the file, for ParaView
};

/// How far a trajectory had been written at some moment.
struct TrajectoryMark {
  std::int64_t frames = 0, log_rows = 0;
  double last_time = 0;  ///< of the last of these frames [s]
};

/// Writes frames, large ones in parallel. Small ones wait in memory (up to 4 MB), so that several are written at once; with
/// options.flush = 0 every frame is on disk and readable before write_frame returns.
/// Faults (exists already, missing folder, disk full) are reported with Exit::io or Exit::input and return ERR_FAILED.
class Trajectory {
 public:
  /// Collective. Creates the file: /h5md, /particles/trajectory/box (dimension = dim, boundary none),
  /// constants, /parameters. `dim` is the space dimension, 0 for models without particles (no /particles then). Frames of
  /// systems of many `numbers` are written by all ranks, others by rank 0.
  /// An empty options.file makes *out null and no file.
  static PetscErrorCode create(MPI_Comm comm, const TrajectoryOptions& options, int dim, std::int64_t numbers, const std::vector<Dataset>& constants,
                               std::unique_ptr<Trajectory>* out);
  /// Collective. Opens the file again at `mark`: the next frame follows there. Frames and rows of the log written after it stay
  /// until something is written in their place, and in a file beside it until the first new frame is complete. Ends the run with
  /// exit code 2 if the file is not the one marked.
  static PetscErrorCode resume(MPI_Comm comm, const TrajectoryOptions& options, int dim, std::int64_t numbers, const TrajectoryMark& mark,
                               std::unique_ptr<Trajectory>* out);
  /// Collective, before the first frame of a trajectory that was resumed. Frames of these fields and observables will follow; `changed`: options of
  /// its form that are not what they were, as they are given. Ends the run with exit code 2 where the file has other columns, or something in every
  /// frame that these have not; what it lacks is left out, with a warning.
  PetscErrorCode require_form(const std::vector<Field>& fields, const std::vector<Observable>& observables, const std::vector<std::string>& changed);
  /// Collective, before the first frame. A dataset (count, rows, columns), in the input's order: `page(k, &vec)` gives page k, which is
  /// borrowed until the next call; block size = columns. Page 0 is asked for also where there are none, for its size. All ranks must have the file
  /// open: `numbers` is large, or there is one rank.
  PetscErrorCode write_pages(const std::string& path, std::int64_t count, const std::function<PetscErrorCode(std::int64_t, Vec*)>& page);
  /// Collective. Appends one frame; the first one, which is written at once, fixes the set of fields and observables.
  PetscErrorCode write_frame(std::int64_t step, double time, const std::vector<Field>& fields, const std::vector<Observable>& observables);
  /// Collective. Gives a table its values, in the place of those that it was created with; it is made where the file has no such one.
  PetscErrorCode write_table(const Dataset& table);
  /// Not collective: buffered (what rank 0 says), and written with the next frame or flush.
  void log_step(const StepRecord& record);
  /// Collective. Writes what waits: no kill loses it any more, and readers see it.
  PetscErrorCode write_waiting();
  /// Collective. The same, and brings it to disk: no failure of power does, either.
  PetscErrorCode flush();
  /// Collective. Flushes and closes; also done by the destructor, without reporting errors.
  PetscErrorCode close();
  /// Frames in the file, and those that wait.
  std::int64_t frames() const;
  /// What is written of it; on rank 0 and on the others.
  TrajectoryMark mark() const;
  ~Trajectory();

 private:
  Trajectory();
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bs
