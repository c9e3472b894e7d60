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
  double start = 0;          ///< c, l: voltage from a to b [V], current [A] at the start (IC, for capacitors .ic)
  bool started = false;      ///< whether the netlist says it
  std::string source;        ///< v, i: u(t) as read_waveform() takes it [V, A]
};

struct Circuit {
  std::string title;
  std::vector<std::string> nodes = {"0"};  ///< by number, as first written
  std::vector<CircuitElement> elements;
  bool from_conditions = false;      ///< the run starts from IC, .ic or UIC, not from the operating point
  std::vector<std::string> remarks;  ///< lines for warnings: what was passed over, and what to write instead
};

/// Reads the netlist in `text`: a title, then cards; '*' begins a line of comment, ';' and, after a blank, '$' a comment at the end of a line, '+'
/// goes on with the card before; names in any case. Returns one line of error with `file` and the line, or the nodes that the circuit leaves
/// undetermined; empty if all is well.
std::string read_netlist(const std::string& text, const std::string& file, Circuit* out);

/// Elements by what holds them at the start: capacitors hold their voltage, but those of a loop of such and voltage sources, of which the last has
/// the voltage that the others leave.
struct StartingCircuit {
  std::vector<std::size_t> holding, last;  ///< capacitors, as places in `elements`
  std::vector<std::size_t> by_source;      ///< of each node one that voltage sources alone join it to, the same for all of these
  /// Whether voltage sources alone say the voltage of a capacitor of which the netlist says nothing.
  bool by_sources(const CircuitElement& c) const { return !c.started && by_source[c.a] == by_source[c.b]; }
  std::string fault;  ///< nodes whose voltage nothing determines then; empty: none
};
StartingCircuit starting_circuit(const Circuit& circuit);

}  // namespace bs
