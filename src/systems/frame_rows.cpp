#include "systems/frame_rows.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"

namespace bs {

PetscErrorCode own_numbers(Vec vec, std::vector<double>* numbers) {
  PetscInt size = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(vec, &size));
  const ReadArray a(vec);
  numbers->assign(a.data(), a + size);
  PetscFunctionReturn(0);
}

PetscErrorCode frame_rows(System& system, double t, Vec y, const std::string& name, std::vector<double>* rows) {
  std::vector<Field> fields;
  PetscFunctionBegin;
  PetscCall(system.fields(t, y, &fields));
  for (const Field& field : fields) {
    if (!ends_with(field.group, name)) continue;
    PetscInt size = 0, width = 1;
    PetscCall(VecGetLocalSize(field.vec, &size));
    PetscCall(VecGetBlockSize(field.vec, &width));
    rows->resize(static_cast<std::size_t>(size));
    if (field.source) PetscCall(field.source(0, size / width, rows->data()));
    else PetscCall(own_numbers(field.vec, rows));
    PetscFunctionReturn(0);
  }
  SETERRQ(system.comm(), PETSC_ERR_ARG_WRONG, "%s has no field %s", system.name(), name.c_str());
}

}  // namespace bs
