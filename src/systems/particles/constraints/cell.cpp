#include "systems/particles/constraints/cell.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "systems/layout.hpp"

namespace bs {

namespace {

/// out = A B, (d, d) each.
void multiply(int d, const double* A, const double* B, double* out) {
  for (int r = 0; r < d; ++r)
    for (int c = 0; c < d; ++c) {
      out[r * d + c] = 0;
      for (int k = 0; k < d; ++k) out[r * d + c] += A[r * d + k] * B[k * d + c];
    }
}

/// What is given of one component at time t, and its rate.
double given_at(const Drive& drive, double t, double* rate) {
  const double zero[3] = {0, 0, 0};
  double g[3] = {0, 0, 0}, v[3] = {0, 0, 0}, a[3] = {0, 0, 0};
  drive.at(t, zero, g, v, a);
  if (rate) *rate = v[0];
  return g[0];
}

}  // namespace

/// Of a sum in a checkpoint.
static std::string saved_name(int row, int column) { return "box_strain_" + component_name(row, column); }

void Cell::create(const Network& net) {
  net_ = &net;
  dim_ = static_cast<int>(net.dim);
  for (PetscInt g = 0; g < net.ghosts && !net.image.empty(); ++g)
    for (int k = 0; k < dim_; ++k)
      if (net.image[static_cast<std::size_t>(g * dim_ + k)] != 0) {
        images_.push_back(net.n + g);
        break;
      }
}

std::vector<std::string> Cell::boundary() const {
  std::vector<std::string> words;
  for (int k = 0; k < dim_ && active(); ++k) words.emplace_back(box_.periodic[k] ? "periodic" : "none");
  return words;
}

bool Cell::moving() const {
  return !free_.empty() || std::any_of(components_.begin(), components_.end(), [](const Component& one) { return one.drive.moving() != 0; });
}

bool Cell::triclinic() const {
  const auto shears = [](const auto& one) { return one.row != one.column; };
  return !box_.orthogonal(dim_) || std::any_of(components_.begin(), components_.end(), shears) || std::any_of(free_.begin(), free_.end(), shears);
}

/// F and dF/dt, (d, d) each.
void Cell::gradient(double t, double* F, double* rate) const {
  std::fill_n(F, dim_ * dim_, 0.0);
  std::fill_n(rate, dim_ * dim_, 0.0);
  for (int k = 0; k < dim_; ++k) F[k * dim_ + k] = 1;
  for (const Component& one : components_) {
    double v = 0;
    F[one.row * dim_ + one.column] += given_at(one.drive, time_of(t), &v);
    rate[one.row * dim_ + one.column] += at_rest_ ? 0.0 : v;
  }
  for (const Free& one : free_) F[one.row * dim_ + one.column] += one.strain;
}

std::vector<FreeStrain> Cell::free_strains(double t) const {
  std::vector<FreeStrain> all;
  for (const Free& one : free_) all.push_back({one.row, one.column, one.strain, given_at(one.stress, time_of(t), nullptr)});
  return all;
}

void Cell::set_free_strains(const std::vector<double>& strains) {
  for (std::size_t k = 0; k < free_.size(); ++k) free_[k].strain = strains[k];
}

void Cell::keep(const Keeper& keep) {
  for (Free& one : free_) keep(saved_name(one.row, one.column), one.strain);
  if (keep.restores()) keep_strains();
}

void Cell::edges(double t, double* edges, double* rates) const {
  double F[9], G[9];
  gradient(t, F, G);
  for (int k = 0; k < dim_; ++k)
    for (int r = 0; r < dim_; ++r) {
      double e = 0, v = 0;
      for (int c = 0; c < dim_; ++c) {
        const double E = box_.edges[static_cast<std::size_t>(k * dim_ + c)];
        e += F[r * dim_ + c] * E;
        v += G[r * dim_ + c] * E;
      }
      edges[k * dim_ + r] = e;
      if (rates) rates[k * dim_ + r] = v;
    }
}

void Cell::velocity_gradient(double t, double* L) const {
  double F[9], G[9], inverse[9];
  gradient(t, F, G);
  // F has rows where edges have columns: both are inverted alike
  if (invert_edges(F, dim_, inverse)) multiply(dim_, G, inverse, L);
  else std::fill_n(L, dim_ * dim_, 0.0);
}

void Cell::carried(double from, double to, double* A) const {
  double F[9], before[9], rate[9], inverse[9];
  gradient(to, F, rate);
  gradient(from, before, rate);
  for (const Free& one : free_) before[one.row * dim_ + one.column] += one.kept - one.strain;
  std::fill_n(A, dim_ * dim_, 0.0);
  for (int k = 0; k < dim_; ++k) A[k * dim_ + k] = 1;
  if (!std::equal(F, F + dim_ * dim_, before) && invert_edges(before, dim_, inverse)) multiply(dim_, F, inverse, A);
}

double Cell::volume(double t) const {
  double e[9];
  edges(t, e, nullptr);
  return box_volume(e, dim_);
}

void Cell::shift_images(double t, double sign, bool velocities, double* states) const {
  double e[9], rate[9];
  const Layout layout{dim_};
  if (images_.empty()) return;
  edges(t, e, rate);
  for (const PetscInt i : images_) {
    double *x = layout.of(states, i), *v = x + layout.v(0);
    const int* s = net_->image.data() + static_cast<std::size_t>(i - net_->n) * static_cast<std::size_t>(dim_);
    for (int c = 0; c < dim_; ++c)
      for (int k = 0; k < dim_; ++k) {
        x[c] += sign * s[k] * e[k * dim_ + c];
        if (velocities) v[c] += s[k] * rate[k * dim_ + c];
      }
  }
}

std::vector<std::string> Cell::describe() const {
  std::vector<std::string> lines;
  if (!box_.active()) return lines;
  std::string edges, along;
  for (int k = 0; k < dim_; ++k) {
    edges += k ? "; " : "";
    for (int c = 0; c < dim_; ++c) edges += format(c ? ", %g" : "%g", box_.edges[static_cast<std::size_t>(k * dim_ + c)]);
    if (box_.periodic[k]) along += (along.empty() ? "" : ", ") + std::to_string(k + 1);
  }
  lines.push_back("periodic box along edge " + along + " of (" + edges + ") m");
  for (const Component& one : components_) lines.push_back("box strain " + component_name(one.row, one.column) + ": " + one.drive.text().substr(2));
  for (const Free& one : free_)
    lines.push_back("box stress " + component_name(one.row, one.column) + ": " + one.stress.text().substr(2) + ", its strain is free");
  return lines;
}

namespace {

/// (3, 3) of (d, d): nothing changes along what is not there.
void pad(const double* F, int d, double* out) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[3 * r + c] = r < d && c < d ? F[r * d + c] : r == c ? 1 : 0;
}

}  // namespace

