// Numbers of springs and particles that change while what a session has made of them lives.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lattice/generator.hpp"
#include "lattice/spring_laws.hpp"
#include "session/session.hpp"
#include "session_tools.hpp"

using namespace bs;

namespace {

using Numbers = std::vector<double>;

const Settings LOADS = {{"-bs_gravity", "0.3,-1"}, {"-snes_rtol", "1e-12"}};

/// A net that is stretched a little and hangs from one side, uneven, with numbers for any law.
LatticeArrays net(const SpringLawInfo* law = nullptr) {
  GeneratorSpec spec;
  spec.type = LatticeType::triangular;
  spec.size = {5, 5};
  spec.dim = 2;
  spec.perturbation = 0.1;
  spec.stiffness = {100};
  spec.fixed = {"ymax"};
  LatticeArrays all = arrays_of(generate(spec, 0, 1));
  const std::size_t springs = all.stiffness.size();
  all.rest_length.assign(springs, 0.9);
  all.damping.assign(springs, 0.5);
  all.damping[3] = 0;
  if (!law) return all;
  all.spring_law = law->name;
  for (const SpringParameter& one : law->parameters)
    all.spring_columns.push_back({one.name, "", Numbers(springs, 70)});  // nothing yields: what is plastic depends on the way
  if (law->zero_rest) all.rest_length.assign(springs, 0);
  return all;
}

/// Other numbers than these, each by itself.
Numbers changed(const Numbers& numbers, double share) {
  Numbers now = numbers;
  for (std::size_t k = 0; k < now.size(); ++k) now[k] *= 1 + share * std::sin(1.0 + static_cast<double>(k));
  return now;
}

std::unique_ptr<Session> session_of_net(const LatticeArrays& lattice, const Settings& settings = LOADS) {
  return session_of(lattice, settings, Session::Make::when_needed);
}

/// Of the named table of a result.
const Numbers& table(const Result& result, const std::string& name) {
  for (const FrameTable& one : result.frame.tables)
    if (one.name == name) return one.value;
  FAIL("no table " << name);
  return result.frame.tables[0].value;
}

void require_near(const Numbers& a, const Numbers& b, double most) {
  REQUIRE(a.size() == b.size());
  for (std::size_t k = 0; k < a.size(); ++k) REQUIRE(std::abs(a[k] - b[k]) <= most * (1 + std::abs(b[k])));
}

/// The equilibrium that a session of its own finds.
Result afresh(const LatticeArrays& lattice) {
  Result found;
  good(session_of_net(lattice)->solve_statics(&found));
  return found;
}

}  // namespace

TEST_CASE("an equilibrium follows the numbers of its springs and particles") {
  LatticeArrays lattice = net();
  const auto session = session_of_net(lattice);
  Result found;
  REQUIRE(session->follow(&found).text.find("solve_statics") != std::string::npos);
  good(session->solve_statics(&found));
  const std::pair<const char*, Numbers*> columns[] = {
      {"stiffness", &lattice.stiffness}, {"rest_length", &lattice.rest_length}, {"mass", &lattice.mass}, {"damping", &lattice.damping}};
  for (const auto& [name, column] : columns) {
    *column = changed(*column, 0.2);
    good(session->set_numbers(name, *column));
    REQUIRE(session->numbers(name) == *column);
    good(session->follow(&found));
    REQUIRE(found.load_factor == 1);
    require_near(table(found, "position"), table(afresh(lattice), "position"), 1e-9);
  }
  Result modes_now, modes_afresh;
  good(session->modes(5, &modes_now));
  good(session_of_net(lattice)->modes(5, &modes_afresh));
  require_near(modes_now.omega_squared, modes_afresh.omega_squared, 1e-9);
  REQUIRE(session->follow(&found).exit == Exit::input);  // the last analysis was of modes
}

TEST_CASE("what every law of springs takes may change") {
  for (const SpringLawInfo& law : spring_laws()) {
    LatticeArrays lattice = net(&law);
    const auto session = session_of_net(lattice);
    Result found;
    INFO(law.name);
    good(session->solve_statics(&found));
    std::vector<std::pair<std::string, Numbers*>> columns = {{"stiffness", &lattice.stiffness}};
    for (Column& one : lattice.spring_columns) columns.emplace_back(one.name, &one.value);
    for (const auto& [name, column] : columns) {
      INFO(name);
      *column = changed(*column, 0.1);
      good(session->set_numbers(name, *column));
      good(session->follow(&found));
      require_near(table(found, "position"), table(afresh(lattice), "position"), 1e-8);
    }
  }
}

