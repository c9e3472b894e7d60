// u(t) of a linear system: waveforms or a table, one column of B each.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>
#include "base/options.hpp"
#include "lattice/csv_table.hpp"
#include "systems/linear/waveform.hpp"

namespace bs {

class Sources {
 public:
  void options(Section& section);
  /// Collective. Reads what the options name, for `columns` columns of B; `preset` where no option was given (may be
  /// empty: then a source must be given if B has columns). Ends the run with exit code 2 if the numbers do not match.
  PetscErrorCode read(MPI_Comm comm, std::int64_t columns, const std::string& preset);
  std::size_t count() const { return waves_.empty() ? columns_ : waves_.size(); }
  /// u_k(t). A table holds its first and last value outside its times (covers() refuses such runs).
  double at(std::size_t column, double t) const;
  bool constant() const;
  /// Empty if the table reaches from `start` to `end`, or one line of error.
  std::string covers(double start, double end) const;
  std::string describe() const;

 private:
  std::string text_, file_;
  int hold_ = 0;
  std::vector<Waveform> waves_;
  CsvTable table_;
  std::size_t columns_ = 0;
};

}  // namespace bs
