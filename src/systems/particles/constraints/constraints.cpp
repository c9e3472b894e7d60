#include "systems/particles/constraints/constraints.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "network/ghost_copies.hpp"
#include "systems/layout.hpp"

namespace bs {

PetscErrorCode Constraints::create(Network* network) {
  const Network& net = *network;
  PetscFunctionBegin;
  net_ = network;
  network->constraints = this;
  box_.create(net);
  for (const Moved& one : motions_) ways_.push_back(one.drive.given() ? Way{0, 0, net.held, net.held} : Way{});
  for (PetscInt i = 0; i < net.n + net.ghosts; ++i)
    if (net.fixed[i]) fixed_.push_back(i);
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
    if (rollers_.empty() || rollers_.back().global != global) rollers_.push_back({global, 0});
    rollers_.back().mask = static_cast<std::uint8_t>(rollers_.back().mask | one.mask);
  }
  std::sort(rollers_.begin(), rollers_.end(), [](const Roller& a, const Roller& b) { return a.global < b.global; });
  for (PetscInt i = 0; i < net.n; ++i)
    if (held(i)) holders_.push_back(i);
  PetscCall(on_some_rank(net.comm, !rollers_.empty(), &rolls_));
  PetscFunctionReturn(0);
}

std::uint8_t Constraints::rolling(PetscInt global) const {
  const auto at = std::lower_bound(rollers_.begin(), rollers_.end(), global, [](const Roller& one, PetscInt g) { return one.global < g; });
  return at != rollers_.end() && at->global == global ? at->mask : std::uint8_t{0};
}

// Rows and columns of a held component are those of the identity times `diagonal`.
void Constraints::hold_rows(PetscInt i, const PetscInt* columns, PetscInt count, int block, double diagonal, double* panel) const {
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

bool Constraints::drives() const {
  return std::any_of(motions_.begin(), motions_.end(), [](const Moved& one) { return one.drive.moving() != 0; });
}

std::uint8_t Constraints::held(PetscInt i) const {
  return net_->fixed[i] ? static_cast<std::uint8_t>((1 << net_->dim) - 1) : rolling(net_->global[i]);
}

// X = X_from + (t - t_from)/(t_to - t_from) (X_to - X_from); at the end with the velocity that led there
static void follow_way(double from_time, double to_time, double from, double to, double t, double* x, double* v) {
  const double length = to_time - from_time, part = length > 0 ? std::clamp((t - from_time) / length, 0.0, 1.0) : 1;
  *x = part < 1 ? from + part * (to - from) : to;
  *v = length > 0 && t >= from_time && t <= to_time + 1e-9 * length ? (to - from) / length : 0;
}

void Constraints::at(const Hold& hold, double t, double* x, double* v, double* a) const {
  double values[9] = {};
  const int d = net_->dim;
  const Drive& drive = motions_[static_cast<std::size_t>(hold.motion)].drive;
  drive.at(full_load_ ? 1.0 : t, net_->held.data() + static_cast<std::size_t>(hold.particle * d), values, values + 3, values + 6);
  const std::uint8_t given = drive.given();
  for (int c = 0; c < d && given != 0; ++c) {
    const Way& way = ways_[static_cast<std::size_t>(hold.motion)];
    const std::size_t k = static_cast<std::size_t>(hold.particle * d + c);
    if (given >> c & 1) follow_way(way.from_time, way.to_time, way.from[k], way.to[k], t, values + c, values + 3 + c);
  }
  for (int c = 0; c < d; ++c) {
    if (!(hold.mask >> c & 1)) continue;
    x[c] = values[c];
    v[c] = at_rest_ ? 0 : values[3 + c];
    if (a) a[c] = at_rest_ ? 0 : values[6 + c];
  }
}

template <class Visit>
void Constraints::for_holds(PetscInt first, PetscInt last, Visit visit) const {
  auto one = std::lower_bound(holds_.begin(), holds_.end(), first, [](const Hold& hold, PetscInt i) { return hold.particle < i; });
  for (; one != holds_.end() && one->particle < last; ++one) visit(*one);
}

template <class Visit>
void Constraints::for_fixed(PetscInt first, PetscInt last, Visit visit) const {
  for (auto at = std::lower_bound(fixed_.begin(), fixed_.end(), first); at != fixed_.end() && *at < last; ++at) visit(static_cast<std::size_t>(*at));
}

void Constraints::drive(double t, PetscInt first, PetscInt last, double* states) const {
  const Layout layout{net_->dim};
  for_holds(first, last, [&](const Hold& hold) {
    double* state = layout.of(states, hold.particle);
    at(hold, t, state, state + layout.v(0), nullptr);
  });
}

void Constraints::place(double t, PetscInt first, PetscInt last, double* states) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const Layout layout{net_->dim};
  for_fixed(first, last, [&](std::size_t i) {
    double* state = layout.of(states, static_cast<PetscInt>(i));
    std::copy_n(net_->held.data() + i * d, d, state);
    std::fill_n(state + layout.v(0), d, 0.0);
  });
  drive(t, first, last, states);
}

