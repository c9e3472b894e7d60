#include "systems/particles/body_places.hpp"
#include <algorithm>
#include "network/ghost_copies.hpp"
#include "systems/particles/free_bodies.hpp"

namespace bs {

PetscErrorCode BodyPlaces::create(const Network& net) {
  GhostCopies copies;
  std::vector<double> label;
  ISHandle from;
  PetscFunctionBegin;
  net_ = &net;
  PetscCall(copies.create(net));
  PetscCall(label_bodies(net, &copies, &label));
  const std::vector<std::uint8_t> held = held_axes(net);
  std::vector<PetscInt> labels;
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i]) labels.push_back(static_cast<PetscInt>(label[static_cast<std::size_t>(i)]));
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  const PetscInt count = static_cast<PetscInt>(labels.size());
  body_.assign(static_cast<std::size_t>(net.n), -1);
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i])
      body_[static_cast<std::size_t>(i)] = static_cast<PetscInt>(
          std::lower_bound(labels.begin(), labels.end(), static_cast<PetscInt>(label[static_cast<std::size_t>(i)])) - labels.begin());
  PetscCall(VecDuplicate(copies.layout(), whole_.out()));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, count, mine_.out()));
  PetscCall(ISCreateGeneral(net.comm, count, labels.data(), PETSC_COPY_VALUES, from.out()));
  PetscCall(VecScatterCreate(whole_, from, mine_, nullptr, scatter_.out()));
  mass_.assign(labels.size(), 0.0);
  held_.assign(labels.size(), 0);
  for (PetscInt i = 0; i < net.n; ++i)
    if (body_[i] >= 0) mass_[body_[i]] += net.mass[i];
  PetscCall(add_up(&mass_));
  int any = 0;
  for (int c = 0; c < net.dim; ++c) {
    std::vector<double> holds(labels.size(), 0.0);
    for (PetscInt i = 0; i < net.n; ++i)
      if (body_[i] >= 0) holds[body_[i]] += held[i] >> c & 1;
    PetscCall(add_up(&holds));
    for (std::size_t b = 0; b < holds.size(); ++b) {
      if (holds[b] > 0) held_[b] = static_cast<std::uint8_t>(held_[b] | 1 << c);
      else any = 1;
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_LOR, net.comm));
  any_ = any != 0;
  PetscFunctionReturn(0);
}

/// values: of each body of this rank; on return the sums over all ranks that have a part of it, always in the same order.
PetscErrorCode BodyPlaces::add_up(std::vector<double>* values) const {
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(mine_, &a));
  std::copy(values->begin(), values->end(), a);
  PetscCall(VecRestoreArrayWrite(mine_, &a));
  PetscCall(VecZeroEntries(whole_));
  PetscCall(VecScatterBegin(scatter_, mine_, whole_, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(scatter_, mine_, whole_, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterBegin(scatter_, whole_, mine_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter_, whole_, mine_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayWrite(mine_, &a));
  std::copy_n(a, values->size(), values->begin());
  PetscCall(VecRestoreArrayWrite(mine_, &a));
  PetscFunctionReturn(0);
}

// off = sum of m (x_to - A x_from) / sum of m
PetscErrorCode BodyPlaces::pull_back(const double* A, double h, Vec from, Vec to) const {
  const int d = net_->dim;
  const PetscInt n = net_->n;
  const PetscScalar* start = nullptr;
  PetscScalar* end = nullptr;
  PetscFunctionBegin;
  if (!any_) PetscFunctionReturn(0);
  std::vector<std::vector<double>> off(static_cast<std::size_t>(d), std::vector<double>(mass_.size(), 0.0));
  PetscCall(VecGetArrayRead(from, &start));
  PetscCall(VecGetArray(to, &end));
  for (PetscInt i = 0; i < n; ++i)
    for (int r = 0; r < d && body_[i] >= 0; ++r) {
      double carried = 0;
      for (int c = 0; c < d; ++c) carried += A[r * d + c] * start[i * 2 * d + c];
      off[r][body_[i]] += net_->mass[i] * (end[i * 2 * d + r] - carried);
    }
  for (int r = 0; r < d; ++r) {
    PetscCall(add_up(&off[r]));
    for (std::size_t b = 0; b < mass_.size(); ++b) off[r][b] = held_[b] >> r & 1 ? 0 : off[r][b] / mass_[b];
  }
  for (PetscInt i = 0; i < n; ++i)
    for (int r = 0; r < d && body_[i] >= 0; ++r) {
      end[i * 2 * d + r] -= off[r][body_[i]];
      end[i * 2 * d + d + r] -= off[r][body_[i]] / h;
    }
  PetscCall(VecRestoreArray(to, &end));
  PetscCall(VecRestoreArrayRead(from, &start));
  PetscFunctionReturn(0);
}

}  // namespace bs
