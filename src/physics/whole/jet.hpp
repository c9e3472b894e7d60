// Functions of numbers that carry their first two derivatives by one variable: u[3] = (u, u', u'').
#pragma once
#include <algorithm>
#include <cmath>

namespace bs::jet {

inline constexpr const char* FUNCTIONS[] = {"exp",  "log",  "sqrt", "sin",  "cos", "tan",  "asin", "acos",
                                            "atan", "sinh", "cosh", "tanh", "abs", "step", "erf"};
enum Function { EXP, LOG, SQRT, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ABS, STEP, ERF };
inline constexpr double PI = 3.14159265358979323846, E = 2.71828182845904523536;

/// f, f' and f'' of one function at u.
inline void derivatives(int function, double u, double* f) {
  const double s = 1 - u * u;
  switch (function) {
    case EXP: f[0] = f[1] = f[2] = std::exp(u); break;
    case LOG: f[0] = std::log(u), f[1] = 1 / u, f[2] = -1 / (u * u); break;
    case SQRT: f[0] = std::sqrt(u), f[1] = 0.5 / f[0], f[2] = -0.25 / (u * f[0]); break;
    case SIN: f[0] = std::sin(u), f[1] = std::cos(u), f[2] = -f[0]; break;
    case COS: f[0] = std::cos(u), f[1] = -std::sin(u), f[2] = -f[0]; break;
    case TAN: f[0] = std::tan(u), f[1] = 1 + f[0] * f[0], f[2] = 2 * f[0] * f[1]; break;
    case ASIN: f[0] = std::asin(u), f[1] = 1 / std::sqrt(s), f[2] = u * f[1] / s; break;
    case ACOS: f[0] = std::acos(u), f[1] = -1 / std::sqrt(s), f[2] = u * f[1] / s; break;
    case ATAN: f[0] = std::atan(u), f[1] = 1 / (1 + u * u), f[2] = -2 * u * f[1] * f[1]; break;
    case SINH: f[0] = f[2] = std::sinh(u), f[1] = std::cosh(u); break;
    case COSH: f[0] = f[2] = std::cosh(u), f[1] = std::sinh(u); break;
    case TANH: f[0] = std::tanh(u), f[1] = 1 - f[0] * f[0], f[2] = -2 * f[0] * f[1]; break;
    case ERF: f[0] = std::erf(u), f[1] = 2 / std::sqrt(PI) * std::exp(-u * u), f[2] = -2 * u * f[1]; break;
    default: f[0] = u >= 0 ? 1 : 0, f[1] = f[2] = 0;  // step
  }
}

/// What does not change keeps a slope of infinity from counting.
inline double times(double slope, double change) { return change == 0 ? 0 : slope * change; }

// f(u)' = f' u',  f(u)'' = f' u'' + f'' u'^2
inline void chain(const double* f, double* u) {
  const double first = u[1];
  u[0] = f[0];
  u[1] = times(f[1], first);
  u[2] = times(f[1], u[2]) + times(f[2], first * first);
}

inline void apply(int function, double* u) {
  if (function == ABS) {
    const double sign = u[0] < 0 || (u[0] == 0 && u[1] < 0) ? -1 : 1;
    for (int k = 0; k < 3; ++k) u[k] *= sign;
    return;
  }
  double f[3];
  derivatives(function, u[0], f);
  chain(f, u);
}

inline void multiply(double* u, const double* v) {
  const double product[3] = {u[0] * v[0], u[1] * v[0] + u[0] * v[1], u[2] * v[0] + 2 * u[1] * v[1] + u[0] * v[2]};
  std::copy_n(product, 3, u);
}

// q = u/v:  q' = (u' - q v')/v,  q'' = (u'' - 2 q' v' - q v'')/v
inline void divide(double* u, const double* v) {
  u[0] /= v[0];
  u[1] = (u[1] - u[0] * v[1]) / v[0];
  u[2] = (u[2] - 2 * u[1] * v[1] - u[0] * v[2]) / v[0];
}

// u^n by its rule; with an exponent that changes u^v = exp(v log u)
inline void power(double* u, const double* v) {
  const double n = v[0];
  if (v[1] == 0 && v[2] == 0) {
    const double f[3] = {std::pow(u[0], n), times(std::pow(u[0], n - 1), n), times(std::pow(u[0], n - 2), n * (n - 1))};
    chain(f, u);
    return;
  }
  apply(LOG, u);
  multiply(u, v);
  apply(EXP, u);
}

}  // namespace bs::jet
