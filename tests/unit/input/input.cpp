// Lattices from files and options: what the ranks read together is what was written, and faults are told once.
#include <hdf5.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "base/find_file.hpp"
#include "input/adjust.hpp"
#include "input/hdf5_file.hpp"
#include "input/load.hpp"
#include "input/remote.hpp"
#include "lattice/columns.hpp"
#include "lattice/generator.hpp"
#include "options.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

MPI_Comm const world = MPI_COMM_WORLD;  // NOLINT(misc-misplaced-const): the handle is constant

/// A folder that all ranks see and rank 0 removes.
struct Folder {
  std::string path;
  Folder() {
    char name[64] = "/tmp/backspring_input_XXXXXX";
    if (rank_of(world) == 0 && !mkdtemp(name)) name[0] = 0;
    MPI_Bcast(name, sizeof name, MPI_CHAR, 0, world);
    path = name;
  }
  ~Folder() {
    MPI_Barrier(world);
    if (rank_of(world) == 0) std::filesystem::remove_all(path);
  }
};

/// Options that hold while it lives.
struct Options {
  std::vector<std::string> names;
  explicit Options(const std::vector<std::pair<std::string, std::string>>& list) {
    for (const auto& [name, value] : list) {
      PetscOptionsSetValue(nullptr, name.c_str(), value.c_str());
      names.push_back(name);
    }
  }
  ~Options() {
    for (const std::string& name : names) PetscOptionsClearValue(nullptr, name.c_str());
  }
};

