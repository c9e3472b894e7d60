// The distributed lattice against a list of all its springs, which every rank makes for itself.
#include "network/network.hpp"
#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <tuple>
#include <vector>
#include "base/hash.hpp"
#include "input/remote.hpp"
#include "lattice/generator.hpp"
#include "network/partition.hpp"
#include "systems/particles/linearised_forces.hpp"

using namespace bs;

namespace {

using End = std::tuple<std::int64_t, std::int64_t, double, double, double>;  // other's row, spring's row, k, L, D

/// A cube with dampers, whose springs are shuffled over the ranks' chunks; every seventh is doubled.
Lattice shuffled(int rank, int size) {
  GeneratorSpec spec;
  spec.type = LatticeType::cubic;
  spec.size = {4, 5, 3};
  spec.neighbors = 18;
  spec.stiffness = {100, 60, 40};
  spec.fixed_particles = {0, 7};
  Lattice whole = generate(spec, 0, 1), l = generate(spec, rank, size);
  std::vector<std::size_t> order(whole.stiffness.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  const auto key = [](std::size_t k) { return hash_uniform(5, Stream::perturbation, static_cast<std::int64_t>(k), 1); };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  for (std::size_t k = 0, n = order.size(); k < n; k += 7) order.push_back(order[k]);
  l.springs = split_rows(static_cast<std::int64_t>(order.size()), rank, size);
  l.pairs.clear(), l.stiffness.clear(), l.rest_length.clear(), l.damping.clear();
  for (std::int64_t row = l.springs.first; row < l.springs.first + l.springs.count; ++row) {
    const std::size_t k = order[static_cast<std::size_t>(row)];
    const bool turned = row % 2;
    l.pairs.push_back(whole.pairs[2 * k + turned]);
    l.pairs.push_back(whole.pairs[2 * k + !turned]);
    l.stiffness.push_back(whole.stiffness[k] + static_cast<double>(row));
    l.rest_length.push_back(whole.rest_length[k]);
    l.damping.push_back(0.5 * static_cast<double>(row % 3));
  }
  return l;
}

std::map<std::int64_t, std::vector<End>> all_ends() {
  const Lattice l = shuffled(0, 1);
  std::map<std::int64_t, std::vector<End>> ends;
  for (std::size_t half = 0; half < l.pairs.size(); ++half) {
    const std::size_t k = half / 2;
    ends[l.pairs[half]].emplace_back(l.pairs[half ^ 1], static_cast<std::int64_t>(k), l.stiffness[k], l.rest_length[k], l.damping[k]);
  }
  for (auto& [row, list] : ends) std::sort(list.begin(), list.end());
  return ends;
}

/// Row in the input of every global index.
std::vector<long long> rows_by_global(const Network& net) {
  std::vector<long long> rows(static_cast<std::size_t>(net.total), 0);
  for (PetscInt i = 0; i < net.n; ++i) rows[static_cast<std::size_t>(net.first + i)] = net.row[static_cast<std::size_t>(i)];
  MPI_Allreduce(MPI_IN_PLACE, rows.data(), static_cast<int>(rows.size()), MPI_LONG_LONG, MPI_SUM, PETSC_COMM_WORLD);
  return rows;
}

}  // namespace

TEST_CASE("every particle has its springs, whatever the partition and the slices they travel in") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const Lattice lattice = shuffled(rank, size);
  const auto ends = all_ends();
  for (const int partition : {0, 1, 2})
    for (const int ordering : {0, 1})
      for (const std::size_t slice : {std::size_t{1} << 18, std::size_t{1}, std::size_t{23}}) {
        CAPTURE(partition, ordering, slice);
        NetworkOptions options;
        options.partition = partition;
        options.ordering = ordering;
        options.slice = slice;
        Network net;
        REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
        long long owned = net.n;
        MPI_Allreduce(MPI_IN_PLACE, &owned, 1, MPI_LONG_LONG, MPI_SUM, PETSC_COMM_WORLD);
        REQUIRE(owned == lattice.particles.total);
        REQUIRE(net.fixed_total == 2);
        const std::vector<long long> rows = rows_by_global(net);
        REQUIRE(std::is_permutation(rows.begin(), rows.end(),
                                    [] {
                                      std::vector<long long> all(60);
                                      for (int k = 0; k < 60; ++k) all[static_cast<std::size_t>(k)] = k;
                                      return all;
                                    }()
                                        .begin()));
        bool same = true;
        for (PetscInt i = 0; i < net.n; ++i) {
          std::vector<End> found;
          for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e)
            found.emplace_back(rows[static_cast<std::size_t>(net.global[static_cast<std::size_t>(net.links.other[e])])], net.links.spring[e],
                               net.links.stiffness[e], net.links.rest_length[e], net.links.damping[e]);
          same = same && found == ends.at(net.row[static_cast<std::size_t>(i)]);  // and in this order
        }
        REQUIRE(same);
        REQUIRE(static_cast<PetscInt>(net.global.size()) == net.n + net.ghosts);
      }
}

