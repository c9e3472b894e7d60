# Sourced by ./demo and ./check: Debian packages, environment of mpirun, build.
# Needs: $here, the project's folder. Every step says what it does; the first failure ends the script.

say() { printf '\033[1m== %s\033[0m\n' "$*"; }

# What ./demo needs, all from Debian (435 MB to download on an empty system), and with the tests (620 MB).
demo_packages="g++ cmake ninja-build pkg-config petsc-dev slepc-dev libyaml-dev libopenblas0-serial openmpi-bin catch2
python3 python3-h5py python3-numpy python3-scipy python3-matplotlib python3-tqdm python3-yaml ffmpeg"
packages="$demo_packages dpkg-dev file python3-pandas python3-meshio
pybind11-dev python3-dev python3-mpi4py python3-petsc4py mypy python3-nbconvert python3-ipykernel python3-gsd python3-vtk9 python3-ase python3-mdanalysis lammps ngspice xvfb xauth libgl1-mesa-dri clang libclang-rt-dev clang-format
python3-sphinx python3-myst-parser furo"

# install_packages [NAME ...]: what of these, by default of all packages, is missing. What a distribution does not have is left out, and said.
install_packages() {
  local missing="" known="" unknown="" p sudo=""
  for p in ${*:-$packages}; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null)" = installed ] || missing="$missing $p"
  done
  [ -z "$missing" ] && return 0
  [ "$(id -u)" = 0 ] || sudo=sudo
  $sudo apt-get update -qq
  for p in $missing; do
    if apt-cache show "$p" >/dev/null 2>&1; then known="$known $p"; else unknown="$unknown $p"; fi
  done
  [ -z "$unknown" ] || say "not in this distribution, left out:$unknown"
  [ -z "$known" ] && return 0
  say "installing:$known"
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $known >/dev/null
  rm -f "$here/build/release/build.ninja"  # CMake looks again for what it has left out
}

prepare_mpi() {
  export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
  export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe  # Open MPI 4, and from 5 on
  if [ "$(id -u)" = 0 ]; then export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; fi
}

build() {
  if [ ! -f "$here/build/release/build.ninja" ]; then
    say "configuring build/release"
    cmake --preset release -S "$here" >/dev/null
  fi
  say "building build/release/backspring"
  cmake --build "$here/build/release" "$@"
}
