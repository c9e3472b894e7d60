# What the program is linked with: MPI, PETSc, SLEPc, HDF5, libyaml, LAPACK. What is missing is told with the packages that bring it.
#   -DPETSC_DIR=DIR [-DPETSC_ARCH=ARCH] -DSLEPC_DIR=DIR   a PETSc and a SLEPc built by hand (or the environment's variables)
#   -DHDF5_ROOT=DIR                                       an HDF5 that the system does not know; the one that PETSc was built with
#   -DBS_PETSC_MODULE=PETSc64 -DBS_SLEPC_MODULE=SLEPc64   Debian's with 64-bit indices
set(BS_OLDEST 3.18)
set(BS_PETSC_MODULE "PETSc" CACHE STRING "pkg-config module of the PETSc to use (PETSc64: 64-bit indices)")
set(BS_SLEPC_MODULE "SLEPc" CACHE STRING "pkg-config module of the SLEPc that goes with it (SLEPc64)")
foreach(name PETSC_DIR PETSC_ARCH SLEPC_DIR)
  set(${name} "$ENV{${name}}" CACHE STRING "of a PETSc or SLEPc built by hand; empty: the system's")
endforeach()

# bs_missing(WHAT DEBIAN FEDORA HOMEBREW [OTHERWISE]): ends with what to install.
function(bs_missing what debian fedora homebrew)
  set(text "${what}\n  Debian, Ubuntu:  apt install ${debian}\n  Fedora:          ${fedora}\n  macOS:           brew install ${homebrew}\n")
  foreach(otherwise ${ARGN})
    string(APPEND text "  ${otherwise}\n")
  endforeach()
  message(FATAL_ERROR "${text}")
endfunction()

# Folders of .pc files: of an arch, of an installed prefix
foreach(folder "${PETSC_DIR}/${PETSC_ARCH}" "${PETSC_DIR}" "${SLEPC_DIR}/${PETSC_ARCH}" "${SLEPC_DIR}")
  if(IS_DIRECTORY "${folder}/lib/pkgconfig" AND NOT folder MATCHES "^/?$")
    set(ENV{PKG_CONFIG_PATH} "${folder}/lib/pkgconfig:$ENV{PKG_CONFIG_PATH}")
    list(APPEND BS_PKG_CONFIG_PATH ${folder}/lib/pkgconfig)
  elseif(folder STREQUAL PETSC_DIR AND PETSC_DIR AND NOT IS_DIRECTORY "${PETSC_DIR}/${PETSC_ARCH}/lib/pkgconfig")
    message(FATAL_ERROR "-DPETSC_DIR=${PETSC_DIR} -DPETSC_ARCH=${PETSC_ARCH}: no PETSc is built there (no lib/pkgconfig/PETSc.pc): "
                        "give the folder and the arch that PETSc's configure has named")
  elseif(folder STREQUAL SLEPC_DIR AND SLEPC_DIR AND NOT IS_DIRECTORY "${SLEPC_DIR}/${PETSC_ARCH}/lib/pkgconfig")
    message(FATAL_ERROR "-DSLEPC_DIR=${SLEPC_DIR}: no SLEPc for -DPETSC_ARCH=${PETSC_ARCH} is built there (no lib/pkgconfig/slepc.pc): "
                        "build it with this PETSC_DIR and PETSC_ARCH")
  endif()
endforeach()

find_package(MPI COMPONENTS CXX)
if(NOT MPI_CXX_FOUND)
  bs_missing("MPI was not found: no working mpicxx." "libopenmpi-dev openmpi-bin" "dnf install openmpi-devel && module load mpi" "open-mpi"
             "elsewhere:       put mpicxx on PATH, or give -DMPI_CXX_COMPILER=")
endif()
find_package(PkgConfig)
if(NOT PKG_CONFIG_FOUND)
  bs_missing("pkg-config was not found, which tells where PETSc is." "pkg-config" "dnf install pkgconf-pkg-config" "pkgconf")
endif()

pkg_check_modules(PETSC IMPORTED_TARGET ${BS_PETSC_MODULE})
if(NOT PETSC_FOUND)
  bs_missing("PETSc ${BS_OLDEST} or newer was not found: pkg-config knows no module ${BS_PETSC_MODULE}." "petsc-dev (64-bit indices: libpetsc64-real-dev)"
             "dnf install petsc-openmpi-devel && module load mpi" "petsc" "built by hand:   -DPETSC_DIR=DIR -DPETSC_ARCH=ARCH")
elseif(PETSC_VERSION VERSION_LESS BS_OLDEST)
  message(FATAL_ERROR "PETSc ${PETSC_VERSION} in ${PETSC_PREFIX} is too old: ${BS_OLDEST} or newer is needed (-DPETSC_DIR=DIR -DPETSC_ARCH=ARCH)")
endif()
pkg_check_modules(SLEPC IMPORTED_TARGET ${BS_SLEPC_MODULE})
if(NOT SLEPC_FOUND)
  bs_missing("SLEPc ${BS_OLDEST} or newer was not found: pkg-config knows no module ${BS_SLEPC_MODULE}." "slepc-dev (64-bit indices: libslepc64-real-dev)"
             "build it from source with the PETSc above" "slepc" "built by hand:   -DSLEPC_DIR=DIR, with the same PETSC_DIR and PETSC_ARCH")
