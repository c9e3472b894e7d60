#include "physics/whole/drive.hpp"

#include <algorithm>
#include <cmath>

#include "base/rounding.hpp"
#include "physics/vector.hpp"

namespace bs {

/// Displacement, velocity and acceleration of one component into s[3].
void Drive::follow(const Component& one, double t, const double* x0, double* s) const {
  const Side side = sides_.at(t);
  s[0] = s[1] = s[2] = 0;
  if (one.kind == Kind::velocity) {
    s[0] = one.rate * t;
    s[1] = one.rate;
  } else if (one.kind == Kind::sinusoid) {
    const double w = TWO_PI * one.frequency, angle = w * t + one.phase;
    s[0] = one.amplitude * std::sin(angle);
    s[1] = one.amplitude * w * std::cos(angle);
    s[2] = -w * w * s[0];
  } else if (one.kind == Kind::expression) {
    one.expression.at(t, x0, s, side);
  } else if (one.kind == Kind::table) {
    const std::vector<double>&time = one.time, &shift = one.shift;
    auto after = std::upper_bound(time.begin(), time.end(), t) - time.begin();
    if (const auto next = static_cast<std::size_t>(after); next < time.size() && snap(t, time[next]) == time[next]) {
      t = time[next];
      ++after;
    }
    const std::size_t k = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, static_cast<std::ptrdiff_t>(time.size()) - 2));
    const double slope = (shift[k + 1] - shift[k]) / (time[k + 1] - time[k]), slack = 1e-9 * (time.back() - time.front());
    // from the left end only: exact there, so the last row is taken by itself
    s[0] = t >= time.back() ? shift.back() : t <= time.front() ? shift.front() : shift[k] + (t - time[k]) * slope;
    s[1] = t < time.front() - slack || t > time.back() + slack ? 0 : slope;
    if (k == 0 || t != time[k] || side == Side::given || side == Side::right) return;
    const double before = (shift[k] - shift[k - 1]) / (time[k] - time[k - 1]);
    s[1] = side == Side::left ? before : 0.5 * (slope + before);
  }
}

// X = c + (A.r) A + cos (r - (A.r) A) + sin A x r,  r = x0 - c
void Drive::rotate(double t, const double* x0, double* x, double* v, double* a) const {
  double r[3] = {0, 0, 0}, along = 0;
  for (int c = 0; c < dim_; ++c) r[c] = x0[c] - center_[c];
  for (int c = 0; c < 3; ++c) along += axis_[c] * r[c];
  const double cosine = std::cos(omega_ * t), sine = std::sin(omega_ * t);
  for (int c = 0; c < dim_; ++c) {
    const int p = (c + 1) % 3, q = (c + 2) % 3;
    const double turned = axis_[p] * r[q] - axis_[q] * r[p], across = r[c] - along * axis_[c];
    x[c] = center_[c] + along * axis_[c] + cosine * across + sine * turned;
    v[c] = omega_ * (cosine * turned - sine * across);
    a[c] = -omega_ * omega_ * (cosine * across + sine * turned);
  }
}

void Drive::at(double t, const double* x0, double* x, double* v, double* a) const {
  if (rotation_) {
    rotate(t, x0, x, v, a);
    return;
  }
  double start[3] = {0, 0, 0}, s[3];
  std::copy_n(x0, dim_, start);
  for (int c = 0; c < dim_; ++c) {
    if (component_[c].kind == Kind::free) continue;
    follow(component_[c], t, start, s);
    x[c] = start[c] + s[0];
    v[c] = s[1];
    a[c] = s[2];
  }
}

void Drive::displacement(double t, const double* x0, double* u) const {
  double start[3] = {0, 0, 0}, s[3];
  std::copy_n(x0, dim_, start);
  for (int c = 0; c < dim_; ++c) {
    if (component_[c].kind == Kind::free) continue;
    follow(component_[c], t, start, s);
    u[c] = s[0];
  }
}

std::string Drive::misses(double t) const {
  for (const Component& one : component_) {
    if (one.kind != Kind::table) continue;
    const double slack = 1e-9 * (one.time.back() - one.time.front());
    if (t < one.time.front() - slack) return "begins after the end of the run";
    if (t > one.time.back() + slack) return "does not reach the end of the run";
  }
  return {};
}

Knot Drive::next_knot(double from, double to) const {
  Knot next;
  for (const Component& one : component_) {
    if (one.kind == Kind::expression) next.take(one.expression.next_knot(from, to));
    if (one.kind != Kind::table) continue;
    auto row = std::upper_bound(one.time.begin(), one.time.end(), from);
    while (row != one.time.end() && !is_after(from, *row)) ++row;
    if (row != one.time.end()) next.take({*row, false});
  }
  return next;
}

bool Drive::may_jump() const {
  return std::any_of(std::begin(component_), std::end(component_),
                     [](const Component& one) { return one.kind == Kind::expression && one.expression.may_jump(); });
}

bool Drive::jumps_by_place() const {
  return std::any_of(std::begin(component_), std::end(component_), [](const Component& one) {
    return one.kind == Kind::expression && one.expression.may_jump() && one.expression.depends_on_place();
  });
}

/// A time in (a, b] at which u jumps; NaN: none is found.
// Halves the interval, always going on with the half in which the change of u and that by its slopes at both ends,
//   u(b) - u(a) - (b - a) (u'(a) + u'(b))/2
// are further apart: it falls as (b - a)^3, at a bend as b - a, at a jump not at all.
static double find_jump(const Expression& u, double a, double b, const double* x0) {
  constexpr double NOTHING = 1e-9;  // of u, and of what the whole interval misses
  double left[3], right[3], middle[3];
  u.at(a, x0, left);
  u.at(b, x0, right);
  const auto missed = [](double h, const double* from, const double* to) {
    const double gap = std::abs(to[0] - from[0] - h / 2 * (from[1] + to[1]));
    return std::isfinite(gap) ? gap : INFINITY;
  };
  double least = NOTHING * std::max(std::abs(left[0]), std::abs(right[0]));
  if (const double whole = missed(b - a, left, right); std::isfinite(whole)) least = std::max(least, NOTHING * whole);
  while (missed(b - a, left, right) > least) {
    const double m = a + (b - a) / 2;
    if (!(m > a && m < b)) return b;
    u.at(m, x0, middle);
    const bool first = missed(m - a, left, middle) >= missed(b - m, middle, right);
    std::copy_n(middle, 3, first ? right : left);
    (first ? b : a) = m;
  }
  return NAN;
}

double Drive::jump(double from, double to, const double* x0) const {
  double start[3] = {0, 0, 0};
  std::copy_n(x0, dim_, start);
  for (const Component& one : component_) {
    if (one.kind != Kind::expression || !one.expression.may_jump()) continue;
    const double at = find_jump(one.expression, from, to, start);
    if (!std::isnan(at)) return at;
  }
  return NAN;
}

}  // namespace bs
