// What error control needs to know of a linear system: the states it can judge, and where it cannot go on.
#include <algorithm>
#include <cmath>
#include <vector>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "systems/linear/linear_model.hpp"
#include "systems/linear/system.hpp"

namespace bs {

/// Of C's columns that are not empty.
PetscErrorCode LinearModel::mark_differential(Vec* marks) {
  PetscInt first, last, n;
  PetscScalar marked;
  std::vector<PetscInt> columns;
  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(system_.C, &first, &last));
  for (PetscInt i = first; i < last; ++i) PetscCall(each_nonzero(system_.C, i, [&](PetscInt j, double) { columns.push_back(j); }));
  std::sort(columns.begin(), columns.end());
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  PetscCall(VecDuplicate(system_.x0, marks));
  PetscCall(VecZeroEntries(*marks));
  for (const PetscInt j : columns) PetscCall(VecSetValue(*marks, j, 1, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(*marks));
  PetscCall(VecAssemblyEnd(*marks));
  PetscCall(VecGetSize(*marks, &n));
  PetscCall(VecSum(*marks, &marked));
  if (static_cast<PetscInt>(std::lround(marked)) == n) PetscCall(VecDestroy(marks));
  PetscFunctionReturn(0);
}

/// A source that jumps just after t takes unknowns along: however short a step is, they change as much. A change that halved intervals keep is a
/// jump.
PetscErrorCode LinearModel::advice(double t, std::string* text) {
  constexpr double NEAR = 1e-6, JUMP = 0.5;
  constexpr int HALVINGS = 30;
  PetscInt first, last;
  std::string mine;
  PetscFunctionBegin;
  text->clear();
  if (!system_.B) PetscFunctionReturn(0);
  PetscCall(VecGetOwnershipRange(u_, &first, &last));
  for (PetscInt k = first; k < last && mine.empty(); ++k) {
    const auto column = static_cast<std::size_t>(k), own = static_cast<std::size_t>(k - first);
    const auto change = [&](double from, double to) { return std::abs(sources_.at(column, to) - sources_.before(column, from)); };
    double from = t - NEAR * std::abs(t), to = t + NEAR * std::abs(t);
    const double whole = change(from, to);
    for (int halving = 0; halving < HALVINGS; ++halving) {
      const double middle = 0.5 * (from + to);
      (change(from, middle) > change(middle, to) ? to : from) = middle;
    }
    if (whole == 0 || change(from, to) < JUMP * whole) continue;
    const std::string name = own < system_.source_labels.size() ? system_.source_labels[own] : format("source %lld", static_cast<long long>(k) + 1);
    mine =
        format("%s jumps at t = %.7g s, and states with it whatever the step is: give it a rise time, or take constant steps (-ts_adapt_type none)",
               name.c_str(), to);
  }
  PetscCall(first_error(comm_, Error{0, mine, Exit::solve}, text));
  PetscFunctionReturn(0);
}

}  // namespace bs
