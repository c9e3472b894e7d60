// One writer per file: who has the lock, who is refused, and what becomes of the lock file.
#include <sys/stat.h>
#include <unistd.h>
#include <catch2/catch.hpp>
#include <fstream>
#include <memory>
#include <sstream>
#include "output/output_locks.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

/// A name of this rank's own.
std::string file_of_rank(const char* name) { return std::string(name) + std::to_string(rank_of(PETSC_COMM_WORLD)) + ".h5md"; }

bool exists(const std::string& file) { return access(file.c_str(), F_OK) == 0; }

std::string read(const std::string& file) {
  std::ostringstream all;
  all << std::ifstream(file).rdbuf();
  return all.str();
}

}  // namespace

TEST_CASE("a file has one writer until its lock is given up") {
  const std::string file = file_of_rank("unit_lock_");
  std::string warning;
  auto first = std::make_unique<RunLock>();
  REQUIRE(first->acquire(file, "-bs_output", &warning).empty());
  REQUIRE(warning.empty());
  REQUIRE(first->acquire(file, "-bs_output", &warning).empty());  // it has it already
  REQUIRE(exists(lock_name(file)));
  CHECK(read(lock_name(file)).find("process " + std::to_string(static_cast<long>(getpid()))) != std::string::npos);

  RunLock second;
  CHECK(second.acquire(file, "-bs_output", &warning).find(file + ": another run writes it, process ") == 0);
  CHECK(second.held_elsewhere(file, "-bs_output").find("another run writes it") != std::string::npos);
  CHECK(first->held_elsewhere(file, "-bs_output").empty());

  first.reset();
  CHECK_FALSE(exists(lock_name(file)));
  CHECK(second.held_elsewhere(file, "-bs_output").empty());
  CHECK(second.acquire(file, "-bs_output", &warning).empty());
}

TEST_CASE("the lock file of a run that was killed is taken over, a foreign file is left alone") {
  const std::string file = file_of_rank("unit_left_"), lock = lock_name(file);
  std::string warning, text;
  {
    RunLock killed;
    REQUIRE(killed.acquire(file, "-bs_output", &warning).empty());
    text = read(lock);
  }
  std::ofstream(lock) << text;  // nobody holds it
  {
    RunLock next;
    CHECK(next.acquire(file, "-bs_output", &warning).empty());
  }
  CHECK_FALSE(exists(lock));
  std::ofstream(lock) << "notes of mine\n";
  {
    RunLock next;
    CHECK_FALSE(next.acquire(file, "-bs_output", &warning).empty());
  }
  CHECK(read(lock) == "notes of mine\n");
  REQUIRE(unlink(lock.c_str()) == 0);
  const std::string elsewhere = file_of_rank("unit_elsewhere_");
  REQUIRE(symlink(elsewhere.c_str(), lock.c_str()) == 0);
  {
    RunLock next;
    CHECK(next.acquire(file, "-bs_output", &warning).find("is a symbolic link") != std::string::npos);
  }
  CHECK_FALSE(exists(elsewhere));
  REQUIRE(unlink(lock.c_str()) == 0);
}
