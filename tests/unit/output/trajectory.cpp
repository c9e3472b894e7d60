// A trajectory is written in parallel and read back on rank 0 by HDF5's serial interface.
#include <array>
#include <catch2/catch.hpp>

#include <unistd.h>

#include <cmath>
#include <fstream>
#include <map>

#include "base/handle.hpp"
#include "base/version.hpp"
#include "output/h5.hpp"
#include "output/trajectory.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

constexpr int particles = 7, frames = 3;

double position_at(int frame, int particle, int axis) { return 100 * frame + particle + 0.1 * axis; }

/// Rows of this rank: on 3 ranks the middle one has none.
void my_rows(int* first, int* count) {
  const int rank = rank_of(PETSC_COMM_WORLD), size = size_of(PETSC_COMM_WORLD);
  const int head = size == 1 ? particles : 4;
  *first = rank == 0 ? 0 : head;
  *count = rank == 0 ? head : rank == size - 1 ? particles - head : 0;
}

void make_vec(int d, VecHandle* vec) {
  int first, count;
  my_rows(&first, &count);
  REQUIRE(VecCreate(PETSC_COMM_WORLD, vec->out()) == 0);
  REQUIRE(VecSetSizes(*vec, count * d, particles * d) == 0);
  REQUIRE(VecSetBlockSize(*vec, d) == 0);
  REQUIRE(VecSetType(*vec, VECSTANDARD) == 0);
}

void fill(Vec vec, int d, int frame, double sign) {
  int first, count;
  PetscScalar* a;
  my_rows(&first, &count);
  REQUIRE(VecGetArray(vec, &a) == 0);
  for (int i = 0; i < count; ++i)
    for (int c = 0; c < d; ++c) a[i * d + c] = sign * position_at(frame, first + i, c);
  REQUIRE(VecRestoreArray(vec, &a) == 0);
}

std::vector<Dataset> constants() {
  int first, count;
  my_rows(&first, &count);
  std::vector<double> mass;
  std::vector<std::int64_t> bonds;
  for (int i = first; i < first + count; ++i) mass.push_back(1 + i);
  for (int i = first; i < std::min(first + count, particles - 1); ++i) bonds.insert(bonds.end(), {i, i + 1});
  return {{"/particles/trajectory/mass", first, particles, 0, mass},
          {"/connectivity/bonds", first, particles - 1, 2, bonds},
          {"/connectivity/bonds_damping", 0, 0, 0, std::vector<double>()}};
}

/// A serial look at the file; NaN stands for what is not there.
struct Look {
  H5 file;
  explicit Look(const std::string& name) : file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose) {}
  std::vector<hsize_t> shape(const std::string& path) const {
    H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
    H5 space(H5Dget_space(set), H5Sclose);
    std::vector<hsize_t> dims(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
    H5Sget_simple_extent_dims(space, dims.data(), nullptr);
    return dims;
  }
  std::vector<double> values(const std::string& path) const {
    std::size_t count = 1;
    for (hsize_t n : shape(path)) count *= n;
    std::vector<double> all(count, std::nan(""));
    H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
    H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
    return all;
  }
  haddr_t address(const std::string& path) const {
    H5 object(H5Oopen(file, path.c_str(), H5P_DEFAULT), H5Oclose);
    haddr_t at = HADDR_UNDEF;
    REQUIRE(find_h5_header(object, &at) >= 0);
    return at;
  }
  std::string text(const std::string& path, const char* name) const {
    H5 object(H5Oopen(file, path.c_str(), H5P_DEFAULT), H5Oclose);
    H5 attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
    if (attribute < 0) return {};
    H5 type(H5Aget_type(attribute), H5Tclose);
    char* value = nullptr;
    H5Aread(attribute, type, &value);
    std::string out = value ? value : "";
    H5free_memory(value);
    return out;
  }
};

void require_fields(const Look& look, int d, int columns) {
  const std::vector<hsize_t> shape = {frames, particles, static_cast<hsize_t>(columns)};
  for (const char* name : {"position", "velocity"}) {
    const std::string path = std::string("/particles/trajectory/") + name + "/value";
    const double sign = path.find("velocity") == std::string::npos ? 1 : -1;
    REQUIRE(look.shape(path) == shape);
    const std::vector<double> got = look.values(path);
    for (int t = 0; t < frames; ++t)
      for (int i = 0; i < particles; ++i)
        for (int c = 0; c < columns; ++c)
          REQUIRE(got[static_cast<std::size_t>((t * particles + i) * columns + c)] == (c < d ? sign * position_at(t, i, c) : 0.0));
  }
}

