// backspring: implicit time stepping of mass-spring systems on PETSc.
#include <dlfcn.h>
#include <hdf5.h>
#include <petscts.h>
#include <csignal>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/find_file.hpp"
#include "base/option_aliases.hpp"
#include "base/option_names.hpp"
#include "base/version.hpp"
#include "cli/command_line.hpp"
#include "cli/crash.hpp"
#include "cli/voice.hpp"
#include "output/progress.hpp"
#include "session/inside.hpp"
#include "session/tasks.hpp"

namespace {

const char HELP[] =
    "backspring: implicit time integration of mass-spring systems M x'' = f(t, x, x') with PETSc\n"
    "  mpirun -n 2 backspring -options_file options/problems/cloth.yaml [any -bs_ -ts_ -snes_ -ksp_ -pc_ option]\n"
    "An option and its value are separated by a blank; components of a value by commas: -bs_gravity 0,-9.81\n"
    "Exit codes: 0 done, 2 bad input or options, 3 solve failed, 4 output failed, 130/143 stopped by a signal\n\n";

/// -help lists every option, also of the tasks and models that this run is not of.
PetscErrorCode collect_all_help() {
  PetscBool help = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-help", &help));
  if (!help) PetscFunctionReturn(0);
  bs::collect_help_of_others();
  MPI_Comm unheard = bs::own_communicator(PETSC_COMM_WORLD, [](const std::string&) {});  // no run has what is warned of there
  for (const bs::Variant& variant : bs::variants()) PetscCall(bs::rehearse(unheard, variant));
  PetscCallMPI(MPI_Comm_free(&unheard));
  PetscFunctionReturn(0);
}

bool asks_version(int argc, char** argv) {
  for (int k = 1; k < argc; ++k)
    if (std::strcmp(argv[k], "-bs_version") == 0) return true;
  return false;
}

std::string fault_of_words(const std::string& where, const std::vector<std::string>& words) {
  const std::string form = bs::fault_of_form(words);
  if (!form.empty()) return where + form;
  const std::vector<std::string> stray = bs::stray_words(words);
  if (stray.empty()) return {};
  return where + "'" + stray[0] + "' is neither an option nor the value of one: options begin with a dash, lists have no blanks, like 0,-9.81";
}

/// Whether rank 0 found the command line or an option file wrong, and said so.
bool refused(int argc, char** argv) {
  int wrong = 0;
  const PetscMPIInt rank = bs::rank_of(MPI_COMM_WORLD);
  std::vector<std::string> folders;
  std::string fault = bs::find_option_files(argc, argv, &folders);
  bs::set_option_folders(MPI_COMM_WORLD, folders);
  if (rank == 0) {
    if (fault.empty()) fault = bs::fault_of_option_files(argc, argv);
    if (fault.empty()) fault = fault_of_words("", {argv + 1, argv + argc});
    if (fault.empty()) fault = fault_of_words("PETSC_OPTIONS: ", bs::words_of_environment());
    if (!fault.empty()) bs::print_line("error", fault);
    wrong = !fault.empty();
  }
  MPI_Bcast(&wrong, 1, MPI_INT, 0, MPI_COMM_WORLD);
  return wrong != 0;
}

PetscErrorCode initialize(int argc, char** argv) {
  if (const PetscErrorCode status = bs::start_petsc({argv, argv + argc}, HELP)) return status;
  PetscFunctionBegin;
  PetscCall(bs::unify_option_names(PETSC_COMM_WORLD, {argv + 1, argv + argc}));
  PetscFunctionReturn(0);
}

/// Handlers of errors, crashes and signals around the program; the exit code.
int watched_run() {
  int exit_code = 0;
  PetscBool trace = PETSC_FALSE;
  PetscErrorCode status = PetscOptionsGetBool(nullptr, nullptr, "-bs_trace", &trace, nullptr);
  if (!status && trace) status = bs::trace_petsc_errors(MPI_COMM_WORLD);
  if (!trace) H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  if (!status) status = bs::install_crash_handler(MPI_COMM_WORLD, trace);
  bs::catch_signals(MPI_COMM_WORLD);
  bs::let_runs_print(MPI_COMM_WORLD);
  if (!status) status = bs::reserve_blas_memory();
  // a reader that hangs up (| head) is no reason for a stack trace
  std::signal(SIGPIPE, SIG_DFL);
  if (!status) status = bs::Session::perform(PETSC_COMM_WORLD, &exit_code);
  if (!status) status = collect_all_help();
  bs::print_help();
  const int failed = bs::exit_code_of(MPI_COMM_WORLD, status);
  if (trace) (void)PetscPopErrorHandler();
  return failed ? failed : exit_code;
}

int run_petsc(int argc, char** argv) {
  bs::print_messages_of(MPI_COMM_WORLD);
  bs::collect_help(argc, argv);
  // never taken back: PETSc would free by another allocator what it has allocated before its start
  (void)new bs::PetscErrors(MPI_COMM_WORLD);
  if (initialize(argc, argv)) return static_cast<int>(bs::last_error(MPI_COMM_WORLD).exit);
  const int code = watched_run();
  if (bs::end_petsc() && !code) return static_cast<int>(bs::Exit::io);
  return code;
}

/// Open MPI keeps freed memory from going back to the system, for networks that register it: a lattice's set-up would then
/// count for the whole run.
void return_freed_memory() {
#ifdef __GLIBC__
  constexpr int LARGE = 1 << 24;
  mallopt(M_MMAP_MAX, 1 << 16);
  mallopt(M_MMAP_THRESHOLD, LARGE);
  mallopt(M_TRIM_THRESHOLD, 2 * LARGE);
#endif
}

/// Calls function(value) of a library that may be missing.
void call_if_there(const char* function, int value) {
  using Setter = void (*)(int);
  if (const auto set = reinterpret_cast<Setter>(dlsym(RTLD_DEFAULT, function))) set(value);
}

/// One thread a rank, unless the environment asks for more. OpenBLAS would start as many as there are cores, on every rank, each with a buffer of its
/// own; CHOLMOD asks OpenMP for four whatever OMP_NUM_THREADS says, which makes the coarse grid's factors half as slow again.
void one_thread_a_rank() {
  const char* threads = std::getenv("OMP_NUM_THREADS");
  if (!threads && !std::getenv("OPENBLAS_NUM_THREADS")) call_if_there("openblas_set_num_threads", 1);
  if (!threads || !std::strcmp(threads, "1")) call_if_there("omp_set_max_active_levels", 0);  // parallel regions run on one thread
}

}  // namespace

int main(int argc, char** argv) {
  bs::translate_common_flags(argc, argv);
  bs::translate_old_and_new_names(argc, argv);
  // Open MPI's shared file pointers, which nothing here uses, are tried whenever a file is opened; this kind of them
  // overflows its buffer where the name has more than some 240 characters
  setenv("OMPI_MCA_sharedfp", "^lockedfile", 0);
  // PTScotch's threads make partitions differ from run to run
  setenv("SCOTCH_PTHREAD_NUMBER", "1", 0);
  if (asks_version(argc, argv)) {
    std::printf("backspring %s (PETSc %d.%d.%d%s)\n", bs::version(), PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR,
                sizeof(PetscInt) == 8 ? ", 64-bit indices" : "");
    return 0;
  }
  int provided = 0;
  if (MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided)) return static_cast<int>(bs::Exit::input);
  return_freed_memory();
  one_thread_a_rank();
  const int code = refused(argc, argv) ? static_cast<int>(bs::Exit::input) : run_petsc(argc, argv);
  bs::drop_context(MPI_COMM_WORLD);
  MPI_Finalize();
  bs::expect_exit();
  return code;
}
