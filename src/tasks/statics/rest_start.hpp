// The start of a static analysis: the lattice as it was given need not be in equilibrium.
#pragma once
#include "tasks/statics/pseudo_time.hpp"

namespace bs {

/// Before the first load step the lattice comes to rest under the loads of the load factor 0. What it gives up on the way is released, not work of
/// the loads, and load steps lead from equilibrium to equilibrium from the first one on. Where no such equilibrium is found the first step starts
/// from the lattice as it is given.
class RestStart {
 public:
  /// Collective. Before the first step of `ts`; its state becomes the equilibrium. The factor of `model` is 0 afterwards.
  PetscErrorCode find(TS ts, TSContext& context, Equilibrium& model, PseudoTime& solver);
  bool tried() const { return tried_; }
  bool found() const { return found_; }
  void count(std::vector<Tally>* out) const;
  PetscErrorCode warn(Warnings* warnings) const;
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  bool tried_ = false, found_ = false;
  std::int64_t iterations_ = 0;  ///< of Newton's method
};

}  // namespace bs
