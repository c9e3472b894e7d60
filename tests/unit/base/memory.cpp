// Memory: what is left of limits, and what lattices need, against figures worked out by hand and against the arrays themselves.
#include <sys/resource.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "base/error.hpp"
#include "base/memory.hpp"
#include "lattice/generator.hpp"
#include "network/migrate.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

/// A folder of files like those of /sys/fs/cgroup, removed at the end.
struct Tree {
  Tree() {
    char name[] = "/tmp/bs_groups_XXXXXX";
    path = mkdtemp(name);
  }
  ~Tree() { (void)!std::system(("rm -r " + path).c_str()); }
  void put(const std::string& folder, const std::string& file, const std::string& text) const {
    (void)!std::system(("mkdir -p " + path + folder).c_str());
    std::ofstream(path + folder + "/" + file) << text;
  }
  std::string path;
};

GeneratorSpec spec_of(LatticeType type, std::vector<std::int64_t> size, int neighbors) {
  GeneratorSpec spec;
  spec.type = type;
  spec.size = std::move(size);
  spec.neighbors = neighbors;
  return spec;
}

/// While it lives, this process may hold no more than `more` bytes of addresses beyond those it has.
struct Limited {
  explicit Limited(double more) {
    getrlimit(RLIMIT_AS, &before);
    rlimit tight = before;
    tight.rlim_cur = static_cast<rlim_t>(memory_use().addresses + more);
    setrlimit(RLIMIT_AS, &tight);
  }
  ~Limited() { setrlimit(RLIMIT_AS, &before); }
  rlimit before = {};
};

}  // namespace

TEST_CASE("what a limit leaves") {
  REQUIRE(left_of(100, 30, 0) == 70);
  REQUIRE(left_of(100, 30, 10) == 80);
  REQUIRE(left_of(100, 30, 50) == 100);  // what malloc has kept counts no more than what is used
  REQUIRE(left_of(100, 130, 10) == 0);
  REQUIRE(std::isinf(left_of(INFINITY, 130, 10)));
}

TEST_CASE("numbers of /proc files are found by whole names") {
  const std::string text = "MemTotal:       24684084 kB\nMemAvailable:   1000 kB\nSwapFree:  24 kB\nfile 17\nfile_mapped 3";
  REQUIRE(number_of(text, "MemAvailable", -1) == 1000);
  REQUIRE(number_of(text, "file", -1) == 17);
  REQUIRE(number_of(text, "mapped", -1) == -1);
  REQUIRE(number_of("", "file", 5) == 5);
  REQUIRE(machine_room(text).bytes == 1024 * 1024);
  REQUIRE(std::isinf(machine_room("MemFree: 3 kB\n").bytes));  // kernels before 3.14: nothing is known
}

TEST_CASE("control groups of version 2 leave what the tightest one above leaves") {
  const Tree tree;
  tree.put("/job", "memory.max", "1000000\n");
  tree.put("/job", "memory.current", "700000\n");
  tree.put("/job", "memory.stat", "anon 500000\ninactive_file 100000\nactive_file 50000\nslab_reclaimable 1000\n");
  tree.put("/job", "memory.swap.max", "0\n");
  tree.put("/job/task", "memory.max", "max\n");
  const MemoryRoom room = group_room(tree.path, "0::/job/task\n", 5e6);
  REQUIRE(room.bytes == 1000000 - (700000 - 151000));
  REQUIRE(room.bound == tree.path + "/job");
  tree.put("/job", "memory.swap.max", "max\n");
  REQUIRE(group_room(tree.path, "0::/job/task\n", 5e6).bytes == 1000000 - (700000 - 151000) + 5e6);
  tree.put("/job", "memory.swap.max", "3000\n");
  tree.put("/job", "memory.swap.current", "1000\n");
  REQUIRE(group_room(tree.path, "0::/job/task\n", 5e6).bytes == 1000000 - (700000 - 151000) + 2000);
  REQUIRE(std::isinf(group_room(tree.path, "0::/elsewhere\n", 0).bytes));
}

