// What Trajectory holds: the open file, its growing datasets, and what waits to be written to them.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/text.hpp"
#include "output/frame_columns.hpp"
#include "output/fresh_file.hpp"
#include "output/h5.hpp"
#include "output/trajectory.hpp"
#include "output/xdmf.hpp"
#include "systems/system.hpp"

namespace bs {

/// A dataset of a trajectory that grows with it, and the rows it had at the mark.
struct Growing {
  std::string path;
  bool log, clock;  ///< of the log of steps; its length tells how many frames are whole
  std::int64_t rows;
  bool times() const { return clock && ends_with(path, "/time"); }
};

/// The growing datasets of an open file, in the same order on every rank. `fault`: one of them, or a group, is not within
/// the file itself (a link, external storage): writing it would change another file; else empty.
std::vector<Growing> growing_of(hid_t file, const TrajectoryMark& mark, std::string* fault);

/// What an open file and what a run writes to every frame do not have in common.
struct FormDifferences {
  std::string width;                          ///< numbers of a frame here and there; empty: they are as many
  std::vector<std::string> missing, surplus;  ///< groups that the file alone has not, or has alone
  /// Why the run cannot go on with the file, and what it leaves out of it; empty if nothing.
  std::string fault(const std::string& changed) const;
  std::string warning(const std::string& changed) const;
};

/// Rows of a dataset.
PetscErrorCode count_rows(hid_t file, const std::string& path, std::int64_t* rows);

/// Columns of /backspring/log before those of rejected attempts, "rejected_" and the reason's key each.
inline constexpr const char* STEP_COLUMNS[] = {"step", "time", "dt", "newton", "krylov", "rejected"};
/// All of them, in the order in which rows are written.
std::vector<std::string> log_columns();

inline constexpr int column_chunk = 128;  ///< rows allocated at a time in datasets with one row a frame or step

inline constexpr std::int64_t most_waiting = 1 << 22;  ///< bytes of frames in memory, all ranks together

/// The same of the clock where ranks write together: MPI-IO has no write that is last, and at a new chunk a kill could come between two.
inline constexpr int shared_clock_chunk = 4096;

struct Trajectory::Impl {
  MPI_Comm comm = MPI_COMM_NULL;
  PetscMPIInt rank = 0;
  TrajectoryOptions options;
  int columns = 0;              ///< components written per particle; 0 without particles
  bool shared = false;          ///< all ranks have the file open and write by MPI-IO; else rank 0 alone, for all
  bool gathers = false;         ///< rank 0 alone, of several
  bool writer = false;          ///< this rank has it open
  MPI_Comm io = MPI_COMM_NULL;  ///< the ranks that have it open; of a rank that has not: itself
  bool single = false;          ///< -viewer_hdf5_sp_output: fields in single precision
  bool draws = false;           ///< fields for viewers alone are written, too
  H5 file, transfer;
  std::int64_t frames = 0;  ///< written
  bool usable = true;       ///< false after a failed write: only to be closed

  std::int64_t frame_size = 0;  ///< bytes of a frame's fields and observables, of all ranks
  std::vector<FieldColumn> fields;
  std::vector<ObservableColumn> observables;
  GrowingColumn step, time, edges;
  std::vector<std::int64_t> steps;  ///< of the frames that wait; the same on every rank
  std::vector<double> times;
  std::vector<GrowingColumn> log;
  std::vector<StepRecord> records;  ///< not written yet; rank 0 only
  Xdmf xdmf;                        ///< rank 0 only
  std::int64_t log_rows = 0;        ///< written
  double last_time = 0;             ///< of the last frame written
  bool described = false;           ///< fields and observables are known
  bool laid_out = false;            ///< the columns are open
  bool published = false;           ///< the file has its name
  bool unsynced = false;            ///< it has changed since it was last brought to disk
  bool named = true;                ///< its name is on disk, too
  std::string target;               ///< options.file, or where it leads as a link: the link stays
  std::string made;                 ///< where the file is until its first frame is whole: a file that has its final name is readable
  FileIdentity identity;            ///< of the file made, on rank 0
  TrajectoryMark mark;              ///< where a continued trajectory goes on
  std::int64_t old_frames = 0;      ///< frames it had when it was opened
  bool tail = false;                ///< it still has what was written after the mark
  std::int64_t room_end = 0;        ///< where the room ends that was made for what is being written
  std::string kept;                 ///< rank 0: the file that keeps what was cut until the next frame is whole

