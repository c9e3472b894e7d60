// A function of time and place that the user writes as text.
#pragma once
#include <memory>
#include <string>

namespace bs {

/// u(t, x0, y0, z0) with its first two derivatives by t, exact: GNU libmatheval differentiates the text symbolically. It knows + - * / ^, exp, log,
/// sqrt, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, abs, step, erf, pi and e. Where the program was built without libmatheval, parse() says
/// so.
class Expression {
 public:
  /// False, and one line in `error` without the option's name, for a text that is no such function.
  bool parse(const std::string& text, std::string* error);
  /// out: u, u', u'' at time t of what starts at x0 (three numbers).
  void at(double t, const double* x0, double* out) const;

 private:
  struct Parts;
  std::shared_ptr<Parts> parts_;
};

}  // namespace bs
