// Detection of motions that are smaller than the errors which error-controlled steps may make.
#pragma once
#include <petscts.h>
#include "base/error.hpp"
#include "base/handle.hpp"

namespace bs {

/// The largest change of the state since the start, in units of the tolerance atol + rtol |y|. Where it is small every step is good enough, however
/// long it is: the defaults, 1e-4 of the unit and of the number, suit motions of metres and seconds, not those of micrometres.
class ToleranceWatch {
 public:
  /// Collective. From the state of `ts`; nothing is watched where steps follow no error estimate.
  PetscErrorCode begin(TS ts);
  /// Collective. At a state that is worth looking at.
  PetscErrorCode check(TS ts, Vec y);
  /// Collective. At the end.
  PetscErrorCode warn(TS ts, Warnings* warnings) const;
  /// What a checkpoint holds of it, and back, where it holds that.
  void save(Facts* facts) const { facts->real["change_in_tolerances"] = in_tolerances_; }
  void restore(const Facts& facts) { in_tolerances_ = facts.real_of("change_in_tolerances", in_tolerances_); }

 private:
  VecHandle start_, change_;
  double in_tolerances_ = 0;  ///< the largest so far
  double largest_ = 0;        ///< change [m, m/s or the unit of the states]
};

}  // namespace bs
