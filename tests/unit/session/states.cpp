// Sessions: frames, states that are set, polls between steps, and what analyses hand out.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "base/collective.hpp"
#include "session/session.hpp"
#include "session_tools.hpp"

using namespace bs;

namespace {

using Numbers = std::vector<double>;

/// n unit masses on a line, tied by springs of stiffness k and length 1; the first is fixed.
LatticeArrays line(int n, double k) {
  LatticeArrays l;
  l.dim = 1;
  for (int i = 0; i < n; ++i) {
    l.position.push_back(i);
    l.mass.push_back(1);
    l.fixed.push_back(i == 0);
    if (i == 0) continue;
    l.springs.insert(l.springs.end(), {i - 1, i});
    l.stiffness.push_back(k);
    l.rest_length.push_back(1);
  }
  Group wall{"wall", l.fixed}, end{"end", std::vector<std::uint8_t>(l.mass.size(), 0)};
  end.member.back() = 1;
  l.groups = {wall, end};
  return l;
}

/// This rank's part of all.
Numbers own(const Session& session, const Numbers& all) {
  const Rows rows = session.particles();
  return {all.begin() + rows.first * session.dim(), all.begin() + (rows.first + rows.count) * session.dim()};
}

}  // namespace

TEST_CASE("frames of a session come at its output times, the last at the end") {
  const auto session = session_of(line(4, 10), {{"-ts_dt", "0.03"}, {"-bs_output_interval", "0.1"}, {"-ts_max_time", "0.25"}, {"-bs_gravity", "1"}});
  Numbers times;
  bool more = true;
  for (good(session->run_to_frame(&more)); more; good(session->run_to_frame(&more))) times.push_back(session->time());
  REQUIRE(times == Numbers{0.1, 0.2, 0.25});
  FrameData frame;
  good(session->get_frame(&frame));
  REQUIRE(frame.time == 0.25);
  REQUIRE(frame.table("position")->value == array_of(*session, Session::Array::position));
  const Numbers v = array_of(*session, Session::Array::velocity);
  double kinetic = 0;
  for (const double one : v) kinetic += one * one / 2;
  REQUIRE(frame.observable("kinetic_energy")->value[0] == Approx(kinetic).epsilon(1e-13));
  REQUIRE_FALSE(frame.table("nothing"));
}

TEST_CASE("a state that is set is one that a session begins with") {
  const Settings settings = {{"-ts_type", "cn"}, {"-ts_dt", "0.01"}, {"-snes_rtol", "1e-12"}};
  const auto session = session_of(line(5, 20), settings);
  good(session->step(7));
  Numbers x = array_of(*session, Session::Array::position), v = array_of(*session, Session::Array::velocity);
  x[4] += 0.1;
  v[3] = -0.5;
  good(session->set_rows(Session::Array::position, own(*session, x)));
  good(session->set_rows(Session::Array::velocity, own(*session, v)));
  REQUIRE(array_of(*session, Session::Array::position) == x);
  REQUIRE(array_of(*session, Session::Array::velocity) == v);
  REQUIRE(session->time() == Approx(0.07).epsilon(1e-14));
  good(session->step(5));
  REQUIRE(session->steps() == 12);
  LatticeArrays there = line(5, 20);
  there.position = x;
  there.velocity = v;
  const auto anew = session_of(there, settings);
  good(anew->step(5));
  const Numbers a = array_of(*session, Session::Array::position), b = array_of(*anew, Session::Array::position);
  for (std::size_t k = 0; k < a.size(); ++k) REQUIRE(a[k] == Approx(b[k]).epsilon(1e-11));
}

