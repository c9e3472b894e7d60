#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "output/tables.hpp"

namespace bs {

namespace {

/// Place of the first of `count` numbers that is not finite; `count`: all are.
PetscInt first_not_finite(const double* values, PetscInt count) {
  // a sum of zeros is finite only if its factors are: no branch in the loop
  double sum = 0;
  for (PetscInt i = 0; i < count; ++i) sum += 0.0 * values[i];
  if (std::isfinite(sum)) return count;
  return static_cast<PetscInt>(std::find_if_not(values, values + count, [](double value) { return std::isfinite(value); }) - values);
}

const char* in_words(double value) { return std::isnan(value) ? "not a number" : "infinite"; }

void note(const std::string& name, std::int64_t row, double value, Error* fault) {
  fault->note(row, format("%s is %s in row %lld", name.c_str(), in_words(value), static_cast<long long>(row)), Exit::solve);
}

/// Of this rank's rows. `gaps`: NaN may stand there.
PetscErrorCode check_vector(const std::string& name, Vec vec, bool gaps, Error* fault) {
  PetscInt n, first, block;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(vec, &n));
  PetscCall(VecGetBlockSize(vec, &block));
  PetscCall(VecGetOwnershipRange(vec, &first, nullptr));
  const ReadArray values(vec);
  PetscInt at = first_not_finite(values, n);
  if (gaps) at = static_cast<PetscInt>(std::find_if(values + at, values + n, [](double value) { return std::isinf(value); }) - values);
  if (at < n) note(name, (first + at) / block, values[at], fault);
  PetscFunctionReturn(0);
}

/// Of a field whose rows come from a source, piece by piece.
PetscErrorCode check_rows(const Field& field, Error* fault) {
  constexpr PetscInt piece = 20000;  // rows, which stay in the processor's cache
  PetscInt n, first, block;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(field.vec, &n));
  PetscCall(VecGetBlockSize(field.vec, &block));
  PetscCall(VecGetOwnershipRange(field.vec, &first, nullptr));
  std::vector<double> rows(static_cast<std::size_t>(std::min(piece, n / block) * block));
  for (PetscInt row = 0; row < n / block; row += piece) {
    const PetscInt count = std::min(piece, n / block - row);
    PetscCall(field.source(row, count, rows.data()));
    const PetscInt at = first_not_finite(rows.data(), count * block);
    if (at < count * block) note(field.group, first / block + row + at / block, rows[static_cast<std::size_t>(at)], fault);
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode find_not_finite(MPI_Comm comm, const std::vector<Field>& fields, const std::vector<Observable>& observables, std::string* what) {
  Error fault;
  PetscFunctionBegin;
  for (const Field& field : fields) {
    if (field.source) PetscCall(check_rows(field, &fault));
    else PetscCall(check_vector(field.group, field.vec, field.gaps, &fault));
  }
  PetscCall(first_error(comm, fault, what));
  for (const Observable& o : observables)  // the same on every rank
    for (const double value : o.value)
      if (what->empty() && !std::isfinite(value)) *what = format("%s is %s", o.name.c_str(), in_words(value));
  PetscFunctionReturn(0);
}

PetscErrorCode require_finite(MPI_Comm comm, const Dataset& table) {
  Error fault;
  PetscFunctionBegin;
  if (const auto* values = std::get_if<std::vector<double>>(&table.rows); values && !table.gaps) {
    const PetscInt at = first_not_finite(values->data(), static_cast<PetscInt>(values->size())), columns = std::max(1, table.columns);
    if (at < static_cast<PetscInt>(values->size())) note(table.path, table.first + at / columns, (*values)[static_cast<std::size_t>(at)], &fault);
  }
  if (fault) fault.text += ": it is not written";
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode require_finite(MPI_Comm comm, const std::string& name, Vec vec) {
  Error fault;
  PetscFunctionBegin;
  PetscCall(check_vector(name, vec, false, &fault));
  if (fault) fault.text += ": it is not written";
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
