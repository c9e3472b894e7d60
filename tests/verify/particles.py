"""Particle systems in plain NumPy, independent of the program: forces, energies, and the reader of a case folder
(particles.csv, springs.csv, anchors.csv, params.json)."""
import json
import pathlib

import numpy as np

from harness import read_table, write_lattice


class System:
    """Positions and velocities are (N, d). Fixed particles take no force.

    Spring of d = x_i - x_j, w = v_i - v_j, u = d/|d| on i: strain -K (|d|/L - 1) u, hooke -k (|d| - L) u, and
    -K d where L = 0; damping axial -D (u.w) u or simple -D w. Anchors: the same against a point at rest.
    """

    def __init__(self, x, v, m, fixed=None, pairs=(), stiffness=(), rest=(), damping=(), anchors=None, law="strain",
                 damping_law="axial", gravity=None, drag=0.0, central=None):
        self.x, self.m = np.array(x, float), np.array(m, float)
        self.n, self.dim = self.x.shape
        self.fixed = np.zeros(self.n, bool) if fixed is None else np.array(fixed, bool)
        self.v = np.where(self.fixed[:, None], 0.0, np.array(v, float))
        self.pairs = np.array(pairs, int).reshape(-1, 2)
        self.stiffness, self.rest, self.damping = (np.array(a, float) for a in (stiffness, rest, damping))
        self.anchors = anchors
        self.law, self.damping_law = law, damping_law
        self.gravity = np.zeros(self.dim) if gravity is None else np.array(gravity, float)
        self.drag, self.central = drag, central  # central: (G, M0, x0) or None
        self.extra_force = None                  # f(x, v) -> (N, d), added to the rest
        self.motion = None                       # t -> displacement and velocity (d) of all anchor points

    def _pull(self, d, w, k, L, D):
        """Force on the first end and elastic energy of springs d (M, d)."""
        l = np.sqrt((d * d).sum(1))
        safe = np.where(l > 0, l, 1.0)
        u, zero = d / safe[:, None], L == 0
        Ls = np.where(zero, 1.0, L)
        if self.law == "strain":
            size, energy = k * (l / Ls - 1), k * Ls / 2 * (l / Ls - 1) ** 2
        else:
            size, energy = k * (l - L), k / 2 * (l - L) ** 2
        size, energy = np.where(zero, k * l, size), np.where(zero, k * l * l / 2, energy)
        damp = D[:, None] * (w if self.damping_law == "simple" else (u * w).sum(1)[:, None] * u)
        return -size[:, None] * u - damp, energy

    def _springs(self, x, v):
        i, j = self.pairs.T
        return self._pull(x[i] - x[j], v[i] - v[j], self.stiffness, self.rest, self.damping)

    def _anchors(self, x, v, t=0.0):
        a = self.anchors
        shift, rate = self.motion(t) if self.motion else (0.0, 0.0)
        return self._pull(x[a["particle"]] - a["point"] - shift, v[a["particle"]] - rate, a["stiffness"], a["rest_length"],
                          a["damping"])

    def force(self, x, v, everywhere=False, t=0.0):
        """(N, d); zero on fixed particles unless `everywhere`."""
        f = self.m[:, None] * self.gravity - self.drag * v
        if self.central:
            G, M0, x0 = self.central
            r = x - x0
            f = f - G * M0 * (self.m / (r * r).sum(1) ** 1.5)[:, None] * r
        if len(self.pairs):
            pull = self._springs(x, v)[0]
            np.add.at(f, self.pairs[:, 0], pull)
            np.add.at(f, self.pairs[:, 1], -pull)
        if self.anchors:
            np.add.at(f, self.anchors["particle"], self._anchors(x, v, t)[0])
        if self.extra_force:
            f = f + self.extra_force(x, v)
        return f if everywhere else np.where(self.fixed[:, None], 0.0, f)

    def acceleration(self, x, v, t=0.0):
        return self.force(x, v, t=t) / self.m[:, None]

    def potential(self, x):
        free, v = ~self.fixed, np.zeros_like(x)
        e = -(self.m[free, None] * self.gravity * x[free]).sum()
        if self.central:
            G, M0, x0 = self.central
            e -= (G * M0 * self.m[free] / np.sqrt(((x[free] - x0) ** 2).sum(1))).sum()
        e += self._springs(x, v)[1].sum() if len(self.pairs) else 0.0
        return e + (self._anchors(x, v)[1].sum() if self.anchors else 0.0)

    def kinetic(self, v):
        return (self.m[:, None] * v * v)[~self.fixed].sum() / 2

    def rhs(self, t, y):
        """y = (x, v) flattened; for SciPy's integrators."""
        x, v = y.reshape(2, self.n, self.dim)
        return np.concatenate([v.ravel(), self.acceleration(x, v, t).ravel()])

    def state(self):
        return np.concatenate([self.x.ravel(), self.v.ravel()])

    def force_scale(self, x):
        """(N) sum of the sizes of the terms that make up each particle's force: what rounding is relative to."""
        s = self.m * np.abs(self.gravity).sum() + self.drag * np.abs(self.v).max()
        if self.central:
            s = s + self.central[0] * self.central[1] * self.m / ((x - self.central[2]) ** 2).sum(1)
        def term(d, k, L):
            l = np.sqrt((d * d).sum(1))
            return np.where(L == 0, k * l, k if self.law == "strain" else k * np.maximum(l, L))
        if len(self.pairs):
            t = term(x[self.pairs[:, 0]] - x[self.pairs[:, 1]], self.stiffness, self.rest)
            np.add.at(s, self.pairs[:, 0], t)
            np.add.at(s, self.pairs[:, 1], t)
        if self.anchors:
            a = self.anchors
            np.add.at(s, a["particle"], term(x[a["particle"]] - a["point"], a["stiffness"], a["rest_length"]))
        return s

    def write(self, path, radius=None):
        """The HDF5 lattice of this system; the options that go with it are options()."""
        springs = dict(pairs=self.pairs, stiffness=self.stiffness, rest_length=self.rest, damping=self.damping)
        return write_lattice(path, self.x, self.m, velocity=self.v, fixed=self.fixed, radius=radius, anchors=self.anchors,
                             spring_law=self.law, damping_law=self.damping_law, **(springs if len(self.pairs) else {}))

    def options(self, lattice):
        o = {"bs_lattice_file": lattice}
        if np.any(self.gravity):
            o["bs_gravity"] = self.gravity
        if self.drag:
            o["bs_stokes_drag"] = self.drag
        if self.central:
            o["bs_central_G"], o["bs_central_M0"], o["bs_central_point"] = self.central
        return o


