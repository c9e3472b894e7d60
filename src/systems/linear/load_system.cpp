#include <algorithm>
#include <map>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/handle.hpp"
#include "base/rounding.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "input/matrix_load.hpp"
#include "systems/linear/system.hpp"

namespace bs {

void SystemOptions::read(Section& o, bool help) {
  o.file("-bs_linear_G", "matrix G of G x + C x' = B u(t): Matrix Market text or PETSc binary (.bin, .petsc, .dat)", G);
  o.file("-bs_linear_C", "matrix C, which may be singular", C);
  o.file("-bs_linear_B", "matrix B, with one column for every source", B);
  o.choice("-bs_linear_type", "origin of the matrices: files, or a built-in system", {"files", "rc_ladder", "rlc", "heat1d", "heat2d"}, type);
  o.file("-bs_netlist", "netlist of SPICE with R, L, C, V and I cards, in place of matrices; it makes -bs_model linear the default", netlist);
  o.integers("-bs_linear_size", "rc_ladder, heat1d: number of states; heat2d: cells along x,y", size);
  resistance_given = o.real("-bs_linear_resistance", "resistance; rc_ladder: of the first resistor, default 100; rlc: default 20 [ohm]", resistance,
                            Range::positive);
  capacitance_given =
      o.real("-bs_linear_capacitance", "capacitance; rc_ladder: mean value, default 1e-8; rlc: default 1e-6 [F]", capacitance, Range::positive);
  o.real("-bs_linear_inductance", "rlc: inductance [H]", inductance, Range::positive);
  o.real("-bs_linear_vary", "rc_ladder: relative variation vary, below 1, of R_i = R (1 + vary sin 1.7 i) and C_i = C (1 + vary cos 0.9 i)", vary,
         Range::nonnegative);
  o.real("-bs_linear_conductivity", "heat1d, heat2d: kappa of T' = kappa Laplace T on the unit interval or square [1/s]", conductivity,
         Range::positive);
  o.file("-bs_linear_x0", "initial state: Matrix Market, PETSc binary, or CSV (on each line a number, or name,value); default 0", x0);
  o.file("-bs_linear_labels", "text file with a name for every state, one per line", labels);
  if (!netlist.empty() && (type > 0 || !(G + C + B).empty()))
    o.fail("option -bs_netlist: a netlist takes no -bs_linear_type, -bs_linear_G, -bs_linear_C, -bs_linear_B");
  if (!netlist.empty()) return;
  if (help && type == 0 && (G.empty() || C.empty())) type = 2;
  if (vary >= 1) o.fail("option -bs_linear_vary: give a number below 1, or some resistance is not positive");
  if (type > 0 && !(G + C + B).empty()) o.fail("option -bs_linear_type: a built-in system takes no -bs_linear_G, -bs_linear_C, -bs_linear_B");
  if (type == 0 && (G.empty() || C.empty()))
    o.fail(std::string("option ") + (G.empty() ? "-bs_linear_G" : "-bs_linear_C") +
           " is missing: name a matrix file, or choose -bs_linear_type rc_ladder");
}

namespace {

std::string size_text(const std::string& what, PetscInt rows, PetscInt columns) {
  return format("%s is %lld x %lld", what.c_str(), static_cast<long long>(rows), static_cast<long long>(columns));
}

PetscErrorCode load_files(MPI_Comm comm, const SystemOptions& o, LinearSystem* out) {
  PetscInt n, m, rows, columns;
  PetscFunctionBegin;
  PetscCall(load_matrix(comm, o.G, "-bs_linear_G", out->G.out()));
  PetscCall(MatGetSize(out->G, &n, &m));
  if (n != m) PetscCall(fail(comm, Exit::input, o.G + ": " + size_text("G", n, m) + ": it must be square"));
  PetscCall(load_matrix(comm, o.C, "-bs_linear_C", out->C.out()));
  PetscCall(MatGetSize(out->C, &rows, &columns));
  if (rows != n || columns != n)
    PetscCall(fail(comm, Exit::input, o.C + ": " + size_text("C", rows, columns) + ", " + size_text("G", n, n) + ": they must have one size"));
  if (!o.B.empty()) {
    PetscCall(load_matrix(comm, o.B, "-bs_linear_B", out->B.out()));
    PetscCall(MatGetSize(out->B, &rows, &columns));
    if (rows != n)
      PetscCall(fail(comm, Exit::input, o.B + ": " + size_text("B", rows, columns) + ", " + size_text("G", n, n) + ": B must have as many rows"));
  }
  out->origin = o.G + ", " + o.C + (o.B.empty() ? "" : ", " + o.B);
  PetscFunctionReturn(0);
}

PetscErrorCode read_labels(MPI_Comm comm, const std::string& path, PetscInt n, std::vector<std::string>* names) {
  std::string text;
  PetscFunctionBegin;
  PetscCall(read_text_file(comm, path, &text));
  names->clear();
  for (const std::string& line : split(text, '\n')) names->push_back(line);
  while (!names->empty() && names->back().empty()) names->pop_back();
  if (static_cast<PetscInt>(names->size()) != n)
    PetscCall(fail(comm, Exit::input,
                   "option -bs_linear_labels: " + path + " has " + how_many(static_cast<std::int64_t>(names->size()), "line") + " for " +
                       how_many(n, "state") + ": write one a state"));
  PetscFunctionReturn(0);
}

/// A state that occurs in no equation, or an equation without a state: the pencil is singular whatever the step.
PetscErrorCode check_rows(MPI_Comm comm, const LinearSystem& s) {
  PetscInt first, last;
  PetscFunctionBegin;
  Error fault;
  PetscCall(MatGetOwnershipRange(s.G, &first, &last));
  for (PetscInt i = first; i < last && !fault; ++i) {
    bool empty = true;
    for (Mat A : {s.G.get(), s.C.get()}) PetscCall(each_nonzero(A, i, [&](PetscInt, double) { empty = false; }));
    if (empty)
      fault.note(
          i,
          (s.origin.empty() ? "" : s.origin + ": ") +
              format(
                  "the pencil sC + G is singular: row %lld of both G and C is empty and determines nothing: remove this state or give it an equation",
                  static_cast<long long>(i) + 1));
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace

/// Collective. x0, which has its numbers in the order of `names`, gets that of the system's states. Errors (exit 2): a name that is none of theirs,
/// or that comes twice.
static PetscErrorCode place_by_name(MPI_Comm comm, const std::string& file, const std::vector<std::string>& names, LinearSystem* s) {
  std::map<std::string, std::size_t> row;
  Error fault;
  VecHandle whole;
  ScatterHandle scatter;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < names.size(); ++k)
    if (!row.emplace(lower(names[k]), k).second && !fault)
      fault.note(static_cast<std::int64_t>(k), file + ": the state " + names[k] + " is there twice: give each one its value");
  PetscCall(fail_if_any(comm, fault));
  PetscCall(VecScatterCreateToAll(s->x0, scatter.out(), whole.out()));
  PetscCall(VecScatterBegin(scatter, s->x0, whole, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, s->x0, whole, INSERT_VALUES, SCATTER_FORWARD));
  const ReadArray given(whole);
  const WriteArray x0(s->x0);
  for (std::size_t i = 0; i < s->labels.size(); ++i) {
    const auto found = row.find(lower(s->labels[i]));
    if (found != row.end()) x0[static_cast<PetscInt>(i)] = given[static_cast<PetscInt>(found->second)];
    else if (!fault)
      fault.note(static_cast<std::int64_t>(i), file + ": there is no value of the state " + s->labels[i] + ": give each one its value");
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode load_system(MPI_Comm comm, const SystemOptions& o, LinearSystem* out) {
  PetscInt n, first, last;
  PetscFunctionBegin;
  if (!o.netlist.empty()) PetscCall(load_netlist(comm, o.netlist, out));
  else if (o.type > 0) PetscCall(generate_system(comm, o, out));
  else PetscCall(load_files(comm, o, out));
  PetscCall(check_rows(comm, *out));
  PetscCall(MatCreateVecs(out->G, out->x0.out(), nullptr));
  PetscCall(VecZeroEntries(out->x0));
  PetscCall(VecGetSize(out->x0, &n));
  PetscCall(VecGetOwnershipRange(out->x0, &first, &last));
  std::vector<std::string> names, labels;
  if (!o.x0.empty()) PetscCall(load_vector(comm, o.x0, "-bs_linear_x0", out->x0, &names));
  if (!o.labels.empty()) PetscCall(read_labels(comm, o.labels, n, &labels));
  if (!labels.empty()) out->labels.assign(labels.begin() + first, labels.begin() + last);
  bool labelled = !out->labels.empty();
  PetscCall(on_some_rank(comm, labelled, &labelled));
  if (!names.empty() && labelled) PetscCall(place_by_name(comm, o.x0, names, out));
  else if (!names.empty()) out->labels.assign(names.begin() + first, names.begin() + last);
  PetscFunctionReturn(0);
}

void Sources::options(Section& o) {
  o.text("-bs_linear_source", waveform_help(), text_);
  o.file("-bs_linear_source_table", "CSV file with columns t,u1,u2,..., one u for every column of B", file_);
  o.choice("-bs_linear_source_table_kind",
           "values between the times of the table: linear (interpolated), or step (a value holds until the next time)", {"linear", "step"}, hold_);
}

PetscErrorCode Sources::read(MPI_Comm comm, std::int64_t columns, const std::string& preset) {
  PetscFunctionBegin;
  std::string error;
  if (!text_.empty() && !file_.empty()) error = "options -bs_linear_source and -bs_linear_source_table: give one of them";
  if (error.empty() && !file_.empty()) {
    std::string text;
    PetscCall(read_text_file(comm, file_, &text));
    if (read_csv_table(text, file_, 2, 1000000, &table_, &error)) columns_ = static_cast<std::size_t>(table_.columns - 1);
  } else if (error.empty()) {
    const std::string& given = text_.empty() ? preset : text_;
    if (!given.empty()) error = read_waveforms(given, &waves_);
    if (!error.empty()) error = "option -bs_linear_source: " + error;
  }
  const auto wanted = static_cast<std::size_t>(columns);
  if (error.empty() && count() != wanted)
    error = count() == 0
                ? "B has " + how_many(columns, "column") + " and no source is given: add -bs_linear_source \"step(1)\" or -bs_linear_source_table"
            : wanted == 0 ? std::string("a source is given, but no matrix B says where it acts: add -bs_linear_B, or leave the source out")
                          : how_many(static_cast<std::int64_t>(count()), "source") + " for the " + how_many(columns, "column") +
                                " of B: give one a column" + (file_.empty() ? ", separated by ';'" : " after the time");
  if (!error.empty()) PetscCall(fail(comm, Exit::input, error));
  for (const Waveform& wave : waves_)
    if (!wave.remark().empty()) PetscCall(warn(comm, "waveform", (text_.empty() ? "" : "option -bs_linear_source: ") + wave.remark()));
  PetscFunctionReturn(0);
}

/// The last row of the table whose time is not after t, but for rounding.
std::size_t Sources::row_at(double t) const {
  const std::size_t width = columns_ + 1;
  std::size_t low = 0, high = table_.rows();
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    const double time = table_.values[middle * width];
    if (snap(t, time) >= time) low = middle;
    else high = middle;
  }
  return low;
}

double Sources::before(std::size_t column, double t) const {
  if (!waves_.empty()) return waves_[column].before(t);
  const std::size_t width = columns_ + 1, low = row_at(t);
  const bool jumps = hold_ == 1 && low > 0 && snap(t, table_.values[low * width]) == table_.values[low * width];
  return jumps ? table_.values[(low - 1) * width + 1 + column] : at(column, t);
}

double Sources::at(std::size_t column, double t) const {
  if (!waves_.empty()) return waves_[column].at(t);
  const std::size_t n = table_.rows(), width = columns_ + 1, low = row_at(t);
  const auto time = [&](std::size_t row) { return table_.values[row * width]; };
  const auto value = [&](std::size_t row) { return table_.values[row * width + 1 + column]; };
  if (low + 1 == n || hold_ == 1 || snap(t, time(low)) <= time(low)) return value(low);
  return value(low) + (value(low + 1) - value(low)) * ((t - time(low)) / (time(low + 1) - time(low)));
}

Knot Sources::next_knot(double t) const {
  Knot next;
  for (const Waveform& wave : waves_) next.take(wave.next_knot(t));
  const std::size_t width = columns_ + 1;
  for (std::size_t row = columns_ > 0 ? row_at(t) : 0; row < table_.rows() && !std::isfinite(next.time); ++row) {
    const double* here = &table_.values[row * width];
    const bool jumps = hold_ == 1 && row > 0 && !std::equal(here + 1, here + width, here + 1 - width);
    if (is_after(t, *here) && (jumps || hold_ == 0)) next = {*here, jumps};
  }
  return next;
}

bool Sources::constant() const {
  if (waves_.empty()) return columns_ == 0;
  return std::all_of(waves_.begin(), waves_.end(), [](const Waveform& w) { return w.constant(); });
}

std::string Sources::covers(double start, double end) const {
  if (columns_ == 0) return {};
  const double first = table_.values.front(), last = table_.values[(table_.rows() - 1) * (columns_ + 1)];
  if (snap(start, first) >= first && snap(end, last) <= last) return {};
  return format("%s: the table reaches from t = %g to %g s, the run from %g to %g s: add rows or change -ts_max_time", file_.c_str(), first, last,
                start, end);
}

std::string Sources::describe() const {
  if (columns_ > 0) return format("%zu from %s, %s", columns_, file_.c_str(), hold_ == 1 ? "steps" : "piecewise linear");
  if (waves_.empty()) return "none";
  std::string text = waves_[0].text();
  for (std::size_t k = 1; k < std::min<std::size_t>(waves_.size(), 4); ++k) text += "; " + waves_[k].text();
  return waves_.size() > 4 ? text + "; ..." : text;
}

}  // namespace bs
