// The scan of Gmsh meshes that goes before DMPlex.
#include <algorithm>
#include "common.hpp"
#include "input/gmsh_scan.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of(data, size);
  const std::string whole = bs::fault_of_gmsh(text);
  if (!whole.empty()) require_message(whole, "");
  const bs::GmshScan scan = bs::scan_gmsh(text);
  if (!scan.fault.empty()) {
    require_message(scan.fault, "");
    require(!scan.complete, "a fault ends the scan");
    return 0;
  }
  if (!scan.complete) return 0;
  std::vector<std::int64_t> sorted = scan.nodes;
  std::sort(sorted.begin(), sorted.end());
  require(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(), "each node once");
  for (const bs::GmshLine& line : scan.lines)
    for (const std::int64_t end : line.ends) require(std::binary_search(sorted.begin(), sorted.end(), end), "lines end at nodes");
  // with the edges 0-1, 1-2, ...: a message or none, never more
  std::vector<std::int64_t> pairs;
  for (std::size_t k = 1; k < scan.nodes.size(); ++k) pairs.insert(pairs.end(), {static_cast<std::int64_t>(k) - 1, static_cast<std::int64_t>(k)});
  const std::string lone = bs::lone_line(scan, static_cast<std::int64_t>(scan.nodes.size()), pairs);
  if (!lone.empty()) require_message(lone, "line element ");
  return 0;
}
