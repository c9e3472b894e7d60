#include "systems/particles/nodal_forces.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "input/adjust.hpp"
#include "lattice/columns.hpp"
#include "physics/vector.hpp"
#include "systems/particles/constraints/cell.hpp"

namespace bs {

namespace {

constexpr std::size_t COLUMN = particle_parameter("force");
const char* const FORMS = "write a number [N], expression:TEXT in t or table:FILE for each component, and total at the end to share the force";

/// Squares of forces are summed: they must not overflow.
bool read_force(const std::string& word, double* value) {
  constexpr double LARGEST = 1e150;
  return read_number(word, value) && std::abs(*value) <= LARGEST;
}

bool begins(const std::string& word, const char* with) { return word.rfind(with, 0) == 0; }

}  // namespace

PetscErrorCode NodalForces::read(MPI_Comm comm, const Lattice& l) {
  static const char help[] =
      "force on every particle of the group NAME, fx[,fy[,fz]], or in all on the group with ,total behind it; each a number, expression:TEXT in t, "
      "x0, "
      "y0, z0, or table:FILE (rows t,f); static analyses: numbers grow with the load factor, which is t [N]";
  GroupOptions texts;

  PetscFunctionBegin;
  for (const Group& group : l.groups) names_.push_back(group.name);
  PetscCall(read_options_of_groups(comm, l, "bs_force_", "Forces on groups", help, &texts));
  for (const auto& [group, text] : texts) {
    Given one;
    one.group = group;
    one.text = text;
    PetscCall(parse(comm, option_of(one), l.dim, &one));
    varies_ = varies_ || one.varies;
    given_.push_back(std::move(one));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode NodalForces::parse(MPI_Comm comm, const std::string& option, int dim, Given* out) const {
  std::vector<std::string> words = split(out->text, ',');
  std::string drive;

  PetscFunctionBegin;
  out->shared = words.back() == "total";
  if (out->shared) words.pop_back();
  if (words.empty() || words.size() > static_cast<std::size_t>(dim))
    PetscCall(fail(comm, Exit::input,
                   format("option %s: %s in %s: give 1 to %d of them [N]", option.c_str(),
                          how_many(static_cast<std::int64_t>(words.size()), "component").c_str(), how_many(dim, "dimension").c_str(), dim)));
  for (std::size_t c = 0; c < words.size(); ++c) {
    const bool follows = begins(words[c], "expression:") || begins(words[c], "table:");
    if (!follows && !read_force(words[c], &out->constant[c]))
      PetscCall(fail(comm, Exit::input, "option " + option + ": '" + shown_text(words[c]) + "' is no finite force: " + FORMS));
    out->varies = out->varies || follows;
    drive += std::string(c > 0 ? "," : "") + static_cast<char>('x' + static_cast<char>(c)) + "=" + (follows ? words[c] : "free");
  }
  if (!out->varies) PetscFunctionReturn(0);
  PetscCall(read_drive(comm, option, "", drive, dim, true, &out->drive));
  PetscFunctionReturn(0);
}

PetscErrorCode NodalForces::create(const Network& net) {
  const std::size_t d = static_cast<std::size_t>(net.dim);
  std::vector<std::vector<Share>> of(static_cast<std::size_t>(net.n));
  std::vector<double> sum(of.size() * d, 0.0);
  std::vector<std::uint8_t> acts(of.size(), 0);

  PetscFunctionBegin;
  net_ = &net;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const double* own = net.columns(i).vector(COLUMN);
    if (!own || std::all_of(own, own + d, [](double f) { return f == 0; })) continue;
    std::copy_n(own, d, &sum[i * d]);
    acts[i] = 1;
    ++rows_;
  }
  for (std::size_t g = 0; g < given_.size(); ++g) {
    const Given& one = given_[g];
    const NetworkGroup& group = net.groups[one.group];
    const double weight = one.shared ? 1 / static_cast<double>(group.total) : 1;
    for (const PetscInt i : group.member) {
      if (i >= net.n) break;
      const std::size_t at = static_cast<std::size_t>(i);
      for (std::size_t c = 0; c < d; ++c) sum[at * d + c] += weight * one.constant[c];
      if (one.varies) of[at].push_back({g, weight});
      acts[at] = 1;
    }
  }
  first_.push_back(0);
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (!acts[i]) continue;
    if (!net.fixed[i]) slots_[net.boundary(static_cast<PetscInt>(i))].push_back(loaded_.size());
    loaded_.push_back(static_cast<PetscInt>(i));
    constant_.insert(constant_.end(), &sum[i * d], &sum[i * d] + d);
    shares_.insert(shares_.end(), of[i].begin(), of[i].end());
    first_.push_back(shares_.size());
  }
  PetscCall(sum_over_ranks(net.comm, &rows_));
  active_ = rows_ > 0 || !given_.empty();
  PetscFunctionReturn(0);
}

void NodalForces::set_static(double s, bool grow) {
  static_ = true;
  grow_ = grow;
  load_ = grow ? s : 1;
}

void NodalForces::list_drives(std::vector<Drive*>* all) {
  for (Given& one : given_) all->push_back(&one.drive);
}

void NodalForces::add_varying(std::size_t k, double t, double* f) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (std::size_t e = first_[k]; e < first_[k + 1]; ++e) {
    double one[3] = {0, 0, 0};
    given_[shares_[e].given].drive.displacement(grow_ ? t : 1, &net_->held[static_cast<std::size_t>(loaded_[k]) * d], one);
    for (std::size_t c = 0; c < d; ++c) f[c] += shares_[e].weight * one[c];
  }
}

