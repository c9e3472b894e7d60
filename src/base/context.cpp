#include "base/context.hpp"

namespace bs {

namespace {

using Shared = std::shared_ptr<Context>;

extern "C" int copy_context(MPI_Comm, int, void*, void* from, void* to, int* copied) {
  *static_cast<void**>(to) = new Shared(*static_cast<Shared*>(from));
  *copied = 1;
  return MPI_SUCCESS;
}

extern "C" int delete_context(MPI_Comm, int, void* held, void*) {
  delete static_cast<Shared*>(held);
  return MPI_SUCCESS;
}

/// The name of the attribute; MPI has one for the process.
int key() {
  static const int made = [] {
    int fresh = MPI_KEYVAL_INVALID;
    MPI_Comm_create_keyval(copy_context, delete_context, &fresh, nullptr);
    return fresh;
  }();
  return made;
}

}  // namespace

std::shared_ptr<Context> context_of(MPI_Comm comm) {
  void* held = nullptr;
  int there = 0;
  MPI_Comm_get_attr(comm, key(), &held, &there);
  if (there) return *static_cast<Shared*>(held);
  auto* fresh = new Shared(std::make_shared<Context>());
  MPI_Comm_set_attr(comm, key(), fresh);
  return *fresh;
}

void drop_context(MPI_Comm comm) {
  void* held = nullptr;
  int there = 0;
  MPI_Comm_get_attr(comm, key(), &held, &there);
  if (there) MPI_Comm_delete_attr(comm, key());
}

}  // namespace bs
