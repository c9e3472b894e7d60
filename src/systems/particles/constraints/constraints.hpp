// What holds particles and what moves as given: fixed particles, rollers, driven groups, the points of anchors, the periodic box. States, matrices,
// rigid motions and reactions ask here.
#pragma once
#include <petscvec.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/error.hpp"
#include "base/handle.hpp"
#include "network/network.hpp"
#include "physics/whole/drive.hpp"
#include "physics/whole/motion.hpp"
#include "systems/mechanics.hpp"
#include "systems/particles/constraints/cell.hpp"

namespace bs {

/// Components of position and velocity that are held are known functions of time. They are no unknowns: the state y keeps the initial position and
/// zero velocity in their place, and local states get their values at the time of evaluation (LocalState). Every method therefore sees a system that
/// depends on time, with exact values at all its stages.
class Constraints {
 public:
  /// A component-wise hold of one particle by one motion.
  struct Hold {
    PetscInt particle;  ///< local index
    int motion;
    std::uint8_t mask;  ///< bit c: component c
  };
  struct Moved {
    std::size_t group;  ///< among the lattice's groups
    Drive drive;
  };

  /// Collective. Reads -bs_anchor_motion and what belongs to it, in `dim` dimensions. Errors (exit 2): tables that cannot be followed.
  PetscErrorCode read_anchors(MPI_Comm comm, int dim);
  /// Collective. Reads -bs_motion_NAME and what is given of the box, and marks in lattice->fixed what is held in all components: 1 at rest, 2 moving.
  /// Errors (exit 2): unknown groups, texts that are no motion, particles both fixed and driven or driven twice.
  PetscErrorCode read(MPI_Comm comm, Lattice* lattice);
  /// Collective. Finds the particles in the network, which must outlive the object and whose constraints these are.
  PetscErrorCode create(Network* net);

  /// Bit c: component c of local particle i is held, all of fixed ones.
  std::uint8_t held(PetscInt i) const;
  /// Owned particles with a held component, ascending.
  const std::vector<PetscInt>& holders() const { return holders_; }
  /// visit(k, c): of every held component c of holders()[k].
  template <class Visit>
  void for_held(Visit visit) const {
    for (std::size_t k = 0; k < holders_.size(); ++k)
      for (int c = 0; c < net_->dim; ++c)
        if (held(holders_[k]) >> c & 1) visit(k, c);
  }
  /// Whether groups are held by motions, those that keep them at rest included.
  bool holds_groups() const { return !motions_.empty(); }
  const std::vector<Moved>& motions() const { return motions_; }
  /// Of what motions hold, by local index, then in the order of the motions; fixed particles have none.
  const std::vector<Hold>& holds() const { return holds_; }
  /// Whether motions hold and move anything; whether anything is another at another time.
  bool drives() const;
  bool time_dependent() const { return drives() || anchors_.active() || box_.moving(); }
  /// Adds what all that is driven follows.
  void list_drives(std::vector<Drive*>* all);
  Cell& box() { return box_; }
  const Cell& box() const { return box_; }
  Motion& anchors() { return anchors_; }
  const Motion& anchors() const { return anchors_; }

  /// Writes what is held of local particles [first, last) into `states`, 2d numbers (x, v) each, at time t.
  void place(double t, PetscInt first, PetscInt last, double* states) const;
  /// The same of what motions hold alone.
  void drive(double t, PetscInt first, PetscInt last, double* states) const;
  /// Sets what is held of local particles [first, last) to 0 in `values`: `vectors` vectors of d numbers each.
  void clear(PetscInt first, PetscInt last, int vectors, double* values) const;
  /// What motions hold has no velocity in the state y, whatever the input says.
  PetscErrorCode stop(Vec y) const;
  /// y with what motions hold where it is at time t, borrowed; y itself where they hold nothing.
  PetscErrorCode show(double t, Vec y, Vec* shown);
  /// Position, velocity and acceleration of what one hold holds; other components are left alone.
  void at(const Hold& hold, double t, double* x, double* v, double* a) const;

  /// Whether some particle of any rank is held in part of its components: a roller, which stays in all matrices.
  bool rolls() const { return rolls_; }
  /// Of owned particle i's rows of a matrix, (d, count block) numbers, those of held components, and their columns, become 0 but for `diagonal` on
  /// the diagonal, which is that of the last d columns of its own block. columns: global indices, `count` of them.
  void hold_rows(PetscInt i, const PetscInt* columns, PetscInt count, int block, double diagonal, double* panel) const;

  /// Collective. The group, whose motion is `given`, moves uniformly from where it is at time `from` to where `places`, laid out as a state, has its
  /// particles at time `to`, and stays there; in the same moment where these are one. Without a name all such groups. Errors (exit 2): another
  /// motion.
  PetscErrorCode give(const std::string& group, double from, double to, Vec places);

  /// All such motions, and where in time they stand.
  std::vector<Mechanics::GivenMotion> given_motions() const;
  /// The option of the first such motion; empty: there is none.
  std::string given() const;

  /// For equilibria, whose time is a load factor.
  void set_loads(const Loads& loads);
  /// Collective. Ends the run with exit code 2 where a table does not reach t_end, or something is seen to jump on the way there.
  PetscErrorCode covers(double t_start, double t_end) const;
  /// Collective. What cannot be followed from time `from` to time `to` (System::foresee).
  PetscErrorCode foresee(double from, double to, std::string* text) const;
  std::vector<std::string> describe() const;
  /// (count of the chunk) bits of components that motions hold, for the fingerprint, moved out; empty where they hold nothing.
  std::vector<std::int64_t> take_held_bits() { return std::move(held_bits_); }

 private:
  PetscErrorCode read_groups(MPI_Comm comm, const Lattice& lattice);
  PetscErrorCode mark(MPI_Comm comm, Lattice* lattice);
  void find_jumps(double from, double to, const std::vector<std::size_t>& where, Error* fault) const;
  /// The mask of what is held of the roller with that global index; 0: it is none, or unknown here.
  std::uint8_t rolling(PetscInt global) const;
  template <class Visit>
  void for_holds(PetscInt first, PetscInt last, Visit visit) const;
  template <class Visit>
  void for_fixed(PetscInt first, PetscInt last, Visit visit) const;

  const Network* net_ = nullptr;
  Cell box_;
  Motion anchors_;
  std::vector<std::string> names_;
  std::vector<Moved> motions_;
  std::vector<Hold> holds_;
  std::vector<PetscInt> fixed_;  ///< local indices of fixed particles and of those that are driven as a whole, ascending
  std::vector<PetscInt> holders_;
  /// Of holds_, those of owned particles whose motion may jump: the first of each motion, and all where the place matters.
  std::vector<std::size_t> first_jumpers_, jumpers_;
  std::vector<std::int64_t> held_bits_;
  /// Of a motion that is given: (n + ghosts, d) places at two times.
  struct Way {
    double from_time = 0, to_time = 0;
    std::vector<double> from, to;
  };
  std::vector<Way> ways_;  ///< by motion
  struct Roller {
    PetscInt global;
    std::uint8_t mask;
  };
  std::vector<Roller> rollers_;  ///< local ones, by global index
  bool rolls_ = false, at_rest_ = false, full_load_ = false;
  VecHandle shown_;
};

}  // namespace bs
