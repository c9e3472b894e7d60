// What is given of the periodic box over time: -bs_box_strain, -bs_box_rate, -bs_box_stress.
#include <algorithm>
#include <cstdlib>

#include "base/error.hpp"
#include "base/options.hpp"
#include "base/text.hpp"
#include "systems/particles/constraints/cell.hpp"

namespace bs {

namespace {

const char* const STRAIN = "-bs_box_strain";
const char* const RATE = "-bs_box_rate";
const char* const STRESS = "-bs_box_stress";

const char* forms_of(const std::string& option) {
  if (option == STRAIN) return "write components such as xy=velocity:0.01 or xx=sinusoid:0.02,0.5";
  if (option == RATE) return "write components with their rates of strain [1/s], such as xy=0.01";
  return "write components with their stress at full load, such as xx=0,yy=-1000";
}

/// Whether text[at] begins "ab=", a and b axes.
bool begins_component(const std::string& text, std::size_t at) {
  const auto axis = [&](std::size_t k) { return text[k] >= 'x' && text[k] <= 'z'; };
  return at + 2 < text.size() && axis(at) && axis(at + 1) && text[at + 2] == '=' && (at + 3 >= text.size() || text[at + 3] != '=');
}

bool is_number(const std::string& text) {
  double value = 0;
  return read_number(text, &value);
}

}  // namespace

PetscErrorCode Cell::read(MPI_Comm comm, const Lattice& l) {
  std::string strain, rate, stress;

  PetscFunctionBegin;
  dim_ = l.dim;
  box_ = l.box;
  PetscCall(read_section(comm, "Periodic box", [&](Section& o) {
    o.text(STRAIN,
           "strain of the periodic box over time by components of F - I, e.g. xy=velocity:0.01,xx=sinusoid:0.02,0.5: velocity:RATE [1/s], "
           "sinusoid:AMPLITUDE,FREQUENCY,PHASE, table:FILE (rows t,strain), expression:TEXT in t; static analyses: t is the load factor",
           strain);
    o.text(RATE, "constant rates of strain of the periodic box, e.g. xy=0.01, which is xy=velocity:0.01 of -bs_box_strain [1/s]", rate);
    o.text(STRESS,
           "components of the box' strain that are free under a given stress, tension positive, e.g. xx=0,yy=-1000, in static analyses: a number is "
           "the stress at full load, which the load factor multiplies; also sinusoid, table and expression as in -bs_box_strain [N/m^(d-1)]",
           stress);
  }));
  for (const auto& [option, text] : {std::pair{STRAIN, &strain}, {RATE, &rate}, {STRESS, &stress}}) {
    if (text->empty()) continue;
    if (!box_.active())
      PetscCall(fail(comm, Exit::input,
                     std::string("option ") + option + ": " + l.source +
                         " has no periodic box: give -bs_lattice_periodic or a lattice file with /box, or leave it out"));
    PetscCall(read_components(comm, option, *text));
  }
  PetscCall(check_free(comm));
  PetscFunctionReturn(0);
}

PetscErrorCode Cell::read_components(MPI_Comm comm, const char* option, const std::string& text) {
  PetscFunctionBegin;
  for (std::size_t at = 0; at < text.size();) {
    if (!begins_component(text, at))
      PetscCall(fail(comm, Exit::input, std::string("option ") + option + ": '" + shown_text(text.substr(at)) + "': " + forms_of(option)));
    std::size_t end = at + 3;
    while (end < text.size() && !(text[end] == ',' && begins_component(text, end + 1))) ++end;
    PetscCall(read_component(comm, option, text.substr(at, 2), text.substr(at + 3, end - at - 3)));
    at = end + 1;
  }
  PetscFunctionReturn(0);
}

bool Cell::has(int row, int column) const {
  const auto is = [&](const auto& one) { return one.row == row && one.column == column; };
  return std::any_of(components_.begin(), components_.end(), is) || std::any_of(free_.begin(), free_.end(), is);
}

PetscErrorCode Cell::read_component(MPI_Comm comm, const std::string& option, const std::string& name, const std::string& text) {
  const int row = name[0] - 'x', column = name[1] - 'x';
  const std::string begin = "option " + option + ": " + name + ": ";
  std::string written = text;
  Drive drive;

  PetscFunctionBegin;
  if (row >= dim_ || column >= dim_)
    PetscCall(fail(comm, Exit::input, begin + "the lattice has " + how_many(dim_, "dimension") + ": " + forms_of(option)));
  if (has(row, column)) PetscCall(fail(comm, Exit::input, begin + "the component is given twice: write each once, as a strain, a rate or a stress"));
  if (option == RATE && !is_number(text))
    PetscCall(fail(comm, Exit::input, begin + "'" + shown_text(text) + "' is no finite number: " + forms_of(option)));
  if (option != STRAIN && is_number(text)) written = "velocity:" + text;
  if (option == STRESS && text == "free") PetscCall(fail(comm, Exit::input, begin + "say under which stress it is free: " + forms_of(option)));
  PetscCall(read_drive(comm, option, name + ": ", "x=" + written, 1, false, &drive));
  if (option == STRESS) free_.push_back({row, column, std::move(drive), 0});
  else components_.push_back({row, column, std::move(drive)});
  PetscFunctionReturn(0);
}

/// A strain is found only where springs resist it: not a rotation, and not along what is repeated nowhere.
PetscErrorCode Cell::check_free(MPI_Comm comm) const {
  PetscFunctionBegin;
  for (const Free& one : free_) {
    const std::string name = component_name(one.row, one.column), other = component_name(one.column, one.row);
    const std::string begin = std::string("option ") + STRESS + ": " + name + ": ";
    for (const Free& next : free_)
      if (next.row == one.column && next.column == one.row && one.row < one.column)
        PetscCall(fail(comm, Exit::input, begin + "with " + other + " free as well the box could turn: leave one of them out"));
    bool repeats = false;
    for (int k = 0; k < dim_; ++k) repeats = repeats || (box_.periodic[k] && box_.edges[static_cast<std::size_t>(k * dim_ + one.column)] != 0);
    if (!repeats)
      PetscCall(fail(comm, Exit::input, begin + format("the box is not periodic along %c, where no stress acts: leave it out", 'x' + one.column)));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
