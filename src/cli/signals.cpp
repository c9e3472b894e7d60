#include "cli/signals.hpp"
#include <unistd.h>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include "base/signals.hpp"

namespace bs {
namespace {

volatile std::sig_atomic_t ending = 0, asked = 0;
volatile std::sig_atomic_t launched = 0;  // by mpirun or its like, which passes signals on
volatile pid_t first_sender = 0;
timespec first_at = {};

double seconds_since(const timespec& then) {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec - then.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec - then.tv_nsec);
}

/// Whether it is the first signal again: sent to the process and to its group at once, as timeout(1) does, or passed on by a
/// launcher to a rank that has had it already.
bool same_order(pid_t sender) {
  constexpr double AT_ONCE = 0.2;  // [s]
  const pid_t parent = getppid();
  return seconds_since(first_at) < AT_ONCE || (launched && sender == parent && first_sender != parent);
}

extern "C" void on_ending(int number, siginfo_t* info, void*) {
  if (!ending) {
    first_sender = info->si_pid;
    clock_gettime(CLOCK_MONOTONIC, &first_at);
    ending = number;
  } else if (!same_order(info->si_pid)) {
    static const char said[] = "backspring: a second signal: the run ends at once, without the last frame and checkpoint\n";
    (void)!write(STDERR_FILENO, said, sizeof said - 1);
    _exit(128 + number);
  }
}

extern "C" void on_asking(int) { asked = 1; }

}  // namespace

void catch_signals(MPI_Comm comm) {
  launched = std::getenv("OMPI_COMM_WORLD_RANK") || std::getenv("PMIX_RANK") || std::getenv("PMI_RANK");
  struct sigaction action = {};
  action.sa_flags = SA_RESTART | SA_SIGINFO;
  action.sa_sigaction = on_ending;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_flags = SA_RESTART;
  action.sa_handler = on_asking;
  sigaction(SIGUSR1, &action, nullptr);
  set_signals(comm, {[] { return static_cast<int>(ending); },
                     [] {
                       const bool come = asked != 0;
                       asked = 0;
                       return come;
                     }});
}

}  // namespace bs
