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
    "cards are Rname N1 N2 ohm, Cname N1 N2 farad [IC=V], Lname N1 N2 henry [IC=A], Vname N+ N- SOURCE, Iname N+ N- SOURCE, .ic V(NODE)=V, .tran "
    "(passed over but for UIC), "
    ".end and comments";

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
  *source = plain_number(value);
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
  bool has_tran() const { return tran_; }
  bool has_uic() const { return uic_; }

  /// One card; returns why it is none.
  std::string read(const Card& card) {
    const std::vector<std::string> words = words_of(card.text);
    const std::string first = words.empty() ? "" : lower(words[0]);
    if (first == ".tran") return pass_over(words);
    if (first == ".ic") return read_node_voltages(card.text);
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

  /// After the last card: whether the run starts from conditions, and the voltages of capacitors that .ic gives. Returns an error.
  std::string finish() {
    std::vector<double> at(circuit_->nodes.size(), 0.0);
    std::vector<bool> held(at.size(), false), used(at.size(), false);
    for (const auto& [name, voltage] : voltages_) {
      const auto found = numbers_.find(name);
      if (found == numbers_.end()) return ".ic V(" + printable(name) + "): no card names this node";
      at[found->second] = voltage;
      held[found->second] = true;
    }
    for (CircuitElement& e : circuit_->elements) {
      circuit_->from_conditions = circuit_->from_conditions || e.started;
      if (e.kind != 'c') continue;
      used[e.a] = used[e.b] = true;
      if (e.started || !(held[e.a] || held[e.b])) continue;
      e.start = at[e.a] - at[e.b];
      e.started = true;
    }
    for (std::size_t k = 1; k < held.size(); ++k)
      if (held[k] && !used[k]) return ".ic V(" + circuit_->nodes[k] + "): no capacitor at this node keeps a voltage: leave it out";
    circuit_->from_conditions = circuit_->from_conditions || uic_ || !voltages_.empty();
    return {};
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
    std::string rest;
    for (std::size_t k = 4; k < words.size(); ++k) rest += " " + words[k];
    const std::vector<std::string> condition = assignment(rest);
    if (e->kind == 'r' || condition.empty() || lower(condition[0]) != "ic")
      return "'" + printable(words[4]) + "' after the value is not read: leave it out";
    if (condition.size() != 2) return "write IC=" + std::string(e->kind == 'c' ? "volt" : "ampere") + " behind the value, and nothing else";
    e->started = true;
    const std::string wrong = read_spice_number(condition[1], &e->start);
    return wrong.empty() ? "" : "IC: '" + printable(condition[1]) + "' " + wrong;
  }

  /// Words between blanks and signs of equality.
  static std::vector<std::string> assignment(std::string text) {
    std::replace(text.begin(), text.end(), '=', ' ');
    return words_of(text);
  }

  /// .ic V(a)=1 V(b)=2
  std::string read_node_voltages(const std::string& text) {
    const std::vector<std::string> words = assignment(text);
    const std::string wanted = "'" + printable(text) + "': write .ic V(NODE)=VOLT, with blanks between several";
    if (words.size() < 4 || words.size() % 3 != 1) return wanted;
    for (std::size_t k = 1; k < words.size(); k += 3) {
      double value = 0;
      const std::string refused = read_spice_number(words[k + 2], &value);
      if (lower(words[k]) != "v") return wanted;
      if (!refused.empty()) return ".ic V(" + printable(words[k + 1]) + "): '" + printable(words[k + 2]) + "' " + refused;
      voltages_[lower(words[k + 1])] = value;
    }
    return {};
  }

  std::string pass_over(const std::vector<std::string>& words) {
    std::string instead;
    double step = 0, end = 0;
    tran_ = true;
    uic_ = uic_ || lower(words.back()) == "uic";
    if (words.size() > 2 && read_spice_number(words[1], &step).empty() && read_spice_number(words[2], &end).empty())
      instead = ": write -ts_dt " + short_number(step) + " -ts_max_time " + short_number(end);
    circuit_->remarks.push_back(".tran is passed over" + (instead.empty() ? ": give -ts_dt and -ts_max_time" : instead));
    return {};
  }

  Circuit* circuit_;
  std::map<std::string, std::size_t> numbers_, lines_;
  std::map<std::string, double> voltages_;  ///< of nodes, by .ic
  bool tran_ = false, uic_ = false;
};

/// "the node a floats", "the nodes a, b, ... float" of those that are not joined to ground; empty: there are none.
std::string floating(const Circuit& c, DisjointSets* joined) {
  std::string names;
  std::size_t count = 0;
  for (std::size_t k = 1; k < c.nodes.size(); ++k)
    if (joined->top(static_cast<PetscInt>(k)) != joined->top(0) && ++count <= 5) names += (count > 1 ? ", " : "") + c.nodes[k];
  if (count == 0) return {};
  return std::string(count > 1 ? "the nodes " : "the node ") + names + (count > 5 ? ", ..." : "") + (count > 1 ? " float" : " floats");
}

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
  const std::string names = floating(c, &joined);
  return names.empty() ? "" : names + ": no resistor, capacitor, inductor or voltage source leads to ground (0 or gnd): add one";
}

}  // namespace

StartingCircuit starting_circuit(const Circuit& c) {
  StartingCircuit out;
  DisjointSets held(static_cast<PetscInt>(c.nodes.size())), joined(static_cast<PetscInt>(c.nodes.size()));
  const auto join = [](DisjointSets* sets, const CircuitElement& e) {
    const auto a = static_cast<PetscInt>(e.a), b = static_cast<PetscInt>(e.b);
    const bool apart = sets->top(a) != sets->top(b);
    if (apart) sets->join(a, b);
    return apart;
  };
  for (const CircuitElement& e : c.elements) {
    if (e.kind == 'v') (void)join(&held, e);
    if (e.kind == 'v' || e.kind == 'r' || e.kind == 'c') (void)join(&joined, e);
  }
  for (std::size_t k = 0; k < c.nodes.size(); ++k) out.by_source.push_back(static_cast<std::size_t>(held.top(static_cast<PetscInt>(k))));
  for (const bool started : {true, false})  // those whose voltage is given first
    for (std::size_t k = 0; k < c.elements.size(); ++k)
      if (c.elements[k].kind == 'c' && c.elements[k].started == started) (join(&held, c.elements[k]) ? out.holding : out.last).push_back(k);
  const std::string names = floating(c, &joined);
  if (!names.empty())
    out.fault = names +
                " at the start from IC, where inductors keep their currents: no resistor, capacitor or voltage source leads to ground: add a "
                "resistor, or leave IC, .ic and UIC out";
  return out;
}

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
  error = reader.finish();
  if (!error.empty()) return file + ": " + error;
  if (out->from_conditions && reader.has_tran() && !reader.has_uic())
    out->remarks.push_back(
        file + ": the run starts from IC and .ic, as SPICE does where .tran ends in UIC: add it, or leave them out for the operating point");
  if (out->elements.empty()) return file + ": no cards: after the first line, the title, " + SUPPORTED;
  error = check_topology(*out);
  return error.empty() ? "" : file + ": " + error;
}

}  // namespace bs
