#include "input/hdf5_layout.hpp"

#include <algorithm>
#include <utility>

#include "base/fault.hpp"

namespace bs {

namespace {

const Hdf5Layout lattice_names{false, "/particles/position", "/particles/velocity", "/particles/mass", "/particles/fixed",
                          "/particles/radius", "/particles/id", "/springs", "/springs/pairs", "/springs/stiffness",
                          "/springs/rest_length", "/springs/damping"};
const Hdf5Layout trajectory_names{true, "/particles/trajectory/position/value", "/particles/trajectory/velocity/value",
                             "/particles/trajectory/mass", "/particles/trajectory/fixed", "/particles/trajectory/radius",
                             "/particles/trajectory/id", "/connectivity/bonds", "/connectivity/bonds",
                             "/connectivity/bonds_stiffness", "/connectivity/bonds_rest_length",
                             "/connectivity/bonds_damping"};

/// `index` receives the place of the law's name among two choices; `given` whether the file names one: an attribute of
/// the root, or, in a trajectory, the option that was in force.
PetscErrorCode read_law(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, const std::string& source,
                        const char* name, const char* const choices[2], int* index, bool* given) {
  std::string text, attribute = name, owner = "/";

  PetscFunctionBegin;
  PetscCall(file.text_attribute(owner, attribute, &text));
  if (text.empty() && layout.trajectory) {
    owner = "/parameters/options";
    attribute = std::string("bs_") + name;
    PetscCall(file.text_attribute(owner, attribute, &text));
  }
  *given = !text.empty();
  *index = text == choices[1] ? 1 : 0;
  if (*given && text != choices[0] && text != choices[1])
    PetscCall(tell(comm, Exit::input,
                   format("%s: attribute %s of %s is '%s'; write %s or %s", source.c_str(), attribute.c_str(),
                          owner.c_str(), text.c_str(), choices[0], choices[1])));
  PetscFunctionReturn(0);
}

}  // namespace

const Hdf5Layout& layout_of(const Hdf5File& file) {
  return file.has(trajectory_names.position) ? trajectory_names : lattice_names;
}

int box_dimension(const Hdf5File& file, int columns) {
  const H5 attribute(H5Aopen_by_name(file.id(), "/particles/trajectory/box", "dimension", H5P_DEFAULT, file.links()),
                         H5Aclose);
  if (!attribute) return columns;
  const H5 type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  int found = 0;
  const bool good = H5Tget_class(type) == H5T_INTEGER && H5Sget_simple_extent_npoints(space) == 1 &&
                    H5Aread(attribute, H5T_NATIVE_INT, &found) >= 0;
  return good && found >= 1 && found < columns ? found : columns;
}

PetscErrorCode read_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* l) {
  static const char* const spring_laws[2] = {"hooke", "strain"};
  static const char* const damping_laws[2] = {"axial", "simple"};
  int spring = 0, damping = 0;

  PetscFunctionBegin;
  PetscCall(read_law(comm, file, layout, l->source, "spring_law", spring_laws, &spring, &l->spring_law_given));
  PetscCall(read_law(comm, file, layout, l->source, "damping_law", damping_laws, &damping, &l->damping_law_given));
  l->spring_law = spring ? SpringLaw::strain : SpringLaw::hooke;
  l->damping_law = damping ? DampingLaw::simple : DampingLaw::axial;
  PetscFunctionReturn(0);
}

void note_unknown_members(const Hdf5File& file, Lattice* l) {
  static const std::vector<std::pair<const char*, std::vector<std::string>>> known = {
      {"/particles", {"position", "velocity", "mass", "fixed", "radius", "id"}},
      {"/springs", {"pairs", "stiffness", "rest_length", "damping"}},
      {"/anchors", {"particle", "point", "stiffness", "rest_length", "damping"}}};
  for (const auto& [group, names] : known)
    for (const std::string& name : file.members(group))
      if (std::find(names.begin(), names.end(), name) == names.end())
        l->warnings.push_back(l->source + ": " + group + "/" + name + " is not part of a lattice, it is ignored");
}

}  // namespace bs
