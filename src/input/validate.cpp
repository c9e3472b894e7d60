#include <algorithm>
#include <cinttypes>
#include <cmath>
#include "base/error.hpp"
#include "base/memory.hpp"
#include "input/adjust.hpp"
#include "input/hdf5_layout.hpp"
#include "lattice/columns.hpp"
#include "lattice/lattice.hpp"
#include "lattice/lattice_arrays.hpp"
#include "network/migrate.hpp"

namespace bs {

namespace {

std::size_t at(std::int64_t row) { return static_cast<std::size_t>(row); }

/// The words that begin a fault of one row: "F: particle 3" and, where the source is an HDF5 lattice, the dataset.
struct Place {
  std::string source;
  bool datasets;

  explicit Place(const Lattice& lattice) : source(lattice.source), datasets(lattice.has_datasets()) {}
  std::string row(const char* what, std::int64_t number, const char* group, const char* name) const {
    std::string text = source + ": " + what + " " + std::to_string(number);
    return datasets ? text + ", " + group + "/" + name : text;
  }
};

/// The k-th particle's number as the user knows it: of what is held as arrays, its row.
std::int64_t number(const Lattice& lattice, const Place& place, std::int64_t k) {
  return lattice.id.empty() || place.datasets || place.source == IN_MEMORY ? lattice.particles.first + k : lattice.id[at(k)];
}

const char* const TOO_LARGE = "its square cannot be computed; write at most 1e150, in other units if need be";

const char* remedy_for(double value, const char* remedy) { return std::isfinite(value) && !usable(value) ? TOO_LARGE : remedy; }

/// Whether every one of the `count` numbers from `values` is usable; `bad` receives the first that is not.
bool all_usable(const double* values, std::size_t count, double* bad) {
  for (std::size_t k = 0; k < count; ++k)
    if (!usable(values[k])) {
      *bad = values[k];
      return false;
    }
  return true;
}

void check_particle(const Lattice& l, const Place& place, std::int64_t k, Error* fault) {
  const std::size_t d = at(l.dim);
  const std::int64_t row = l.particles.first + k, id = number(l, place, k);
  const auto note = [&](const char* name, const char* what, double value, const char* remedy) {
    fault->note(row, place.row("particle", id, "/particles", name) + format(": %s %g; %s", what, value, remedy_for(value, remedy)));
  };
  double bad = 0;
  if (!all_usable(&l.position[at(k) * d], d, &bad)) note("position", "position", bad, "write finite coordinates [m]");
  if (!all_usable(&l.velocity[at(k) * d], d, &bad)) note("velocity", "velocity", bad, "write finite components [m/s]");
  const double mass = l.mass[at(k)];
  if (!(usable(mass) && mass > 0)) note("mass", "mass", mass, "write a finite mass > 0 [kg]; a particle that must not move is marked as fixed");
  for (const Column& column : l.particle_columns) {
    const ParticleParameter& one = particle_parameters[particle_parameter(column.name)];
    const std::size_t width = at(one.width(l.dim));
    const auto first = column.value.begin() + static_cast<std::ptrdiff_t>(at(k) * width);
    const auto wrong = [&](double value) { return !usable(value) || (value < 0 && one.nonnegative); };
    const auto found = std::find_if(first, first + static_cast<std::ptrdiff_t>(width), wrong);
    if (found == first + static_cast<std::ptrdiff_t>(width)) continue;
    const double value = *found;
    fault->note(row, l.source + ": particle " + std::to_string(id) + (column.path.empty() ? "" : ", " + column.path) +
                         format(": %s %g; ", one.name, value) +
                         remedy_for(value, format("write a finite %s%s [%s]", one.name, one.nonnegative ? " >= 0" : "", one.unit).c_str()));
  }
}

/// Stiffness, rest length (NaN passes where `nan_rest`) and damping of a spring or an anchor.
void check_numbers(const Place& place, const char* what, const char* group, std::int64_t row, double stiffness, double rest, bool nan_rest,
                   double damping, Error* fault) {
  const auto note = [&](const char* name, const char* label, double value, const char* remedy) {
    fault->note(row, place.row(what, row, group, name) + format(": %s %g; %s", label, value, remedy_for(value, remedy)));
  };
  if (!(usable(stiffness) && stiffness >= 0)) note("stiffness", "stiffness", stiffness, "write a finite number >= 0");
  if (!(usable(rest) && rest >= 0) && !(nan_rest && std::isnan(rest)))
    note("rest_length", "rest length", rest, "write a finite length >= 0 [m] (0: the zero-rest-length law)");
  if (!(usable(damping) && damping >= 0)) note("damping", "damping", damping, "write a finite number >= 0 [kg/s]");
}

/// Whether particle `end` exists; else says so.
bool exists(const Lattice& l, const Place& place, const char* what, const char* group, const char* name, std::int64_t row, std::int64_t end,
            Error* fault) {
  if (end >= 0 && end < l.particles.total) return true;
  fault->note(row, place.row(what, row, group, name) +
                       format(": there is no particle %" PRId64 "; write 0 to %" PRId64 " (particles count from 0)", end, l.particles.total - 1));
  return false;
}

void check_spring(const Lattice& l, const Place& place, std::int64_t k, Error* fault) {
  const std::int64_t row = l.springs.first + k, i = l.pairs[2 * at(k)], j = l.pairs[2 * at(k) + 1];
  if (!exists(l, place, "spring", "/springs", "pairs", row, i, fault)) return;
  if (!exists(l, place, "spring", "/springs", "pairs", row, j, fault)) return;
  bool apart = i != j;  // or joined to an image of itself
  for (int c = 0; c < l.dim && !l.shift.empty(); ++c) apart = apart || l.shift[at(k * l.dim + c)] != 0;
  if (!apart)
    fault->note(
        row, place.row("spring", row, "/springs", "pairs") + format(": joins particle %" PRId64 " to itself; give it two ends or leave it out", i));
  check_numbers(place, "spring", "/springs", row, l.stiffness[at(k)], l.rest_length[at(k)], true, l.damping[at(k)], fault);
  if (const double area = l.has_area() ? l.area.value[at(k)] : 1; !(usable(area) && area > 0))
    fault->note(row, l.source + format(": spring %" PRId64 ", %s: %g; write a finite area > 0 [m^2]", row, l.area.path.c_str(), area));
}

void check_anchor(const Lattice& l, const Place& place, std::int64_t k, Error* fault) {
  const std::int64_t row = l.anchors.first + k;
  const std::size_t d = at(l.dim);
  double bad = 0;
  if (!exists(l, place, "anchor", "/anchors", "particle", row, l.anchor_particle[at(k)], fault)) return;
  if (!all_usable(&l.anchor_point[at(k) * d], d, &bad))
    fault->note(row, place.row("anchor", row, "/anchors", "point") + format(": point %g; %s", bad, remedy_for(bad, "write finite coordinates [m]")));
  check_numbers(place, "anchor", "/anchors", row, l.anchor_stiffness[at(k)], l.anchor_rest_length[at(k)], false, l.anchor_damping[at(k)], fault);
}

double distance(const double* a, const double* b, int dim) {
  double sum = 0;
  for (int k = 0; k < dim; ++k) sum = std::hypot(sum, a[k] - b[k]);
  return sum;
}

/// What is wrong with a spring of length 0; empty if nothing.
std::string fault_of_zero_length(const Lattice& l, double rest, double damping) {
  if (std::isnan(rest)) return "so the initial distance cannot be its rest length; give it a rest length or move an end";
  if (rest != 0) return format("its rest length is %g; move an end, or write rest length 0", rest);
  if (damping > 0 && l.damping_law == DampingLaw::axial) return "so its axial damping has no direction; write -bs_damping_law simple, or damping 0";
  return {};
}

}  // namespace

PetscErrorCode check_sizes(MPI_Comm comm, const std::string& source, std::int64_t particles, int dim, std::int64_t springs, std::int64_t anchors) {
  const std::int64_t most = PETSC_MAX_INT;
  const char* const remedy = "use a PETSc with 64-bit indices (cmake -DBS_PETSC_MODULE=PETSc64)";
  PetscFunctionBegin;
  if (particles <= 0) PetscCall(fail(comm, Exit::input, source + ": has no particles; write at least one"));
  if (particles > most / (std::int64_t{2} * dim))
    PetscCall(fail(comm, Exit::input,
                   format("%s: %" PRId64 " particles in %d dimensions have more unknowns than PETSc's indices can count "
                          "(%" PRId64 "); %s, and have at least %s of memory for setting them up",
                          source.c_str(), particles, dim, most, remedy, in_bytes(lattice_bytes({particles, springs, anchors, dim}, 1)).c_str())));
  for (const std::int64_t count : {springs, anchors})
    if (count > most)
      PetscCall(
          fail(comm, Exit::input,
               format("%s: %" PRId64 " springs are more than PETSc's indices can count (%" PRId64 "); %s", source.c_str(), count, most, remedy)));
  PetscFunctionReturn(0);
}

/// Chunk-local checks: finite positions and velocities, mass > 0, columns in their range, ends of springs and anchors
/// that exist and differ, stiffness, damping, rest length >= 0 and finite (NaN of a spring: the initial distance).
static PetscErrorCode check_values(MPI_Comm comm, const Lattice& l) {
  const Place place(l);
  Error particles, springs, anchors;
  PetscFunctionBegin;
  for (std::int64_t k = 0; k < l.particles.count && !particles; ++k) check_particle(l, place, k, &particles);
  PetscCall(fail_if_any(comm, particles));
  for (std::int64_t k = 0; k < l.springs.count && !springs; ++k) check_spring(l, place, k, &springs);
  PetscCall(fail_if_any(comm, springs));
  for (std::int64_t k = 0; k < l.anchors.count && !anchors; ++k) check_anchor(l, place, k, &anchors);
  PetscCall(fail_if_any(comm, anchors));
  PetscFunctionReturn(0);
}

/// Initial distance [m] between the ends of each spring, and between particle and point of each anchor, of
/// this chunk. Needs ends that exist.
static PetscErrorCode initial_lengths(MPI_Comm comm, const Lattice& l, std::vector<double>* springs, std::vector<double>* anchors) {
  const std::size_t d = at(l.dim);
  std::vector<double> ends;
  PetscFunctionBegin;
  PetscCall(fetch_rows(comm, l.particles, l.position, l.dim, l.pairs, &ends));
  springs->resize(at(l.springs.count));
  for (std::size_t k = 0; k < l.shift.size(); ++k)  // the second ends' images
    for (std::size_t c = 0; c < d; ++c) ends[(2 * (k / d) + 1) * d + c] += static_cast<double>(l.shift[k]) * l.box.edges[k % d * d + c];
  for (std::size_t k = 0; k < springs->size(); ++k) (*springs)[k] = distance(&ends[2 * k * d], &ends[(2 * k + 1) * d], l.dim);
  PetscCall(fetch_rows(comm, l.particles, l.position, l.dim, l.anchor_particle, &ends));
  anchors->resize(at(l.anchors.count));
  for (std::size_t k = 0; k < anchors->size(); ++k) (*anchors)[k] = distance(&ends[k * d], &l.anchor_point[k * d], l.dim);
  PetscFunctionReturn(0);
}

/// Springs and anchors whose ends are at one place need a rest length of 0, and damping that has a direction.
static PetscErrorCode check_lengths(MPI_Comm comm, const Lattice& l, const std::vector<double>& springs, const std::vector<double>& anchors) {
  const Place place(l);
  Error of_spring, of_anchor;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < springs.size(); ++k) {
    if (springs[k] != 0 || l.rest_at_zero_length) continue;
    const std::string text = fault_of_zero_length(l, l.rest_length[k], l.damping[k]);
    const std::int64_t row = l.springs.first + static_cast<std::int64_t>(k);
    if (!text.empty() && !of_spring)
      of_spring.note(row, format("%s: spring %" PRId64 ": its ends, particles %" PRId64 " and %" PRId64 " (from 0), are at "
                                 "one place, %s",
                                 l.source.c_str(), row, l.pairs[2 * k], l.pairs[2 * k + 1], text.c_str()));
  }
  PetscCall(fail_if_any(comm, of_spring));
  for (std::size_t k = 0; k < anchors.size(); ++k) {
    if (anchors[k] != 0) continue;
    const std::string text = fault_of_zero_length(l, l.anchor_rest_length[k], l.anchor_damping[k]);
    const std::int64_t row = l.anchors.first + static_cast<std::int64_t>(k);
    if (!text.empty() && !of_anchor)
      of_anchor.note(row, format("%s: anchor %" PRId64 ": its point is where particle %" PRId64 " (from 0) is, %s", l.source.c_str(), row,
                                 l.anchor_particle[k], text.c_str()));
  }
  PetscCall(fail_if_any(comm, of_anchor));
  PetscFunctionReturn(0);
}

PetscErrorCode validate(MPI_Comm comm, Lattice* l) {
  std::vector<double> springs, anchors;
  PetscFunctionBegin;
  PetscCall(check_sizes(comm, l->source, l->particles.total, l->dim, l->springs.total, l->anchors.total));
  PetscCall(check_values(comm, *l));
  PetscCall(initial_lengths(comm, *l, &springs, &anchors));
  PetscCall(check_lengths(comm, *l, springs, anchors));
  PetscCall(check_interactions(comm, *l));
  for (std::size_t k = 0; k < springs.size(); ++k)
    if (std::isnan(l->rest_length[k])) l->rest_length[k] = springs[k];
  PetscFunctionReturn(0);
}

}  // namespace bs