TEST_CASE("numbers that are no state are refused") {
  const auto session = session_of(line(3, 1), {{"-ts_dt", "0.01"}});
  const Rows rows = session->particles();
  Numbers x(static_cast<std::size_t>(rows.count), 0.0);
  if (rows.first + rows.count == 3) x.back() = NAN;
  REQUIRE(session->set_rows(Session::Array::position, x).text == "row 2 is not finite: give numbers");
  REQUIRE(session->set_rows(Session::Array::velocity, Numbers(7, 0.0)).exit == Exit::input);
  REQUIRE(session->set_rows(Session::Array::force, own(*session, {0, 0, 0})).text.find("set these") != std::string::npos);
  const auto writing = session_of(line(3, 1), {{"-bs_report", "/tmp/backspring_states.json"}, {"-bs_overwrite", "true"}});
  REQUIRE(writing->set_rows(Session::Array::velocity, own(*writing, {0, 0, 0})).text.find("-bs_report") != std::string::npos);
}

TEST_CASE("a poll ends a call on all ranks, and the session goes on") {
  const auto session = session_of(line(4, 10), {{"-ts_dt", "0.01"}, {"-bs_gravity", "1"}});
  int asked = 0;
  session->on_poll([&] { return ++asked == 5 && rank_of(MPI_COMM_WORLD) == size_of(MPI_COMM_WORLD) - 1 ? 2 : 0; });
  const Error error = session->run_until(10);
  REQUIRE(error.text == "stopped by signal 2");
  REQUIRE(static_cast<int>(error.exit) == 130);
  const std::int64_t there = session->steps();
  REQUIRE((there > 0 && there < 10));
  good(session->step(3));
  REQUIRE(session->steps() == there + 3);
  Result found;
  const auto still = session_of(line(4, 10), {{"-bs_gravity", "1"}}, Session::Make::when_needed);
  still->on_poll([] { return 15; });
  REQUIRE(static_cast<int>(still->solve_statics(&found, {{"-bs_load_steps", "5"}}).exit) == 143);
  still->on_poll([] { return 0; });
  good(still->solve_statics(&found));
}

TEST_CASE("an equilibrium comes with tensions, reactions and counts, modes with their shapes") {
  const auto session = session_of(line(3, 50), {{"-bs_force_end", "4"}}, Session::Make::when_needed);
  Result found;
  good(session->solve_statics(&found, {{"-bs_output_springs", "true"}, {"-bs_load_steps", "2"}}));
  REQUIRE(session->dim() == 1);
  const Numbers tension = found.frame.table("tension")->value;
  REQUIRE(tension.size() == 2);
  for (const double t : tension) REQUIRE(t == Approx(4).epsilon(1e-10));
  REQUIRE(found.frame.observable("reaction/wall")->value[0] == Approx(-4).epsilon(1e-10));
  REQUIRE(found.frame.observable("elastic_energy")->value[0] == Approx(2 * 4.0 * 4.0 / 100).epsilon(1e-10));
  REQUIRE(found.frame.table("position")->value[2] == Approx(2.16).epsilon(1e-12));
  REQUIRE((found.steps == 2 && found.rejected == 0 && found.newton >= 2));
  good(session->modes(2, &found));
  // two masses on the chain: omega^2 = k (3 -+ sqrt 5)/2, the shapes of norm 1
  REQUIRE(found.omega_squared[0] == Approx(50 * (3 - std::sqrt(5.0)) / 2).epsilon(1e-10));
  REQUIRE(found.shapes.size() == 6);
  for (std::size_t k = 0; k < 2; ++k) {
    const double *q = found.shapes.data() + 3 * k, w2 = found.omega_squared[k];
    REQUIRE(q[0] == 0);
    REQUIRE(q[1] * q[1] + q[2] * q[2] == Approx(1).epsilon(1e-10));
    REQUIRE(50 * (q[2] - q[1]) == Approx(w2 * q[2]).margin(1e-8));
  }
}

