// What Trajectory holds: the open file and its growing datasets.
#pragma once
#include <petscviewerhdf5.h>

#include <string>
#include <vector>

#include "base/handle.hpp"
#include "output/fresh_file.hpp"
#include "output/tables.hpp"
#include "output/trajectory.hpp"
#include "output/xdmf.hpp"

namespace bs {

/// Columns of /backspring/log before those of rejected attempts, "rejected_" and the reason's key each.
inline constexpr const char* STEP_COLUMNS[] = {"step", "time", "dt", "newton", "krylov", "rejected"};
/// All of them, in the order in which rows are written.
std::vector<std::string> log_columns();

inline constexpr int frame_chunk = 256;  ///< rows allocated at a time in datasets with one row a frame
inline constexpr int log_chunk = 512;

struct Trajectory::Impl {
  MPI_Comm comm = MPI_COMM_NULL;
  TrajectoryOptions options;
  int columns = 0;  ///< components written per particle; 0 without particles
  PetscMPIInt rank = 0;
  ViewerHandle viewer;
  hid_t file = -1;  ///< the viewer's, borrowed
  std::int64_t frames = 0;
  bool usable = true;  ///< false after a failed write: only to be closed

  std::vector<std::string> groups;  ///< of the fields, in the order of the first frame
  std::vector<VecHandle> padded;    ///< per field; empty unless components are appended
  std::vector<std::string> names;   ///< of the observables
  std::vector<H5> values;           ///< per field, the dataset its frames are in
  std::vector<Column> observables;
  Column step, time, edges;
  std::vector<Column> log;
  std::vector<StepRecord> records;  ///< not written yet; rank 0 only
  Xdmf xdmf;                        ///< rank 0 only
  std::int64_t log_rows = 0;        ///< written
  double last_time = 0;             ///< of the last frame
  bool laid_out = false;            ///< the columns are open
  bool published = false;           ///< the file has its name
  std::string target;               ///< options.file, or where it leads as a link: the link stays
  std::string made;                 ///< where the file is until its first frame is whole: a file that has its final name is readable
  FileIdentity identity;            ///< of the file made, on rank 0
  TrajectoryMark mark;              ///< where a continued trajectory goes on
  std::int64_t old_frames = 0;      ///< frames it had when it was opened
  bool tail = false;                ///< it still has what was written after the mark
  std::string kept;                 ///< rank 0: the file that keeps what was cut until the next frame is whole

  /// All collective.
  PetscErrorCode begin(MPI_Comm on, const TrajectoryOptions& given, int dim);
  /// Opens `path` for writing.
  PetscErrorCode open(const std::string& path);
  /// Creates and opens the file under its temporary name. `reason`: why that cannot be.
  PetscErrorCode create(std::string* reason);
  /// Gives the file, whole on disk, its name, if it has not got it.
  PetscErrorCode publish();
  const std::string& path() const { return published ? target : made; }
  PetscErrorCode create_log();
  /// Groups, growing datasets without rows, and hard links of step and time: before the first frame's data.
  PetscErrorCode lay_out(const std::vector<Field>& fields, const std::vector<Observable>& given);
  /// The same of a file that has them.
  PetscErrorCode find_layout(const std::vector<Field>& fields, const std::vector<Observable>& given);
  PetscErrorCode open_log();
  /// Is it the file that stood at `mark`, or one that went on from there? `fault` receives why not.
  PetscErrorCode recognise(const TrajectoryMark& at, std::string* fault);
  /// Before the first write to a continued trajectory: copies frames and rows of the log after the mark to a file beside it,
  /// then takes them away.
  PetscErrorCode cut_tail();
  /// The first new frame is whole: what was cut goes.
  PetscErrorCode drop_kept();
  PetscErrorCode check(const std::vector<Field>& fields, const std::vector<Observable>& given) const;
  /// Allocates what `more` frames (0 or 1) and the waiting rows of the log take, at most `bytes`.
  PetscErrorCode make_room(std::int64_t more, std::int64_t bytes);
  /// Lets the stored end lie at least `bytes` behind what was allocated at the last flush.
  PetscErrorCode leave_room(std::int64_t bytes);
  PetscErrorCode write(std::int64_t at, double now, const std::vector<Field>& fields, const std::vector<Observable>& given);
  PetscErrorCode write_log();
  /// Not collective. Brings the sidecar up to date; a failure causes one warning and does not end the run.
  PetscErrorCode write_xdmf(bool last);
  PetscErrorCode write_field(std::size_t index, const Field& field);
  /// Upper bound of what a frame adds to the file [bytes].
  PetscErrorCode frame_bytes(const std::vector<Field>& fields, const std::vector<Observable>& given, std::int64_t* bytes) const;
  PetscErrorCode put_unit(const std::string& dataset, const std::string& quantity);
  /// Closes datasets and file.
  PetscErrorCode close();

 private:
  PetscErrorCode link_clock(const std::string& group);
  PetscErrorCode create_values(const Field& field);
  /// Numbers a row has in the file, of a field with `block` a row.
  PetscInt width_of(const std::string& group, PetscInt block) const;
  PetscErrorCode pad(std::size_t index, Vec vec, Vec* out);
};

}  // namespace bs
