// Reads XSpringies scenes: masses and springs in a window, in pixels, seconds and masses of 1.
#pragma once
#include <string>

#include "lattice/lattice.hpp"

namespace bs {

/// The window XSpringies opened: its size is not in the file.
constexpr double XSP_WIDTH = 642, XSP_HEIGHT = 550;

/// Reads the scene `text`, called `name` in messages, in a window of `width` x `height` pixels with the origin at the
/// bottom left. On success `*out` is the whole scene: d = 2, hooke springs with axial damping, spring ends as rows in
/// the order of the file's mass records, the file's ids in out->id, forces that are on as out->implied_options. A mass
/// < 0 in the file is a fixed particle of that size, 0 is 1; springs to unknown masses or from a mass to itself are
/// dropped with a warning. On failure returns false and sets `*error` to one line "name:line: what is wrong".
bool parse_xsp(const std::string& text, const std::string& name, double width, double height, Lattice* out, std::string* error);

}  // namespace bs