endif()
string(REGEX MATCH "^[0-9]+\\.[0-9]+" bs_petsc_release "${PETSC_VERSION}")
string(REGEX MATCH "^[0-9]+\\.[0-9]+" bs_slepc_release "${SLEPC_VERSION}")
if(NOT bs_petsc_release STREQUAL bs_slepc_release)
  message(FATAL_ERROR "SLEPc ${SLEPC_VERSION} in ${SLEPC_PREFIX} does not go with PETSc ${PETSC_VERSION} in ${PETSC_PREFIX}: "
                      "give the SLEPc that was built with that PETSc (-DSLEPC_DIR=DIR)")
endif()

# What PETSc was configured with, and whether SLEPc was built with this one: Debian has PETScs of 32- and 64-bit indices of one version beside each other
find_file(BS_PETSCCONF petscconf.h PATHS ${PETSC_INCLUDE_DIRS} NO_DEFAULT_PATH NO_CACHE)
find_file(bs_slepc_petscconf petscconf.h PATHS ${SLEPC_INCLUDE_DIRS} NO_DEFAULT_PATH NO_CACHE)
if(bs_slepc_petscconf AND NOT bs_slepc_petscconf STREQUAL BS_PETSCCONF)
  message(FATAL_ERROR "SLEPc ${SLEPC_VERSION} (${BS_SLEPC_MODULE}) was built with another PETSc than ${BS_PETSC_MODULE} in ${PETSC_PREFIX}: give the one that goes with it "
                      "(-DBS_PETSC_MODULE=PETSc64 -DBS_SLEPC_MODULE=SLEPc64: 64-bit indices; -DSLEPC_DIR=DIR: built by hand)")
endif()
set(bs_petscconf "")
if(BS_PETSCCONF)
  file(STRINGS ${BS_PETSCCONF} bs_petscconf REGEX "PETSC_(USE_COMPLEX|USE_REAL_DOUBLE) ")
endif()
if(bs_petscconf MATCHES "USE_COMPLEX" OR NOT bs_petscconf MATCHES "USE_REAL_DOUBLE")
  message(FATAL_ERROR "the PETSc in ${PETSC_PREFIX} does not count in real numbers of double precision: configure one "
                      "--with-scalar-type=real --with-precision=double, and give it as -DPETSC_DIR=DIR -DPETSC_ARCH=ARCH")
endif()

# Debian has an HDF5 for each MPI beside the serial one, and PETSc.pc lacks the path of hdf5.h.
if(NOT HDF5_ROOT AND NOT DEFINED ENV{HDF5_ROOT})
  pkg_check_modules(HDF5 QUIET IMPORTED_TARGET hdf5-openmpi)
endif()
if(TARGET PkgConfig::HDF5)
  set(BS_HDF5 PkgConfig::HDF5)
else()
  set(HDF5_PREFER_PARALLEL ON)
  find_package(HDF5 COMPONENTS C)
  if(NOT HDF5_FOUND OR NOT HDF5_IS_PARALLEL)
    bs_missing("an HDF5 for MPI was not found." "libhdf5-openmpi-dev" "dnf install hdf5-openmpi-devel && module load mpi" "hdf5-mpi"
               "built by hand:   -DHDF5_ROOT=DIR (configured --enable-parallel)")
  endif()
  set(BS_HDF5 hdf5::hdf5)
endif()

pkg_check_modules(YAML IMPORTED_TARGET yaml-0.1)
if(NOT YAML_FOUND)
  bs_missing("libyaml was not found." "libyaml-dev" "dnf install libyaml-devel" "libyaml")
endif()
# PETSc needs LAPACK, but its pkg-config file does not link it.
find_package(LAPACK)
if(NOT LAPACK_FOUND)
  bs_missing("LAPACK was not found." "liblapack-dev libopenblas0-serial" "dnf install lapack-devel" "openblas" "elsewhere:       -DBLA_VENDOR=NAME, see CMake's FindLAPACK")
endif()

# Together: PETSc's headers refuse another MPI than its own.
if(NOT BS_LIBRARIES_AGREE)
  file(WRITE ${CMAKE_BINARY_DIR}/agree.cpp "#include <hdf5.h>\n#include <petscts.h>\n#include <slepceps.h>\n#include <H5FDmpio.h>\n"
       "int main(int argc, char** argv) {\n  return SlepcInitialize(&argc, &argv, nullptr, nullptr) || H5open() < 0;\n}\n")
  try_compile(BS_LIBRARIES_AGREE ${CMAKE_BINARY_DIR}/agree SOURCES ${CMAKE_BINARY_DIR}/agree.cpp
              LINK_LIBRARIES PkgConfig::SLEPC PkgConfig::PETSC ${BS_HDF5} MPI::MPI_CXX LAPACK::LAPACK OUTPUT_VARIABLE bs_agree CXX_STANDARD 17)
  if(NOT BS_LIBRARIES_AGREE)
    unset(BS_LIBRARIES_AGREE CACHE)
    message(FATAL_ERROR "a program with MPI ${MPI_CXX_VERSION} (${MPI_CXX_COMPILER}), PETSc (${PETSC_PREFIX}), SLEPc (${SLEPC_PREFIX}) and HDF5 cannot be compiled: they "
                        "must be of one MPI; give MPI by -DMPI_CXX_COMPILER=, PETSc by -DPETSC_DIR=, HDF5 by -DHDF5_ROOT=. The compiler says:\n${bs_agree}")
  endif()
endif()
message(STATUS "PETSc ${PETSC_VERSION}, SLEPc ${SLEPC_VERSION}")
