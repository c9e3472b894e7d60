#include "base/memory.hpp"
#include <sys/mman.h>
#include <sys/resource.h>
#include <algorithm>
#include <functional>
#include <vector>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/options.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <cstdlib>
#include <fstream>
#include <sstream>
#include "base/text.hpp"

namespace bs {

namespace {

constexpr double SMALL = 4e6;  // bytes not worth the question

/// -bs_memory_check.
struct MemoryCheck {
  bool on = true;
};

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
  bool& checks = held_by<MemoryCheck>(comm).on;
  checks = true;
  PetscCall(read_section(comm, "Memory", [&](Section& o) {
    o.flag("-bs_memory_check", "refuse a run that needs more memory than the limits and the machine leave; false: start it anyway", checks);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode reserve_memory(MPI_Comm comm, const MemoryNeed& need) {
  double most = need.bytes;
  PetscFunctionBegin;
  PetscCall(max_over_ranks(comm, &most));
  if (!held_by<MemoryCheck>(comm).on || most < SMALL) PetscFunctionReturn(0);
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  const MemoryUse use = memory_use();
  const double fresh = std::max(0.0, need.bytes - use.reusable);
  const std::string meminfo = contents_of("/proc/meminfo");
  const MemoryRoom group = group_room("/sys/fs/cgroup", contents_of("/proc/self/cgroup"), 1024 * number_of(meminfo, "SwapFree", 0));
  Together together;
  PetscCall(add_up(comm, fresh, group.bound, &together));
  const Trial trial(fresh);
  const std::string reason = obstacle(need.bytes, process_room(use), group, machine_room(meminfo), together, trial);
  Error fault;
  if (!reason.empty())
    fault.note(rank,
               need.what + " needs at least " + in_bytes(need.bytes) + " of memory" + (size > 1 ? format(" on each of %d ranks", size) : "") + "; " +
                   reason + (need.advice.empty() ? "take a smaller system" : need.advice) + ", or start it anyway with -bs_memory_check false",
               present_phase(comm));
  PetscCall(fail_if_any(comm, fault));  // after which all trials are undone
  PetscFunctionReturn(0);
}

namespace {

constexpr double NONE = std::numeric_limits<double>::infinity();

double kept_by_malloc() {
#ifdef __GLIBC__
#if __GLIBC_PREREQ(2, 33)
  return static_cast<double>(mallinfo2().fordblks);
#else
  return static_cast<double>(static_cast<unsigned>(mallinfo().fordblks));
#endif
#else
  return 0;
#endif
}

double limit_of(int resource) {
  rlimit limit = {};
  if (getrlimit(resource, &limit) || limit.rlim_cur == RLIM_INFINITY) return NONE;
  return static_cast<double>(limit.rlim_cur);
}

/// The number in a file of a control group; "max" and what cannot be read bound nothing.
double number_in(const std::string& path, double otherwise) {
  const std::string text = contents_of(path);
  if (text.empty() || text.compare(0, 3, "max") == 0) return otherwise;
  return std::strtod(text.c_str(), nullptr);
}

/// Version 2: limits of memory and of swap are apart.
double room_of_v2(const std::string& folder, double free_swap) {
  const double limit = number_in(folder + "/memory.max", NONE);
  if (limit == NONE) return NONE;
  const std::string stat = contents_of(folder + "/memory.stat");
  const double cache = number_of(stat, "inactive_file", 0) + number_of(stat, "active_file", 0) + number_of(stat, "slab_reclaimable", 0);
  const double swap = std::max(0.0, number_in(folder + "/memory.swap.max", NONE) - number_in(folder + "/memory.swap.current", 0));
  return left_of(limit, number_in(folder + "/memory.current", 0), cache) + std::min(swap, free_swap);
}

/// Version 1: the second limit counts memory and swap together.
double room_of_v1(const std::string& folder, double free_swap) {
  const double limit = number_in(folder + "/memory.limit_in_bytes", NONE);
  if (limit >= 1e18) return NONE;  // how version 1 writes that there is none
  const std::string stat = contents_of(folder + "/memory.stat");
  const double cache = number_of(stat, "total_inactive_file", 0) + number_of(stat, "total_active_file", 0);
  const double swap = std::max(0.0, number_in(folder + "/memory.memsw.limit_in_bytes", NONE) - limit);
  return left_of(limit, number_in(folder + "/memory.usage_in_bytes", 0), cache) + std::min(swap, free_swap);
}

/// The tightest of the groups from `path` up to the root of the tree at `mount`.
template <class Room>
void find_tightest(const std::string& mount, std::string path, Room&& room, MemoryRoom* out) {
  for (;;) {
    while (!path.empty() && path.back() == '/') path.pop_back();
    const std::string folder = mount + path;
    const double bytes = room(folder);
    if (bytes < out->bytes) *out = {bytes, folder};
    if (path.empty()) return;
    path.erase(path.rfind('/'));
  }
}

}  // namespace

std::string contents_of(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (file) text << file.rdbuf();
  return text.str();
}

double number_of(const std::string& text, const std::string& name, double otherwise) {
  for (std::size_t at = 0; at != std::string::npos && at < text.size();) {
    const std::size_t next = at + name.size();
    if (text.compare(at, name.size(), name) == 0 && next < text.size() && (text[next] == ':' || text[next] == ' '))
      return std::strtod(text.c_str() + next + 1, nullptr);
    at = text.find('\n', at);
    if (at != std::string::npos) ++at;
  }
  return otherwise;
}

MemoryUse memory_use() {
  const std::string status = contents_of("/proc/self/status");
  return {1024 * number_of(status, "VmSize", 0), 1024 * number_of(status, "VmData", 0), kept_by_malloc()};
}

double left_of(double limit, double used, double reusable) { return std::max(0.0, limit - std::max(0.0, used - reusable)); }

MemoryRoom process_room(const MemoryUse& use) {
  const MemoryRoom addresses{left_of(limit_of(RLIMIT_AS), use.addresses, use.reusable), "the limit on the addresses of a process (ulimit -v)"};
  const MemoryRoom data{left_of(limit_of(RLIMIT_DATA), use.data, use.reusable), "the limit on the data of a process (ulimit -d)"};
  return addresses.bytes < data.bytes ? addresses : data;
}

MemoryRoom machine_room(const std::string& meminfo) {
  MemoryRoom room;
  const double available = number_of(meminfo, "MemAvailable", -1);
  if (available >= 0) room = {1024 * (available + number_of(meminfo, "SwapFree", 0)), "MemAvailable and SwapFree of /proc/meminfo"};
  return room;
}

MemoryRoom group_room(const std::string& root, const std::string& cgroups, double free_swap) {
  MemoryRoom room;
  std::istringstream lines(cgroups);
  for (std::string line; std::getline(lines, line);) {  // ID:CONTROLLERS:PATH; no controllers are named for version 2
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",", path = line.substr(second + 1);
    if (controllers == ",,")
      find_tightest(
          root, path, [&](const std::string& folder) { return room_of_v2(folder, free_swap); }, &room);
    else if (controllers.find(",memory,") != std::string::npos)
      find_tightest(
          root + "/memory", path, [&](const std::string& folder) { return room_of_v1(folder, free_swap); }, &room);
  }
  return room;
}

bool out_of_memory() {
  constexpr std::size_t LEAST = 1 << 24;
  void* const trial = mmap(nullptr, LEAST, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (trial == MAP_FAILED) return true;
  (void)munmap(trial, LEAST);
  return false;
}

std::string if_out_of_memory() {
  return out_of_memory() ? "; most probably for lack of memory, as less than 16 MB are left: raise the memory limit, or use more ranks" : "";
}

std::string in_bytes(double bytes) {
  if (bytes < 9.995e8) return format("%.0f MB", bytes / 1e6);
  return bytes < 9.995e11 ? format("%.3g GB", bytes / 1e9) : format("%.3g TB", bytes / 1e12);
}

}  // namespace bs
