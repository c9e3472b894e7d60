// Large frames that their sources make piece by piece while they are written, beside those that are kept.
#include <catch2/catch.hpp>

#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

#include "base/handle.hpp"
#include "output/h5.hpp"
#include "output/trajectory.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

double number(double time, PetscInt row, PetscInt column) { return 1000 * time + static_cast<double>(row) + 0.25 * static_cast<double>(column); }

/// Rows of `width` numbers; `largest` receives the most rows that were asked for at once.
RowSource source_of(const double* time, PetscInt width, PetscInt* largest) {
  return [time, width, largest](PetscInt first, PetscInt count, double* to) -> PetscErrorCode {
    *largest = std::max(*largest, count);
    for (PetscInt i = 0; i < count; ++i)
      for (PetscInt c = 0; c < width; ++c) to[i * width + c] = number(*time, first + i, c);
    return 0;
  };
}

/// Two frames of `rows` rows of two numbers, `pad` in the file; the most rows of a piece.
PetscInt write_and_compare(PetscInt rows, int pad) {
  const std::string file = "frame_pieces_" + std::to_string(getpid()) + ".h5md";
  std::unique_ptr<Trajectory> out;
  TrajectoryOptions options;
  options.file = file;
  options.pad = pad;
  options.xdmf = false;
  double time = 0;
  PetscInt largest = 0;
  VecHandle vec;
  REQUIRE(VecCreateSeq(PETSC_COMM_SELF, 2 * rows, vec.out()) == 0);
  REQUIRE(VecSetBlockSize(vec, 2) == 0);
  REQUIRE(Trajectory::create(PETSC_COMM_SELF, options, 2, 4 * rows, {}, &out) == 0);
  for (const int frame : {0, 1}) {
    time = 0.5 + frame;
    REQUIRE(out->write_frame(frame, time, {{"/particles/trajectory/position", vec, false, source_of(&time, 2, &largest)}}, {}) == 0);
  }
  REQUIRE(out->close() == 0);
  const PetscInt width = std::max(pad, 2);
  std::vector<double> read(static_cast<std::size_t>(2 * rows * width));
  {
    const H5 opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    const H5 set(H5Dopen2(opened, "/particles/trajectory/position/value", H5P_DEFAULT), H5Dclose);
    REQUIRE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, read.data()) >= 0);
  }
  PetscInt wrong = 0;
  for (PetscInt frame = 0; frame < 2; ++frame)
    for (PetscInt i = 0; i < rows; ++i)
      for (PetscInt c = 0; c < width; ++c)
        if (read[static_cast<std::size_t>((frame * rows + i) * width + c)] != (c < 2 ? number(0.5 + static_cast<double>(frame), i, c) : 0)) ++wrong;
  REQUIRE(wrong == 0);
  REQUIRE(std::remove(file.c_str()) == 0);
  return largest;
}

}  // namespace

TEST_CASE("frames made by a source as they are written") {
  if (rank_of(PETSC_COMM_WORLD) > 0) return;
  constexpr PetscInt large = 200007;  // 3.2 MB, the last piece shorter than the others
  const int pad = GENERATE(0, 3);
  REQUIRE(write_and_compare(large, pad) < large);
  REQUIRE(write_and_compare(11, pad) == 11);  // kept in memory whole
}