void Constraints::clear(PetscInt first, PetscInt last, int vectors, double* values) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim), width = static_cast<std::size_t>(vectors) * d;
  for_fixed(first, last, [&](std::size_t i) { std::fill_n(values + i * width, width, 0.0); });
  for_holds(first, last, [&](const Hold& hold) {
    for (std::size_t c = 0; c < width; ++c)
      if (hold.mask >> (c % d) & 1) values[static_cast<std::size_t>(hold.particle) * width + c] = 0;
  });
}

PetscErrorCode Constraints::stop(Vec y) const {
  const Layout layout{net_->dim, net_->n};
  PetscFunctionBegin;
  const WriteArray ay(y);
  for_holds(0, net_->n, [&](const Hold& hold) {
    for (PetscInt c = 0; c < layout.dim; ++c)
      if (hold.mask >> c & 1) ay[layout.v(hold.particle, c)] = 0;
  });
  PetscFunctionReturn(0);
}

PetscErrorCode Constraints::show(double t, Vec y, Vec* shown) {
  PetscFunctionBegin;
  *shown = y;
  if (!holds_groups()) PetscFunctionReturn(0);
  PetscCall(copy_into(&shown_, y));
  drive(t, 0, net_->n, WriteArray(shown_));
  *shown = shown_;
  PetscFunctionReturn(0);
}

PetscErrorCode Constraints::give(const std::string& group, double from, double to, Vec places) {
  const PetscInt d = net_->dim;
  const Layout layout{d, net_->n};
  bool found = false;
  std::vector<double> to_places(net_->held.size()), one(static_cast<std::size_t>(net_->n));
  GhostCopies copies;
  PetscFunctionBegin;
  PetscCall(copies.create(*net_));
  const ReadArray ay(places);
  for (PetscInt c = 0; c < d; ++c) {
    for (PetscInt i = 0; i < net_->n; ++i) one[static_cast<std::size_t>(i)] = to_places[static_cast<std::size_t>(i * d + c)] = ay[layout.x(i, c)];
    PetscCall(copies.exchange(one, [&](PetscInt ghost, double x) { to_places[static_cast<std::size_t>(ghost * d + c)] = x; }));
  }
  for (std::size_t k = 0; k < motions_.size(); ++k) {
    if (!motions_[k].drive.given() || (!group.empty() && names_[motions_[k].group] != group)) continue;
    found = true;
    Way next = ways_[k];
    next.from_time = from;
    next.to_time = to;
    for (const Hold& hold : holds_) {
      double x[3] = {0, 0, 0}, v[3];
      if (hold.motion != static_cast<int>(k)) continue;
      at(hold, from, x, v, nullptr);
      std::copy_n(x, d, &next.from[static_cast<std::size_t>(hold.particle * d)]);
    }
    next.to = to_places;
    if (!(to > from)) next.from = next.to;
    ways_[k] = std::move(next);
  }
  if (!found && !group.empty())
    PetscCall(
        fail(net_->comm, Exit::input, "the group " + group + " is not one whose motion is given: add the option -bs_motion_" + group + " given"));
  PetscFunctionReturn(0);
}

