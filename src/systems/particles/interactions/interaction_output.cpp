// What a frame file and a fingerprint hold of interactions.
#include "systems/particles/interactions/interaction_output.hpp"
#include "base/row_sum.hpp"
#include "input/hdf5_layout.hpp"
#include "physics/interactions/registry.hpp"

namespace bs {

void add_to_fingerprint(const Lattice& lattice, RowSum* sum) {
  constexpr std::uint64_t FIRST = 32, SHIFTS = 128, LIMITS = 256;  // tables below are the springs' and particles'
  for (std::size_t kind = 0; kind < lattice.interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    const InteractionRows& from = lattice.interactions[kind];
    sum->add(FIRST + 2 * kind, from.rows.first, schema.ends, from.ends);
    sum->add(FIRST + 2 * kind + 1, from.rows.first, static_cast<int>(schema.parameters.size()), from.parameter);
    sum->add(SHIFTS + kind, from.rows.first, schema.ends * lattice.dim, from.shift);
    for (const Column& column : from.break_columns) {
      std::uint64_t c = 0;
      while (c < TURN_LIMITS && column.name != turn_limits[c].name) ++c;
      sum->add(LIMITS + (TURN_LIMITS + 1) * kind + c, from.rows.first, 1, column.value);
    }
  }
}

void move_to_datasets(bool trajectory, Lattice* lattice, std::vector<Dataset>* out) {
  for (std::size_t kind = 0; kind < lattice->interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    InteractionRows& from = lattice->interactions[kind];
    const Rows rows = from.rows;
    if (rows.total == 0) continue;
    const std::size_t width = schema.parameters.size();
    for (std::size_t p = 0; p < width; ++p) {
      std::vector<double> column(static_cast<std::size_t>(rows.count));
      for (std::size_t k = 0; k < column.size(); ++k) column[k] = from.parameter[k * width + p];
      out->push_back({parameter_path(schema, schema.parameters[p].name, trajectory), rows.first, rows.total, 0, std::move(column)});
    }
    for (Column& column : from.break_columns) {
      for (const BreakLimit& one : turn_limits)
        if (column.name == one.name)
          out->push_back({parameter_path(schema, one.name, trajectory), rows.first, rows.total, 0, std::move(column.value), {}, one.powers, true});
      if (column.name == BROKEN && !trajectory) out->push_back({broken_path(schema, false), rows.first, rows.total, 0, std::move(column.value)});
    }
    if (lattice->box.active())
      out->push_back({parameter_path(schema, "shift", trajectory), rows.first, rows.total, schema.ends * lattice->dim, std::move(from.shift)});
    out->push_back({topology_path(schema, trajectory), rows.first, rows.total, schema.ends, std::move(from.ends)});
  }
  lattice->interactions.clear();
}

std::string count_text(const Network& net) {
  std::string text;
  for (std::size_t kind = 0; kind < net.interactions.size(); ++kind)
    if (net.interactions[kind].total > 0) text += ", " + std::to_string(net.interactions[kind].total) + " " + interaction_schemas()[kind].title + "s";
  return text;
}

}  // namespace bs
