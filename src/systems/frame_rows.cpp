#include "systems/frame_rows.hpp"
#include <algorithm>
#include <variant>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "systems/system.hpp"

namespace bs {

PetscErrorCode own_numbers(Vec vec, std::vector<double>* numbers) {
  PetscInt size = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(vec, &size));
  const ReadArray a(vec);
  numbers->assign(a.data(), a + size);
  PetscFunctionReturn(0);
}

PetscErrorCode sum_by_rows(MPI_Comm comm, std::int64_t count, const std::vector<std::pair<std::int64_t, double>>& parts, std::vector<double>* own) {
  VecHandle sums;
  PetscFunctionBegin;
  PetscCall(create_vec(comm, static_cast<PetscInt>(count), 1, sums.out()));
  for (const auto& [row, part] : parts) PetscCall(VecSetValue(sums, static_cast<PetscInt>(row), part, ADD_VALUES));
  PetscCall(VecAssemblyBegin(sums));
  PetscCall(VecAssemblyEnd(sums));
  PetscCall(own_numbers(sums, own));
  PetscFunctionReturn(0);
}

/// This rank's rows of a field, and how many columns it has.
static PetscErrorCode own_rows(const Field& field, PetscInt* columns, std::vector<double>* rows) {
  PetscInt size = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(field.vec, &size));
  PetscCall(VecGetBlockSize(field.vec, columns));
  rows->resize(static_cast<std::size_t>(size));
  if (field.source) PetscCall(field.source(0, size / *columns, rows->data()));
  else PetscCall(own_numbers(field.vec, rows));
  PetscFunctionReturn(0);
}

PetscErrorCode frame_rows(System& system, double t, Vec y, const std::string& name, std::vector<double>* rows) {
  std::vector<Field> fields;
  PetscInt columns = 1;
  PetscFunctionBegin;
  PetscCall(system.fields(t, y, &fields));
  for (const Field& field : fields) {
    if (!ends_with(field.group, name)) continue;
    PetscCall(own_rows(field, &columns, rows));
    PetscFunctionReturn(0);
  }
  SETERRQ(system.comm(), PETSC_ERR_ARG_WRONG, "%s has no field %s", system.name(), name.c_str());
}

/// They are laid into the places of the state's positions, from which they travel to the input's order.
PetscErrorCode rows_of_particles(System& system, Vec y, const double* numbers, std::vector<double>* rows) {
  VecHandle places;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, places.out()));
  PetscCall(VecZeroEntries(places));
  set_half(places, StateHalf::position, numbers);
  PetscCall(system.gather_state(places, &parts));
  PetscCall(own_numbers(parts[0].vec, rows));
  PetscFunctionReturn(0);
}

PetscErrorCode read_tables(System& system, double t, Vec y, std::vector<FrameTable>* out) {
  std::vector<Field> fields;
  PetscFunctionBegin;
  PetscCall(system.fields(t, y, &fields));
  out->clear();
  for (const Field& field : fields) {
    if (field.drawing) continue;
    PetscInt columns = 1;
    FrameTable table;
    std::vector<double> rows;
    table.name = field.group.substr(field.group.rfind('/') + 1);
    PetscCall(own_rows(field, &columns, &rows));
    table.columns = static_cast<int>(columns);
    PetscCall(gather_all(system.comm(), std::move(rows), &table.value));
    out->push_back(std::move(table));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode read_breaks(System& system, std::vector<FrameTable>* out) {
  std::vector<Dataset> lists;
  PetscFunctionBegin;
  out->clear();
  if (system.breaks()) PetscCall(system.breaks()->tables(&lists));
  for (const Dataset& list : lists) {
    FrameTable table;
    const std::string events = "/events/", springs = events + "broken/";
    table.name = list.path.substr(list.path.rfind(springs, 0) == 0 ? springs.size() : events.size());
    table.columns = std::max(list.columns, 1);
    std::vector<double> own;  // of the first rank, which holds them all
    if (const auto* reals = std::get_if<std::vector<double>>(&list.rows)) own = *reals;
    else if (const auto* whole = std::get_if<std::vector<std::int64_t>>(&list.rows)) own.assign(whole->begin(), whole->end());
    PetscCall(gather_all(system.comm(), std::move(own), &table.value));
    out->push_back(std::move(table));
  }
  PetscFunctionReturn(0);
}

/// The one of that name, or null.
template <class Named>
static const Named* named(const std::vector<Named>& all, const std::string& name) {
  for (const Named& one : all)
    if (one.name == name) return &one;
  return nullptr;
}

const Observable* FrameData::observable(const std::string& name) const { return named(observables, name); }

const FrameTable* FrameData::table(const std::string& name) const { return named(tables, name); }

}  // namespace bs
