// Parts of a system that break at accepted states: for time stepping, load steps and the trajectory.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <vector>
#include "systems/system.hpp"

namespace bs {

class Breaks {
 public:
  virtual ~Breaks() = default;
  /// How many parts the last System::accept() broke: forces are others than before. The same on every rank.
  virtual std::int64_t broke() const = 0;
  /// Whether any part is broken.
  virtual bool any() const = 0;
  /// Before a step is accepted that may be taken back.
  virtual void mark() = 0;
  /// Parts that broke since mark() are whole again, with their histories of then; sums are given back by System::restore_sums().
  virtual void revert() = 0;
  /// Books a step of motion at constant load [s]; `motion`, `motion_steps`: all of them.
  virtual void add_motion(double seconds) = 0;
  virtual double motion() const = 0;
  virtual std::int64_t motion_steps() const = 0;
  /// Collective. The list of what broke, for the end of a trajectory.
  virtual PetscErrorCode tables(std::vector<Dataset>* out) const = 0;
};

}  // namespace bs