PetscErrorCode Cell::reaches(double t_end) const {
  PetscFunctionBegin;
  for (const Component& one : components_) PetscCall(check_reach(net_->comm, "-bs_box_strain", one.drive, t_end, at_rest_));
  for (const Free& one : free_) PetscCall(check_reach(net_->comm, "-bs_box_stress", one.stress, t_end, at_rest_));
  PetscFunctionReturn(0);
}

PetscErrorCode Cell::follow(double t, Vec y) const {
  const PetscInt d = dim_;
  const Layout at{d, net_->n};
  double F[9], rate[9], L[9];
  PetscFunctionBegin;
  if (!moving()) PetscFunctionReturn(0);
  gradient(t, F, rate);
  velocity_gradient(t, L);
  const WriteArray ay(y);
  for (PetscInt i = 0; i < net_->n; ++i) {
    if (net_->fixed[i]) continue;
    const double* const x0 = net_->held.data() + i * d;
    double *const x = ay.data() + at.x(i), *const v = ay.data() + at.v(i);
    for (PetscInt r = 0; r < d; ++r) {
      x[r] = 0;
      for (PetscInt c = 0; c < d; ++c) x[r] += F[r * d + c] * x0[c];
    }
    for (PetscInt r = 0; r < d; ++r)
      for (PetscInt c = 0; c < d; ++c) v[r] += L[r * d + c] * x[c];
  }
  PetscFunctionReturn(0);
}