std::vector<Mechanics::GivenMotion> Constraints::given_motions() const {
  std::vector<Mechanics::GivenMotion> all;
  for (std::size_t k = 0; k < motions_.size(); ++k)
    if (motions_[k].drive.given()) all.push_back({names_[motions_[k].group], ways_[k].from_time, ways_[k].to_time});
  return all;
}

std::string Constraints::given() const {
  const std::vector<Mechanics::GivenMotion> all = given_motions();
  return all.empty() ? "" : "-bs_motion_" + all[0].group;
}

void Constraints::set_loads(const Loads& loads) {
  at_rest_ = anchors_.at_rest = loads.at_rest;
  full_load_ = loads.driven_at_full_load;
  anchors_.at_full_load = loads.anchors_at_full_load;
  box_.set_static(loads.at_rest, loads.box_at_full_load);
}

void Constraints::list_drives(std::vector<Drive*>* all) {
  for (Moved& one : motions_) all->push_back(&one.drive);
  all->push_back(&anchors_.drive);
  box_.list_drives(all);
}

/// In what is held at rest there are no velocities, and a jump is a step of the load.
void Constraints::find_jumps(double from, double to, const std::vector<std::size_t>& where, Error* fault) const {
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

PetscErrorCode Constraints::foresee(double from, double to, std::string* text) const {
  const char* const quantities[] = {"place", "velocity", "acceleration"};
  const auto finite = [](double value) { return std::isfinite(value); };
  double shift[6] = {};
  Error fault;
  PetscFunctionBegin;
  text->clear();
  if (!time_dependent()) PetscFunctionReturn(0);
  if (net_->anchors_total > 0) anchors_.at(to, shift, shift + 3);
  if (!std::all_of(shift, shift + 6, finite))
    fault.note(-2, format("option -bs_anchor_motion: anchor points have no finite place or velocity at t = %.10g: give smaller numbers", to));
  if (box_.active()) box_.foresee(from, to, &fault);
  for (const Hold& hold : holds_) {
    const Moved& one = motions_[static_cast<std::size_t>(hold.motion)];
    if (hold.particle >= net_->n || !one.drive.moving()) continue;
    double values[9] = {};
    at(hold, to, values, values + 3, values + 6);
    const double* bad = std::find_if_not(values, values + 9, finite);
    if (bad != values + 9)
      fault.note(net_->row[hold.particle],
                 format("option -bs_motion_%s: particle %lld has no finite %s at t = %.10g%s: give a motion that is finite from the start to the end "
                        "of the run",
                        names_[one.group].c_str(), static_cast<long long>(net_->row[hold.particle]), quantities[(bad - values) / 3], to,
                        at_rest_ ? ", the load factor" : " s"));
  }
  find_jumps(from, to, jumpers_, &fault);
  PetscCall(first_error(net_->comm, fault, text));
  PetscFunctionReturn(0);
}

PetscErrorCode Constraints::covers(double t_start, double t_end) const {
  constexpr int PARTS = 1000;
  const double part = (t_end - t_start) / PARTS;
  Error fault;
  PetscFunctionBegin;
  if (net_->anchors_total > 0) PetscCall(check_reach(net_->comm, "-bs_anchor_table", anchors_.drive, t_end, at_rest_));
  for (const Moved& one : motions_) PetscCall(check_reach(net_->comm, "-bs_motion_" + names_[one.group], one.drive, t_end, at_rest_));
  PetscCall(box_.reaches(t_end));
  for (int k = 0; k < PARTS; ++k) {
    const double from = t_start + k * part, to = k + 1 < PARTS ? t_start + (k + 1) * part : t_end;
    find_jumps(from, to, first_jumpers_, &fault);
    box_.find_jumps(from, to, &fault);
  }
  PetscCall(fail_if_any(net_->comm, fault));
  PetscFunctionReturn(0);
}

std::vector<std::string> Constraints::describe() const {
  std::vector<std::string> lines;
  for (const Moved& one : motions_)
    lines.push_back("group " + names_[one.group] + " (" + how_many(net_->groups[one.group].total, "particle") + "): " + one.drive.text());
  for (const std::string& line : box_.describe()) lines.push_back(line);
  if (net_->anchors_total > 0 && anchors_.active()) lines.push_back("anchors: " + anchors_.describe());
  return lines;
}

}  // namespace bs
