#include "input/gmsh_file.hpp"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>

#include "base/fault.hpp"
#include "input/text_file.hpp"

namespace bs {

namespace {

/// Keeps PETSc's first message instead of printing it.
PetscErrorCode keep_message(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type,
                            const char* message, void* context) {
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
    return format("%s: no memory for its %lld bytes", path.c_str(), look.bytes);
  }
  std::ifstream in(path, std::ios::binary);
  in.read(text->data(), look.bytes);
  if (in.gcount() != look.bytes) return path + ": cannot be read to its end; look at the disk";
  return {};
}

std::string fault_of_gmsh(const std::string& text) {
  char word[16] = {}, version[16] = {};
  (void)std::sscanf(text.c_str(), "%15s %15s", word, version);
  if (std::strcmp(word, "$MeshFormat") != 0 && std::strcmp(word, "$Comments") != 0)
    return "line 1: not a Gmsh mesh, which begins with $MeshFormat; write it by Gmsh (-format msh41)";
  if (std::strcmp(word, "$MeshFormat") == 0) {
    const std::string v = version;
    if (v != "2.2" && v != "4.1")
      return "line 2: Gmsh format " + (v.empty() ? "without a version" : v) + "; write 2.2 or 4.1 (gmsh -save -format msh41)";
  }
  const auto has = [&text](const char* name) { return text.find(std::string("\n") + name) != std::string::npos; };
  if (version[0] == '4' && !has("$Entities") && !has("$PartitionedEntities"))
    return "has no $Entities, which format 4.1 needs (meshio leaves them out); write it as Gmsh 2.2 (in meshio: gmsh22)";
  for (const char* const name : {"$Nodes", "$EndNodes", "$Elements", "$EndElements"})
    if (!has(name)) return std::string("has no ") + name + ": truncated, or not a whole mesh; write it anew";
  return {};
}

PetscErrorCode plex_from_gmsh(const std::string& path, DM* mesh, std::string* error) {
  // Left to itself DMPlex takes the elements' dimension, and drops the z of a cloth without a word; of curved elements
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
  const PetscErrorCode code = DMPlexCreateGmshFromFile(PETSC_COMM_SELF, path.c_str(), PETSC_TRUE, mesh);
  PetscCall(PetscPopErrorHandler());
  for (int k = 0; k < 2; ++k)
    if (!set[k]) PetscCall(PetscOptionsClearValue(nullptr, defaults[k][0]));
  if (code) {
    *mesh = nullptr;
    if (error->empty()) *error = format("error %d", code);
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