TEST_CASE("control groups of version 1") {
  const Tree tree;
  tree.put("/memory/job", "memory.limit_in_bytes", "2000000\n");
  tree.put("/memory/job", "memory.usage_in_bytes", "900000\n");
  tree.put("/memory/job", "memory.stat", "cache 1\ntotal_inactive_file 100000\ntotal_active_file 0\n");
  tree.put("/memory", "memory.limit_in_bytes", "9223372036854771712\n");
  const std::string cgroups = "5:devices:/\n4:cpu,memory:/job\n0::/\n";
  REQUIRE(group_room(tree.path, cgroups, 0).bytes == 1200000);
  REQUIRE(group_room(tree.path, cgroups, 7).bytes == 1200007);
  tree.put("/memory/job", "memory.memsw.limit_in_bytes", "2000003\n");
  REQUIRE(group_room(tree.path, cgroups, 7).bytes == 1200003);
}

TEST_CASE("bytes in words") {
  REQUIRE(in_bytes(512e6) == "512 MB");
  REQUIRE(in_bytes(9.83e9) == "9.83 GB");
  REQUIRE(in_bytes(2.412e12) == "2.41 TB");
}

TEST_CASE("springs are counted before they are laid") {
  for (const LatticeType type : {LatticeType::chain, LatticeType::square, LatticeType::triangular, LatticeType::cloth, LatticeType::cubic,
                                 LatticeType::bcc, LatticeType::fcc, LatticeType::kagome, LatticeType::honeycomb, LatticeType::diamond})
    for (const int neighbors : type_info(type).neighbors)
      for (const std::int64_t n : {1, 2, 5}) {
        std::vector<std::int64_t> size{n, 4, 3};
        size.resize(static_cast<std::size_t>(type_info(type).axes));
        const GeneratorSpec spec = spec_of(type, size, neighbors);
        INFO(type_info(type).name << " " << neighbors << " neighbours, " << n);
        REQUIRE(spring_count(spec) == generate(spec, 0, 1).springs.count);
      }
}

TEST_CASE("a chunk takes the bytes of its arrays") {
  const Lattice l = generate(spec_of(LatticeType::cubic, {6, 5, 4}, 0), 0, 1);
  const auto bytes = [](const auto& list) { return static_cast<double>(list.size() * sizeof(list[0])); };
  const double held = bytes(l.position) + bytes(l.velocity) + bytes(l.mass) + bytes(l.fixed) + bytes(l.pairs) + bytes(l.stiffness) +
                      bytes(l.rest_length) + bytes(l.damping);
  REQUIRE(chunk_bytes({l.particles.count, l.springs.count, 0, 3}, 1) == held);
  REQUIRE(chunk_bytes({l.particles.count, l.springs.count, 0, 3}, 4) == held / 4);
  REQUIRE(lattice_bytes({l.particles.count, l.springs.count, 0, 3}, 1) > held);
}

TEST_CASE("what one rank cannot have is told once") {
  const Handled handled;
  const int rank = rank_of(PETSC_COMM_WORLD), size = size_of(PETSC_COMM_WORLD);
  REQUIRE(reserve_memory(PETSC_COMM_WORLD, {"a little", 64e6, ""}) == 0);
  REQUIRE(reserve_memory(PETSC_COMM_WORLD, {"next to nothing", 1e3, ""}) == 0);
  {
    Caught said;
    REQUIRE(reserve_memory(PETSC_COMM_WORLD, {"a giant", 1e17, "take less"}) == ERR_FAILED);
    const std::string text = said.text();
    REQUIRE((text.find("backspring: error: a giant needs at least 1e+05 TB of memory") == 0) == (rank == 0));
    REQUIRE((text.find("take less, or start it anyway with -bs_memory_check false\n") != std::string::npos) == (rank == 0));
  }
#ifndef __SANITIZE_ADDRESS__
  PetscErrorCode status = 0;
  std::string text;
  {
    Caught said;
    if (rank == size - 1) {
      const Limited limited(64e6);
      status = reserve_memory(PETSC_COMM_WORLD, {"more than the limit", 4e9, ""});
    } else {
      status = reserve_memory(PETSC_COMM_WORLD, {"more than the limit", 4e9, ""});
    }
    text = said.text();
  }
  REQUIRE(status == ERR_FAILED);
  REQUIRE(last_error(PETSC_COMM_WORLD).exit == Exit::input);
  REQUIRE((text.find("(ulimit -v) leaves") != std::string::npos) == (rank == 0));
  INFO(text);
  if (rank == 0) REQUIRE(text.find('\n') == text.size() - 1);
#endif
}
