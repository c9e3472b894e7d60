// Waveforms as a netlist of SPICE writes them: NAME(V1 V2 ...), arguments separated by blanks, in SPICE's order. No PETSc.
#pragma once
#include <string>
#include <vector>

namespace bs {

/// A number of SPICE: digits, then a factor (T G MEG K M U N P F, MIL = 25.4e-6, any case; M is milli), then letters of a
/// unit, which count for nothing: 1k, 5mV, 3MEGohm. Returns why it is none, empty if it is one.
std::string read_spice_number(const std::string& word, double* value);

/// Whether the text between the brackets is written with blanks, as in SPICE, and not as NAME(values or key=value, ...).
bool is_spice_form(const std::string& inside);

/// Reads `name` (lower case: sin, sine, pulse, exp, pwl) with the arguments `inside`. `kind` receives the name read_waveform()
/// has for it, `p` its parameters in the order of waveform_help() (phase in rad). Returns one line of error, empty if all is well.
std::string read_spice(const std::string& name, const std::string& inside, std::string* kind, std::vector<double>* p);

}  // namespace bs
