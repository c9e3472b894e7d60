// Blocks of S, those on its diagonal above all.
#include <algorithm>
#include <cmath>
#include <limits>
#include "systems/particles/condensed/spring_product.hpp"
#include "systems/particles/supports.hpp"

namespace bs {

void SpringMatrix::hold_block(PetscInt i, PetscInt j, double* block) const {
  if (!net_->supports || !net_->supports->rolls()) return;
  const std::uint8_t rows = net_->supports->rolling(net_->global[i]), columns = net_->supports->rolling(net_->global[j]);
  for (int r = 0; r < dim_; ++r)
    for (int c = 0; c < dim_; ++c) {
      if (!((rows >> r & 1) || (columns >> c & 1))) continue;
      block[r * dim_ + c] = i == j && r == c ? Supports::on_diagonal(inertia_, net_->mass[i]) : 0;
    }
}

namespace {

/// The pairs' part of the diagonal blocks.
template <int d>
void add_pairs(const SpringMatrix& S, double* out) {
  constexpr int area = d * d;
  const SpringPattern& pattern = S.pattern();
  double B[area];
  const auto add = [&](PetscInt i) {
    double* to = out + static_cast<std::size_t>(i) * area;
    for (int c = 0; c < area; ++c) to[c] += B[c];
  };
  for (PetscInt i = 0; i < pattern.n; ++i)
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) {
      write_block<d>(S.pair(static_cast<std::size_t>(k)), B);
      add(i);
      add(pattern.other[k]);
    }
  for (std::size_t r = 0; r < pattern.cut_row.size(); ++r)
    for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k) {
      write_block<d>(S.cut(static_cast<std::size_t>(k)), B);
      add(pattern.cut_row[r]);
    }
}

}  // namespace

void SpringMatrix::diagonal_blocks(std::vector<double>* out) const {
  out->assign(node_.begin(), node_.end());
  if (dim_ == 1) add_pairs<1>(*this, out->data());
  else if (dim_ == 2) add_pairs<2>(*this, out->data());
  else add_pairs<3>(*this, out->data());
  if (remainder_.created()) remainder_.add_diagonal(out);
  if (net_->supports && net_->supports->rolls())
    for (PetscInt i = 0; i < pattern_.n; ++i) hold_block(i, i, out->data() + static_cast<std::size_t>(i) * area_);
}

PetscErrorCode SpringMatrix::diagonal(Vec out) const {
  PetscScalar* a = nullptr;
  std::vector<double> blocks;
  PetscFunctionBegin;
  diagonal_blocks(&blocks);
  PetscCall(VecGetArrayWrite(out, &a));
  for (PetscInt i = 0; i < pattern_.n; ++i)
    for (int c = 0; c < dim_; ++c) a[i * dim_ + c] = blocks[i * area_ + c * (dim_ + 1)];
  PetscCall(VecRestoreArrayWrite(out, &a));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::size_ratio(const std::vector<double>& blocks, double* ratio) const {
  double ends[2] = {-std::numeric_limits<double>::max(), 0};  // minus the smallest, the largest
  PetscFunctionBegin;
  for (PetscInt i = 0; i < pattern_.n; ++i) {
    if (net_->fixed[i]) continue;  // tied to nothing
    double size = 0;
    for (int c = 0; c < dim_; ++c) size = std::max(size, std::abs(blocks[i * area_ + c * (dim_ + 1)]));
    ends[0] = std::max(ends[0], -size);
    ends[1] = std::max(ends[1], size);
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, ends, 2, MPI_DOUBLE, MPI_MAX, net_->comm));
  *ratio = -ends[1] / ends[0];
  PetscFunctionReturn(0);
}

}  // namespace bs