TEST_CASE("springs that are removed are those of a lattice without their forces") {
  LatticeArrays lattice = net();
  const auto session = session_of_net(lattice);
  Result found;
  good(session->solve_statics(&found));
  good(session->remove_springs({2, 11, 30}));
  good(session->follow(&found));
  for (const std::size_t row : {2, 11, 30}) lattice.stiffness[row] = lattice.damping[row] = 0;
  require_near(table(found, "position"), table(afresh(lattice), "position"), 1e-9);
  REQUIRE(session->remove_springs({99}).text.find("spring 99") != std::string::npos);
  good(session->set_numbers("stiffness", net().stiffness));
  good(session->set_numbers("damping", net().damping));
  REQUIRE(session->numbers("stiffness") == lattice.stiffness);
  REQUIRE(session->numbers("damping") == lattice.damping);
}

TEST_CASE("a state that is restored brings back numbers and springs, and one of another lattice is refused") {
  LatticeArrays lattice = net(), other = net();
  const Settings settings = {{"-ts_type", "verlet"}, {"-ts_dt", "0.01"}, {"-bs_gravity", "0,-3"}};
  const auto session = session_of_net(lattice, settings), undisturbed = session_of_net(lattice, settings);
  std::shared_ptr<const Session::State> there, elsewhere;
  good(session->step(5));
  good(session->save(&there));
  good(session->set_numbers("mass", changed(lattice.mass, 0.2)));
  good(session->remove_springs({2, 11, 30}));
  good(session->step(5));
  good(session->restore(*there));
  REQUIRE(session->numbers("mass") == lattice.mass);
  REQUIRE(session->numbers("stiffness") == lattice.stiffness);
  REQUIRE(session->numbers("damping") == lattice.damping);
  good(undisturbed->restore(*there));
  good(undisturbed->step(5));
  good(session->step(5));
  REQUIRE(array_of(*session, Session::Array::position) == array_of(*undisturbed, Session::Array::position));
  other.mass[3] *= 2;
  const auto heavier = session_of_net(other, settings);
  good(heavier->save(&elsewhere));
  const Error error = session->restore(*elsewhere);
  REQUIRE((error.exit == Exit::input && error.text.find("another lattice") != std::string::npos));
  REQUIRE(session->steps() == 10);
}

TEST_CASE("a motion goes on with other numbers as one that begins with them") {
  for (const char* type : {"beuler", "cn", "verlet", "bdf"}) {
    LatticeArrays lattice = net();
    const Settings settings = {{"-ts_type", type}, {"-ts_dt", "0.01"}, {"-bs_gravity", "0,-3"}, {"-snes_rtol", "1e-12"}};
    const auto session = session_of_net(lattice, settings);
    good(session->step(5));
    lattice.stiffness = changed(lattice.stiffness, 0.3);
    lattice.mass = changed(lattice.mass, 0.2);
    for (double& one : lattice.damping) one *= 0.5;
    lattice.position = array_of(*session, Session::Array::position);
    lattice.velocity = array_of(*session, Session::Array::velocity);
    const Numbers before = array_of(*session, Session::Array::force);
    good(session->set_numbers("stiffness", lattice.stiffness));
    good(session->set_numbers("mass", lattice.mass));
    good(session->set_numbers("damping", lattice.damping));
    REQUIRE(array_of(*session, Session::Array::position) == lattice.position);
    const auto anew = session_of_net(lattice, settings);
    const Numbers forces = array_of(*session, Session::Array::force);  // of the same state as before, which are kept where nothing has changed
    REQUIRE(forces != before);
    require_near(forces, array_of(*anew, Session::Array::force), 1e-12);
    good(session->step(5));
    REQUIRE(session->steps() == 10);
    good(anew->step(5));
    INFO(type);
    require_near(array_of(*session, Session::Array::position), array_of(*anew, Session::Array::position), 1e-11);
    require_near(array_of(*session, Session::Array::force), array_of(*anew, Session::Array::force), 1e-8);
  }
}

TEST_CASE("a checkpoint knows the numbers that were given last") {
  LatticeArrays lattice = net();
  const Folder folder;
  const std::string file = folder.path + "/state.h5";
  const Settings settings = {{"-ts_type", "cn"}, {"-ts_dt", "0.01"}, {"-bs_gravity", "0,-3"}};
  const Settings onward = {{"-ts_type", "cn"}, {"-ts_dt", "0.01"}, {"-bs_gravity", "0,-3"}, {"-bs_restart", file}};
  const auto session = session_of_net(lattice, settings);
  good(session->step(3));
  const LatticeArrays before = lattice;
  lattice.stiffness = changed(lattice.stiffness, 0.3);
  lattice.mass = changed(lattice.mass, 0.3);
  good(session->set_numbers("stiffness", lattice.stiffness));
  good(session->set_numbers("mass", lattice.mass));
  good(session->step(2));
  good(session->checkpoint(file));
  const auto goes_on = session_of_net(lattice, onward);
  good(goes_on->step(2));
  good(session->step(2));
  REQUIRE(array_of(*goes_on, Session::Array::position) == array_of(*session, Session::Array::position));
  REQUIRE(session_of_net(before, onward)->step().exit == Exit::input);
}

