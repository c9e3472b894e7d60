// Sessions: how many steps a motion may take, looks at its state, and forces that hold an equilibrium.
#include <catch2/catch.hpp>

#include "base/collective.hpp"
#include "session/session.hpp"
#include "session_tools.hpp"

using namespace bs;

namespace {

using Numbers = std::vector<double>;

const Settings CHAIN = {
    {"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "7"}, {"-bs_lattice_velocity", "1"}, {"-ts_type", "cn"}, {"-ts_dt", "0.02"}};

/// The numbers that a view shows, row by row.
Numbers shown(const Session::View& view, int dim) {
  Numbers all;
  for (std::int64_t row = 0; row < view.rows; ++row)
    for (int c = 0; c < dim; ++c) all.push_back(view.first[row * view.stride + c]);
  return all;
}

}  // namespace

TEST_CASE("a number of steps (-ts_max_steps) counts the steps before a state is set, too, and ends the frames with one warning") {
  const auto session = session_of(with(CHAIN, {{"-bs_output_interval", "0.06"}, {"-ts_max_time", "1"}, {"-ts_max_steps", "7"}}));
  std::vector<std::int64_t> steps;
  Numbers rows;
  bool more = true;
  for (good(session->run_to_frame(&more)); more; good(session->run_to_frame(&more))) {
    steps.push_back(session->steps());
    good(session->get_rows(Session::Array::velocity, &rows));
    good(session->set_rows(Session::Array::velocity, rows));
  }
  REQUIRE(steps == std::vector<std::int64_t>{3, 6, 7});
  good(session->run_to_frame(&more));
  REQUIRE_FALSE(more);
  good(session->finish());
  const std::vector<std::string> said = session->warnings();
  const bool first = rank_of(MPI_COMM_WORLD) == 0;
  REQUIRE(said.size() == (first ? 1 : 0));
  if (first) REQUIRE(said[0] == "the run ended after the 7 steps of -ts_max_steps, at t = 0.14 of 1: give more of them");
}

TEST_CASE("a view is the state where it is, follows it, and outlives the session; refused where rows have another order") {
  auto session = session_of(with(CHAIN, {{"-bs_ordering", "rows"}, {"-bs_lattice_dim", "2"}}));
  Session::View x, v;
  const Error error = session->view(Session::Array::position, &x);
  if (size_of(MPI_COMM_WORLD) > 1) {
    REQUIRE(error.text.find("several ranks") != std::string::npos);
    return;
  }
  good(error);
  good(session->view(Session::Array::velocity, &v));
  Numbers rows;
  for (int k = 0; k < 3; ++k) {
    good(session->step(2));
    REQUIRE(shown(x, 2) == array_of(*session, Session::Array::position));
    REQUIRE(shown(v, 2) == array_of(*session, Session::Array::velocity));
    good(session->get_rows(Session::Array::velocity, &rows));
    for (double& one : rows) one *= 0.5;
    good(session->set_rows(Session::Array::velocity, rows));
    REQUIRE(shown(v, 2) == rows);
  }
  const Numbers last = shown(x, 2);
  session.reset();
  REQUIRE(shown(x, 2) == last);
  REQUIRE(session_of(CHAIN)->view(Session::Array::position, &x).text.find("-bs_ordering rows") != std::string::npos);
  REQUIRE(session_of(with(CHAIN, {{"-bs_ordering", "rows"}}))->view(Session::Array::force, &x).text.find("forces") != std::string::npos);
}

TEST_CASE("an equilibrium tells the force on everything that is held, in a group or not") {
  const auto session = session_of(with(CHAIN, {{"-bs_lattice_fixed", "xmin"}, {"-bs_gravity", "2"}}));
  Result found;
  good(session->solve_statics(&found));
  Numbers expected(7, 0.0);
  expected[0] = -7 * 2.0;  // the weight of all along the chain
  REQUIRE(found.frame.reaction.size() == expected.size());
  for (std::size_t row = 0; row < expected.size(); ++row) REQUIRE(found.frame.reaction[row] == Approx(expected[row]).margin(1e-9));
}
