#include "input/gmsh_file.hpp"

#include <array>
#include <fstream>
#include <vector>

#include "base/fault.hpp"
#include "input/text_file.hpp"

namespace bs {

namespace {

enum Section { entities, partitioned_entities, nodes, elements, end_of_elements, sections };
const char* const section_names[sections] = {"\n$Entities", "\n$PartitionedEntities", "\n$Nodes", "\n$Elements",
                                             "\n$EndElements"};

/// Which of the sections the file has; read in blocks, as binary files have no lines.
std::array<bool, sections> find_sections(std::ifstream& in) {
  constexpr std::size_t block = 1 << 20, overlap = 32;
  std::array<bool, sections> found{};
  std::string window(overlap, '\n');
  std::vector<char> buffer(block);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(block));
    window.append(buffer.data(), static_cast<std::size_t>(in.gcount()));
    for (std::size_t s = 0; s < sections; ++s)
      found[s] = found[s] || window.find(section_names[s]) != std::string::npos;
    window.erase(0, window.size() - overlap);
  }
  return found;
}

/// Keeps PETSc's first message instead of printing it.
PetscErrorCode keep_message(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type,
                            const char* message, void* context) {
  auto* text = static_cast<std::string*>(context);
  if (type == PETSC_ERROR_INITIAL && text->empty() && message) *text = message;
  return code;
}

}  // namespace

std::string fault_of_gmsh(const std::string& path) {
  const FileLook look = look_at_file(path);
  if (!look.error.empty()) return look.error;
  std::ifstream in(path, std::ios::binary);
  char word[16] = {}, version[16] = {};
  in.width(sizeof word);
  in >> word;
  const std::string name = path + ": ";
  if (std::string(word) != "$MeshFormat" && std::string(word) != "$Comments")
    return name + "line 1: not a Gmsh mesh, it begins not with $MeshFormat; write it by Gmsh (-format msh41)";
  if (std::string(word) == "$MeshFormat") {
    in.width(sizeof version);
    in >> version;
    const std::string v = version;
    if (v != "2.2" && v != "4.1" && v != "2.20" && v != "4.10")
      return name + "line 2: Gmsh format " + (v.empty() ? "without a version" : v) +
             "; write 2.2 or 4.1 (gmsh -save -format msh41)";
  }
  const auto found = find_sections(in);
  if (version[0] == '4' && !found[entities] && !found[partitioned_entities])
    return name + "has no $Entities, which format 4.1 needs (meshio leaves them out); write it as Gmsh 2.2 (in meshio: gmsh22)";
  for (const Section s : {nodes, elements, end_of_elements})
    if (!found[s])
      return name + "has no " + (section_names[s] + 1) + ": truncated, or not a whole mesh; write it anew";
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
