// What Newton and its line search remember: energies of past iterates, the stage, the size of the first residual.
#include <catch2/catch.hpp>

#include "solvers/newton/convergence.hpp"

using namespace bs;

TEST_CASE("the search compares with the highest of the last eight energies") {
  PastEnergies past;
  REQUIRE(past.highest() == 0);  // Phi now
  past.moved(-5);                // Phi was 5 above what it is now
  REQUIRE(past.highest() == 5);
  past.moved(3);  // it went up again: the first iterate is 2 above
  REQUIRE(past.highest() == 2);
  past.moved(4);  // above all before it
  REQUIRE(past.highest() == 0);
  past.forget();
  REQUIRE(past.highest() == 0);
  past.moved(-1);
  REQUIRE(past.highest() == 1);
}

TEST_CASE("an energy is forgotten after eight more") {
  PastEnergies past;
  past.moved(-100);
  for (std::size_t k = 1; k < PastEnergies::MEMORY; ++k) {
    past.moved(0);
    REQUIRE(past.highest() == 100);
  }
  past.moved(0);
  REQUIRE(past.highest() == 0);
}

TEST_CASE("a Jacobian belongs to a stage by its time") {
  NewtonStage stage;
  REQUIRE_FALSE(stage.has_jacobian());  // there was none
  stage.residual_time = stage.time = 0.5;
  stage.sigma = 10;
  REQUIRE(stage.has_jacobian());
  stage.residual_time = 0.6;  // the residual is of the next stage
  REQUIRE_FALSE(stage.has_jacobian());
}

TEST_CASE("a kinematic residual counts by the velocity it stands for") {
  NewtonSolve solve;
  solve.inverse_h = 100;
  solve.first = {2, 30};
  REQUIRE(solve.size_of_forces() == 200);
  solve.first = {0.1, 30};
  REQUIRE(solve.size_of_forces() == 30);
}

TEST_CASE("a length that was rejected is worth the iterations of the shorter steps in its place") {
  PastLengths lengths;
  lengths.begin(0.1);
  REQUIRE_FALSE(lengths.exceeded(1000));  // nothing is known of shorter ones
  lengths.begin(0.025);                   // 0.1 has not converged
  REQUIRE(lengths.failed == 0.1);
  lengths.converged(10);
  lengths.begin(0.025);
  REQUIRE_FALSE(lengths.exceeded(1000));  // this length has not been rejected
  lengths.converged(8);
  lengths.begin(0.1);
  REQUIRE_FALSE(lengths.exceeded(31));
  REQUIRE(lengths.exceeded(32));  // four steps of eight
  lengths.begin(0.0125);          // neither 0.1 nor 0.025, of another place, ...
  lengths.begin(0.003125);        // ... nor 0.0125
  REQUIRE(lengths.failed == 0.0125);
  lengths.converged(1);
  lengths.begin(0.0125);
  REQUIRE_FALSE(lengths.exceeded(19));  // few are always allowed
  REQUIRE(lengths.exceeded(20));
  lengths.converged(15);
  REQUIRE(lengths.failed == 0);
  lengths.begin(0.1);
  REQUIRE_FALSE(lengths.exceeded(1000));
}

TEST_CASE("iterates are idle where neither part of the residual is halved nor the potential falls by a hundredth more") {
  NewtonSolve solve;
  solve.least = {1, 1};
  solve.follow({1, 0.9}, 0);
  solve.follow({2, 0.7}, 0);
  REQUIRE((solve.idle == 2 && solve.stalled == 2));
  solve.follow({2, 0.4}, 0);  // half of the least
  REQUIRE((solve.idle == 0 && solve.stalled == 0));
  solve.follow({2, 0.4}, 10);  // the potential fell
  REQUIRE((solve.idle == 0 && solve.stalled == 1));
  solve.follow({2, 0.4}, 10.05);
  solve.follow({2, 0.4}, 10.09);
  REQUIRE(solve.idle == 2);
  solve.follow({2, 0.4}, 10.2);  // counted from where progress was seen last, not from the iterate before
  REQUIRE(solve.idle == 0);
  solve.follow({2, 0.21}, 9);  // uphill, and not yet half of 0.4
  REQUIRE((solve.idle == 1 && solve.stalled == 5));
}

TEST_CASE("how far the potential has fallen adds up over moves, known or not") {
  PastEnergies past;
  past.moved(-5);
  past.moved(2);
  past.forget();
  past.moved(-1);
  REQUIRE(past.fall == 4);
}
