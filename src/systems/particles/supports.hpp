// What holds particles and moves them as given: the motions of groups.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/error.hpp"
#include "network/network.hpp"
#include "physics/whole/drive.hpp"

namespace bs {

/// Components of position and velocity that a motion holds are known functions of time. They are no unknowns: the state y keeps the
/// initial position and zero velocity in their place, as it does for fixed particles, and local states get their values at the time of
/// evaluation (LocalState). Every method therefore sees a system that depends on time, with exact values at all its stages.
class Supports {
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

  /// Collective. Reads -bs_motion_NAME and marks in lattice->fixed what is held in all components: 1 at rest, 2 moving. Errors (exit 2): unknown
  /// groups, texts that are no motion, particles both fixed and driven or driven twice.
  PetscErrorCode read(MPI_Comm comm, Lattice* lattice);
  /// Collective. Finds the particles in the network, which must outlive the object.
  PetscErrorCode create(const Network& net);

  /// Whether some motion holds anything on any rank; whether something moves.
  bool active() const { return !motions_.empty(); }
  bool moving() const;
  const std::vector<Moved>& motions() const { return motions_; }
  /// By local index, then in the order of the motions; fixed particles have none.
  const std::vector<Hold>& holds() const { return holds_; }
  /// The components of local particle i that are held, fixed particles' included.
  std::uint8_t mask(PetscInt i) const;

  /// Writes held components of local particles [first, last) into `states`, 2d numbers (x, v) each, at time t.
  void place(double t, PetscInt first, PetscInt last, double* states) const;
  /// Sets held components of local particles [first, last), fixed ones left alone, to 0 in `values`: `vectors` vectors of d numbers each.
  void clear(PetscInt first, PetscInt last, int vectors, double* values) const;
  /// For equilibria, whose time is a load factor: velocities and accelerations are 0 from now on, and everything is where it is at t = 1.
  void set_static(bool at_rest, bool full_load) {
    at_rest_ = at_rest;
    full_load_ = full_load;
  }
  /// Position, velocity and acceleration of what one hold holds; other components are left alone.
  void at(const Hold& hold, double t, double* x, double* v, double* a) const;
  /// Whether some particle of any rank is held in part of its components: a roller. Rows and columns of these components are taken out of
  /// every matrix.
  bool rolls() const { return rolls_; }
  /// The held components of the roller with that global index; 0: it is none, or unknown here.
  std::uint8_t rolling(PetscInt global) const;
  /// Of owned particle i's rows of a matrix, (d, count block) numbers, those of held components, and their columns, become 0 but for `diagonal` on
  /// the diagonal, which is that of the last d columns of its own block. columns: global indices, `count` of them.
  void hold_rows(PetscInt i, const PetscInt* columns, PetscInt count, int block, double diagonal, double* panel) const;
  /// What stands on the diagonal of a M - b D - c K for a held component: a m, or m where there is no inertia.
  static double on_diagonal(double a, double mass) { return a > 0 ? a * mass : mass; }
  /// Collective. Ends the run with exit code 2 where a table does not reach t_end, or a motion is seen to jump on the way there.
  PetscErrorCode covers(double t_start, double t_end) const;
  /// What of this rank's motions cannot be followed from time `from` to time `to` (System::foresee).
  void foresee(double from, double to, Error* fault) const;
  std::vector<std::string> describe() const;
  /// (count of the chunk) bits of held components, for the fingerprint; moved out.
  std::vector<std::int64_t> take_held_bits() { return std::move(held_bits_); }

 private:
  PetscErrorCode read_motion(MPI_Comm comm, const Lattice& lattice, std::size_t group, const std::string& text);
  PetscErrorCode mark(MPI_Comm comm, Lattice* lattice);
  void look_for_jumps(double from, double to, const std::vector<std::size_t>& where, Error* fault) const;
  const Network* net_ = nullptr;
  std::vector<std::string> names_;
  std::vector<Moved> motions_;
  std::vector<Hold> holds_;
  /// Of holds_, those of owned particles whose motion may jump: the first of each motion, and all where the place matters.
  std::vector<std::size_t> first_jumpers_, jumpers_;
  std::vector<std::int64_t> held_bits_;
  struct Roller {
    PetscInt global, particle;
    std::uint8_t mask;
  };
  std::vector<Roller> rollers_;  ///< local ones, by global index
  bool rolls_ = false, at_rest_ = false, full_load_ = false;
};

/// Collective. Reads the files that `drive` names, given by `option`. Errors (exit 2): files that are not there or are no tables to follow.
PetscErrorCode read_drive_tables(MPI_Comm comm, const std::string& option, Drive* drive);

}  // namespace bs
