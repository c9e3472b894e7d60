#include "systems/linear/waveform.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include "base/rounding.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

constexpr double TWO_PI = 6.283185307179586476925286766559;

/// Rise from 0 to 1 in `rise` from t = 0, flat for `width`, down in `fall`; t is already snapped to the knots.
double trapezium(double t, double rise, double width, double fall) {
  if (t < 0) return 0;
  if (t < rise) return t / rise;
  if (t < rise + width) return 1;
  if (t < rise + width + fall) return 1 - (t - rise - width) / fall;
  return 0;
}

/// Since the beginning of the pulse that t lies in, snapped to its knots.
double since_beginning(double t, const std::vector<double>& p) {
  const double t0 = p[1], rise = p[2], width = p[3], fall = p[4], period = p[6];
  double start = t0;
  if (std::isfinite(period) && t > t0) {
    start = t0 + std::floor((t - t0) / period) * period;
    if (snap(t, start + period) == start + period) start += period;
  }
  const double knots[] = {start, start + rise, start + (rise + width), start + (rise + width + fall)};
  const double lengths[] = {0, rise, rise + width, rise + width + fall};
  double local = t - start;
  for (int k = 0; k < 4; ++k)
    if (snap(t, knots[k]) == knots[k]) local = lengths[k];
  return local;
}

double piecewise(double t, const std::vector<double>& p) {
  const std::size_t n = p.size() / 2;
  if (t <= p[0]) return p[1];
  for (std::size_t k = 1; k < n; ++k) {
    const double a = p[2 * k - 2], b = p[2 * k], at = snap(t, b);
    if (at == b) return p[2 * k + 1];
    if (at < b) return p[2 * k - 1] + (p[2 * k + 1] - p[2 * k - 1]) * ((at - a) / (b - a));
  }
  return p[2 * n - 1];
}

}  // namespace

double Waveform::at(double t) const {
  switch (kind_) {
    case Kind::constant: return p_[0];
    case Kind::step: return p_[2] + (snap(t, p_[1]) >= p_[1] ? p_[0] : 0.0);
    case Kind::pulse: return p_[5] + p_[0] * trapezium(since_beginning(t, p_), p_[2], p_[3], p_[4]);
    case Kind::sine: {
      const double since = std::max(0.0, t - p_[4]);
      return p_[3] + p_[0] * std::exp(-p_[5] * since) * std::sin(TWO_PI * p_[1] * since + p_[2]);
    }
    case Kind::exponential: {
      // v1, from t1 on towards v2, from t2 on back towards v1
      double value = p_[0];
      if (t > p_[2]) value += (p_[1] - p_[0]) * -std::expm1(-(t - p_[2]) / p_[3]);
      if (t > p_[4]) value += (p_[0] - p_[1]) * -std::expm1(-(t - p_[4]) / p_[5]);
      return value;
    }
    case Kind::piecewise: return piecewise(t, p_);
  }
  return 0;
}

double Waveform::before(double t) const {
  bool jumps = kind_ == Kind::step && snap(t, p_[1]) == p_[1];
  if (kind_ == Kind::pulse) {
    const double since = since_beginning(t, p_);
    jumps = (since == 0 && p_[2] == 0) || (since == p_[2] + p_[3] && p_[4] == 0);
  }
  return at(jumps ? t - std::max(4e-10 * std::abs(t), std::numeric_limits<double>::min()) : t);  // beyond what snap() takes for t
}

Knot Waveform::next_knot(double t) const {
  Knot next;
  const auto consider = [&](double time) {
    if (is_after(t, time)) next.take({time, before(time) != at(time)});
  };
  if (kind_ == Kind::step) consider(p_[1]);
  else if (kind_ == Kind::sine) consider(p_[4]);
  else if (kind_ == Kind::exponential) consider(p_[2]), consider(p_[4]);
  else if (kind_ == Kind::pulse) {
    const double period = p_[6], whole = std::isfinite(period) && t > p_[1] ? std::floor((t - p_[1]) / period) : 0;
    for (int k = 0; k < 2; ++k) {
      const double start = p_[1] + (k + whole > 0 ? (k + whole) * period : 0);
      for (const double since : {0.0, p_[2], p_[2] + p_[3], p_[2] + p_[3] + p_[4]}) consider(start + since);
    }
  } else if (kind_ == Kind::piecewise) {
    for (std::size_t k = 0; k < p_.size() && !std::isfinite(next.time); k += 2) consider(p_[k]);
  }
  return next;
}

bool Waveform::constant() const { return kind_ == Kind::constant || (kind_ == Kind::step && (p_[1] <= 0 || p_[0] == 0)); }

