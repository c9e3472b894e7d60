"""Trajectories made by formula, in the layout of the program's own files."""
import itertools

import h5py
import numpy as np


def grid_lattice(shape, spacing, reach):
    """Points (N, d) of a grid and springs to all neighbours closer than `reach` spacings."""
    points = np.array(list(itertools.product(*[range(n) for n in shape])), dtype=float)
    index = {tuple(p): i for i, p in enumerate(points.astype(int))}
    offsets = [o for o in itertools.product(*[range(-2, 3)] * len(shape))
               if o > (0,) * len(shape) and np.linalg.norm(o) <= reach + 1e-9]
    pairs = [(i, index[tuple(np.add(p, o))]) for p, i in index.items() for o in offsets if tuple(np.add(p, o)) in index]
    return points * spacing, np.array(pairs, dtype=np.int64).reshape(-1, 2)


def energies(x, v, mass, pairs, stiffness, rest):
    kinetic = 0.5 * (mass[None, :] * (v ** 2).sum(axis=2)).sum(axis=1)
    length = np.sqrt(((x[:, pairs[:, 1]] - x[:, pairs[:, 0]]) ** 2).sum(axis=2))
    potential = 0.5 * (stiffness * (length - rest) ** 2).sum(axis=1)
    return kinetic, potential


def write_run(path, x, v, t, pairs, mass=None, fixed=None, parameters=None, rest=None, dim=None, drop=()):
    """x, v (T, N, columns), t (T). `drop` names datasets to leave out."""
    frames, count, columns = x.shape
    mass = np.full(count, 0.01) if mass is None else mass
    stiffness = np.full(len(pairs), 50.0)
    if rest is None:
        rest = np.sqrt(((x[0, pairs[:, 1]] - x[0, pairs[:, 0]]) ** 2).sum(axis=1))
    kinetic, potential = energies(x, v, mass, pairs, stiffness, rest)
    steps = 10 * np.arange(frames)
    with h5py.File(path, "w") as f:
        group = f.create_group("particles/trajectory")
        group.create_group("box").attrs["dimension"] = dim or columns
        for name, value in (("position", x), ("velocity", v)):
            if name in drop:
                continue
            g = group.create_group(name)
            g.create_dataset("value", data=value, maxshape=(None, count, columns), chunks=(1, count, columns))
            if name == "position":
                g.create_dataset("time", data=t, maxshape=(None,))
                g.create_dataset("step", data=steps, maxshape=(None,))
            else:
                g["time"], g["step"] = group["position/time"], group["position/step"]
        group["mass"] = mass
        group["id"] = np.arange(1, count + 1)
        if fixed is not None:
            group["fixed"] = fixed.astype(np.uint8)
        if len(pairs):
            f["connectivity/bonds"] = pairs.astype(np.int32)
            for name, data in (("stiffness", stiffness), ("rest_length", rest), ("damping", np.full(len(pairs), 0.1))):
                if "bonds_" + name not in drop:
                    f["connectivity/bonds_" + name] = data
        momentum = (mass[None, :, None] * v).sum(axis=1)
        x3, p3 = np.zeros((frames, count, 3)), np.zeros((frames, count, 3))
        x3[..., :columns], p3[..., :columns] = x, mass[None, :, None] * v
        for name, value in (("kinetic_energy", kinetic), ("potential_energy", potential), ("total_energy", kinetic + potential),
                            ("momentum", momentum), ("angular_momentum", np.cross(x3, p3).sum(axis=1))):
            if name not in drop:
                g = f.create_group("observables/" + name)
                g["value"], g["time"], g["step"] = value, group["position/time"], group["position/step"]
        if "log" not in drop:
            n = 10 * (frames - 1)
            dt = np.diff(np.interp(np.linspace(0, frames - 1, n + 1), np.arange(frames), t))
            log = {"step": np.arange(1, n + 1), "time": t[0] + np.cumsum(dt), "dt": dt, "newton": 2 + np.arange(n) % 3,
                   "krylov": 20 + (7 * np.arange(n)) % 13, "rejected": (np.arange(n) % 17 == 5).astype(int)}
            for name, value in log.items():
                f[f"backspring/log/{name}"] = value
        f.create_group("parameters").attrs.update({"program": "backspring", "petsc_version": np.bytes_("3.18.5"), "ranks": 2})
        options = {"ts_type": "beuler", "ts_dt": "0.01", **(parameters or {})}
        f.create_group("parameters/options").attrs.update({k: np.bytes_(s) for k, s in options.items()})
    return path


