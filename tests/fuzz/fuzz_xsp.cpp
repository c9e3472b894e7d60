// XSpringies scenes.
#include "common.hpp"
#include "lattice/xsp.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bs::Lattice l;
  std::string error;
  if (!bs::parse_xsp(text_of(data, size), "f.xsp", bs::XSP_WIDTH, bs::XSP_HEIGHT, &l, &error)) {
    require_message(error, "f.xsp:");
    return 0;
  }
  require(error.empty(), "success has no message");
  const std::size_t n = l.mass.size(), m = l.stiffness.size();
  require(n >= 1 && l.position.size() == 2 * n && l.velocity.size() == 2 * n && l.fixed.size() == n && l.id.size() == n, "one entry a particle");
  require(l.pairs.size() == 2 * m && l.damping.size() == m && l.rest_length.size() == m, "one entry a spring");
  for (const std::int64_t end : l.pairs) require(end >= 0 && end < static_cast<std::int64_t>(n), "ends exist");
  for (const auto* values : {&l.position, &l.velocity, &l.mass, &l.particle_columns.at(0).value, &l.stiffness, &l.damping, &l.rest_length})
    require_finite(*values);
  for (const double mass : l.mass) require(mass > 0, "masses are positive");
  for (const std::string& warning : l.warnings) require_message(warning, "f.xsp:");
  for (const auto& [name, value] : l.implied_options)
    require(name[0] == '-' && value.find("nan") == std::string::npos && value.find("inf") == std::string::npos, "implied options are finite");
  return 0;
}
