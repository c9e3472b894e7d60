#include "systems/particles/coupling.hpp"
#include "base/collective.hpp"
#include "base/dimension.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/options.hpp"
#include "systems/layout.hpp"
#include "systems/particles/constraints/constraints.hpp"

namespace bs {

PetscErrorCode Coupling::read_options(MPI_Comm comm, const Lattice& lattice, NetworkOptions* network) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Forces that couple all particles", [&](Section& o) {
    mass_.options(o);
    pull_.options(o);
    o.integer("-bs_xsp_center_particle",
              "row, counted from 0, of the particle that serves as centre of -bs_xsp_center_of_mass and -bs_xsp_attraction; -1: the point given by "
              "-bs_xsp_attraction_center",
              center_row_);
    o.integer("-bs_dense_coupling_max",
              "largest number of particles for which the Jacobian of -bs_xsp_center_of_mass is assembled as a dense matrix; above it, a low-rank "
              "operator is added to the sparse matrix",
              dense_max_, Range::nonnegative);
  }));
  if (center_row_ < -1 || center_row_ >= lattice.particles.total)
    PetscCall(fail(comm, Exit::input,
                   format("option -bs_xsp_center_particle: %lld is not a row of the %s: give 0 to %lld, "
                          "or -1 for a point",
                          static_cast<long long>(center_row_), how_many(lattice.particles.total, "particle").c_str(),
                          static_cast<long long>(lattice.particles.total - 1))));
  dense_ = lattice.particles.total <= dense_max_;
  network->all_to_all = mass_.active() && dense_;
  network->center_row = mass_.active() || attracts() ? center_row_ : -1;
  PetscFunctionReturn(0);
}

PetscErrorCode Coupling::create(const Network& net, const RowPattern& pattern) {
  PetscFunctionBegin;
  net_ = &net;
  pattern_ = &pattern;
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i]) rows_[net.boundary(i)].push_back(i);
  for (int c = 0; c < 3; ++c) C_[c] = pull_.center[c];
  selected_.assign(static_cast<std::size_t>(net.n + net.ghosts), 0);
  double sum = 0;
  std::int64_t owned_center = -1;
  for (PetscInt i = 0; i < net.n; ++i)
    if (net.row[i] == center_row_) owned_center = net.global[i];
  PetscCall(max_over_ranks(net.comm, &owned_center));
  for (PetscInt i = 0; i < net.n + net.ghosts; ++i) {
    if (owned_center >= 0 && net.global[i] == owned_center) center_ = i;
    selected_[i] = !net.fixed[i] && i != center_;
    if (i < net.n && selected_[i]) sum += net.mass[i];
  }
  PetscCall(sum_over_ranks(net.comm, &sum));
  S_ = sum > 0 ? sum : 1;
  PetscFunctionReturn(0);
}

// X = sum m x / S, V = sum m v / S over the selected particles
PetscErrorCode Coupling::gather(const LocalState& state) {
  const Network& net = *net_;
  PetscFunctionBegin;
  if (center_ >= 0)
    for (int c = 0; c < net.dim; ++c) C_[c] = state.at(center_)[c];
  if (!mass_.active()) PetscFunctionReturn(0);
  double sums[6] = {0, 0, 0, 0, 0, 0};
  for (PetscInt i = 0; i < net.n; ++i) {
    if (!selected_[i]) continue;
    for (int c = 0; c < net.dim; ++c) {
      sums[c] += net.mass[i] * state.at(i)[c];
      // NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign): dim is at most 3
      sums[3 + c] += net.mass[i] * state.at(i)[net.dim + c];
    }
  }
  PetscCall(sum_over_ranks(net.comm, sums, 6));
  for (int c = 0; c < 3; ++c) {
    X_[c] = sums[c] / S_;
    V_[c] = sums[3 + c] / S_;
  }
  PetscFunctionReturn(0);
}

void Coupling::forces(Part part, double t, const LocalState& state, double* f, Singularity*, Energies* sum) const {
  with_dimension(net_->dim, [&](auto d) {
    for (const PetscInt i : rows_[static_cast<int>(part)]) add_force<d>(i, point<d>(i, t, state), f + i * d);
  });
  if (sum && part == Part::boundary) energies(t, state, sum);
}

