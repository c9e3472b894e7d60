#include "systems/particles/condensed/coarse_blocks.hpp"
#include "base/gather_all.hpp"
#include "base/long_sum.hpp"

namespace bs {

void CoarseBlocks::create(PetscInt nodes, std::vector<PetscInt> differences, std::size_t width) {
  nodes_ = nodes;
  width_ = width;
  difference_ = std::move(differences);
  slot_.assign(difference_.empty() ? 0 : static_cast<std::size_t>(difference_.back()) + 1, -1);
  for (std::size_t k = 0; k < difference_.size(); ++k) slot_[static_cast<std::size_t>(difference_[k])] = static_cast<PetscInt>(k);
  near_.assign(static_cast<std::size_t>(nodes) * difference_.size() * width, 0.0);
  far_.clear();
}

double* CoarseBlocks::far(PetscInt a, PetscInt b) {
  std::vector<double>& numbers = far_[{a, b}];
  if (numbers.empty()) numbers.assign(width_, 0.0);
  return numbers.data();
}

PetscErrorCode CoarseBlocks::sum(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscCall(sum_over_ranks(comm, near_.data(), near_.size()));
  PetscCall(sum_far(comm));
  PetscFunctionReturn(0);
}

/// Every rank gets all far blocks and adds them in the order of the ranks.
PetscErrorCode CoarseBlocks::sum_far(MPI_Comm comm) {
  PetscMPIInt ranks;
  std::vector<double> own, all;  // ends, numbers
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  if (ranks == 1) PetscFunctionReturn(0);
  for (const auto& [ends, numbers] : far_) {
    own.push_back(static_cast<double>(ends.first));
    own.push_back(static_cast<double>(ends.second));
    own.insert(own.end(), numbers.begin(), numbers.end());
  }
  PetscCall(gather_all(comm, own, &all));
  far_.clear();
  for (std::size_t k = 0; k < all.size(); k += 2 + width_) {
    double* to = far(static_cast<PetscInt>(all[k]), static_cast<PetscInt>(all[k + 1]));
    for (std::size_t m = 0; m < width_; ++m) to[m] += all[k + 2 + m];
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
