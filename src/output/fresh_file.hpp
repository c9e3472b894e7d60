// Files that are created under an unpredictable name and receive their final name once they are complete.
//
// A temporary name that can be guessed can be taken beforehand, by a second run or by a planted symbolic link that leads
// elsewhere. Here it holds 64 random bits, lies in the same folder, and is created with O_EXCL and O_NOFOLLOW.
#pragma once
#include <petscsys.h>
#include <sys/stat.h>
#include <cstdint>
#include <functional>
#include <string>
#include "output/h5.hpp"

namespace bs {

/// A file, whatever its name is.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  friend bool operator==(const FileIdentity& a, const FileIdentity& b) { return a.device == b.device && a.inode == b.inode; }
};

/// Local. Where `file` leads if it is a symbolic link to something that exists; else `file`.
std::string real_name(const std::string& file);

/// Local. The identity behind a name (`follow`: through symbolic links); false if there is none.
bool identity_of(const std::string& name, bool follow, FileIdentity* identity);

/// Local. Creates FILE.<16 hexadecimal digits><ending>, open for reading and writing as `*handle`. errno, or 0.
int create_fresh(const std::string& file, const char* ending, std::string* name, int* handle);

/// Local. Gives `made` the name `file`. replace = false: only if nothing has that name (EEXIST). errno, or 0.
int give_name(const std::string& made, const std::string& file, bool replace);

/// Local. `file` becomes a file with this text: a reader sees all of it or what was there before. errno, or 0.
int write_whole(const std::string& file, const std::string& text, bool replace);

/// Local. A file or folder is on disk when this returns. errno, or 0.
int bring_to_disk(const std::string& path);

/// Local. Removes files that killed runs left of FILE under names that create_fresh() made with the ending .tmp. To be called
/// only while the lock of FILE is held.
void remove_stale(const std::string& file);

/// Collective. Rank 0 creates an HDF5 file without content under a fresh name (ending .tmp), which every rank then knows
/// and opens by that name (MPI-IO has no other way). `reason`, on every rank: why it cannot be, or nothing.
PetscErrorCode create_fresh_hdf5(MPI_Comm comm, const std::string& file, std::string* name, FileIdentity* identity, std::string* reason);

/// Collective, after opening and before the first write. `reason`: the name leads to another file than the one created.
PetscErrorCode confirm_identity(MPI_Comm comm, const std::string& name, const FileIdentity& identity, std::string* reason);

// Checks that a file can be written, before anything is computed and before each frame.

/// Local. Why `file`, given by option `name`, cannot be written: it exists (and may not be overwritten), is a folder, a device, a
/// pipe or a link to nothing, or its folder cannot be written to. Empty if it can. Leaves no file behind.
std::string unwritable(const std::string& file, const char* name, bool overwrite);

/// Collective. Reports what unwritable() returns on rank 0 and ends the run with exit code 2.
PetscErrorCode require_writable(MPI_Comm comm, const std::string& file, const char* name, bool overwrite);

/// Collective. Reserves `bytes` on disk behind byte `from` of `file` (as rank 0 has it; negative: its end) without changing its length;
/// `reason` receives, on every rank, why that is impossible (disk full, quota), or nothing. A file system that cannot reserve is asked for
/// its free space instead.
PetscErrorCode reserve_space(MPI_Comm comm, const std::string& file, std::int64_t from, std::int64_t bytes, std::string* reason);

/// Collective. A new file beside `target` of some `bytes`, which `fill` writes on all ranks. Once it is whole and on disk, `put` gives the file of
/// this name that of the target on rank 0: errno, or 0. Where anything of it fails, the error is said by `watch`, and no file is left.
PetscErrorCode write_whole_hdf5(MPI_Comm comm, const IoWatch& watch, const std::string& target, std::int64_t bytes,
                                const std::function<PetscErrorCode(hid_t)>& fill, const std::function<int(const std::string&)>& put);

}  // namespace bs
