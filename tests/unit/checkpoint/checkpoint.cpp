// A checkpoint gives back every bit that it was given, keeps the one before, and refuses what it does not belong to.
#include "checkpoint/checkpoint.hpp"
#include <unistd.h>
#include <cmath>
#include <fstream>
#include <limits>
#include "small_model.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

class Decay final : public SmallModel {
 public:
  using SmallModel::SmallModel;
  std::vector<double> rates(double, const std::vector<double>& y) const override { return y; }
};

/// Numbers of this rank that are no round ones.
std::vector<double> numbers(double phase) {
  std::vector<double> all;
  for (int k = 0; k < 5; ++k) all.push_back(std::sin(phase + 5 * rank_of(PETSC_COMM_WORLD) + k) / 3);
  return all;
}

VecHandle vector_of(Model& model, const std::vector<double>& values) {
  VecHandle y;
  REQUIRE(VecDuplicate(model.initial_state(), y.out()) == 0);
  SmallModel::set(y, values);
  return y;
}

Facts facts_of(double time) {
  Facts run;
  run.real = {{"time", time}, {"tiny", std::numeric_limits<double>::denorm_min()}};
  run.whole = {{"step", std::int64_t{1} << 40}, {"rejected", -3}};
  run.text = {{"note", "two words"}};
  return run;
}

void remove_all(const std::string& file) {
  MPI_Barrier(PETSC_COMM_WORLD);
  if (rank_of(PETSC_COMM_WORLD) == 0)
    for (const std::string& name : {file, previous_checkpoint(file)}) (void)unlink(name.c_str());
  MPI_Barrier(PETSC_COMM_WORLD);
}

}  // namespace

TEST_CASE("a checkpoint gives back states and numbers bit by bit, and so does the one before it") {
  const std::string file = "unit_checkpoint.h5";
  remove_all(file);
  Decay model(numbers(0));
  const VecHandle y = vector_of(model, numbers(1)), z = vector_of(model, numbers(2)), later = vector_of(model, numbers(3));
  REQUIRE(write_checkpoint(model, file, facts_of(0.1), {{"/state", y}, {"/history/0", z}}) == 0);
  REQUIRE(write_checkpoint(model, file, facts_of(0.2), {{"/state", later}}) == 0);

  const VecHandle room = vector_of(model, numbers(9));
  CheckpointFile now, before;
  REQUIRE(now.open(PETSC_COMM_WORLD, file) == 0);
  REQUIRE(before.open(PETSC_COMM_WORLD, previous_checkpoint(file)) == 0);
  REQUIRE(now.require_same(model) == 0);
  CHECK(now.run().real == facts_of(0.2).real);
  CHECK(before.run().real == facts_of(0.1).real);
  CHECK(before.run().whole == facts_of(0.1).whole);
  CHECK(before.run().text == facts_of(0.1).text);
  CHECK(before.has("/history/0"));
  CHECK_FALSE(now.has("/history/0"));
  REQUIRE(now.read(model, "/state", room) == 0);
  CHECK(SmallModel::get(room) == numbers(3));
  REQUIRE(before.read(model, "/state", room) == 0);
  CHECK(SmallModel::get(room) == numbers(1));
  REQUIRE(before.read(model, "/history/0", room) == 0);
  CHECK(SmallModel::get(room) == numbers(2));
  remove_all(file);
}

TEST_CASE("a changed bit of a state, and a checkpoint of another system, are refused") {
  if (size_of(PETSC_COMM_WORLD) > 1) return;  // what ends a run on several ranks ends this program
  const std::string file = "unit_damaged.h5";
  remove_all(file);
  const std::vector<double> kept{1.25, 2.5, 3.75, 5.125, 7.0625};
  Decay model(kept), other({1, 2});
  const VecHandle y = vector_of(model, kept);
  REQUIRE(write_checkpoint(model, file, facts_of(0.1), {{"/state", y}}) == 0);
  const Handled handled;
  {
    CheckpointFile good;
    REQUIRE(good.open(PETSC_COMM_WORLD, file) == 0);
    Caught caught;
    CHECK(good.require_same(other) != 0);
    CHECK(caught.text().find("of a system of 5 unknowns, not 2") != std::string::npos);
  }
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  std::string all((std::istreambuf_iterator<char>(bytes)), std::istreambuf_iterator<char>());
  const std::size_t at = all.find(std::string(reinterpret_cast<const char*>(kept.data()), 8 * kept.size()));
  REQUIRE(at != std::string::npos);
  bytes.clear();
  bytes.seekp(static_cast<std::streamoff>(at));
  bytes.put(static_cast<char>(all[at] ^ 1));
  bytes.close();
  CheckpointFile damaged;
  REQUIRE(damaged.open(PETSC_COMM_WORLD, file) == 0);
  Caught caught;
  CHECK(damaged.read(model, "/state", y) != 0);
  CHECK(caught.text().find("/state does not match its checksum") != std::string::npos);
  remove_all(file);
}