TEST_CASE("numbers that are none are refused, and nothing changes") {
  const LatticeArrays lattice = net();
  const auto session = session_of_net(lattice);
  Result found;
  good(session->solve_statics(&found));
  const Numbers where = table(found, "position");
  const std::size_t springs = lattice.stiffness.size();
  const auto with = [](Numbers numbers, std::size_t row, double value) {
    numbers[row] = value;
    return numbers;
  };
  const std::pair<Error, const char*> faults[] = {
      {session->set_numbers("stiffness", Numbers(springs, -1)), "spring 0: stiffness -1"},
      {session->set_numbers("stiffness", with(lattice.stiffness, 4, NAN)), "spring 4: stiffness nan; give finite numbers"},
      {session->set_numbers("stiffness", Numbers(springs - 1, 1)), "numbers called stiffness for 56 springs"},
      {session->set_numbers("rest_length", with(lattice.rest_length, 7, 0)), "spring 7: rest_length 0; a spring of rest length 0"},
      {session->set_numbers("rest_length", with(lattice.rest_length, 7, -2)), "spring 7: rest_length -2"},
      {session->set_numbers("damping", Numbers(springs, 1)), "spring 3: damping 1; a spring that was made without"},
      {session->set_numbers("mass", with(lattice.mass, 2, 0)), "particle 2: mass 0; give masses > 0"},
      {session->set_numbers("yield_force", Numbers(springs, 1)), "yield_force are not the lattice's"},
      {session->set_numbers("area", Numbers(springs, 1)), "name stiffness, rest_length, damping, mass"}};
  for (const auto& [error, words] : faults) {
    REQUIRE(error.exit == Exit::input);
    CAPTURE(error.text);
    REQUIRE(error.text.find(words) != std::string::npos);
  }
  good(session->follow(&found));
  require_near(table(found, "position"), where, 1e-12);
  const auto named = session_of({{"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "4"}});
  REQUIRE(named->set_numbers("stiffness", {1, 1, 1}).text.find("read_lattice") != std::string::npos);
}

TEST_CASE("sensitivities of equilibria with springs of any law: by differences of equilibria") {
  for (const SpringLawInfo& law : spring_laws()) {
    const LatticeArrays lattice = net(&law);
    const auto session = session_of_net(lattice);
    Result found;
    std::map<std::string, Numbers> changes;
    REQUIRE(session->sensitivities(Numbers(50, 1.0), &changes).text.find("no equilibrium") != std::string::npos);
    good(session->solve_statics(&found));
    Numbers slope(50);
    for (std::size_t k = 0; k < slope.size(); ++k) slope[k] = std::cos(static_cast<double>(3 * k));
    const auto quantity = [&] {
      double sum = 0;
      for (std::size_t k = 0; k < slope.size(); ++k) sum += slope[k] * table(found, "position")[k];
      return sum;
    };
    good(session->sensitivities(slope, &changes));
    REQUIRE(changes.size() == 2 + law.parameters.size());
    const std::map<std::string, Numbers> wanted = changes;
    for (const auto& [name, expected] : wanted) {
      if (name == "rest_length" && law.zero_rest) continue;  // the net's springs have none
      const Numbers before = session->numbers(name);
      const double most = std::abs(*std::max_element(expected.begin(), expected.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
      for (const std::size_t spring : {0, 17, 40}) {
        const double h = 1e-4 * before[spring];
        double values[2];
        for (const int side : {0, 1}) {
          Numbers now = before;
          now[spring] += side == 0 ? h : -h;
          good(session->set_numbers(name, now));
          REQUIRE(session->sensitivities(slope, &changes).exit == Exit::input);  // of other numbers than the equilibrium's
          good(session->follow(&found));
          values[side] = quantity();
        }
        CAPTURE(law.name, name, spring);
        REQUIRE(std::abs((values[0] - values[1]) / (2 * h) - expected[spring]) <= 1e-5 * most + 1e-11);
      }
      good(session->set_numbers(name, before));
      good(session->follow(&found));
    }
    REQUIRE(session->sensitivities(Numbers(3, 1.0), &changes).text.find("3 slopes for 50") != std::string::npos);
  }
}
