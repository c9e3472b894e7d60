#include "input/gmsh_scan.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <utility>

#include "base/format.hpp"
#include "input/gmsh_numbers.hpp"
#include "lattice/text.hpp"

namespace bs {

namespace {

/// Dimension, corners and nodes of Gmsh's element types from 1 on.
struct Shape {
  int dimension, corners, nodes;
};
constexpr Shape shapes[] = {{1, 2, 2},  {2, 3, 3},  {2, 4, 4},  {3, 4, 4},  {3, 8, 8},  {3, 6, 6},  {3, 5, 5},  {1, 2, 3},
                            {2, 3, 6},  {2, 4, 9},  {3, 4, 10}, {3, 8, 27}, {3, 6, 18}, {3, 5, 14}, {0, 1, 1},  {2, 4, 8},
                            {3, 8, 20}, {3, 6, 15}, {3, 5, 13}, {2, 3, 9},  {2, 3, 10}, {2, 3, 12}, {2, 3, 15}, {2, 3, 15},
                            {2, 3, 21}, {1, 2, 4},  {1, 2, 5},  {1, 2, 6},  {3, 4, 20}, {3, 4, 35}, {3, 4, 56}};
constexpr std::int64_t shape_count = sizeof shapes / sizeof shapes[0];

/// Reads both sections; goes on while nothing is wrong and everything is understood.
class Scanner {
 public:
  Scanner(const std::string& text, bool binary, bool v4) : in_(text, binary, v4), binary_(binary), v4_(v4) {}
  GmshScan run() {
    if (in_.section("$Nodes")) v4_ ? nodes4() : nodes2();
    if (!in_.good()) fail("$Nodes lacks a number where one is required");
    if (ok()) index_nodes();
    if (ok() && in_.section("$Elements")) v4_ ? elements4() : elements2();
    if (!in_.good()) fail("$Elements lacks a number where one is required");
    for (std::size_t k = 0; ok() && k < tags_.size(); ++k)
      if (used_[place(tags_[k])]) out_.nodes.push_back(tags_[k]);
    out_.complete = ok();
    return std::move(out_);
  }

 private:
  bool ok() const { return out_.fault.empty() && understood_ && in_.good(); }
  void fail(const std::string& text) {
    if (out_.fault.empty()) out_.fault = text + "; write it again";
  }
  /// A count must not exceed what the rest of the file can hold.
  bool plausible(std::int64_t count, const char* what) {
    if (in_.good() && (count < 0 || static_cast<std::uint64_t>(count) > in_.left())) fail(format("announces %" PRId64 " %s", count, what));
    return ok();
  }
  void nodes2() {
    const std::int64_t count = in_.count_line();
    if (!plausible(count, "nodes")) return;
    for (std::int64_t k = 0; k < count && ok(); ++k) {
      tags_.push_back(in_.small());
      in_.skip_reals(3);
    }
  }
  void nodes4() {
    const std::int64_t blocks = in_.large();
    for (int k = 0; k < 3; ++k) (void)in_.large();
    for (std::int64_t b = 0; b < blocks && ok(); ++b) {
      const std::int64_t dimension = in_.small();
      (void)in_.small();
      const std::int64_t parametric = in_.small(), count = in_.large();
      if (!plausible(count, "nodes")) return;
      for (std::int64_t k = 0; k < count && ok(); ++k) tags_.push_back(in_.large());
      in_.skip_reals(count * (3 + (parametric ? std::clamp<std::int64_t>(dimension, 0, 3) : 0)));
    }
  }
  void index_nodes() {
    sorted_ = tags_;
    std::sort(sorted_.begin(), sorted_.end());
    const auto twice = std::adjacent_find(sorted_.begin(), sorted_.end());
    if (twice != sorted_.end()) fail(format("node %" PRId64 " is given twice", *twice));
    used_.assign(sorted_.size(), false);
  }
  std::size_t place(std::int64_t tag) const {
    return static_cast<std::size_t>(std::lower_bound(sorted_.begin(), sorted_.end(), tag) - sorted_.begin());
  }
  const Shape* shape(std::int64_t type) {
    understood_ = understood_ && type >= 1 && type <= shape_count;
    return ok() ? &shapes[type - 1] : nullptr;
  }
  /// The nodes of one element.
  void element(std::int64_t tag, const Shape& shape) {
    std::int64_t ends[56];
    for (int k = 0; k < shape.nodes; ++k) ends[k] = in_.large();
    if (!ok()) return;
    for (int k = 0; k < shape.nodes; ++k) {
      const std::size_t at = place(ends[k]);
      if (at == sorted_.size() || sorted_[at] != ends[k])
        return fail(format("element %" PRId64 " lies on node %" PRId64 ", which is not in $Nodes", tag, ends[k]));
      if (std::find(ends, ends + k, ends[k]) != ends + k) return fail(format("element %" PRId64 " lies twice on node %" PRId64, tag, ends[k]));
      if (k < shape.corners) used_[at] = true;
    }
    out_.dimension = std::max(out_.dimension, shape.dimension);
    out_.curved = out_.curved || shape.nodes > shape.corners;
    if (shape.dimension == 1) out_.lines.push_back({tag, {ends[0], ends[1]}});
  }
  void elements2() {
    const std::int64_t count = in_.count_line();
    if (!plausible(count, "elements")) return;
    for (std::int64_t k = 0; k < count && ok();) {
      // In binary a header serves several elements of one type.
      const std::int64_t first = binary_ ? 0 : in_.small(), type = in_.small(), block = binary_ ? in_.small() : 1;
      const std::int64_t labels = in_.small();
      const Shape* const known = shape(type);
      if (!known || !plausible(block, "elements") || !plausible(labels, "labels")) return;
      for (std::int64_t b = 0; b < block && ok(); ++b) {
        const std::int64_t tag = binary_ ? in_.small() : first;
        for (std::int64_t l = 0; l < labels && ok(); ++l) (void)in_.small();
        element(tag, *known);
      }
      k += std::max<std::int64_t>(block, 1);
    }
  }
  void elements4() {
    const std::int64_t blocks = in_.large();
    for (int k = 0; k < 3; ++k) (void)in_.large();
    for (std::int64_t b = 0; b < blocks && ok(); ++b) {
      for (int k = 0; k < 2; ++k) (void)in_.small();
      const Shape* const known = shape(in_.small());
      const std::int64_t count = in_.large();
      if (!known || !plausible(count, "elements")) return;
      for (std::int64_t k = 0; k < count && ok(); ++k) {
        const std::int64_t tag = in_.large();
        element(tag, *known);
      }
    }
  }

