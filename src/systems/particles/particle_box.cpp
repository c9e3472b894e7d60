// A particle system in its periodic box: what the box shows, and how particles answer its strains.
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/vec_array.hpp"
#include "input/hdf5_layout.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

/// The edges and the stress, tension positive, of the state that state_ holds:
///   sigma = (sum of (T/l) dx dx over springs - sum of m c c over particles) / V,   c = v - F' F^-1 x
/// by the components xx; xx, yy, xy; or xx, yy, zz, yz, xz, xy.
PetscErrorCode ParticleModel::observe_box(double t, std::vector<Observable>* out) {
  const int d = net_.dim;
  double edges[9], L[9];
  const Cell& box = constraints_.box();
  BoxForces sums;
  PetscFunctionBegin;
  box.edges(t, edges, nullptr);
  box.velocity_gradient(t, L);
  for (const Term* term : *terms_) term->box_forces(state_, &sums);
  double* sigma = sums.virial;
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i] == 1) continue;
    double c[3];
    beside_flow(d, state_.at(i), L, c);
    for (int r = 0; r < d; ++r)
      for (int q = 0; q < d; ++q) sigma[r * d + q] -= net_.inertia[i] * c[r] * c[q];
  }
  PetscCall(sum_over_ranks(net_.comm, sigma, 9));
  out->push_back({"stress", stress_components(d, sigma, box.volume(t)), 0, {1, 2 - d, -2}});
  const int columns = box.triclinic() ? d : 0;
  std::vector<double> shown;
  for (int k = 0; k < d; ++k)
    for (int c = 0; c < d; ++c)
      if (columns > 0 || k == c) shown.push_back(edges[k * d + c]);
  out->push_back({BOX_EDGES, shown, columns});
  if (box.moving() && box.free_strains(t).empty()) out->push_back({BOX_FLOW, std::vector<double>(L, L + d * d), d, {0, 0, -1}});
  std::vector<double> found;
  for (const FreeStrain& one : box.free_strains(t)) found.push_back(one.strain);
  if (!found.empty()) out->push_back({"free_strain", found});
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::strain_response(double t, Vec y, StrainResponse* out) {
  const int d = net_.dim, q = d * (d + 1) / 2;
  const Cell& box = constraints_.box();
  BoxForces sums;
  PetscFunctionBegin;
  *out = {};
  if (!box.active()) PetscFunctionReturn(0);
  out->count = q;
  out->volume = box.volume(t);
  double rate[9];
  box.gradient(t, out->gradient, rate);
  if (net_.fixed_total > 0 || constraints_.holds_groups()) out->held = "fixed or driven particles";
  else if (net_.anchors_total > 0) out->held = "anchors";
  else if (std::any_of(terms_->begin(), terms_->end(), [](const Term* term) { return term->depends_on_place(); }))
    out->held = "forces that depend on the place in space";
  PetscCall(gather(t, y));
  out->force.assign(static_cast<std::size_t>(q) * static_cast<std::size_t>(net_.n * d), 0.0);
  out->affine.assign(static_cast<std::size_t>(q * q), 0.0);
  out->size.assign(static_cast<std::size_t>(q), 0.0);
  for (const Term* term : *terms_) {
    term->strain_response(state_, out);
    term->box_forces(state_, &sums);
  }
  PetscCall(sum_over_ranks(net_.comm, out->affine.data(), q * q));
  PetscCall(sum_over_ranks(net_.comm, out->size.data(), q));
  for (double& square : out->size) square = std::sqrt(square);
  PetscCall(sum_over_ranks(net_.comm, sums.virial, 9));
  out->stress = stress_components(d, sums.virial, out->volume);
  PetscFunctionReturn(0);
}

/// The springs as they are drawn: a line across the whole box, and one that can exert no force, is a point.
std::vector<std::int64_t> ParticleModel::drawn_pairs() const {
  const std::size_t d = static_cast<std::size_t>(net_.dim);
  std::vector<std::int64_t> drawn = lattice_.pairs;
  for (std::size_t k = 0; k < lattice_.stiffness.size(); ++k) {
    bool none = lattice_.stiffness[k] == 0 && lattice_.damping[k] == 0;
    for (const char* name : {"stiffness_2", "stiffness_3"})
      if (const Column* column = find_column(lattice_.spring_columns, name)) none = none && column->value[k] == 0;
    bool across = false;
    for (std::size_t c = k * d; c < std::min((k + 1) * d, lattice_.shift.size()); ++c) across = across || lattice_.shift[c] != 0;
    if (none || across) drawn[2 * k + 1] = drawn[2 * k];
  }
  return drawn;
}

/// Where that is not as they are.
PetscErrorCode ParticleModel::add_drawn(const std::string& bonds, std::vector<Dataset>* out) {
  const Rows& s = lattice_.springs;
  std::vector<std::int64_t> drawn = drawn_pairs();
  bool differs = false;
  PetscFunctionBegin;
  PetscCall(on_some_rank(net_.comm, net_.box.active() || drawn != lattice_.pairs, &differs));
  if (differs) out->push_back({bonds + "_drawn", s.first, s.total, 2, std::move(drawn)});
  PetscFunctionReturn(0);
}

/// The ends of springs that can break, of which draw_broken makes points.
PetscErrorCode ParticleModel::keep_drawn() {
  PetscFunctionBegin;
  if (!breaks() || lattice_.springs.total == 0) PetscFunctionReturn(0);
  const std::vector<std::int64_t> drawn = drawn_pairs();
  PetscCall(VecCreateMPI(net_.comm, static_cast<PetscInt>(drawn.size()), PETSC_DETERMINE, drawn_.out()));
  PetscCall(VecSetBlockSize(drawn_, 2));
  const WriteArray ends(drawn_);
  std::copy(drawn.begin(), drawn.end(), ends.data());
  PetscFunctionReturn(0);
}

/// `broken`: 1 or 0 for every spring. None is ever whole again.
PetscErrorCode ParticleModel::draw_broken(Vec broken) {
  PetscInt springs;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(broken, &springs));
  const ReadArray flags(broken);
  const WriteArray ends(drawn_);
  for (PetscInt k = 0; k < springs; ++k)
    if (flags[k] != 0) ends[2 * k + 1] = ends[2 * k];
  PetscFunctionReturn(0);
}

}  // namespace bs
