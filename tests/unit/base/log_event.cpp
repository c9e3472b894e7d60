// Scopes are counted and timed as -log_view shows them.
#include <petsclog.h>

#include <catch2/catch.hpp>

#include "base/log_event.hpp"

namespace {

PetscErrorCode leave_with_an_error() {
  const bs::LoggedTime logged(bs::LogEvent::guess);
  return PETSC_ERR_USER;
}

PetscEventPerfInfo seen(const char* name) {
  PetscLogEvent event = -1;
  PetscEventPerfInfo info;
  PetscLogEventGetId(name, &event);
  REQUIRE(event >= 0);
  PetscLogEventGetPerfInfo(0, event, &info);
  return info;
}

}  // namespace

TEST_CASE("a scope is one call of its event, also where it is left with an error", "[log]") {
  PetscLogDefaultBegin();
  (void)bs::number_of(bs::LogEvent::guess);
  const PetscEventPerfInfo before = seen("BSGuess");
  {
    const bs::LoggedTime logged(bs::LogEvent::guess);
    CHECK(seen("BSGuess").depth == before.depth + 1);
  }
  CHECK(leave_with_an_error() == PETSC_ERR_USER);
  CHECK(seen("BSGuess").depth == before.depth);
  CHECK(seen("BSGuess").count == before.count + 2);
}

TEST_CASE("the first and the last event bear their own names", "[log]") {
  PetscLogEvent event = -1;
  (void)bs::number_of(bs::LogEvent::forces);
  PetscLogEventGetId("BSForces", &event);
  CHECK(event == bs::number_of(bs::LogEvent::forces));
  PetscLogEventGetId("BSWrite", &event);
  CHECK(event == bs::number_of(bs::LogEvent::write));
}
