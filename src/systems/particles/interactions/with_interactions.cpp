#include "systems/particles/interactions/with_interactions.hpp"
#include "base/text.hpp"
#include "physics/interactions/registry.hpp"
#include "systems/particles/interactions/interaction.hpp"

namespace bs {
namespace {

/// One member for each law; what is common to all uses is the order: springs and particle laws first, then kind by kind.
template <int d, class... Laws>
class WithInteractions final : public Physics {
 public:
  WithInteractions(const Network& net, std::unique_ptr<Physics> pairs, std::tuple<Laws...>)
      : WithInteractions(net, std::move(pairs), std::index_sequence_for<Laws...>()) {}

  void forces(Part part, double t, const LocalState& state, const Coupling& coupling, double* f, Singularity* fault) const override {
    pairs_->forces(part, t, state, coupling, f, fault);
    for_each([&](const auto& kind) { kind.add_forces(part, state, f, fault); });
  }
  void forces_and_energies(Part part, double t, const LocalState& state, const Coupling& coupling, double* f, Singularity* fault,
                           Energies* sum) const override {
    pairs_->forces_and_energies(part, t, state, coupling, f, fault, sum);
    for_each([&](const auto& kind) {
      kind.add_forces(part, state, f, fault);
      if (part == Part::boundary) sum->elastic += kind.energy(state);
    });
  }
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, const Coupling& coupling, double* f) const override {
    pairs_->forces_on(which, t, state, coupling, f);
    for_each([&](const auto& kind) { kind.add_forces_on(which, state, f); });
  }
  void pull(double t, const LocalState& state, double* sum) const override { pairs_->pull(t, state, sum); }
  PetscErrorCode jacobian(double t, const LocalState& state, const Coupling& coupling, double sigma, bool momentum,
                          RowWriter* writer) const override {
    PetscFunctionBegin;
    fill(state, false, -1, &blocks_);
    if (!momentum) {
      std::vector<double> scale(net_.mass.begin(), net_.mass.begin() + net_.n);
      for (double& m : scale) m = 1 / m;
      blocks_.scale_rows(scale);
    }
    writer->add(&blocks_);
    PetscCall(pairs_->jacobian(t, state, coupling, sigma, momentum, writer));
    PetscFunctionReturn(0);
  }
  // S = a M - b D - c K
  void condense_springs(double t, const LocalState& state, const Coefficients& abc, bool positive, PairMatrix* S) const override {
    pairs_->condense_springs(t, state, abc, positive, S);
    fill(state, positive, -abc.stiffness, &S->remainder());
  }
  PetscErrorCode condense_rows(double t, const LocalState& state, const Coefficients& abc, bool positive, BlockRowWriter* writer) const override {
    PetscFunctionBegin;
    fill(state, positive, -abc.stiffness, &blocks_);
    writer->add(&blocks_);
    PetscCall(pairs_->condense_rows(t, state, abc, positive, writer));
    PetscFunctionReturn(0);
  }
  void multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const override {
    pairs_->multiply_tangent(t, state, z, f);
    for_each([&](const auto& kind) { kind.multiply_tangent(state, z, f); });
  }
  void multiply_law_damping(double t, const LocalState& state, const double* w, double* f) const override {
    pairs_->multiply_law_damping(t, state, w, f);
  }
  void commit(const LocalState& state, double h, Links* links) const override { pairs_->commit(state, h, links); }
  LinkMeasures measure(const LocalState& state, PetscInt i, PetscInt e) const override { return pairs_->measure(state, i, e); }
  Energies energies(double t, const LocalState& state) const override {
    Energies sum = pairs_->energies(t, state);
    for_each([&](const auto& kind) { sum.elastic += kind.energy(state); });
    return sum;
  }
  Supply supply(double t, const LocalState& state, const Coupling& coupling) const override { return pairs_->supply(t, state, coupling); }
  void strain_response(const LocalState& state, StrainResponse* sum) const override {
    pairs_->strain_response(state, sum);
    for_each([&](const auto& kind) { kind.add_strain_response(state, sum); });
  }
  void box_forces(const LocalState& state, BoxForces* sum) const override {
    pairs_->box_forces(state, sum);
    for_each([&](const auto& kind) { kind.add_box_forces(state, sum); });
  }
  void particle_stress(const LocalState& state, double* sum) const override {
    pairs_->particle_stress(state, sum);
    for_each([&](const auto& kind) { kind.add_particle_stress(state, sum); });
  }
  PotentialChange beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma) const override {
    PotentialChange sum = pairs_->beyond_slope(t, state, line, lambda, sigma);
    for_each([&](const auto& kind) { sum.value += sigma * kind.beyond_slope(state, line, lambda); });
    return sum;
  }
  std::string lacks_potential() const override { return pairs_->lacks_potential(); }
  void law_sizes(double t, const LocalState& state, double* size) const override { pairs_->law_sizes(t, state, size); }
  double anchor_tension(double t, const LocalState& state, PetscInt k) const override { return pairs_->anchor_tension(t, state, k); }
  void add_interaction_sizes(const LocalState& state, double* size) const override {
    for_each([&](const auto& kind) { kind.add_sizes(state, size); });
  }
  std::vector<double> rates() const override {
    std::vector<double> sum = pairs_->rates();
    for_each([&](const auto& kind) { kind.add_rates(&sum); });
    return sum;
  }
  void stiffness_sizes(double t, const LocalState& state, double* size) const override {
    pairs_->stiffness_sizes(t, state, size);
    for_each([&](const auto& kind) { kind.add_stiffness_sizes(state, size); });
  }

