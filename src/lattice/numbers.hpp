// Numbers of a lattice that may be given anew while systems made of it live.
#pragma once
#include <cmath>
#include <string>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// Squares of what is given are summed: they must not overflow. False for what is no number.
inline bool usable(double value) { return std::abs(value) <= 1e150; }

/// The numbers of that name: stiffness, rest_length, damping, or what the springs' laws take beyond these, of every spring; mass, of every particle.
/// Null: there are none, or they cannot be changed.
std::vector<double>* changeable_numbers(Lattice* lattice, const std::string& name);

/// Gives them anew; `all`: of the whole lattice, which `lattice` holds. False, and why, where they are no numbers of that lattice, are out of their
/// range, or would make another system of it: springs of rest length 0 or without damper stay such, others may lose their damper.
bool change_numbers(Lattice* lattice, const std::string& name, const std::vector<double>& all, std::string* why);

}  // namespace bs
