// Output on the terminal while the program runs. Only rank 0 prints, on stdout.
#pragma once
#include <petscsys.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace bs {

/// Where the run stands; counts are totals since the start.
struct RunState {
  double time = 0, start = 0, end = 0;  ///< simulated [s]
  std::int64_t steps = 0, rejected = 0, newton = 0, krylov = 0;
  double energy = std::numeric_limits<double>::quiet_NaN();  ///< total, as last observed [J]; NaN: not shown
  double observed = 0;                                       ///< when it was [s]
  std::string reasons;                                       ///< of the rejections, in words; may be empty
  std::int64_t warnings = 0;                                 ///< warnings after which the run continued
  const char* clock = nullptr;                               ///< what stands for the time where load steps are taken
};

/// "0.42 s", "1 min 05 s", "3 h 07 min", "2 d 04 h" of a wall time [s].
std::string duration(double seconds);

/// Wall time left [s] if the rest of the simulated time goes as the past did in `wall` seconds; NaN if unknown.
double time_left(const RunState& state, double wall);

/// The first line of every header: "backspring 0.2.0 on 2 ranks".
std::string program_line(MPI_Comm comm);

/// The line without "\r" or newline, e.g. "t = 0.5 s (50 %), step 100, Newton 210, Krylov 840, E = 1.25 J at 0.4 s, 3 s left".
std::string progress_line(const RunState& state, double wall);

/// "backspring: ok t=... steps=... rejected=... newton=... krylov=... wall=..."; outcome: ok, stopped (by a signal) or failed; wall in
/// seconds; then " warnings=N" where there were any.
std::string verdict_line(const RunState& state, double wall, const std::string& outcome);

/// " warnings=N", or nothing where there were none.
std::string counted(std::size_t warnings);

/// True if stdout ends in a terminal. Open MPI gives rank 0 a terminal of its own whatever mpirun's output is: then
/// mpirun's own stdout decides.
bool stdout_is_terminal();

/// Local. From here on runs on `comm` print on stdout, which they do not by default.
void let_runs_print(MPI_Comm comm);

/// Seconds between lines: negative: none; 0: every step.
class Progress {
 public:
  /// Starts the clock. On a terminal the line is rewritten in place, at most ten times a second.
  Progress(MPI_Comm comm, double interval);
  /// Lines above everything else.
  void header(const std::vector<std::string>& lines) const;
  /// After every step; prints if it is time to. Costs a clock reading.
  void update(const RunState& state);
  /// `lines` of the summary, then the verdict line, which is printed however quiet the run is.
  void finish(const RunState& state, const std::string& outcome, const std::vector<std::string>& lines);
  /// Ends a line that is being rewritten, before something else is printed.
  void break_line();
  double wall() const;  ///< [s] since construction

 private:
  bool prints_, terminal_;
  double interval_, started_, last_ = 0;
  std::size_t width_ = 0;  ///< of the line being rewritten; 0: none
};

}  // namespace bs
