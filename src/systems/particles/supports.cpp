#include "systems/particles/supports.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "input/text_file.hpp"

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

PetscErrorCode Supports::read(MPI_Comm comm, Lattice* l) {
  static const char help[] =
      "motion of the group NAME: fixed, velocity:VX,VY,VZ [m/s], rotation:W,CX,CY,CZ,AX,AY,AZ [rad/s, m], table:FILE (rows t,x,y,z), or by "
      "components such as x=velocity:0.1,y=free,z=sinusoid:A,F,PHASE, with expression:TEXT in t, x0, y0, z0";
  std::vector<std::pair<std::size_t, std::string>> texts;
  std::vector<std::string> given;
  std::string known;

  PetscFunctionBegin;
  for (const Group& group : l->groups) {
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
  for (const auto& [group, text] : texts) PetscCall(read_motion(comm, *l, group, text));
  if (active()) PetscCall(mark(comm, l));
  PetscFunctionReturn(0);
}

PetscErrorCode Supports::read_motion(MPI_Comm comm, const Lattice& l, std::size_t group, const std::string& text) {
  Moved moved;
  std::string error;
  const std::string option = "-bs_motion_" + names_[group];

  PetscFunctionBegin;
  moved.group = group;
  if (!moved.drive.parse(text, l.dim, &error)) PetscCall(fail(comm, Exit::input, "option " + option + ": " + error));
  PetscCall(read_drive_tables(comm, option, &moved.drive));
  motions_.push_back(std::move(moved));
  PetscFunctionReturn(0);
}

/// Which components are held, and whether by more than one motion.
PetscErrorCode Supports::mark(MPI_Comm comm, Lattice* l) {
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

PetscErrorCode Supports::create(const Network& net) {
  PetscFunctionBegin;
  net_ = &net;
  std::vector<std::uint8_t> taken(net.fixed.size(), 0);
  for (std::size_t k = 0; k < motions_.size(); ++k)
    for (const PetscInt i : net.groups[motions_[k].group].member) {
      const std::uint8_t mask = static_cast<std::uint8_t>(motions_[k].drive.held() & ~taken[i]);
      if (net.fixed[i] == 1 || mask == 0) continue;
      taken[i] = static_cast<std::uint8_t>(taken[i] | mask);
      holds_.push_back({i, static_cast<int>(k), mask});
    }
  std::stable_sort(holds_.begin(), holds_.end(), [](const Hold& a, const Hold& b) { return a.particle < b.particle; });
  std::vector<bool> seen(motions_.size(), false);
  for (std::size_t k = 0; k < holds_.size() && holds_[k].particle < net.n; ++k) {
    const std::size_t motion = static_cast<std::size_t>(holds_[k].motion);
    const Drive& drive = motions_[motion].drive;
    if (!drive.may_jump()) continue;
    if (!seen[motion]) first_jumpers_.push_back(k);
    if (!seen[motion] || drive.jumps_by_place()) jumpers_.push_back(k);
    seen[motion] = true;
  }
  for (const Hold& one : holds_) {
    if (net.fixed[one.particle]) continue;
    const PetscInt global = net.global[one.particle];
    if (rollers_.empty() || rollers_.back().global != global) rollers_.push_back({global, one.particle, 0});
    rollers_.back().mask = static_cast<std::uint8_t>(rollers_.back().mask | one.mask);
  }
  std::sort(rollers_.begin(), rollers_.end(), [](const Roller& a, const Roller& b) { return a.global < b.global; });
  int some = !rollers_.empty();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &some, 1, MPI_INT, MPI_MAX, net.comm));
  rolls_ = some != 0;
  PetscFunctionReturn(0);
}

std::uint8_t Supports::rolling(PetscInt global) const {
  const auto at = std::lower_bound(rollers_.begin(), rollers_.end(), global, [](const Roller& one, PetscInt g) { return one.global < g; });
  return at != rollers_.end() && at->global == global ? at->mask : std::uint8_t{0};
}

// Rows and columns of a held component are those of the identity times `diagonal`.
void Supports::hold_rows(PetscInt i, const PetscInt* columns, PetscInt count, int block, double diagonal, double* panel) const {
  const int d = net_->dim;
  const PetscInt width = count * block, own = net_->global[i];
  const std::uint8_t mine = rolling(own);
  for (PetscInt s = 0; s < count; ++s) {
    const std::uint8_t theirs = rolling(columns[s]);
    if (!(mine | theirs)) continue;
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < block; ++c)
        if ((mine >> r & 1) || (theirs >> (c % d) & 1)) panel[r * width + s * block + c] = 0;
    for (int r = 0; r < d && columns[s] == own; ++r)
      if (mine >> r & 1) panel[r * width + s * block + block - d + r] = diagonal;
  }
}

bool Supports::moving() const {
  return std::any_of(motions_.begin(), motions_.end(), [](const Moved& one) { return one.drive.moving() != 0; });
}

std::uint8_t Supports::mask(PetscInt i) const {
  if (net_->fixed[i]) return static_cast<std::uint8_t>((1 << net_->dim) - 1);
  std::uint8_t bits = 0;
  auto at = std::lower_bound(holds_.begin(), holds_.end(), i, [](const Hold& one, PetscInt j) { return one.particle < j; });
  for (; at != holds_.end() && at->particle == i; ++at) bits = static_cast<std::uint8_t>(bits | at->mask);
  return bits;
}

