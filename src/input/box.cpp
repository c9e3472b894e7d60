#include <algorithm>
#include <cinttypes>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "input/hdf5_layout.hpp"
#include "lattice/spring_laws.hpp"
#include "network/migrate.hpp"

namespace bs {

namespace {

std::size_t at(std::int64_t row) { return static_cast<std::size_t>(row); }

/// A trajectory that says nothing has no periodic box.
PetscErrorCode read_boundary(MPI_Comm comm, const Hdf5File& file, const std::string& group, bool trajectory, Lattice* l) {
  std::vector<std::string> words;
  PetscFunctionBegin;
  PetscCall(file.words_attribute(group, "boundary", &words));
  if (words.empty() && trajectory) PetscFunctionReturn(0);
  // of a trajectory padded to three components the first d count
  if (words.empty() || static_cast<int>(words.size()) < l->dim)
    PetscCall(fail(comm, Exit::input,
                   format("%s: attribute boundary of %s has %s; write %d, periodic or none along each edge", l->source.c_str(), group.c_str(),
                          how_many(static_cast<std::int64_t>(words.size()), "word").c_str(), l->dim)));
  for (int k = 0; k < l->dim; ++k) {
    const std::string& word = words[at(k)];
    if (word != "periodic" && word != "none")
      PetscCall(fail(comm, Exit::input, l->source + ": attribute boundary of " + group + " has '" + word + "'; write periodic or none"));
    l->box.periodic[k] = word == "periodic";
  }
  PetscFunctionReturn(0);
}

/// (d, d), or (d) the lengths of orthogonal edges; of a trajectory the last frame of (T, D, D) or (T, D).
PetscErrorCode read_edges(MPI_Comm comm, const Hdf5File& file, const std::string& path, bool frames, Lattice* l) {
  const int d = l->dim;
  PetscFunctionBegin;
  if (!file.has(path))
    PetscCall(fail(comm, Exit::input, l->source + ": " + path + " is missing; write the edge vectors of the periodic box as rows [m]"));
  const H5 set(H5Dopen2(file.id(), path.c_str(), H5P_DEFAULT), H5Dclose);
  const H5 space(set < 0 ? H5I_INVALID_HID : H5Dget_space(set), H5Sclose);
  hsize_t extent[H5S_MAX_RANK] = {0};
  const int rank = space < 0 ? -1 : H5Sget_simple_extent_dims(space, extent, nullptr), lead = frames ? 1 : 0;
  const hsize_t D = rank > lead ? extent[lead] : 0;
  const bool square = rank == lead + 2 && extent[lead + 1] == D, flat = rank == lead + 1;
  if (!(square || flat) || D < static_cast<hsize_t>(d) || D > 3 || (frames && extent[0] == 0) || (!frames && D != static_cast<hsize_t>(d)))
    PetscCall(fail(
        comm, Exit::input,
        format("%s: %s has the wrong shape; write (%d, %d), rows the edge vectors of the periodic box [m]", l->source.c_str(), path.c_str(), d, d)));
  Table table;
  TableShape shape;
  shape.rows = static_cast<std::int64_t>(D);
  shape.columns = square ? static_cast<int>(D) : 0;
  shape.frames = frames;
  std::vector<double> last;
  PetscCall(file.find(path, shape, &table));
  PetscCall(file.read(table, 0, shape.rows, 0, &last));
  for (int k = 0; k < d; ++k)
    for (int c = 0; c < d; ++c) l->box.edges[at(k * d + c)] = square ? last[at(k) * D + at(c)] : k == c ? last[at(k)] : 0.0;
  if (!complete_edges(&l->box, d))
    PetscCall(fail(comm, Exit::input,
                   l->source + ": " + path + ": the edges span no volume; write finite vectors [m] that do not lie in one plane or line"));
  PetscFunctionReturn(0);
}

/// What joins particles in a periodic box: ends (count, width) and the boxes (count, width - first, d) that those from the one numbered `first` on
/// are in.
struct Joined {
  std::string title, dataset;
  const Rows& rows;
  const std::vector<std::int64_t>& ends;
  int width, first, center;  ///< center: the end that the nearest images of the others are sought at
  std::vector<std::int64_t>* shift;
};

std::vector<Joined> all_joined(bool trajectory, const std::string& springs, Lattice* l) {
  std::vector<Joined> all = {{"spring", springs, l->springs, l->pairs, 2, 1, 0, &l->shift}};
  for (std::size_t kind = 0; kind < l->interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    InteractionRows& rows = l->interactions[kind];
    all.push_back({schema.title, parameter_path(schema, "shift", trajectory), rows.rows, rows.ends, schema.ends, 0, schema.center, &rows.shift});
  }
  return all;
}

/// Images are numbered up to 63, and only where space is repeated.
PetscErrorCode check_range(MPI_Comm comm, const Joined& joined, const Lattice& l) {
  const std::int64_t width = std::int64_t{l.dim} * (joined.width - joined.first);
  Error fault;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < joined.shift->size() && !fault; ++k) {
    const std::int64_t row = joined.rows.first + static_cast<std::int64_t>(k) / width, s = (*joined.shift)[k];
    const bool open = !l.box.periodic[k % at(l.dim)];
    if (s < -image::MOST || s > image::MOST || (open && s != 0))
      fault.note(row, format("%s: %s %" PRId64 ", %s: a shift of %" PRId64 " boxes; write %s", l.source.c_str(), joined.title.c_str(), row,
                             joined.dataset.c_str(), s, open ? "0 along edges that are not periodic" : "-63 to 63"));
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode read_shifts(MPI_Comm comm, const Hdf5File& file, const Joined& joined, Lattice* l) {
  const int ends = joined.width - joined.first;
  Table table;
  TableShape shape;
  PetscFunctionBegin;
  if (!file.has(joined.dataset) || joined.rows.total == 0) PetscFunctionReturn(0);
  shape.integers = true;
  shape.rows = joined.rows.total;
  shape.row_name = "M";
  shape.columns = l->dim * ends;
  PetscCall(file.find(joined.dataset, shape, &table));
  PetscCall(file.read(table, joined.rows.first, joined.rows.count, 0, joined.shift));
  PetscCall(check_range(comm, joined, *l));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode check_shifts(MPI_Comm comm, Lattice* l) {
  PetscFunctionBegin;
  for (const Joined& one : all_joined(false, "/springs/shift", l)) PetscCall(check_range(comm, one, *l));
  PetscFunctionReturn(0);
}

PetscErrorCode read_hdf5_box(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& names, Lattice* l) {
  const std::string group = names.trajectory ? "/particles/trajectory/box" : "/box";
  PetscFunctionBegin;
  if (!file.has(group)) PetscFunctionReturn(0);
  PetscCall(read_boundary(comm, file, group, names.trajectory, l));
  if (!l->box.active()) PetscFunctionReturn(0);
  PetscCall(read_edges(comm, file, group + (names.trajectory ? "/edges/value" : "/edges"), names.trajectory, l));
  for (const Joined& one : all_joined(names.trajectory, names.column("shift"), l)) PetscCall(read_shifts(comm, file, one, l));
  PetscFunctionReturn(0);
}

/// Nearest images; a tie has no answer.
static PetscErrorCode find_shifts(MPI_Comm comm, const Joined& joined, const Lattice& l) {
  const std::size_t d = at(l.dim), width = at(joined.width), first = at(joined.first), center = at(joined.center);
  std::vector<double> ends;
  const NearestImages nearest(l.box, l.dim);
  Error fault;
  PetscFunctionBegin;
  // an end that does not exist is reported later, with its place
  bool wrong = std::any_of(joined.ends.begin(), joined.ends.end(), [&](std::int64_t row) { return row < 0 || row >= l.particles.total; });
  PetscCall(on_some_rank(comm, wrong, &wrong));
  joined.shift->assign(at(joined.rows.count) * (width - first) * d, 0);
  if (wrong) PetscFunctionReturn(0);
  PetscCall(fetch_rows(comm, l.particles, l.position, l.dim, joined.ends, &ends));
  for (std::size_t item = 0; item < joined.ends.size(); ++item) {
    const std::size_t k = item / width, a = item % width, from = k * width + center;
    const std::int64_t row = joined.rows.first + static_cast<std::int64_t>(k);
    double dx[3] = {0, 0, 0}, square = 0;
    std::int64_t shift[3] = {0, 0, 0};
    if (a == center || joined.ends[item] == joined.ends[from]) continue;  // an end twice is refused later
    for (std::size_t c = 0; c < d; ++c) {
      dx[c] = ends[item * d + c] - ends[from * d + c];
      for (std::size_t e = 0; e < d; ++e) square += l.box.edges[e * d + c] * l.box.edges[e * d + c];
    }
    const double further = nearest.find(dx, shift);
    double length = 0;
    for (std::size_t c = 0; c < d; ++c) {
      double x = dx[c];
      for (std::size_t e = 0; e < d; ++e) x += static_cast<double>(shift[e]) * l.box.edges[e * d + c];
      length = std::hypot(length, x);
    }
    // as near as the square of the length can tell, which the rounding of places in a large box blurs
    if (further < length * (1e-9 * length + 8 * PETSC_MACHINE_EPSILON * std::sqrt(square)) && !fault)
      fault.note(row, format("%s: %s %" PRId64 ": two images of particle %" PRId64 " are equally near to particle %" PRId64
                             ", so it is not known which one it joins; write %s",
                             l.source.c_str(), joined.title.c_str(), row, joined.ends[item], joined.ends[from], joined.dataset.c_str()));
    for (std::size_t c = 0; c < d; ++c) (*joined.shift)[((k * (width - first)) + a - first) * d + c] = shift[c];
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

/// Images are numbered as seen from any end.
static PetscErrorCode check_reach(MPI_Comm comm, const Joined& joined, const Lattice& l) {
  const std::size_t d = at(l.dim), ends = at(joined.width - joined.first), size = ends * d;
  Error fault;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < joined.shift->size() && !fault; ++k) {
    const std::int64_t* row = joined.shift->data() + k / size * size;
    for (std::size_t a = 0; a < ends && !fault; ++a)
      if (std::abs((*joined.shift)[k] - (joined.first > 0 ? 0 : row[a * d + k % d])) > image::MOST)
        fault.note(joined.rows.first + static_cast<std::int64_t>(k / size),
                   format("%s: %s %" PRId64 ": its ends are more than 63 boxes apart; write positions nearer to each other, or edges that lean less",
                          l.source.c_str(), joined.title.c_str(), joined.rows.first + static_cast<std::int64_t>(k / size)));
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode choose_images(MPI_Comm comm, Lattice* l) {
  PetscFunctionBegin;
  if (!l->box.active()) PetscFunctionReturn(0);
  for (const Joined& one : all_joined(false, "/springs/shift", l)) {
    std::int64_t given = static_cast<std::int64_t>(one.shift->size());
    PetscCall(sum_over_ranks(comm, &given));
    if (given == 0 && one.rows.total > 0) PetscCall(find_shifts(comm, one, *l));
    PetscCall(check_reach(comm, one, *l));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
