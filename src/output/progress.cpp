#include "output/progress.hpp"
#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "base/version.hpp"

namespace bs {

namespace {
struct Printing {
  bool on = false;
};
}  // namespace

std::string duration(double seconds) {
  if (!std::isfinite(seconds)) return "?";
  if (seconds < 10) return format("%.2g s", seconds);
  const long long s = std::llround(seconds);
  if (s < 60) return format("%lld s", s);
  if (s < 3600) return format("%lld min %02lld s", s / 60, s % 60);
  if (s < 86400) return format("%lld h %02lld min", s / 3600, s % 3600 / 60);
  return format("%lld d %02lld h", s / 86400, s % 86400 / 3600);
}

double time_left(const RunState& state, double wall) {
  const double done = state.time - state.start, rest = state.end - state.time;
  return done > 0 && rest >= 0 ? wall * (rest / done) : std::numeric_limits<double>::quiet_NaN();
}

std::string program_line(MPI_Comm comm) {
  const PetscMPIInt size = size_of(comm);
  return std::string("backspring ") + version() + " on " + how_many(size, "rank");
}

std::string progress_line(const RunState& state, double wall) {
  const double span = state.end - state.start;
  std::string line = state.clock ? format("%s %.6g", state.clock, state.time) : format("t = %.6g s", state.time);
  // Rounded down: 100 % means the end.
  if (span > 0) line += format(" (%.0f %%)", std::floor(100 * (state.time - state.start) / span + 1e-9));
  line += format(", %s %lld, Newton %lld, Krylov %lld", state.clock ? "load step" : "step", (long long)state.steps, (long long)state.newton,
                 (long long)state.krylov);
  if (state.rejected > 0) line += format(", rejected %lld", (long long)state.rejected);
  if (state.rejected > 0 && !state.reasons.empty()) line += " (" + state.reasons + ")";
  if (!std::isnan(state.energy)) line += format(", E = %.6g J", state.energy);
  if (!std::isnan(state.energy) && state.observed != state.time) line += format(state.clock ? " at %.6g" : " at %.6g s", state.observed);
  const double left = time_left(state, wall);
  if (!std::isnan(left) && state.time < state.end) line += ", " + duration(left) + " left";
  return line;
}

std::string verdict_line(const RunState& state, double wall, const std::string& outcome) {
  const std::string line =
      format("backspring: %s t=%s steps=%lld rejected=%lld newton=%lld krylov=%lld wall=%.3f", outcome.c_str(), time_number(state.time).c_str(),
             (long long)state.steps, (long long)state.rejected, (long long)state.newton, (long long)state.krylov, wall);
  return line + counted(static_cast<std::size_t>(state.warnings));
}

std::string counted(std::size_t warnings) { return warnings > 0 ? format(" warnings=%zu", warnings) : std::string(); }

bool stdout_is_terminal() {
  if (!isatty(STDOUT_FILENO)) return false;
  if (!std::getenv("OMPI_COMM_WORLD_SIZE") || !std::getenv("PMIX_RANK")) return true;
  const std::string parent = "/proc/" + std::to_string(getppid());
  std::string name;
  std::ifstream(parent + "/comm") >> name;
  if (name.find("run") == std::string::npos && name != "mpiexec") return false;  // a daemon's: not to be known
  char target[64] = "";
  const ssize_t length = readlink((parent + "/fd/1").c_str(), target, sizeof target - 1);
  const std::string file(target, length > 0 ? static_cast<std::size_t>(length) : 0);
  return file.rfind("/dev/pts/", 0) == 0 || file.rfind("/dev/tty", 0) == 0 || file == "/dev/console";
}

/// Columns a rewritten line may fill: a longer one would wrap and stay.
static std::size_t terminal_width() {
  struct winsize size;
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col - 1u : 79u;
}

static double now() { return MPI_Wtime(); }

void let_runs_print(MPI_Comm comm) { held_by<Printing>(comm).on = true; }

Progress::Progress(MPI_Comm comm, double interval) : interval_(interval), started_(now()) {
  const PetscMPIInt rank = rank_of(comm);
  prints_ = rank == 0 && held_by<Printing>(comm).on;
  terminal_ = prints_ && stdout_is_terminal();
}

double Progress::wall() const { return now() - started_; }

void Progress::header(const std::vector<std::string>& lines) const {
  if (!prints_) return;
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

void Progress::update(const RunState& state) {
  if (!prints_ || interval_ < 0) return;
  const double at = wall();
  const bool rewrite = terminal_ && interval_ > 0;
  if (interval_ > 0 && at - last_ < (rewrite ? std::min(0.1, interval_) : interval_)) return;
  last_ = at;
  std::string line = progress_line(state, at);
  if (!rewrite) {
    std::printf("%s\n", line.c_str());
  } else {
    line.resize(std::min(line.size(), terminal_width()));
    const std::size_t width = line.size();
    if (width < width_) line.append(width_ - width, ' ');  // over the remains of a longer line
    width_ = width;
    std::printf("\r%s", line.c_str());
  }
  std::fflush(stdout);
}

void Progress::break_line() {
  if (width_ > 0) {
    std::printf("\n");
    std::fflush(stdout);
  }
  width_ = 0;
}

void Progress::finish(const RunState& state, const std::string& outcome, const std::vector<std::string>& lines) {
  if (!prints_) return;
  const double at = wall();
  break_line();
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
  std::printf("%s\n", verdict_line(state, at, outcome).c_str());
  std::fflush(stdout);
}

}  // namespace bs
