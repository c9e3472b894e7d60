#include "input/adjust.hpp"
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <map>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "input/remote.hpp"

namespace bs {

/// Smallest box around the particles of all ranks.
static PetscErrorCode bounding_box(MPI_Comm comm, const Lattice& l, Box* box) {
  const std::size_t d = static_cast<std::size_t>(l.dim);
  PetscFunctionBegin;
  std::fill(box->lo, box->lo + d, INFINITY);
  std::fill(box->hi, box->hi + d, -INFINITY);
  for (std::size_t p = 0; p < l.position.size(); ++p) {
    box->lo[p % d] = std::min(box->lo[p % d], l.position[p]);
    box->hi[p % d] = std::max(box->hi[p % d], l.position[p]);
  }
  PetscCall(min_over_ranks(comm, box->lo, l.dim));
  PetscCall(max_over_ranks(comm, box->hi, l.dim));
  PetscFunctionReturn(0);
}

PetscErrorCode adjust_lattice(MPI_Comm comm, const GeneratorSpec& spec, Lattice* l) {
  Faces faces = 0;
  Box box;
  PetscFunctionBegin;
  std::string fault = check_particle_data(spec, l->dim, l->dim, l->particles.total);
  if (fault.empty()) fault = parse_faces(spec.fixed, l->dim, &faces);
  if (!fault.empty()) PetscCall(fail(comm, Exit::input, l->source + ": " + fault));
  if (l->fixed.empty()) l->fixed.assign(static_cast<std::size_t>(l->particles.count), 0);
  if (faces || !spec.groups.empty()) PetscCall(bounding_box(comm, *l, &box));
  if (faces) apply_faces(faces, box, 0, l->dim, l->position, &l->fixed);
  choose_groups(spec.groups, box, 0, l);
  apply_fixed_particles(spec.fixed_particles, l->particles, &l->fixed);
  fix_groups(spec.fixed_groups, l);
  if (spec.radius > 0)
    set_column(&l->particle_columns,
               {"radius", "-bs_lattice_radius", std::vector<double>(static_cast<std::size_t>(l->particles.count), spec.radius)});
  if (!spec.velocity.empty() || !spec.velocity_gradient.empty())
    apply_velocity(spec.velocity, spec.velocity_gradient, l->dim, l->position, l->fixed, &l->velocity);
  const std::size_t d = static_cast<std::size_t>(l->dim);
  for (std::size_t p = 0; p < l->velocity.size(); ++p)
    if (l->fixed[p / d]) l->velocity[p] = 0;  // whatever the file says
  PetscFunctionReturn(0);
}

PetscErrorCode warn_of_idle_options(MPI_Comm comm, const std::string& source) {
  static const char* const names[] = {"-bs_lattice_size",
                                      "-bs_lattice_spacing",
                                      "-bs_lattice_neighbors",
                                      "-bs_lattice_origin",
                                      "-bs_lattice_stiff_fraction",
                                      "-bs_lattice_stiff_factor",
                                      "-bs_angle_stiffness",
                                      "-bs_rest_angle",
                                      "-bs_lattice_periodic",
                                      "-bs_lattice_total_mass",
                                      "-bs_lattice_particle_mass",
                                      "-bs_lattice_stiffness",
                                      "-bs_lattice_damping",
                                      "-bs_lattice_rest_length_factor",
                                      "-bs_lattice_remove_fraction",
                                      "-bs_lattice_remove_each",
                                      "-bs_lattice_prune"};
  std::string idle;
  PetscFunctionBegin;
  for (const char* name : names)
    if (is_given(name)) idle += (idle.empty() ? "" : ", ") + std::string(name);
  if (!idle.empty()) PetscCall(warn(comm, "ignored_options", source + ": the file has its own values; ignored: " + idle));
  PetscFunctionReturn(0);
}

void AnchorSpec::options(Section& section) {
  double values[3] = {0, 0, 0};
  int count = 0;
  section.integers("-bs_anchor_particles", "indices of particles tied by a spring to an anchor point, counted from 0", particles);
  section.text("-bs_anchor_group", "group whose particles are tied by a spring to an anchor point each, beside those of -bs_anchor_particles", group);
  if (section.reals("-bs_anchor_point", "anchor point, the same for all these particles (default: the initial position of each) [m]", values, 3,
                    &count))
    point.assign(values, values + count);
  section.real("-bs_anchor_stiffness", "stiffness of the anchor springs [N/m, strain law with a rest length: N]", stiffness, Range::nonnegative);
  section.real("-bs_anchor_rest_length", "rest length of the anchor springs [m]", rest_length, Range::nonnegative);
  section.real("-bs_anchor_damping", "damping of the anchor springs [kg/s]", damping, Range::nonnegative);
}

/// What is wrong with `spec` for this lattice; empty if nothing.
static std::string fault_of(const AnchorSpec& spec, const Lattice& l) {
  if (spec.particles.empty()) {
    const bool other = !spec.point.empty() || spec.stiffness > 0 || spec.rest_length > 0 || spec.damping > 0;
    return other ? "-bs_anchor_ options name no particles; add -bs_anchor_particles i,j,... or -bs_anchor_group NAME" : "";
  }
  for (const std::int64_t i : spec.particles)
    if (i < 0 || i >= l.particles.total)
      return format("-bs_anchor_particles %" PRId64 ": there is no such particle; write numbers from 0 to %" PRId64, i, l.particles.total - 1);
  if (!spec.point.empty() && static_cast<int>(spec.point.size()) != l.dim)
    return "-bs_anchor_point has " + how_many(static_cast<std::int64_t>(spec.point.size()), "number") +
           format(": write %d, as the lattice has d = %d", l.dim, l.dim);
  if (spec.stiffness <= 0 && spec.damping <= 0) return "-bs_anchor_particles needs springs; add -bs_anchor_stiffness (or -bs_anchor_damping) > 0";
  return {};
}

/// The particles of the spec's group, by row, behind those it names.
static PetscErrorCode add_members(MPI_Comm comm, const Lattice& l, AnchorSpec* spec) {
  std::vector<std::int64_t> rows, all;
  PetscFunctionBegin;
  if (spec->group.empty()) PetscFunctionReturn(0);
  PetscCall(require_groups(comm, "-bs_anchor_group", {spec->group}, l));
  const auto group = std::find_if(l.groups.begin(), l.groups.end(), [&](const Group& one) { return one.name == spec->group; });
  for (std::size_t p = 0; p < group->member.size(); ++p)
    if (group->member[p]) rows.push_back(l.particles.first + static_cast<std::int64_t>(p));
  PetscCall(gather_all(comm, rows, &all));
  spec->particles.insert(spec->particles.end(), all.begin(), all.end());
  PetscFunctionReturn(0);
}

PetscErrorCode add_anchors(MPI_Comm comm, const AnchorSpec& given, Lattice* l) {
  std::vector<std::int64_t> mine;
  std::vector<double> points;
  AnchorSpec spec = given;
  PetscFunctionBegin;
  PetscCall(add_members(comm, *l, &spec));
  const std::string fault = fault_of(spec, *l);
  if (!fault.empty()) PetscCall(fail(comm, Exit::input, fault));
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  // The last rank's chunk ends the table, so what is appended goes there.
  if (rank == size - 1) mine = spec.particles;
  PetscCall(fetch_rows(comm, l->particles, l->position, l->dim, mine, &points));
  for (std::size_t k = 0; k < mine.size(); ++k) {
    const double* from = spec.point.empty() ? &points[k * static_cast<std::size_t>(l->dim)] : spec.point.data();
    l->anchor_particle.push_back(mine[k]);
    l->anchor_point.insert(l->anchor_point.end(), from, from + l->dim);
    l->anchor_stiffness.push_back(spec.stiffness);
    l->anchor_rest_length.push_back(spec.rest_length);
    l->anchor_damping.push_back(spec.damping);
  }
  l->anchors.count += static_cast<std::int64_t>(mine.size());
  PetscCall(number_rows(comm, &l->anchors));
  PetscFunctionReturn(0);
}

void read_group_options(Section& section, GroupTexts* out) {
  static const char help[] =
      "particles of the group NAME (letters, digits, underscores): faces (xmin,xmax,...), boxes (box:X0,Y0,Z0,X1,Y1,Z1 [m]), rows "
      "(ids:0,5,7-12) or all, with commas between them; -bs_motion_NAME moves them, -bs_force_NAME acts on them";
  out->clear();
  for (const std::string& name : section.names("-bs_group_NAME", help)) {
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
    shape.integers = shape.truths = true;
    shape.row_name = "the group's rows";
    PetscCall(file.find(path, shape, &table));
    PetscCall(file.require_data(table));
    if (table.truths && table.rows != l->particles.total)
      fault.note(0, format("%s: %s: %" PRId64 " truth values for %s; write one for each, or the rows that are meant", l->source.c_str(), path.c_str(),
                           table.rows, how_many(l->particles.total, "particle").c_str()));
    PetscCall(fail_if_any(comm, fault));
    Group group{name, std::vector<std::uint8_t>(static_cast<std::size_t>(l->particles.count), 0)};
    for (std::int64_t at = 0; at < table.rows; at += SLICE) {
      std::vector<std::int64_t> rows;
      PetscCall(file.read(table, at, std::min(SLICE, table.rows - at), 0, &rows));
      for (std::size_t k = 0; k < rows.size() && !fault; ++k) {
        if (table.truths && rows[k] == 0) continue;
        if (table.truths) rows[k] = at + static_cast<std::int64_t>(k);
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

/// No group of the lattice has that name, which `option` gives.
static PetscErrorCode fail_without_group(MPI_Comm comm, const std::string& option, const std::string& name, const Lattice& l) {
  std::string known;
  for (const Group& one : l.groups) known += (known.empty() ? "" : ", ") + one.name;
  return fail(comm, Exit::input,
              "option " + option + ": there is no group " + name + ": choose its particles by -bs_group_" + name +
                  (known.empty() ? "" : ", or name one of " + known));
}

PetscErrorCode require_groups(MPI_Comm comm, const std::string& option, const std::vector<std::string>& names, const Lattice& l) {
  PetscFunctionBegin;
  for (const std::string& name : names)
    if (std::none_of(l.groups.begin(), l.groups.end(), [&](const Group& one) { return one.name == name; }))
      PetscCall(fail_without_group(comm, option, name, l));
  PetscFunctionReturn(0);
}

PetscErrorCode check_groups(MPI_Comm comm, const Lattice& l) {
  std::map<std::string, std::string> names;  // by what options know: they have no capitals
  PetscFunctionBegin;
  for (const Group& group : l.groups) {
    const auto [there, fresh] = names.emplace(lower(group.name), group.name);
    if (!fresh)
      PetscCall(fail(comm, Exit::input,
                     "groups " + there->second + " and " + group.name + " of " + l.source +
                         " are one to options, which know no capitals: give one of them another name"));
    std::int64_t count = std::count(group.member.begin(), group.member.end(), 1);
    PetscCall(sum_over_ranks(comm, &count));
    if (count == 0)
      PetscCall(fail(comm, Exit::input,
                     "group " + group.name + " of " + l.source + " has no particles: choose some by -bs_group_" + group.name + ", or leave it out"));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode read_options_of_groups(MPI_Comm comm, const Lattice& lattice, const std::string& begin, const char* title, const char* help,
                                      GroupOptions* out) {
  std::vector<std::string> given;
  PetscFunctionBegin;
  PetscCall(read_section(comm, title, [&](Section& o) {
    given = o.names("-" + begin + "NAME", help);
    for (std::size_t g = 0; g < lattice.groups.size(); ++g) {
      std::string text;
      if (o.text(("-" + begin + lattice.groups[g].name).c_str(), help, text)) out->emplace_back(g, text);
    }
  }));
  for (const std::string& name : given)
    if (std::none_of(lattice.groups.begin(), lattice.groups.end(), [&](const Group& one) { return lower(one.name) == lower(name); }))
      PetscCall(fail_without_group(comm, "-" + begin + name, name, lattice));
  PetscFunctionReturn(0);
}

}  // namespace bs
