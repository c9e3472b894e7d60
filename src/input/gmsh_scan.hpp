// The nodes and elements of a Gmsh file as it names them: what DMPlex takes on trust, or drops, is checked on them.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace bs {

/// A line element: its number and the numbers of its two ends, as in the file.
struct GmshLine {
  std::int64_t element, ends[2];
};

struct GmshScan {
  std::string fault;                ///< one line, without the file's name; empty if nothing is wrong
  bool complete = false;            ///< everything was understood; else DMPlex must judge alone
  std::vector<std::int64_t> nodes;  ///< numbers of the nodes that are corners of elements, in the file's order
  std::vector<GmshLine> lines;      ///< line elements
  int dimension = 0;                ///< highest dimension of an element
  bool curved = false;              ///< elements have nodes besides their corners
};

/// One line, without the file's name, that says why `text` is no Gmsh mesh of format 2.2 or 4.1; empty if nothing
/// is wrong with its sections.
std::string fault_of_gmsh(const std::string& text);

/// Reads sections $Nodes and $Elements of `text`, a whole file of format 2.2 or 4.1, text or binary. Faults: counts or
/// numbers that cannot be, a node given twice, an element on an unknown node or twice on one.
GmshScan scan_gmsh(const std::string& text);

/// Whether a line element is no edge of the mesh that DMPlex made, of `vertices` vertices and edges `pairs` (M, 2): beside
/// elements of higher dimension DMPlex drops such lines. Returns one line about the first, or nothing.
std::string lone_line(const GmshScan& scan, std::int64_t vertices, const std::vector<std::int64_t>& pairs);

}  // namespace bs
