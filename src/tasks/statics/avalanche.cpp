#include "tasks/statics/avalanche.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"

namespace bs {

/// A long avalanche does not keep a run from being stopped.
PetscErrorCode Avalanche::check_for_signal() {
  PetscFunctionBegin;
  PetscCall(on_some_rank(model_.comm(), ending_signal(model_.comm()) != 0, &interrupted_));
  PetscFunctionReturn(0);
}

PetscErrorCode Avalanche::relax(double factor, Vec y, bool* good) {
  HeldEnergies had, has, after;
  PetscFunctionBegin;
  PetscCall(model_.energies(factor, y, &had));
  PetscCall(solver_.relax(y, good));
  if (!*good) PetscFunctionReturn(0);
  PetscCall(model_.energies(factor, y, &has));
  PetscCall(model_.accept({factor}, y));
  PetscCall(model_.energies(factor, y, &after));
  has.dissipated = after.dissipated;  // known once histories are brought up to y; what is stored then may have broken
  model_.release(had.sum() - has.sum());
  PetscFunctionReturn(0);
}

/// One step; y stays where Newton's method fails. `now`: of y, before and after it.
PetscErrorCode Avalanche::move(double factor, double h, Vec y, HeldEnergies* now, bool* good) {
  const HeldEnergies had = *now;
  HeldEnergies after;
  PetscFunctionBegin;
  PetscCall(model_.set_motion(h, y));
  PetscCall(solver_.advance(h, y, good));
  if (!*good) PetscFunctionReturn(0);
  PetscCall(model_.energies(factor, y, now));
  model_.breaks()->add_motion(h);
  PetscCall(model_.accept({factor}, y));
  PetscCall(model_.energies(factor, y, &after));
  now->dissipated = after.dissipated;
  model_.release(had.sum() - now->sum());
  *now = after;
  PetscFunctionReturn(0);
}

/// At first with steps that resolve the motion. Where nothing has broken for 100 over the root mean squared frequency they grow, so that backward
/// Euler's own damping brings to rest what still swings; a break makes them short again. Loose parts in free flight never come to rest: they are all
/// that moves where long steps no longer take kinetic energy. What is left at the end goes when the equilibrium is looked for.
PetscErrorCode Avalanche::follow(double factor, Vec y, const Frame& frame, std::int64_t* broken, bool* good) {
  constexpr double LEFT = 1e-3, GROWTH = 1.25, QUIET = 100, LONG = 10, LONGEST = 1e4, SAME = 0.99;
  constexpr int MOST_CUTS = 20, IN_TURN = 3;
  Breaks& breaks = *model_.breaks();
  const double period = 1 / std::sqrt(model_.mean_squared_frequency()), nominal = options_.step > 0 ? options_.step : period;
  double h = nominal, most = 0, last_break = breaks.motion(), next_frame = last_break + options_.interval;
  int cuts = 0, same = 0;
  HeldEnergies now;
  PetscFunctionBegin;
  PetscCall(zero_velocities(y));
  PetscCall(model_.energies(factor, y, &now));
  for (std::int64_t step = 0; step < options_.most && cuts <= MOST_CUTS; ++step) {
    if (options_.interval > 0 && breaks.motion() >= next_frame * (1 - 1e-12)) {
      moving_ = true;
      PetscCall(frame(y));
      moving_ = false;
      next_frame = breaks.motion() + options_.interval;
    }
    const double before = now.kinetic;
    PetscCall(move(factor, h, y, &now, good));
    PetscCall(check_for_signal());
    if (interrupted_) break;
    cuts = *good ? 0 : cuts + 1;
    if (!*good) {
      h /= 2;
      continue;
    }
    most = std::max(most, now.kinetic);
    *broken += breaks.broke();
    if (breaks.broke() > 0) last_break = breaks.motion();
    const bool quiet = breaks.motion() - last_break >= QUIET * period;
    same = quiet && h > LONG * period && now.kinetic >= SAME * before ? same + 1 : 0;
    if (quiet && (now.kinetic <= LEFT * most || same == IN_TURN || h > LONGEST * period)) break;
    h = quiet ? GROWTH * h : std::min(nominal, 2 * h);
  }
  model_.release(now.kinetic);
  PetscCall(model_.set_motion(0, y));
  PetscFunctionReturn(0);
}

PetscErrorCode Avalanche::follow_to_rest(double factor, Vec y, const Frame& frame, bool* found, std::string* failure) {
  Breaks& breaks = *model_.breaks();
  std::int64_t broken = 0;
  PetscFunctionBegin;
  *found = false;
  while (breaks.broke() > 0) {
    bool good = true;
    PetscCall(check_for_signal());
    if (interrupted_) PetscFunctionReturn(0);
    broken += breaks.broke();
    if (options_.dynamics) PetscCall(follow(factor, y, frame, &broken, &good));
    if (interrupted_) PetscFunctionReturn(0);
    PetscCall(relax(factor, y, &good));
    if (good) continue;
    std::vector<Dataset> lists;
    PetscCall(breaks.tables(&lists));
    const bool springs = std::all_of(lists.begin(), lists.end(), [](const Dataset& one) { return one.path.rfind("/events/broken/", 0) == 0; });
    *failure = format(
        "at load factor %.10g no equilibrium was found after %s had broken: compute the motion (-bs_task dynamics), or remove loads "
        "that act on loose parts",
        factor, how_many(broken, springs ? "spring" : "part").c_str());
    PetscFunctionReturn(0);
  }
  *found = true;
  PetscCall(zero_velocities(y));  // they led to the state before the break
  PetscFunctionReturn(0);
}

}  // namespace bs
