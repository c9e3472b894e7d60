// Can it be written? Asked before anything is computed, and before each frame.
#pragma once
#include <petscsys.h>

#include <cstdint>
#include <string>

namespace bs {

/// Collective. Tells (exit 2) if `file`, given by option `name`, exists and may not be overwritten, or cannot be
/// written. Leaves no file behind.
PetscErrorCode require_writable(MPI_Comm comm, const std::string& file, const char* name, bool overwrite);

/// Collective. Reserves `bytes` on disk behind the end of `file` without changing its length; `reason` receives, on
/// every rank, why that is impossible (disk full, quota), or nothing. A file system that cannot reserve is asked for
/// its free space instead.
PetscErrorCode reserve_space(MPI_Comm comm, const std::string& file, std::int64_t bytes, std::string* reason);

}  // namespace bs