void require_rest(const Look& look) {
  const std::string position = "/particles/trajectory/position/", energy = "/observables/kinetic_energy/";
  REQUIRE(look.values(position + "time") == std::vector<double>{0, 0.5, 1});
  REQUIRE(look.values(position + "step") == std::vector<double>{0, 10, 20});
  for (const char* other : {"/particles/trajectory/velocity/", "/observables/kinetic_energy/", "/observables/momentum/"})
    for (const char* clock : {"step", "time"}) REQUIRE(look.address(std::string(other) + clock) == look.address(position + clock));
  REQUIRE(look.values(energy + "value") == std::vector<double>{0, 2, 4});
  REQUIRE(look.shape("/observables/momentum/value") == std::vector<hsize_t>{frames, 2});
  REQUIRE(look.values("/observables/momentum/value") == std::vector<double>{0, 1, 1, 2, 2, 3});
  REQUIRE(look.values("/particles/trajectory/mass") == std::vector<double>{1, 2, 3, 4, 5, 6, 7});
  REQUIRE(look.shape("/connectivity/bonds") == std::vector<hsize_t>{particles - 1, 2});
  REQUIRE(look.values("/connectivity/bonds") == std::vector<double>{0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6});
  REQUIRE(look.shape("/connectivity/bonds_damping") == std::vector<hsize_t>{0});
  // Two steps before each frame and one after the last.
  REQUIRE(look.values("/backspring/log/step") == std::vector<double>{0, 1, 2, 3, 4, 5, 6});
  REQUIRE(look.values("/backspring/log/dt") == std::vector<double>(7, 0.25));
  REQUIRE(look.values("/backspring/log/krylov") == std::vector<double>{0, 3, 6, 9, 12, 15, 18});
  REQUIRE(look.text("/parameters", "version") == version());
  REQUIRE(look.text("/parameters/options", "bs_test_of_output") == "-3.5");
}

/// Writes `frames` frames in d dimensions.
void write(const std::string& file, int d, int pad, OutputUnits units, double flush, std::int64_t numbers) {
  std::unique_ptr<Trajectory> out;
  TrajectoryOptions options;
  options.file = file;
  options.pad = pad;
  options.units = units;
  options.flush = flush;
  options.overwrite = true;
  VecHandle x, v;
  make_vec(d, &x);
  make_vec(d, &v);
  REQUIRE(Trajectory::create(PETSC_COMM_WORLD, options, d, numbers, constants(), &out) == 0);
  std::int64_t step = 0;
  const auto log = [&] {
    StepRecord record;
    record.step = step;
    record.dt = 0.25;
    record.krylov = 3 * step++;
    out->log_step(record);
  };
  for (int t = 0; t < frames; ++t) {
    fill(x, d, t, 1);
    fill(v, d, t, -1);
    log();
    log();
    REQUIRE(out->write_frame(10 * t, 0.5 * t, {{"/particles/trajectory/position", x}, {"/particles/trajectory/velocity", v}},
                             {{"kinetic_energy", {2.0 * t}}, {"momentum", {1.0 * t, t + 1.0}}}) == 0);
    REQUIRE(out->frames() == t + 1);
  }
  log();
  REQUIRE(out->close() == 0);
}

/// The same name on every rank, in a folder all of them see.
std::string scratch(const char* name) {
  long pid = getpid();
  MPI_Bcast(&pid, 1, MPI_LONG, 0, PETSC_COMM_WORLD);
  return "/tmp/backspring_" + std::to_string(pid) + "_" + name;
}

void remove_file(const std::string& file) {
  MPI_Barrier(PETSC_COMM_WORLD);
  if (rank_of(PETSC_COMM_WORLD) == 0) {
    unlink(file.c_str());
    unlink((file + ".xdmf").c_str());
  }
  MPI_Barrier(PETSC_COMM_WORLD);
}

}  // namespace

TEST_CASE("a trajectory of 1, 2 or 3 dimensions is read back as written") {
  const Handled handled;
  const int d = GENERATE(1, 2, 3), pad = GENERATE(0, 3);
  const double flush = GENERATE(0.0, 2.0);
  const std::int64_t numbers = GENERATE(0, 1000000);  // written by rank 0, by all
  const std::string file = scratch("frames.h5md");
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_test_of_output", "-3.5") == 0);
  const OutputUnits units = pad == 3 ? GENERATE(OutputUnits::SI, OutputUnits::metal, OutputUnits::nano) : OutputUnits::none;
  write(file, d, pad, units, flush, numbers);
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_test_of_output") == 0);
  if (rank_of(PETSC_COMM_WORLD) == 0) {
    const Look look(file);
    require_fields(look, d, pad ? pad : d);
    require_rest(look);
    const std::map<OutputUnits, std::array<const char*, 4>> expected = {
        {OutputUnits::none, {"", "", "", ""}},
        {OutputUnits::SI, {"m", "m s-1", "s", "kg m+2 s-2"}},
        {OutputUnits::metal, {"Angstrom", "Angstrom ps-1", "ps", "u Angstrom+2 ps-2"}},
        {OutputUnits::nano, {"nm", "nm ns-1", "ns", "ag nm+2 ns-2"}}};
    const auto& unit = expected.at(units);
    REQUIRE(look.text("/particles/trajectory/position/value", "unit") == unit[0]);
    REQUIRE(look.text("/particles/trajectory/velocity/value", "unit") == unit[1]);
    REQUIRE(look.text("/observables/kinetic_energy/time", "unit") == unit[2]);
    REQUIRE(look.text("/observables/kinetic_energy/value", "unit") == unit[3]);
    REQUIRE(H5Aexists_by_name(look.file, "/connectivity/bonds", "particles_group", H5P_DEFAULT) > 0);
  }
  remove_file(file);
}

