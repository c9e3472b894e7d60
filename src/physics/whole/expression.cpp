#include "physics/whole/expression.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "base/rounding.hpp"
#include "physics/whole/jet.hpp"

namespace bs {

namespace {

using namespace jet;

enum Code : std::uint8_t { NUMBER, TIME, X0, Y0, Z0, NEGATE, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, FIRST_FUNCTION };

}  // namespace

std::string shown_text(const std::string& text) {
  constexpr std::size_t MOST = 60;
  return text.size() <= MOST ? text : text.substr(0, MOST) + "...";
}

/// Recursive descent: sum of products of powers, written behind one another as operations on a stack.
struct Expression::Reader {
  const std::string& text;
  bool placed;
  Expression* out;
  std::size_t at = 0;
  int nested = 0, depth = 0;
  std::string error = {};

  char next() {
    while (at < text.size() && (text[at] == ' ' || text[at] == '\t')) ++at;
    return at < text.size() ? text[at] : '\0';
  }
  bool fail(std::size_t where, const std::string& what) {
    if (!error.empty()) return false;
    error = "'" + shown_text(text) + "': " + (where < text.size() ? "character " + std::to_string(where + 1) : "at its end") + ": " + what;
    return false;
  }
  bool unexpected(const std::string& wanted) {
    const char c = next();
    if (c == 0 && at >= text.size()) return fail(at, wanted + " is missing");
    const bool printable = c > ' ' && c < 127;
    const bool known = printable && (std::isalnum(static_cast<unsigned char>(c)) || std::string("_.+-*/^()").find(c) != std::string::npos);
    const std::string shown = printable                             ? "'" + std::string(1, c) + "'"
                              : static_cast<unsigned char>(c) > 127 ? "a letter that is not ASCII"
                                                                    : "a line break or another control character";
    return fail(at, known ? wanted + " is missing before " + shown : shown + " has no meaning in an expression: take it out");
  }
  /// `grows`: by how many numbers the stack does.
  void put(std::uint8_t code, int grows, double value = 0) {
    out->operations_.push_back({code, value});
    depth += grows;
    if (3 * static_cast<std::size_t>(depth) > out->stack_.size()) out->stack_.resize(3 * static_cast<std::size_t>(depth));
  }
  /// Whether operations from the `first` on change in time; and whether they are one number, which has no sign.
  bool changes(std::size_t first) const {
    return std::any_of(out->operations_.begin() + static_cast<std::ptrdiff_t>(first), out->operations_.end(),
                       [](const Operation& one) { return one.code == TIME; });
  }
  bool is_number(std::size_t first) const { return out->operations_.size() == first + 1 && out->operations_[first].code == NUMBER; }

  bool sum() {
    if (!product()) return false;
    for (char c = next(); c == '+' || c == '-'; c = next()) {
      ++at;
      if (!product()) return false;
      put(c == '+' ? ADD : SUBTRACT, -1);
    }
    return true;
  }
  bool product() {
    if (!sign()) return false;
    for (char c = next(); c == '*' || c == '/'; c = next()) {
      ++at;
      const std::size_t first = out->operations_.size();
      if (!sign()) return false;
      out->may_jump_ = out->may_jump_ || (c == '/' && changes(first));
      put(c == '*' ? MULTIPLY : DIVIDE, -1);
    }
    return true;
  }
  bool sign() {
    if (next() != '-') return powers();
    if (!enter()) return false;
    ++at;
    if (!sign()) return false;
    put(NEGATE, 0);
    --nested;
    return true;
  }
  bool powers() {
    const std::size_t base = out->operations_.size();
    if (!operand()) return false;
    while (next() == '^') {
      ++at;
      const std::size_t first = out->operations_.size();
      if (next() == '-' ? !sign() : !operand()) return false;
      out->may_jump_ = out->may_jump_ || (changes(base) && !is_number(first));
      put(POWER, -1);
    }
    return true;
  }
  bool operand() {
    const char c = next();
    if (c == '(') return bracket();
    if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') return number();
    if (std::isalpha(static_cast<unsigned char>(c)) || c == '_') return name();
    return unexpected("a number, a name or '('");
  }
  bool bracket() {
    if (!enter()) return false;
    ++at;
    if (!sum()) return false;
    if (next() != ')') return unexpected("an operator or ')'");
    ++at;
    --nested;
    return true;
  }
  bool enter() {
    if (++nested <= MOST_NESTED) return true;
    return fail(at, "more than " + std::to_string(MOST_NESTED) + " brackets or signs within one another: write it with fewer");
  }
  bool number() {
    const std::size_t start = at;
    const auto digits = [&] {
      const std::size_t from = at;
      while (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at]))) ++at;
      return at - from;
    };
    std::size_t count = digits();
    if (at < text.size() && text[at] == '.') {
      ++at;
      count += digits();
    }
    if (count == 0) return fail(start, "'.' is no number");
    if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {
      const std::size_t mark = at++;
      if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
      if (digits() == 0) at = mark;  // the number e, before which an operator is missing
    }
    const double value = std::strtod(text.substr(start, at - start).c_str(), nullptr);
    if (!std::isfinite(value)) return fail(start, "the number is beyond 1.8e308");
    put(NUMBER, 1, value);
    return true;
  }
  bool name() {
    const std::size_t start = at;
    while (at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) || text[at] == '_')) ++at;
    const std::string word = text.substr(start, at - start);
    if (word == "pi" || word == "e") {
      put(NUMBER, 1, word == "e" ? E : PI);
      return true;
    }
    const auto* function = std::find(std::begin(FUNCTIONS), std::end(FUNCTIONS), word);
    if (function != std::end(FUNCTIONS)) return call(static_cast<int>(function - std::begin(FUNCTIONS)));
    const std::string variables[] = {"t", "x0", "y0", "z0"};
    const auto* variable = std::find(std::begin(variables), std::end(variables), word);
    if (variable == std::end(variables) || (!placed && word != "t"))
      return fail(start, shown_text(word) +
                             (placed ? " is unknown: write an expression in t [s] and the initial position x0, y0, z0 [m], such as 0.1*sin(2*pi*t)"
                                     : " is unknown: write an expression in t alone, such as 0.1*sin(2*pi*t)"));
    out->by_place_ = out->by_place_ || word != "t";
    put(static_cast<std::uint8_t>(TIME + (variable - std::begin(variables))), 1);
    return true;
  }
  bool call(int function) {
    if (next() != '(') return unexpected(std::string("'(' of ") + FUNCTIONS[function]);
    const std::size_t first = out->operations_.size();
    if (!bracket()) return false;
    out->may_jump_ = out->may_jump_ || ((function == STEP || function == TAN || function == LOG) && changes(first));
    out->has_knots_ = out->has_knots_ || ((function == STEP || function == ABS) && changes(first));
    put(static_cast<std::uint8_t>(FIRST_FUNCTION + function), 0);
    return true;
  }
};

