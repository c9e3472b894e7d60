"""Adjoint sensitivities of the Python package against central differences of equilibria that SciPy finds (tests/bench/beside_scipy.py); prints JSON.

    PYTHONPATH=build/release/python /usr/bin/python3 src/package/paper/adjoint.py
"""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[3] / "tests" / "bench"))
import backspring as bs
import numpy as np
from beside_scipy import ByScipy, net_of

SIDE, ROWS, STEP = 12, 12, 1e-4


def main():
    """J: the mean height of the free particles of a stretched net under its weight."""
    x, pairs, k, L, held = net_of(SIDE)
    peer = ByScipy(x, pairs, L, held)
    slope = np.zeros_like(x)
    slope[~held, 1] = 1 / (~held).sum()
    net = bs.Lattice(x, pairs, stiffness=k, rest_length=L, mass=1.0, fixed=np.flatnonzero(held), groups={"free": np.flatnonzero(~held)})
    with bs.Statics(net, loads={"free": (0, -peer.weight)}, snes_rtol=1e-13) as solver:
        solver.solve()
        found = solver.sensitivities(slope)["stiffness"]
    inner = np.flatnonzero(np.abs(found) > 1e-3 * np.abs(found).max())
    off = 0.0
    for row in np.random.default_rng(2).choice(inner, ROWS, replace=False):
        values = []
        for sign in (1, -1):
            changed = k.copy()
            changed[row] *= 1 + sign * STEP
            values.append((slope * peer.newton(changed).reshape(slope.shape)).sum())
        off = max(off, abs((values[0] - values[1]) / (2 * STEP * k[row]) - found[row]) / np.abs(found).max())
    print(json.dumps({"adjoint_springs": len(pairs), "adjoint_rows": ROWS, "adjoint_off": off}))


if __name__ == "__main__":
    main()
