#include "systems/tangent.hpp"

namespace bs {

namespace {
constexpr char MARK[] = "bs_tangent";
}

PetscErrorCode attach_tangent(Mat P, Tangent* tangent) {
  PetscContainer mark;
  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(P)), &mark));
  PetscCall(PetscContainerSetPointer(mark, tangent));
  PetscCall(PetscObjectCompose(reinterpret_cast<PetscObject>(P), MARK, reinterpret_cast<PetscObject>(mark)));
  PetscCall(PetscContainerDestroy(&mark));
  PetscFunctionReturn(0);
}

Tangent* tangent_of(Mat P) {
  PetscObject mark = nullptr;
  void* pointer = nullptr;
  if (!P || PetscObjectQuery(reinterpret_cast<PetscObject>(P), MARK, &mark) || !mark) return nullptr;
  if (PetscContainerGetPointer(reinterpret_cast<PetscContainer>(mark), &pointer)) return nullptr;
  return static_cast<Tangent*>(pointer);
}

}  // namespace bs
