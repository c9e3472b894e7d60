// The files that a run will write: checked before anything is computed, and locked while the run lasts.
#pragma once
#include <petscsys.h>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// One writer per file: an advisory lock on FILE.lock, held by one process for the life of the run.
///
/// The lock is on a file of its own, so that readers of FILE (HDF5 locks what it opens) are not blocked. It is a lock of
/// flock(2): the system frees it when the process ends, however it ends, and NFS clients carry it to the server, so that
/// it holds between hosts. A run that is killed leaves FILE.lock, unlocked; the next run takes it over.
class RunLock {
 public:
  RunLock() = default;
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;
  /// Removes the lock files and frees the locks.
  ~RunLock();
  /// Local; to be called on one rank. Takes the lock of `file`, given by `option`. Returns what is wrong (another run holds it:
  /// its host and process; the lock file belongs to another user), or nothing. `warning`: a file system without locks.
  std::string acquire(const std::string& file, const char* option, std::string* warning);
  /// Local. Says so if another run has the lock of `file`, which this one has not; does not take it.
  std::string held_elsewhere(const std::string& file, const char* option) const;

 private:
  struct Held {
    std::string path;
    int handle;
  };
  std::vector<Held> held_;
};

/// Local. The name of the lock of `file`.
std::string lock_name(const std::string& file);

/// What the options name; empty: none.
struct RunFiles {
  std::string output, checkpoint, report;
  std::string restart;   ///< the checkpoint that is read
  std::string matrices;  ///< what the names of the matrices begin with
  std::vector<std::string> matrix_files;
  std::vector<std::pair<std::string, std::string>> inputs;  ///< read so far: option and path
  bool xdmf = true;                                         ///< output + ".xdmf" is kept, too
  bool overwrite = false;                                   ///< -bs_overwrite
  bool resumes = false;                                     ///< an existing output is continued, not replaced
};

class OutputLocks {
 public:
  /// Collective. Ends the run with exit code 2 for: two names for one file, among those written and against every input and option file; a
  /// file that exists and may not be replaced, or is not a regular file; foreign files under a name that the program derives
  /// by itself (.xdmf, .previous, .checkpoint, .lock); another run that writes one of them, or makes such a name; names too long for
  /// what is made of them.
  PetscErrorCode acquire(MPI_Comm comm, const RunFiles& files);
  /// Local, to be called on one rank. Why another file of the run's may not be written under that name: what it writes or has read is there.
  /// Checkpoints may be replaced. Empty: it may.
  std::string taken(const std::string& file) const;

 private:
  RunFiles files_;
  RunLock lock_;  ///< of rank 0
};

/// Local. Whether `file` is a checkpoint of this program's, by what HDF5 finds in it.
bool is_checkpoint(const std::string& file);

}  // namespace bs
