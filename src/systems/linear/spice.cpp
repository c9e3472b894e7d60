#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include "base/text.hpp"
#include "systems/linear/waveform.hpp"

namespace bs {
namespace {

constexpr double NEVER = std::numeric_limits<double>::infinity();
constexpr double DEGREE = 3.14159265358979323846 / 180;
constexpr double SMALLEST = 1e-100, LARGEST = 1e100;

struct Factor {
  const char* name;
  double multiply, divide;  ///< two, so that 2m is 2/1000, correctly rounded
};

// the longer names first
constexpr Factor FACTORS[] = {{"meg", 1e6, 1}, {"mil", 25.4, 1e6}, {"t", 1e12, 1}, {"g", 1e9, 1},  {"k", 1e3, 1},
                              {"m", 1, 1e3},   {"u", 1, 1e6},      {"n", 1, 1e9},  {"p", 1, 1e12}, {"f", 1, 1e15}};

struct Argument {
  const char* name;
  bool optional, nonnegative;
};

struct Form {
  const char* kind;
  std::vector<Argument> arguments;
};

const Form* form_of(const std::string& name) {
  static const Form sine = {
      "sine",
      {{"VO", false, false}, {"VA", false, false}, {"FREQ", false, true}, {"TD", true, false}, {"THETA", true, true}, {"PHASE", true, false}}};
  static const Form pulse = {"pulse",
                             {{"V1", false, false},
                              {"V2", false, false},
                              {"TD", true, false},
                              {"TR", true, true},
                              {"TF", true, true},
                              {"PW", true, true},
                              {"PER", true, true}}};
  static const Form exponential = {
      "exp",
      {{"V1", false, false}, {"V2", false, false}, {"TD1", false, false}, {"TAU1", false, true}, {"TD2", false, false}, {"TAU2", false, true}}};
  static const Form piecewise = {"pwl", {}};
  if (name == "sin" || name == "sine") return &sine;
  if (name == "pulse") return &pulse;
  if (name == "exp") return &exponential;
  return name == "pwl" ? &piecewise : nullptr;
}

std::string usage(const std::string& name, const Form& form) {
  std::string text, upper = name;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  for (const Argument& a : form.arguments) text += (text.empty() ? "" : " ") + std::string(a.name);
  return upper + "(" + (text.empty() ? "T1 V1 T2 V2 ..." : text) + ")";
}

std::string read_arguments(const Form& form, const std::string& wanted, const std::vector<std::string>& words, std::vector<double>* a) {
  if (words.size() > form.arguments.size()) return "too many parameters: write " + wanted + ", separated by blanks";
  for (std::size_t k = 0; k < words.size(); ++k) {
    const Argument& argument = form.arguments[k];
    double value = 0;
    const std::string refused = read_spice_number(words[k], &value);
    if (!refused.empty()) return std::string(argument.name) + " = '" + printable(words[k]) + "' " + refused + ": write " + wanted;
    if (argument.nonnegative && value < 0) return std::string(argument.name) + " = " + printable(words[k]) + ": give a number >= 0";
    a->push_back(value);
  }
  if (words.size() < form.arguments.size() && !form.arguments[words.size()].optional)
    return std::string(form.arguments[words.size()].name) +
           " is missing (SPICE's defaults from the time step or the end of its run are not "
           "taken): write " +
           wanted;
  return {};
}

std::string read_pairs(const std::vector<std::string>& words, std::vector<double>* p) {
  const std::string wanted = "write PWL(T1 V1 T2 V2 ...) with increasing times";
  for (const std::string& word : words) {
    double value = 0;
    const std::string refused = read_spice_number(word, &value);
    if (!refused.empty()) return "'" + printable(word) + "' " + refused + ": " + wanted;
    if (p->size() % 2 == 0 && p->size() >= 2 && !(value > (*p)[p->size() - 2]))
      return "time " + printable(word) + " is not after the one before: " + wanted;
    p->push_back(value);
  }
  return words.size() < 2 || words.size() % 2
             ? how_many(static_cast<std::int64_t>(words.size()), "{number does|numbers do} not form pairs of time and value: ") + wanted
             : "";
}

}  // namespace

std::string read_spice_number(const std::string& word, double* value) {
  const char *from = word.data(), *end = from + word.size();
  if (word.size() > 1 && *from == '+' && from[1] != '-') ++from;
  const char* digits = from < end && *from == '-' ? from + 1 : from;
  if (digits < end && *digits == '.') ++digits;
  if (digits == end || !std::isdigit(static_cast<unsigned char>(*digits))) return "is not a number";  // inf and nan, too
  const auto [rest, code] = std::from_chars(from, end, *value);
  std::string letters(rest, end);
  for (char& c : letters) {
    if (!std::isalpha(static_cast<unsigned char>(c))) return "is not a number with a suffix of letters, such as 2.5m or 3MEG";
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  for (const Factor& factor : FACTORS)
    if (letters.rfind(factor.name, 0) == 0) {
      *value = *value * factor.multiply / factor.divide;
      break;
    }
  const bool size = *value == 0 || (std::abs(*value) >= SMALLEST && std::abs(*value) <= LARGEST);
  return code == std::errc() && size ? "" : "is out of range: write 0, or a number of 1e-100 to 1e100 in size";
}

bool is_spice_form(const std::string& inside) {
  const std::vector<std::string> parts = split(inside, ',');
  return inside.find('=') == std::string::npos &&
         std::any_of(parts.begin(), parts.end(), [](const std::string& part) { return part.find_first_of(" \t\r\n") != std::string::npos; });
}

std::string read_spice(const std::string& name, const std::string& inside, std::string* kind, std::vector<double>* p) {
  const Form* form = form_of(name);
  if (!form) return "blanks between parameters belong to SPICE's SIN, PULSE, EXP and PWL: write " + printable(name) + "(...) with commas";
  *kind = form->kind;
  const bool pairs = form->arguments.empty();
  const std::string wanted = usage(name, *form);
  std::string text = inside;
  if (text.find(',') != std::string::npos && !pairs)
    return "commas and blanks are mixed: write SPICE's order with blanks alone, " + wanted + ", or the program's with commas alone";
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (pairs) return read_pairs(words, p);
  std::vector<double> a;
  const std::string error = read_arguments(*form, wanted, words, &a);
  if (!error.empty()) return error;
  const auto or_else = [&](std::size_t k, double value) { return k < a.size() ? a[k] : value; };
  if (*kind == "sine") {
    if (a[2] == 0) return "FREQ is 0, for which SPICE takes the reciprocal of its run's length: give the frequency [Hz]";
    *p = {a[1], a[2], or_else(5, 0) * DEGREE, a[0], or_else(3, 0), or_else(4, 0)};
  } else if (*kind == "pulse") {
    if (a.size() > 6 && a[6] == 0) return "PER is 0: give a longer period, or leave it out";
    if (a.size() > 5 && a[5] == 0) return "PW is 0, for which SPICE takes the length of its run: give the width [s]";
    *p = {a[1] - a[0], or_else(2, 0), or_else(3, 0), or_else(5, NEVER), or_else(4, 0), a[0], or_else(6, NEVER)};
  } else {
    *p = {a[0], a[1], a[2], a[3], a[4], a[5]};
  }
  return {};
}

}  // namespace bs
