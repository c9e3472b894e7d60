#include "time/tolerance_watch.hpp"
#include <algorithm>
#include "base/text.hpp"
#include "time/methods.hpp"

namespace bs {

namespace {

constexpr double FEW = 10;         // tolerances: errors of each step may be a tenth of the whole motion
constexpr double NOTHING = 1e-12;  // of the state: it rests, but for rounding

}  // namespace

PetscErrorCode ToleranceWatch::begin(TS ts) {
  Vec y;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(is_adaptive(ts, &adaptive));
  if (!adaptive) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecDuplicate(y, start_.out()));
  PetscCall(VecDuplicate(y, change_.out()));
  PetscCall(VecCopy(y, start_));
  PetscFunctionReturn(0);
}

PetscErrorCode ToleranceWatch::check(TS ts, Vec y) {
  PetscReal weighted, absolute, relative, change, size;
  PetscFunctionBegin;
  if (!start_ || in_tolerances_ >= FEW) PetscFunctionReturn(0);
  PetscCall(VecWAXPY(change_, -1, start_, y));
  PetscCall(VecNorm(change_, NORM_INFINITY, &change));
  PetscCall(VecNorm(y, NORM_INFINITY, &size));
  if (!(change > NOTHING * size)) PetscFunctionReturn(0);
  PetscCall(TSErrorWeightedNorm(ts, start_, y, NORM_INFINITY, &weighted, &absolute, &relative));
  in_tolerances_ = std::min<double>(FEW, std::max<double>(in_tolerances_, weighted));  // beyond that it does not matter where a run was continued
  largest_ = std::max<double>(largest_, change);
  PetscFunctionReturn(0);
}

PetscErrorCode ToleranceWatch::warn(TS ts, Warnings* warnings) const {
  PetscReal atol, rtol;
  PetscFunctionBegin;
  if (!start_ || largest_ == 0 || in_tolerances_ >= FEW) PetscFunctionReturn(0);
  PetscCall(TSGetTolerances(ts, &atol, nullptr, &rtol, nullptr));
  PetscCall(warnings->add("tolerance_loose", format("steps were adapted to errors (-ts_atol %g, -ts_rtol %g) beside which the motion is small, %.2g "
                                                    "of a tolerance at most: give about -ts_atol %.0e and a small -ts_rtol",
                                                    atol, rtol, in_tolerances_, 1e-4 * largest_)));
  PetscFunctionReturn(0);
}

}  // namespace bs
