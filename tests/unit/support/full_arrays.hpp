// A lattice in memory with everything that one may hold, and whether two are the same.
#pragma once
#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "lattice/columns.hpp"
#include "lattice/lattice_arrays.hpp"
#include "lattice/spring_laws.hpp"

/// 12 particles in d = 2 or 3 dimensions and a box that is periodic along all edges but the last, 20 springs of four laws, two anchors, angle
/// springs, and hinges where d = 3. Complete: nothing of it is filled in or dropped when it is loaded.
inline bs::LatticeArrays full_arrays(int dim) {
  const std::size_t d = static_cast<std::size_t>(dim), n = 12, s = 20;
  std::mt19937 generator(7);
  const auto drawn = [&generator](std::size_t count, double low, double high) {
    std::vector<double> some(count);
    for (double& one : some) one = low + (high - low) * std::generate_canonical<double, 53>(generator);
    return some;
  };
  const auto of_law = [&drawn](std::size_t place, double low, double high) {
    std::vector<double> some = drawn(s, low, high);
    for (std::size_t k = 0; k < s; ++k)
      if (k % 4 != place) some[k] = 0;
    return some;
  };
  bs::LatticeArrays a;
  a.dim = dim;
  a.position = drawn(n * d, 0, 3);
  a.velocity = drawn(n * d, -1, 1);
  a.mass = drawn(n, 1, 2);
  a.fixed.assign(n, 0);
  a.fixed[0] = a.fixed[5] = 1;
  for (std::size_t c = 0; c < d; ++c) a.velocity[c] = a.velocity[5 * d + c] = 0;
  for (std::size_t p = 0; p < n; ++p) a.id.push_back(7 + 3 * static_cast<std::int64_t>(p));
  a.particle_columns = {{"radius", "", drawn(n, 0, 1)}, {"drag", "", drawn(n, 0, 1)}, {"force", "", drawn(n * d, -1, 1)}};
  a.groups = {{"a", std::vector<std::uint8_t>(n, 0)}, {"some", std::vector<std::uint8_t>(n, 0)}};
  a.groups[0].member[0] = a.groups[1].member[2] = a.groups[1].member[11] = 1;
  for (std::int64_t k = 0; k < 20; ++k) a.springs.insert(a.springs.end(), {k % 12, (k + 1 + k / 12 * 3) % 12});
  a.stiffness = drawn(s, 1, 2);
  a.rest_length = drawn(s, 1, 2);
  a.damping = drawn(s, 0, 1);
  a.area = drawn(s, 1, 2);
  a.laws = {"hooke", "plastic", "maxwell", "polynomial"};
  for (std::int64_t k = 0; k < 20; ++k) a.law.push_back(k % 4);
  a.spring_columns = {
      {"stiffness_2", "", of_law(3, 1, 2)},      {"stiffness_3", "", of_law(3, 1, 2)},       {"yield_force", "", of_law(1, 1, 2)},
      {"hardening", "", of_law(1, 1, 2)},        {"relaxation_time", "", of_law(2, 1, 2)},   {"plastic_stretch", "", of_law(1, 0, 0.1)},
      {"plastic_path", "", of_law(1, 0.2, 0.3)}, {"viscous_stretch", "", of_law(2, 0, 0.1)}, {"viscous_loss", "", of_law(2, 0, 1)}};
  a.break_columns = {{"critical_strain", "", drawn(s, 5, 9)}, {"critical_force", "", drawn(s, 50, 90)}, {"critical_energy", "", drawn(s, 50, 90)}};
  a.break_columns[0].value[3] = std::numeric_limits<double>::infinity();
  a.break_columns.push_back({bs::BROKEN, "", std::vector<double>(s, 0)});
  a.break_columns[3].value[9] = 1;
  a.damping_law = "simple";
  a.spring_law = "strain";  // of the anchors
  a.rest_at_zero_length = true;
  a.implied_options = {{"-bs_gravity", dim == 3 ? "0,0,-1" : "0,-1"}, {"-bs_viscosity", "0.5"}};
  a.box.edges = dim == 3 ? std::array<double, 9>{3.5, 0, 0, 0.5, 3.6, 0, 0, 0, 4} : std::array<double, 9>{3.5, 0, 0.5, 3.6, 0, 0, 0, 0, 0};
  for (int k = 0; k + 1 < dim; ++k) a.box.periodic[k] = true;
  a.shift.assign(s * d, 0);
  for (std::size_t k = 0; k < s; ++k) a.shift[k * d] = static_cast<std::int64_t>(k % 3) - 1;
  a.anchors = {{1, 2}, drawn(2 * d, 0, 3), {1, 2}, {0.5, 0.25}, {0.1, 0.2}};
  a.interactions = {{"angles",
                     {0, 1, 2, 3, 4, 5},
                     {0.1, 1, 0.2, 2},
                     std::vector<std::int64_t>(6 * d, 0),
                     {{"critical_change", "", {50, 60}}, {bs::BROKEN, "", {0, 0}}}}};
  a.interactions[0].shift[3 * d] = 1;
  if (dim == 3)
    a.interactions.push_back(
        {"hinges", {0, 1, 2, 3, 4, 5, 6, 7}, {0.1, 1, 0.2, -2}, std::vector<std::int64_t>(24, 0), {{"critical_energy", "", {70, 80}}}});
  return a;
}

