// A check of the memory that is about to be allocated against what is available, before libraries run out of memory halfway.
#pragma once
#include <petscsys.h>
#include <limits>
#include <string>

namespace bs {

struct MemoryNeed {
  std::string what;  ///< what needs the memory: the subject of "... needs at least 9.8 GB of memory"
  double bytes = 0;  ///< needed on this rank: a lower bound of the new memory that is held at one time, so that no run is refused that would succeed
  std::string advice;  ///< a remedy beside more memory or ranks, such as "give -pc_type jacobi", or empty
};

/// Collective. Ends the run, with the exit code of the present phase, if some rank cannot get its bytes: because a limit on the process
/// (ulimit -v, -d), a control group or the machine leaves less to the ranks on it, or the system refuses a mapping of that
/// size, made and undone here. Requests below 4 MB on every rank are not checked.
PetscErrorCode reserve_memory(MPI_Comm comm, const MemoryNeed& need);

/// Collective. Reads -bs_memory_check; by default reserve_memory checks.
PetscErrorCode read_memory_option(MPI_Comm comm);

// How much memory this process can still allocate: its own limits, those of its control group, and what the machine has left.

/// The memory that a limit leaves [bytes], infinity without a limit, and the name of the limit for messages.
struct MemoryRoom {
  double bytes = std::numeric_limits<double>::infinity();
  std::string bound;
};

/// Memory held by the process [bytes], from /proc/self/status; 0 where that cannot be read, so that the room is overestimated.
struct MemoryUse {
  double addresses = 0;  ///< VmSize: what ulimit -v counts
  double data = 0;       ///< VmData: what ulimit -d counts
  double reusable = 0;   ///< freed memory that malloc keeps; part of both of the above
};
MemoryUse memory_use();

/// Bytes that a limit leaves to a process that holds `used`, of which `reusable` can be used again.
double left_of(double limit, double used, double reusable);

/// The tighter one of ulimit -v and ulimit -d.
MemoryRoom process_room(const MemoryUse& use);

/// Memory that the machine can give without taking any from other processes: MemAvailable + SwapFree, from the text of /proc/meminfo.
MemoryRoom machine_room(const std::string& meminfo);

/// What the control group of a process and the groups above it leave (file cache and free swap count as room), for the text
/// of /proc/self/cgroup; `root`: /sys/fs/cgroup. The bound names the group's folder: processes that share it share the room.
MemoryRoom group_room(const std::string& root, const std::string& cgroups, double free_swap);

/// Whether less than 16 MB are left, so that a failure in a library is probably due to lack of memory. Safe in a signal handler.
bool out_of_memory();

/// Text to append to a library's error message: lack of memory, where that is the likely cause; else empty.
std::string if_out_of_memory();

/// The number after "NAME:" or "NAME " at the beginning of a line; `otherwise` where there is none.
double number_of(const std::string& text, const std::string& name, double otherwise);

/// The contents of a small file; empty where it cannot be read.
std::string contents_of(const std::string& path);

/// "512 MB", "9.83 GB", "2.41 TB".
std::string in_bytes(double bytes);

}  // namespace bs
