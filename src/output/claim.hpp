// The files that a run will write: checked before anything is computed, and locked while the run lasts.
#pragma once
#include <petscsys.h>

#include <string>
#include <vector>

#include "output/run_lock.hpp"

namespace bs {

/// What the options name; empty: none.
struct RunFiles {
  std::string output, checkpoint, report;
  std::string restart;   ///< the checkpoint that is read
  std::string matrices;  ///< what the names of the matrices begin with
  std::vector<std::string> matrix_files;
  bool xdmf = true;        ///< output + ".xdmf" is kept, too
  bool overwrite = false;  ///< -bs_overwrite
  bool resumes = false;    ///< an existing output is continued, not replaced
};

class Claim {
 public:
  /// Collective. Ends the run with exit code 2 for: two names for one file, among those written and against every input and option file; a
  /// file that exists and may not be replaced, or is not a regular file; foreign files under a name that the program derives
  /// by itself (.xdmf, .previous, .checkpoint, .lock); another run that writes one of them, or makes such a name; names too long for
  /// what is made of them.
  PetscErrorCode take(MPI_Comm comm, const RunFiles& files);

 private:
  RunLock lock_;  ///< of rank 0
};

/// Local. Whether `file` is a checkpoint of this program's, by what HDF5 finds in it.
bool is_checkpoint(const std::string& file);

}  // namespace bs
