// Checks that a file can be written, before anything is computed and before each frame.
#pragma once
#include <petscsys.h>

#include <cstdint>
#include <string>

namespace bs {

/// Local. Why `file`, given by option `name`, cannot be written: it exists (and may not be overwritten), is a folder, a device, a
/// pipe or a link to nothing, or its folder cannot be written to. Empty if it can. Leaves no file behind.
std::string unwritable(const std::string& file, const char* name, bool overwrite);

/// Collective. Reports what unwritable() returns on rank 0 and ends the run with exit code 2.
PetscErrorCode require_writable(MPI_Comm comm, const std::string& file, const char* name, bool overwrite);

/// Collective. Reserves `bytes` on disk behind byte `from` of `file` (as rank 0 has it; negative: its end) without changing its length;
/// `reason` receives, on every rank, why that is impossible (disk full, quota), or nothing. A file system that cannot reserve is asked for
/// its free space instead.
PetscErrorCode reserve_space(MPI_Comm comm, const std::string& file, std::int64_t from, std::int64_t bytes, std::string* reason);

}  // namespace bs
