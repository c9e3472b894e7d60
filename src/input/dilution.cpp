#include "input/dilution.hpp"
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/hash.hpp"
#include "base/text.hpp"
#include "input/remote.hpp"
#include "network/migrate.hpp"

namespace bs {

namespace {

template <class T>
void keep_rows(const std::vector<std::uint8_t>& keep, int width, std::vector<T>* values) {
  std::size_t to = 0;
  if (values->empty()) return;
  for (std::size_t row = 0; row < keep.size(); ++row)
    for (std::size_t k = 0; keep[row] && k < static_cast<std::size_t>(width); ++k)
      (*values)[to++] = (*values)[row * static_cast<std::size_t>(width) + k];
  values->resize(to);
  values->shrink_to_fit();
}

/// Finds the threshold below which `wanted` of the numbers of all ranks lie (fewer where several numbers equal the threshold); `below` counts those
/// that do. Numbers are multiples of 2^-53, so that 53 bisections of [0, 1) find it; each looks only at those of this rank's numbers that are still
/// undecided.
PetscErrorCode find_threshold(MPI_Comm comm, std::vector<double> drawn, std::int64_t wanted, double* value, std::int64_t* below) {
  double low = 0, high = 1;
  std::size_t first = 0, last = drawn.size();
  PetscFunctionBegin;
  *below = 0;
  for (int bit = 0; bit < 53; ++bit) {
    const double middle = (low + high) / 2;
    const auto begin = drawn.begin();
    const auto split = std::partition(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last),
                                      [middle](double one) { return one < middle; });
    std::int64_t less = split - begin;
    PetscCall(sum_over_ranks(comm, &less));
    if (less <= wanted) {
      low = middle;
      first = static_cast<std::size_t>(split - begin);
      *below = less;
    } else {
      high = middle;
      last = static_cast<std::size_t>(split - begin);
    }
  }
  *value = low;
  PetscFunctionReturn(0);
}

/// Sets keep[k] to whether spring k of this rank stays, given the random number drawn[k] that was drawn for it.
PetscErrorCode choose_springs(MPI_Comm comm, const GeneratorSpec& spec, const Rows& springs, const std::vector<double>& drawn,
                              std::vector<std::uint8_t>* keep) {
  double threshold = spec.remove_fraction;
  std::int64_t below = 0, equal = 0;
  PetscFunctionBegin;
  keep->resize(drawn.size());
  if (!spec.remove_each) {
    const std::int64_t wanted = std::llround(spec.remove_fraction * static_cast<double>(springs.total));
    PetscCall(find_threshold(comm, drawn, wanted, &threshold, &below));
    Rows same;  // springs whose number equals the threshold: as many of them as are still wanted are removed, the first ones
    same.count = std::count(drawn.begin(), drawn.end(), threshold);
    PetscCall(number_rows(comm, &same));
    equal = wanted - below - same.first;
  }
  for (std::size_t k = 0; k < drawn.size(); ++k) (*keep)[k] = !(drawn[k] < threshold || (drawn[k] == threshold && equal-- > 0));
  PetscFunctionReturn(0);
}

/// A spring named by what it joins: its lower row, its higher row, and the periodic image (three shifts) that the higher one is in.
using Leg = std::array<std::int64_t, 5>;

/// The spring from row a to row b in the image `box`, turned so that it leads to the higher row (between images of one particle: to the greater
/// shift).
Leg leg_between(std::int64_t a, std::int64_t b, std::array<std::int64_t, 3> box) {
  const bool up = a != b ? a < b : box > std::array<std::int64_t, 3>{};
  if (!up) {
    std::swap(a, b);
    for (std::int64_t& s : box) s = -s;
  }
  return {a, b, box[0], box[1], box[2]};
}

struct LegQuestion {
  Leg leg;
  std::int64_t angle;  ///< index of the angle spring on the rank that asks
  int asker;
};

}  // namespace

void keep_springs(const std::vector<std::uint8_t>& keep, Lattice* l) {
  keep_rows(keep, 2, &l->pairs);
  keep_rows(keep, 1, &l->stiffness);
  keep_rows(keep, 1, &l->rest_length);
  keep_rows(keep, 1, &l->damping);
  keep_rows(keep, l->dim, &l->shift);
  l->springs.count = static_cast<std::int64_t>(l->stiffness.size());
}