def cloth(path, n=25, frames=20, parameters=None):
    """A cloth held at two corners, made by formula: catenary-like sag that swings."""
    points, pairs = grid_lattice((n, n), 1.0 / (n - 1), 2.0)
    a, b = points.T
    t = np.linspace(0, 1.9, frames)
    x, v = np.zeros((frames, n * n, 3)), np.zeros((frames, n * n, 3))

    def shape(time):
        grow = 1 - np.cos(np.pi * min(time, 1.0)) if time < 1 else 2.0
        sag = 0.5 * grow * (0.30 * np.sin(np.pi * a) * (0.3 + 0.7 * b) + 0.42 * b)
        out = np.zeros((n * n, 3))
        out[:, 0] = a + 0.03 * grow * (0.5 - a) * b
        out[:, 1] = b * (1 - 0.27 * grow) - 0.09 * grow * np.sin(np.pi * a) * (1 - b)
        out[:, 2] = -sag - 0.05 * grow * np.cos(4 * np.pi * a) * b * np.sin(3 * time) - 0.04 * grow * np.cos(5 * a + 9 * b) * b
        return out

    for i, time in enumerate(t):
        x[i], v[i] = shape(time), (shape(time + 1e-5) - shape(time - 1e-5)) / 2e-5
    fixed = ((a == a.min()) | (a == a.max())) & (b == b.min())
    return write_run(path, x, v, t, pairs, fixed=fixed, parameters={"bs_gravity": "0,0,-9.8", **(parameters or {})})


def cube(path, n=10, frames=12, reach=1.5, parameters=None, **more):
    """A lattice that twists and is squeezed, clamped at the bottom."""
    points, pairs = grid_lattice((n, n, n), 1.0 / (n - 1), reach)
    t = np.linspace(0, 1, frames)

    def shape(time):
        angle = 1.1 * np.sin(0.5 * np.pi * time) * points[:, 2]
        c, s = np.cos(angle), np.sin(angle)
        p = points[:, :2] - 0.5
        wide = 1 - 0.18 * time * np.sin(np.pi * points[:, 2])
        return np.stack([wide * (c * p[:, 0] - s * p[:, 1]), wide * (s * p[:, 0] + c * p[:, 1]),
                         points[:, 2] * (1 + 0.25 * time)], axis=1)

    x = np.array([shape(s) for s in t])
    v = np.array([(shape(s + 1e-5) - shape(s - 1e-5)) / 2e-5 for s in t])
    rest = np.sqrt(((points[pairs[:, 1]] - points[pairs[:, 0]]) ** 2).sum(axis=1))
    return write_run(path, x, v, t, pairs, fixed=points[:, 2] == 0, rest=rest, parameters=parameters, **more)


def chain(path, d=1, n=12, frames=30, **more):
    """A chain along x: a standing wave; in d > 1 it swings, too."""
    s, t = np.arange(n) / (n - 1), np.linspace(0, 2, frames)
    x, v = np.zeros((frames, n, d)), np.zeros((frames, n, d))
    x[:, :, 0] = s + 0.1 * np.sin(np.pi * s) * np.sin(3 * t)[:, None]
    v[:, :, 0] = 0.3 * np.sin(np.pi * s) * np.cos(3 * t)[:, None]
    for k in range(1, d):
        x[:, :, k] = 0.3 * np.sin(np.pi * s) * np.cos((k + 2) * t)[:, None]
        v[:, :, k] = -0.3 * (k + 2) * np.sin(np.pi * s) * np.sin((k + 2) * t)[:, None]
    pairs = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    fixed = (s == 0) | (s == 1)
    return write_run(path, x, v, t, pairs, fixed=fixed, rest=np.full(n - 1, 1.0 / (n - 1)), **more)


def linear(path, frames=50):
    """Two decaying states and a source."""
    t = np.linspace(0, 1e-3, frames)
    with h5py.File(path, "w") as f:
        f["states/value"] = np.stack([1 - np.exp(-t / 2e-4), np.exp(-t / 3e-4) * np.cos(2e4 * t), 0 * t], axis=1)
        f["states/time"], f["states/step"] = t, np.arange(frames)
        f["states/labels"] = np.array([b"v_out", b"i_L", b"v_in"])
        f["sources/value"], f["sources/time"] = np.ones((frames, 1)), t
        f["sources/labels"] = np.array([b"V1"])
        f.create_group("parameters").attrs["ts_type"] = "cn"
    return path
