#include <algorithm>
#include <cmath>
#include <numeric>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"
#include "systems/first_order.hpp"
#include "systems/mechanics.hpp"
#include "systems/model.hpp"

namespace bs {

namespace {

template <PetscErrorCode (FirstOrderTangent::*product)(Vec, Vec)>
PetscErrorCode shell_product(Mat J, Vec z, Vec y) {
  FirstOrderTangent* self = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(J, &self));
  PetscCall((self->*product)(z, y));
  PetscFunctionReturn(0);
}

PetscErrorCode shell_view(Mat, PetscViewer viewer) {
  PetscBool text = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(viewer), PETSCVIEWERASCII, &text));
  if (text) PetscCall(PetscViewerASCIIPrintf(viewer, "products with the tangents of the forces; -bs_operator assembled makes it an AIJ matrix\n"));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode FirstOrderTangent::linearise(double t, Vec y, double sigma, Form form) {
  PetscFunctionBegin;
  sigma_ = sigma;
  form_ = form;
  PetscCall(own_.linearise(t, y));
  const ReadArray ay(y);
  size_ = speed_ = 0;
  layout_of(y).for_each([&](PetscInt x, PetscInt v) {
    size_ = std::max(size_, sigma * std::abs(ay[x]));
    speed_ = std::max(speed_, std::abs(ay[v]));
  });
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrderTangent::create_shell(Mat* J) {
  PetscInt local = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(own_.state_vector(), &local));
  PetscCall(MatCreateShell(comm(), local, local, PETSC_DETERMINE, PETSC_DETERMINE, this, J));
  PetscCall(MatSetBlockSize(*J, own_.layout().block()));
  PetscCall(MatSetVecType(*J, VECSTANDARD));
  PetscCall(set_shell_operation(*J, MATOP_MULT, shell_product<&FirstOrderTangent::multiply>));
  PetscCall(set_shell_operation(*J, MATOP_VIEW, shell_view));
  PetscCall(offer_transposed(*J));
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrderTangent::offer_transposed(Mat J) {
  const bool symmetric = static_ ? own_.symmetric_at_rest() : own_.exact_symmetric();
  PetscFunctionBegin;
  if (symmetric) PetscCall(set_shell_operation(J, MATOP_MULT_TRANSPOSE, shell_product<&FirstOrderTangent::multiply_transposed>));
  else PetscCall(MatSetOperation(J, MATOP_MULT_TRANSPOSE, nullptr));  // MatShellSetOperation leaves a function that finds none
  PetscFunctionReturn(0);
}

/// K z_x + D z_v; of an equilibrium K z_x.
PetscErrorCode FirstOrderTangent::change_of_force(Vec z) {
  PetscFunctionBegin;
  if (static_) {
    if (!places_) PetscCall(VecDuplicate(own_.state_vector(), places_.out()));
    PetscCall(VecCopy(z, places_));
    PetscCall(zero_velocities(places_));
    z = places_;
  }
  PetscCall(own_.change_of_force(z, force_.data()));
  PetscFunctionReturn(0);
}

// J z: scale M (sigma z_x - z_v) and scale (mu M z_v - D z_v - K z_x); scale = 1 (momentum form), M^-1 (velocity form); of an
// equilibrium the latter is shift M z_x - K z_x
PetscErrorCode FirstOrderTangent::multiply(Vec z, Vec y) {
  const Layout& at = own_.layout();
  const std::vector<double>& masses = own_.masses();
  PetscFunctionBegin;
  force_.resize(static_cast<std::size_t>(at.particles * at.dim));
  PetscCall(change_of_force(z));
  const ReadArray az(z);
  const WriteArray ay(y);
  for (PetscInt i = 0; i < at.particles; ++i) {
    const double m = masses[static_cast<std::size_t>(i)], factor = scale(m);
    for (PetscInt c = 0; c < at.dim; ++c) {
      const PetscInt x = at.x(i, c), v = at.v(i, c);
      ay[x] = factor * m * (sigma_ * az[x] - az[v]);
      ay[v] = factor * (row_of_v(m, az[x], az[v]) - force_[static_cast<std::size_t>(i * at.dim + c)]);
    }
  }
  PetscFunctionReturn(0);
}

// J^T z, with u = scale z: M (sigma u_x) - K u_v and -M u_x + mu M u_v - D u_v; of an equilibrium the former has shift M u_v, too, and the latter
// is -M u_x
PetscErrorCode FirstOrderTangent::multiply_transposed(Vec z, Vec y) {
  const Layout& at = own_.layout();
  const std::vector<double>& masses = own_.masses();
  const auto entries = static_cast<std::size_t>(at.particles * at.dim);
  std::vector<double> u(entries), damping(entries, 0.0);
  PetscFunctionBegin;
  if (!places_) PetscCall(VecDuplicate(own_.state_vector(), places_.out()));
  force_.resize(entries);
  const ReadArray az(z);
  {
    const WriteArray places(places_);
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) {
        places[at.x(i, c)] = u[i * at.dim + c] = scale(masses[i]) * az[at.v(i, c)];
        places[at.v(i, c)] = 0;
      }
  }
  PetscCall(own_.change_of_force(places_, force_.data()));
  if (!static_) PetscCall(own_.damping_force(u.data(), damping.data()));
  const WriteArray ay(y);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      const PetscInt e = i * at.dim + c;
      const double m = masses[i], ux = scale(m) * az[at.x(i, c)];
      ay[at.x(i, c)] = sigma_ * m * ux + row_of_v(m, u[e], 0) - force_[e];
      ay[at.v(i, c)] = row_of_v(m, 0, u[e]) - m * ux - damping[e];
    }
  PetscFunctionReturn(0);
}

