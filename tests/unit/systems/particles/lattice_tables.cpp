// Everything that the reader of lattice files knows is written by take_tables: the members of each group of the schema, by name.
#include "systems/particles/lattice_tables.hpp"
#include <catch2/catch.hpp>
#include <set>
#include "lattice/spring_laws.hpp"

using namespace bs;

namespace {

std::vector<double> numbers(std::int64_t count) { return std::vector<double>(static_cast<std::size_t>(count), 0.5); }
std::vector<std::int64_t> rows(std::int64_t count) { return std::vector<std::int64_t>(static_cast<std::size_t>(count), 1); }

/// Eight particles, four springs, two anchors and two of each interaction, with every number that any of them may have.
Lattice full_lattice() {
  Lattice l;
  l.particles = {0, 8, 8};
  l.position = l.velocity = numbers(24);
  l.mass = numbers(8);
  l.fixed.assign(8, 1);
  l.id = rows(8);
  for (const ParticleParameter& one : particle_parameters) l.particle_columns.push_back({one.name, "", numbers(8 * one.width(3))});
  l.springs = {0, 4, 4};
  l.pairs = rows(8);
  l.stiffness = l.rest_length = l.damping = numbers(4);
  l.shift = rows(12);
  l.law_by_row = true;
  l.spring_laws.assign(4, 1);
  for (const SpringParameter& one : spring_parameters()) l.spring_columns.push_back({one.name, "", numbers(4)});
  for (const SpringHistory& one : spring_histories()) l.spring_columns.push_back({one.name, "", numbers(4)});
  for (const BreakLimit& one : break_limits) l.break_columns.push_back({one.name, "", numbers(4)});
  l.break_columns.push_back({BROKEN, "", numbers(4)});
  l.area = {AREA, "", numbers(4)};
  l.anchors = {0, 2, 2};
  l.anchor_particle = rows(2);
  l.anchor_point = numbers(6);
  l.anchor_stiffness = l.anchor_rest_length = l.anchor_damping = numbers(2);
  for (const InteractionSchema& schema : interaction_schemas()) {
    l.interactions.push_back(
        {{0, 2, 2}, rows(2 * schema.ends), numbers(2 * static_cast<std::int64_t>(schema.parameters.size())), rows(6 * schema.ends), {}});
    for (const BreakLimit& one : turn_limits) l.interactions.back().break_columns.push_back({one.name, "", numbers(2)});
    l.interactions.back().break_columns.push_back({BROKEN, "", numbers(2)});
  }
  l.box.periodic[0] = true;
  for (std::size_t k = 0; k < 9; k += 4) l.box.edges[k] = 2;
  l.groups.push_back({"some", std::vector<std::uint8_t>(8, 1)});
  return l;
}

}  // namespace

TEST_CASE("whatever is read of a lattice file is written to one") {
  Lattice l = full_lattice();
  std::vector<Dataset> tables;
  REQUIRE(take_tables(PETSC_COMM_SELF, hdf5_layout(false), &l, &tables) == 0);
  std::set<std::string> written, read = {"/groups/some"};
  for (const Dataset& table : tables) {
    CHECK(written.insert(table.path).second);
    const std::size_t width = static_cast<std::size_t>(std::max(1, table.columns)), all = width * static_cast<std::size_t>(table.total);
    std::visit(
        [&](const auto& one) {
          using Rows = std::decay_t<decltype(one)>;
          if constexpr (!std::is_same_v<Rows, Words>) CHECK(one.size() == all);
        },
        table.rows);
  }
  for (const auto& [group, names] : lattice_members())
    for (const std::string& name : names) read.insert(group + "/" + name);
  CHECK(written == read);
}

TEST_CASE("what a lattice file says in attributes") {
  Lattice l;
  CHECK(root_attributes(l).empty());
  l.spring_law_given = l.damping_law_given = l.law_by_row = l.rest_at_zero_length = true;
  l.spring_law = SpringLaw::strain;
  l.damping_law = DampingLaw::simple;
  l.implied_options = {{"-bs_gravity", "0,-1"}, {"-ts_dt", "0.1"}};
  const auto all = root_attributes(l);
  const std::vector<std::pair<std::string, std::string>> expected = {{"spring_law", "strain"},
                                                                     {"damping_law", "simple"},
                                                                     {"spring_laws", "hooke,strain,tension,polynomial,plastic,maxwell"},
                                                                     {"implied_options", "-bs_gravity 0,-1 -ts_dt 0.1"},
                                                                     {"force_at_zero_length", "none"}};
  CHECK(all == expected);
}
