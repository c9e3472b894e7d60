#!/usr/bin/env bash
# valgrind on one rank of small runs: no invalid access, no block of ours lost. Usage: valgrind.sh path/to/backspring
set -euo pipefail
program=$(readlink -f "$1")
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
command -v valgrind >/dev/null || { echo "no valgrind: apt install valgrind"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
run() {
  echo "== $*"
  valgrind --quiet --num-callers=40 --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite --error-exitcode=9 \
    --suppressions=/usr/share/openmpi/openmpi-valgrind.supp --suppressions="$here/valgrind.supp" "$program" "$@" >said 2>&1 ||
    { code=$?; cat said; exit $code; }
  tail -n 1 said
}
run -bs_lattice_type cloth -bs_lattice_size 5,5 -bs_gravity 0,0,-9.81 -bs_lattice_fixed ymax -ts_dt 0.01 -ts_max_steps 3 \
  -bs_output cloth.h5md
run -bs_lattice_file cloth.h5md -bs_gravity 0,0,-9.81 -ts_type rk -ts_dt 1e-3 -ts_max_steps 3
run -bs_model linear -bs_linear_type rc_ladder -bs_linear_size 20 -bs_linear_source "step(1)" -ts_dt 1e-6 -ts_max_time 5e-6
echo "3 passed, 0 failed, 0 skipped"