/// Collective. D a, 0 where a = x' - v is rounding of x' = sigma x + ... on every rank, since the energy search leaves states with x' = v, and where
/// D a is therefore lost beside D v: far from the origin the rounding of x' is a velocity that counts.
PetscErrorCode FirstOrderTangent::damp(const std::vector<double>& a, std::vector<double>* damping) {
  constexpr double ROUNDINGS = 16, LOST = 1000;
  const double most = std::accumulate(a.begin(), a.end(), 0.0, [](double m, double value) { return std::max(m, std::abs(value)); });
  bool some = !(most <= PETSC_MACHINE_EPSILON * std::min(ROUNDINGS * std::max(size_, speed_), LOST * speed_));
  PetscFunctionBegin;
  damping->assign(a.size(), 0.0);
  if (static_) PetscFunctionReturn(0);
  PetscCall(on_some_rank(comm(), some, &some));
  if (some) PetscCall(own_.damping_force(a.data(), damping->data()));
  PetscFunctionReturn(0);
}

/// Collective. Of S w = r_v + (mu M - D) a and S z_v = r_v + K a/sigma the one with less on its right side: what it adds to r_v is then in force_.
PetscErrorCode FirstOrderTangent::choose_unknown(const std::vector<double>& a) {
  const Layout& at = own_.layout();
  constexpr double STRONG = 1e4;  // weaker dampers leave twelve digits of inertia
  double square[2] = {0, 0};
  PetscFunctionBegin;
  by_velocity_ = false;
  if (static_ || !own_.damps()) PetscFunctionReturn(0);
  bool strong = own_.damping_rate() > STRONG * inertia_ * sigma_;
  PetscCall(on_some_rank(comm(), strong, &strong));
  if (!strong) PetscFunctionReturn(0);
  if (!places_) PetscCall(VecDuplicate(own_.state_vector(), places_.out()));
  {
    const WriteArray places(places_);
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) {
        places[at.x(i, c)] = a[i * at.dim + c];
        places[at.v(i, c)] = 0;
      }
  }
  std::vector<double> stiff(a.size());
  PetscCall(own_.change_of_force(places_, stiff.data()));
  for (std::size_t k = 0; k < a.size(); ++k) {
    const double damped = inertia_ * sigma_ * own_.masses()[k / static_cast<std::size_t>(at.dim)] * a[k] - force_[k];
    square[0] += damped * damped;
    stiff[k] /= sigma_;
    square[1] += stiff[k] * stiff[k];
  }
  PetscCall(sum_over_ranks(comm(), square, 2));
  by_velocity_ = square[1] < square[0];
  if (by_velocity_) force_.swap(stiff);
  PetscFunctionReturn(0);
}

