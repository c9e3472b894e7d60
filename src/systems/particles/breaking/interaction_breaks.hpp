// Angle springs, hinges and their like that break: limits of those this rank judges, and which are broken.
#pragma once
#include <functional>
#include <memory>
#include <vector>
#include "systems/particles/breaking/breakable.hpp"
#include "systems/particles/breaking/rules.hpp"

namespace bs {

/// One as it is: the change of its angle from that at rest, theta - theta_0 [rad], its moment dE/dtheta [N m] and its energy [J].
struct TurnMeasures {
  double change, moment, energy;
};

/// A broken one keeps its row in the network's table, and its loops pass it by. It is judged by the rank that owns its first end, and passed by on
/// every rank that has one of its ends.
class InteractionBreaks final : public Breakable {
 public:
  using Measure = std::function<TurnMeasures(const LocalState&, std::size_t)>;
  /// Collective. Of the network's table of that kind; null where none of it may break. `net`, and what `measure` (of a place in the table) refers to,
  /// must outlive the result, and the lattice's chunk is still there; springs that are broken from the start are cut already.
  static PetscErrorCode create(Network& net, const Lattice& lattice, const BreakRules& rules, std::size_t kind, Measure measure,
                               std::unique_ptr<InteractionBreaks>* out);
  const BreakWords& words() const override { return words_; }
  bool given_broken() const override { return given_broken_; }
  void judge(const LocalState& state, std::vector<PastLimit>* found) const override;
  PetscErrorCode follow(const std::vector<std::int64_t>& springs, const LocalState& state, std::vector<PastLimit>* found) const override;
  void cut(std::int64_t row) override;
  void mark() override { marked_ = cuts_.size(); }
  void revert() override { mend_from(marked_); }
  void mend() override { mend_from(0); }
  PetscErrorCode flags(Vec* out) override;

 private:
  PetscErrorCode give_limits(const Lattice& lattice, const BreakRules& rules, std::size_t kind);
  PetscErrorCode cut_given(const Lattice& lattice, const BreakRules& rules, std::size_t kind);
  void mend_from(std::size_t cut);
  void find_sides(const InteractionSchema& schema);
  PetscErrorCode rows_along(const std::vector<std::int64_t>& springs, std::vector<std::int64_t>* rows) const;
  PastLimit past(std::size_t k, double excess, const TurnMeasures& m) const;
  const PetscInt* ends(std::size_t k) const { return table_->end.data() + k * static_cast<std::size_t>(words_.ends); }

  Network* net_ = nullptr;
  InteractionTable* table_ = nullptr;
  Measure measure_;
  BreakWords words_;
  Rows rows_;
  bool given_broken_ = false;
  std::vector<std::uint8_t> spared_;                        ///< of each place in the table
  std::vector<std::size_t> judged_;                         ///< places, by rows
  std::vector<double> limit_[TURN_LIMITS];                  ///< of each judged one
  std::vector<std::int64_t> end_row_;                       ///< row of every local particle
  std::vector<std::pair<std::int64_t, std::size_t>> side_;  ///< rows of springs along sides, and the places they are sides of; empty: none matters
  std::vector<std::size_t> cuts_;                           ///< places that were whole at the start
  std::size_t marked_ = 0;                                  ///< cuts at mark()
  VecHandle flags_;
};

}  // namespace bs
