// Lattices as arrays: from files and generators and back, on any number of ranks; what is computed of them is what is computed of the file.
#include "session/lattices.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <functional>

#include "full_arrays.hpp"
#include "session/session.hpp"
#include "session_tools.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

const MPI_Comm world = MPI_COMM_WORLD;  // NOLINT(misc-misplaced-const): the handle is constant
using Numbers = std::vector<double>;

LatticeArrays read(const Settings& settings, MPI_Comm comm = world, std::vector<std::string>* warnings = nullptr) {
  LatticeArrays arrays;
  good(read_lattice(comm, settings, &arrays, warnings));
  return arrays;
}

/// States and forces after some steps: in every bit on one rank; on several another division of the lattice sums in another order.
void compare(Session& first, Session& second, int steps) {
  for (int step = 0; step < 2; ++step) {
    for (const Session::Array what : {Session::Array::position, Session::Array::velocity, Session::Array::force}) {
      const Numbers a = array_of(first, what), b = array_of(second, what);
      REQUIRE(a.size() == b.size());
      if (size_of(world) == 1) REQUIRE(a == b);
      for (std::size_t k = 0; k < a.size(); ++k) REQUIRE(a[k] == Approx(b[k]).epsilon(1e-6).margin(1e-6));
    }
    if (step > 0) return;
    good(first.step(steps));
    good(second.step(steps));
  }
}

/// The lattice of `lattice` in `run`, beside the arrays that are read of it.
void compare_with_arrays(const Settings& lattice, const Settings& run, int steps) {
  const LatticeArrays arrays = read(lattice);
  REQUIRE(difference(arrays, read(lattice, PETSC_COMM_SELF)).empty());
  const auto named = session_of(with(lattice, run)), held = session_of(arrays, run);
  compare(*named, *held, steps);
}

const Settings STEPS = {{"-ts_dt", "0.002"}};

}  // namespace

TEST_CASE("arrays with everything that a lattice may hold are written, read and run") {
  const Folder folder;
  for (const int dim : {2, 3}) {
    const LatticeArrays arrays = full_arrays(dim);
    const std::string file = folder.path + "/" + std::to_string(dim) + ".h5";
    std::vector<std::string> warnings;
    good(write_lattice(world, arrays, {}, file, &warnings));
    const LatticeArrays found = read({{"-bs_lattice_file", file}}, world, &warnings);
    REQUIRE(warnings.empty());
    REQUIRE(difference(found, arrays).empty());
    compare_with_arrays({{"-bs_lattice_file", file}}, STEPS, 5);
    compare(*session_of({{"-bs_lattice_file", file}, STEPS[0]}), *session_of(arrays, STEPS), 5);
  }
}

TEST_CASE("what may be left out of arrays is what a file leaves out") {
  const Folder folder;
  LatticeArrays arrays = full_arrays(3);
  for (auto* one : {&arrays.rest_length, &arrays.damping, &arrays.area, &arrays.velocity, &arrays.anchors.rest_length, &arrays.anchors.damping})
    one->clear();
  arrays.fixed.clear();
  arrays.id.clear();
  arrays.shift.clear();
  arrays.interactions[0].shift.clear();
  arrays.break_columns.clear();
  good(write_lattice(world, arrays, {}, folder.path + "/a.h5"));
  const LatticeArrays found = read({{"-bs_lattice_file", folder.path + "/a.h5"}});
  REQUIRE((found.area.empty() && found.id.empty() && found.break_columns.empty()));
  REQUIRE((found.shift.size() == 60 && found.interactions[0].shift.size() == 18 && found.velocity == Numbers(36, 0.0)));
  REQUIRE((found.anchors.rest_length == Numbers(2, 0.0) && found.anchors.damping == Numbers(2, 0.0)));
  for (std::size_t k = 0; k < 20; ++k) {  // initial distances to the nearest images
    double least = INFINITY;
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j) {
        double square = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const double there =
              found.position[3 * static_cast<std::size_t>(found.springs[2 * k + 1]) + c] + i * found.box.edges[c] + j * found.box.edges[3 + c];
          square += std::pow(there - found.position[3 * static_cast<std::size_t>(found.springs[2 * k]) + c], 2);
        }
        least = std::min(least, std::sqrt(square));
      }
    REQUIRE(found.rest_length[k] == Approx(least).epsilon(1e-14));
  }
}

