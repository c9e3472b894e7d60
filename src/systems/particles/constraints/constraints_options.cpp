// What is given of anchor points, groups and the box, and which particles it holds.
#include <algorithm>
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "input/text_file.hpp"
#include "systems/particles/constraints/constraints.hpp"

namespace bs {

namespace {

/// "xy" of bits 0 and 1.
std::string components(unsigned mask) {
  std::string text;
  for (int c = 0; c < 3; ++c)
    if (mask >> c & 1u) text += static_cast<char>('x' + c);
  return text;
}

}  // namespace

PetscErrorCode Constraints::read_anchors(MPI_Comm comm, int dim) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Motion of anchor points", [&](Section& o) { anchors_.options(o); }));
  if (anchors_.active()) PetscCall(read_drive(comm, "-bs_anchor_table", "", anchors_.text(dim), dim, true, &anchors_.drive));
  PetscFunctionReturn(0);
}

PetscErrorCode Constraints::read(MPI_Comm comm, Lattice* l) {
  PetscFunctionBegin;
  PetscCall(read_groups(comm, *l));
  if (holds_groups()) PetscCall(mark(comm, l));
  PetscCall(box_.read(comm, *l));
  PetscFunctionReturn(0);
}

PetscErrorCode Constraints::read_groups(MPI_Comm comm, const Lattice& l) {
  static const char help[] =
      "motion of the group NAME: fixed, velocity:VX,VY,VZ [m/s], rotation:W,CX,CY,CZ,AX,AY,AZ [rad/s, m], table:FILE (rows t,x,y,z), or by "
      "components such as x=velocity:0.1,y=free,z=sinusoid:A,F,PHASE, with expression:TEXT in t, x0, y0, z0";
  std::vector<std::pair<std::size_t, std::string>> texts;
  std::vector<std::string> given;
  std::string known;

  PetscFunctionBegin;
  for (const Group& group : l.groups) {
    if (group.name == "anchors")
      PetscCall(fail(comm, Exit::input, "a group is named anchors, as the springs to given points are: give it another name"));
    if (group.name == "value" || group.name == "time" || group.name == "step")
      PetscCall(fail(comm, Exit::input, "a group is named " + group.name + ", as what a trajectory holds of every quantity: give it another name"));
    names_.push_back(group.name);
    known += (known.empty() ? "" : ", ") + group.name;
  }
  PetscCall(option_endings("bs_motion_", &given));
  for (const std::string& name : given)
    if (std::none_of(names_.begin(), names_.end(), [&](const std::string& one) { return lower(one) == lower(name); }))
      PetscCall(fail(comm, Exit::input,
                     "option -bs_motion_" + name + ": there is no group " + name + ": choose its particles by -bs_group_" + name +
                         (known.empty() ? "" : ", or name one of " + known)));
  PetscCall(read_section(comm, "Motion of groups", [&](Section& o) {
    std::string none;
    o.text("-bs_motion_NAME", help, none);
    for (std::size_t g = 0; g < names_.size(); ++g) {
      std::string text;
      if (!o.text(("-bs_motion_" + names_[g]).c_str(), help, text)) continue;
      texts.emplace_back(g, text);
      if (names_[g] == "box" || names_[g] == "loads")
        o.fail("option -bs_motion_" + names_[g] + ": work/" + names_[g] + " of a trajectory is that of something else: give the group another name");
    }
  }));
  for (const auto& [group, text] : texts) {
    motions_.push_back({group, {}});
    PetscCall(read_drive(comm, "-bs_motion_" + names_[group], "", text, l.dim, true, &motions_.back().drive));
  }
  PetscFunctionReturn(0);
}

/// Which components are held, and whether by more than one motion.
PetscErrorCode Constraints::mark(MPI_Comm comm, Lattice* l) {
  const unsigned all = (1u << l->dim) - 1;
  Error fault;

  PetscFunctionBegin;
  held_bits_.assign(l->fixed.size(), 0);
  for (std::size_t p = 0; p < l->fixed.size(); ++p) {
    const std::int64_t row = l->particles.first + static_cast<std::int64_t>(p);
    unsigned held = 0, moving = 0;
    std::size_t before = 0;
    for (const Moved& one : motions_) {
      if (!l->groups[one.group].member[p]) continue;
      const std::string& name = names_[one.group];
      if (l->fixed[p] && one.drive.moving())
        fault.note(row, format("particle %lld is fixed, but belongs to the group %s, which -bs_motion_%s moves: take it out of one of them",
                               static_cast<long long>(row), name.c_str(), name.c_str()));
      const unsigned twice = held & one.drive.held() & (moving | one.drive.moving());
      if (twice)
        fault.note(row,
                   format("particle %lld belongs to the groups %s and %s, whose motions both hold its component %s: let one of them leave it free",
                          static_cast<long long>(row), names_[before].c_str(), name.c_str(), components(twice).c_str()));
      held |= one.drive.held();
      moving |= one.drive.moving();
      before = one.group;
    }
    held_bits_[p] = held;
    if (!l->fixed[p] && held == all) l->fixed[p] = moving ? 2 : 1;
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode read_drive(MPI_Comm comm, const std::string& option, const std::string& component, const std::string& text, int dim, bool placed,
                          Drive* drive) {
  std::string error;
  PetscFunctionBegin;
  if (!drive->parse(text, dim, &error, placed)) PetscCall(fail(comm, Exit::input, "option " + option + ": " + component + error));
  for (std::size_t k = 0; k < drive->tables().size(); ++k) {
    std::string file = drive->tables()[k].first, content;
    CsvTable table;
    PetscCall(find_input(comm, option, &file));
    PetscCall(read_text_file(comm, file, &content));
    if (!read_csv_table(content, file, 2, 1 + drive->tables()[k].second, &table, &error) || !drive->set_table(k, table, &error))
      PetscCall(fail(comm, Exit::input, error));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode check_reach(MPI_Comm comm, const std::string& option, const Drive& drive, double t_end) {
  const std::string missed = drive.misses(t_end);
  PetscFunctionBegin;
  if (!missed.empty())
    PetscCall(fail(comm, Exit::input,
                   format("the table of %s %s, t = %g s: %s", option.c_str(), missed.c_str(), t_end,
                          missed[0] == 'b' ? "its times are those of the run" : "add rows or lower -ts_max_time")));
  PetscFunctionReturn(0);
}

}  // namespace bs
