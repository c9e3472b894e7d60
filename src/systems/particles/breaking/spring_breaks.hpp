// Springs that break: limits of those this rank judges, and what is done to the links of one that breaks.
#pragma once
#include <vector>
#include "systems/particles/breaking/breakable.hpp"
#include "systems/particles/breaking/rules.hpp"
#include "systems/particles/spring_table.hpp"

namespace bs {

class PairForces;
struct LinkMeasures;

/// A broken spring stays among the links with all its numbers 0. It is judged by the rank that owns the end with the lower global index, and cut at
/// both its ends.
class SpringBreaks final : public Breakable {
 public:
  /// Collective. `net` and `pairs` must outlive the object, and the lattice's chunk is still there. Springs that the lattice calls broken are cut.
  /// Ends the run with exit code 2 where a spring of rest length 0 has a critical strain.
  PetscErrorCode create(Network& net, const Lattice& lattice, const BreakRules& rules, const PairForces& pairs);
  const BreakWords& words() const override;
  bool leads() const override { return true; }
  bool given_broken() const override { return given_broken_; }
  void judge(const LocalState& state, std::vector<PastLimit>* found) const override;
  void cut(std::int64_t row) override;
  void mark() override;
  void revert() override;
  void mend() override { mend_from(0); }
  PetscErrorCode flags(Vec* out) override;

 private:
  /// A spring this rank judges.
  struct Judged {
    PetscInt particle, link;
  };
  struct Cut {
    PetscInt link;
    double stiffness, damping;
    std::vector<double> parameters;  ///< of its law
  };
  PetscErrorCode give_limits(const Lattice& lattice);
  PetscErrorCode cut_notch();
  double limit(std::size_t k, int which) const;
  double excess_of(std::size_t k, const LinkMeasures& m) const;
  void cut_link(PetscInt link);
  void mend_from(std::size_t cut);

  Network* net_ = nullptr;
  const PairForces* pairs_ = nullptr;
  BreakRules rules_;
  bool given_broken_ = false;
  SpringTable table_;
  std::vector<Judged> judged_;
  std::vector<double> factor_;                ///< of each judged spring; empty: 1
  std::vector<double> column_[BREAK_LIMITS];  ///< of each judged spring; empty: rules_.limit
  std::vector<std::int64_t> end_row_;         ///< row of every local particle
  std::vector<std::pair<std::int64_t, PetscInt>> links_by_row_;
  std::vector<Cut> cuts_;            ///< of links that were whole at the start
  std::size_t marked_ = 0;           ///< cuts at mark()
  std::vector<double> marked_more_;  ///< Links::more at mark(): parameters and histories, also of springs that stay whole
  VecHandle flags_;
};

/// For the trajectory: where limits scatter, those that each part has.
void put_thresholds(const BreakRules& rules, const Lattice& lattice, std::vector<Dataset>* out);

}  // namespace bs
