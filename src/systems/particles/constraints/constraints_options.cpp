// What is given of anchor points, groups and the box, and which particles it holds.
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "input/adjust.hpp"
#include "systems/client.hpp"
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
  GroupOptions texts;

  PetscFunctionBegin;
  for (const Group& group : l.groups) {
    if (group.name == "anchors")
      PetscCall(fail(comm, Exit::input, "a group is named anchors, as the springs to given points are: give it another name"));
    if (group.name == "value" || group.name == "time" || group.name == "step")
      PetscCall(fail(comm, Exit::input, "a group is named " + group.name + ", as what a trajectory holds of every quantity: give it another name"));
    names_.push_back(group.name);
  }
  PetscCall(read_options_of_groups(comm, l, "bs_motion_", "Motion of groups", help, &texts));
  for (const auto& [group, text] : texts) {
    const std::string& name = names_[group];
    if (name == "box" || name == "loads" || name == "forces")
      PetscCall(fail(comm, Exit::input,
                     "option -bs_motion_" + name + ": work/" + name + " of a trajectory is that of something else: give the group another name"));
    motions_.push_back({group, {}});
    PetscCall(read_drive(comm, "-bs_motion_" + names_[group], "", text, l.dim, true, &motions_.back().drive));
    if (motions_.back().drive.given() && !held_by<Client>(comm).moves_groups)
      PetscCall(fail(
          comm, Exit::input,
          "option -bs_motion_" + name + ": given motions are said by a program on the library: write another one, such as velocity:V or table:FILE"));
    if (motions_.back().drive.given() && (is_given("-bs_checkpoint") || is_given("-bs_restart")))
      PetscCall(fail(comm, Exit::input,
                     "option -bs_motion_" + name + ": checkpoints do not say where given motions lead: leave -bs_checkpoint and -bs_restart out"));
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

PetscErrorCode check_reach(MPI_Comm comm, const std::string& option, const Drive& drive, double t_end, bool at_rest) {
  const std::string missed = drive.misses(t_end);
  PetscFunctionBegin;
  if (missed.empty()) PetscFunctionReturn(0);
  if (at_rest)
    PetscCall(
        fail(comm, Exit::input,
             format("the table of %s %s the load factor %g: add rows", option.c_str(), missed[0] == 'b' ? "begins after" : "does not reach", t_end)));
  PetscCall(fail(comm, Exit::input,
                 format("the table of %s %s, t = %g s: %s", option.c_str(), missed.c_str(), t_end,
                        missed[0] == 'b' ? "its times are those of the run" : "add rows or lower -ts_max_time")));
  PetscFunctionReturn(0);
}

}  // namespace bs
