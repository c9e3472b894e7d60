#!/usr/bin/env python3
"""The speed of a crack through a strip of a triangular lattice with Kelvin-viscous springs, beside the exact solution for a crack that runs steadily.

The strip: unit masses, unit springs of length 1 with axial dampers eta, 2 N rows that move between two that are held 2 Delta further apart than at rest. Springs
across the middle break at the elongation eps_c. Far ahead of the crack each of them is stretched by U = sqrt(3) Delta/(2 N + 1), and Griffith's load is the one at
which the strip holds the energy of the two springs that break a spacing: Delta_G = eps_c sqrt(2 N + 1)/sqrt(3). The solution is L. I. Slepyan's, by Wiener and Hopf's
method; for this lattice see L. Pechenik, H. Levine, D. A. Kessler, Steady-state mode I cracks in a viscoelastic triangular lattice (2000, arXiv cond-mat/0002314)."""
import numpy as np
from harness import run_parts, write_lattice
import h5py
from scipy.optimize import brentq

HALF = 0.75**0.5  # distance of two rows
ALONG, ACROSS = np.array([1.0, 0.0]), (np.array([-0.5, HALF]), np.array([0.5, HALF]))
EPS_C = 1e-5  # so small that the lattice stays linear


def transfer(omega, v, eta, N):
    """Q(omega) = 1 + (1 - i omega eta) a.G a*, with sigma+ + Q sigma- = drive. sigma: U + eta U' of a spring across the middle, whose upper end moves as u(t), the lower
    one as its mirror image half a spacing further, tau = 1/(2v) later: U = a.u in Fourier space with e^(i omega t), a = (-(1 - e)/2, sqrt(3)(1 + e)/2), e = e^(i omega tau).
    G: compliance of the upper rows, u of row 0 by a force on it, where every row moves as u(t - x/v); by elimination from the row that is held."""
    outer = lambda e: np.outer(e, e)
    q, k = omega / v, 1 - 1j * omega * eta
    row = -omega**2 * np.eye(2) + 2 * k * (1 - np.cos(q)) * outer(ALONG)
    side = k * (outer(ACROSS[0]) + outer(ACROSS[1]))
    up = -k * (outer(ACROSS[1]) * np.exp(0.5j * q) + outer(ACROSS[0]) * np.exp(-0.5j * q))
    down = -k * (outer(ACROSS[1]) * np.exp(-0.5j * q) + outer(ACROSS[0]) * np.exp(0.5j * q))
    D = row + 2 * side
    for j in range(N - 2, -1, -1):
        D = row + (2 if j > 0 else 1) * side - up @ np.linalg.solve(D, down)
    e = np.exp(0.5j * omega / v)
    a = np.array([-(1 - e) / 2, HALF * (1 + e)])
    return 1 + k * (a @ np.linalg.solve(D, a.conj()))


def driving(v, eta, N, points=3000):
    """Delta/Delta_G at which a crack runs at v. With Q = Q+ Q-, and U(0) = eps_c from sigma- at omega = -i/eta: Delta/Delta_G = sqrt(Q+(0)/Q-(0)) Q-(-i/eta), so that, b = 1/eta,
    ln = 1/pi int_0^inf [b^2 arg Q/(w (w^2 + b^2)) + b ln|Q|/(w^2 + b^2)] dw."""
    b, w = 1 / eta, np.geomspace(1e-5, 4e3, points)
    Q = np.array([transfer(one, v, eta, N) for one in w])
    whole = (b * b * np.unwrap(np.angle(Q)) / w + b * np.log(abs(Q))) / (w * w + b * b) * w  # d ln w
    below = np.log(2 * N + 1) / b * w[0]
    return np.exp((np.sum(0.5 * (whole[1:] + whole[:-1]) * np.diff(np.log(w))) + below) / np.pi)


def strip(N, n, load, cut):
    """(positions, arguments of write_lattice, place of each spring's middle along the strip): uniformly strained by `load` Griffith loads, cut up to x = `cut`."""
    rows = np.arange(-N - 1, N + 1)
    x = np.array([(i + 0.5 * (j % 2), (j + 0.5) * HALF) for j in rows for i in range(n)])
    row = np.repeat(rows, n)
    at = lambda i, j: (j + N + 1) * n + i
    pairs = [(at(i, j), at(i + 1, j)) for j in rows for i in range(n - 1)]
    pairs += [(at(i, j), at(k, j + 1)) for j in rows[:-1] for i in range(n) for k in ((i, i - 1) if j % 2 == 0 else (i, i + 1)) if 0 <= k < n]
    pairs = np.array(pairs)
    middle = x[pairs, 0].mean(axis=1)
    crosses = (row[pairs[:, 0]] == -1) & (row[pairs[:, 1]] == 0)
    delta = load * EPS_C * np.sqrt(2 * N + 1) / np.sqrt(3)
    x[:, 1] *= 1 + delta / ((N + 0.5) * HALF)
    columns = {"critical_strain": np.where(crosses, EPS_C, np.inf), "broken": (crosses & (middle < cut)).astype(float)}
    return x, {"fixed": (row == N) | (row == -N - 1), "pairs": pairs, "columns": columns}, middle


def time_of_a_break(checks, folder, N, eta, load, h, n=90, cut=20, end=260.0):
    """Time from one break to the next, far from both ends of the strip; infinite where the crack does not get there."""
    x, springs, middle = strip(N, n, load, cut)
    write_lattice(folder / "l.h5", x, 1.0, stiffness=1.0, rest_length=1.0, damping=eta, damping_law="axial", **springs)
    done = checks.run({"bs_lattice_file": str(folder / "l.h5"), "ts_type": "rk", "ts_rk_type": "2b", "ts_adapt_type": "none", "ts_dt": h, "ts_max_time": end,
                       "bs_output": "c.h5md", "bs_output_interval": end, "bs_advise": False}, ranks=checks.ranks, keep=("c.h5md",))
    (folder / "c.h5md").write_bytes(done.files["c.h5md"])
    with h5py.File(folder / "c.h5md") as f:
        if "events" not in f:
            return np.inf
        when, where = f["events/broken/time"][...], middle[f["events/broken/spring"][...]]
    steady = (where > cut + 30) & (where < n - 25)
    return 0.5 / np.polyfit(when[steady], where[steady], 1)[0] if np.count_nonzero(steady) > 20 else np.inf


def speeds(checks, folder):
    """A break is seen at the end of a step, so that the time between two is exact to one step."""
    for N, eta, load, h in ((2, 0.5, 1.53, 0.02), (2, 0.5, 1.6, 0.02), (2, 0.5, 1.6, 0.005), (2, 0.5, 1.9, 0.02), (4, 1.0, 1.8, 0.02)):
        exact = brentq(lambda v: driving(v, eta, N) - load, 0.25, 0.7, xtol=1e-6)
        found = time_of_a_break(checks, folder, N, eta, load, h)
        checks.near(f"{2 * N} rows, eta = {eta}, {load} Griffith loads, h = {h}: 1/(2v), v = {0.5 / found:.4f}", found, 0.5 / exact, 1.05 * h)


if __name__ == "__main__":
    run_parts(__doc__, (speeds,))