TEST_CASE("the pattern of matrices has a pair once, however many springs it has") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  Network net;
  REQUIRE(build_network(PETSC_COMM_WORLD, shuffled(rank, size), NetworkOptions(), &net) == 0);
  const PairPattern pattern = pairs_of(net);
  long long pairs = 0, expected = 0;
  for (PetscInt i = 0; i < net.n; ++i) {
    std::vector<PetscInt> all, found(pattern.other.begin() + pattern.start[i], pattern.other.begin() + pattern.start[i + 1]);
    const auto row = std::find(pattern.cut_row.begin(), pattern.cut_row.end(), i) - pattern.cut_row.begin();
    if (static_cast<std::size_t>(row) < pattern.cut_row.size())
      for (PetscInt k = pattern.cut_start[row]; k < pattern.cut_start[row + 1]; ++k) found.push_back(net.n + pattern.ghost[k]);
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e)
      if (!net.fixed[i] && !net.fixed[net.links.other[e]] && net.links.other[e] > i) all.push_back(net.links.other[e]);
    expected += static_cast<long long>(all.size());
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    std::sort(found.begin(), found.end());
    CHECK(found == all);
    pairs += static_cast<long long>(found.size());
  }
  MPI_Allreduce(MPI_IN_PLACE, &pairs, 1, MPI_LONG_LONG, MPI_SUM, PETSC_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, &expected, 1, MPI_LONG_LONG, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(pairs < expected);  // some are doubled
}

TEST_CASE("particles have the numbers of their columns, on whatever rank, and no memory for those the lattice lacks") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const auto value = [](std::size_t k, std::int64_t row) { return static_cast<double>(100 * (k + 1)) + static_cast<double>(row); };
  constexpr std::size_t count = std::size(particle_parameters);
  for (unsigned given = 0; given < 1u << count; ++given) {
    Lattice lattice = shuffled(rank, size);
    for (std::size_t k = count; k-- > 0;) {  // in another order than the list's
      if (!(given >> k & 1)) continue;
      lattice.particle_columns.push_back({particle_parameters[k].name, "", {}});
      for (std::int64_t i = 0; i < lattice.particles.count; ++i)
        for (int c = 0; c < particle_parameters[k].width(lattice.dim); ++c)
          lattice.particle_columns.back().value.push_back(value(k, lattice.particles.first + i) + 0.25 * c);
    }
    for (const int partition : {0, 1, 2}) {
      CAPTURE(given, partition);
      NetworkOptions options;
      options.partition = partition;
      Network net;
      REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
      std::size_t width = 0;
      for (std::size_t k = 0; k < count; ++k) width += given >> k & 1 ? static_cast<std::size_t>(particle_parameters[k].width(lattice.dim)) : 0;
      REQUIRE(net.columns.given.size() == width * static_cast<std::size_t>(net.n));
      bool same = true;
      for (PetscInt i = 0; i < net.n; ++i)
        for (std::size_t k = 0; k < count; ++k)
          same = same && net.columns(i)[k] == (given >> k & 1 ? value(k, net.row[static_cast<std::size_t>(i)]) : particle_parameters[k].missing) &&
                 (net.columns(i).vector(k) != nullptr) == ((given >> k & 1) != 0);
      REQUIRE(same);
    }
  }
}

TEST_CASE("parts by coordinates and by rows are of one size, though many particles lie in one plane") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const Lattice lattice = shuffled(rank, size);
  for (const int partition : {1, 2}) {
    NetworkOptions options;
    options.partition = partition;
    Network net;
    REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
    CAPTURE(partition);
    CHECK(net.n == 60 / size);
  }
}

