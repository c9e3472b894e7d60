#include "systems/particles/cell.hpp"

#include <algorithm>

#include "base/fault.hpp"
#include "base/options.hpp"
#include "systems/particles/drive_tables.hpp"

namespace bs {

namespace {

const char* const FORMS = "write components such as xy=velocity:0.01 or xx=sinusoid:0.02,0.5";

/// Whether text[at] begins "ab=", a and b axes.
bool begins_component(const std::string& text, std::size_t at) {
  const auto axis = [&](std::size_t k) { return text[k] >= 'x' && text[k] <= 'z'; };
  return at + 2 < text.size() && axis(at) && axis(at + 1) && text[at + 2] == '=' && (at + 3 >= text.size() || text[at + 3] != '=');
}

}  // namespace

PetscErrorCode Cell::read(MPI_Comm comm, const Lattice& l) {
  static const char help[] =
      "strain of the periodic box over time by components of F - I, e.g. xy=velocity:0.01,xx=sinusoid:0.02,0.5: velocity:RATE [1/s], "
      "sinusoid:AMPLITUDE,FREQUENCY,PHASE, table:FILE (rows t,strain), expression:TEXT in t; static analyses: t is the load factor";
  std::string text;

  PetscFunctionBegin;
  dim_ = l.dim;
  box_ = l.box;
  PetscCall(read_section(comm, "Periodic box", [&](Section& o) { o.text("-bs_box_strain", help, text); }));
  if (text.empty()) PetscFunctionReturn(0);
  if (!box_.active())
    PetscCall(
        tell(comm, Exit::input,
             "option -bs_box_strain: " + l.source + " has no periodic box: give -bs_lattice_periodic or a lattice file with /box, or leave it out"));
  for (std::size_t at = 0; at < text.size();) {
    if (!begins_component(text, at)) PetscCall(tell(comm, Exit::input, "option -bs_box_strain: '" + text.substr(at) + "': " + FORMS));
    std::size_t end = at + 3;
    while (end < text.size() && !(text[end] == ',' && begins_component(text, end + 1))) ++end;
    PetscCall(read_component(comm, text.substr(at, 2), text.substr(at + 3, end - at - 3)));
    at = end + 1;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Cell::read_component(MPI_Comm comm, const std::string& name, const std::string& text) {
  Component one{name[0] - 'x', name[1] - 'x', {}};
  std::string error;
  const std::string option = "option -bs_box_strain: " + name + ": ";

  PetscFunctionBegin;
  if (one.row >= dim_ || one.column >= dim_) PetscCall(tell(comm, Exit::input, option + format("the lattice has %d dimensions: ", dim_) + FORMS));
  if (std::any_of(components_.begin(), components_.end(), [&](const Component& c) { return c.row == one.row && c.column == one.column; }))
    PetscCall(tell(comm, Exit::input, option + "the component is given twice: write each once"));
  if (!one.drive.parse("x=" + text, 1, &error)) PetscCall(tell(comm, Exit::input, option + error));
  PetscCall(read_drive_tables(comm, "-bs_box_strain", &one.drive));
  components_.push_back(std::move(one));
  PetscFunctionReturn(0);
}

void Cell::create(const Network& net) {
  net_ = &net;
  for (PetscInt g = 0; g < net.ghosts; ++g)
    for (int k = 0; k < dim_; ++k)
      if (net.image[static_cast<std::size_t>(g * dim_ + k)] != 0) {
        images_.push_back(net.n + g);
        break;
      }
}

bool Cell::moving() const {
  return std::any_of(components_.begin(), components_.end(), [](const Component& one) { return one.drive.moving() != 0; });
}

bool Cell::triclinic() const {
  return !box_.orthogonal(dim_) || std::any_of(components_.begin(), components_.end(), [](const Component& one) { return one.row != one.column; });
}

/// F and dF/dt, (d, d) each.
void Cell::gradient(double t, double* F, double* rate) const {
  const double zero[3] = {0, 0, 0};
  std::fill_n(F, dim_ * dim_, 0.0);
  std::fill_n(rate, dim_ * dim_, 0.0);
  for (int k = 0; k < dim_; ++k) F[k * dim_ + k] = 1;
  for (const Component& one : components_) {
    double g[3] = {0, 0, 0}, v[3] = {0, 0, 0}, a[3] = {0, 0, 0};
    one.drive.at(full_load_ ? 1.0 : t, zero, g, v, a);
    F[one.row * dim_ + one.column] += g[0];
    rate[one.row * dim_ + one.column] += at_rest_ ? 0.0 : v[0];
  }
}

void Cell::edges(double t, double* edges, double* rates) const {
  double F[9], G[9];
  gradient(t, F, G);
  for (int k = 0; k < dim_; ++k)
    for (int r = 0; r < dim_; ++r) {
      double e = 0, v = 0;
      for (int c = 0; c < dim_; ++c) {
        const double E = box_.edges[static_cast<std::size_t>(k * dim_ + c)];
        e += F[r * dim_ + c] * E;
        v += G[r * dim_ + c] * E;
      }
      edges[k * dim_ + r] = e;
      if (rates) rates[k * dim_ + r] = v;
    }
}

void Cell::velocity_gradient(double t, double* L) const {
  double F[9], G[9], inverse[9];
  gradient(t, F, G);
  std::fill_n(L, dim_ * dim_, 0.0);
  if (!invert_edges(F, dim_, inverse)) return;  // F has rows where edges have columns: both are inverted alike
  for (int r = 0; r < dim_; ++r)
    for (int c = 0; c < dim_; ++c)
      for (int k = 0; k < dim_; ++k) L[r * dim_ + c] += G[r * dim_ + k] * inverse[k * dim_ + c];
}

double Cell::volume(double t) const {
  double e[9];
  edges(t, e, nullptr);
  return box_volume(e, dim_);
}

void Cell::shift_images(double t, double sign, bool velocities, double* states) const {
  double e[9], rate[9];
  edges(t, e, rate);
  for (const PetscInt i : images_) {
    double* y = states + static_cast<std::size_t>(i) * 2 * static_cast<std::size_t>(dim_);
    const int* s = net_->image.data() + static_cast<std::size_t>(i - net_->n) * static_cast<std::size_t>(dim_);
    for (int c = 0; c < dim_; ++c)
      for (int k = 0; k < dim_; ++k) {
        y[c] += sign * s[k] * e[k * dim_ + c];
        if (velocities) y[dim_ + c] += sign * s[k] * rate[k * dim_ + c];
      }
  }
}

PetscErrorCode Cell::covers(double t_end) const {
  PetscFunctionBegin;
  for (const Component& one : components_)
    if (!one.drive.covers(t_end))
      PetscCall(tell(net_->comm, Exit::input,
                     format("the table of -bs_box_strain does not reach the end of the run, t = %g s: add rows or lower -ts_max_time", t_end)));
  PetscFunctionReturn(0);
}

std::vector<std::string> Cell::describe() const {
  std::vector<std::string> lines;
  if (!box_.active()) return lines;
  std::string edges, along;
  for (int k = 0; k < dim_; ++k) {
    edges += k ? "; " : "";
    for (int c = 0; c < dim_; ++c) edges += format(c ? ", %g" : "%g", box_.edges[static_cast<std::size_t>(k * dim_ + c)]);
    if (box_.periodic[k]) along += (along.empty() ? "" : ", ") + std::to_string(k + 1);
  }
  lines.push_back("periodic box along edge " + along + " of (" + edges + ") m");
  for (const Component& one : components_)
    lines.push_back(std::string("box strain ") + static_cast<char>('x' + one.row) + static_cast<char>('x' + one.column) + ": " +
                    one.drive.text().substr(2));
  return lines;
}

}  // namespace bs