void Coupling::energies(double t, const LocalState& state, Energies* sum) const {
  with_dimension(net_->dim, [&](auto d) {
    for (PetscInt i = 0; i < net_->n; ++i)
      if (net_->fixed[i] != 1) sum->field += energy<d>(i, point<d>(i, t, state));
  });
}

void Coupling::forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const {
  with_dimension(net_->dim, [&](auto d) {
    for (std::size_t k = 0; k < which.size(); ++k) add_force<d>(which[k], point<d>(which[k], t, state), f + k * d);
  });
}

void Coupling::supply(double t, const LocalState& state, Supply* sum) const {
  with_dimension(net_->dim, [&](auto d) {
    for (PetscInt i = 0; i < net_->n; ++i) {
      if (net_->fixed[i] == 1) continue;
      const Point<d> here = point<d>(i, t, state);
      double f[d] = {};
      add_force<d>(i, here, f);
      sum->coupling += dot<d>(f, here.v);
    }
  });
}

void Coupling::add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const {
  const Links& links = net_->links;
  with_dimension(net_->dim, [&](auto d) {
    const Point<d> here = point<d>(i, t, state);
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      if (links.spring[e] >= 0 || pattern_->slot(e) < 0) continue;
      double K[d * d] = {}, D[d * d] = {};
      add_cross<d>(i, links.other[e], here, K, D);
      subtract_blocks<d>(panel, width, pattern_->slot(e), K, D);
    }
    double K[d * d] = {}, D[d * d] = {};
    add_self<d>(i, here, K, D);
    subtract_blocks<d>(panel, width, pattern_->self(i), K, D);
  });
}

std::string Coupling::describe() const {
  std::string text;
  if (mass_.active()) text += mass_.describe() + (dense_ ? ", assembled" : ", low-rank operator");
  if (attracts()) text += (text.empty() ? "" : "; ") + pull_.describe();
  if (center_row_ >= 0) text += format("; the centre is the particle in row %lld", static_cast<long long>(center_row_));
  return text;
}

// J = P + U W^T, one column per direction k:
// U: m_i (momentum) or m_i/M_i (velocity) at v_i of selected i;  W: value m_j/S^2 at x_j, damping m_j/S^2 at v_j, -value/S at x_C
PetscErrorCode Coupling::create_operator(const Network& net, Mat P, bool momentum, Mat* A) const {
  const PetscInt d = net.dim;
  const Layout at{d, net.n};
  PetscFunctionBegin;
  if (!mass_.active() || dense_) {
    PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(P)));
    *A = P;
    PetscFunctionReturn(0);
  }
  MatHandle U, W;
  for (MatHandle* M : {&U, &W}) PetscCall(MatCreateDense(net.comm, at.x(net.n), PETSC_DECIDE, PETSC_DETERMINE, d, nullptr, M->out()));
  for (PetscInt i = 0; i < net.n; ++i) {
    const int held = net.constraints->held(i);
    for (PetscInt k = 0; k < d; ++k) {
      if (held >> k & 1) continue;
      const PetscInt x = at.x(net.global[i], k), v = at.v(net.global[i], k);
      if (selected_[i]) {
        PetscCall(MatSetValue(U, v, k, momentum ? net.mass[i] : net.mass[i] / net.inertia[i], INSERT_VALUES));
        PetscCall(MatSetValue(W, x, k, mass_.value * net.mass[i] / (S_ * S_), INSERT_VALUES));
        PetscCall(MatSetValue(W, v, k, mass_.damping * net.mass[i] / (S_ * S_), INSERT_VALUES));
      } else if (i == center_) {
        PetscCall(MatSetValue(W, x, k, -mass_.value / S_, INSERT_VALUES));
      }
    }
  }
  for (Mat M : {U.get(), W.get()}) {
    PetscCall(assemble(M));
  }
  PetscCall(MatCreateLRC(P, U, nullptr, W, A));
  PetscFunctionReturn(0);
}

}  // namespace bs
