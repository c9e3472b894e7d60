// What is remembered for all that runs on one communicator: in the place of variables of the whole process.
#pragma once
#include <mpi.h>
#include <map>
#include <memory>
#include <typeindex>
#include <typeinfo>

namespace bs {

/// One object of each type that is asked for, made at the first question.
class Context {
 public:
  template <class T>
  T& held() {
    std::shared_ptr<void>& slot = parts_[std::type_index(typeid(T))];
    if (!slot) slot = std::make_shared<T>();
    return *static_cast<T*>(slot.get());
  }

 private:
  std::map<std::type_index, std::shared_ptr<void>> parts_;
};

/// Local. The context of `comm`, an attribute of it: made at the first call, shared by the communicators that are duplicated from `comm` afterwards,
/// as PETSc does for its objects, and freed with the last of them.
std::shared_ptr<Context> context_of(MPI_Comm comm);

/// Local. The object of type T in the context of `comm`.
template <class T>
T& held_by(MPI_Comm comm) {
  return context_of(comm)->held<T>();
}

/// Local. Takes the context off `comm`, for communicators that are never freed.
void drop_context(MPI_Comm comm);

}  // namespace bs
