#include "base/memory.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "base/fault.hpp"
#include "base/memory_room.hpp"
#include "base/options.hpp"

namespace bs {

namespace {

constexpr double SMALL = 4e6;  // bytes not worth the question
bool checks = true;

/// A mapping while it lives, as large as what is to be allocated: it meets the limits that nothing here reads.
class Trial {
 public:
  explicit Trial(double bytes) {
    if (bytes < 1) return;
    if (bytes < 1e18) length_ = static_cast<std::size_t>(bytes);
    start_ = length_ ? mmap(nullptr, length_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) : MAP_FAILED;
    failed_ = start_ == MAP_FAILED;
  }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial() {
    if (length_ && !failed_) (void)munmap(start_, length_);
  }
  bool failed() const { return failed_; }

 private:
  void* start_ = nullptr;
  std::size_t length_ = 0;
  bool failed_ = false;
};

/// What the ranks of this machine take together: all of them, and those that share this rank's control group.
struct Together {
  int ranks = 1, group_ranks = 1;
  double bytes = 0, group_bytes = 0;
};

PetscErrorCode add_up(MPI_Comm comm, double bytes, const std::string& group, Together* out) {
  MPI_Comm node;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node));
  PetscCallMPI(MPI_Comm_size(node, &out->ranks));
  const std::size_t ranks = static_cast<std::size_t>(out->ranks);
  const unsigned long long mine = std::hash<std::string>()(group);
  std::vector<unsigned long long> groups(ranks);
  std::vector<double> all(ranks);
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_UNSIGNED_LONG_LONG, groups.data(), 1, MPI_UNSIGNED_LONG_LONG, node));
  PetscCallMPI(MPI_Allgather(&bytes, 1, MPI_DOUBLE, all.data(), 1, MPI_DOUBLE, node));
  PetscCallMPI(MPI_Comm_free(&node));
  out->group_ranks = 0;
  for (std::size_t k = 0; k < ranks; ++k) {
    out->bytes += all[k];
    if (groups[k] == mine) out->group_bytes += all[k];
    out->group_ranks += groups[k] == mine;
  }
  PetscFunctionReturn(0);
}

std::string on_ranks(int count) { return count > 1 ? format("%d ranks on this machine share", count) : std::string("one process has"); }

/// What stands in the way of `bytes` on this rank, and what to do about it; empty if nothing does.
std::string obstacle(double bytes, const MemoryRoom& own, const MemoryRoom& group, const MemoryRoom& machine, const Together& together,
                     const Trial& trial) {
  if (bytes > own.bytes) return own.bound + " leaves " + in_bytes(own.bytes) + ": raise it, use more ranks, ";
  if (together.group_bytes > group.bytes)
    return "the memory limit of the control group " + group.bound + " leaves " + in_bytes(group.bytes) + ", which " + on_ranks(together.group_ranks) +
           ": raise it, use more machines, ";
  if (together.bytes > machine.bytes)
    return "the machine has " + in_bytes(machine.bytes) + " left (" + machine.bound + "), which " + on_ranks(together.ranks) +
           ": use more machines, ";
  if (trial.failed()) return "the system gives no such amount (a limit, or vm.overcommit_memory): use more machines, ";
  return {};
}

}  // namespace

PetscErrorCode read_memory_option(MPI_Comm comm) {
  PetscFunctionBegin;
  checks = true;
  PetscCall(read_section(comm, "Memory", [](Section& o) {
    o.flag("-bs_memory_check", "refuse a run that needs more memory than the limits and the machine leave; false: start it anyway", checks);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode reserve_memory(MPI_Comm comm, const MemoryNeed& need) {
  double most = need.bytes;
  int size = 1, rank = 0;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, comm));
  if (!checks || most < SMALL) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  const MemoryUse use = memory_use();
  const double fresh = std::max(0.0, need.bytes - use.reusable);
  const std::string meminfo = contents_of("/proc/meminfo");
  const MemoryRoom group = group_room("/sys/fs/cgroup", contents_of("/proc/self/cgroup"), 1024 * number_of(meminfo, "SwapFree", 0));
  Together together;
  PetscCall(add_up(comm, fresh, group.bound, &together));
  const Trial trial(fresh);
  const std::string reason = obstacle(need.bytes, process_room(use), group, machine_room(meminfo), together, trial);
  Fault fault;
  if (!reason.empty())
    fault.note(rank,
               need.what + " needs at least " + in_bytes(need.bytes) + " of memory" + (size > 1 ? format(" on each of %d ranks", size) : "") + "; " +
                   reason + (need.advice.empty() ? "take a smaller system" : need.advice) + ", or start it anyway with -bs_memory_check false",
               present_phase());
  PetscCall(agree(comm, fault));  // after which all trials are undone
  PetscFunctionReturn(0);
}

}  // namespace bs
