// A function of time and place that the user writes as text.
#pragma once
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>
#include "base/knots.hpp"

namespace bs {

/// u(t, x0, y0, z0) with its first two derivatives by t, exact: every operation carries the three of them along, so that their cost grows with the
/// length of the text alone. Numbers, + - * / ^, brackets, exp, log, sqrt, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, abs, step (0 below
/// 0, else 1), erf, pi and e. As in GNU libmatheval, ^ binds more than the sign before it and is evaluated from the left: -2^2 = -4, 2^3^2 = 64.
class Expression {
 public:
  static constexpr std::size_t MOST_CHARACTERS = 10000;
  static constexpr int MOST_NESTED = 200;

  /// False, and one line in `error` without the option's name, for a text that is no such function. `placed`: it may depend on x0, y0 and z0.
  bool parse(const std::string& text, bool placed, std::string* error);
  /// out: u, u', u'' at time t of what starts at x0 (three numbers). A bend has the derivatives to its right, a jump none. `side` of step and abs
  /// where their argument is 0 at t; left and right: 0 but for the rounding of t.
  void at(double t, const double* x0, double* out, Side side = Side::given) const;
  /// The first time in (from, to] at which the argument of a step or an abs changes its sign, as seen from 17 times; none where u depends on the
  /// place.
  Knot next_knot(double from, double to) const;
  bool depends_on_place() const { return by_place_; }
  /// Whether something in it can jump or grow beyond all bounds at some time.
  bool may_jump() const { return may_jump_; }

 private:
  struct Reader;
  /// One operation on the top of a stack of numbers.
  struct Operation {
    std::uint8_t code;
    double value;  ///< of a number
  };
  void run(double t, const double* x0, Side side, double* out, std::vector<double>* signs = nullptr) const;

  std::vector<Operation> operations_;
  bool by_place_ = false, may_jump_ = false, has_knots_ = false;
  mutable double asked_ = NAN, time_ = NAN;  ///< the last time, and the decimal that it is
  mutable Side side_ = Side::given;          ///< with which it was asked
  mutable double value_[3] = {0, 0, 0};      ///< the result then, where the place does not matter
  mutable std::vector<double> stack_;        ///< three numbers each: u, u', u''
};

/// A text of any length for a line of an error: its beginning.
std::string shown_text(const std::string& text);

}  // namespace bs