// b = r_v + (mu M - D) a, or r_v + K a/sigma; of an equilibrium r_v
PetscErrorCode FirstOrderTangent::condense(Vec r, Vec b) {
  const Layout& at = own_.layout();
  const PetscInt d = at.dim;
  const std::vector<double>& masses = own_.masses();
  PetscFunctionBegin;
  std::vector<double> a(static_cast<std::size_t>(at.particles * d), 0.0);
  const ReadArray ar(r);
  for (PetscInt i = 0; i < at.particles && !static_; ++i)
    for (PetscInt c = 0; c < d; ++c) a[i * d + c] = ar[at.x(i, c)] / (form_ == Form::momentum ? masses[i] : 1.0);
  PetscCall(damp(a, &force_));
  PetscCall(choose_unknown(a));
  const WriteArray ab(b);
  for (PetscInt i = 0; i < at.particles; ++i) {
    const double m = masses[i], scale = form_ == Form::momentum ? 1.0 : m;
    for (PetscInt k = i * d, c = 0; c < d; ++c, ++k)
      ab[k] = scale * ar[at.v(i, c)] + (by_velocity_ ? force_[k] : inertia_ * sigma_ * m * a[k] - force_[k]);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrderTangent::stiffness_sizes(Vec s) {
  const Layout& at = own_.layout();
  std::vector<double> size(static_cast<std::size_t>(at.particles));
  PetscFunctionBegin;
  own_.stiffness_sizes(size.data());
  const WriteArray all(s);
  for (PetscInt k = 0; k < at.particles * at.dim; ++k) all[k] = size[static_cast<std::size_t>(k / at.dim)] / sigma_;
  PetscFunctionReturn(0);
}

// z_x = w/sigma,   z_v = w - a;   with z_v for w: z_x = (w + a)/sigma
PetscErrorCode FirstOrderTangent::expand(Vec r, Vec w, Vec z) {
  const Layout& at = own_.layout();
  const PetscInt d = at.dim;
  const std::vector<double>& masses = own_.masses();
  PetscFunctionBegin;
  const ReadArray ar(r), aw(w);
  const WriteArray az(z);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      const double a = ar[at.x(i, c)] / (form_ == Form::momentum ? masses[i] : 1.0);
      az[at.x(i, c)] = (by_velocity_ ? aw[i * d + c] + a : aw[i * d + c]) / sigma_;
      az[at.v(i, c)] = by_velocity_ ? aw[i * d + c] : aw[i * d + c] - a;
    }
  PetscFunctionReturn(0);
}

std::unique_ptr<Mechanics> Model::take_mechanics() { return nullptr; }

PetscErrorCode Linearisation::multiply(const Coefficients& k, Vec z, Vec out) {
  const Layout& at = layout();
  const std::vector<double>& m = masses();
  PetscScalar* both = nullptr;
  PetscFunctionBegin;
  if (!room_) PetscCall(VecDuplicate(state_vector(), room_.out()));
  force_.resize(static_cast<std::size_t>(at.particles * at.dim));
  const ReadArray az(z);
  PetscCall(VecGetArrayWrite(room_, &both));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      both[at.x(i, c)] = k.stiffness * az[i * at.dim + c];
      both[at.v(i, c)] = k.damping * az[i * at.dim + c];
    }
  PetscCall(VecRestoreArrayWrite(room_, &both));
  PetscCall(change_of_force(room_, force_.data()));
  const WriteArray a(out);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt e = i * at.dim; e < (i + 1) * at.dim; ++e)
      a[e] = k.mass * m[static_cast<std::size_t>(i)] * az[e] - force_[static_cast<std::size_t>(e)];
  PetscFunctionReturn(0);
}

}  // namespace bs
