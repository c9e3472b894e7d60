// The loops behind PairForces, for one dimension and one law of damping.
#pragma once
#include <algorithm>
#include "physics/pair/springs/registry.hpp"
#include "systems/particles/link_kernel.hpp"
#include "systems/particles/physics.hpp"
#include "systems/particles/plain_links.hpp"

namespace bs {

template <int d, class Damper>
class PairForcesOf final : public PairForces {
 public:
  template <class Spring>
  using Kernel = LinkKernel<d, Spring, Damper>;
  PairForcesOf(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern)
      : net_(net), laws_(laws), motion_(motion), pattern_(pattern) {
    const PetscInt count = static_cast<PetscInt>(net.anchors.particle.size());
    anchor_start_.assign(static_cast<std::size_t>(net.n) + 1, 0);
    anchor_order_.resize(static_cast<std::size_t>(count));
    for (PetscInt i : net.anchors.particle) ++anchor_start_[i + 1];
    for (PetscInt i = 0; i < net.n; ++i) anchor_start_[i + 1] += anchor_start_[i];
    std::vector<PetscInt> at(anchor_start_.begin(), anchor_start_.end() - 1);
    for (PetscInt k = 0; k < count; ++k) anchor_order_[at[net.anchors.particle[k]]++] = k;
    anchor_law_ = net.mixed ? OF_EACH : static_cast<LinkLaw>(net.spring_law);
    PairForcesOf::choose_loops();
  }

  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override {
    sum ? forces_of<true>(part, t, state, f, fault, sum) : forces_of<false>(part, t, state, f, fault, nullptr);
  }

  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override {
    const AnchorShift shift(motion_, t);
    std::fill_n(f, which.size() * d, 0.0);
    for (std::size_t k = 0; k < which.size(); ++k) (void)force_on(which[k], t, state, shift, f + k * d);
  }

  void pull(double t, const LocalState& state, double* sum) const override {
    const AnchorShift shift(motion_, t);
    Singularity none;
    for (PetscInt i = 0; i < net_.n; ++i) add_anchors(i, state.at(i), shift, sum, &none);
  }

  PetscErrorCode jacobian(double t, const LocalState& state, const std::vector<Term*>& terms, double sigma, bool momentum,
                          RowWriter* writer) const override;

  void energies(double t, const LocalState& state, Energies* sum) const override;
  void strain_response(const LocalState& state, StrainResponse* sum) const override;
  void box_forces(const LocalState& state, BoxForces* sum) const override;
  void particle_stress(const LocalState& state, double* sum) const override;
  void supply(double t, const LocalState& state, Supply* sum) const override;
  void beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma, PotentialChange* sum) const override;
  std::string lacks_potential() const override;
  bool depends_on_place() const override;

  void outer_sizes(double t, const LocalState& state, double* size) const override {
    for (PetscInt i = 0; i < net_.n; ++i) {
      if (net_.fixed[i]) continue;
      const Point<d> point = point_of(i, t, state);
      for_each_law(laws_, [&](const auto& law) {
        double f[d] = {};
        if (law.active() && law.template force<d>(point, f)) size[i] += norm<d>(f);
      });
    }
  }

  double anchor_tension(double t, const LocalState& state, PetscInt k) const override;
  void condense_springs(double t, const LocalState& state, const Coefficients& abc, bool positive, PairMatrix* S) const override {
    positive ? fill_springs<true>(t, state, abc, S) : fill_springs<false>(t, state, abc, S);
  }
  PetscErrorCode condense_rows(double t, const LocalState& state, const Coefficients& abc, bool positive, RowWriter* writer) const override {
    PetscFunctionBegin;
    PetscCall(positive ? fill_rows<true>(t, state, abc, writer) : fill_rows<false>(t, state, abc, writer));
    PetscFunctionReturn(0);
  }
  void multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const override;
  void multiply_law_damping(double t, const LocalState& state, const double* w, double* f) const override;

  void commit(const LocalState& state, double h, Links* links) const override;
  void predict_tensions(const LocalState& state, const LocalState& z, double part, double* tension) const override;
  double largest_turn(const LocalState& state, const LocalState& z) const override;

  LinkMeasures measure(const LocalState& state, PetscInt i, PetscInt e) const override;
  void measure(const LocalState& state, std::size_t count, const PetscInt* i, const PetscInt* e, double* length, double* tension) const override;
  void pull_change(const LocalState& state, PetscInt i, PetscInt e, int of, double* pull) const override;
  void damping_sizes(double t, const LocalState& state, double sigma, double* size) const override;
  void add_rates(std::vector<double>* rates) const override;
  void stiffness_sizes(double t, const LocalState& state, double* size) const override;

