#include "cli/blas_memory.hpp"

#include <petscblaslapack.h>
#include <sys/time.h>

#include <csignal>
#include <vector>

#include "cli/crash.hpp"

namespace bs {

namespace {

constexpr int SECONDS = 3;  // of processor time, for what takes a millisecond

extern "C" void on_no_memory(int) {
  end_with_line(
      "no memory for the work space of BLAS (128 MB in Debian's OpenBLAS): raise the memory limit (ulimit -d, "
      "ulimit -v, that of the job), or run fewer ranks on this machine",
      Exit::input);
}

/// A Cholesky factorisation too large for the kernels that need no work space.
PetscErrorCode first_call() {
  constexpr int N = 96;
  std::vector<PetscScalar> identity(static_cast<std::size_t>(N) * N, 0.0);
  PetscBLASInt n = N, info = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < N; ++k) identity[k * (N + 1)] = 1.0;
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &n, identity.data(), &n, &info));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode reserve_blas_memory() {
  PetscFunctionBegin;
  struct sigaction watch = {}, before = {};
  watch.sa_handler = on_no_memory;
  const itimerval limit = {{0, 0}, {SECONDS, 0}}, none = {};
  itimerval other = {};
  (void)sigaction(SIGPROF, &watch, &before);
  (void)setitimer(ITIMER_PROF, &limit, &other);
  PetscCall(first_call());
  (void)setitimer(ITIMER_PROF, &none, nullptr);
  (void)sigaction(SIGPROF, &before, nullptr);
  if (other.it_value.tv_sec || other.it_value.tv_usec) (void)setitimer(ITIMER_PROF, &other, nullptr);  // a profiler's
  PetscFunctionReturn(0);
}

}  // namespace bs