  GmshNumbers in_;
  bool binary_, v4_, understood_ = true;
  std::vector<std::int64_t> tags_, sorted_;
  std::vector<bool> used_;  // by place in sorted_
  GmshScan out_;
};

}  // namespace

std::string fault_of_gmsh(const std::string& text) {
  char word[16] = {}, version[16] = {};
  (void)std::sscanf(text.c_str(), "%15s %15s", word, version);
  if (std::strcmp(word, "$MeshFormat") != 0 && std::strcmp(word, "$Comments") != 0)
    return "line 1: not a Gmsh mesh, which begins with $MeshFormat; write it by Gmsh (-format msh41)";
  if (std::strcmp(word, "$MeshFormat") == 0) {
    const std::string v = version;
    if (v != "2.2" && v != "4.1")
      return "line 2: Gmsh format " + (v.empty() ? "without a version" : printable(v)) + "; write 2.2 or 4.1 (gmsh -save -format msh41)";
  }
  const auto has = [&text](const char* name) { return text.find(std::string("\n") + name) != std::string::npos; };
  if (has("$PartitionedEntities"))
    return "a partitioned mesh of format 4.1 ($PartitionedEntities); write it without partitions, or make an .h5 of it by "
           "postprocess/convert.py";
  if (version[0] == '4' && !has("$Entities"))
    return "has no $Entities, which format 4.1 needs (meshio leaves them out); write it as Gmsh 2.2 (in meshio: gmsh22)";
  for (const char* const name : {"$Nodes", "$EndNodes", "$Elements", "$EndElements"})
    if (!has(name)) return std::string("has no ") + name + ": truncated, or not a whole mesh; write it again";
  return {};
}

GmshScan scan_gmsh(const std::string& text) {
  double version = 0;
  int binary = 0, one = 0;
  const std::size_t head = text.find("$MeshFormat");
  if (head == std::string::npos || std::sscanf(text.c_str() + head + 11, "%lf %d", &version, &binary) != 2) return {};
  if (binary) {
    const std::size_t line = text.find('\n', text.find('\n', head) + 1);
    if (line == std::string::npos || text.size() - line < 1 + sizeof one) return {};
    std::memcpy(&one, text.data() + line + 1, sizeof one);
    if (one != 1) return {};  // of the other byte order
  }
  return Scanner(text, binary != 0, version >= 4).run();
}

std::string lone_line(const GmshScan& scan, std::int64_t vertices, const std::vector<std::int64_t>& pairs) {
  using Edge = std::pair<std::int64_t, std::int64_t>;
  // DMPlex numbers the nodes that elements use in the file's order.
  if (!scan.complete || scan.lines.empty() || static_cast<std::int64_t>(scan.nodes.size()) != vertices) return {};
  std::vector<Edge> rows, edges;
  for (std::size_t k = 0; k < scan.nodes.size(); ++k) rows.emplace_back(scan.nodes[k], static_cast<std::int64_t>(k));
  std::sort(rows.begin(), rows.end());
  for (std::size_t e = 0; 2 * e < pairs.size(); ++e) edges.push_back(std::minmax(pairs[2 * e], pairs[2 * e + 1]));
  std::sort(edges.begin(), edges.end());
  for (const GmshLine& line : scan.lines) {
    std::int64_t end[2];
    for (int k = 0; k < 2; ++k) end[k] = std::lower_bound(rows.begin(), rows.end(), Edge(line.ends[k], 0))->second;
    if (!std::binary_search(edges.begin(), edges.end(), Edge(std::minmax(end[0], end[1]))))
      return format("line element %" PRId64 " (nodes %" PRId64 " and %" PRId64
                    ") is not an edge of the other elements and would "
                    "be lost; make an .h5 of the mesh by postprocess/convert.py",
                    line.element, line.ends[0], line.ends[1]);
  }
  return {};
}

}  // namespace bs
