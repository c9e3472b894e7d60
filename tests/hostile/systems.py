"""Random systems for random_options.py, each with what tells whether a run of it is right: independent of the program."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import numpy as np
import scipy.integrate
from particles import System

# What one step of these types solves: c of Y = y_n + c h g(Y), y_{n+1} as in step_error
THETA = {"beuler": (1.0, True), "cn": (0.5, True)}


def lattice_points(rng, kind):
    """Positions (N, d) of a small lattice with distance 1, and its springs by distance."""
    sizes = {"chain": (rng.integers(2, 20),), "square": tuple(rng.integers(2, 6, 2)), "cubic": tuple(rng.integers(2, 4, 3)), "pair": (2,)}[kind]
    x = np.stack(np.meshgrid(*[np.arange(n, dtype=float) for n in sizes], indexing="ij"), -1).reshape(-1, len(sizes))
    if kind == "chain" and rng.random() < 0.5:
        x = np.hstack([x, np.zeros((len(x), int(rng.integers(1, 3))))])
    far = np.linalg.norm(x[:, None] - x[None], axis=-1)
    reach = 1.5 if kind in ("square", "cubic") else 1.1
    i, j = np.nonzero(np.triu((far > 0) & (far < reach)))
    return x, np.stack([i, j], 1)


class Particles:
    """A random lattice: masses and stiffnesses over up to four powers of ten, dampers, gravity, drag, fixed particles."""

    def __init__(self, rng):
        kind = str(rng.choice(["pair", "chain", "chain", "square", "cubic"]))
        x, pairs = lattice_points(rng, kind)
        spread = rng.choice([0, 0, 1, 4])
        mass = 10 ** rng.uniform(-spread / 2, spread / 2, len(x)) * 10 ** rng.uniform(-3, 3)
        stiffness = 10 ** rng.uniform(-spread / 2, spread / 2, len(pairs)) * 10 ** rng.uniform(-2, 5)
        rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * (0 if rng.random() < 0.1 else rng.choice([1, 1, 0.9]))
        period = np.sqrt(np.median(mass) / np.median(stiffness))
        damping = rng.choice([0, 0, 0.1]) * stiffness * period
        x = x + rng.choice([0.01, 0.1]) * rng.uniform(-1, 1, x.shape)
        v = rng.choice([0, 0.1]) * rng.uniform(-1, 1, x.shape) / period
        fixed = rng.random(len(x)) < rng.choice([0, 0, 0.3])
        fixed[0] = fixed[0] and not fixed.all()
        gravity = rng.choice([0, 0.1]) * np.median(stiffness) / np.median(mass) * rng.uniform(-1, 1, x.shape[1])
        drag = rng.choice([0, 0, 0.1]) * np.median(mass) / period
        self.system = System(x, v, mass, fixed, pairs, stiffness, rest, damping, law=str(rng.choice(["hooke", "strain"])),
                             damping_law=str(rng.choice(["axial", "simple"])), gravity=gravity, drag=drag)
        s = self.system
        rates = np.linalg.eigvals(self.slope(s.state()))
        self.omega = max(float(np.abs(rates).max()), 1e-300)
        self.name = f"{kind} of {len(x)} in {x.shape[1]}-D"

    def options(self, folder):
        s = self.system
        options = dict(s.options(s.write(folder / "lattice.h5")), bs_spring_law=s.law, bs_damping_law=s.damping_law)
        if "bs_gravity" in options:
            options["bs_gravity"] = tuple(options["bs_gravity"])
        return options

    def states(self, file):
        group = file["particles/trajectory"]
        parts = [group[name + "/value"][...] for name in ("position", "velocity")]
        return np.concatenate([part.reshape(len(part), -1) for part in parts], 1)

    def start(self):
        return self.system.state()

    def rate(self, t, y):
        n = self.system.x.size
        rate = self.system.rhs(t, y)
        still = np.repeat(self.system.fixed, self.system.dim)
        rate[:n][still] = 0
        return rate

    def slope(self, y):
        """dg/dy by central differences: for scales and corrections only."""
        columns = []
        for k in range(len(y)):
            e = np.zeros(len(y))
            e[k] = 1e-6 * max(1.0, abs(y[k]))
            columns.append((self.rate(0, y + e) - self.rate(0, y - e)) / (2 * e[k]))
        return np.array(columns).T

    def size(self, change):
        """A change of the state as one number [m]: positions, and velocities over the fastest rate."""
        n = self.system.x.size
        return float(max(np.abs(change[:n]).max(), np.abs(change[n:]).max() / self.omega))


class Circuit:
    """A random linear system C x' + G x = b u(t): G diagonally dominant and unsymmetric, C diagonal."""

    def __init__(self, rng):
        n = int(rng.integers(2, 30))
        G = np.where(rng.random((n, n)) < 4 / n, rng.uniform(-1, 1, (n, n)), 0.0)
        np.fill_diagonal(G, np.abs(G).sum(1) + rng.uniform(0.1, 1, n))
        scale = 10 ** rng.uniform(-3, 3)
        self.G, self.C = scale * G, scale * np.diag(10 ** rng.uniform(-1, 1, n)) * 10 ** rng.uniform(-3, 3)
        self.b = np.where(rng.random(n) < 0.5, scale, 0.0)
        self.b[0] = scale
        self.omega = float(np.abs(np.linalg.eigvals(np.linalg.solve(self.C, self.G))).max())
        self.name = f"linear system of {n}"

    def options(self, folder):
        for name, matrix in (("G", self.G), ("C", self.C), ("B", self.b[:, None])):
            rows, columns = np.nonzero(matrix)
            lines = [f"{i + 1} {j + 1} {matrix[i, j]:.17g}" for i, j in zip(rows, columns)]
            (folder / f"{name}.mtx").write_text("%%MatrixMarket matrix coordinate real general\n"
                                                f"{matrix.shape[0]} {matrix.shape[1]} {len(lines)}\n" + "\n".join(lines) + "\n")
        return {"bs_model": "linear", "bs_linear_G": "G.mtx", "bs_linear_C": "C.mtx", "bs_linear_B": "B.mtx", "bs_linear_source": "1"}

    def states(self, file):
        return file["states/value"][...]

    def start(self):
        return np.zeros(len(self.b))

    def rate(self, t, y):
        return np.linalg.solve(self.C, self.b - self.G @ y)

    def slope(self, y):
        return -np.linalg.solve(self.C, self.G)

    def size(self, change):
        return float(np.abs(change).max())


def exact(system, t):
    """States at the times t, to 1e-10."""
    if isinstance(system, Circuit):
        rest = np.linalg.solve(system.G, system.b)
        A = system.slope(None)
        return np.array([rest - scipy.linalg.expm(A * (time - t[0])) @ rest for time in t])
    found = scipy.integrate.solve_ivp(system.rate, (t[0], t[-1]), system.start(), "DOP853", t, rtol=1e-11, atol=1e-13)
    return found.y.T


def step_error(system, before, after, h, theta, endpoint):
    """How far `after` is from a solution of one theta step, as Newton's correction at it, over what the step changed."""
    if endpoint:
        miss = after - before - h * (theta * system.rate(0, after) + (1 - theta) * system.rate(0, before))
        at = after
    else:
        at = before + theta * (after - before)
        miss = after - before - h * system.rate(0, at)
    correction = np.linalg.solve(np.eye(len(at)) - theta * h * system.slope(at), miss)
    return system.size(correction) / max(system.size(after - before), 1e-9 * system.size(before), 1e-300)
