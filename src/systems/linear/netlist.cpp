#include "systems/linear/netlist.hpp"
#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>
#include "base/disjoint_sets.hpp"
#include "base/text.hpp"
#include "systems/linear/waveform.hpp"

namespace bs {
namespace {

const char* const SUPPORTED =
    "cards are Rname N1 N2 ohm, Cname N1 N2 farad, Lname N1 N2 henry, Vname N+ N- SOURCE, Iname N+ N- SOURCE, .tran (passed over), .end and comments";

struct Card {
  std::size_t line = 0;
  std::string text;
};

/// Without the comment at its end, and without blanks around.
std::string without_comment(std::string line) {
  line = line.substr(0, line.find(';'));
  for (std::size_t k = 0; k < line.size(); ++k)
    if (line[k] == '$' && (k == 0 || std::isspace(static_cast<unsigned char>(line[k - 1])))) line.resize(k);
  line = trim(line);
  return line.empty() || line[0] == '*' ? "" : line;
}

/// The cards after the title, up to .end, with the lines that go on with them. Returns a line of error.
std::string split_cards(const std::string& text, std::string* title, std::vector<Card>* cards) {
  const std::vector<std::string> lines = split(text, '\n');
  *title = lines[0];
  for (std::size_t k = 1; k < lines.size(); ++k) {
    const std::string line = without_comment(lines[k]);
    if (line.empty()) continue;
    if (lower(line) == ".end") break;
    if (line[0] != '+') cards->push_back({k + 1, line});
    else if (cards->empty()) return "line " + std::to_string(k + 1) + ": '+' goes on with a card, and there is none before: leave it out";
    else cards->back().text += " " + line.substr(1);
  }
  return {};
}

/// Words between blanks, and between brackets and commas, which count as blanks.
std::vector<std::string> words_of(std::string text) {
  for (char& c : text)
    if (c == '(' || c == ')' || c == ',') c = ' ';
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// u(t) of the words after the nodes of a source: [DC] value, a waveform, or both; then the waveform counts.
std::string read_source(const std::vector<std::string>& words, std::string* source) {
  std::size_t k = 3;
  double value = 0;
  Waveform wave;
  if (k < words.size() && lower(words[k]) == "dc") ++k;
  const bool given = k < words.size() && read_spice_number(words[k], &value).empty();
  if (given) ++k;
  *source = exact_number(value);
  if (k == words.size()) return given ? "" : "a value is missing: write DC 5, or a waveform such as SIN(0 1 1k)";
  const std::string kind = lower(words[k]);
  if (kind == "ac") return "AC is of small-signal analyses, and this one is of time: leave it out";
  if (kind != "sin" && kind != "pulse" && kind != "exp" && kind != "pwl")
    return "'" + printable(words[k]) + "' is no source: write DC 5, or one of SIN, PULSE, EXP, PWL, such as SIN(0 1 1k)";
  *source = kind + "(";
  for (std::size_t j = k + 1; j < words.size(); ++j) *source += (j > k + 1 ? " " : "") + words[j];
  *source += ")";
  return read_waveform(*source, &wave);
}

class Reader {
 public:
  explicit Reader(Circuit* circuit) : circuit_(circuit) {}

  /// One card; returns why it is none.
  std::string read(const Card& card) {
    const std::vector<std::string> words = words_of(card.text);
    const std::string first = words.empty() ? "" : lower(words[0]);
    if (first == ".tran") return pass_over(words);
    if (first.empty() || std::string("rclvi").find(first[0]) == std::string::npos)
      return "'" + printable(card.text) + "' is not among what is read: " + SUPPORTED;
    if (words.size() < 4) return "'" + printable(card.text) + "' lacks nodes or a value: " + SUPPORTED;
    const auto [before, fresh] = lines_.emplace(first, card.line);
    if (!fresh) return words[0] + " is there already, in line " + std::to_string(before->second) + ": give it another name";
    CircuitElement e;
    e.kind = first[0];
    e.name = words[0];
    e.a = node(words[1]);
    e.b = node(words[2]);
    const std::string error = e.kind == 'v' || e.kind == 'i' ? read_source(words, &e.source) : read_value(words, &e);
    if (error.empty()) circuit_->elements.push_back(e);
    return error.empty() ? "" : words[0] + ": " + error;
  }

 private:
  std::size_t node(const std::string& word) {
    const std::string name = lower(word);
    if (name == "0" || name == "gnd") return 0;
    const auto [place, fresh] = numbers_.emplace(name, circuit_->nodes.size());
    if (fresh) circuit_->nodes.push_back(word);
    return place->second;
  }

  static std::string read_value(const std::vector<std::string>& words, CircuitElement* e) {
    const std::string refused = read_spice_number(words[3], &e->value);
    if (!refused.empty()) return "'" + printable(words[3]) + "' " + refused;
    if (e->kind == 'r' ? e->value == 0 : e->value <= 0)
      return words[3] + (e->kind == 'r' ? ": a resistance must not be 0: join its nodes, or put a V card of 0 in its place" : ": give a number > 0");
    if (words.size() == 4) return {};
    if (lower(words[4]).rfind("ic", 0) == 0)
      return "initial conditions are not read from cards: leave IC out and give -bs_linear_x0, or -bs_linear_dc for the operating point";
    return "'" + printable(words[4]) + "' after the value is not read: leave it out";
  }

  std::string pass_over(const std::vector<std::string>& words) {
    std::string instead;
    double step = 0, end = 0;
    if (words.size() > 2 && read_spice_number(words[1], &step).empty() && read_spice_number(words[2], &end).empty())
      instead = ": write -ts_dt " + short_number(step) + " -ts_max_time " + short_number(end);
    circuit_->remarks.push_back(".tran is passed over" + (instead.empty() ? ": give -ts_dt and -ts_max_time" : instead));
    return {};
  }

  Circuit* circuit_;
  std::map<std::string, std::size_t> numbers_, lines_;
};

/// What leaves voltages or currents undetermined: loops of voltage sources, and nodes that nothing but current sources joins to ground.
std::string check_topology(const Circuit& c) {
  DisjointSets held(static_cast<PetscInt>(c.nodes.size())), joined(static_cast<PetscInt>(c.nodes.size()));
  for (const CircuitElement& e : c.elements) {
    const auto a = static_cast<PetscInt>(e.a), b = static_cast<PetscInt>(e.b);
    if (e.kind == 'v' && held.top(a) == held.top(b))
      return e.name + " closes a loop of voltage sources between the nodes " + c.nodes[e.a] + " and " + c.nodes[e.b] +
             ", whose current nothing determines: put a resistor into the loop";
    if (e.kind == 'v') held.join(a, b);
    if (e.kind != 'i') joined.join(a, b);
  }
  std::string names;
  std::size_t count = 0;
  for (std::size_t k = 1; k < c.nodes.size(); ++k)
    if (joined.top(static_cast<PetscInt>(k)) != joined.top(0) && ++count <= 5) names += (count > 1 ? ", " : "") + c.nodes[k];
  if (count == 0) return {};
  return std::string(count > 1 ? "the nodes " : "the node ") + names + (count > 5 ? ", ..." : "") + (count > 1 ? " float" : " floats") +
         ": no resistor, capacitor, inductor or voltage source leads to ground (0 or gnd): add one";
}

}  // namespace

std::string read_netlist(const std::string& text, const std::string& file, Circuit* out) {
  std::vector<Card> cards;
  *out = {};
  std::string error = split_cards(text, &out->title, &cards);
  if (!error.empty()) return file + " " + error;
  Circuit scratch;
  if (Reader(&scratch).read({1, without_comment(out->title)}).empty() && !scratch.elements.empty())
    out->remarks.push_back(file + " line 1: '" + printable(out->title) + "' counts as the title, as in SPICE, not as a card: put a title before it");
  Reader reader(out);
  for (const Card& card : cards) {
    const std::size_t said = out->remarks.size();
    error = reader.read(card);
    const std::string where = file + " line " + std::to_string(card.line) + ": ";
    if (!error.empty()) return where + error;
    if (out->remarks.size() > said) out->remarks.back() = where + out->remarks.back();
  }
  if (out->elements.empty()) return file + ": no cards: after the first line, the title, " + SUPPORTED;
  error = check_topology(*out);
  return error.empty() ? "" : file + ": " + error;
}

}  // namespace bs
