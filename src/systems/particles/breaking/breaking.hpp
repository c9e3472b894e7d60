// Springs that break: which are past their limits at an accepted state, what they leave, and the list of them.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>
#include "lattice/columns.hpp"
#include "lattice/lattice.hpp"
#include "systems/breaks.hpp"
#include "systems/particles/spring_table.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

/// Which springs break, and when: options and the lattice's limits.
struct BreakRules {
  enum Side { tension, compression, both };
  enum Scatter { none, weibull, uniform };
  /// The same for all springs whose lattice gives none; infinite: no limit.
  double limit[BREAK_LIMITS] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::infinity()};
  Side side = tension;
  bool worst = false;      ///< one spring at a time, that of the largest excess; else every one past its limit
  Scatter scatter = none;  ///< of the limits, by a factor for each spring
  double width = 0;        ///< Weibull modulus, or half width of the uniform distribution
  std::int64_t seed = 0;
  std::vector<std::string> spared;  ///< groups whose springs do not break
  bool notched = false;
  double notch[4] = {0, 0, 0, 0};  ///< from (x, y) to (x, y) [m]: springs that cross it at the start are broken

  /// Collective. Reads the -bs_break_ options. Errors (exit 2): values out of range; groups that the lattice has not.
  PetscErrorCode read(MPI_Comm comm, const Lattice& lattice);
  /// Whether some spring may break.
  bool active(const Lattice& lattice) const;
  /// Factor of the limits of the spring of that row:
  ///   Weibull (-ln(1 - U))^(1/M);  uniform 1 + W (2U - 1);  U uniform in [0, 1) by the row
  double factor(std::int64_t row) const;
  /// For the header; empty where nothing breaks.
  std::string describe(const Lattice& lattice) const;
};

/// Collective. Ends the run with exit code 2 where a limit of the lattice is no number > 0 or inf.
PetscErrorCode check_break_limits(MPI_Comm comm, const Lattice& lattice);

/// A spring that broke.
struct BrokenSpring {
  std::int64_t number = 0;  ///< among all that broke, from 0
  std::int64_t row = 0;     ///< in the input
  std::int64_t ends[2] = {0, 0};
  std::int64_t avalanche = 0;
  double time = 0, load = 0, strain = 0, energy = 0;  ///< when; what it was like
};

/// A broken spring stays among the links with all its numbers 0, so that patterns and loops are those of the whole lattice. A spring is judged
/// by the rank that owns the end with the lower global index, and every rank is told what broke: both its ends agree.
class Breaking final : public Breaks {
 public:
  /// Collective. Before the lattice is distributed.
  PetscErrorCode read(MPI_Comm comm, const Lattice& lattice);
  /// Collective. `net` must outlive the object, and the lattice's chunk is still there. Springs that the lattice calls broken are cut.
  /// Ends the run with exit code 2 where a spring of rest length 0 has a critical strain.
  PetscErrorCode create(Network& net, const Lattice& lattice);
  bool active() const { return active_; }
  std::string describe(const Lattice& lattice) const { return rules_.describe(lattice); }

  /// Collective, at an accepted state. Breaks what is past its limit; `load`: the factor of loads, `loads`: whether time is one.
  PetscErrorCode break_springs(double t, double load, bool loads, const LocalState& state, const Terms& terms);
  std::int64_t broke() const override { return broke_; }
  bool any() const override { return sums_.broken > 0 || given_broken_; }
  void mark() override;
  void revert() override;
  void add_motion(double seconds) override {
    sums_.motion += seconds;
    ++sums_.motion_steps;
  }
  double motion() const override { return sums_.motion; }
  std::int64_t motion_steps() const override { return sums_.motion_steps; }
  /// /events/broken/time, load, spring, ends, strain, energy, avalanche; on rank 0.
  PetscErrorCode tables(std::vector<Dataset>* out) const override;
  /// Plastic work of springs before they broke [J].
  double dissipated() const { return sums_.dissipated; }

  PetscErrorCode observe(std::vector<Observable>* out) const;
  std::vector<Tally> tallies() const;
  /// Collective. 1 for every broken spring, in the input's order; borrowed.
  PetscErrorCode flags(Vec* out);
  /// Collective. What a checkpoint holds of it, and back.
  PetscErrorCode gather(std::vector<StatePart>* parts);
  PetscErrorCode scatter();
  void save(std::map<std::string, double>* sums) const;
  void restore(const std::map<std::string, double>& sums);
  /// For the trajectory: where limits scatter, those that each spring has.
  void put_thresholds(const Lattice& lattice, std::vector<Dataset>* out) const;

 private:
  /// A spring this rank judges.
  struct Judged {
    PetscInt particle, link;
  };
  struct Found {
    double excess, dissipated;  ///< the latter before it broke [J]
    BrokenSpring spring;
  };
  struct Sums {
    std::int64_t broken = 0, avalanches = 0, size = 0, largest = 0;  ///< size: of the present avalanche
    double energy = 0, dissipated = 0;                               ///< [J]
    double motion = 0;                                               ///< [s]
    double last = -1;                                                ///< time of the last break
    std::int64_t motion_steps = 0;
    std::int64_t running = 0;  ///< 1: the last call of break_springs() broke something
  };
  struct Cut {
    PetscInt link;
    double stiffness, damping;
  };
  PetscErrorCode give_limits(const Lattice& lattice);
  PetscErrorCode cut_notch();
  double limit(std::size_t k, int which) const;
  double excess_of(std::size_t k, const LinkMeasures& m) const;
  void judge(double t, double load, const LocalState& state, const Terms& terms, std::vector<Found>* found) const;
  PetscErrorCode keep_worst(std::vector<Found>* found) const;
  PetscErrorCode share(std::vector<Found>* found) const;
  void cut(PetscInt link);
  void cut_row(std::int64_t row);

  Network* net_ = nullptr;
  BreakRules rules_;
  bool active_ = false, given_broken_ = false;  ///< the latter: the lattice had broken springs
  SpringTable table_;
  std::vector<Judged> judged_;
  std::vector<double> factor_;                ///< of each judged spring; empty: 1
  std::vector<double> column_[BREAK_LIMITS];  ///< of each judged spring; empty: rules_.limit
  std::vector<std::int64_t> end_row_;         ///< row of every local particle
  std::vector<std::pair<std::int64_t, PetscInt>> links_by_row_;
  std::vector<BrokenSpring> list_;  ///< on rank 0
  std::vector<Cut> cuts_;           ///< since mark()
  Sums sums_;
  std::size_t marked_list_ = 0;
  std::vector<double> marked_more_;  ///< Links::more at mark(): parameters and histories, also of springs that stay whole
  std::int64_t broke_ = 0;
  struct Kept {
    std::string name;
    VecHandle rows;
  };
  std::vector<Kept> kept_;  ///< the list by springs, for checkpoints
  VecHandle flags_;
};

}  // namespace bs
