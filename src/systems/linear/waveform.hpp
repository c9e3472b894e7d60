// Sources over time, as in SPICE. No PETSc.
#pragma once
#include <string>
#include <vector>
#include "base/knots.hpp"

namespace bs {

/// One source u(t). Where it jumps it already has its new value at the time of the jump: a step with t0 = 0 is on at
/// t = 0; before() is what it comes from. Times that differ from a knot by 1e-10 of it count as the knot (a run's times are sums of steps).
class Waveform {
 public:
  enum class Kind { constant, step, pulse, sine, exponential, piecewise };
  double at(double t) const;
  /// The limit from the left: another value than at(t) where it jumps.
  double before(double t) const;
  /// The next time after t at which it jumps or bends.
  Knot next_knot(double t) const;
  /// Whether it is written as a netlist of SPICE has it.
  bool as_spice() const { return spice_; }
  /// Whether it has one value for all t >= 0.
  bool constant() const;
  /// A sentence where it is constant though its name says otherwise (an amplitude of 0); empty if there is nothing to report.
  std::string remark() const;
  const std::string& text() const { return text_; }  ///< as it was given

 private:
  friend std::string read_waveform(const std::string& text, Waveform* out);
  Kind kind_ = Kind::constant;
  std::vector<double> p_;  ///< the kind's parameters in the order of waveform_help()
  std::string text_;
  bool spice_ = false;
};

/// Reads NAME(values or key=value, ...), for example pulse(amp=5,t0=2e-4,rise=1e-4,width=6e-4,fall=2e-4) or
/// sine(1,50); a number alone is constant; SPICE's form with blanks: SIN(0 1 50). Returns one line of error, empty if all
/// is well.
std::string read_waveform(const std::string& text, Waveform* out);

/// Waveforms separated by ';'.
std::string read_waveforms(const std::string& text, std::vector<Waveform>* out);

/// The grammar, for -help.
const char* waveform_help();

// Waveforms as a netlist of SPICE writes them: NAME(V1 V2 ...), arguments separated by blanks, in SPICE's order.

/// A number of SPICE: digits, then a factor (T G MEG K M U N P F, MIL = 25.4e-6, any case; M is milli), then letters of a
/// unit, which count for nothing: 1k, 5mV, 3MEGohm. Returns why it is none, empty if it is one.
std::string read_spice_number(const std::string& word, double* value);

/// Whether the text between the brackets is written with blanks, as in SPICE, and not as NAME(values or key=value, ...).
bool is_spice_form(const std::string& inside);

/// Reads `name` (lower case: sin, sine, pulse, exp, pwl) with the arguments `inside`. `kind` receives the name read_waveform()
/// has for it, `p` its parameters in the order of waveform_help() (phase in rad). Returns one line of error, empty if all is well.
std::string read_spice(const std::string& name, const std::string& inside, std::string* kind, std::vector<double>* p);

}  // namespace bs