TEST_CASE("a force that the caller computes is one of the system's") {
  // a spring to the point 3 on the last particle, by the caller and as an anchor of the settings
  const Settings settings = {{"-ts_type", "verlet"}, {"-ts_dt", "0.01"}, {"-bs_gravity", "1"}};
  const auto ours = session_of(line(4, 30), settings, Session::Make::when_needed);
  ours->on_force({[](double, const ForceCallback::Rows& row, const double* x, const double* v, double* f) {
                    for (std::size_t k = 0; k < row.size(); ++k)
                      if (row[k] == 3) f[k] -= 20 * (x[k] - 3) + 0.5 * v[k];
                  },
                  {},
                  {}});
  LatticeArrays tied = line(5, 30);  // a fixed particle in the anchor's place
  tied.position[4] = 3 + 1;
  tied.fixed[4] = 1;
  tied.stiffness[3] = 20;
  tied.damping = {0, 0, 0, 0.5};
  tied.groups.clear();
  const auto theirs = session_of(tied, settings);
  good(ours->step(50));
  good(theirs->step(50));
  const Numbers a = array_of(*ours, Session::Array::position), b = array_of(*theirs, Session::Array::position);
  for (std::size_t k = 0; k < 4; ++k) REQUIRE(a[k] == Approx(b[k]).epsilon(1e-13));
  Result found, expected;
  good(ours->solve_statics(&found));
  good(theirs->solve_statics(&expected));
  for (std::size_t k = 0; k < 4; ++k)
    REQUIRE(found.frame.table("position")->value[k] == Approx(expected.frame.table("position")->value[k]).epsilon(1e-10));
}

TEST_CASE("an equilibrium that is not found leaves the last one on the way") {
  const auto session = session_of(line(3, 100), {{"-bs_force_end", "4"}}, Session::Make::when_needed);
  session->on_force({[](double s, const ForceCallback::Rows& row, const double*, const double*, double* f) {
                       for (std::size_t k = 0; k < row.size(); ++k) f[k] += s > 0.6 ? NAN : 0;
                     },
                     {},
                     {}});
  Result found;
  const Error error = session->solve_statics(&found, {{"-bs_load_steps", "4"}, {"-bs_step_max_cuts", "0"}});
  INFO(error.text);
  REQUIRE(error.exit == Exit::solve);
  REQUIRE(error.text.find("computed outside is not finite") != std::string::npos);
  REQUIRE((found.load_factor == 0.5 && found.steps == 2 && found.rejected == 1));
  REQUIRE(found.frame.table("position")->value[2] == Approx(2 + 2 * 0.5 * 4 / 100).epsilon(1e-12));
}

TEST_CASE("two sessions that share a particle, each step repeated until they agree, stand for one") {
  // a chain of 10: particles 0 to 5 are told where the last one is and answer with the force on it, 5 to 9 the other way round
  const Settings settings = {{"-ts_type", "beuler"}, {"-ts_dt", "0.02"}, {"-snes_rtol", "1e-13"}};
  const auto chain = [](int first, int count, bool fixed) {
    LatticeArrays l = line(count, 40);
    for (double& x : l.position) x = 1.07 * x + first;
    l.fixed[0] = fixed;
    l.groups = {{"end", std::vector<std::uint8_t>(l.mass.size(), 0)}};
    l.groups[0].member.back() = 1;
    return l;
  };
  const auto whole = session_of(chain(0, 10, true), settings);
  LatticeArrays right = chain(5, 5, false);
  for (int i = 0; i < 5; ++i) right.position[static_cast<std::size_t>(i)] = 1.07 * (5 + i);
  const auto told = session_of(chain(0, 6, true), with(settings, {{"-bs_motion_end", "given"}}));
  double pull = 0;
  const auto pulled = session_of(right, settings, Session::Make::when_needed);
  pulled->on_force({[&](double, const ForceCallback::Rows& row, const double*, const double*, double* f) {
                      for (std::size_t k = 0; k < row.size(); ++k)
                        if (row[k] == 0) f[k] += pull;
                    },
                    {},
                    {}});
  double place = array_of(*told, Session::Array::position)[5];
  for (int step = 1; step <= 15; ++step) {
    std::shared_ptr<const Session::State> before[2];
    good(told->save(&before[0]));
    good(pulled->save(&before[1]));
    double next = place, off = 1;
    for (int k = 0; k < 60 && std::abs(off) > 1e-13; ++k) {
      if (k > 0) {
        good(told->restore(*before[0]));
        good(pulled->restore(*before[1]));
      }
      good(told->drive("end", 0.02 * step, own(*told, {0, 0, 0, 0, 0, next})));
      good(told->step());
      pull = -array_of(*told, Session::Array::reaction)[5];
      good(pulled->step());
      off = array_of(*pulled, Session::Array::position)[0] - next;
      next += 0.9 * off;
    }
    CHECK(std::abs(off) <= 1e-13);
    place = next;
    good(whole->step());
    const Numbers x = array_of(*whole, Session::Array::position), a = array_of(*told, Session::Array::position),
                  b = array_of(*pulled, Session::Array::position);
    for (std::size_t k = 0; k < 6; ++k) CHECK(a[k] == Approx(x[k]).epsilon(1e-11));
    for (std::size_t k = 0; k < 5; ++k) CHECK(b[k] == Approx(x[5 + k]).epsilon(1e-11));
  }
  CHECK(told->steps() == 15);
}

