// What -help prints: the program's own options first, then those of PETSc under a heading of their own.
#pragma once

namespace bs {

/// Local. Replaces --help and -h by -help, and --version by -bs_version, in the words of the command line.
void translate_common_flags(int argc, char** argv);

/// Local. Where the command line has -help, all that PETSc prints is collected from now on; before PetscInitialize.
void collect_help(int argc, const char* const* argv);

/// Local. What is collected from now on is of runs that -help makes of other tasks and models: only the program's own options that were not listed
/// before are taken of it.
void collect_help_of_others();

/// Local. Prints what was collected on this rank, the program's own sections first.
void print_help();

}  // namespace bs