bool Expression::parse(const std::string& text, bool placed, std::string* error) {
  *this = {};
  Reader reader{text, placed, this};
  if (text.size() > MOST_CHARACTERS) {
    *error = "'" + shown_text(text) + "' has " + std::to_string(text.size()) + " characters: write " + std::to_string(MOST_CHARACTERS) +
             " at most, or a table";
    return false;
  }
  if (!reader.sum() || (reader.next(), reader.at < text.size() && !reader.unexpected("an operator"))) {
    *error = reader.error;
    return false;
  }
  return true;
}

/// step or abs of u = 0, up to rounding, from one side; false: not there.
static bool apply_at_zero(int function, double t, Side side, double* u) {
  const bool exact = side == Side::given || side == Side::mean;
  if ((function != STEP && function != ABS) || std::abs(u[0]) > (exact ? 0 : 1e-10 * std::abs(t * u[1]))) return false;
  if (side == Side::given ? function == ABS : !exact && u[1] == 0) return false;
  // what the values above 0 count
  const double over = side == Side::given ? 1 : side == Side::mean ? 0.5 : (u[1] > 0) == (side == Side::right) ? 1 : 0;
  if (function == STEP) {
    u[0] = over;
    u[1] = u[2] = 0;
  } else {
    u[0] = std::abs(u[0]);
    for (int k = 1; k < 3; ++k) u[k] *= 2 * over - 1;
  }
  return true;
}

/// `signs` receives those of the arguments of step and abs just after t.
void Expression::run(double t, const double* x0, Side side, double* out, std::vector<double>* signs) const {
  double* top = stack_.data() - 3;
  for (const Operation& one : operations_) {
    if (one.code <= Z0) {
      top += 3;
      top[0] = one.code == NUMBER ? one.value : one.code == TIME ? t : x0[one.code - X0];
      top[1] = one.code == TIME ? 1 : 0;
      top[2] = 0;
      continue;
    }
    if (one.code == NEGATE) {
      for (int k = 0; k < 3; ++k) top[k] = -top[k];
      continue;
    }
    if (one.code >= FIRST_FUNCTION) {
      const int function = one.code - FIRST_FUNCTION;
      if (signs && (function == STEP || function == ABS)) signs->push_back(top[0] != 0 ? top[0] : top[1]);
      if (!apply_at_zero(function, t, side, top)) apply(function, top);
      continue;
    }
    double *u = top - 3, *v = top;
    top = u;
    if (one.code == ADD)
      for (int k = 0; k < 3; ++k) u[k] += v[k];
    else if (one.code == SUBTRACT)
      for (int k = 0; k < 3; ++k) u[k] -= v[k];
    else if (one.code == MULTIPLY) multiply(u, v);
    else if (one.code == DIVIDE) divide(u, v);
    else power(u, v);
  }
  std::copy_n(top, 3, out);
}

Knot Expression::next_knot(double from, double to) const {
  constexpr int PARTS = 16;
  constexpr double SAME = 1e-9;
  const double x0[3] = {0, 0, 0}, start = from + 4e-10 * std::abs(from), length = (to - start) / PARTS;
  double u[3], other[3];
  std::vector<double> before, after;
  if (by_place_ || !has_knots_ || !(length > 0)) return {};
  const auto differ = [&](double t) {
    after.clear();
    run(t, x0, Side::given, u, &after);
    return !std::equal(before.begin(), before.end(), after.begin(), [](double a, double b) { return (a < 0) == (b < 0); });
  };
  (void)differ(start);
  before = after;
  int part = 1;
  while (part <= PARTS && !differ(start + part * length)) ++part;
  if (part > PARTS) return {};
  double a = start + (part - 1) * length, b = start + part * length;
  for (double m = a + 0.5 * (b - a); m > a && m < b; m = a + 0.5 * (b - a)) (differ(m) ? b : a) = m;
  const double time = decimal_time(b);
  run(time, x0, Side::left, u);
  run(time, x0, Side::right, other);
  return {time, std::abs(other[0] - u[0]) > SAME * std::max(std::abs(other[0]), std::abs(u[0]))};
}

void Expression::at(double t, const double* x0, double* out, Side side) const {
  const bool fresh = t != asked_ || side != side_;
  if (fresh) time_ = decimal_time(t);  // once for all places
  asked_ = t;
  side_ = side;
  if (by_place_) {
    run(time_, x0, side, out);
    return;
  }
  if (fresh) run(time_, x0, side, value_);
  std::copy_n(value_, 3, out);
}

}  // namespace bs
