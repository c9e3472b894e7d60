#include "lattice/groups.hpp"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <limits>
#include "base/text.hpp"

namespace bs {

namespace {

bool read_row(const std::string& word, std::int64_t* value) {
  if (word.empty() || word.size() > 18 || !std::all_of(word.begin(), word.end(), [](unsigned char c) { return std::isdigit(c); })) return false;
  *value = std::strtoll(word.c_str(), nullptr, 10);
  return true;
}

/// A row, or two with a hyphen between them.
bool read_range(const std::string& word, std::pair<std::int64_t, std::int64_t>* range) {
  const std::size_t hyphen = word.find('-');
  if (hyphen == std::string::npos) {
    if (!read_row(word, &range->first)) return false;
    range->second = range->first;
    return true;
  }
  return read_row(word.substr(0, hyphen), &range->first) && read_row(word.substr(hyphen + 1), &range->second) && range->first <= range->second;
}

/// The numbers of a box from words[*at] on.
std::string parse_box(const std::vector<std::string>& words, const std::string& first, int dim, std::size_t* at, GroupSpec* out) {
  std::array<double, 6> box{};
  std::string word = first;
  for (int k = 0; k < 2 * dim; ++k) {
    double value = 0;
    if (k > 0 && ++*at < words.size()) word = words[*at];
    if (*at >= words.size() || !read_number(word, &value))
      return "box: needs " + std::to_string(2 * dim) + " numbers [m], the lower corner's and the upper corner's coordinates: write " +
             (dim == 1   ? "box:X0,X1"
              : dim == 2 ? "box:X0,Y0,X1,Y1"
                         : "box:X0,Y0,Z0,X1,Y1,Z1");
    box[static_cast<std::size_t>(k < dim ? k : 3 + k - dim)] = value;
  }
  out->boxes.push_back(box);
  return {};
}

std::string parse_rows(const std::vector<std::string>& words, const std::string& first, std::int64_t total, std::size_t* at, GroupSpec* out) {
  std::string word = first;
  for (;;) {
    std::pair<std::int64_t, std::int64_t> range;
    if (!read_range(word, &range)) return "ids: '" + word + "' is no row of particles: write rows and ranges such as ids:0,5,7-12";
    if (range.second >= total)
      return "ids: there is no particle " + std::to_string(range.second) + ": write rows from 0 to " + std::to_string(total - 1);
    out->ranges.push_back(range);
    if (*at + 1 >= words.size() || words[*at + 1].empty() || !std::isdigit(static_cast<unsigned char>(words[*at + 1][0]))) return {};
    word = words[++*at];
  }
}

}  // namespace

bool is_group_name(const std::string& name) {
  return !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

std::string parse_group(const std::string& text, int dim, int axes, std::int64_t total, GroupSpec* out) {
  const std::vector<std::string> words = split(text, ',');
  for (std::size_t at = 0; at < words.size(); ++at) {
    const std::string& word = words[at];
    std::string fault;
    Faces face = 0;
    if (word == "all") out->all = true;
    else if (word.rfind("box:", 0) == 0) fault = parse_box(words, word.substr(4), dim, &at, out);
    else if (word.rfind("ids:", 0) == 0) fault = parse_rows(words, word.substr(4), total, &at, out);
    else if (parse_faces({word}, axes, &face).empty()) out->faces |= face;
    else
      fault = "'" + word + "' chooses no particles: write faces (xmin" + (axes > 1 ? ", xmax, ymin" : ", xmax") + (axes > 1 ? ", ...)" : ")") +
              ", box:LOW,HIGH corners, ids:0,5,7-12 or all, with commas between them";
    if (!fault.empty()) return fault;
  }
  return {};
}

void choose_groups(const std::vector<GroupSpec>& specs, const Box& box, double depth, Lattice* l) {
  const std::size_t d = static_cast<std::size_t>(l->dim), count = static_cast<std::size_t>(l->particles.count);
  for (const GroupSpec& spec : specs) {
    Group group{spec.name, std::vector<std::uint8_t>(count, spec.all ? 1 : 0)};
    apply_faces(spec.faces & 3u, box, depth, l->dim, l->position, &group.member);
    apply_faces(spec.faces & ~3u, box, 0, l->dim, l->position, &group.member);
    for (const auto& [first, last] : spec.ranges)
      for (std::int64_t row = std::max(first, l->particles.first); row <= last && row < l->particles.first + l->particles.count; ++row)
        group.member[static_cast<std::size_t>(row - l->particles.first)] = 1;
    for (const std::array<double, 6>& inner : spec.boxes)
      for (std::size_t p = 0; p < count; ++p) {
        bool inside = true;
        for (std::size_t c = 0; c < d; ++c) inside = inside && l->position[p * d + c] >= inner[c] && l->position[p * d + c] <= inner[3 + c];
        if (inside) group.member[p] = 1;
      }
    const auto old = std::find_if(l->groups.begin(), l->groups.end(), [&](const Group& one) { return one.name == spec.name; });
    if (old != l->groups.end()) *old = std::move(group);
    else l->groups.push_back(std::move(group));
  }
}

void fix_groups(const std::vector<std::string>& names, Lattice* l) {
  for (const Group& group : l->groups)
    if (std::find(names.begin(), names.end(), group.name) != names.end())
      for (std::size_t p = 0; p < group.member.size(); ++p)
        if (group.member[p]) l->fixed[p] = 1;
}

namespace {
const char* const face_names[6] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
}

std::string parse_faces(const std::vector<std::string>& names, int axes, Faces* faces) {
  *faces = 0;
  for (const std::string& name : names) {
    int face = 0;
    while (face < 2 * axes && name != face_names[face]) ++face;
    if (face == 2 * axes) {
      std::string known = face_names[0];
      for (int f = 1; f < 2 * axes; ++f) known += std::string(", ") + face_names[f];
      return "-bs_lattice_fixed " + name + ": no such face; the faces of this lattice are " + known;
    }
    *faces |= 1u << face;
  }
  return {};
}

void apply_faces(Faces faces, const Box& box, double depth, int dim, const std::vector<double>& position, std::vector<std::uint8_t>* fixed) {
  for (int k = 0; k < dim; ++k) {
    const bool lower = faces >> (2 * k) & 1u, upper = faces >> (2 * k + 1) & 1u;
    if (!lower && !upper) continue;
    const double size = std::max(std::abs(box.lo[k]), std::abs(box.hi[k]));
    const double reach = depth + 1e-9 * (box.hi[k] - box.lo[k]) + 8 * std::numeric_limits<double>::epsilon() * size;
    for (std::size_t p = 0; p < fixed->size(); ++p) {
      const double x = position[p * static_cast<std::size_t>(dim) + static_cast<std::size_t>(k)];
      if ((lower && x - box.lo[k] <= reach) || (upper && box.hi[k] - x <= reach)) (*fixed)[p] = 1;
    }
  }
}

void apply_fixed_particles(const std::vector<std::int64_t>& ids, const Rows& rows, std::vector<std::uint8_t>* fixed) {
  for (const std::int64_t id : ids)
    if (id >= rows.first && id - rows.first < rows.count) (*fixed)[static_cast<std::size_t>(id - rows.first)] = 1;
}

void apply_velocity(const std::vector<double>& u, const std::vector<double>& gradient, int dim, const std::vector<double>& position,
                    const std::vector<std::uint8_t>& fixed, std::vector<double>* velocity) {
  const std::size_t d = static_cast<std::size_t>(dim), n = position.size() / d;
  velocity->assign(n * d, 0.0);
  for (std::size_t p = 0; p < n; ++p) {
    if (!fixed.empty() && fixed[p]) continue;
    for (std::size_t i = 0; i < d; ++i) {
      double v = i < u.size() ? u[i] : 0.0;
      if (!gradient.empty())
        for (std::size_t j = 0; j < d; ++j) v += gradient[i * d + j] * position[p * d + j];
      (*velocity)[p * d + i] = v;
    }
  }
}

}  // namespace bs
