#include "base/log_event.hpp"
#include <petsclog.h>
#include <array>

namespace bs {

PetscLogEvent number_of(LogEvent event) {
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

LoggedTime::LoggedTime(LogEvent event, void* object) : event_(number_of(event)), object_(object) {
  (void)PetscLogEventBegin(event_, object_, nullptr, nullptr, nullptr);
}

LoggedTime::~LoggedTime() { (void)PetscLogEventEnd(event_, object_, nullptr, nullptr, nullptr); }

}  // namespace bs
