#include "systems/linear/sources.hpp"
#include <algorithm>
#include "base/error.hpp"
#include "input/text_file.hpp"

namespace bs {

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
    error = count() == 0  ? format("B has %zu columns and no source is given: add -bs_linear_source \"step(1)\" or -bs_linear_source_table", wanted)
            : wanted == 0 ? std::string("a source is given, but no matrix B says where it acts: add -bs_linear_B, or leave the source out")
                          : format("%zu sources for the %zu columns of B: give one a column%s", count(), wanted,
                                   file_.empty() ? ", separated by ';'" : " after the time");
  if (!error.empty()) PetscCall(fail(comm, Exit::input, error));
  for (const Waveform& wave : waves_)
    if (!wave.remark().empty()) PetscCall(warn(comm, "option -bs_linear_source: " + wave.remark()));
  PetscFunctionReturn(0);
}

double Sources::at(std::size_t column, double t) const {
  if (!waves_.empty()) return waves_[column].at(t);
  const std::size_t n = table_.rows(), width = columns_ + 1;
  const auto time = [&](std::size_t row) { return table_.values[row * width]; };
  const auto value = [&](std::size_t row) { return table_.values[row * width + 1 + column]; };
  // the last row whose time is not after t, but for rounding
  std::size_t low = 0, high = n;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    if (snap(t, time(middle)) >= time(middle)) low = middle;
    else high = middle;
  }
  if (low + 1 == n || hold_ == 1 || snap(t, time(low)) <= time(low)) return value(low);
  return value(low) + (value(low + 1) - value(low)) * ((t - time(low)) / (time(low + 1) - time(low)));
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
