// Sessions: frames, states that are set, polls between steps, and what analyses hand out.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>

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
  ours->on_force([](double, const std::vector<std::int64_t>& row, const double* x, const double* v, double* f) {
    for (std::size_t k = 0; k < row.size(); ++k)
      if (row[k] == 3) f[k] -= 20 * (x[k] - 3) + 0.5 * v[k];
  });
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
  session->on_force([](double s, const std::vector<std::int64_t>& row, const double*, const double*, double* f) {
    for (std::size_t k = 0; k < row.size(); ++k) f[k] += s > 0.6 ? NAN : 0;
  });
  Result found;
  const Error error = session->solve_statics(&found, {{"-bs_load_steps", "4"}, {"-bs_step_max_cuts", "0"}});
  INFO(error.text);
  REQUIRE(error.exit == Exit::solve);
  REQUIRE(error.text.find("computed outside is not finite") != std::string::npos);
  REQUIRE((found.load_factor == 0.5 && found.steps == 2 && found.rejected == 1));
  REQUIRE(found.frame.table("position")->value[2] == Approx(2 + 2 * 0.5 * 4 / 100).epsilon(1e-12));
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
