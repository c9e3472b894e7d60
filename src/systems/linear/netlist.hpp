// Netlists of SPICE: circuits of resistors, capacitors, inductors and independent sources. No PETSc.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace bs {

/// One element between two nodes.
struct CircuitElement {
  char kind = 'r';           ///< r, c, l, v, i
  std::string name;          ///< as written
  std::size_t a = 0, b = 0;  ///< nodes: 0 is ground, the others count from 1
  double value = 0;          ///< r, c, l [ohm, F, H]
  std::string source;        ///< v, i: u(t) as read_waveform() takes it [V, A]
};

struct Circuit {
  std::string title;
  std::vector<std::string> nodes = {"0"};  ///< by number, as first written
  std::vector<CircuitElement> elements;
  std::vector<std::string> remarks;  ///< lines for warnings: what was passed over, and what to write instead
};

/// Reads the netlist in `text`: a title, then cards; '*' begins a line of comment, ';' and, after a blank, '$' a comment at the end of a line, '+'
/// goes on with the card before; names in any case. Returns one line of error with `file` and the line, or the nodes that the circuit leaves
/// undetermined; empty if all is well.
std::string read_netlist(const std::string& text, const std::string& file, Circuit* out);

}  // namespace bs