void Supports::at(const Hold& hold, double t, double* x, double* v, double* a) const {
  double values[9] = {};
  const int d = net_->dim;
  motions_[static_cast<std::size_t>(hold.motion)].drive.at(full_load_ ? 1.0 : t, net_->held.data() + static_cast<std::size_t>(hold.particle * d),
                                                           values, values + 3, values + 6);
  for (int c = 0; c < d; ++c) {
    if (!(hold.mask >> c & 1)) continue;
    x[c] = values[c];
    v[c] = at_rest_ ? 0 : values[3 + c];
    if (a) a[c] = at_rest_ ? 0 : values[6 + c];
  }
}

void Supports::place(double t, PetscInt first, PetscInt last, double* states) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  auto one = std::lower_bound(holds_.begin(), holds_.end(), first, [](const Hold& hold, PetscInt i) { return hold.particle < i; });
  for (; one != holds_.end() && one->particle < last; ++one) {
    double* state = states + static_cast<std::size_t>(one->particle) * 2 * d;
    at(*one, t, state, state + d, nullptr);
  }
}

void Supports::clear(PetscInt first, PetscInt last, int vectors, double* values) const {
  const int d = net_->dim;
  auto one = std::lower_bound(holds_.begin(), holds_.end(), first, [](const Hold& hold, PetscInt i) { return hold.particle < i; });
  for (; one != holds_.end() && one->particle < last; ++one)
    for (int c = 0; c < vectors * d; ++c)
      if (one->mask >> (c % d) & 1) values[static_cast<std::size_t>(one->particle) * static_cast<std::size_t>(vectors * d) + c] = 0;
}

/// In what is held at rest there are no velocities, and a jump is a step of the load.
void Supports::look_for_jumps(double from, double to, const std::vector<std::size_t>& where, Error* fault) const {
  if (at_rest_ || !(to > from)) return;
  for (const std::size_t k : where) {
    const Hold& hold = holds_[k];
    const Moved& one = motions_[static_cast<std::size_t>(hold.motion)];
    const double at = one.drive.jump(from, to, net_->held.data() + static_cast<std::size_t>(hold.particle * net_->dim));
    if (!std::isnan(at))
      fault->note(net_->row[hold.particle],
                  format("option -bs_motion_%s: the motion of particle %lld jumps at t = %.10g s, where its velocity would be infinite: give a ramp "
                         "(velocity:V, table:FILE or an expression), or apply it as a load by -bs_task statics",
                         names_[one.group].c_str(), static_cast<long long>(net_->row[hold.particle]), at));
  }
}

void Supports::foresee(double from, double to, Error* fault) const {
  const char* const quantities[] = {"place", "velocity", "acceleration"};
  for (const Hold& hold : holds_) {
    const Moved& one = motions_[static_cast<std::size_t>(hold.motion)];
    if (hold.particle >= net_->n || !one.drive.moving()) continue;
    double values[9] = {};
    at(hold, to, values, values + 3, values + 6);
    const double* bad = std::find_if_not(values, values + 9, [](double value) { return std::isfinite(value); });
    if (bad != values + 9)
      fault->note(
          net_->row[hold.particle],
          format("option -bs_motion_%s: particle %lld has no finite %s at t = %.10g%s: give a motion that is finite from the start to the end "
                 "of the run",
                 names_[one.group].c_str(), static_cast<long long>(net_->row[hold.particle]), quantities[(bad - values) / 3], to,
                 at_rest_ ? ", the load factor" : " s"));
  }
  look_for_jumps(from, to, jumpers_, fault);
}

PetscErrorCode Supports::covers(double t_start, double t_end) const {
  constexpr int PARTS = 1000;
  Error fault;
  PetscFunctionBegin;
  for (const Moved& one : motions_) {
    const std::string missed = one.drive.misses(t_end);
    if (!missed.empty())
      PetscCall(fail(net_->comm, Exit::input,
                     format("the table of -bs_motion_%s %s, t = %g s: %s", names_[one.group].c_str(), missed.c_str(), t_end,
                            missed[0] == 'b' ? "its times are those of the run" : "add rows or lower -ts_max_time")));
  }
  const double part = (t_end - t_start) / PARTS;
  for (int k = 0; k < PARTS; ++k) look_for_jumps(t_start + k * part, k + 1 < PARTS ? t_start + (k + 1) * part : t_end, first_jumpers_, &fault);
  PetscCall(fail_if_any(net_->comm, fault));
  PetscFunctionReturn(0);
}

std::vector<std::string> Supports::describe() const {
  std::vector<std::string> lines;
  for (const Moved& one : motions_)
    lines.push_back(format("group %s (%lld particles): ", names_[one.group].c_str(), static_cast<long long>(net_->groups[one.group].total)) +
                    one.drive.text());
  return lines;
}

PetscErrorCode read_drive_tables(MPI_Comm comm, const std::string& option, Drive* drive) {
  std::string error;

  PetscFunctionBegin;
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

}  // namespace bs
