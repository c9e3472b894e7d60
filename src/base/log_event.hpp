// What -log_view shows of the program's own: a name and the time spent in scopes.
#pragma once
#include <petscsys.h>

namespace bs {

/// In the order of the names in log_event.cpp.
enum class LogEvent {
  forces,
  jacobian,
  energies,
  condense,
  tangent_product,
  potential,
  product,
  factor,
  triangles,
  coarse_set_up,
  coarse,
  guess,
  write,
  count
};

/// PETSc's number of an event. All are registered at the first call, so that ranks agree on the numbers whatever each computes first.
PetscLogEvent number_of(LogEvent event);

/// Counts as the event from here to the end of the scope, also where that is left with an error.
class LoggedTime {
 public:
  /// `object`: any of PETSc's, whose ranks -log_sync waits for
  explicit LoggedTime(LogEvent event, void* object = nullptr);
  LoggedTime(const LoggedTime&) = delete;
  LoggedTime& operator=(const LoggedTime&) = delete;
  ~LoggedTime();

 private:
  PetscLogEvent event_;
  void* object_;
};

}  // namespace bs