void NodalForces::force(std::size_t k, double t, double* f) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (std::size_t c = 0; c < d; ++c) f[c] = load_ * constant_[k * d + c];
  add_varying(k, t, f);
}

void NodalForces::varying(std::size_t k, double t, double* f) const {
  std::fill_n(f, net_->dim, 0.0);
  if (!static_) add_varying(k, t, f);
}

// -f.(x - x0) of what has a potential
double NodalForces::energy_of(std::size_t k, double t, const LocalState& state) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim), i = static_cast<std::size_t>(loaded_[k]);
  double f[3], sum = 0;
  for (std::size_t c = 0; c < d; ++c) f[c] = load_ * constant_[k * d + c];
  if (static_) add_varying(k, t, f);
  for (std::size_t c = 0; c < d; ++c) sum -= f[c] * (state.at(loaded_[k])[c] - net_->held[i * d + c]);
  return sum;
}

void NodalForces::forces(Part part, double t, const LocalState& state, double* f, Singularity*, Energies* sum) const {
  for (const std::size_t k : slots_[static_cast<int>(part)]) {
    double one[3];
    force(k, t, one);
    for (int c = 0; c < net_->dim; ++c) f[loaded_[k] * net_->dim + c] += one[c];
  }
  if (sum && part == Part::boundary) energies(t, state, sum);
}

void NodalForces::forces_on(const std::vector<PetscInt>& which, double t, const LocalState&, double* f) const {
  auto from = loaded_.begin();
  for (std::size_t w = 0; w < which.size(); ++w) {
    from = std::lower_bound(from, loaded_.end(), which[w]);
    if (from == loaded_.end() || *from != which[w]) continue;
    double one[3];
    force(static_cast<std::size_t>(from - loaded_.begin()), t, one);
    for (int c = 0; c < net_->dim; ++c) f[static_cast<PetscInt>(w) * net_->dim + c] += one[c];
  }
}

void NodalForces::energies(double t, const LocalState& state, Energies* sum) const {
  double all = 0;
  for (std::size_t k = 0; k < loaded_.size(); ++k)
    if (net_->fixed[loaded_[k]] != 1) all += energy_of(k, t, state);
  sum->field += all;
}

void NodalForces::supply(double t, const LocalState& state, Supply* sum) const {
  for (std::size_t k = 0; k < loaded_.size(); ++k) {
    if (net_->fixed[loaded_[k]] == 1) continue;
    double one[3];
    force(k, t, one);
    for (int c = 0; c < net_->dim; ++c) sum->field += one[c] * state.at(loaded_[k])[net_->dim + c];
  }
}