TEST_CASE("the graph is cut where springs are soft and few") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  GeneratorSpec spec;
  spec.type = LatticeType::chain;
  spec.size = {720};
  Lattice l = generate(spec, rank, size);  // every third spring is soft; none of them in the middle, or a third of the way
  REQUIRE(number_rows(PETSC_COMM_WORLD, &l.springs) == 0);
  for (std::size_t k = 0; k < l.stiffness.size(); ++k) l.stiffness[k] = (l.springs.first + static_cast<std::int64_t>(k)) % 3 == 0 ? 1 : 1000;
  Network net;
  REQUIRE(build_network(PETSC_COMM_WORLD, l, NetworkOptions(), &net) == 0);
  if (net.partition.rfind("graph", 0) != 0) return;
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e)
      if (net.links.other[e] >= net.n) CHECK(net.links.spring[e] % 3 == 0);
}

TEST_CASE("couplings to images are those to their particle, but where a particle is joined in several boxes") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  int folded = 0, kept = 0;
  for (const std::int64_t narrow : {2, 3}) {
    GeneratorSpec spec;
    spec.type = LatticeType::cubic;
    spec.size = {narrow, 5, 4};
    spec.neighbors = 18;
    spec.periodic = "xz";
    Lattice lattice = generate(spec, rank, size);
    REQUIRE(number_rows(PETSC_COMM_WORLD, &lattice.springs) == 0);
    Network net;
    REQUIRE(build_network(PETSC_COMM_WORLD, lattice, NetworkOptions(), &net) == 0);
    for (PetscInt i = 0; i < net.n; ++i)
      for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e) {
        const PetscInt j = net.links.other[e], particle = net.global[static_cast<std::size_t>(j)] - net.first;
        bool several = false;
        for (PetscInt k = net.links.start[i]; k < net.links.start[i + 1]; ++k) {
          const PetscInt other = net.links.other[k];
          several = several || (other != j && net.global[static_cast<std::size_t>(other)] == net.global[static_cast<std::size_t>(j)]);
        }
        const bool own = particle >= 0 && particle < net.n;
        CHECK(net.coupled(i, e) == (own && !several ? particle : j));
        folded += own && !several && j >= net.n;
        kept += own && several && j >= net.n;
      }
  }
  CHECK(folded > 0);
  CHECK(kept > 0);
}

TEST_CASE("velocities, anchors and groups arrive with their particles; fixed ones are at rest") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  Lattice lattice = shuffled(rank, size);
  const auto velocity = [](std::int64_t row, int c) { return 1.0 + static_cast<double>(row) + 0.25 * c; };
  lattice.velocity.clear();
  Group odd{"odd", {}};
  for (std::int64_t row = lattice.particles.first; row < lattice.particles.first + lattice.particles.count; ++row) {
    for (int c = 0; c < 3; ++c) lattice.velocity.push_back(velocity(row, c));
    odd.member.push_back(row % 2 == 1);
  }
  lattice.groups.push_back(odd);
  lattice.anchors = split_rows(40, rank, size);  // several at a particle, on the way to another rank
  for (std::int64_t k = lattice.anchors.first; k < lattice.anchors.first + lattice.anchors.count; ++k) {
    const double number = static_cast<double>(k);
    lattice.anchor_particle.push_back(59 - k % 10);
    lattice.anchor_point.insert(lattice.anchor_point.end(), {number, number + 0.5, number + 0.75});
    lattice.anchor_stiffness.push_back(100 + number);
    lattice.anchor_rest_length.push_back(200 + number);
    lattice.anchor_damping.push_back(300 + number);
  }
  for (const int partition : {0, 1, 2}) {
    CAPTURE(partition);
    NetworkOptions options;
    options.partition = partition;
    Network net;
    REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
    bool same = true;
    std::int64_t odd_rows = 0;
    for (PetscInt i = 0; i < net.n; ++i)
      for (int c = 0; c < 3; ++c) same = same && net.velocity[static_cast<std::size_t>(3 * i + c)] == (net.fixed[i] ? 0 : velocity(net.row[i], c));
    CHECK(same);
    REQUIRE(net.groups.size() == 1);
    CHECK(net.groups[0].total == 30);
    for (const PetscInt i : net.groups[0].member) odd_rows += i >= net.n || net.row[static_cast<std::size_t>(i)] % 2 == 1;
    CHECK(odd_rows == static_cast<std::int64_t>(net.groups[0].member.size()));
    same = true;
    for (std::size_t k = 0; k < net.anchors.row.size(); ++k) {
      const double row = static_cast<double>(net.anchors.row[k]);
      same = same && net.row[static_cast<std::size_t>(net.anchors.particle[k])] == 59 - net.anchors.row[k] % 10;
      same = same && net.anchors.point[3 * k] == row && net.anchors.point[3 * k + 1] == row + 0.5 && net.anchors.point[3 * k + 2] == row + 0.75;
      same = same && net.anchors.stiffness[k] == 100 + row && net.anchors.rest_length[k] == 200 + row && net.anchors.damping[k] == 300 + row;
      if (k > 0 && net.anchors.particle[k] == net.anchors.particle[k - 1]) same = same && net.anchors.row[k] > net.anchors.row[k - 1];
    }
    CHECK(same);
    int count = static_cast<int>(net.anchors.row.size());
    MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
    CHECK(count == 40);
  }
}

