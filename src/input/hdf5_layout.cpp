#include "input/hdf5_layout.hpp"
#include <algorithm>
#include <cinttypes>
#include <iterator>
#include <sstream>
#include <utility>
#include "base/error.hpp"
#include "lattice/columns.hpp"
#include "lattice/spring_laws.hpp"
#include "lattice/xsp.hpp"

namespace bs {

namespace {

/// `index` receives the place of the law's name among the choices; `given` whether the file names one: an attribute of
/// the root, or, in a trajectory, the option that was in force.
PetscErrorCode read_law(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, const std::string& source, const char* name,
                        const std::vector<std::string>& choices, int* index, bool* given) {
  std::string text, attribute = name, owner = "/";
  PetscFunctionBegin;
  PetscCall(file.text_attribute(owner, attribute, &text));
  if (text.empty() && layout.trajectory) {
    owner = "/parameters/options";
    attribute = std::string("bs_") + name;
    PetscCall(file.text_attribute(owner, attribute, &text));
  }
  *given = !text.empty();
  const auto at = std::find(choices.begin(), choices.end(), text);
  if (*given && at == choices.end())
    PetscCall(fail(
        comm, Exit::input,
        format("%s: attribute %s of %s is '%s'; write ", source.c_str(), attribute.c_str(), owner.c_str(), text.c_str()) + alternatives(choices)));
  *index = *given ? static_cast<int>(at - choices.begin()) : 0;
  PetscFunctionReturn(0);
}

}  // namespace

Hdf5Layout layout_of(const Hdf5File& file) { return hdf5_layout(file.has(hdf5_layout(true).motion("position"))); }

PetscErrorCode add_column(const Hdf5File& file, Column column, const Rows& rows, const char* row_name, bool frames, std::vector<Column>* out,
                          int width) {
  PetscFunctionBegin;
  if (!file.has(column.path)) PetscFunctionReturn(0);
  PetscCall(read_rows(file, column.path, rows, row_name, frames, &column.value, width));
  out->push_back(std::move(column));
  PetscFunctionReturn(0);
}

/// The box of a padded trajectory has as many dimensions as its positions have components; the momentum in files of this program has those of
/// the lattice.
int lattice_dimension(const Hdf5File& file, int columns) {
  const auto least = [&columns](int found) { columns = found >= 1 && found < columns ? found : columns; };
  const H5 attribute(H5Aopen_by_name(file.id(), "/particles/trajectory/box", "dimension", H5P_DEFAULT, file.links()), H5Aclose);
  if (attribute) {
    const H5 type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
    int found = 0;
    if (H5Tget_class(type) == H5T_INTEGER && H5Sget_simple_extent_npoints(space) == 1 && H5Aread(attribute, H5T_NATIVE_INT, &found) >= 0)
      least(found);
  }
  if (const std::string momentum = "/observables/momentum/value"; file.has("/parameters/options") && file.has(momentum)) {
    const H5 set(H5Dopen2(file.id(), momentum.c_str(), H5P_DEFAULT), H5Dclose), space(set < 0 ? H5I_INVALID_HID : H5Dget_space(set), H5Sclose);
    hsize_t extent[H5S_MAX_RANK] = {0, 1};  // (T) or (T, d)
    if (space >= 0 && H5Sget_simple_extent_dims(space, extent, nullptr) >= 1) least(static_cast<int>(extent[1]));
  }
  return columns;
}

PetscErrorCode read_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* l) {
  int spring = 0, damping = 0;
  PetscFunctionBegin;
  PetscCall(read_law(comm, file, layout, l->source, "spring_law", spring_law_names(), &spring, &l->spring_law_given));
  PetscCall(read_law(comm, file, layout, l->source, "damping_law", damper_law_names(), &damping, &l->damping_law_given));
  l->spring_law = static_cast<SpringLaw>(spring);
  l->damping_law = static_cast<DampingLaw>(damping);
  PetscFunctionReturn(0);
}

