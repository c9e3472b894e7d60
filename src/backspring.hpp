// backspring as a library: what a program in C++ includes, as <backspring/backspring.hpp> of what is installed.
//
//   Library    starts MPI and PETSc                             session/session.hpp
//   Session    steps, equilibria, modes, moduli of a lattice in memory or as settings name it; forces of one's own, observers
//   LatticeArrays, read_lattice, write_lattice                  lattice/lattice_arrays.hpp, session/lattices.hpp
//   register_interaction_law<Law>()  laws of one's own between 2 to 4 particles      systems/particles/interactions/kinds.hpp
//
// Errors are values (base/error.hpp). Units are the user's own, as long as they agree with one another.
#pragma once
#include "session/lattices.hpp"
#include "session/session.hpp"
#include "systems/particles/interactions/kinds.hpp"
