#include "solve/signals.hpp"
#include <csignal>

namespace bs {
namespace {

volatile std::sig_atomic_t ending = 0, asked = 0;
extern "C" void on_ending(int number) { ending = number; }
extern "C" void on_asking(int) { asked = 1; }

}  // namespace

void catch_signals() {
  struct sigaction action = {};
  action.sa_flags = SA_RESTART;
  action.sa_handler = on_ending;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_handler = on_asking;
  sigaction(SIGUSR1, &action, nullptr);
}

int ending_signal() { return ending; }

bool take_checkpoint_signal() {
  const bool come = asked != 0;
  asked = 0;
  return come;
}

}  // namespace bs
