#include "linalg/sparse_blocks.hpp"
#include <algorithm>

namespace bs {

void SparseBlocks::create(PetscInt n, int d, const std::vector<std::pair<PetscInt, PetscInt>>& joins) {
  std::vector<std::pair<PetscInt, PetscInt>> sorted = joins;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  n_ = n;
  d_ = static_cast<std::size_t>(d);
  area_ = d_ * d_;
  start_.assign(static_cast<std::size_t>(n) + 1, 0);
  column_.clear();
  for (const auto& [i, j] : sorted) {
    ++start_[i + 1];
    column_.push_back(j);
  }
  for (PetscInt i = 0; i < n; ++i) start_[i + 1] += start_[i];
  value_.assign(column_.size() * area_, 0.0);
}

PetscInt SparseBlocks::find(PetscInt i, PetscInt j) const {
  const auto begin = column_.begin() + start_[i], end = column_.begin() + start_[i + 1];
  return static_cast<PetscInt>(std::lower_bound(begin, end, j) - column_.begin());
}

void SparseBlocks::zero() { std::fill(value_.begin(), value_.end(), 0.0); }

void SparseBlocks::scale_rows(const std::vector<double>& scale) {
  for (PetscInt i = 0; i < n_; ++i)
    for (std::size_t k = start_[i] * area_; k < start_[i + 1] * area_; ++k) value_[k] *= scale[i];
}

template <int d>
void SparseBlocks::multiply(const double* owned, const double* ghosts, double* y) const {
  for (PetscInt i = 0; i < n_; ++i) {
    double sum[d];
    std::copy_n(y + i * d, d, sum);
    for (PetscInt k = start_[i]; k < start_[i + 1]; ++k) {
      const PetscInt j = column_[k];
      const double *p = j < n_ ? owned + j * d : ghosts + (j - n_) * d, *A = value_.data() + static_cast<std::size_t>(k) * area_;
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c) sum[r] += A[r * d + c] * p[c];
    }
    std::copy_n(sum, d, y + i * d);
  }
}

void SparseBlocks::multiply_add(const double* owned, const double* ghosts, double* y) const {
  if (d_ == 1) multiply<1>(owned, ghosts, y);
  else if (d_ == 2) multiply<2>(owned, ghosts, y);
  else multiply<3>(owned, ghosts, y);
}

void SparseBlocks::add_diagonal(std::vector<double>* blocks) const {
  for (PetscInt i = 0; i < n_; ++i)
    for (PetscInt k = start_[i]; k < start_[i + 1]; ++k)
      for (std::size_t c = 0; column_[k] == i && c < area_; ++c) (*blocks)[i * area_ + c] += value_[k * area_ + c];
}

void SparseBlocks::add_to_panel(PetscInt i, const std::vector<PetscInt>& global, const PetscInt* columns, PetscInt count, PetscInt stride,
                                double* panel) const {
  for (PetscInt k = start_[i]; k < start_[i + 1]; ++k) {
    const PetscInt slot = static_cast<PetscInt>(std::lower_bound(columns, columns + count, global[column_[k]]) - columns);
    for (std::size_t r = 0; r < d_; ++r)
      for (std::size_t c = 0; c < d_; ++c) panel[r * count * stride + slot * stride + c] += value_[k * area_ + r * d_ + c];
  }
}

}  // namespace bs
