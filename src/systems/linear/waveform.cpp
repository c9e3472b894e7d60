#include "systems/linear/waveform.hpp"
#include <algorithm>
#include <cmath>
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

double pulse(double t, const std::vector<double>& p) {
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
  return p[5] + p[0] * trapezium(local, rise, width, fall);
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

double snap(double t, double knot) { return std::isfinite(knot) && std::abs(t - knot) <= 1e-10 * std::abs(knot) ? knot : t; }

double Waveform::at(double t) const {
  switch (kind_) {
    case Kind::constant: return p_[0];
    case Kind::step: return p_[2] + (snap(t, p_[1]) >= p_[1] ? p_[0] : 0.0);
    case Kind::pulse: return pulse(t, p_);
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

}  // namespace bs
