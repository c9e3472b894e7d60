#include "physics/whole/expression.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#ifdef BS_MATHEVAL
#include <matheval.h>
#endif

namespace bs {

#ifdef BS_MATHEVAL

struct Expression::Parts {
  void* f[3] = {nullptr, nullptr, nullptr};  ///< u, u', u''
  bool by_place = false;
  double time = NAN, value[3] = {0, 0, 0};  ///< the last result, where the place does not matter
  Parts() = default;
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;
  ~Parts() {
    for (void* one : f)
      if (one) evaluator_destroy(one);
  }
};

bool Expression::parse(const std::string& text, std::string* error) {
  const std::string known[] = {"t", "x0", "y0", "z0"};
  auto parts = std::make_shared<Parts>();
  std::vector<char> copy(text.begin(), text.end());
  copy.push_back(0);
  parts->f[0] = text.empty() ? nullptr : evaluator_create(copy.data());
  if (!parts->f[0]) {
    *error = "'" + text + "' is no expression: write one in t, x0, y0 and z0 such as 0.1*sin(2*pi*t)";
    return false;
  }
  char** names = nullptr;
  int count = 0;
  evaluator_get_variables(parts->f[0], &names, &count);
  for (int k = 0; k < count; ++k) {
    if (std::find(std::begin(known), std::end(known), names[k]) == std::end(known)) {
      *error = "'" + text + "': " + names[k] + " is unknown: write an expression in t [s] and the initial position x0, y0, z0 [m]";
      return false;
    }
    parts->by_place = parts->by_place || std::strcmp(names[k], "t") != 0;
  }
  char t[] = "t";
  for (int k = 1; k < 3; ++k) parts->f[k] = evaluator_derivative(parts->f[k - 1], t);
  parts_ = std::move(parts);
  return true;
}

void Expression::at(double t, const double* x0, double* out) const {
  if (parts_->by_place || t != parts_->time) {
    static char names[4][3] = {"t", "x0", "y0", "z0"};
    char* of[4] = {names[0], names[1], names[2], names[3]};
    double values[4] = {t, x0[0], x0[1], x0[2]};
    for (int k = 0; k < 3; ++k) parts_->value[k] = evaluator_evaluate(parts_->f[k], 4, of, values);
  }
  parts_->time = t;
  std::copy_n(parts_->value, 3, out);
}

#else

struct Expression::Parts {};

bool Expression::parse(const std::string&, std::string* error) {
  *error = "this program was built without GNU libmatheval, which reads expressions: install libmatheval-dev and build it again, or use a table";
  return false;
}

void Expression::at(double, const double*, double* out) const { std::fill_n(out, 3, 0.0); }

#endif

}  // namespace bs
