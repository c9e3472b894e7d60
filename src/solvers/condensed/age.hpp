// When a preconditioner has aged, by the iterations its solves take.
#pragma once

namespace bs {

/// A part of it, the coarse grid, changes less from state to state than the factors do, and is made anew only where new factors alone do not
/// bring the iterations back.
class PreconditionerAge {
 public:
  /// The next one is new in all its parts.
  void discard() noexcept { due_ = coarse_due_ = true; }
  bool due() const noexcept { return due_; }
  /// A new one is made; whether it takes over the coarse grid of the last.
  bool renew() noexcept {
    kept_ = !coarse_due_;
    due_ = coarse_due_ = false;
    return kept_;
  }
  /// A solve took `rate` iterations per digit, with a preconditioner that was made for it (`fresh`) or before. Due is a new one where that is more
  /// than `most` times what it was with all parts new.
  void note(double rate, bool fresh, double most) noexcept {
    if (fresh && !kept_) new_rate_ = rate;
    if (rate <= most * new_rate_ + 1) return;
    due_ = true;
    coarse_due_ = coarse_due_ || fresh;
  }

 private:
  bool due_ = true, coarse_due_ = true;
  bool kept_ = false;  ///< the coarse grid is older than the factors
  double new_rate_ = 0;
};

}  // namespace bs