// An image moves with v + sum of s_k e_k', but a fluid with the same velocity everywhere has none: the drag would depend on which image of a particle
// the lattice happens to have.
void Cell::find_drag(double t, Error* fault) const {
  double F[9], rate[9];
  if (drag_.empty()) return;
  gradient(t, F, rate);
  if (std::all_of(rate, rate + dim_ * dim_, [](double v) { return v == 0; })) return;
  fault->note(-1,
              format("option -bs_box_strain: the box flows at t = %.10g s, and the fluid of the %s does not, so that images of one particle would "
                     "feel unlike drag: give springs damping instead, or a force of your own against v - F' F^-1 x, or strain the box by "
                     "-bs_task statics",
                     t, drag_.c_str()));
}

void Cell::list_drives(std::vector<Drive*>* all) {
  for (Component& one : components_) all->push_back(&one.drive);
}

void Cell::find_jumps(double from, double to, Error* fault) const {
  const double zero[3] = {0, 0, 0};
  if (at_rest_ || !(to > from)) return;
  if (!*fault) find_drag(to, fault);
  for (const Component& one : components_) {
    const double at = one.drive.jump(from, to, zero);
    if (!std::isnan(at))
      fault->note(-1,
                  format("option -bs_box_strain: %s jumps at t = %.10g s, where its rate would be infinite: give a ramp (velocity:RATE, table:FILE "
                         "or an expression), or apply it as a load by -bs_task statics",
                         component_name(one.row, one.column).c_str(), at));
  }
}

// On the straight way from F(from) to F(to) some F has no volume where A = F(to) F(from)^-1 has an eigenvalue -m, m >= 0:
//   det(A + m I) = m^3 + tr A m^2 + (sum of the minors of A) m + det A = 0,
// whose least value over m >= 0 is at 0 or at its minimum.
bool Cell::collapses(double from, double to) const {
  constexpr double NOTHING = 1e-12;  // of a volume: below it rounding errors of F are large
  double F[9], rate[9], last[9], next[9], inverse[9], A[9];
  gradient(to, F, rate);
  pad(F, dim_, next);
  gradient(from, F, rate);
  pad(F, dim_, last);
  if (to > from && invert_edges(last, 3, inverse)) multiply(3, next, inverse, A);
  else std::copy_n(next, 9, A);
  const auto minor = [&](int p, int q) { return A[4 * p] * A[4 * q] - A[3 * p + q] * A[3 * q + p]; };
  const double trace = A[0] + A[4] + A[8], minors = minor(0, 1) + minor(1, 2) + minor(0, 2);
  const double det = A[0] * minor(1, 2) - A[1] * (A[3] * A[8] - A[5] * A[6]) + A[2] * (A[3] * A[7] - A[4] * A[6]);
  const double square = trace * trace - 3 * minors, m = square > 0 ? std::max(0.0, (std::sqrt(square) - trace) / 3) : 0;
  const double least = std::min(det, ((m + trace) * m + minors) * m + det);
  double e[9];
  edges(to, e, nullptr);
  return !(least > NOTHING) || !invert_edges(e, dim_, inverse);
}

void Cell::foresee(double from, double to, Error* fault) const {
  const char* const unit = at_rest_ ? ", the load factor" : " s";
  const auto check = [&](const Drive& drive, const char* option, int row, int column) {
    double v = 0;
    if (!std::isfinite(given_at(drive, time_of(to), &v)) || (!at_rest_ && !std::isfinite(v)))
      fault->note(-1, format("option %s: %s or its rate is not finite at t = %.10g%s: give one that is finite from the start to the end of the run",
                             option, component_name(row, column).c_str(), to, unit));
  };
  for (const Component& one : components_) check(one.drive, "-bs_box_strain", one.row, one.column);
  for (const Free& one : free_) check(one.stress, "-bs_box_stress", one.row, one.column);
  find_jumps(from, to, fault);
  if (!*fault && collapses(from, to))
    fault->note(-1, (to > from ? format("the periodic box has no volume left on the way from t = %.10g to t = %.10g%s", from, to, unit)
                               : format("the periodic box has no volume at t = %.10g%s", to, unit)) +
                        ": give smaller strains by -bs_box_strain or -bs_box_rate, or end the run earlier");
}

}  // namespace bs