/// The name of the first array in which they differ; empty: none. Laws by their names, columns whatever their order.
inline std::string difference(const bs::LatticeArrays& a, const bs::LatticeArrays& b) {
  const auto columns = [](std::vector<bs::Column> some) {
    std::sort(some.begin(), some.end(), [](const bs::Column& x, const bs::Column& y) { return x.name < y.name; });
    return some;
  };
  const auto differ = [&columns](const std::vector<bs::Column>& x, const std::vector<bs::Column>& y) {
    const auto same = [](const bs::Column& p, const bs::Column& q) { return p.name == q.name && p.value == q.value; };
    const std::vector<bs::Column> u = columns(x), v = columns(y);
    return !std::equal(u.begin(), u.end(), v.begin(), v.end(), same);
  };
  const auto law_names = [](const bs::LatticeArrays& one) {
    std::vector<std::string> names;
    for (const std::int64_t at : one.law) names.push_back(one.laws.at(static_cast<std::size_t>(at)));
    return names;
  };
  const auto kinds = [&differ](const bs::InteractionArrays& x, const bs::InteractionArrays& y) {
    return x.kind == y.kind && x.ends == y.ends && x.parameter == y.parameter && x.shift == y.shift && !differ(x.break_columns, y.break_columns);
  };
  const auto groups = [](const bs::Group& x, const bs::Group& y) { return x.name == y.name && x.member == y.member; };
  if (a.dim != b.dim) return "dim";
  if (a.position != b.position) return "position";
  if (a.velocity != b.velocity) return "velocity";
  if (a.mass != b.mass) return "mass";
  if (a.fixed != b.fixed) return "fixed";
  if (a.id != b.id) return "id";
  if (a.springs != b.springs) return "springs";
  if (a.stiffness != b.stiffness) return "stiffness";
  if (a.rest_length != b.rest_length) return "rest_length";
  if (a.damping != b.damping) return "damping";
  if (a.area != b.area) return "area";
  if (differ(a.particle_columns, b.particle_columns)) return "particle_columns";
  if (differ(a.spring_columns, b.spring_columns)) return "spring_columns";
  if (differ(a.break_columns, b.break_columns)) return "break_columns";
  if (!std::equal(a.groups.begin(), a.groups.end(), b.groups.begin(), b.groups.end(), groups)) return "groups";
  if (!std::equal(a.box.periodic, a.box.periodic + 3, b.box.periodic) || (a.box.active() && a.box.edges != b.box.edges)) return "box";
  if (a.shift != b.shift) return "shift";
  if (a.anchors.particle != b.anchors.particle || a.anchors.point != b.anchors.point) return "anchors";
  if (a.anchors.stiffness != b.anchors.stiffness || a.anchors.rest_length != b.anchors.rest_length || a.anchors.damping != b.anchors.damping)
    return "numbers of anchors";
  if (!std::equal(a.interactions.begin(), a.interactions.end(), b.interactions.begin(), b.interactions.end(), kinds)) return "interactions";
  if (a.spring_law != b.spring_law || a.damping_law != b.damping_law || law_names(a) != law_names(b)) return "laws";
  if (a.rest_at_zero_length != b.rest_at_zero_length) return "rest_at_zero_length";
  return a.implied_options != b.implied_options ? "implied_options" : "";
}
