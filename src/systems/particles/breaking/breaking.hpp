// What breaks: which parts of all terms are past their limits at an accepted state, what they leave, and the list of them.
#pragma once
#include <vector>
#include "systems/particles/breaking/breakable.hpp"
#include "systems/system.hpp"

namespace bs {

inline constexpr double BREAK_TIE = 1e-9;  ///< excesses that differ by less are equal, so that rounding does not decide what breaks

class Breaking final : public Breaks {
 public:
  /// `worst`: one part at a time, that of the largest excess; else every one past its limit. `with_springs`: parts may follow springs that break.
  void create(MPI_Comm comm, bool worst, bool with_springs);
  /// One more kind that may break; it must outlive the object.
  void add(Breakable& kind) {
    kinds_.push_back(&kind);
    sums_.of.push_back(0);
  }
  bool active() const { return !kinds_.empty(); }
  /// Counts the times at which parts broke or became whole again.
  std::uint64_t changes() const { return changes_; }

  /// Collective, at an accepted state. Breaks what is past its limit; `load`: the factor of loads, `loads`: whether time is one.
  PetscErrorCode break_parts(double t, double load, bool loads, const LocalState& state);
  std::int64_t broke() const override { return broke_; }
  bool any() const override;
  void mark() override;
  void revert() override;
  void add_motion(double seconds) override {
    sums_.motion += seconds;
    ++sums_.motion_steps;
  }
  double motion() const override { return sums_.motion; }
  std::int64_t motion_steps() const override { return sums_.motion_steps; }
  /// /events/broken/time, load, spring, ends, strain, energy, avalanche, and /events/broken_angles/... with number, angle, change; on rank 0.
  PetscErrorCode tables(std::vector<Dataset>* out) const override;
  /// What parts had lost before they broke [J].
  double dissipated() const { return sums_.dissipated; }

  /// Collective. A flag for each part, by kinds.
  PetscErrorCode fields(std::vector<Field>* out);
  void observe(std::vector<Observable>* out) const;
  std::vector<Tally> tallies() const;
  /// Collective. What a checkpoint holds of it, and back.
  PetscErrorCode gather(std::vector<StatePart>* parts);
  PetscErrorCode recall();
  void keep(const Keeper& keep);

 private:
  struct Sums {
    std::int64_t broken = 0, avalanches = 0, size = 0, largest = 0;  ///< size: of the present avalanche
    double energy = 0, dissipated = 0;                               ///< [J]
    double motion = 0;                                               ///< [s]
    double last = -1;                                                ///< time of the last break
    std::int64_t motion_steps = 0;
    std::int64_t running = 0;      ///< 1: the last call of break_parts() broke something
    std::vector<std::int64_t> of;  ///< how many broke of each kind
  };
  PetscErrorCode keep_worst(std::vector<PastLimit>* found) const;
  PetscErrorCode share(std::vector<PastLimit>* found) const;
  PetscErrorCode add_followers(const LocalState& state, std::vector<PastLimit>* found) const;
  void book(double t, double load, PastLimit* one);
  PetscErrorCode gather_kind(std::size_t kind, std::vector<StatePart>* parts);
  PetscErrorCode recall_kind(std::size_t kind);

  MPI_Comm comm_ = MPI_COMM_NULL;
  int rank_ = 0;
  bool worst_ = false, with_springs_ = false;
  std::vector<Breakable*> kinds_;
  std::vector<Broken> list_;  ///< on rank 0
  Sums sums_;
  std::size_t marked_list_ = 0;
  std::int64_t broke_ = 0;
  std::uint64_t changes_ = 0;
  std::vector<std::vector<VecHandle>> kept_;  ///< per kind: the list by rows, for checkpoints
};

}  // namespace bs
