// Modified nodal analysis of a circuit.
#include <algorithm>
#include <utility>
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/handle.hpp"
#include "base/memory.hpp"
#include "base/text.hpp"
#include "systems/linear/netlist.hpp"
#include "systems/linear/system.hpp"

namespace bs {
namespace {

struct Entry {
  PetscInt row, column;
  double value;
};

/// Entries of a matrix; those of ground, -1, are left out.
struct Entries {
  std::vector<Entry> list;
  void add(PetscInt row, PetscInt column, double value) {
    if (row >= 0 && column >= 0) list.push_back({row, column, value});
  }
};

struct Equations {
  PetscInt states = 0, sources = 0;
  Entries G, C, B;
  std::vector<std::string> labels, units, source_labels, source_units;
  std::string source;
  std::vector<std::pair<PetscInt, double>> given;  ///< at the start: entries of the right side beside the sources
};

// The current of each element flows from its node a to b; what leaves a node is 0 in sum, and a source's current is that through it:
//   R: (v_a - v_b)/R leaves a;  C: C (v_a - v_b)' leaves a;  I: u leaves a
//   L: i leaves a, L i' - (v_a - v_b) = 0;  V: i leaves a, v_a - v_b = u
// At the `start`, where L keeps i and C, as `holding` says, its voltage, which takes a current through it, numbered after the states:
//   L: i leaves a, i = IC;  C: i leaves a, v_a - v_b = IC
Equations equations_of(const Circuit& circuit, const StartingCircuit* start = nullptr) {
  Equations e;
  for (std::size_t k = 1; k < circuit.nodes.size(); ++k) {
    e.labels.push_back("V(" + circuit.nodes[k] + ")");
    e.units.emplace_back("V");
  }
  for (const CircuitElement& element : circuit.elements) {
    const PetscInt a = static_cast<PetscInt>(element.a) - 1, b = static_cast<PetscInt>(element.b) - 1;
    const char kind = element.kind;
    if (kind == 'r' || (kind == 'c' && !start)) {
      Entries& M = kind == 'r' ? e.G : e.C;
      const double g = kind == 'r' ? 1 / element.value : element.value;
      M.add(a, a, g);
      M.add(b, b, g);
      M.add(a, b, -g);
      M.add(b, a, -g);
    }
    if (kind == 'l' || kind == 'v') {
      const auto i = static_cast<PetscInt>(e.labels.size());
      const double sign = kind == 'l' ? -1 : 1;
      e.labels.push_back("I(" + element.name + ")");
      e.units.emplace_back("A");
      e.G.add(a, i, 1);
      e.G.add(b, i, -1);
      if (kind == 'l' && start) {
        e.G.add(i, i, 1);
        e.given.emplace_back(i, element.start);
        continue;
      }
      e.G.add(i, a, sign);
      e.G.add(i, b, -sign);
      if (kind == 'l') e.C.add(i, i, element.value);
      else e.B.add(i, e.sources, 1);
    }
    if (kind == 'i') {
      e.B.add(a, e.sources, -1);
      e.B.add(b, e.sources, 1);
    }
    if (kind != 'v' && kind != 'i') continue;
    e.source += (e.sources > 0 ? ";" : "") + element.source;
    e.source_labels.push_back(element.name);
    e.source_units.emplace_back(kind == 'v' ? "V" : "A");
    ++e.sources;
  }
  e.states = static_cast<PetscInt>(e.labels.size());
  for (const std::size_t k : start ? start->holding : std::vector<std::size_t>()) {
    const CircuitElement& element = circuit.elements[k];
    const PetscInt a = static_cast<PetscInt>(element.a) - 1, b = static_cast<PetscInt>(element.b) - 1, i = e.states++;
    e.G.add(a, i, 1);
    e.G.add(b, i, -1);
    e.G.add(i, a, 1);
    e.G.add(i, b, -1);
    e.given.emplace_back(i, element.start);
  }
  return e;
}

PetscErrorCode assemble(MPI_Comm comm, PetscInt rows, PetscInt columns, const Entries& entries, MatHandle* out) {
  PetscInt local = PETSC_DECIDE, width = PETSC_DECIDE, total = rows, wide = columns, first;
  PetscFunctionBegin;
  PetscCall(PetscSplitOwnership(comm, &local, &total));
  PetscCall(PetscSplitOwnership(comm, &width, &wide));
  PetscCallMPI(MPI_Scan(&local, &first, 1, MPIU_INT, MPI_SUM, comm));
  first -= local;
  std::vector<PetscInt> here(static_cast<std::size_t>(local), 0), there;
  for (const Entry& e : entries.list)
    if (e.row >= first && e.row < first + local) ++here[static_cast<std::size_t>(e.row - first)];
  there = here;
  for (PetscInt& n : here) n = std::min(n, width);
  for (PetscInt& n : there) n = std::min(n, columns - width);
  PetscCall(MatCreateAIJ(comm, local, width, rows, columns, 0, here.data(), 0, there.data(), out->out()));
  for (const Entry& e : entries.list)
    if (e.row >= first && e.row < first + local) PetscCall(MatSetValue(*out, e.row, e.column, e.value, ADD_VALUES));
  PetscCall(assemble(*out));
  PetscFunctionReturn(0);
}

/// The circuit at the start, where the netlist has conditions.
PetscErrorCode assemble_start(MPI_Comm comm, const std::string& path, const Circuit& circuit, StartSystem* out) {
  PetscInt first, last;
  PetscFunctionBegin;
  const StartingCircuit start = starting_circuit(circuit);
  if (!start.fault.empty()) PetscCall(fail(comm, Exit::input, path + ": " + start.fault));
  const Equations e = equations_of(circuit, &start);
  PetscCall(assemble(comm, e.states, e.states, e.G, &out->G));
  if (e.sources > 0) PetscCall(assemble(comm, e.states, e.sources, e.B, &out->B));
  PetscCall(MatCreateVecs(out->G, nullptr, out->b.out()));
  PetscCall(VecGetOwnershipRange(out->b, &first, &last));
  for (const auto& [row, value] : e.given)
    if (row >= first && row < last) PetscCall(VecSetValue(out->b, row, value, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(out->b));
  PetscCall(VecAssemblyEnd(out->b));
  for (const std::size_t k : start.last) {
    const CircuitElement& c = circuit.elements[k];
    if (start.by_sources(c)) continue;
    out->checks.push_back({static_cast<PetscInt>(c.a) - 1, static_cast<PetscInt>(c.b) - 1, c.start,
                           path + ": " + c.name + " closes a loop of capacitors and voltage sources, which " +
                               (c.started ? format("do not leave it its %g V", c.start) : std::string("charge it at once")) +
                               ": give capacitors of the loop an IC that fits"});
  }
  PetscFunctionReturn(0);
}

/// This rank's part of the names of the rows or columns of a matrix.
void take_part(const std::vector<std::string>& all, PetscInt first, PetscInt last, std::vector<std::string>* part) {
  part->assign(all.begin() + first, all.begin() + last);
}

}  // namespace

PetscErrorCode load_netlist(MPI_Comm comm, const std::string& path, LinearSystem* out) {
  std::string text;
  Circuit circuit;
  PetscInt first, last;
  PetscFunctionBegin;
  PetscCall(read_text_file(comm, path, &text));
  PetscCall(reserve_memory(comm, {"the cards and equations of " + path, 3.0 * static_cast<double>(text.size()), ""}));
  const std::string error = read_netlist(text, path, &circuit);
  if (!error.empty()) PetscCall(fail(comm, Exit::input, error));
  for (const std::string& remark : circuit.remarks) PetscCall(warn(comm, "netlist", remark));
  const Equations e = equations_of(circuit);
  PetscCall(assemble(comm, e.states, e.states, e.G, &out->G));
  PetscCall(assemble(comm, e.states, e.states, e.C, &out->C));
  PetscCall(MatGetOwnershipRange(out->G, &first, &last));
  take_part(e.labels, first, last, &out->labels);
  take_part(e.units, first, last, &out->units);
  if (e.sources > 0) {
    PetscCall(assemble(comm, e.states, e.sources, e.B, &out->B));
    PetscCall(MatGetOwnershipRangeColumn(out->B, &first, &last));
    take_part(e.source_labels, first, last, &out->source_labels);
    take_part(e.source_units, first, last, &out->source_units);
    out->source = e.source;
  }
  if (circuit.from_conditions) PetscCall(assemble_start(comm, path, circuit, &out->start));
  out->origin = path + (circuit.title.empty() ? "" : " (" + printable(circuit.title) + ")");
  PetscFunctionReturn(0);
}

}  // namespace bs
