// Sessions: what they compute is what the program computes, and they do not disturb one another.
#include <catch2/catch.hpp>

#include <hdf5.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "base/context.hpp"
#include "lattice/generator.hpp"
#include "options.hpp"
#include "session/session.hpp"
#include "session_tools.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

const MPI_Comm world = MPI_COMM_WORLD;
using Numbers = std::vector<double>;

const Settings NET = {{"-bs_lattice_type", "triangular"}, {"-bs_lattice_size", "4,4"}, {"-bs_lattice_dim", "2"},
                      {"-bs_lattice_fixed", "ymax"},      {"-bs_gravity", "0,-9.81"},  {"-bs_spring_law", "hooke"}};
const Settings CHAIN = {
    {"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "7"}, {"-bs_lattice_velocity", "1"}, {"-ts_type", "cn"}, {"-ts_dt", "0.02"}};

/// The program's task with these options, which writes `file` and a report beside it; under its own communicator.
void run_program(const std::string& task, const Settings& settings, const std::string& file) {
  OptionTexts texts(settings.begin(), settings.end());
  texts["-bs_task"] = task;
  texts["-bs_output"] = file;
  texts["-bs_report"] = file + ".json";
  const Given given(texts);
  MPI_Comm comm;
  int exit_code = -1;
  MPI_Comm_dup(world, &comm);
  drop_context(comm);
  REQUIRE(Session::perform(comm, &exit_code) == 0);
  REQUIRE(exit_code == 0);
  MPI_Comm_free(&comm);
}

/// The last positions of a trajectory, read on every rank.
Numbers last_positions(const std::string& file) {
  const hid_t opened = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t table = H5Dopen2(opened, "/particles/trajectory/position/value", H5P_DEFAULT), space = H5Dget_space(table);
  hsize_t shape[3] = {0, 0, 0};
  H5Sget_simple_extent_dims(space, shape, nullptr);
  Numbers all(shape[0] * shape[1] * shape[2]);
  H5Dread(table, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
  H5Sclose(space);
  H5Dclose(table);
  H5Fclose(opened);
  return {all.end() - static_cast<std::ptrdiff_t>(shape[1] * shape[2]), all.end()};
}

/// The numbers behind a key of a report, up to the next key.
Numbers reported(const std::string& file, const std::string& key) {
  std::ifstream in(file + ".json");
  std::stringstream text;
  text << in.rdbuf();
  const std::string all = text.str();
  std::size_t at = all.find("\"" + key + "\":");
  REQUIRE(at != std::string::npos);
  at += key.size() + 3;
  Numbers found;
  for (const std::size_t end = std::min(all.find('"', at), all.size()); at < end;) {
    char* behind = nullptr;
    const double value = std::strtod(all.c_str() + at, &behind);
    if (behind == all.c_str() + at) {
      ++at;
      continue;
    }
    found.push_back(value);
    at = static_cast<std::size_t>(behind - all.c_str());
  }
  return found;
}

/// Two masses m and a spring of stiffness k and length L along a line, stretched by 2 a and at rest.
LatticeArrays two_masses(double m, double k, double length, double a) {
  LatticeArrays two;
  two.dim = 1;
  two.position = {-a, length + a};
  two.mass = {m, m};
  two.springs = {0, 1};
  two.stiffness = {k};
  two.rest_length = {length};
  return two;
}

double resident_memory() {
  std::ifstream in("/proc/self/statm");
  double all = 0, resident = 0;
  in >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

TEST_CASE("a lattice in memory steps by backward Euler's recurrence") {
  const double m = 2, k = 50, length = 1, a = 0.1, h = 0.01;
  std::unique_ptr<Session> session;
  good(Session::create(world, two_masses(m, k, length, a), {{"-ts_type", "beuler"}, {"-ts_dt", "0.01"}}, &session));
  REQUIRE(session->particles().total == 2);
  REQUIRE(session->dim() == 1);
  REQUIRE(array_of(*session, Session::Array::position) == Numbers{-a, length + a});
  // each mass is on a spring of stiffness 2k to its place: u' = v, m v' = -2 k u
  double u = a, v = 0;
  const double w2 = 2 * k / m;
  for (int n = 1; n <= 40; ++n) {
    good(session->step());
    v = (v - h * w2 * u) / (1 + h * h * w2);
    u += h * v;
    const Numbers x = array_of(*session, Session::Array::position), f = array_of(*session, Session::Array::force);
    REQUIRE(x[1] == Approx(length + u).epsilon(1e-11));
    REQUIRE(x[0] == Approx(-u).epsilon(1e-11));
    REQUIRE(f[0] == Approx(2 * k * u).epsilon(1e-9));
    REQUIRE(array_of(*session, Session::Array::velocity)[1] == Approx(v).epsilon(1e-9));
  }
  REQUIRE(session->steps() == 40);
  REQUIRE(session->time() == Approx(0.4).epsilon(1e-13));
  Numbers rows;
  good(session->get_rows(Session::Array::position, &rows));
  REQUIRE(rows.size() == static_cast<std::size_t>(session->particles().count));
}

TEST_CASE("a lattice in memory is the lattice of the options, its box and groups included") {
  GeneratorSpec spec;
  spec.type = LatticeType::triangular;
  spec.size = {5, 4};
  spec.dim = 2;
  spec.perturbation = 0.1;
  spec.stiffness = {300};
  spec.periodic = "x";
  spec.fixed = {"ymin"};
  const Settings options = {{"-bs_lattice_type", "triangular"},  {"-bs_lattice_size", "5,4"},      {"-bs_lattice_dim", "2"},
                            {"-bs_lattice_perturbation", "0.1"}, {"-bs_lattice_stiffness", "300"}, {"-bs_lattice_periodic", "x"},
                            {"-bs_lattice_fixed", "ymin"}};
  const Settings loads = {{"-bs_gravity", "2,-9.81"}, {"-ts_dt", "0.02"}};
  std::unique_ptr<Session> given;
  good(Session::create(world, arrays_of(generate(spec, 0, 1)), loads, &given));
  const auto named = session_of(with(options, loads));
  good(given->run_until(0.2));
  good(named->run_until(0.2));
  REQUIRE(given->steps() == 10);
  for (const Session::Array what : {Session::Array::position, Session::Array::velocity, Session::Array::force}) {
    const Numbers in_memory = array_of(*given, what), by_options = array_of(*named, what);
    REQUIRE(in_memory.size() == by_options.size());
    if (size_of(world) == 1) REQUIRE(in_memory == by_options);  // else the rows come from other ranks, and so may the parts of the lattice differ
    for (std::size_t k = 0; k < in_memory.size(); ++k) REQUIRE(in_memory[k] == Approx(by_options[k]).epsilon(1e-6).margin(1e-6));
  }
  LatticeArrays grouped = arrays_of(generate(spec, 0, 1));
  grouped.groups = {{"left", std::vector<std::uint8_t>(grouped.mass.size(), 0)}};
  grouped.groups[0].member[0] = 1;
  good(Session::create(world, grouped, {{"-bs_motion_left", "fixed"}}, &given));
  const Numbers start = array_of(*given, Session::Array::position);
  good(given->step(3));
  REQUIRE(array_of(*given, Session::Array::position)[0] == start[0]);
}

TEST_CASE("two sessions, stepped by turns, are two runs of the program bit by bit") {
  const Folder folder;
  const std::string net = folder.path + "/net.h5md", chain = folder.path + "/chain.h5md";
  run_program("dynamics", with(NET, {{"-ts_max_time", "0.1"}}), net);
  run_program("dynamics", with(CHAIN, {{"-ts_max_time", "0.15"}}), chain);
  const auto first = session_of(NET), second = session_of(CHAIN);
  int steps = 0, frames = 0;
  first->on_step([&](const StepRecord& record) { steps += record.step == first->steps() ? 1 : 100; });
  first->on_frame([&](double) { ++frames; });
  for (int n = 0; n < 5; ++n) {
    good(first->step());
    good(second->step(1));
  }
  good(first->run_until(0.1));
  good(second->run_until(0.15));
  REQUIRE(array_of(*first, Session::Array::position) == last_positions(net));
  REQUIRE(array_of(*second, Session::Array::position) == last_positions(chain));
  REQUIRE(steps == 10);
  REQUIRE(frames == 2);
  REQUIRE(second->steps() == 8);
  good(first->step());
  REQUIRE(first->steps() == 11);
  REQUIRE(first->warnings().empty());
}

TEST_CASE("one call does what -bs_task names, and tells the end of it on the caller's communicator") {
  MPI_Comm comm;
  int exit_code = -1;
  MPI_Comm_dup(world, &comm);
  drop_context(comm);
  OptionTexts texts(NET.begin(), NET.end());
  texts["-bs_task"] = "dance";
  {
    const Given given(texts);
    const PetscErrors errors(comm);
    REQUIRE(Session::perform(comm, &exit_code) != 0);
    REQUIRE(last_error(comm).exit == Exit::input);
    REQUIRE(last_error(comm).text.find("dance") != std::string::npos);
  }
  clear_error(comm);
  for (const char* const task : {"dynamics", "statics"}) {
    texts["-bs_task"] = task;
    const Given given(texts);
    set_signals(comm, {[] { return 15; }, {}});
    REQUIRE(Session::perform(comm, &exit_code) == 0);
    REQUIRE(exit_code == 143);
  }
  REQUIRE_FALSE(last_error(comm));
  MPI_Comm_free(&comm);
}

TEST_CASE("equilibria, moduli and modes of a session are the program's") {
  const Folder folder;
  const std::string file = folder.path + "/run.h5md";
  const auto session =
      session_of(with(NET, {{"-ts_type", "cn"}, {"-ts_dt", "0.005"}, {"-ts_init_time", "3"}, {"-bs_output", folder.path + "/own.h5md"}}));
  Result found;
  REQUIRE(session->time() == 3);
  run_program("statics", NET, file);
  good(session->step(2));  // changes nothing of what follows
  good(session->solve_statics(&found));
  REQUIRE(found.load_factor == 1);
  REQUIRE(found.frame.table("position")->value == last_positions(file));
  good(session->solve_statics(&found, {{"-bs_load_steps", "4"}}));
  REQUIRE(found.load_factor == 1);

  const std::string modes = folder.path + "/modes.h5md";
  run_program("modes", with(NET, {{"-bs_modes", "3"}}), modes);
  for (int again = 0; again < 2; ++again) {
    good(session->modes(3, &found));
    REQUIRE(found.omega_squared == reported(modes, "omega_squared"));
  }

  const Settings box = {{"-bs_lattice_type", "triangular"}, {"-bs_lattice_size", "4,4"}, {"-bs_lattice_dim", "2"}, {"-bs_lattice_periodic", "xy"}};
  const std::string moduli = folder.path + "/moduli.h5md";
  run_program("moduli", box, moduli);
  good(session_of(box)->moduli(&found));
  REQUIRE(found.stiffness.size() == 9);
  REQUIRE(found.stiffness == reported(moduli, "stiffness"));
  good(session->step());
  REQUIRE(session->steps() == 3);
  const Numbers last = array_of(*session, Session::Array::position);
  good(session->finish());
  REQUIRE(last_positions(folder.path + "/own.h5md") == last);
  REQUIRE(session->step().text == "the session is finished: create another one");
}

TEST_CASE("errors are values, said by nobody, and what follows works") {
  Caught out(stdout), err;
  std::unique_ptr<Session> session;
  Error error = Session::create(world, {{"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "5x"}}, &session);
  REQUIRE(error.text == "option -bs_lattice_size: 5x is not a whole number: give a whole number");
  REQUIRE(error.exit == Exit::input);
  REQUIRE_FALSE(session);
  LatticeArrays bad = two_masses(1, 1, 1, 0);
  bad.springs = {0};
  error = Session::create(world, bad, {}, &session);
  REQUIRE(error.text == "lattice in memory: springs has 1 number: give 2");
  bad.springs = {0, 2};
  REQUIRE(Session::create(world, bad, {}, &session));
  bad.springs = {0, 1};
  bad.mass[0] = -1;
  REQUIRE(Session::create(world, bad, {}, &session));
  REQUIRE_FALSE(session);
  bad.mass[0] = 1;
  good(Session::create(world, bad, {{"-bs_grvity", "1"}}, &session));
  error = session->step();
  REQUIRE(error.text == "option -bs_grvity does not exist: did you mean -bs_gravity?");
  good(Session::create(world, bad, {{"-ts_type", "euler"}, {"-ts_dt", "1e200"}, {"-bs_lattice_velocity", "1e140"}}, &session));
  error = session->step(9);
  REQUIRE(error);
  REQUIRE(error.exit == Exit::solve);
  const auto next = session_of(CHAIN);
  good(next->step(3));
  REQUIRE(next->steps() == 3);
  if (size_of(world) == 1) {  // an error of PETSc's, which is one rank's own
    REQUIRE(session_of(with(CHAIN, {{"-snes_type", "nonsense"}}))->step().text.find("nonsense") != std::string::npos);
  }
  REQUIRE(err.text().empty());
  REQUIRE(out.text().empty());
  REQUIRE_FALSE(last_error(world));
}

#ifndef __SANITIZE_ADDRESS__  // which keeps what is freed for a while
TEST_CASE("many sessions in one process take no more memory than a few") {
  const auto some = [](int count) {
    for (int n = 0; n < count; ++n) {
      const auto session = session_of(NET);
      good(session->step(2));
    }
    return resident_memory();
  };
  const double few = some(20), many = some(size_of(world) == 1 ? 180 : 20);
  INFO("resident memory after 20 sessions " << few << ", after all " << many);
  REQUIRE(many - few < 4e6);
}
#endif
