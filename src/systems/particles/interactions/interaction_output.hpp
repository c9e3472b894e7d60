// Interactions in the output: constant datasets, the fingerprint, the header.
#pragma once
#include <string>
#include <vector>
#include "network/network.hpp"
#include "systems/model.hpp"

namespace bs {

class RowSum;

/// Nothing changes where there are none.
void add_to_fingerprint(const Lattice& lattice, RowSum* sum);
/// Moves the tables of the lattice's chunk, as a trajectory's /connectivity/angles or a lattice file's /angles/triples and the like; the same
/// datasets on every rank.
void move_to_datasets(bool trajectory, Lattice* lattice, std::vector<Dataset>* out);
/// ", 12 angle springs", or nothing.
std::string count_text(const Network& net);

}  // namespace bs