TEST_CASE("a session goes on from a state that was saved as if nothing had come between") {
  LatticeArrays net = line(6, 20);
  net.spring_law = "plastic";
  net.spring_columns.push_back({"yield_force", "", Numbers(5, 0.3)});
  const Settings settings = {{"-ts_type", "cn"}, {"-ts_dt", "0.02"}, {"-snes_rtol", "1e-13"}, {"-bs_motion_end", "x=sinusoid:0.4,2"}};
  const auto session = session_of(net, settings), undisturbed = session_of(net, settings);
  std::shared_ptr<const Session::State> there;
  good(session->step(15));
  good(session->save(&there));
  good(session->step(20));
  const Numbers first = array_of(*session, Session::Array::position);
  good(session->restore(*there));
  CHECK(session->steps() == 15);
  CHECK(session->time() == there->time);
  good(session->step(20));
  const Numbers again = array_of(*session, Session::Array::position);
  good(undisturbed->step(35));
  const Numbers expected = array_of(*undisturbed, Session::Array::position);
  for (std::size_t k = 0; k < 6; ++k) {
    CHECK(first[k] == expected[k]);
    CHECK(again[k] == Approx(expected[k]).epsilon(1e-11));
  }
  FrameData a, b;
  good(session->get_frame(&a));
  good(undisturbed->get_frame(&b));
  CHECK(a.observable("work/end")->value[0] == Approx(b.observable("work/end")->value[0]).epsilon(1e-10));
  CHECK(a.observable("dissipated_energy")->value[0] > 0);
  CHECK(a.observable("dissipated_energy")->value[0] == Approx(b.observable("dissipated_energy")->value[0]).epsilon(1e-10));
}