PetscErrorCode read_row_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* l) {
  const std::string path = layout.column("law"), owner = layout.trajectory ? path : "/";
  const std::vector<std::string> known = spring_law_names();
  std::vector<std::string> names;
  std::vector<std::int64_t> given;
  std::vector<std::uint8_t> place;
  Error fault;
  PetscFunctionBegin;
  if (!file.has(path)) PetscFunctionReturn(0);
  PetscCall(file.words_attribute(owner, "spring_laws", &names));
  if (names.empty())
    PetscCall(fail(comm, Exit::input,
                   format("%s: %s is there, but attribute spring_laws of %s, which names its laws, is not; write it as a list of strings",
                          l->source.c_str(), path.c_str(), owner.c_str())));
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end())
      PetscCall(
          fail(comm, Exit::input,
               format("%s: attribute spring_laws of %s names '%s'; write ", l->source.c_str(), owner.c_str(), name.c_str()) + alternatives(known)));
    place.push_back(static_cast<std::uint8_t>(at - known.begin()));
  }
  PetscCall(read_rows(file, path, l->springs, "M", false, &given));
  const std::int64_t count = static_cast<std::int64_t>(place.size());
  l->law_by_row = true;
  l->spring_laws.assign(given.size(), 0);
  for (std::size_t k = 0; k < given.size() && !fault; ++k) {
    const std::int64_t row = l->springs.first + static_cast<std::int64_t>(k);
    if (given[k] < 0 || given[k] >= count)
      fault.note(row, format("%s: spring %" PRId64 ", %s: %" PRId64 " is not an index of attribute spring_laws; write 0 to %" PRId64,
                             l->source.c_str(), row, path.c_str(), given[k], count - 1));
    else l->spring_laws[k] = place[static_cast<std::size_t>(given[k])];
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

std::vector<std::pair<std::string, std::vector<std::string>>> lattice_members() {
  std::vector<std::pair<std::string, std::vector<std::string>>> known = {
      {"/box", {"edges"}},
      {"/particles", {"position", "velocity", "mass", "fixed", "id"}},
      {"/anchors", {"particle", "point", "stiffness", "rest_length", "damping"}},
      {"/springs", {"pairs", "stiffness", "rest_length", "damping", "law", "shift"}}};
  for (const ParticleParameter& one : particle_parameters) known[1].second.emplace_back(one.name);
  for (const SpringParameter& one : spring_parameters()) known.back().second.emplace_back(one.name);
  for (const SpringHistory& one : spring_histories()) known.back().second.push_back(one.name);
  for (const BreakLimit& one : break_limits) known.back().second.emplace_back(one.name);
  known.back().second.emplace_back(BROKEN);
  known.back().second.emplace_back(AREA);
  for (const InteractionSchema& schema : interaction_schemas()) {
    known.push_back({std::string("/") + schema.group + "s", {schema.topology, "shift"}});
    for (const InteractionParameter& parameter : schema.parameters) known.back().second.emplace_back(parameter.name);
    for (const BreakLimit& one : turn_limits)
      if (schema.turns) known.back().second.emplace_back(one.name);
    if (schema.turns) known.back().second.emplace_back(BROKEN);
  }
  return known;
}

PetscErrorCode read_scene_attributes(MPI_Comm comm, const Hdf5File& file, Lattice* l) {
  std::string text, force;
  PetscFunctionBegin;
  PetscCall(file.text_attribute("/", IMPLIED_OPTIONS, &text));
  PetscCall(file.text_attribute("/", FORCE_AT_ZERO_LENGTH, &force));
  std::istringstream words(text);
  for (std::string name, value; words >> name;) {
    if (std::find(std::begin(XSP_OPTIONS), std::end(XSP_OPTIONS), name) == std::end(XSP_OPTIONS) || !(words >> value))
      PetscCall(fail(comm, Exit::input,
                     format("%s: attribute %s of /: '%s' is no option of an .xsp scene with its value; write NAME VALUE NAME VALUE ..., or leave the "
                            "attribute out and give options on the command line",
                            l->source.c_str(), IMPLIED_OPTIONS, name.c_str())));
    l->implied_options.emplace_back(name, value);
  }
  if (!force.empty() && force != "none" && force != "error")
    PetscCall(fail(comm, Exit::input,
                   format("%s: attribute %s of / is '%s'; write none or error", l->source.c_str(), FORCE_AT_ZERO_LENGTH, force.c_str())));
  l->rest_at_zero_length = force == "none";
  PetscFunctionReturn(0);
}

void note_unknown_members(const Hdf5File& file, Lattice* l) {
  for (const auto& [group, names] : lattice_members())
    for (const std::string& name : file.members(group))
      if (std::find(names.begin(), names.end(), name) == names.end())
        l->warnings.push_back(l->source + ": " + group + "/" + name + " is not part of a lattice, it is ignored");
}

}  // namespace bs
