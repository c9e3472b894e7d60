#include "input/groups.hpp"

#include <algorithm>
#include <cinttypes>

#include "base/error.hpp"
#include "base/option_names.hpp"

namespace bs {

void read_group_options(Section& section, GroupTexts* out) {
  static const char help[] =
      "particles of the group NAME (letters, digits, underscores): faces (xmin,xmax,...), boxes (box:X0,Y0,Z0,X1,Y1,Z1 [m]), rows "
      "(ids:0,5,7-12) or all, with commas between them; -bs_motion_NAME moves them";
  std::vector<std::string> names;
  std::string none;
  out->clear();
  section.text("-bs_group_NAME", help, none);
  if (option_endings("bs_group_", &names)) return;
  for (const std::string& name : names) {
    std::string text;
    const std::string option = "-bs_group_" + name;
    if (!section.text(option.c_str(), help, text)) continue;
    if (!is_group_name(name)) section.fail("option " + option + ": '" + name + "' is no name of a group: write letters, digits and underscores");
    out->emplace_back(name, text);
  }
}

PetscErrorCode parse_groups(MPI_Comm comm, const GroupTexts& texts, int dim, int axes, std::int64_t total, std::vector<GroupSpec>* out) {
  PetscFunctionBegin;
  out->clear();
  for (const auto& [name, text] : texts) {
    GroupSpec spec;
    spec.name = name;
    const std::string fault = parse_group(text, dim, axes, total, &spec);
    if (!fault.empty()) PetscCall(fail(comm, Exit::input, "option -bs_group_" + name + ": " + fault));
    out->push_back(std::move(spec));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode read_hdf5_groups(MPI_Comm comm, const Hdf5File& file, Lattice* l) {
  constexpr std::int64_t SLICE = 1 << 20;  // rows read at once
  Error fault;

  PetscFunctionBegin;
  for (const std::string& name : file.members("/groups")) {
    const std::string path = "/groups/" + name;
    if (!is_group_name(name))
      PetscCall(fail(comm, Exit::input, l->source + ": " + path + ": no name of a group: write letters, digits and underscores"));
    Table table;
    TableShape shape;
    shape.integers = true;
    shape.row_name = "the group's rows";
    PetscCall(file.find(path, shape, &table));
    PetscCall(file.require_data(table));
    Group group{name, std::vector<std::uint8_t>(static_cast<std::size_t>(l->particles.count), 0)};
    for (std::int64_t at = 0; at < table.rows; at += SLICE) {
      std::vector<std::int64_t> rows;
      PetscCall(file.read(table, at, std::min(SLICE, table.rows - at), 0, &rows));
      for (std::size_t k = 0; k < rows.size() && !fault; ++k) {
        if (rows[k] < 0 || rows[k] >= l->particles.total)
          fault.note(at, format("%s: %s: there is no particle in row %" PRId64 "; write rows from 0 to %" PRId64, l->source.c_str(), path.c_str(),
                                rows[k], l->particles.total - 1));
        else if (rows[k] >= l->particles.first && rows[k] - l->particles.first < l->particles.count)
          group.member[static_cast<std::size_t>(rows[k] - l->particles.first)] = 1;
      }
    }
    l->groups.push_back(std::move(group));
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode require_groups(MPI_Comm comm, const std::string& option, const std::vector<std::string>& names, const Lattice& l) {
  PetscFunctionBegin;
  for (const std::string& name : names) {
    bool there = false;
    std::string known;
    for (const Group& one : l.groups) {
      there = there || one.name == name;
      known += (known.empty() ? "" : ", ") + one.name;
    }
    if (!there)
      PetscCall(fail(comm, Exit::input,
                     "option " + option + ": there is no group " + name + ": choose its particles by -bs_group_" + name +
                         (known.empty() ? "" : ", or name one of " + known)));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_empty_groups(MPI_Comm comm, const Lattice& l) {
  PetscFunctionBegin;
  for (const Group& group : l.groups) {
    std::int64_t count = std::count(group.member.begin(), group.member.end(), 1);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT64_T, MPI_SUM, comm));
    if (count == 0)
      PetscCall(fail(comm, Exit::input,
                     "group " + group.name + " of " + l.source + " has no particles: choose some by -bs_group_" + group.name + ", or leave it out"));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
