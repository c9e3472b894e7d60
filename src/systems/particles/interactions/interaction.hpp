// One kind of interaction in d dimensions: the loop over its elements, and what is made of it. Every use is a visitor of the
// elements; a law describes a single element only.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>
#include "lattice/lattice.hpp"
#include "linalg/sparse_blocks.hpp"
#include "systems/frame_rows.hpp"
#include "systems/particles/breaking/interaction_breaks.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// Whether a law says its angle and moment.
template <class Law, class = void>
struct turns : std::false_type {};
template <class Law>
struct turns<Law, std::void_t<decltype(Law::template change<3>(nullptr, nullptr, nullptr))>> : std::true_type {};

/// Whether a law says how its forces change with its parameters.
template <class Law, class = void>
struct says_force_change : std::false_type {};
template <class Law>
struct says_force_change<Law, std::void_t<decltype(Law::template force_change<3>(nullptr, nullptr, 0, nullptr))>> : std::true_type {};

/// Elements are visited by ascending row; each adds to the ends this rank owns, its other ends are ghosts, in a periodic box images of any particle.
template <class Law, int d>
class Interaction final : public Term {
 public:
  static constexpr int N = Law::ends;
  /// One element: where its ends are, local indices of them, its parameters.
  struct Element {
    const double* x[N];
    const PetscInt* end;
    const double* p;
    std::int64_t row;
    std::size_t place;  ///< in the table
  };

  Interaction(const Network& net, const InteractionTable& table)
      : net_(net), table_(table), kind_(static_cast<std::size_t>(&table - net.interactions.data())) {
    for (PetscInt i = 0; i < net.n; ++i) boundary_.push_back(net.boundary(i));
    for (std::size_t k = 0; k < table.row.size(); ++k)
      for (const bool cut : {false, true}) {
        const PetscInt* end = table.end.data() + k * N;
        if (std::any_of(end, end + N, [&](PetscInt i) { return i < net.n && (boundary_[i] != 0) == cut; })) part_[cut].push_back(k);
      }
    for (const PetscInt i : table.end) {
      const PetscInt global = net.global[i];
      unknown_.push_back(global >= net.first && global < net.first + net.n ? global - net.first : i);
    }
  }

