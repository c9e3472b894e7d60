// One writer per file: an advisory lock on FILE.lock, held by one process for the life of the run.
//
// The lock is on a file of its own, so that readers of FILE (HDF5 locks what it opens) are not blocked. It is a lock of flock(2):
// the system frees it when the process ends, however it ends, and NFS clients carry it to the server, so that it holds
// between hosts. A run that is killed leaves FILE.lock, unlocked; the next run takes it over.
#pragma once
#include <string>
#include <vector>

namespace bs {

class RunLock {
 public:
  RunLock() = default;
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;
  /// Removes the lock files and frees the locks.
  ~RunLock();
  /// Local; to be called on one rank. Takes the lock of `file`, given by `option`. Returns what is wrong (another run holds it:
  /// its host and process; the lock file belongs to another user), or nothing. `warning`: a file system without locks.
  std::string take(const std::string& file, const char* option, std::string* warning);
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

}  // namespace bs