TEST_CASE("motions that are given go where they are told, and are refused where nobody tells") {
  const auto session = session_of(line(3, 10), {{"-ts_dt", "0.01"}, {"-bs_motion_end", "given"}, {"-bs_motion_wall", "fixed"}});
  good(session->step(2));
  CHECK(array_of(*session, Session::Array::position)[2] == 2);
  good(session->drive("end", 0.05, own(*session, {0, 0, 2.3})));
  good(session->step(1));
  CHECK(array_of(*session, Session::Array::position)[2] == Approx(2.1).epsilon(1e-13));
  CHECK(array_of(*session, Session::Array::velocity)[2] == Approx(10).epsilon(1e-12));
  good(session->step(4));
  CHECK(array_of(*session, Session::Array::position)[2] == 2.3);
  CHECK(array_of(*session, Session::Array::velocity)[2] == 0);
  CHECK(session->drive("wall", 1, own(*session, {0, 0, 0})).text.find("-bs_motion_wall given") != std::string::npos);
  CHECK(session->drive("end", 0.01, own(*session, {0, 0, 0})).text.find("later time") != std::string::npos);
  CHECK(session->drive("", 1, own(*session, {0, 0, 0})).exit == Exit::input);
  CHECK(session->checkpoint("given_motions.checkpoint").text.find("-bs_motion_end") != std::string::npos);
  // a table of a file whose name has the word is no given motion
  const Folder folder;
  const std::string table = folder.path + "/given.csv", saved = folder.path + "/saved";
  if (rank_of(MPI_COMM_WORLD) == 0) std::ofstream(table) << "0,0\n1,0.5\n";
  MPI_Barrier(MPI_COMM_WORLD);
  const auto followed = session_of(line(3, 10), {{"-ts_dt", "0.01"}, {"-bs_motion_end", "table:" + table}});
  good(followed->step(2));
  good(followed->checkpoint(saved));
}

TEST_CASE("an observer pauses a session after the step that it sees, and load steps are told, too") {
  const auto session = session_of(line(4, 10), {{"-ts_dt", "0.03"}, {"-bs_gravity", "1"}}),
             same = session_of(line(4, 10), {{"-ts_dt", "0.03"}, {"-bs_gravity", "1"}});
  session->on_step([&](const StepRecord& record) {
    if (record.step % 4 == 0) session->pause();
  });
  good(session->run_until(10));
  REQUIRE(session->steps() == 4);
  good(session->step(10));
  REQUIRE(session->steps() == 8);
  bool more = false;
  good(session->run_to_frame(&more));
  REQUIRE(session->steps() == 9);
  good(same->step(9));
  REQUIRE(array_of(*session, Session::Array::position) == array_of(*same, Session::Array::position));
  Numbers factors;
  const auto still = session_of(line(3, 50), {{"-bs_force_end", "4"}}, Session::Make::when_needed);
  still->on_step([&](const StepRecord& record) { factors.push_back(record.time); });
  Result found;
  good(still->solve_statics(&found, {{"-bs_load_steps", "4"}}));
  REQUIRE(factors == Numbers{0.25, 0.5, 0.75, 1});
}

TEST_CASE("what breaks is told with frames and equilibria, and a checkpoint goes on with it") {
  LatticeArrays bundle = line(3, 10);
  bundle.break_columns = {{"critical_force", {}, {0.5, 100}}};
  const Settings pull = {{"-ts_dt", "0.05"}, {"-bs_force_end", "3"}};
  const auto session = session_of(bundle, pull);
  FrameData frame;
  good(session->get_frame(&frame));
  REQUIRE(frame.breaks.empty());
  good(session->step(20));
  good(session->get_frame(&frame));
  REQUIRE(frame.breaks.size() == 7);
  REQUIRE((frame.breaks[2].name == "spring" && frame.breaks[2].value == Numbers{0}));
  REQUIRE((frame.breaks[3].name == "ends" && frame.breaks[3].columns == 2 && frame.breaks[3].value == Numbers{0, 1}));
  REQUIRE((frame.breaks[0].value[0] > 0 && frame.breaks[0].value[0] < session->time()));
  const std::string file = "session_states.checkpoint";
  good(session->checkpoint(file));
  good(session->step(5));
  const auto anew = session_of(bundle, {{"-bs_restart", file}});
  good(anew->step(5));
  REQUIRE((anew->steps() == 25 && anew->time() == session->time()));
  REQUIRE(array_of(*anew, Session::Array::position) == array_of(*session, Session::Array::position));
  REQUIRE(static_cast<int>(session->checkpoint("no/such/folder").exit) == static_cast<int>(Exit::io));
  MPI_Barrier(MPI_COMM_WORLD);
  (void)std::remove(file.c_str());
}
