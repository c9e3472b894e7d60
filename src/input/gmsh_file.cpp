#include "input/gmsh_file.hpp"

#include <cstdio>
#include <fstream>
#include <new>

#include "base/crash.hpp"
#include "base/fault.hpp"
#include "input/text_file.hpp"

namespace bs {

namespace {

/// Keeps PETSc's first message instead of printing it.
PetscErrorCode keep_message(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type, const char* message, void* context) {
  auto* text = static_cast<std::string*>(context);
  if (type == PETSC_ERROR_INITIAL && text->empty() && message) *text = message;
  return code;
}

}  // namespace

std::string read_gmsh_text(const std::string& path, std::string* text) {
  const FileLook look = look_at_file(path);
  if (!look.error.empty()) return look.error;
  try {
    text->resize(static_cast<std::size_t>(look.bytes));
  } catch (const std::bad_alloc&) {
    return format("%s: not enough memory for its %lld bytes", path.c_str(), look.bytes);
  }
  std::ifstream in(path, std::ios::binary);
  in.read(text->data(), look.bytes);
  if (in.gcount() != look.bytes) return path + ": cannot be read to its end; check the disk";
  return {};
}

PetscErrorCode plex_from_gmsh(const std::string& path, DM* mesh, std::string* error) {
  // Left to itself DMPlex takes the elements' dimension, and silently drops the z of a cloth; of curved elements
  // it keeps no coordinates of the corners.
  static const char* const defaults[2][2] = {{"-dm_plex_gmsh_spacedim", "3"}, {"-dm_plex_gmsh_highorder", "0"}};
  PetscBool set[2];

  PetscFunctionBegin;
  *mesh = nullptr;
  error->clear();
  for (int k = 0; k < 2; ++k) {
    PetscCall(PetscOptionsHasName(nullptr, nullptr, defaults[k][0], &set[k]));
    if (!set[k]) PetscCall(PetscOptionsSetValue(nullptr, defaults[k][0], defaults[k][1]));
  }
  PetscCall(PetscPushErrorHandler(keep_message, error));
  const ReadingFile reading(path);
  const PetscErrorCode code = DMPlexCreateGmshFromFile(PETSC_COMM_SELF, path.c_str(), PETSC_TRUE, mesh);
  PetscCall(PetscPopErrorHandler());
  for (int k = 0; k < 2; ++k)
    if (!set[k]) PetscCall(PetscOptionsClearValue(nullptr, defaults[k][0]));
  if (code) {
    PetscCall(DMDestroy(mesh));  // begun, not finished
    if (error->empty()) *error = format("error %d", code);
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
