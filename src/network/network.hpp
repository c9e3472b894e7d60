// The distributed lattice: which rank owns which particle, in what local order, and which particles of other ranks it uses.
#pragma once
#include <petscis.h>
#include <array>
#include <cstdint>
#include <string>
#include <vector>
#include "base/arrays.hpp"
#include "base/handle.hpp"
#include "lattice/columns.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Springs seen from their owned end, in compressed rows: those of particle i are [start[i], start[i+1]), ascending by
/// the other end's row in the input, then by spring, so that sums over them are the same on any number of ranks.
/// A spring between two owned particles appears twice; one cut by a rank boundary once on either side.
struct Links {
  std::vector<PetscInt> start;  ///< (n + 1)
  HugeVector<PetscInt> other;   ///< local index of the other end; >= n: a ghost
  HugeVector<double> stiffness, rest_length;
  std::vector<double> damping;       ///< empty where no spring of this rank has a damper
  std::vector<std::int64_t> spring;  ///< row in the input; -1: a coupling without a spring
  // of lattices with more than Hooke's or the strain law
  std::vector<std::uint8_t> law;  ///< place in the registry; empty: that of the network
  std::vector<double> more;       ///< (links, width): the law's parameters, then its history
  int width = 0;
  std::vector<std::uint8_t> broken;  ///< 1: the spring exists no more, its numbers are 0; empty: none can break
  double history_time = 0;           ///< when the histories were what they are: the end of the last good step [s]
  bool at_rest = false;              ///< statics, whose time is none
  /// Time at t since then [s].
  double elapsed(double t) const { return at_rest || t <= history_time ? 0 : t - history_time; }
  bool is_broken(PetscInt e) const { return !broken.empty() && broken[static_cast<std::size_t>(e)]; }
};

/// Springs of owned particles to points.
struct Anchors {
  std::vector<PetscInt> particle;  ///< local index
  std::vector<double> point;       ///< (count, 3)
  std::vector<double> stiffness, rest_length, damping;
  std::vector<std::int64_t> row;  ///< row in the input
  std::vector<std::uint8_t> law;  ///< as for links; laws of anchors take nothing more
  std::vector<double> more;
  int width = 0;
  static double elapsed(double) { return 0; }
};

/// Interactions of one kind with at least one owned end, ascending by row, so that sums over them are the same on any number
/// of ranks. Every end is known: owned or a ghost. In a periodic box an interaction is there once for every box that owned ends of it are in, each
/// time with the images that lie about these ends: it acts on an owned particle once.
struct InteractionTable {
  std::int64_t total = 0;            ///< of all ranks
  std::vector<PetscInt> end;         ///< (count, ends) local indices
  std::vector<double> parameter;     ///< (count, parameters)
  std::vector<std::int64_t> row;     ///< (count) row in the input
  std::vector<std::uint8_t> broken;  ///< (count) 1: it exerts nothing; empty: none can break
  bool is_broken(std::size_t k) const { return !broken.empty() && broken[k]; }
};

/// Some particles of a lattice under a name.
struct NetworkGroup {
  std::string name;
  std::int64_t total = 0;        ///< members on all ranks
  std::vector<PetscInt> member;  ///< local indices, ascending: owned ones and ghosts
};

class Constraints;

/// Unknowns are numbered by particle: block `global` of 2d numbers (x, v). Local particles: n owned, then ghosts: particles of other
/// ranks and, in a periodic box, images of any; an image has the global index of its particle.
struct Network {
  MPI_Comm comm = MPI_COMM_NULL;
  int dim = 3;
  PetscInt n = 0, ghosts = 0, total = 0;  ///< particles
  PetscInt first = 0;                     ///< global index of the first owned particle
  std::int64_t springs_total = 0, anchors_total = 0, fixed_total = 0;
  bool room = false;  ///< springs that exert nothing may come to do so: matrices have their blocks, too
  // owned and ghosts
  std::vector<PetscInt> global;
  std::vector<std::uint8_t> fixed;  ///< 0: free, at least in part; 1: fixed; 2: all its components move as given
  std::vector<double> held;         ///< (n + ghosts, d): where a particle starts; fixed ones stay there
  std::vector<double> mass;         ///< of the particles themselves, m of the laws
  PeriodicBox box;
  std::vector<int> image;                    ///< (ghosts, d): the box a ghost is in; empty: no periodic box
  std::vector<NetworkGroup> groups;          ///< the same names in the same order on every rank
  const Constraints* constraints = nullptr;  ///< what holds particles (systems/particles/constraints); null until that is found
  // owned
  std::vector<double> velocity;         ///< (n, d)
  std::vector<double> inertia;          ///< (n): M of M x'' = f; the mass, and what of a fluid is accelerated along
  ParticleColumns columns;              ///< what the lattice gives of lattice/columns.hpp
  std::vector<std::int64_t> row, id;    ///< row in the input and the user's number
  std::vector<std::int64_t> ghost_row;  ///< (ghosts) row in the input, of images that of their particle
  Links links;
  Anchors anchors;
  std::vector<InteractionTable> interactions;  ///< by kind; empty where the lattice has none at all
  SpringLaw spring_law = SpringLaw::hooke;
  bool mixed = false;              ///< laws are looked up link by link; the same on every rank, as the next two
  bool softens = false;            ///< some spring's law may
  bool relaxes = false;            ///< some spring's law does
  std::vector<std::uint8_t> laws;  ///< per place in the registry, where mixed: whether some spring obeys it
  DampingLaw damping_law = DampingLaw::axial;
  bool rest_at_zero_length = false;
  std::string source, partition;  ///< what it was made of; how it was divided

  /// Rows in the input of all local particles.
  std::vector<std::int64_t> local_rows() const {
    std::vector<std::int64_t> rows = row;
    rows.insert(rows.end(), ghost_row.begin(), ghost_row.end());
    return rows;
  }
  /// Whether local particle j is an image of owned particle i: a spring between them keeps its length whatever moves.
  bool own_image(PetscInt i, PetscInt j) const { return j >= n && global[j] == global[i]; }
  /// Whether owned particle i is linked to a ghost.
  bool boundary(PetscInt i) const {
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e)
      if (links.other[e] >= n) return true;
    return false;
  }
  /// The local particle that link e of owned particle i is a coupling to in matrices: of an image of a particle of this rank that particle,
  /// unless i is linked to it in another box as well, and so in another direction; else the other end.
  PetscInt coupled(PetscInt i, PetscInt e) const {
    const PetscInt j = links.other[e];
    return j < n || image.empty() ? j : coupled_image(i, e);
  }
  PetscInt coupled_image(PetscInt i, PetscInt e) const;
};

struct NetworkOptions {
  int partition = 0;             ///< -bs_partition: 0 graph, 1 geometric, 2 rows
  int ordering = 0;              ///< -bs_ordering: 0 rcm, 1 rows
  std::int64_t center_row = -1;  ///< a particle every other one feels: made known to all
  bool all_to_all = false;       ///< couple every free particle with every other one
  /// Rows of particles of which each feels the other by something else than springs, ascending, both ways; the same on every rank.
  std::vector<std::array<std::int64_t, 2>> couples;
  std::size_t slice = std::size_t{1} << 18;  ///< springs of a rank in transit at once
};

/// Collective. Divides the lattice among the ranks of `comm`, orders each part for cache and finds its ghosts.
/// Needs sum(particles)*2d to fit PetscInt, which the readers have checked.
PetscErrorCode build_network(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, Network* out);

/// Collective. Reads -bs_partition and -bs_ordering.
PetscErrorCode read_network_options(MPI_Comm comm, NetworkOptions* out);

}  // namespace bs