 private:
  using AnchorShift = bs::AnchorShift<d>;
  /// Owned particle i as its laws see it.
  Point<d> point_of(PetscInt i, double t, const LocalState& state) const {
    const double* y = state.at(i);
    return {t, net_.mass[i], net_.columns(i), y, y + d};
  }

  /// The laws with loops of their own; of links of any other law, or of several, that of each is looked up (MixedSpring).
  enum LinkLaw : std::uint8_t { HOOKE = static_cast<int>(SpringLaw::hooke), STRAIN = static_cast<int>(SpringLaw::strain), OF_EACH };

  template <class F>
  static auto with_law(LinkLaw law, F&& f) {
    if (law == HOOKE) return f(HookeSpring{});
    if (law == STRAIN) return f(StrainSpring{});
    return f(MixedSpring{});
  }

  /// The law that all springs of particle i obey.
  LinkLaw law_of_links(PetscInt i) const {
    const Links& links = net_.links;
    if (!net_.mixed) return anchor_law_;
    int law = -1;
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      if (links.spring[e] < 0) continue;
      if (law >= 0 && law != links.law[e]) return OF_EACH;
      law = links.law[e];
    }
    return law >= 0 && law < OF_EACH ? static_cast<LinkLaw>(law) : OF_EACH;
  }

  void choose_loops() override {
    for (auto& rows : rows_) rows.clear();
    law_.clear();
    plain_.clear();
    for (PetscInt i = 0; i < net_.n; ++i) lay_row(i);
  }

  void lay_row(PetscInt i) {
    const Links& links = net_.links;
    rows_[static_cast<int>(net_.boundary(i) ? Part::boundary : Part::interior)].push_back(i);
    law_.push_back(law_of_links(i));
    bool plain = law_.back() != OF_EACH;
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e)
      plain = plain && links.spring[e] >= 0 && links.rest_length[e] != 0 && (links.damping.empty() || links.damping[e] == 0);
    plain_.push_back(plain);
  }

  /// t: the time of evaluation.
  template <class Spring, class Table>
  static typename Kernel<Spring>::Parameters parameters(const Table& table, PetscInt e, double t) {
    const LinkParameters p{table.stiffness[e], table.rest_length[e], table.damping.empty() ? 0.0 : table.damping[e]};
    if constexpr (Spring::mixed) return {p, {table.law[e], table.more.data() + static_cast<std::size_t>(e) * table.width, table.elapsed(t)}};
    else return p;
  }

  /// The springs of particle i, of the law `Spring`: f += their force; with_energy: half their energy is added to sum where they are plain.
  template <class Spring, bool with_energy>
  void add_springs(PetscInt i, const double* y, const LocalState& state, double* f, Singularity* found, Energies* sum) const {
    double energy = 0;
    bool done = false;
    if constexpr (!Spring::mixed) done = plain_[i] && add_plain_links<d, Spring, with_energy>(net_.links, i, y, state.at(0), f, &energy);
    if (with_energy) sum->elastic += 0.5 * energy;
    if (!done) add_links<Spring>(i, y, state, f, found);
  }

  /// Adds the force on owned particle i to fi[d], whatever holds it; with_energy as in add_springs.
  template <bool with_energy = false>
  Singularity force_on(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, double* fi, Energies* sum = nullptr) const {
    const double* y = state.at(i);
    Singularity found;
    with_law(law_[i], [&](auto law) { add_springs<decltype(law), with_energy>(i, y, state, fi, &found, sum); });
    add_anchors(i, y, shift, fi, &found);
    const Point<d> point = point_of(i, t, state);
    for_each_law(laws_, [&](const auto& law) {
      if (law.active() && !law.template force<d>(point, fi)) found = {Singularity::particle, net_.row[i], law.title};
    });
    return found;
  }

  // The compiler leaves the laws' functions out of the innermost loops where several loops call them: `flatten` takes them in.
  template <class Spring>
  [[gnu::flatten]] void add_links(PetscInt i, const double* y, const LocalState& state, double* f, Singularity* found) const {
    const Links& links = net_.links;
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      if (links.spring[e] < 0) continue;
      const LinkGeometry<d> g(y, state.at(links.other[e]));
      const auto p = parameters<Spring>(links, e, state.time());
      if (Kernel<Spring>::defined(g, p)) Kernel<Spring>::force(g, p, f);
      else if (std::isnan(g.length)) *found = {Singularity::state, net_.row[i], ""};
      else if (!net_.rest_at_zero_length && Kernel<Spring>::acts(p)) *found = {Singularity::spring, links.spring[e], ""};
    }
  }

  /// use(kernel, e, g, p) for every spring e of particle i but those that have no direction.
  template <class Use>
  void for_links(PetscInt i, const LocalState& state, Use&& use) const {
    const Links& links = net_.links;
    with_law(law_[i], [&](auto law) {
      using Link = Kernel<decltype(law)>;
      for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
        if (links.spring[e] < 0) continue;
        const LinkGeometry<d> g(state.at(i), state.at(links.other[e]));
        const auto p = parameters<decltype(law)>(links, e, state.time());
        if (Link::defined(g, p)) use(Link{}, e, g, p);
      }
    });
  }

  /// use(kernel, k, g, p) for every anchor k of particle i at x = y.
  template <class Use>
  void for_anchors(PetscInt i, const double* y, const AnchorShift& shift, Use&& use) const {
    if (anchor_start_[i] == anchor_start_[i + 1]) return;
    with_law(anchor_law_, [&](auto law) {
      for (PetscInt a = anchor_start_[i]; a < anchor_start_[i + 1]; ++a) {
        const PetscInt k = anchor_order_[a];
        const AnchorEnd<d> end(shift, net_.anchors, k);
        use(Kernel<decltype(law)>{}, k, LinkGeometry<d>(y, end.y), parameters<decltype(law)>(net_.anchors, k, 0));
      }
    });
  }

  void add_anchors(PetscInt i, const double* y, const AnchorShift& shift, double* f, Singularity* found) const {
    for_anchors(i, y, shift, [&](auto kernel, PetscInt k, const LinkGeometry<d>& g, const auto& p) {
      if (kernel.defined(g, p)) kernel.force(g, p, f);
      else if (std::isnan(g.length)) *found = {Singularity::state, net_.row[i], ""};
      else *found = {Singularity::anchor, net_.anchors.row[k], ""};
    });
  }

  // K += df_i/dx_i, D += df_i/dv_i of anchors and particle laws. `positive`: without what may make -K indefinite.
  template <bool positive>
  void add_node_tangent(PetscInt i, const Point<d>& point, const AnchorShift& shift, double* K, double* D) const {
    for_anchors(i, point.x, shift, [&](auto kernel, PetscInt, const LinkGeometry<d>& g, const auto& p) {
      if (kernel.defined(g, p)) kernel.template tangent<positive>(g, p, K, D);
    });
    for_each_law(laws_, [&](const auto& law) {
      if (!law.active()) return;
      if constexpr (!positive) law.template dfdx<d>(point, K);
      law.template dfdv<d>(point, D);
    });
  }

  template <bool with_energy>
  void forces_of(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const;
  [[gnu::flatten]] void add_link_energies(PetscInt i, const LocalState& state, Energies* sum) const;
  void add_body_energies(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, Energies* sum) const;
  template <class Use>
  void for_springs(const LocalState& state, Use&& use) const;
  [[gnu::flatten]] void add_tangents(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, double* panel, PetscInt width) const;
  template <class Law>
  static void add_supply(const Law& law, const Point<d>& point, Supply* sum);
  template <class Law>
  static void add_law(const Law& law, const Point<d>& point, const double* dx, const double* dv, double sigma, PotentialChange* sum);
  [[gnu::flatten]] void add_products(PetscInt i, const LocalState& state, const LocalState& z, double* f) const;
  /// The pair of S, and that of a cut spring, that was filled last.
  struct PairPlaces {
    PetscInt pair = -1, cut = -1;
  };
  template <class Spring, bool positive>
  [[gnu::flatten]] void fill_pairs(PetscInt i, const LocalState& state, const Coefficients& abc, double* node, PairPlaces* at, PairMatrix* S) const;
  template <bool positive>
  void fill_springs(double t, const LocalState& state, const Coefficients& abc, PairMatrix* S) const;
  template <bool positive>
  PetscErrorCode fill_rows(double t, const LocalState& state, const Coefficients& abc, RowWriter* writer) const;
  template <bool positive>
  void node_block(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, const Coefficients& abc, double* A) const;

  const Network& net_;
  const ParticleLaws& laws_;
  const Motion& motion_;
  const RowPattern& pattern_;
  std::vector<PetscInt> anchor_start_, anchor_order_;
  std::vector<PetscInt> rows_[2];  ///< owned particles of either Part, ascending
  LinkLaw anchor_law_ = OF_EACH;
  std::vector<LinkLaw> law_;         ///< (n) of all springs of a particle
  std::vector<std::uint8_t> plain_;  ///< (n) particles on springs of such a law alone, without dampers or zero rest lengths
};

template <int d>
std::unique_ptr<PairForces> create_pair_forces_of(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern) {
  if (net.damping_law == DampingLaw::simple) return std::make_unique<PairForcesOf<d, SimpleDamper>>(net, laws, motion, pattern);
  return std::make_unique<PairForcesOf<d, AxialDamper>>(net, laws, motion, pattern);
}

}  // namespace bs

#include "systems/particles/physics_condensed.hpp"
#include "systems/particles/physics_forces.hpp"
#include "systems/particles/physics_links.hpp"
#include "systems/particles/physics_potential.hpp"