TEST_CASE("every rank knows the laws of all springs, those it has none of as well") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  GeneratorSpec spec;
  spec.type = LatticeType::chain;
  spec.size = {60};
  Lattice lattice = generate(spec, rank, size);
  REQUIRE(number_rows(PETSC_COMM_WORLD, &lattice.springs) == 0);
  const std::vector<std::string> names = spring_law_names();  // Hooke's is the first
  const std::size_t plastic = static_cast<std::size_t>(std::find(names.begin(), names.end(), "plastic") - names.begin());
  REQUIRE(plastic < names.size());
  lattice.law_by_row = true;
  for (std::int64_t row = lattice.springs.first; row < lattice.springs.first + lattice.springs.count; ++row)
    lattice.spring_laws.push_back(static_cast<std::uint8_t>(row == 0 ? plastic : 0));
  for (const SpringParameter& one : spring_laws()[plastic].parameters)
    lattice.spring_columns.push_back({one.name, "", std::vector<double>(static_cast<std::size_t>(lattice.springs.count), 0.1)});
  NetworkOptions options;
  options.partition = 1;
  Network net;
  REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
  for (std::size_t law = 0; law < net.laws.size(); ++law) CHECK((net.laws[law] != 0) == (law == plastic || law == 0));
  CHECK(net.softens);
  CHECK(net.links.width == static_cast<int>(spring_laws()[plastic].width()));
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e) CHECK(net.links.law[e] == (net.links.spring[e] == 0 ? plastic : 0));
}

TEST_CASE("couplings without springs reach every particle") {
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const Lattice lattice = shuffled(rank, size);
  const auto ends = all_ends();
  for (const bool all : {false, true}) {
    NetworkOptions options;
    options.slice = 11;
    options.center_row = all ? -1 : 33;
    options.all_to_all = all;
    Network net;
    REQUIRE(build_network(PETSC_COMM_WORLD, lattice, options, &net) == 0);
    for (PetscInt i = 0; i < net.n; ++i) {
      PetscInt couplings = 0;
      for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e) couplings += net.links.spring[e] < 0;
      const std::int64_t row = net.row[static_cast<std::size_t>(i)];
      REQUIRE(couplings == (all ? 59 : row == 33 ? 0 : 1));
      REQUIRE(net.links.start[i + 1] - net.links.start[i] == couplings + static_cast<PetscInt>(ends.at(row).size()));
    }
  }
}

TEST_CASE("Rows are found where they stand, whether they lie evenly or in heaps") {
  std::vector<std::int64_t> even(1000), heaps, far = {-5, 7, std::int64_t{1} << 42};
  for (std::size_t k = 0; k < even.size(); ++k) even[k] = 3 + static_cast<std::int64_t>(k);
  for (std::int64_t k = 0; k < 300; ++k) heaps.push_back(k * k * k % 97 + (k / 100) * 1000000000);
  std::sort(heaps.begin(), heaps.end());
  heaps.erase(std::unique(heaps.begin(), heaps.end()), heaps.end());
  for (const std::vector<std::int64_t>& rows : {std::vector<std::int64_t>(), std::vector<std::int64_t>{4}, even, heaps, far}) {
    const RowIndex index(rows);
    std::vector<std::int64_t> asked = rows;
    for (const std::int64_t row : rows) asked.insert(asked.end(), {row - 1, row + 1, row + 50});
    asked.push_back(0);
    for (const std::int64_t row : asked) {
      const auto at = std::find(rows.begin(), rows.end(), row);
      CHECK(index.find(row) == (at == rows.end() ? -1 : at - rows.begin()));
    }
  }
}