  // Collective over comm:
  /// `numbers`: of the state, by which it is decided who writes.
  PetscErrorCode begin(MPI_Comm on, const TrajectoryOptions& given, int dim, std::int64_t numbers);
  /// Creates and opens the file under its temporary name. `reason`: why that cannot be.
  PetscErrorCode create(std::string* reason);
  /// Gives the file, whole, its name, if it has not got it.
  PetscErrorCode publish();
  /// Is it the file that stood at `mark`, or one that went on from there? `fault` receives why not.
  PetscErrorCode recognise(const TrajectoryMark& at, std::string* fault);
  /// Before the first write to a continued trajectory: copies frames and rows of the log after the mark to a file beside it,
  /// then takes them away.
  PetscErrorCode cut_tail();
  /// On the ranks that have the file open: what it has otherwise than frames that were described.
  PetscErrorCode compare_form(FormDifferences* found);
  /// Of a frame's fields those that are written.
  std::vector<Field> written(const std::vector<Field>& given) const;
  /// Lays down which fields and observables a frame has, by the first one.
  PetscErrorCode describe(const std::vector<Field>& given, const std::vector<Observable>& observed);
  /// Keeps a frame until it is written; one that is large is not copied.
  PetscErrorCode hold_frame(std::int64_t at, double now, const std::vector<Field>& given, const std::vector<Observable>& observed);
  /// Writes the frames and rows of the log that wait, if there are any, by one extension of the datasets. `full`: why there is no room for the frame
  /// that is now the next one; what came before is written.
  PetscErrorCode write_out(std::string* full);
  /// Brings what is written to disk; `name`: also that the file has its name, where that is not there yet (file systems with a
  /// journal bring it along).
  PetscErrorCode synchronise(bool name);
  /// Closes datasets and file.
  PetscErrorCode close();

  /// Whether one more frame may wait beside those that do; never where frames are large.
  bool has_space() const { return (static_cast<std::int64_t>(steps.size()) + 1) * frame_size <= most_waiting; }
  /// Everything but frames. The tables of the ranks are gathered first where rank 0 writes for all.
  PetscErrorCode write_head(std::vector<Dataset> constants);
  PetscErrorCode replace_table(Dataset table);

  /// Upper bound of what frames and rows of the log add to the file [bytes].
  std::int64_t frame_bytes(std::int64_t count, std::int64_t rows = 0) const;
  const std::string& path() const { return published ? target : made; }
  bool holds() const { return writer && file >= 0; }

  // Collective over io:
  PetscErrorCode open(const std::string& path);
  PetscErrorCode create_log();
  PetscErrorCode open_log();
  /// Groups, growing datasets without rows, and hard links of step and time: before the first frame's data.
  PetscErrorCode lay_out();
  /// The same of a file that has them.
  PetscErrorCode find_layout();
  PetscErrorCode put_unit(const std::string& dataset, const std::string& quantity, const Powers& powers);
  /// Lets the stored end lie at byte `end` or later, and behind everything that is allocated.
  PetscErrorCode leave_room(std::int64_t end);
  /// Where what is allocated ends.
  std::int64_t allocated() const;

 private:
  std::vector<double> padded(const Observable& o) const;
  PetscErrorCode check(const std::vector<Field>& given, const std::vector<Observable>& observed) const;
  PetscErrorCode link_clock(const std::string& group);
  PetscErrorCode match(const TrajectoryMark& at, std::string* fault);
  PetscErrorCode compare_frames(const std::string& group, std::int64_t numbers, PetscInt components, FormDifferences* found);
  PetscErrorCode reserve(std::int64_t count, std::int64_t rows, std::string* full);
  /// Writes `count` of the waiting frames from number `first` on, and the rows of the log.
  PetscErrorCode put(std::int64_t first, std::int64_t count, std::int64_t rows);
  PetscErrorCode put_fields(std::int64_t first, std::int64_t count);
  PetscErrorCode make_room(std::int64_t count, std::int64_t rows);
  PetscErrorCode put_log(std::int64_t rows);
  PetscErrorCode forget(std::int64_t count);
  PetscErrorCode shorten_to_mark();
  /// The first new frame is whole: what was cut goes.
  PetscErrorCode drop_kept();
  /// Not collective. Brings the sidecar up to date; a failure causes one warning and does not end the run.
  PetscErrorCode write_xdmf(bool last);
};

/// Local. The superblock tells that the file ends at byte `end`. errno, or 0.
int store_end(const std::string& path, std::int64_t end);

/// Local. Takes away what lies behind the end that the superblock tells, and what was reserved there. errno, or 0.
int cut_behind_end(const std::string& path);

// The parts of an H5MD 1.1 file that are written once (layout: README.md).

/// Collective over `comm`, as everything here: the ranks that have the file open. /h5md, and with `units` its module of units (system SI).
PetscErrorCode write_h5md(hid_t file, MPI_Comm comm, bool units);

/// Collective. /particles/trajectory/box of `dim` dimensions; boundary: along each edge, none where it says nothing.
PetscErrorCode write_box(hid_t file, int dim, std::vector<std::string> boundary);

/// Collective. /parameters: versions and the run's `ranks`; /parameters/options: every option in force, as strings.
PetscErrorCode write_parameters(hid_t file, PetscMPIInt ranks);

/// Unit of that dimension in H5MD's notation; empty without units.
std::string unit_of(const Powers& powers, OutputUnits units);

/// Unit of a quantity by its name ("position", "kinetic_energy", ...) in H5MD's notation; empty if unknown or without units.
std::string unit_of_quantity(const std::string& name, OutputUnits units);

}  // namespace bs