TEST_CASE("generated lattices as arrays run as the options do") {
  compare_with_arrays({{"-bs_lattice_type", "triangular"},
                       {"-bs_lattice_size", "6,5"},
                       {"-bs_lattice_dim", "2"},
                       {"-bs_lattice_periodic", "x"},
                       {"-bs_lattice_perturbation", "0.1"},
                       {"-bs_lattice_remove_fraction", "0.2"},
                       {"-bs_lattice_prune", "dangling"},
                       {"-bs_lattice_fixed", "ymin"},
                       {"-bs_lattice_velocity", "0.1,0"},
                       {"-bs_angle_stiffness", "0.2"},
                       {"-bs_group_top", "ymax"},
                       {"-bs_anchor_group", "top"},
                       {"-bs_anchor_stiffness", "3"},
                       {"-bs_spring_law", "plastic"},
                       {"-bs_spring_yield_force", "0.01"}},
                      {{"-bs_gravity", "2,-9.81"}, {"-ts_dt", "0.01"}, {"-bs_force_top", "1,0"}}, 8);
  compare_with_arrays({{"-bs_lattice_type", "cubic"}, {"-bs_lattice_size", "3,3,3"}, {"-bs_spring_law", "strain"}, {"-bs_lattice_radius", "0.1"}},
                      {{"-bs_gravity", "0,0,-1"}, {"-ts_dt", "0.01"}}, 4);
  LatticeArrays arrays = read({{"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "3"}, {"-bs_spring_law", "strain"}, {"-bs_group_end", "xmax"}});
  REQUIRE((arrays.dim == 1 && arrays.spring_law == "strain" && arrays.groups.size() == 1 &&
           arrays.groups[0].member == std::vector<std::uint8_t>{0, 0, 1}));
  REQUIRE(arrays.springs == std::vector<std::int64_t>{0, 1, 1, 2});
}

TEST_CASE("scenes as arrays run as the file does, with what they imply") {
  const Folder folder;
  const std::string source = BS_SOURCE_DIR;
  std::vector<std::string> files = {source + "/meshes/net.xsp"};
  for (const char* name : {"jello", "bridge", "pend", "blanket"}) {
    const std::string file = source + "/../shared/data/xsp/" + name + ".xsp";
    if (std::ifstream(file)) files.push_back(file);
    else WARN("skipped: " << file << " is not there");
  }
  for (const std::string& file : files) {
    CAPTURE(file);
    std::vector<std::string> warnings, again;
    const LatticeArrays arrays = read({{"-bs_lattice_file", file}}, world, &warnings);
    REQUIRE(arrays.rest_at_zero_length);
    REQUIRE_FALSE(arrays.implied_options.empty());
    const auto scene = session_of({{"-bs_lattice_file", file}});
    REQUIRE(warnings == scene->warnings());
    compare(*scene, *session_of(arrays, {}), 3);
    compare(*session_of({{"-bs_lattice_file", file}}), *session_of(arrays, arrays.implied_options), 3);
    const std::string copy = folder.path + "/copy.h5";
    good(write_lattice(world, arrays, {{"-bs_overwrite", ""}}, copy, &again));
    REQUIRE(again.empty());
    REQUIRE(difference(read({{"-bs_lattice_file", copy}}), arrays).empty());
  }
}

TEST_CASE("options rule over what arrays say as they do over a file") {
  LatticeArrays two;
  two.dim = 1;
  two.position = {0, 1.5};
  two.mass = {1, 1};
  two.springs = {0, 1};
  two.stiffness = {8};
  two.rest_length = {1.25};
  two.spring_law = "strain";
  two.implied_options = {{"-bs_gravity", "-1"}};
  const auto force = [&two](const Settings& settings) {
    Numbers f;
    good(session_of(two, settings)->get(Session::Array::force, &f));
    return f;
  };
  const double strain = 8 * 0.25 / 1.25, hooke = 8 * 0.25;
  CHECK(force({})[0] == Approx(strain - 1).epsilon(1e-14));
  CHECK(force({{"-bs_gravity", "-2"}})[1] == Approx(-strain - 2).epsilon(1e-14));
  CHECK(force({{"-bs_spring_law", "hooke"}})[0] == Approx(hooke - 1).epsilon(1e-14));
  two.area = {2};
  two.anchors = {{1}, {2.5}, {4}, {}, {}};
  CHECK(force({{"-bs_spring_law", "hooke"}})[1] == Approx(-hooke - 1 + 4).epsilon(1e-14));
  two.laws = {"strain", "hooke"};
  two.law = {1};
  CHECK(force({})[0] == Approx(hooke - 1).epsilon(1e-14));
  std::unique_ptr<Session> session;
  CHECK(Session::create(world, two, {{"-bs_spring_law", "hooke"}}, &session).text ==
        "option -bs_spring_law hooke: lattice in memory has a law for each spring: leave the option out");
  const Folder folder;
  two.law.clear();
  good(write_lattice(world, two, {{"-bs_lattice_fixed_particles", "1"}, {"-bs_spring_law", "tension"}}, folder.path + "/two.h5"));
  const LatticeArrays found = read({{"-bs_lattice_file", folder.path + "/two.h5"}});
  CHECK((found.fixed == std::vector<std::uint8_t>{0, 1} && found.spring_law == "tension"));
}

TEST_CASE("each bad value in memory gives one error that says the array and the row") {
  struct Case {
    std::function<void(LatticeArrays&)> spoil;
    const char* says;
  };
  const Case cases[] = {
      {[](LatticeArrays& a) { a.position[10] = NAN; }, "particle 3: position nan; write finite coordinates [m]"},
      {[](LatticeArrays& a) { a.velocity[9] = INFINITY; }, "particle 3: velocity inf; write finite components [m/s]"},
      {[](LatticeArrays& a) { a.mass[11] = 0; },
       "particle 11: mass 0; write a finite mass > 0 [kg]; a particle that must not move is marked as fixed"},
      {[](LatticeArrays& a) { a.particle_columns[0].value[2] = -1; }, "particle 2, particles/radius: radius -1; write a finite radius >= 0 [m]"},
      {[](LatticeArrays& a) { a.particle_columns[2].value[35] = NAN; }, "particle 11, particles/force: force nan; write a finite force [N]"},
      {[](LatticeArrays& a) { a.springs[39] = 12; }, "spring 19: there is no particle 12; write 0 to 11 (particles count from 0)"},
      {[](LatticeArrays& a) { a.springs[0] = -1; }, "spring 0: there is no particle -1; write 0 to 11 (particles count from 0)"},
      {[](LatticeArrays& a) { a.springs[9] = a.springs[8], a.shift[12] = 0; },
       "spring 4: joins particle 4 to itself; give it two ends or leave it out"},
      {[](LatticeArrays& a) { a.stiffness[7] = -2; }, "spring 7: stiffness -2; write a finite number >= 0"},
      {[](LatticeArrays& a) { a.rest_length[7] = -2; }, "spring 7: rest length -2; write a finite length >= 0 [m] (0: the zero-rest-length law)"},
      {[](LatticeArrays& a) { a.damping[19] = NAN; }, "spring 19: damping nan; write a finite number >= 0 [kg/s]"},
      {[](LatticeArrays& a) { a.area[6] = 0; }, "spring 6, springs/area: 0; write a finite area > 0 [m^2]"},
      {[](LatticeArrays& a) { a.spring_columns[2].value[5] = -1; }, "spring 5, springs/yield_force: -1; write a finite number >= 0 [N]"},
      {[](LatticeArrays& a) { a.spring_columns[4].value[10] = 0; }, "spring 10, springs/relaxation_time: 0; write a finite number > 0 [s]"},
      {[](LatticeArrays& a) { a.break_columns[0].value[8] = NAN; },
       "spring 8, springs/critical_strain: nan; write a number > 0, or inf for a spring that does not break"},
      {[](LatticeArrays& a) { a.break_columns[3].value[8] = 2; }, "spring 8, springs/broken: 2; write 1 (broken) or 0"},
      {[](LatticeArrays& a) { a.shift[57] = 64; }, "spring 19, /springs/shift: a shift of 64 boxes; write -63 to 63"},
      {[](LatticeArrays& a) { a.shift[5] = 1; }, "spring 1, /springs/shift: a shift of 1 boxes; write 0 along edges that are not periodic"},
      {[](LatticeArrays& a) { a.anchors.particle[1] = 12; }, "anchor 1: there is no particle 12; write 0 to 11 (particles count from 0)"},
      {[](LatticeArrays& a) { a.anchors.point[4] = NAN; }, "anchor 1: point nan; write finite coordinates [m]"},
      {[](LatticeArrays& a) { a.anchors.stiffness[0] = -1; }, "anchor 0: stiffness -1; write a finite number >= 0"},
      {[](LatticeArrays& a) { a.anchors.rest_length[0] = NAN; },
       "anchor 0: rest length nan; write a finite length >= 0 [m] (0: the zero-rest-length law)"},
      {[](LatticeArrays& a) { a.anchors.damping[1] = -1; }, "anchor 1: damping -1; write a finite number >= 0 [kg/s]"},
      {[](LatticeArrays& a) { a.interactions[0].ends[5] = 12; }, "angle spring 1: there is no particle 12; write 0 to 11 (particles count from 0)"},
      {[](LatticeArrays& a) { a.interactions[1].ends[5] = 4; }, "hinge 1: names particle 4 twice; give it 4 different ends"},
      {[](LatticeArrays& a) { a.interactions[0].parameter[2] = -1; }, "angle spring 1: angle stiffness -1; "},
      {[](LatticeArrays& a) { a.interactions[1].parameter[1] = NAN; }, "hinge 0: rest angle nan; "},
      {[](LatticeArrays& a) { a.interactions[1].shift[12] = 70; }, "hinge 1, /hinges/shift: a shift of 70 boxes; write -63 to 63"},
      {[](LatticeArrays& a) { a.groups[0].member[0] = 0; },
       "group a of lattice in memory has no particles: choose some by -bs_group_a, or leave it out"},
  };
  Caught out(stdout), err;
  for (const Case& one : cases) {
    LatticeArrays a = full_arrays(3);
    std::unique_ptr<Session> session;
    one.spoil(a);
    const Error error = Session::create(world, a, {}, &session);
    const std::string says = one.says[0] == 'g' ? one.says : std::string("lattice in memory: ") + one.says;
    CHECK(error.text.substr(0, says.size()) == says);
    CHECK(error.text.find('\n') == std::string::npos);
    CHECK(error.exit == Exit::input);
    CHECK_FALSE(session);
  }
  CHECK(err.text().empty());
  CHECK(out.text().empty());
}

TEST_CASE("what cannot be read or written is said as a value, and nothing stays in force") {
  const Folder folder;
  const std::string file = folder.path + "/chain.h5", exists = " exists: give another -bs_output or add -bs_overwrite";
  const Settings chain = {{"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "4"}};
  LatticeArrays arrays;
  std::vector<std::string> warnings;
  Caught out(stdout), err;
  const auto refusal = [&](const Settings& settings) {
    const Error error = read_lattice(world, settings, &arrays);
    CHECK(error.exit == Exit::input);
    return error.text;
  };
  CHECK(refusal({}).find("no lattice is given; write -bs_lattice_file FILE") == 0);
  CHECK(refusal(with(chain, {{"-bs_grvity", "1"}})) == "option -bs_grvity does not exist: did you mean -bs_gravity?");
  CHECK(refusal({{"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "4x"}}) ==
        "option -bs_lattice_size: 4x is not a whole number: give a whole number");
  CHECK(refusal({{"-bs_model", "linear"}}) == "a lattice that is read: a linear system has no lattice: leave -bs_model and -bs_netlist out");
  CHECK(refusal({{"-bs_lattice_file", folder.path + "/none.h5"}}).find(folder.path + "/none.h5") != std::string::npos);
  CHECK(arrays.mass.empty());
  good(read_lattice(world, with(chain, {{"-bs_gravity", "1"}, {"-ts_dt", "0.1"}}), &arrays, &warnings));  // of a run with the same settings
  CHECK((warnings.empty() && arrays.mass.size() == 4));

  good(write_lattice(world, arrays, {}, file));
  CHECK(write_lattice(world, arrays, {}, file).text.find(exists) != std::string::npos);
  good(write_lattice(world, arrays, {{"-bs_overwrite", ""}}, file));
  CHECK(write_lattice(world, arrays, {}, folder.path + "/chain.txt").text ==
        "option -bs_output " + folder.path + "/chain.txt: names of lattice files end in .h5 or .hdf5: give such a name");
  CHECK(write_lattice(world, arrays, {}, folder.path + "/none/chain.h5").exit == Exit::input);
  CHECK(write_lattice(world, arrays, {{"-bs_lattice_file", file}}, folder.path + "/b.h5").text ==
        "-bs_lattice_file or -bs_lattice_type is given beside a lattice in memory: leave it out");
  arrays.mass.pop_back();
  CHECK(write_lattice(world, arrays, {}, folder.path + "/b.h5").text == "lattice in memory: position has 4 numbers: give 3");
  arrays.mass.push_back(-1);
  CHECK(write_lattice(world, arrays, {}, folder.path + "/b.h5").text.find("lattice in memory: particle 3: mass -1") == 0);
  CHECK_FALSE(std::ifstream(folder.path + "/b.h5").good());
  good(read_lattice(world, {{"-bs_lattice_file", file}, {"-bs_lattice_width", "5"}}, &arrays, &warnings));
  CHECK(warnings.size() == (rank_of(world) == 0 ? 1 : 0));
  CHECK(err.text().empty());
  CHECK(out.text().empty());
  CHECK_FALSE(last_error(world));
  PetscBool there = PETSC_TRUE;
  REQUIRE(PetscOptionsHasName(nullptr, nullptr, "-bs_lattice_file", &there) == 0);
  CHECK_FALSE(there);
}

TEST_CASE("the last frame of a trajectory comes back as arrays") {
  const Folder folder;
  const Settings net = {{"-bs_lattice_type", "triangular"}, {"-bs_lattice_size", "4,4"},         {"-bs_lattice_dim", "2"},
                        {"-bs_lattice_periodic", "xy"},     {"-bs_lattice_perturbation", "0.1"}, {"-bs_angle_stiffness", "0.1"}};
  const std::string file = folder.path + "/run.h5md";
  const auto session = session_of(with(net, {{"-ts_dt", "0.01"}, {"-bs_output", file}}));
  Numbers position, velocity;
  good(session->step(5));
  good(session->get(Session::Array::position, &position));
  good(session->get(Session::Array::velocity, &velocity));
  good(session->finish());
  const LatticeArrays arrays = read({{"-bs_lattice_file", file}}), start = read(net);
  CHECK((arrays.position == position && arrays.velocity == velocity));
  CHECK((arrays.springs == start.springs && arrays.shift == start.shift && arrays.rest_length == start.rest_length));
  CHECK((arrays.interactions.size() == 1 && arrays.interactions[0].ends == start.interactions[0].ends && arrays.position != start.position));
}
