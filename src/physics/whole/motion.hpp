// Motion of the points that anchors (springs to given points) are tied to.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "lattice/csv_table.hpp"
#include "physics/body/law_options.hpp"
#include "physics/vector.hpp"

namespace bs {

/// Every anchor point moves alike: at time t it is at the lattice's anchor point + s(t), with velocity s'(t).
///   fixed:     s = 0
///   velocity:  s = c t
///   sinusoid:  s = A sin(2 pi f t + phase)
///   table:     s linear in t between the rows of a table, equal to them at their times
/// s(0) need not be 0: with a phase or a table the run starts from displaced anchor points, while a rest length that is
/// to be "the initial distance" is that from the lattice's anchor point. A phase of 0 starts from s = 0.
struct Motion {
  enum class Kind { fixed, velocity, sinusoid, table };
  static constexpr const char* title = "motion of anchor points";
  Kind kind = Kind::fixed;
  double c[3] = {0, 0, 0};    ///< velocity [m/s]
  double A[3] = {0, 0, 0};    ///< amplitude [m]
  double frequency = 0;       ///< f [Hz]
  double phase = 0;           ///< [rad]
  int components = 1;         ///< how many of c or A were given
  bool at_rest = false;       ///< statics: displacements as at t, velocities 0
  bool at_full_load = false;  ///< statics that does not scale them: displacements as at t = 1, whatever t is
  std::string table_file;     ///< its text is to be read with read_csv_table and handed to set_table
  std::vector<double> time;   ///< rows of the table, increasing, at least two [s]
  std::vector<double> shift;  ///< (rows, 3) displacement [m]

  template <class V>
  void options(V& o);
  bool active() const noexcept { return kind != Kind::fixed; }
  std::string describe() const;

  /// Takes the table: t [s], then one to three components of s [m]; the missing ones are 0. False, and one line in
  /// `error` that calls the table `name`, if it has less than two rows or a slope that is not finite.
  bool set_table(const CsvTable& table, const std::string& name, std::string* error);

  /// False outside the table. The ends have a tolerance of 1e-9 of the table's span, for times that were summed up.
  bool covers(double t) const noexcept {
    if (kind != Kind::table) return true;
    if (time.empty()) return false;
    const double slack = 1e-9 * (time.back() - time.front());
    return t >= time.front() - slack && t <= time.back() + slack;
  }
  /// s(t), three numbers. Outside the table: that of the nearer end.
  void displacement(double t, double* s) const noexcept;
  /// s'(t), three numbers: at a row of the table the slope to its right, at the last row that to its left.
  /// Outside the table: 0.
  void velocity(double t, double* s) const noexcept;
  /// Both: three numbers each.
  void at(double t, double* s, double* ds) const noexcept {
    displacement(t, s);
    velocity(t, ds);
  }

 private:
  /// The row k such that t belongs to the segment from row k to row k + 1. At least two rows.
  std::size_t segment(double t) const noexcept {
    const auto after = std::upper_bound(time.begin(), time.end(), t) - time.begin();
    return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, std::ptrdiff_t(time.size()) - 2));
  }
  double slope(std::size_t k, std::size_t i) const noexcept { return (shift[3 * k + 3 + i] - shift[3 * k + i]) / (time[k + 1] - time[k]); }
};

inline void Motion::displacement(double t, double* s) const noexcept {
  for (int i = 0; i < 3; ++i) s[i] = 0;
  if (at_full_load) t = 1;
  if (kind == Kind::velocity)
    for (int i = 0; i < 3; ++i) s[i] = c[i] * t;
  if (kind == Kind::sinusoid)
    for (int i = 0; i < 3; ++i) s[i] = A[i] * std::sin(TWO_PI * frequency * t + phase);
  if (kind != Kind::table || time.size() < 2) return;
  const double at = std::clamp(t, time.front(), time.back());
  const std::size_t k = segment(at);
  for (std::size_t i = 0; i < 3; ++i)  // from the left end only: exact there, so the last row is taken by itself
    s[i] = at == time.back() ? shift[shift.size() - 3 + i] : shift[3 * k + i] + (at - time[k]) * slope(k, i);
}