def columns(table, names):
    return np.stack([table[name] for name in names], axis=1)


def read_case(folder):
    """(System, params) of a case folder."""
    folder = pathlib.Path(folder)
    params = json.loads((folder / "params.json").read_text())
    d = params["dim"]
    p, s = read_table(folder / "particles.csv"), read_table(folder / "springs.csv")
    anchors = None
    if (folder / "anchors.csv").exists():
        a = read_table(folder / "anchors.csv")
        if len(a["i"]):
            anchors = {"particle": a["i"].astype(int), "point": columns(a, ["ax", "ay", "az"][:d])}
            anchors.update({name: a[name] for name in ("stiffness", "rest_length", "damping")})
    c = params.get("central_gravity")
    return System(columns(p, "xyz"[:d]), columns(p, ["vx", "vy", "vz"][:d]), p["mass"], p["fixed"],
                  np.stack([s["i"], s["j"]], axis=1), s["stiffness"], s["rest_length"], s["damping"], anchors,
                  damping_law=params["spring_damping"], gravity=(params.get("gravity") or [0, 0, 0])[:d],
                  drag=params.get("stokes_drag") or 0.0,
                  central=(c["G"], c["M0"], np.array(c["x0"][:d])) if c else None), params


def read_motion(path, system):
    """{t: (t, x (N, d), v (N, d))} of a file with one row per time and particle, or, without an id, of the one free
    particle on the x axis."""
    t = read_table(path)
    if "id" in t:
        return read_states(path, system.n, system.dim, key="t")
    out, k = {}, int(np.argmin(system.fixed))
    for time, x1, v1 in zip(t["t"], t["x"], t["vx"]):
        x, v = system.x.copy(), system.v.copy()
        x[k, 0], v[k, 0] = x1, v1
        out[time] = time, x, v
    return out


def read_states(path, n, d, key="step"):
    """{key value: (t, x (n, d), v (n, d))} of a states file."""
    t = read_table(path)
    x, v = columns(t, "xyz"[:d]), columns(t, ["vx", "vy", "vz"][:d])
    out = {}
    for first in range(0, len(t["id"]), n):
        order = np.argsort(t["id"][first:first + n])
        out[t[key][first]] = (t["t"][first], x[first:first + n][order], v[first:first + n][order])
    return out