std::string Waveform::remark() const {
  const bool exponential = kind_ == Kind::exponential, sine = kind_ == Kind::sine;
  const char* what = "";
  if (kind_ == Kind::constant || kind_ == Kind::piecewise) return {};
  if (exponential ? p_[0] == p_[1] : p_[0] == 0) what = "amplitude";
  else if (sine && p_[1] == 0) what = "frequency";
  else return {};
  std::string text = "source '" + printable(text_) + "': its " + what + " is 0, so that it is " + short_number(at(0)) + " at all times: write " +
                     short_number(at(0)) + " if that is meant";
  if (text_.find(',') != std::string::npos && (sine || kind_ == Kind::pulse))
    text += sine ? "; with commas the amplitude comes first; SPICE's order SIN(VO VA FREQ) is written with blanks"
                 : "; with commas the amplitude comes first; SPICE's order PULSE(V1 V2 TD TR TF PW PER) is written with blanks";
  return text;
}

namespace {

constexpr double NONE = std::numeric_limits<double>::quiet_NaN();  // a parameter that must be given
constexpr double NEVER = std::numeric_limits<double>::infinity();

struct Parameter {
  const char* name;
  double value;  ///< where it is left out
  bool nonnegative;
};

struct Shape {
  const char* name;
  std::vector<Parameter> parameters;
};

/// In the order of Waveform::Kind.
const std::vector<Shape>& shapes() {
  static const std::vector<Shape> list = {
      {"constant", {{"value", NONE, false}}},
      {"step", {{"amp", NONE, false}, {"t0", 0, false}, {"offset", 0, false}}},
      {"pulse",
       {{"amp", NONE, false},
        {"t0", 0, false},
        {"rise", 0, true},
        {"width", NONE, true},
        {"fall", 0, true},
        {"offset", 0, false},
        {"period", NEVER, true}}},
      {"sine", {{"amp", NONE, false}, {"freq", NONE, true}, {"phase", 0, false}, {"offset", 0, false}, {"delay", 0, false}, {"damping", 0, true}}},
      {"exp", {{"v1", NONE, false}, {"v2", NONE, false}, {"t1", 0, false}, {"tau1", NONE, true}, {"t2", NEVER, false}, {"tau2", NONE, true}}},
      {"pwl", {}}};
  return list;
}

constexpr double SMALLEST = 1e-100, LARGEST = 1e100;  // beyond, products of parameters and times leave the doubles

/// Why `word` is no number a source may have; empty if it is one.
std::string read_parameter(const std::string& word, double* value) {
  const char *from = word.data(), *end = from + word.size();
  if (word.size() > 1 && *from == '+' && from[1] != '-') ++from;
  const auto [rest, code] = std::from_chars(from, end, *value);
  const bool size = *value == 0 || (std::abs(*value) >= SMALLEST && std::abs(*value) <= LARGEST);
  if (rest == end && (code == std::errc::result_out_of_range || (code == std::errc() && std::isfinite(*value) && !size)))
    return "is out of range: write 0, or a number of 1e-100 to 1e100 in size";
  return code == std::errc() && rest == end && std::isfinite(*value) ? "" : "is not a number";
}

std::string usage(const Shape& shape) {
  if (shape.parameters.empty()) return "pwl(t1,v1,t2,v2,...)";
  std::string text = std::string(shape.name) + "(";
  for (const Parameter& p : shape.parameters) text += (text.back() == '(' ? "" : ",") + std::string(p.name) + "=..";
  return text + ")";
}

std::string read_pwl(const std::vector<std::string>& words, std::vector<double>* p) {
  const std::string wanted = "write pwl(t1,v1,t2,v2,...) with increasing times";
  if (words.size() < 2 || words.size() % 2)
    return how_many(static_cast<std::int64_t>(words.size()), "{number does|numbers do} not form pairs of time and value: ") + wanted;
  for (std::size_t k = 0; k < words.size(); ++k) {
    double value = 0;
    const std::string refused = read_parameter(words[k], &value);
    if (!refused.empty()) return "'" + printable(words[k]) + "' " + refused + ": " + wanted;
    if (k % 2 == 0 && k >= 2 && !(value > (*p)[k - 2])) return "time " + short_number(value) + " is not after the one before: " + wanted;
    p->push_back(value);
  }
  return {};
}

std::string read_parameters(const Shape& shape, const std::vector<std::string>& words, std::vector<double>* p) {
  std::vector<bool> given(shape.parameters.size(), false);
  for (const Parameter& parameter : shape.parameters) p->push_back(parameter.value);
  bool named = false;
  for (std::size_t k = 0; k < words.size(); ++k) {
    std::string word = words[k];
    std::size_t at = k;
    const std::size_t equals = word.find('=');
    if (equals != std::string::npos) {
      named = true;
      const std::string key = trim(word.substr(0, equals));
      word = trim(word.substr(equals + 1));
      for (at = 0; at < shape.parameters.size() && key != shape.parameters[at].name;) ++at;
      if (at == shape.parameters.size()) return "no parameter '" + printable(key) + "': write " + usage(shape);
    } else if (named) {
      return "'" + printable(word) + "' without a name after a named one: write " + usage(shape);
    }
    if (at >= shape.parameters.size()) return "too many parameters: write " + usage(shape);
    const Parameter& parameter = shape.parameters[at];
    if (given[at]) return std::string(parameter.name) + " is given twice";
    given[at] = true;
    const std::string refused = read_parameter(word, &(*p)[at]);
    if (!refused.empty()) return std::string(parameter.name) + " = '" + printable(word) + "' " + refused + ": write " + usage(shape);
    if (parameter.nonnegative && (*p)[at] < 0) return std::string(parameter.name) + " = " + word + ": give a number >= 0";
  }
  return {};
}

/// What single parameters cannot know.
std::string check_together(Waveform::Kind kind, const std::vector<double>& p) {
  if (kind == Waveform::Kind::pulse && !(snap(p[2] + p[3] + p[4], p[6]) <= p[6] && p[6] > 0))
    return std::isfinite(p[3]) ? "period is shorter than rise + width + fall: give a longer one" : "a period needs a width: give PW before PER";
  if (kind == Waveform::Kind::exponential && !(p[3] > 0 && p[5] > 0)) return "tau1 and tau2 must be positive";
  if (kind == Waveform::Kind::exponential && p[4] < p[2]) return "t2 lies before t1: give t2 >= t1";
  return {};
}

/// The place of `name` in shapes(), or a line of error.
std::string kind_of(const std::string& name, std::size_t* kind) {
  std::set<std::string> names;
  for (*kind = 0; *kind < shapes().size() && name != shapes()[*kind].name; ++*kind) names.insert(shapes()[*kind].name);
  if (*kind < shapes().size()) return {};
  const std::string small = lower(name), near = small == "sin" ? "sine" : nearest(name, names, 1);
  if (small == "sin" || small == near)
    return "SPICE's order of parameters is written with blanks, as in SIN(VO VA FREQ); with commas write " + near + "(...) in small letters";
  return "no waveform '" + printable(name) + "'" + (near.empty() ? "" : ", did you mean " + near + "?") +
         ": write constant, step, pulse, sine, exp or pwl";
}

}  // namespace