void keep_angles(const std::vector<std::uint8_t>& keep, Lattice* l) {
  InteractionRows& angles = l->interactions[0];
  keep_rows(keep, 3, &angles.ends);
  keep_rows(keep, 3 * l->dim, &angles.shift);
  keep_rows(keep, 2, &angles.parameter);
  for (Column& column : angles.break_columns) keep_rows(keep, 1, &column.value);
  angles.rows.count = static_cast<std::int64_t>(angles.ends.size() / 3);
}

PetscErrorCode keep_angles_along_springs(MPI_Comm comm, Lattice* l) {
  Chunks chunks;
  std::vector<LegQuestion> asked, received;
  std::vector<Leg> there;
  std::vector<std::int64_t> gone;
  PetscFunctionBegin;
  if (l->interactions.empty()) PetscFunctionReturn(0);
  InteractionRows& angles = l->interactions[0];
  const std::size_t d = static_cast<std::size_t>(l->dim);
  const auto box_of = [d](const std::vector<std::int64_t>& shift, std::size_t end) {
    std::array<std::int64_t, 3> box{};
    for (std::size_t k = 0; k < d && !shift.empty(); ++k) box[k] = shift[end * d + k];
    return box;
  };
  for (std::size_t s = 0; s < l->stiffness.size(); ++s) there.push_back(leg_between(l->pairs[2 * s], l->pairs[2 * s + 1], box_of(l->shift, s)));
  std::sort(there.begin(), there.end());
  const int rank = rank_of(comm);
  for (std::size_t e = 0; e + 1 < angles.ends.size(); ++e) {
    if (e % 3 == 2) continue;  // an angle of three ends has two legs: none begins at the third end
    std::array<std::int64_t, 3> box = box_of(angles.shift, e + 1), from = box_of(angles.shift, e);
    for (std::size_t k = 0; k < 3; ++k) box[k] -= from[k];
    asked.push_back({leg_between(angles.ends[e], angles.ends[e + 1], box), static_cast<std::int64_t>(e / 3), rank});
  }
  PetscCall(gather_chunks(comm, *l, &chunks));
  PetscCall(exchange(
      comm, asked.size(), [&](std::size_t k) { return static_cast<std::size_t>(chunks.owner(asked[k].leg[0])); },
      [&](std::size_t k) { return asked[k]; }, &received));
  received.erase(
      std::remove_if(received.begin(), received.end(), [&](const LegQuestion& q) { return std::binary_search(there.begin(), there.end(), q.leg); }),
      received.end());
  PetscCall(exchange(
      comm, received.size(), [&](std::size_t k) { return static_cast<std::size_t>(received[k].asker); },
      [&](std::size_t k) { return received[k].angle; }, &gone));
  std::vector<std::uint8_t> keep(angles.ends.size() / 3, 1);
  for (const std::int64_t a : gone) keep[static_cast<std::size_t>(a)] = 0;
  keep_angles(keep, l);
  PetscFunctionReturn(0);
}

PetscErrorCode remove_springs(MPI_Comm comm, const GeneratorSpec& spec, Lattice* l) {
  std::vector<std::uint8_t> keep;
  PetscFunctionBegin;
  if (spec.remove_fraction <= 0) PetscFunctionReturn(0);
  PetscCall(number_rows(comm, &l->springs));
  const std::int64_t before = l->springs.total;
  std::vector<double> drawn(static_cast<std::size_t>(l->springs.count));
  for (std::size_t k = 0; k < drawn.size(); ++k)
    drawn[k] = hash_uniform(spec.seed, Stream::removal, l->springs.first + static_cast<std::int64_t>(k), 0);
  PetscCall(choose_springs(comm, spec, l->springs, drawn, &keep));
  keep_springs(keep, l);
  PetscCall(number_rows(comm, &l->springs));
  PetscCall(keep_angles_along_springs(comm, l));
  const std::int64_t gone = before - l->springs.total;
  l->springs_generated = before;
  l->springs_removed = gone;
  l->source += format(", %" PRId64 " of %" PRId64 " springs removed (%s)", gone, before,
                      short_number(before ? static_cast<double>(gone) / static_cast<double>(before) : 0).c_str());
  PetscFunctionReturn(0);
}

}  // namespace bs