 private:
  template <std::size_t... kind>
  WithInteractions(const Network& net, std::unique_ptr<Physics> pairs, std::index_sequence<kind...>)
      : net_(net), pairs_(std::move(pairs)), boundary_(boundary_of(net)), kinds_{{net, net.interactions[kind], boundary_}...} {}

  static std::vector<std::uint8_t> boundary_of(const Network& net) {
    std::vector<std::uint8_t> cut(static_cast<std::size_t>(net.n), 0);
    for (PetscInt i = 0; i < net.n; ++i)
      for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e) cut[i] = cut[i] || net.links.other[e] >= net.n;
    return cut;
  }
  template <class F>
  void for_each(F&& f) const {
    std::apply([&](const auto&... kind) { (f(kind), ...); }, kinds_);
  }
  /// factor K into `blocks`, which are laid out at first use.
  void fill(const LocalState& state, bool positive, double factor, SparseBlocks* blocks) const {
    if (!blocks->created()) {
      std::vector<std::pair<PetscInt, PetscInt>> joins;
      for_each([&](const auto& kind) { kind.join(&joins); });
      blocks->create(net_.n, d, joins);
    }
    blocks->zero();
    for_each([&](const auto& kind) {
      positive ? kind.template add_blocks<true>(state, factor, blocks) : kind.template add_blocks<false>(state, factor, blocks);
    });
  }

  const Network& net_;
  std::unique_ptr<Physics> pairs_;
  std::vector<std::uint8_t> boundary_;  ///< (n) owned particles linked to a ghost
  std::tuple<Interaction<Laws, d>...> kinds_;
  mutable SparseBlocks blocks_;  ///< of the matrix that is being written
};

template <int d, class... Laws>
std::unique_ptr<Physics> make(const Network& net, std::unique_ptr<Physics> pairs, std::tuple<Laws...> laws) {
  return std::make_unique<WithInteractions<d, Laws...>>(net, std::move(pairs), laws);
}

}  // namespace

std::unique_ptr<Physics> with_interactions(const Network& net, std::unique_ptr<Physics> pairs) {
  if (net.interactions.empty()) return pairs;
  if (net.dim == 2) return make<2>(net, std::move(pairs), InteractionLaws{});
  return make<3>(net, std::move(pairs), InteractionLaws{});
}

/// The lowest rank reports.
PetscErrorCode interaction_fault(MPI_Comm comm, bool mine, const Singularity& fault, std::string* text) {
  char words[512] = "";
  int rank, size, speaker;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  speaker = mine ? rank : size;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &speaker, 1, MPI_INT, MPI_MIN, comm));
  if (mine)
    PetscCall(PetscStrncpy(
        words, format("%s %lld met %s: lower -ts_dt, or keep its particles apart", fault.law, static_cast<long long>(fault.row), fault.why).c_str(),
        sizeof words));
  PetscCallMPI(MPI_Bcast(words, sizeof words, MPI_CHAR, speaker, comm));
  *text = words;
  PetscFunctionReturn(0);
}

}  // namespace bs