  void forces(Part part, double, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override {
    const bool cut = part == Part::boundary;
    for (const std::size_t k : part_[cut]) {
      if (table_.is_broken(k)) continue;
      const Element e = element(k, [&](PetscInt i) { return state.at(i); });
      const char* why = Law::template fault<d>(e.x, e.p);
      double force[N * d];
      if (!why) Law::template force<d>(e.x, e.p, force);
      else std::fill_n(force, N * d, std::numeric_limits<double>::infinity());
      if (why && fault->kind == Singularity::none) *fault = describe(e, why);
      for (int a = 0; a < N; ++a)
        if (acts_on(e.end[a]) && (boundary_[e.end[a]] != 0) == cut)
          for (int c = 0; c < d; ++c) f[e.end[a] * d + c] += force[a * d + c];
    }
    if (sum && cut) energies(0, state, sum);
  }

  void forces_on(const std::vector<PetscInt>& which, double, const LocalState& state, double* f) const override {
    traverse_forces(state, [&](const Element& e, const double* force) {
      for (int a = 0; a < N; ++a) {
        const auto at = std::lower_bound(which.begin(), which.end(), e.end[a]);
        if (at == which.end() || *at != e.end[a]) continue;
        for (int c = 0; c < d; ++c) f[static_cast<std::size_t>(at - which.begin()) * d + c] += force[a * d + c];
      }
    });
  }

  /// Of owned ends, held ones too.
  void inner_sizes(const LocalState& state, double* size) const override {
    traverse_forces(state, [&](const Element& e, const double* force) {
      for (int a = 0; a < N; ++a) {
        double square = 0;
        for (int c = 0; c < d; ++c) square += force[a * d + c] * force[a * d + c];
        if (e.end[a] < net_.n) size[e.end[a]] += std::sqrt(square);
      }
    });
  }

  /// Where a law has no energy (an angle between arms of zero length), the force reports it.
  void energies(double, const LocalState& state, Energies* all) const override {
    double sum = 0;
    traverse(state, [&](const Element& e) {
      const double energy = Law::template energy<d>(e.x, e.p);
      if (std::isfinite(energy)) sum += share(e) * energy;
    });
    all->elastic += sum;
  }

  void beyond_slope(double, const LocalState& state, const LocalState& line, double lambda, double sigma, PotentialChange* change) const override {
    double sum = 0;
    traverse_regular(state, [&](const Element& e) {
      double step[N * d];
      const double* dx[N];
      for (int a = 0; a < N; ++a) {
        for (int c = 0; c < d; ++c) step[a * d + c] = lambda * line.at(e.end[a])[c];
        dx[a] = step + a * d;
      }
      sum += share(e) * Law::template energy_beyond_slope<d>(e.x, dx, e.p);
    });
    change->value += sigma * sum;
  }

  void multiply_tangent(double, const LocalState& state, const LocalState& z, double* f) const override {
    traverse_tangents<false>(state, [&](const Element& e, int a, int b, const double* K) {
      if (acts_on(e.end[a]))
        for (int r = 0; r < d; ++r)
          for (int c = 0; c < d; ++c) f[e.end[a] * d + r] += K[r * N * d + c] * z.at(e.end[b])[c];
    });
  }

  // With forces f_a on the ends at x_a, of sum zero, E changes by -f_a.(G x_a) where space is strained by G, by -f_a.e_k' s_a,k where an edge moves.
  void box_forces(const LocalState& state, BoxForces* sum) const override {
    traverse_forces(state, [&](const Element& e, const double* force) {
      double part[d * d] = {};
      add_virial(e, force, share(e), part);
      for (int k = 0; k < d * d; ++k) sum->virial[k] += part[k];
      for (int a = 0; a < N; ++a)
        for (int k = 0; k < d && e.end[a] >= net_.n && !net_.image.empty(); ++k)
          for (int c = 0; c < d; ++c) sum->pull[k * d + c] -= share(e) * net_.image[(e.end[a] - net_.n) * d + k] * force[a * d + c];
    });
  }
  void particle_stress(const LocalState& state, double* sum) const override {
    constexpr int q = d * (d + 1) / 2;
    traverse_forces(state, [&](const Element& e, const double* force) {
      double part[d * d] = {};
      add_virial(e, force, 1.0 / N, part);
      for (int a = 0; a < N; ++a)
        for (int r = 0; r < d && e.end[a] < net_.n; ++r)
          for (int c = r; c < d; ++c) sum[e.end[a] * q + component_place(d, r, c)] += part[r * d + c];
    });
  }
  // d f_a/d e = sum over b of K_ab e x_b,   d2 E/(d e d e') = -sum over a of (e' x_a).(d f_a/d e)
  void strain_response(const LocalState& state, StrainResponse* sum) const override {
    constexpr int q = d * (d + 1) / 2;
    double strain[q][d * d], K[N * d * N * d];
    for (int k = 0; k < q; ++k) unit_strain(d, k, strain[k]);
    traverse_regular(state, [&](const Element& e) {
      Law::template tangent<d, false>(e.x, e.p, K);
      double step[q][N * d] = {}, force[q][N * d] = {};
      for (int k = 0; k < q; ++k) {
        for (int a = 0; a < N; ++a)
          for (int r = 0; r < d; ++r)
            for (int c = 0; c < d; ++c) step[k][a * d + r] += strain[k][r * d + c] * (e.x[a][c] - e.x[0][c]);
        for (int r = 0; r < N * d; ++r) {
          for (int c = 0; c < N * d; ++c) force[k][r] += K[r * N * d + c] * step[k][c];
          if (const PetscInt i = e.end[r / d]; i < net_.n) {
            sum->force[(static_cast<std::size_t>(k) * static_cast<std::size_t>(net_.n) + static_cast<std::size_t>(i)) * d + r % d] += force[k][r];
            sum->size[k] += force[k][r] * force[k][r];
          }
        }
        for (int l = 0; l <= k; ++l) {
          double product = 0;
          for (int r = 0; r < N * d; ++r) product -= share(e) * step[l][r] * force[k][r];
          sum->affine[k * q + l] += product;
          if (l != k) sum->affine[l * q + k] += product;
        }
      }
    });
  }

  PetscErrorCode remember(Network& net, const Lattice& lattice, const BreakRules& rules) override {
    PetscFunctionBegin;
    rows_ = lattice.interactions[kind_].rows;
    if constexpr (turns<Law>::value) {
      const auto measure = [this](const LocalState& state, std::size_t k) {
        const Element e = element(k, [&](PetscInt i) { return state.at(i); });
        TurnMeasures m;
        m.change = Law::template change<d>(e.x, e.p, &m.moment);
        m.energy = Law::template energy<d>(e.x, e.p);
        return m;
      };
      PetscCall(InteractionBreaks::create(net, lattice, rules, kind_, measure, &breaks_));
    }
    PetscFunctionReturn(0);
  }
  Breakable* breakable() const override { return breaks_.get(); }
  // Every owned end is acted on once, wherever its element is seen from.
  PetscErrorCode force_changes(const std::string& name, const LocalState& state, const LocalState& lambda, std::vector<double>* rows) override {
    PetscFunctionBegin;
    if constexpr (says_force_change<Law>::value) {
      const InteractionNumber number = interaction_number(name);
      std::vector<std::pair<std::int64_t, double>> parts;
      if (number.kind != static_cast<int>(kind_)) PetscFunctionReturn(0);
      traverse_regular(state, [&](const Element& e) {
        double change[N * d], sum = 0;
        Law::template force_change<d>(e.x, e.p, static_cast<int>(number.place), change);
        for (int a = 0; a < N; ++a)
          for (int c = 0; c < d && acts_on(e.end[a]); ++c) sum += lambda.at(e.end[a])[c] * change[a * d + c];
        parts.emplace_back(e.row, sum);
      });
      PetscCall(sum_by_rows(net_.comm, rows_.count, parts, rows));
    }
    PetscFunctionReturn(0);
  }

  /// Between owned ends and all ends, neither fixed; broken ones too, so that a continued run has the same matrices.
  void join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const override {
    for (std::size_t k = 0; k < table_.row.size(); ++k)
      for (int a = 0; a < N; ++a)
        for (int b = 0; b < N; ++b)
          if (const PetscInt* end = table_.end.data() + k * N; acts_on(end[a]) && !net_.fixed[end[b]])
            joins->emplace_back(end[a], unknown_[k * N + b]);
  }
  void add_blocks(double, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const override {
    const auto add = [&](const Element& e, int a, int b, const double* K) {
      if (!acts_on(e.end[a]) || net_.fixed[e.end[b]]) return;
      double* to = blocks->block(blocks->find(e.end[a], unknown_[e.place * N + b]));
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c) to[r * d + c] -= abc.stiffness * K[r * N * d + c];
    };
    positive ? traverse_tangents<true>(state, add) : traverse_tangents<false>(state, add);
  }

  void add_rates(std::vector<double>* sum) const override {
    for (std::size_t k = 0; k < table_.row.size(); ++k) {
      double place[N * d], rate[N], *next = place;
      if (table_.is_broken(k)) continue;
      const Element e = element(k, [&](PetscInt i) {
        double* x = std::copy_n(net_.held.data() + i * d, d, next) - d;
        for (int q = 0; q < d && i >= net_.n && !net_.image.empty(); ++q)
          for (int c = 0; c < d; ++c) x[c] += net_.image[(i - net_.n) * d + q] * net_.box.edges[q * d + c];
        next += d;
        return x;
      });
      Law::template rates<d>(e.x, e.p, rate);
      for (int a = 0; a < N; ++a)
        if (acts_on(e.end[a])) (*sum)[e.end[a]] += rate[a];
    }
  }
  void stiffness_sizes(double, const LocalState& state, double* sum) const override {
    std::vector<double> start(static_cast<std::size_t>(net_.n), 0.0), present(start.size(), 0.0);
    add_rates(&start);
    traverse_tangents<false>(state, [&](const Element& e, int a, int b, const double* K) {
      for (int c = 0; c < d && a == b && acts_on(e.end[a]); ++c) present[e.end[a]] += std::abs(K[c * (N * d + 1)]);
    });
    for (std::size_t i = 0; i < start.size(); ++i) sum[i] += std::max(start[i], present[i]);
  }

 private:
  template <class At>
  Element element(std::size_t k, At&& at) const {
    Element e;
    e.end = table_.end.data() + k * N;
    e.p = table_.parameter.data() + k * Law::parameters;
    e.row = table_.row[k];
    e.place = k;
    for (int a = 0; a < N; ++a) e.x[a] = at(e.end[a]);
    return e;
  }
  template <class Visit>
  void traverse(const LocalState& state, Visit&& visit) const {
    for (std::size_t k = 0; k < table_.row.size(); ++k)
      if (!table_.is_broken(k)) visit(element(k, [&](PetscInt i) { return state.at(i); }));
  }
  /// Those that have forces.
  template <class Visit>
  void traverse_regular(const LocalState& state, Visit&& visit) const {
    traverse(state, [&](const Element& e) {
      if (!Law::template fault<d>(e.x, e.p)) visit(e);
    });
  }
  /// visit(element, forces on its ends)
  template <class Visit>
  void traverse_forces(const LocalState& state, Visit&& visit) const {
    traverse_regular(state, [&](const Element& e) {
      double force[N * d];
      Law::template force<d>(e.x, e.p, force);
      visit(e, force);
    });
  }
  /// visit(element, a, b, df_a/dx_b), rows of the block N d numbers apart.
  template <bool positive, class Visit>
  void traverse_tangents(const LocalState& state, Visit&& visit) const {
    double K[N * d * N * d];
    traverse_regular(state, [&](const Element& e) {
      Law::template tangent<d, positive>(e.x, e.p, K);
      for (int a = 0; a < N; ++a)
        for (int b = 0; b < N; ++b) visit(e, a, b, K + a * d * N * d + b * d);
    });
  }
  /// -part of the sum of f_a x_a, its symmetric half, (d, d)
  static void add_virial(const Element& e, const double* force, double part, double* out) {
    for (int a = 1; a < N; ++a)
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c)
          out[r * d + c] -= 0.5 * part * (force[a * d + r] * (e.x[a][c] - e.x[0][c]) + force[a * d + c] * (e.x[a][r] - e.x[0][r]));
  }
  bool acts_on(PetscInt i) const { return i < net_.n && !net_.fixed[i]; }
  double share(const Element& e) const {
    return static_cast<double>(std::count_if(e.end, e.end + N, [&](PetscInt i) { return i < net_.n; })) / N;
  }
  Singularity describe(const Element& e, const char* why) const {
    for (int a = 0; a < N; ++a)
      for (int c = 0; c < d; ++c)
        if (!std::isfinite(e.x[a][c]))
          return {Singularity::state, net_.row[*std::find_if(e.end, e.end + N, [&](PetscInt i) { return i < net_.n; })], "", ""};
    return {Singularity::interaction, e.row, Law::title, why};
  }

  const Network& net_;
  const InteractionTable& table_;
  const std::size_t kind_;                     ///< its place in the network's list
  std::vector<std::uint8_t> boundary_;         ///< (n) owned particles linked to a ghost
  std::vector<std::size_t> part_[2];           ///< elements with an end in either Part
  std::unique_ptr<InteractionBreaks> breaks_;  ///< null where none may break
  Rows rows_;                                  ///< of this rank in the input's order
  std::vector<PetscInt> unknown_;  ///< (count, ends) the local particle whose unknowns an end has: of an image of an owned particle that one
};

}  // namespace bs
