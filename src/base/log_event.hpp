// What -log_view shows of the program's own: a name and the time spent in scopes.
#pragma once
#include <petsclog.h>
#include <array>
#include <cstddef>

namespace bs {

/// In the order of the names in number_of().
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
inline PetscLogEvent number_of(LogEvent event) {
  constexpr std::size_t COUNT = static_cast<std::size_t>(LogEvent::count);
  static const std::array<PetscLogEvent, COUNT> numbers = [] {
    constexpr std::array<const char*, COUNT> NAMES{"BSForces",    "BSJacobian", "BSEnergies", "BSCondense",  "BSTangentMult",
                                                   "BSPotential", "BSProduct",  "BSFactor",   "BSTriangles", "BSCoarseSetUp",
                                                   "BSCoarse",    "BSGuess",    "BSWrite"};
    std::array<PetscLogEvent, COUNT> made{};
    PetscClassId id = 0;
    (void)PetscClassIdRegister("backspring", &id);
    for (std::size_t k = 0; k < COUNT; ++k) (void)PetscLogEventRegister(NAMES[k], id, &made[k]);
    return made;
  }();
  return numbers[static_cast<std::size_t>(event)];
}

/// Counts as the event from here to the end of the scope, also where that is left with an error.
class LoggedTime {
 public:
  /// `object`: any of PETSc's, whose ranks -log_sync waits for
  explicit LoggedTime(LogEvent event, void* object = nullptr) : event_(number_of(event)), object_(object) {
    (void)PetscLogEventBegin(event_, object_, nullptr, nullptr, nullptr);
  }
  LoggedTime(const LoggedTime&) = delete;
  LoggedTime& operator=(const LoggedTime&) = delete;
  ~LoggedTime() { (void)PetscLogEventEnd(event_, object_, nullptr, nullptr, nullptr); }

 private:
  PetscLogEvent event_;
  void* object_;
};

}  // namespace bs