TEST_CASE("a model without particles has no /particles") {
  const Handled handled;
  const std::string file = scratch("linear.h5md");
  TrajectoryOptions options;
  options.file = file;
  std::unique_ptr<Trajectory> out;
  REQUIRE(Trajectory::create(PETSC_COMM_WORLD, options, 0, 0, {}, &out) == 0);
  REQUIRE(out->write_frame(4, 0.25, {}, {{"charge", {7.5}}}) == 0);
  out.reset();
  if (rank_of(PETSC_COMM_WORLD) == 0) {
    const Look look(file);
    REQUIRE(H5Lexists(look.file, "/particles", H5P_DEFAULT) == 0);
    REQUIRE(look.values("/observables/charge/value") == std::vector<double>{7.5});
    REQUIRE(look.values("/observables/charge/time") == std::vector<double>{0.25});
  }
  remove_file(file);
}

TEST_CASE("refused trajectories") {
  const Handled handled;
  const bool first = rank_of(PETSC_COMM_WORLD) == 0;
  std::unique_ptr<Trajectory> out;
  TrajectoryOptions options;
  options.file = scratch("exists.h5md");
  if (first) std::ofstream(options.file) << "keep";
  MPI_Barrier(PETSC_COMM_WORLD);
  Caught exists;
  REQUIRE(Trajectory::create(PETSC_COMM_WORLD, options, 3, 0, {}, &out) == ERR_FAILED);
  REQUIRE(exists.text() == (first ? "backspring: error: " + options.file + " exists: give another -bs_output or add -bs_overwrite\n" : ""));
  REQUIRE(last_error(PETSC_COMM_WORLD).exit == Exit::input);
  std::string kept;
  std::ifstream(options.file) >> kept;
  REQUIRE(kept == "keep");
  remove_file(options.file);

  options.file = scratch("nowhere") + "/a.h5md";
  Caught folder;
  REQUIRE(Trajectory::create(PETSC_COMM_WORLD, options, 3, 0, {}, &out) == ERR_FAILED);
  REQUIRE((folder.text().find("folder " + scratch("nowhere") + " of -bs_output") != std::string::npos) == first);
  options.file = scratch("pad.h5md");
  options.pad = 2;
  Caught pad;
  REQUIRE(Trajectory::create(PETSC_COMM_WORLD, options, 3, 0, {}, &out) == ERR_FAILED);
  REQUIRE((pad.text().find("-bs_output_pad: 2 columns do not hold 3") != std::string::npos) == first);
  REQUIRE(access(options.file.c_str(), F_OK) != 0);
}

TEST_CASE("a frame that cannot be written is told with its number") {
  const Handled handled;
  const std::string file = scratch("whole.h5md");
  std::unique_ptr<Trajectory> out;
  TrajectoryOptions options;
  options.file = file;
  options.flush = 0;
  VecHandle x;
  make_vec(3, &x);
  fill(x, 3, 0, 1);
  REQUIRE(Trajectory::create(PETSC_COMM_WORLD, options, 3, 0, {}, &out) == 0);
  REQUIRE(out->write_frame(0, 0, {{"/particles/trajectory/position", x}}, {}) == 0);
  // The file is taken away: nothing can be reserved for it any more.
  remove_file(file);
  Caught said;
  REQUIRE(out->write_frame(1, 1, {{"/particles/trajectory/position", x}}, {}) == ERR_FAILED);
  const std::string text = said.text();
  REQUIRE(last_error(PETSC_COMM_WORLD).exit == Exit::io);
  REQUIRE(text == (rank_of(PETSC_COMM_WORLD) == 0
                       ? "backspring: error: cannot write frame 1 to " + file + ": No such file or directory: earlier frames are intact\n"
                       : ""));
  REQUIRE(out->frames() == 1);
  REQUIRE(out->close() == 0);
}