template <class T>
std::vector<T> whole(const std::vector<T>& mine, MPI_Datatype type) {
  int count = static_cast<int>(mine.size());
  std::vector<int> counts(static_cast<std::size_t>(size_of(world))), starts(counts.size(), 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (std::size_t r = 1; r < counts.size(); ++r) starts[r] = starts[r - 1] + counts[r - 1];
  std::vector<T> all(static_cast<std::size_t>(starts.back() + counts.back()));
  MPI_Allgatherv(mine.data(), count, type, all.data(), counts.data(), starts.data(), type, world);
  return all;
}
std::vector<double> whole(const std::vector<double>& mine) { return whole(mine, MPI_DOUBLE); }
std::vector<std::int64_t> whole(const std::vector<std::int64_t>& mine) { return whole(mine, MPI_INT64_T); }
std::vector<std::uint8_t> whole(const std::vector<std::uint8_t>& mine) { return whole(mine, MPI_UINT8_T); }

/// A lattice of random numbers that floats hold exactly, whole on every rank.
Lattice random_lattice(int dim, std::int64_t n, std::int64_t m, std::int64_t a) {
  std::mt19937 random(static_cast<unsigned>(7 * dim + n));
  const auto number = [&](double lo, double hi) {
    return static_cast<double>(static_cast<float>(std::uniform_real_distribution<double>(lo, hi)(random)));
  };
  const auto particle = [&] { return std::uniform_int_distribution<std::int64_t>(0, n - 1)(random); };
  Lattice l;
  l.dim = dim;
  l.particles.total = n;
  l.springs.total = m;
  l.anchors.total = a;
  for (std::int64_t i = 0; i < n * dim; ++i) l.position.push_back(number(-5, 5));
  for (const ParticleParameter& one : particle_parameters) l.particle_columns.push_back({one.name, std::string("/particles/") + one.name, {}});
  for (std::int64_t i = 0; i < n; ++i) {
    l.mass.push_back(number(0.5, 2));
    for (Column& column : l.particle_columns)
      for (int k = particle_parameters[particle_parameter(column.name)].width(dim); k > 0; --k) column.value.push_back(number(0, 1));
    l.fixed.push_back(i % 3 == 1);
    for (int k = 0; k < dim; ++k) l.velocity.push_back(l.fixed.back() ? 0 : number(-1, 1));
  }
  for (std::int64_t s = 0; s < m; ++s) {
    const std::int64_t i = particle();
    l.pairs.insert(l.pairs.end(), {i, (i + 1 + s % (n - 1)) % n});
    l.stiffness.push_back(number(0, 9));
    l.rest_length.push_back(number(0, 3));
    l.damping.push_back(number(0, 1));
  }
  for (std::int64_t s = 0; s < a; ++s) {
    l.anchor_particle.push_back(particle());
    for (int k = 0; k < dim; ++k) l.anchor_point.push_back(number(6, 9));
    l.anchor_stiffness.push_back(number(0, 9));
    l.anchor_rest_length.push_back(number(0, 3));
    l.anchor_damping.push_back(number(0, 1));
  }
  return l;
}

/// Writes tables into an HDF5 file, on one rank.
class Writer {
 public:
  explicit Writer(const std::string& path) : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose) {}
  template <class T>
  void table(const std::string& path, const std::vector<T>& values, std::vector<hsize_t> dims, hid_t stored) {
    const H5 groups(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(groups, 1);
    const H5 space(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), H5Sclose);
    const H5 data(H5Dcreate2(file_, path.c_str(), stored, space, groups, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
    const hid_t memory = std::is_same_v<T, double> ? H5T_NATIVE_DOUBLE : std::is_same_v<T, std::int64_t> ? H5T_NATIVE_INT64 : H5T_NATIVE_UINT8;
    H5Dwrite(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  }
  void attribute(const char* name, const char* text, bool variable) {
    const H5 type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
    H5Tset_size(type, variable ? H5T_VARIABLE : std::char_traits<char>::length(text) + 1);
    if (variable) H5Tset_cset(type, H5T_CSET_UTF8);
    const H5 made(H5Acreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    if (variable) H5Awrite(made, type, &text);
    else H5Awrite(made, type, text);
  }

 private:
  H5 file_;
};

struct Stored {
  hid_t real = H5T_IEEE_F64LE, integer = H5T_STD_I64LE;
  bool optional = true;  ///< velocity, fixed, columns, rest_length, damping
  const char *spring_law = nullptr, *damping_law = nullptr;
};

void write_lattice(const std::string& path, const Lattice& l, const Stored& as) {
  const auto n = static_cast<hsize_t>(l.particles.total), m = static_cast<hsize_t>(l.springs.total), a = static_cast<hsize_t>(l.anchors.total),
             d = static_cast<hsize_t>(l.dim);
  Writer w(path);
  w.table("/particles/position", l.position, {n, d}, as.real);
  w.table("/particles/mass", l.mass, {n}, as.real);
  w.table("/springs/pairs", l.pairs, {m, 2}, as.integer);
  w.table("/springs/stiffness", l.stiffness, {m}, as.real);
  if (as.optional) {
    w.table("/particles/velocity", l.velocity, {n, d}, as.real);
    w.table("/particles/fixed", l.fixed, {n}, H5T_STD_U8LE);
    for (const Column& column : l.particle_columns)
      w.table(column.path, column.value,
              particle_parameters[particle_parameter(column.name)].vector ? std::vector<hsize_t>{n, d} : std::vector<hsize_t>{n}, as.real);
    if (!l.id.empty()) w.table("/particles/id", l.id, {n}, as.integer);
    w.table("/springs/rest_length", l.rest_length, {m}, as.real);
    w.table("/springs/damping", l.damping, {m}, as.real);
  }
  if (a) {
    w.table("/anchors/particle", l.anchor_particle, {a}, as.integer);
    w.table("/anchors/point", l.anchor_point, {a, d}, as.real);
    w.table("/anchors/stiffness", l.anchor_stiffness, {a}, as.real);
    w.table("/anchors/rest_length", l.anchor_rest_length, {a}, as.real);
    w.table("/anchors/damping", l.anchor_damping, {a}, as.real);
  }
  if (as.spring_law) w.attribute("spring_law", as.spring_law, true);
  if (as.damping_law) w.attribute("damping_law", as.damping_law, false);
}

std::vector<double> initial_distances(const Lattice& l) {
  std::vector<double> lengths;
  const auto d = static_cast<std::size_t>(l.dim);
  for (std::size_t s = 0; s < l.stiffness.size(); ++s) {
    double square = 0;
    for (std::size_t k = 0; k < d; ++k)
      square += std::pow(
          l.position[static_cast<std::size_t>(l.pairs[2 * s]) * d + k] - l.position[static_cast<std::size_t>(l.pairs[2 * s + 1]) * d + k], 2);
    lengths.push_back(std::sqrt(square));
  }
  return lengths;
}

void check_chunk(const Rows& rows, std::int64_t total) {
  const Rows want = split_rows(total, rank_of(world), size_of(world));
  CHECK(rows.first == want.first);
  CHECK(rows.count == want.count);
  CHECK(rows.total == want.total);
}

/// Loads what the options say; on failure all that rank 0 said is in `said`.
bool load(const std::vector<std::pair<std::string, std::string>>& options, Lattice* out, std::string* said = nullptr) {
  const Options given(options);
  const Handled handled;
  Caught caught;
  const PetscErrorCode code = load_lattice(world, out);
  std::string text = caught.text();
  if (said) *said = text;
  return code == 0;
}

}  // namespace

TEST_CASE("an HDF5 lattice is read as it was written, whatever the ranks and the stored types", "[input]") {
  const Folder folder;
  const std::string file = folder.path + "/lattice.h5";
  const int dim = GENERATE(1, 2, 3);
  const bool narrow = GENERATE(false, true);
  Lattice want = random_lattice(dim, 11, 17, 4);
  for (std::int64_t k = 0; k < 11; ++k) want.id.push_back(100 - 3 * k);
  Stored as;
  if (narrow) {
    as.real = H5T_IEEE_F32BE;
    as.integer = H5T_STD_I32BE;
  }
  as.spring_law = "strain";
  as.damping_law = "simple";
  if (rank_of(world) == 0) write_lattice(file, want, as);
  MPI_Barrier(world);

  Lattice got;
  REQUIRE(load({{"-bs_lattice_file", file}}, &got));
  CHECK(got.dim == dim);
  check_chunk(got.particles, 11);
  check_chunk(got.springs, 17);
  check_chunk(got.anchors, 4);
  CHECK(got.mass.size() == static_cast<std::size_t>(got.particles.count));
  CHECK(got.pairs.size() == static_cast<std::size_t>(2 * got.springs.count));
  CHECK(whole(got.position) == want.position);
  CHECK(whole(got.velocity) == want.velocity);
  CHECK(whole(got.mass) == want.mass);
  REQUIRE(got.particle_columns.size() == std::size(particle_parameters));
  for (std::size_t c = 0; c < got.particle_columns.size(); ++c) {
    CHECK(got.particle_columns[c].name == particle_parameters[c].name);
    CHECK(got.particle_columns[c].path == want.particle_columns[c].path);
    CHECK(whole(got.particle_columns[c].value) == want.particle_columns[c].value);
  }
  CHECK(whole(got.id) == want.id);
  CHECK(whole(got.fixed) == want.fixed);
  CHECK(whole(got.pairs) == want.pairs);
  CHECK(whole(got.stiffness) == want.stiffness);
  CHECK(whole(got.rest_length) == want.rest_length);
  CHECK(whole(got.damping) == want.damping);
  CHECK(whole(got.anchor_particle) == want.anchor_particle);
  CHECK(whole(got.anchor_point) == want.anchor_point);
  CHECK(whole(got.anchor_stiffness) == want.anchor_stiffness);
  CHECK(whole(got.anchor_rest_length) == want.anchor_rest_length);
  CHECK(whole(got.anchor_damping) == want.anchor_damping);
  CHECK(got.spring_law == SpringLaw::strain);
  CHECK(got.damping_law == DampingLaw::simple);
  CHECK((got.spring_law_given && got.damping_law_given));
}

TEST_CASE("what an HDF5 lattice leaves out takes its default", "[input]") {
  const Folder folder;
  const std::string file = folder.path + "/lattice.hdf5";
  const Lattice want = random_lattice(3, 10, 23, 0);
  Stored as;
  as.optional = false;
  if (rank_of(world) == 0) write_lattice(file, want, as);
  MPI_Barrier(world);

  Lattice got;
  REQUIRE(load({{"-bs_lattice_file", file}}, &got));
  const std::vector<double> rest = whole(got.rest_length), length = initial_distances(want);
  REQUIRE(rest.size() == length.size());
  for (std::size_t s = 0; s < rest.size(); ++s) CHECK(rest[s] == Approx(length[s]).epsilon(1e-14));
  CHECK(whole(got.velocity) == std::vector<double>(30, 0.0));
  CHECK(whole(got.damping) == std::vector<double>(23, 0.0));
  CHECK(whole(got.fixed) == std::vector<std::uint8_t>(10, 0));
  CHECK(got.particle_columns.empty());
  CHECK(got.id.empty());
  CHECK(got.spring_law == SpringLaw::hooke);
  CHECK(got.damping_law == DampingLaw::axial);
  CHECK_FALSE((got.spring_law_given || got.damping_law_given));
}

TEST_CASE("options override a file's laws, fix particles, and add anchors", "[input]") {
  const Folder folder;
  const std::string file = folder.path + "/lattice.h5";
  const Lattice want = random_lattice(2, 9, 8, 2);
  Stored as;
  as.spring_law = "strain";
  if (rank_of(world) == 0) write_lattice(file, want, as);
  MPI_Barrier(world);

  Lattice got;
  REQUIRE(load({{"-bs_lattice_file", file},
                {"-bs_spring_law", "hooke"},
                {"-bs_damping_law", "simple"},
                {"-bs_lattice_fixed", "ymax"},
                {"-bs_lattice_fixed_particles", "0,8"},
                {"-bs_lattice_velocity", "3,-2"},
                {"-bs_anchor_particles", "7,2,7"},
                {"-bs_anchor_stiffness", "6"},
                {"-bs_anchor_rest_length", "0"},
                {"-bs_anchor_damping", "0.5"}},
               &got));
  CHECK(got.spring_law == SpringLaw::hooke);
  CHECK(got.damping_law == DampingLaw::simple);
  CHECK((got.spring_law_given && got.damping_law_given));

  std::size_t top = 0;
  for (std::size_t p = 0; p < 9; ++p)
    if (want.position[2 * p + 1] > want.position[2 * top + 1]) top = p;
  const std::vector<std::uint8_t> fixed = whole(got.fixed);
  const std::vector<double> velocity = whole(got.velocity);
  for (std::size_t p = 0; p < 9; ++p) {
    const bool still = want.fixed[p] || p == 0 || p == 8 || p == top;
    CHECK(fixed[p] == still);
    CHECK(velocity[2 * p] == (still ? 0 : 3));
    CHECK(velocity[2 * p + 1] == (still ? 0 : -2));
  }

  std::vector<std::int64_t> particle = want.anchor_particle;
  std::vector<double> point = want.anchor_point, stiffness = want.anchor_stiffness;
  for (const std::size_t p : {7u, 2u, 7u}) {
    particle.push_back(static_cast<std::int64_t>(p));
    point.insert(point.end(), {want.position[2 * p], want.position[2 * p + 1]});
    stiffness.push_back(6);
  }
  CHECK(got.anchors.total == 5);
  CHECK(whole(got.anchor_particle) == particle);
  CHECK(whole(got.anchor_point) == point);
  CHECK(whole(got.anchor_stiffness) == stiffness);
}

TEST_CASE("a trajectory's last frame is a lattice", "[input]") {
  const Folder folder;
  const std::string file = folder.path + "/run.h5md";
  const Lattice want = random_lattice(3, 7, 5, 0);
  if (rank_of(world) == 0) {
    std::vector<double> frames(21, -1.0), velocities(21, -2.0);
    frames.insert(frames.end(), want.position.begin(), want.position.end());
    velocities.insert(velocities.end(), want.velocity.begin(), want.velocity.end());
    Writer w(file);
    w.table("/particles/trajectory/position/value", frames, {2, 7, 3}, H5T_IEEE_F64LE);
    w.table("/particles/trajectory/velocity/value", velocities, {2, 7, 3}, H5T_IEEE_F64LE);
    w.table("/particles/trajectory/mass", want.mass, {7}, H5T_IEEE_F64LE);
    w.table("/particles/trajectory/fixed", want.fixed, {7}, H5T_STD_U8LE);
    w.table("/connectivity/bonds", want.pairs, {5, 2}, H5T_STD_I32LE);
    w.table("/connectivity/bonds_stiffness", want.stiffness, {5}, H5T_IEEE_F64LE);
    w.table("/connectivity/bonds_rest_length", want.rest_length, {5}, H5T_IEEE_F64LE);
    w.table("/connectivity/bonds_damping", want.damping, {5}, H5T_IEEE_F64LE);
  }
  MPI_Barrier(world);
  Lattice got;
  REQUIRE(load({{"-bs_lattice_file", file}}, &got));
  CHECK(whole(got.position) == want.position);
  CHECK(whole(got.velocity) == want.velocity);
  CHECK(whole(got.fixed) == want.fixed);
  CHECK(whole(got.pairs) == want.pairs);
  CHECK(whole(got.rest_length) == want.rest_length);
  CHECK(whole(got.damping) == want.damping);
}

TEST_CASE("an .xsp scene is cut into chunks, and its forces become options the user can override", "[input]") {
  const Folder folder;
  const std::string file = folder.path + "/scene.xsp";
  if (rank_of(world) == 0)
    std::ofstream(file) << "#1.0 scene\nfrce 0 1 10 0\nmass 4 10 20 1 0 2 0.5\nmass 9 40 60 0 0 -3 0.5\nmass 2 7 8 0 1 1 1\n"
                           "spng 1 4 9 5 0.25 30\nspng 2 9 2 6 0 12\n";
  MPI_Barrier(world);
  Lattice got;
  REQUIRE(load({{"-bs_lattice_file", file}}, &got));
  check_chunk(got.particles, 3);
  CHECK(whole(got.position) == std::vector<double>{10, 20, 40, 60, 7, 8});
  CHECK(whole(got.fixed) == std::vector<std::uint8_t>{0, 1, 0});
  CHECK(whole(got.pairs) == std::vector<std::int64_t>{0, 1, 1, 2});
  CHECK(whole(got.rest_length) == std::vector<double>{30, 12});
  CHECK(whole(got.id) == std::vector<std::int64_t>{4, 9, 2});
  REQUIRE_FALSE(got.implied_options.empty());
  const auto [name, value] = got.implied_options.front();
  char text[256] = {};
  PetscBool set;
  PetscOptionsGetString(nullptr, nullptr, name.c_str(), text, sizeof text, &set);
  CHECK(set);
  CHECK(std::string(text) == value);
  {
    const Options mine({{name, "0,-1"}});
    REQUIRE(load({{"-bs_lattice_file", file}}, &got));
    PetscOptionsGetString(nullptr, nullptr, name.c_str(), text, sizeof text, &set);
    CHECK(std::string(text) == "0,-1");
  }
  for (const auto& [implied, unused] : got.implied_options) PetscOptionsClearValue(nullptr, implied.c_str());
}

TEST_CASE("a generated lattice's springs are numbered over the ranks", "[input]") {
  Lattice got;
  REQUIRE(load({{"-bs_lattice_type", "square"}, {"-bs_lattice_size", "5,4"}, {"-bs_lattice_neighbors", "4"}}, &got));
  check_chunk(got.particles, 20);
  CHECK(got.springs.total == 5 * 3 + 4 * 4);
  const std::vector<std::int64_t> firsts = whole(std::vector<std::int64_t>{got.springs.first}),
                                  counts = whole(std::vector<std::int64_t>{got.springs.count});
  std::int64_t next = 0;
  for (std::size_t r = 0; r < firsts.size(); ++r) {
    CHECK(firsts[r] == next);
    next += counts[r];
  }
  CHECK(next == got.springs.total);
}

TEST_CASE("rows of other ranks are fetched in any order", "[input]") {
  const Rows rows = split_rows(13, rank_of(world), size_of(world));
  std::vector<double> mine;
  for (std::int64_t r = rows.first; r < rows.first + rows.count; ++r) mine.insert(mine.end(), {static_cast<double>(r), static_cast<double>(r * r)});
  const std::vector<std::int64_t> wanted = {12, 0, 5, 5, 11, 0};
  std::vector<double> got;
  REQUIRE(fetch_rows(world, rows, mine, 2, rank_of(world) == 0 ? wanted : std::vector<std::int64_t>{3}, &got) == 0);
  if (rank_of(world) == 0) CHECK(got == std::vector<double>{12, 144, 0, 0, 5, 25, 5, 25, 11, 121, 0, 0});
  else CHECK(got == std::vector<double>{3, 9});
}

TEST_CASE("the first faulty row of the whole lattice is told, by one rank, once", "[input]") {
  struct Case {
    std::function<void(Lattice&)> spoil;
    const char* says;
  };
  const Case cases[] = {
      {[](Lattice& l) {
         l.mass[10] = 0;
         l.mass[3] = -1;
       },
       "particle 3: mass -1"},
      {[](Lattice& l) { l.position[2 * 6 + 1] = NAN; }, "particle 6: position"},
      {[](Lattice& l) { l.velocity[2 * 6] = INFINITY; }, "particle 6: velocity inf"},
      {[](Lattice& l) { l.particle_columns[0].value[9] = -2; }, "particle 9, /particles/radius: radius -2; write a finite radius >= 0 [m]"},
      {[](Lattice& l) {
         l.particle_columns[1].value[8] = NAN;
         l.particle_columns[1].value[7] = -0.5;
       },
       "particle 7, /particles/drag: drag -0.5; write a finite drag >= 0 [kg/s]"},
      {[](Lattice& l) { l.pairs[2 * 5] = 11; }, "spring 5: there is no particle 11; write 0 to 10"},
      {[](Lattice& l) { l.pairs[2 * 5 + 1] = -1; }, "spring 5: there is no particle -1"},
      {[](Lattice& l) { l.pairs[2 * 7] = l.pairs[2 * 7 + 1]; }, "spring 7: joins particle"},
      {[](Lattice& l) {
         l.rest_length[16] = -0.5;
         l.stiffness[1] = -4;
       },
       "spring 1: stiffness -4"},
      {[](Lattice& l) { l.rest_length[16] = -0.5; }, "spring 16: rest length -0.5"},
      {[](Lattice& l) { l.damping[2] = INFINITY; }, "spring 2: damping inf"},
      {[](Lattice& l) { l.anchor_particle[3] = 99; }, "anchor 3: there is no particle 99"},
      {[](Lattice& l) { l.anchor_stiffness[0] = NAN; }, "anchor 0: stiffness"},
      {[](Lattice& l) { l.anchor_rest_length[0] = NAN; }, "anchor 0: rest length"},
      {[](Lattice& l) {
         const auto i = static_cast<std::size_t>(l.pairs[26]), j = static_cast<std::size_t>(l.pairs[27]);
         for (std::size_t k = 0; k < 2; ++k) l.position[2 * i + k] = l.position[2 * j + k];
       },
       "are at one place, its rest length is"},
      {[](Lattice& l) {
         const auto i = static_cast<std::size_t>(l.anchor_particle[1]);
         for (std::size_t k = 0; k < 2; ++k) l.anchor_point[2 + k] = l.position[2 * i + k];
         l.anchor_rest_length[1] = 0;
       },
       "write -bs_damping_law simple, or damping 0"},
  };
  for (const Case& one : cases) {
    Lattice l = random_lattice(2, 11, 17, 4);
    l.source = "test";
    Lattice chunk = chunk_of(l, rank_of(world), size_of(world));
    REQUIRE(validate(world, &chunk) == 0);
    one.spoil(l);
    const Handled handled;
    Caught caught;
    chunk = chunk_of(l, rank_of(world), size_of(world));
    const PetscErrorCode code = validate(world, &chunk);
    const std::string said = caught.text();
    INFO(one.says << " / " << said);
    CHECK(code == ERR_FAILED);
    std::int64_t told = said.empty() ? 0 : 1, fits = said.find(one.says) != std::string::npos ? 1 : 0;
    MPI_Allreduce(MPI_IN_PLACE, &told, 1, MPI_INT64_T, MPI_SUM, world);
    MPI_Allreduce(MPI_IN_PLACE, &fits, 1, MPI_INT64_T, MPI_SUM, world);
    CHECK(told == 1);
    CHECK(fits == 1);
  }
}

TEST_CASE("sizes that PETSc cannot index are refused before they are allocated", "[input]") {
  const Handled handled;
  const std::int64_t most = PETSC_MAX_INT;
  CHECK(check_sizes(world, "test", most / 6, 3, most, most) == 0);
  Caught caught;
  CHECK(check_sizes(world, "test", most / 6 + 1, 3, 0, 0) == ERR_FAILED);
  CHECK(check_sizes(world, "test", 0, 3, 0, 0) == ERR_FAILED);
}

TEST_CASE("a text file reaches every rank", "[input]") {
  const Folder folder;
  const std::string file = folder.path + "/text";
  const std::string want = std::string("one\ntwo\0three", 13);
  if (rank_of(world) == 0) std::ofstream(file, std::ios::binary) << want;
  MPI_Barrier(world);
  std::string got;
  REQUIRE(read_text_file(world, file, &got) == 0);
  CHECK(got == want);
  const Handled handled;
  Caught caught;
  CHECK(read_text_file(world, file + ".none", &got) == ERR_FAILED);
  CHECK(read_text_file(world, folder.path, &got) == ERR_FAILED);
}

TEST_CASE("A lattice that is given is perturbed as a generated one of the same rows") {
  const OptionTexts disturb = {{"-bs_lattice_perturbation", "0.2"}, {"-bs_lattice_seed", "7"}};
  OptionTexts made = {{"-bs_lattice_type", "square"}, {"-bs_lattice_size", "6,5"}, {"-bs_lattice_fixed", "ymin"}};
  GeneratorSpec spec;
  spec.type = LatticeType::square;
  spec.size = {6, 5};
  Lattice given = generate(spec, 0, 1), expected, found;
  given.springs.total = given.springs.count;
  given.rest_length.assign(given.rest_length.size(), std::nan(""));  // as files that leave them out
  made.insert(disturb.begin(), disturb.end());
  {
    const Given options(made);
    REQUIRE(load_lattice(world, &expected) == 0);
  }
  OptionTexts texts = disturb;
  texts["-bs_lattice_fixed"] = "ymin";
  const Given options(texts);
  REQUIRE(load_lattice(world, &found, &given) == 0);
  CHECK(found.position == expected.position);
  CHECK(found.fixed == expected.fixed);
  double sum[2] = {0, 0};  // the ranks share springs out otherwise
  for (const double length : found.rest_length) sum[0] += length;
  for (const double length : expected.rest_length) sum[1] += length;
  MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, world);
  CHECK(sum[0] == Approx(sum[1]).epsilon(1e-13));
  CHECK(std::any_of(found.position.begin(), found.position.end(), [](double x) { return x != std::round(x); }) == (found.particles.count > 0));
}