void NodalForces::outer_sizes(double t, const LocalState&, double* size) const {
  for (const auto& part : slots_)
    for (const std::size_t k : part) {
      double one[3] = {0, 0, 0};
      force(k, t, one);
      size[loaded_[k]] += std::hypot(one[0], one[1], one[2]);
    }
}

PetscErrorCode NodalForces::observe(double t, const LocalState& state, std::vector<Observable>* out) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim), groups = net_->groups.size();
  constexpr std::size_t WIDTH = 7;  // force, moment, and whether some act
  std::vector<double> each(loaded_.size() * WIDTH, 0.0), sums((groups + 1) * WIDTH, 0.0);

  PetscFunctionBegin;
  for (std::size_t k = 0; k < loaded_.size(); ++k) {
    double x[3] = {0, 0, 0}, *f = &each[k * WIDTH];
    force(k, t, f);
    std::copy_n(state.at(loaded_[k]), d, x);
    for (int c = 0; c < 3; ++c) f[3 + c] = x[(c + 1) % 3] * f[(c + 2) % 3] - x[(c + 2) % 3] * f[(c + 1) % 3];
    f[6] = 1;
    for (std::size_t q = 0; q < WIDTH; ++q) sums[q] += f[q];
  }
  for (std::size_t g = 0; g < groups; ++g)
    for (const PetscInt i : net_->groups[g].member) {
      const auto at = std::lower_bound(loaded_.begin(), loaded_.end(), i);
      if (at == loaded_.end() || *at != i) continue;
      for (std::size_t q = 0; q < WIDTH; ++q) sums[(g + 1) * WIDTH + q] += each[static_cast<std::size_t>(at - loaded_.begin()) * WIDTH + q];
    }
  PetscCall(sum_over_ranks(net_->comm, sums.data(), sums.size()));
  for (const bool moment : {false, true})
    for (std::size_t g = 0; g <= groups; ++g) {
      const double* s = &sums[g * WIDTH];
      if (s[6] == 0) continue;
      const std::string name = std::string(moment ? "moment" : "force") + (g > 0 ? "/" + net_->groups[g - 1].name : "");
      out->push_back({name, moment ? std::vector<double>(s + 3, s + 6) : std::vector<double>(s, s + d)});
    }
  PetscFunctionReturn(0);
}

PetscErrorCode NodalForces::covers(double t_end) const {
  PetscFunctionBegin;
  for (const Given& one : given_)
    if (one.varies) PetscCall(check_reach(net_->comm, option_of(one), one.drive, t_end, static_));
  PetscFunctionReturn(0);
}

PetscErrorCode NodalForces::foresee(double t, std::string* text) const {
  Error fault;
  PetscFunctionBegin;
  if (!varies_) PetscFunctionReturn(0);
  for (std::size_t k = 0; k < loaded_.size(); ++k) {
    double f[3] = {0, 0, 0};
    add_varying(k, t, f);
    if (first_[k] == first_[k + 1] || std::isfinite(f[0] + f[1] + f[2])) continue;
    const std::int64_t row = net_->row[loaded_[k]];
    fault.note(
        row,
        format("option %s: the force on particle %lld is not finite at t = %.10g%s: give one that is finite from the start to the end of the run",
               option_of(given_[shares_[first_[k]].given]).c_str(), static_cast<long long>(row), t, static_ ? ", the load factor" : " s"));
  }
  PetscCall(first_error(net_->comm, fault, text));
  PetscFunctionReturn(0);
}

std::vector<std::string> NodalForces::describe() const {
  std::vector<std::string> lines;
  if (rows_ > 0) lines.push_back("forces of the lattice on " + how_many(rows_, "particle"));
  for (const Given& one : given_) {
    const NetworkGroup& group = net_->groups[one.group];
    lines.push_back("force on group " + group.name + " (" + how_many(group.total, "particle") + "): " + one.text + " N" +
                    (one.shared ? "" : " on each"));
  }
  return lines;
}

}  // namespace bs