inline void Motion::velocity(double t, double* s) const noexcept {
  for (int i = 0; i < 3; ++i) s[i] = 0;
  if (at_rest) return;
  if (kind == Kind::velocity)
    for (int i = 0; i < 3; ++i) s[i] = c[i];
  if (kind == Kind::sinusoid)
    for (int i = 0; i < 3; ++i) s[i] = A[i] * TWO_PI * frequency * std::cos(TWO_PI * frequency * t + phase);
  if (kind != Kind::table || time.size() < 2 || !covers(t)) return;
  const std::size_t k = segment(t);
  for (std::size_t i = 0; i < 3; ++i) s[i] = slope(k, i);
}

inline bool Motion::set_table(const CsvTable& table, const std::string& name, std::string* error) {
  const std::size_t columns = static_cast<std::size_t>(table.columns), rows = table.rows();
  if (rows < 2 || columns < 2 || columns > 4) {
    *error = name + ": a motion needs two rows or more of t,x[,y[,z]]: add rows, or use -bs_anchor_motion fixed";
    return false;
  }
  time.assign(rows, 0);
  shift.assign(3 * rows, 0);
  for (std::size_t k = 0; k < rows; ++k) {
    time[k] = table.values[columns * k];
    for (std::size_t i = 1; i < columns; ++i) shift[3 * k + i - 1] = table.values[columns * k + i];
  }
  for (std::size_t k = 0; k + 1 < rows; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      if (!std::isfinite(slope(k, i))) {
        *error = name + ": the velocity between times " + exact_number(time[k]) + " and " + exact_number(time[k + 1]) +
                 " is not finite: give rows further apart in time, or nearer in place";
        return false;
      }
  return true;
}

inline std::string Motion::describe() const {
  if (kind == Kind::velocity) return "anchor points move at " + vector_text(c, components) + " m/s";
  if (kind == Kind::sinusoid)
    return "anchor points oscillate by " + vector_text(A, components) + " m at " + short_number(frequency) + " Hz, phase " + short_number(phase) +
           " rad";
  if (kind == Kind::table) return "anchor points move as in " + table_file;
  return "anchor points fixed";
}

template <class V>
void Motion::options(V& o) {
  using R = RangeOf<V>;
  int index = static_cast<int>(kind);
  const bool said =
      o.choice("-bs_anchor_motion", "how anchor points move from their positions in the lattice", {"fixed", "velocity", "sinusoid", "table"}, index);
  kind = static_cast<Kind>(index);
  int of_c = components, of_A = components;
  const bool rate = read_vector(o, "-bs_anchor_velocity", "anchor motion velocity: components x[,y[,z]] [m/s]", c, of_c);
  const bool width =
      read_vector(o, "-bs_anchor_amplitude", "anchor motion sinusoid: amplitude A, x[,y[,z]], of A sin(2 pi f t + phase) [m]", A, of_A);
  const bool pace = o.real("-bs_anchor_frequency", "anchor motion sinusoid: frequency f, >= 0 [Hz]", frequency, R::nonnegative);
  const bool angle = o.real("-bs_anchor_phase", "anchor motion sinusoid: phase; with 0 the motion starts at zero displacement [rad]", phase);
  const bool file =
      o.file("-bs_anchor_table", "anchor motion table: CSV file with a time and a displacement in each row, t,x[,y[,z]] [s, m]", table_file);
  components = kind == Kind::velocity ? of_c : of_A;
  if (rate) require(o, said, "-bs_anchor_velocity", "-bs_anchor_motion velocity");
  if (width) require(o, said, "-bs_anchor_amplitude", "-bs_anchor_motion sinusoid");
  if (pace) require(o, said, "-bs_anchor_frequency", "-bs_anchor_motion sinusoid");
  if (angle) require(o, said, "-bs_anchor_phase", "-bs_anchor_motion sinusoid");
  if (file) require(o, said, "-bs_anchor_table", "-bs_anchor_motion table");
  if (kind == Kind::velocity) require(o, rate, "-bs_anchor_motion velocity", "-bs_anchor_velocity [m/s]");
  if (kind == Kind::sinusoid) require(o, width, "-bs_anchor_motion sinusoid", "-bs_anchor_amplitude [m]");
  if (kind == Kind::sinusoid) require(o, pace, "-bs_anchor_motion sinusoid", "-bs_anchor_frequency [Hz]");
  if (kind == Kind::table) require(o, file, "-bs_anchor_motion table", "-bs_anchor_table, a CSV file");
}

}  // namespace bs
