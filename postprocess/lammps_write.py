"""Frames of a trajectory for LAMMPS: data files and dumps whose ids, types and box agree, in units of the user's choice."""
import os
import sys

import numpy as np

import lammps_units
from backspring_io import RunError
from lammps_box import frame_of, triclinic


def atom_ids(run):
    """The ids by which LAMMPS knows the particles: their own where these are positive and differ, else their rows, from 1."""
    ids = run.id
    if len(ids) and (ids.min() < 1 or len(np.unique(ids)) < len(ids)):
        if not np.array_equal(ids, np.arange(len(ids))):
            print(f"{run.path}: ids are not positive or not unique, particles are numbered by their rows, from 1", file=sys.stderr)
        return np.arange(1, len(ids) + 1)
    return ids


def atom_types(run):
    """Types (N) from 1 on, and their (mass, fixed): equal masses are one type, fixed particles apart."""
    mass = np.ones(run.particles) if run.mass is None else run.mass
    kinds, kind = np.unique(np.stack([mass, run.fixed.astype(float)], axis=1), axis=0, return_inverse=True)
    return kind.reshape(-1) + 1, kinds


def bounds(position):
    """Lower and upper corner of a box about the frame that no bond is half as long as, so that LAMMPS may take it for periodic."""
    low, high = position.min(axis=0), position.max(axis=0)
    margin = 0.6 * max(float(np.linalg.norm(high - low)), 1e-6)
    return low - margin, high + margin