std::string read_waveform(const std::string& given, Waveform* out) {
  const std::string text = trim(given), shown = "source '" + printable(text) + "': ";
  Waveform w;
  w.text_ = text;
  double value = 0;
  const std::string refused = read_parameter(text, &value);
  if (refused.empty()) {
    w.p_ = {value};
    *out = w;
    return {};
  }
  const std::size_t open = text.find('(');
  if (open == std::string::npos && refused != "is not a number") return shown + refused;
  if (open == std::string::npos || text.back() != ')')
    return shown + "write a number, or one of constant step pulse sine exp pwl with parameters in brackets, like pulse(amp=5,t0=1e-3,width=2e-3)";
  std::string name = trim(text.substr(0, open));
  const std::string inside = trim(text.substr(open + 1, text.size() - open - 2));
  std::size_t kind = 0;
  std::string error;
  const bool spice = w.spice_ = is_spice_form(inside);
  if (spice) error = read_spice(lower(name), inside, &name, &w.p_);
  if (error.empty()) error = kind_of(name, &kind);
  if (!error.empty()) return shown + error;
  const Shape& shape = shapes()[kind];
  w.kind_ = static_cast<Waveform::Kind>(kind);
  const std::vector<std::string> words = inside.empty() ? std::vector<std::string>() : split(inside, ',');
  if (!spice) error = shape.parameters.empty() ? read_pwl(words, &w.p_) : read_parameters(shape, words, &w.p_);
  if (!error.empty()) return shown + error;
  if (w.kind_ == Waveform::Kind::exponential && !std::isfinite(w.p_[4]) && std::isnan(w.p_[5])) w.p_[5] = 1;
  for (std::size_t k = 0; k < shape.parameters.size(); ++k)
    if (std::isnan(w.p_[k])) return shown + shape.parameters[k].name + " is missing: write " + usage(shape);
  error = check_together(w.kind_, w.p_);
  if (!error.empty()) return shown + error;
  *out = w;
  return {};
}

std::string read_waveforms(const std::string& text, std::vector<Waveform>* out) {
  for (const std::string& part : split(text, ';')) {
    Waveform w;
    const std::string error = read_waveform(part, &w);
    if (!error.empty()) return error;
    out->push_back(w);
  }
  return {};
}

const char* waveform_help() {
  return "u(t): one waveform for every column of B, separated by ';': constant(value), step(amp,t0,offset), "
         "pulse(amp,t0,rise,width,fall,offset,period) where width is that of the flat top, sine(amp,freq,phase,offset,delay,damping) with phase "
         "in rad and damping in 1/s, exp(v1,v2,t1,tau1,t2,tau2), pwl(t1,v1,t2,v2,...); parameters in this order or by name: "
         "pulse(amp=5,t0=1e-3,width=2e-3). A step has its new value at t0 itself; where a constant step ends there, cn, theta at 0.5 and bdf compute "
         "with the mean of both sides. With blanks instead of commas, arguments follow SPICE's order and "
         "may have its suffixes (k, m, MEG, 5mV): SIN(VO VA FREQ TD THETA PHASE) with the phase in degrees, PULSE(V1 V2 TD TR TF PW PER), "
         "EXP(V1 V2 TD1 TAU1 TD2 TAU2), PWL(T1 V1 T2 V2 ...), in upper or lower case";
}

}  // namespace bs
