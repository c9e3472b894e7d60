#include "lattice/xsp.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "base/text.hpp"

namespace bs {

namespace {

/// Reads records line by line into a scene; the first fault ends it.
class XspParser {
 public:
  explicit XspParser(std::string name) : name_(std::move(name)) {}

  bool read(const std::string& text) {
    // Cut at each line feed; a last line without one counts, too.
    for (std::size_t begin = 0; begin < text.size() && error_.empty();) {
      const std::size_t feed = std::min(text.find('\n', begin), text.size());
      if (line_ == std::numeric_limits<int>::max()) return fail("the file has too many lines");
      ++line_;
      read_line(text.substr(begin, feed - begin));
      begin = feed + 1;
    }
    if (!error_.empty()) return false;
    if (line_ == 0) return fail("the file is empty: an XSpringies scene begins with #1.0", 1);
    if (scene_.masses.empty()) return fail("the scene has no mass: write at least one 'mass id x y vx vy mass elasticity'");
    return true;
  }

  const XspScene& scene() const { return scene_; }
  const std::string& error() const { return error_; }

 private:
  struct Record {
    const char* word;
    std::size_t least;          ///< fewest numbers
    const char* numbers;        ///< what they are, for messages
    void (XspParser::*take)();  ///< null: of no effect on the motion
  };
  static const Record records_[];

  bool fail(const std::string& what, int at_least_line = 0) {
    if (error_.empty()) error_ = name_ + ":" + std::to_string(std::max(line_, at_least_line)) + ": " + what;
    return false;
  }

  void read_line(const std::string& line) {
    if (line_ == 1) {
      if (line.compare(0, 4, "#1.0") != 0) fail("the file begins with '" + printable(line) + "': an XSpringies scene begins with #1.0");
      return;
    }
    split(line);
    if (words_.empty() || words_[0][0] == '#') return;
    for (const Record* r = records_; r->word; ++r) {
      if (words_[0] != r->word) continue;
      if (words_.size() < r->least + 1)
        fail(words_[0] + " has " + std::to_string(words_.size() - 1) + " of its " + how_many(static_cast<std::int64_t>(r->least), "number") +
             ": write '" + words_[0] + " " + r->numbers + "'");
      else if (r->take) (this->*r->take)();
      return;
    }
    note_unknown(words_[0]);
  }

  void split(const std::string& line) {
    static const char space[] = " \t\r\v\f";
    words_.clear();
    for (std::size_t begin = line.find_first_not_of(space); begin != std::string::npos;) {
      const std::size_t end = std::min(line.find_first_of(space, begin), line.size());
      words_.push_back(line.substr(begin, end - begin));
      begin = line.find_first_not_of(space, end);
    }
  }

  void note_unknown(const std::string& word) {
    if (scene_.unknown_words.empty()) scene_.unknown_line = line_;
    const std::string shown = printable(word);
    for (const std::string& known : scene_.unknown_words)
      if (known == shown) return;
    if (scene_.unknown_words.size() < 5) scene_.unknown_words.push_back(shown);
  }

  /// k-th number of the line as T; a fault where it is none of that type. `what` names it.
  template <class T>
  T number(std::size_t k, const char* what, const char* kind) {
    const std::string& word = words_[k];
    const char* begin = word.data();
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') ++begin;
    T value{};
    const auto [end, code] = std::from_chars(begin, word.data() + word.size(), value);
    if (code == std::errc() && end == word.data() + word.size() && std::isfinite(static_cast<double>(value))) return value;
    fail(words_[0] + ": " + what + " is '" + printable(word) + "': write " + kind);
    return T{};
  }
  double real(std::size_t k, const char* what) { return number<double>(k, what, "a finite number"); }
  std::int64_t integer(std::size_t k, const char* what) { return number<std::int64_t>(k, what, "a whole number of at most 18 digits"); }
  double nonnegative(std::size_t k, const char* what) {
    const double value = real(k, what);
    if (value < 0) fail(words_[0] + ": " + what + " is " + printable(words_[k]) + ": write a number >= 0");
    return value;
  }