def alike(values):
    """Values that differ by rounding as one: those between whose neighbours in order there is less than 1e-12 of the largest become the middle one."""
    if not len(values):
        return values
    order = np.argsort(values, kind="stable")
    first = np.concatenate([[True], np.diff(values[order]) > 1e-12 * np.abs(values).max()])
    ends = np.flatnonzero(np.append(first, True))
    out = np.empty_like(values)
    out[order] = values[order][(ends[:-1] + ends[1:]) // 2][np.cumsum(first) - 1]
    return out


def kinds_of(*columns):
    """Types (counted from 0) of rows, and the numbers of each type."""
    kinds, kind = np.unique(np.stack([alike(c) for c in columns], axis=1), axis=0, return_inverse=True)
    return kinds, kind.reshape(-1)


def angle_coefficients(run, row):
    """K [J] and theta0 [degree] of angle springs. An angle of LAMMPS has no sign: in two dimensions one that rests beyond pi is seen from the other side, which is
    the same energy where the angle, too, is beyond pi."""
    angles = run.angles_at(row)
    rest = np.degrees(np.minimum(angles.rest_angle, 2 * np.pi - angles.rest_angle))
    if run.dim == 2:
        x = run.position(row)
        first, third = (x[angles.triples[:, k]] - x[angles.triples[:, 1]] for k in (0, 2))
        if angles.shift is not None:
            first, third = (arm + (angles.shift[:, k] - angles.shift[:, 1]) @ run.box_edges(row) for arm, k in ((first, 0), (third, 2)))
        cross = first[:, 0] * third[:, 1] - first[:, 1] * third[:, 0]
        angle = np.arctan2(cross, (first * third).sum(axis=1)) % (2 * np.pi)
        wrong = np.flatnonzero((angle - np.pi) * (angles.rest_angle - np.pi) < -1e-12)
        if len(wrong):
            k = wrong[0]
            raise RunError(f"{run.path}: angle spring {angles.rows[k]} is at {np.degrees(angle[k]):.6g} degrees and rests at {np.degrees(angles.rest_angle[k]):.6g}, on the other side of "
                           "180: an angle of LAMMPS has no sign and would have another energy; choose another --frame, or .vtu")
    return 0.5 * angles.stiffness, rest


def rates(run, there):
    """Spring rates k [N/m] of the springs `there`."""
    springs = run.springs
    if len(springs) and springs.stiffness is None:
        raise RunError(f"{run.path}: holds no stiffnesses, which a LAMMPS data file needs")
    laws = run.spring_laws
    if len(springs) and laws is None:
        print(f"{run.path}: does not say which spring law, hooke is assumed", file=sys.stderr)
    if not len(springs) or laws is None:
        return springs.stiffness[there]
    # strain: K in newtons, the rate is K/L; a rest length of 0 has the rate itself
    rest = np.where((laws == "strain") & (springs.rest_length > 0), springs.rest_length, 1.0)
    return (springs.stiffness / rest)[there]


def write_data(run, row, path, units="si"):
    """A data file of atom style bond (angle where there are angle springs), bond and angle style harmonic: E = K (r - r0)^2,
    K (theta - theta0)^2, so K is half the rate."""
    if run.mass is None:
        raise RunError(f"{run.path}: holds no masses, which a LAMMPS data file needs")
    there = run.acting(row)
    ids, pairs, rest = atom_ids(run), run.springs.pairs[there], run.springs.rest_length[there]
    frame = frame_of(run, row, bounds, there)
    position, high = frame.position, frame.low + np.diag(frame.cell)
    kind, kinds = atom_types(run)
    angles = run.angles_at(row)
    with open(path, "w", encoding="utf-8") as f:
        f.write(f"backspring {os.path.basename(run.path)}, t = {run.times[row]:.17g}, units = {units}{boundary(frame)}\n\n"
                f"{len(position)} atoms\n{len(kinds)} atom types\n")
        if len(pairs):
            bonds, bond = kinds_of(0.5 * rates(run, there) / lammps_units.factor(units), rest)
            f.write(f"{len(pairs)} bonds\n{len(bonds)} bond types\n")
        if angles:
            half, rest_angle = angle_coefficients(run, row)
            bends, bend = kinds_of(half / lammps_units.factor(units), rest_angle)
            f.write(f"{len(angles)} angles\n{len(bends)} angle types\n")
        f.write("\n" + "".join(f"{frame.low[k]:.17g} {high[k]:.17g} {a}lo {a}hi\n" for k, a in enumerate("xyz")))
        if triclinic(run):
            f.write(f"{frame.cell[1, 0]:.17g} {frame.cell[2, 0]:.17g} {frame.cell[2, 1]:.17g} xy xz yz\n")
        f.write("\nMasses\n\n" + "".join(f"{i + 1} {m:.17g}{'  # fixed' if held else ''}\n" for i, (m, held) in enumerate(kinds)))
        if len(pairs):
            f.write("\nBond Coeffs # harmonic\n\n" + "".join(f"{i + 1} {k:.17g} {r:.17g}\n" for i, (k, r) in enumerate(bonds)))
        if angles:
            f.write("\nAngle Coeffs # harmonic\n\n" + "".join(f"{i + 1} {k:.17g} {r:.17g}\n" for i, (k, r) in enumerate(bends)))
        f.write(f"\nAtoms # {'angle' if angles else 'bond'}\n\n")
        flags = [f" {n[0]} {n[1]} {n[2]}" if frame.periodic.any() else "" for n in frame.images]
        f.writelines(f"{i} 1 {t} {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}{n}\n" for i, t, x, n in zip(ids, kind, position, flags))
        if frame.velocity is not None:
            f.write("\nVelocities\n\n")
            f.writelines(f"{i} {v[0]:.17g} {v[1]:.17g} {v[2]:.17g}\n" for i, v in zip(ids, frame.velocity))
        if len(pairs):
            f.write("\nBonds\n\n")
            f.writelines(f"{i + 1} {t + 1} {ids[a]} {ids[b]}\n" for i, (t, (a, b)) in enumerate(zip(bond, pairs)))
        if angles:
            f.write("\nAngles\n\n")
            f.writelines(f"{i + 1} {t + 1} {ids[a]} {ids[b]} {ids[c]}\n" for i, (t, (a, b, c)) in enumerate(zip(bend, angles.triples)))


def boundary(frame):
    """What LAMMPS' command says of a periodic box."""
    return ", boundary " + " ".join("p" if one else "f" for one in frame.periodic) if frame.periodic.any() else ""


def _box_of_dump(frame, tilted):
    """Lines "ITEM: BOX BOUNDS ...": of a tilted box the bounds are those of what encloses it."""
    words = " ".join("pp" if one else "ff" for one in frame.periodic)
    low, high, (xy, xz, yz) = frame.low.copy(), frame.low + np.diag(frame.cell), frame.cell[[1, 2, 2], [0, 0, 1]]
    if not tilted:
        return f"ITEM: BOX BOUNDS {words}\n" + "".join(f"{a:.17g} {b:.17g}\n" for a, b in zip(low, high))
    low[0], high[0] = low[0] + min(0, xy, xz, xy + xz), high[0] + max(0, xy, xz, xy + xz)
    low[1], high[1] = low[1] + min(0, yz), high[1] + max(0, yz)
    return f"ITEM: BOX BOUNDS xy xz yz {words}\n" + "".join(f"{a:.17g} {b:.17g} {t:.17g}\n" for a, b, t in zip(low, high, (xy, xz, yz)))


def write_dump(run, rows, path):
    """A LAMMPS dump of all frames (.dump, .lammpstrj): OVITO, VMD, MDAnalysis, LAMMPS' rerun. It has steps, no times."""
    moving, wrapped = run.velocities is not None, any(run.periodic)
    columns = "id type x y z" + (" vx vy vz" if moving else "") + (" mass" if run.mass is not None else "") + (" ix iy iz" if wrapped else "")
    ids, kind, tilted = atom_ids(run), atom_types(run)[0], triclinic(run)
    with open(path, "w", encoding="utf-8") as f:
        for row in rows:
            frame = frame_of(run, row, bounds)
            parts = [frame.position] + ([frame.velocity] if moving else []) + ([run.mass[:, None]] if run.mass is not None else [])
            f.write(f"ITEM: TIMESTEP\n{run.step[row]}\nITEM: NUMBER OF ATOMS\n{run.particles}\n" + _box_of_dump(frame, tilted) + f"ITEM: ATOMS {columns}\n")
            reals = np.concatenate(parts, axis=1)
            form = "%d %d " + " ".join(["%.17g"] * reals.shape[1]) + (" %d %d %d" if wrapped else "") + "\n"
            images = frame.images.tolist() if wrapped else [[]] * len(reals)
            f.writelines(form % (i, t, *values, *n) for i, t, values, n in zip(ids.tolist(), kind.tolist(), reals.tolist(), images))
