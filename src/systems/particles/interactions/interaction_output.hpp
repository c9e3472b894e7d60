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
/// Moves the tables of the lattice's chunk, as /connectivity/angles and the like; the same datasets on every rank.
void move_to_datasets(Lattice* lattice, std::vector<Dataset>* out);
/// ", 12 angle springs", or nothing.
std::string count_text(const Network& net);

}  // namespace bs
