#include "systems/particles/cell.hpp"

#include <algorithm>

#include "base/fault.hpp"

namespace bs {

/// Of a sum in a checkpoint.
static std::string saved_name(int row, int column) { return "box_strain_" + component_name(row, column); }

void Cell::create(const Network& net) {
  net_ = &net;
  for (PetscInt g = 0; g < net.ghosts; ++g)
    for (int k = 0; k < dim_; ++k)
      if (net.image[static_cast<std::size_t>(g * dim_ + k)] != 0) {
        images_.push_back(net.n + g);
        break;
      }
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
  const double zero[3] = {0, 0, 0};
  std::fill_n(F, dim_ * dim_, 0.0);
  std::fill_n(rate, dim_ * dim_, 0.0);
  for (int k = 0; k < dim_; ++k) F[k * dim_ + k] = 1;
  for (const Component& one : components_) {
    double g[3] = {0, 0, 0}, v[3] = {0, 0, 0}, a[3] = {0, 0, 0};
    one.drive.at(full_load_ ? 1.0 : t, zero, g, v, a);
    F[one.row * dim_ + one.column] += g[0];
    rate[one.row * dim_ + one.column] += at_rest_ ? 0.0 : v[0];
  }
  for (const Free& one : free_) F[one.row * dim_ + one.column] += one.strain;
}

std::vector<FreeStrain> Cell::free_strains(double t) const {
  const double zero[3] = {0, 0, 0};
  std::vector<FreeStrain> all;
  for (const Free& one : free_) {
    double stress[3] = {0, 0, 0}, v[3] = {0, 0, 0}, a[3] = {0, 0, 0};
    one.stress.at(full_load_ ? 1.0 : t, zero, stress, v, a);
    all.push_back({one.row, one.column, one.strain, stress[0]});
  }
  return all;
}

void Cell::set_free_strains(const std::vector<double>& strains) {
  for (std::size_t k = 0; k < free_.size(); ++k) free_[k].strain = strains[k];
}

void Cell::save(std::map<std::string, double>* sums) const {
  for (const Free& one : free_) (*sums)[saved_name(one.row, one.column)] = one.strain;
}

void Cell::restore(const std::map<std::string, double>& sums) {
  for (Free& one : free_) {
    const auto at = sums.find(saved_name(one.row, one.column));
    one.strain = at == sums.end() ? 0 : at->second;
  }
  keep_strains();
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
  std::fill_n(L, dim_ * dim_, 0.0);
  if (!invert_edges(F, dim_, inverse)) return;  // F has rows where edges have columns: both are inverted alike
  for (int r = 0; r < dim_; ++r)
    for (int c = 0; c < dim_; ++c)
      for (int k = 0; k < dim_; ++k) L[r * dim_ + c] += G[r * dim_ + k] * inverse[k * dim_ + c];
}

void Cell::carried(double from, double to, double* A) const {
  double F[9], before[9], rate[9], inverse[9];
  gradient(to, F, rate);
  gradient(from, before, rate);
  for (const Free& one : free_) before[one.row * dim_ + one.column] += one.kept - one.strain;
  std::fill_n(A, dim_ * dim_, 0.0);
  for (int k = 0; k < dim_; ++k) A[k * dim_ + k] = 1;
  if (std::equal(F, F + dim_ * dim_, before) || !invert_edges(before, dim_, inverse)) return;
  for (int r = 0; r < dim_; ++r)
    for (int c = 0; c < dim_; ++c) {
      A[r * dim_ + c] = 0;
      for (int k = 0; k < dim_; ++k) A[r * dim_ + c] += F[r * dim_ + k] * inverse[k * dim_ + c];
    }
}

double Cell::volume(double t) const {
  double e[9];
  edges(t, e, nullptr);
  return box_volume(e, dim_);
}

void Cell::shift_images(double t, double sign, bool velocities, double* states) const {
  double e[9], rate[9];
  edges(t, e, rate);
  for (const PetscInt i : images_) {
    double* y = states + static_cast<std::size_t>(i) * 2 * static_cast<std::size_t>(dim_);
    const int* s = net_->image.data() + static_cast<std::size_t>(i - net_->n) * static_cast<std::size_t>(dim_);
    for (int c = 0; c < dim_; ++c)
      for (int k = 0; k < dim_; ++k) {
        y[c] += sign * s[k] * e[k * dim_ + c];
        if (velocities) y[dim_ + c] += s[k] * rate[k * dim_ + c];
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

}  // namespace bs