  void take_mass() {
    const XspMass m{integer(1, "id"), line_, real(2, "x"), real(3, "y"), real(4, "vx"), real(5, "vy"), real(6, "mass")};
    if (!error_.empty()) return;
    if (m.id < 0) {
      fail("mass: id is " + std::to_string(m.id) + ": write a whole number >= 0");
      return;
    }
    const auto [at, fresh] = scene_.row_of.emplace(m.id, static_cast<std::int64_t>(scene_.masses.size()));
    if (!fresh)
      fail("mass " + std::to_string(m.id) + " was given on line " + std::to_string(scene_.masses[static_cast<std::size_t>(at->second)].line) +
           " already: write another id");
    scene_.masses.push_back(m);
  }

  void take_spring() {
    scene_.springs.push_back({integer(1, "id"), integer(2, "first mass"), integer(3, "second mass"), line_, nonnegative(4, "stiffness"),
                              nonnegative(5, "damping"), nonnegative(6, "rest length")});
  }

  void take_force() {
    const std::int64_t k = integer(1, "number of the force");
    const XspForce force{integer(2, "switch") > 0, words_.size() > 3 ? real(3, "value") : 0.0, words_.size() > 4 ? real(4, "misc") : 0.0};
    if (k >= 0 && k <= 4) scene_.force[k] = force;
    else note_unknown("frce " + std::to_string(k));
  }

  void take_center() { scene_.center = integer(1, "id"); }
  void take_viscosity() { scene_.viscosity = nonnegative(1, "coefficient"); }
  void take_stickiness() { scene_.stickiness = nonnegative(1, "stickiness"); }
  void take_walls() {
    for (std::size_t k = 0; k < 4; ++k) scene_.wall[k] = integer(k + 1, "wall") > 0;
  }
  void take_step() {
    scene_.step = real(1, "step");
    if (scene_.step <= 0) fail("step: h is " + printable(words_[1]) + ": write a time step > 0");
  }

  std::string name_, error_;
  int line_ = 0;
  std::vector<std::string> words_;  ///< of the line at hand
  XspScene scene_;
};

const XspParser::Record XspParser::records_[] = {{"mass", 7, "id x y vx vy mass elasticity", &XspParser::take_mass},
                                                 {"spng", 6, "id a b ks kd rest", &XspParser::take_spring},
                                                 {"frce", 2, "k on value misc", &XspParser::take_force},
                                                 {"cent", 1, "id", &XspParser::take_center},
                                                 {"visc", 1, "c", &XspParser::take_viscosity},
                                                 {"wall", 4, "top left right bottom", &XspParser::take_walls},
                                                 {"stck", 1, "s", &XspParser::take_stickiness},
                                                 {"step", 1, "h", &XspParser::take_step},
                                                 // step control and the settings of the editor
                                                 {"prec", 0, "", nullptr},
                                                 {"adpt", 0, "", nullptr},
                                                 {"cmas", 0, "", nullptr},
                                                 {"elas", 0, "", nullptr},
                                                 {"kspr", 0, "", nullptr},
                                                 {"kdmp", 0, "", nullptr},
                                                 {"fixm", 0, "", nullptr},
                                                 {"shws", 0, "", nullptr},
                                                 {"gsnp", 0, "", nullptr},
                                                 {nullptr, 0, nullptr, nullptr}};

}  // namespace

bool parse_xsp(const std::string& text, const std::string& name, double width, double height, Lattice* out, std::string* error) {
  if (!(width > 0 && height > 0 && std::isfinite(width) && std::isfinite(height))) {
    *error = name + ": the window is " + short_number(width) + " x " + short_number(height) + " pixels: both must be > 0";
    return false;
  }
  XspParser parser(name);
  if (!parser.read(text)) {
    *error = parser.error();
    return false;
  }
  *out = xsp_lattice(parser.scene(), name, width, height);
  return true;
}

}  // namespace bs
