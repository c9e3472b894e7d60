#!/usr/bin/env python3
"""convert.py against LAMMPS itself: what it writes LAMMPS reads, and finds the same energies, forces, positions; what LAMMPS writes
becomes a lattice that moves as LAMMPS' atoms do. Skipped where there is no lmp (apt install lammps)."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import REPO, SKIPPED, Checks, write_lattice
from program import environment
import h5py
import numpy as np

UNITS = ("lj", "real", "metal", "si", "cgs", "electron", "micro", "nano")


def lammps(checks, folder, script):
    """Runs the commands; returns whether that went well, and the thermodynamic tables as arrays."""
    (folder / "in.test").write_text(script)
    done = subprocess.run(["lmp", "-in", "in.test", "-log", "log.test", "-screen", "none"], cwd=folder, env=environment(1), capture_output=True,
                          text=True, timeout=120)
    log = (folder / "log.test").read_text() if (folder / "log.test").exists() else ""
    said = [line for line in log.splitlines() if "ERROR" in line] + done.stderr.strip().splitlines()
    checks.true("LAMMPS runs", done.returncode == 0, said[0] if said and done.returncode else "")
    log = "".join(line for line in log.splitlines(True) if not line.startswith("WARNING"))
    tables = re.findall(r"^\s*Step .*\n((?:\s*[-+\d.e]+)+)\s*\nLoop time", log, re.M)
    return done.returncode == 0, [np.array([line.split() for line in t.strip().splitlines()], dtype=float) for t in tables]


def dumped(path):
    """[rows sorted by their first column] of a dump's frames."""
    blocks = path.read_text().split("ITEM: TIMESTEP\n")[1:]
    rows = [np.array([line.split() for line in b.split("ITEM: ATOMS")[1].splitlines()[1:]], dtype=float) for b in blocks]
    return [r[np.argsort(r[:, 0])] for r in rows]


def convert(checks, folder, *words):
    done = subprocess.run([sys.executable, REPO / "postprocess/convert.py", *map(str, words)], cwd=folder, capture_output=True, text=True, timeout=120)
    checks.true(f"convert.py {' '.join(map(str, words))[:90]}", done.returncode == 0, done.stderr.strip()[-200:])
    return done.stderr


def head(units, boundary="f f f", reach=3.0):
    return (f"units {units}\natom_style bond\nboundary {boundary}\nbond_style harmonic\npair_style zero {reach}\nneighbor {reach / 4:.6g} bin\n"
            f"comm_modify cutoff {2 * reach:.6g}\n")


TAIL = "pair_coeff * *\nthermo_style custom step pe ke\nthermo_modify norm no format float %.17g\nthermo 1\n"
DUMP = "dump 1 all custom 1 out.dump id x y z fx fy fz\ndump_modify 1 sort id format float %.17g\n"


def forces(x, pairs, stiffness, rest):
    d = x[pairs[:, 0]] - x[pairs[:, 1]]
    length = np.linalg.norm(d, axis=1)
    pull = -(stiffness * (length - rest) / length)[:, None] * d
    f = np.zeros_like(x)
    np.add.at(f, pairs[:, 0], pull)
    np.add.at(f, pairs[:, 1], -pull)
    return f


def a_net(folder, ids=None, law="hooke"):
    """30 particles of three masses on 80 springs, not at rest."""
    rng = np.random.default_rng(7)
    x = rng.uniform(0, 2, (30, 3))
    pairs = np.array([(i, j) for i in range(30) for j in range(i + 1, 30)])
    pairs = pairs[rng.permutation(len(pairs))[:80]]
    write_lattice(folder / "net.h5", x, rng.choice([0.5, 1.0, 2.5], 30), velocity=rng.normal(0, 1, (30, 3)), pairs=pairs,
                  stiffness=rng.choice([20.0, 35.0], 80), rest_length=rng.uniform(0.5, 1.5, 80), spring_law=law)
    if ids is not None:
        with h5py.File(folder / "net.h5", "a") as f:
            f["particles/id"] = ids


def exported(checks, folder, name, ids, law):
    """A trajectory as a data file, and as a dump that LAMMPS runs through again."""
    a_net(folder, ids, law)
    subprocess.run([checks.program, "-bs_lattice_file", "net.h5", "-ts_dt", "0.01", "-ts_max_time", "0.05", "-bs_output", "run.h5md",
                    "-bs_overwrite", "-bs_progress_interval", "-1"], cwd=folder, env=environment(1), check=True, capture_output=True, timeout=120)
    convert(checks, folder, "run.h5md", "-o", "data.run", "--frame", 2)
    convert(checks, folder, "run.h5md", "-o", "run.lammpstrj")
    with h5py.File(folder / "run.h5md") as f:
        x, mass = f["particles/trajectory/position/value"][...], f["particles/trajectory/mass"][...]
        kept = f["particles/trajectory/id"][...]
        pairs, k, rest = (f["connectivity/" + n][...] for n in ("bonds", "bonds_stiffness", "bonds_rest_length"))
        elastic, kinetic = (f[f"observables/{n}_energy/value"][...] for n in ("potential", "kinetic"))
    checks.true(f"{name}: the trajectory keeps the ids", np.array_equal(kept, np.arange(30) if ids is None else ids))
    rate = k / rest if law == "strain" else k
    order = np.argsort(np.arange(1, 31) if ids is None else ids)
    good, tables = lammps(checks, folder, head("si", reach=6) + "read_data data.run\n" + TAIL + DUMP + "run 0\nundump 1\n"
                          + DUMP.replace("out.dump", "again.dump") + "rerun run.lammpstrj dump x y z vx vy vz\n")
    if not good:
        return
    frame = dumped(folder / "out.dump")[0]
    checks.true(f"{name}: ids are those of the trajectory, or count from 1", np.array_equal(frame[:, 0], sorted(ids) if ids is not None else range(1, 31)))
    checks.near(f"{name}: positions of the data file", frame[:, 1:4], x[2][order], 1e-14)
    checks.near(f"{name}: forces against a sum over the springs", frame[:, 4:], forces(x[2], pairs, rate, rest)[order], 1e-11)
    checks.near(f"{name}: energies of the frame against the program's", tables[0][0, 1:], [elastic[2], kinetic[2]], 1e-11)
    again = dumped(folder / "again.dump")
    checks.true(f"{name}: rerun reads every frame", len(again) == len(x) == len(tables[1]), f"{len(again)} of {len(x)}")
    checks.near(f"{name}: rerun: positions of the same atoms", [a[:, 1:4] for a in again], x[:, order], 1e-14)
    checks.near(f"{name}: rerun: energies of every frame", tables[1][:, 1:], np.stack([elastic, kinetic], axis=1), 1e-11)
    checks.true(f"{name}: masses", len(np.unique(mass)) == 3)


DIMER = ("a dimer\n\n2 atoms\n1 bonds\n1 atom types\n1 bond types\n\n-20 20 xlo xhi\n-20 20 ylo yhi\n-20 20 zlo zhi\n\nMasses\n\n1 {m}\n\n"
         "Bond Coeffs # harmonic\n\n1 {k} 1.5\n\nAtoms # bond\n\n1 1 1 -1 0 0\n2 1 1 1 0 0\n\nVelocities\n\n1 {v} 0 0\n2 -{v} 0 0\n\nBonds\n\n1 1 1 2\n")


def units(checks, folder, style):
    """A dimer from 2 to 1.5 long in LAMMPS, and as the lattice says: r - L = 0.5 cos(w t) - 2 v/w sin(w t), w^2 = 2 k/m."""
    (folder / "data.dimer").write_text(DIMER.format(m=12.0, k=100.0, v=0))
    convert(checks, folder, "data.dimer", "-o", "dimer.h5", "--units", style)
    with h5py.File(folder / "dimer.h5") as f:
        k, m, rest = f["springs/stiffness"][0], f["particles/mass"][0], f["springs/rest_length"][0]
    w = np.sqrt(2 * k / m)
    v, dt = 0.1 * w, 2 * np.pi / w / 1000
    (folder / "data.dimer").write_text(DIMER.format(m=12.0, k=100.0, v=repr(float(v))))
    good, _ = lammps(checks, folder, head(style) + f"read_data data.dimer\n{TAIL}fix 1 all nve\ntimestep {dt:.17g}\nrun 300\n"
                     "write_dump all custom out.dump id x y z modify sort id format float %.17g\n")
    if good:
        x = dumped(folder / "out.dump")[0][:, 1]
        t = 300 * dt
        checks.near(f"units {style}: length of the dimer after 0.3 periods", x[1] - x[0],
                    rest + 0.5 * np.cos(w * t) - 2 * v / w * np.sin(w * t), 2e-5)


def tilted(boundary_text, flags):
    """Two chains of eight atoms in a tilted box, wrapped into it; image flags or none."""
    cell = np.array([[6.0, 0, 0], [1.5, 5.0, 0], [-1.0, 0.7, 4.0]])
    rng = np.random.default_rng(3)
    x = np.concatenate([start + np.cumsum(rng.uniform(-0.9, 0.9, (8, 3)), axis=0) for start in ([5.5, 4.5, 3.5], [0.3, 0.2, 0.1])])
    images = np.floor(x @ np.linalg.inv(cell)).astype(int)
    wrapped = x - images @ cell
    ids = rng.permutation(100)[:16] + 1
    bonds = [(ids[8 * c + i], ids[8 * c + i + 1]) for c in range(2) for i in range(7)]
    text = (f"{boundary_text}\n\n16 atoms\n14 bonds\n1 atom types\n1 bond types\n\n0 6 xlo xhi\n0 5 ylo yhi\n0 4 zlo zhi\n1.5 -1.0 0.7 xy xz yz\n\n"
            "Masses\n\n1 2\n\nBond Coeffs # harmonic\n\n1 7 0.9\n\nAtoms # bond\n\n")
    text += "".join(f"{i} 1 1 {p[0]:.17g} {p[1]:.17g} {p[2]:.17g}" + (f" {n[0]} {n[1]} {n[2]}" if flags else "") + "\n"
                    for i, p, n in zip(ids, wrapped, images))
    return text + "\nBonds\n\n" + "".join(f"{k + 1} 1 {a} {b}\n" for k, (a, b) in enumerate(bonds)), x, ids


def imported(checks, folder):
    """Chains cut by the faces of a tilted box are put together: lengths and energy are LAMMPS'."""
    for flags in (True, False):
        text, x, ids = tilted("two chains, units = lj", flags)
        (folder / "data.tilted").write_text(text)
        said = convert(checks, folder, "data.tilted", "-o", "tilted.h5")
        checks.true(f"flags {flags}: says what it did", ("bonds cross the periodic box" in said) == (not flags), said.strip())
        with h5py.File(folder / "tilted.h5") as f:
            got, pairs, k, rest = (f[n][...] for n in ("particles/position", "springs/pairs", "springs/stiffness", "springs/rest_length"))
            checks.true(f"flags {flags}: ids are kept", np.array_equal(f["particles/id"][...], ids))
        step = np.diff(x.reshape(2, 8, 3), axis=1)
        checks.near(f"flags {flags}: bond vectors of the chains before they were wrapped", np.diff(got.reshape(2, 8, 3), axis=1), step, 1e-13)
        if flags:
            checks.near("flags: positions before they were wrapped", got, x, 1e-13)
        good, tables = lammps(checks, folder, head("lj", "p p p", 1.5) + "special_bonds lj/coul 1 1 1\nread_data data.tilted\n" + TAIL + "run 0\n")
        if good:
            length = np.linalg.norm(got[pairs[:, 1]] - got[pairs[:, 0]], axis=1)
            checks.near(f"flags {flags}: energy of the springs against LAMMPS'", 0.5 * (k * (length - rest) ** 2).sum(), tables[0][0, 1], 1e-11)


def moved(checks, folder):
    """Eight atoms in units real: the lattice moves as LAMMPS' atoms do; back in LAMMPS, the energy is in kcal/mol."""
    text, _, ids = tilted("two chains, units = real", True)
    (folder / "data.chains").write_text(text.replace("1 7 0.9", "1 200 0.9"))
    convert(checks, folder, "data.chains", "-o", "chains.h5")
    subprocess.run([checks.program, "-bs_lattice_file", "chains.h5", "-ts_type", "cn", "-ts_dt", "0.02", "-ts_max_time", "10", "-snes_rtol", "1e-12",
                    "-bs_output", "chains.h5md", "-bs_output_interval", "10", "-bs_output_units", "real", "-bs_progress_interval", "-1"],
                   cwd=folder, env=environment(1), check=True, capture_output=True, timeout=120)
    good, tables = lammps(checks, folder, head("real", "p p p", 1.5) + "special_bonds lj/coul 1 1 1\ncomm_modify cutoff 6\nread_data data.chains\n" + TAIL
                          + "thermo 500\nfix 1 all nve\ntimestep 0.02\nrun 500\nwrite_dump all custom out.dump id xu yu zu modify sort id format float %.17g\n")
    if not good:
        return
    with h5py.File(folder / "chains.h5md") as f:
        x, start = f["particles/trajectory/position/value"][-1], f["particles/trajectory/position/value"][0]
        checks.true("units real: the trajectory says them", f["particles/trajectory/velocity/value"].attrs["unit"] == "Angstrom fs-1")
    order = np.argsort(ids)
    checks.near("units real: positions after 10 fs", dumped(folder / "out.dump")[0][:, 1:], x[order], 2e-4)
    checks.true("units real: which is far enough to tell", np.abs(x - start).max() > 0.1, f"{np.abs(x - start).max():.3g} Angstrom")
    convert(checks, folder, "chains.h5md", "-o", "back.data", "--units", "real", "--frame", 0)
    good, back = lammps(checks, folder, head("real", "f f f", 1.5) + "comm_modify cutoff 6\nspecial_bonds lj/coul 1 1 1\nread_data back.data\n" + TAIL + "run 0\n")
    if good:
        checks.near("units real: energy in kcal/mol, there and back", back[0][0, 1], tables[0][0, 1], 1e-8)


def endless(checks, folder, name, lattice, strain):
    """A net without ends in a box that is strained: every frame's energy and forces in LAMMPS; its data file read back, in a periodic box again."""
    subprocess.run([checks.program, *lattice, "-bs_box_strain", strain, "-ts_type", "cn", "-ts_dt", "0.02", "-ts_max_time", "0.4", "-snes_rtol", "1e-12", "-bs_output", "net.h5md",
                    "-bs_output_interval", "0.2", "-bs_overwrite", "-bs_progress_interval", "-1"], cwd=folder, env=environment(1), check=True, capture_output=True, timeout=120)
    convert(checks, folder, "net.h5md", "-o", "data.net", "--frame", 2)
    convert(checks, folder, "net.h5md", "-o", "net.lammpstrj")
    with h5py.File(folder / "net.h5md") as f:
        x, elastic, kinetic = (f[n][...] for n in ("particles/trajectory/position/value", "observables/elastic_energy/value", "observables/kinetic_energy/value"))
        box = f["particles/trajectory/box"]
        words = " ".join("p" if w == b"periodic" or w == "periodic" else "f" for w in box.attrs["boundary"])
        edges, shift, pairs, k, rest = box["edges/value"][...], *(f["connectivity/bonds" + n][...] for n in ("_shift", "", "_stiffness", "_rest_length"))
    words = " ".join([*words.split(), "f", "f"][:3])
    cell = edges[2] if edges.ndim == 3 else np.diag(edges[2])
    good, tables = lammps(checks, folder, head("si", words, reach=2.5) + "special_bonds lj/coul 1 1 1\nbox tilt large\nread_data data.net\n" + TAIL + DUMP + "run 0\nundump 1\n"
                          + "rerun net.lammpstrj dump x y z vx vy vz box yes\n")
    if not good:
        return
    checks.near(f"{name}: energies of the frame", tables[0][0, 1:], [elastic[2], kinetic[2]], 1e-10 * (elastic[2] + kinetic[2]))
    checks.near(f"{name}: energies of every frame of the dump", tables[1][:, 1:], np.stack([elastic, kinetic], axis=1), 1e-10 * (elastic + kinetic).max())
    r = x[2][pairs[:, 1]] - x[2][pairs[:, 0]] + shift @ cell
    length = np.linalg.norm(r, axis=1)
    f = np.zeros_like(x[2])
    np.add.at(f, pairs[:, 0], (k * (length - rest) / length)[:, None] * r)
    np.add.at(f, pairs[:, 1], -(k * (length - rest) / length)[:, None] * r)
    theirs = dumped(folder / "out.dump")[0][:, 4:]
    turned = np.linalg.norm(theirs, axis=1)  # the box may have been turned
    checks.near(f"{name}: sizes of the forces", turned, np.linalg.norm(f, axis=1), 1e-10 * np.abs(f).max())
    if not np.triu(cell, 1).any():
        checks.near(f"{name}: forces", theirs[:, :f.shape[1]], f, 1e-10 * np.abs(f).max())
    convert(checks, folder, "data.net", "-o", "back.h5", "--boundary", words.replace(" ", ","), "--units", "si", "--dim", x.shape[2])
    back = subprocess.run([checks.program, "-bs_lattice_file", "back.h5", "-ts_max_steps", "1", "-ts_dt", "1e-9", "-bs_report", "back.json", "-bs_overwrite"], cwd=folder,
                          env=environment(1), capture_output=True, text=True, timeout=120)
    checks.true(f"{name}: read back", back.returncode == 0, back.stderr.strip()[-200:])
    report = json.loads((folder / "back.json").read_text())
    checks.near(f"{name}: energy there and back", report["first_elastic_energy"][0], elastic[2], 1e-10 * elastic[2])
    stress = report["first_stress"]
    checks.true(f"{name}: in a periodic box", len(stress) == x.shape[2] * (x.shape[2] + 1) // 2)


def driven(checks, folder):
    """A lattice held at one end and driven at the other, sideways too: fix setforce and fix move against groups and their motions by velocity Verlet,
    which is the scheme of both."""
    speed, amplitude, frequency, dt, steps = 0.4, 0.3, 0.8, 0.005, 400
    motion = f"x=velocity:{speed},y=sinusoid:{amplitude},{frequency},z=fixed"
    lattice = ["-bs_lattice_type", "cubic", "-bs_lattice_size", "6,3,3", "-bs_lattice_neighbors", "18", "-bs_lattice_stiffness", "40", "-bs_lattice_particle_mass",
               "0.7", "-bs_lattice_perturbation", "0.05", "-bs_lattice_velocity", "0,0,0.3", "-bs_group_wall", "xmin", "-bs_group_end", "xmax"]
    subprocess.run([checks.program, *lattice, "-bs_motion_wall", "fixed", "-bs_motion_end", motion, "-ts_type", "verlet", "-ts_dt", repr(dt), "-ts_max_time", repr(dt * steps),
                    "-bs_output", "driven.h5md", "-bs_output_interval", repr(dt * steps / 4), "-bs_overwrite", "-bs_progress_interval", "-1"],
                   cwd=folder, env=environment(1), check=True, capture_output=True, timeout=120)
    convert(checks, folder, "driven.h5md", "-o", "data.driven", "--frame", 0)
    with h5py.File(folder / "driven.h5md") as f:
        x, rows = f["particles/trajectory/position/value"][...], {name: f["groups/" + name][...] + 1 for name in ("wall", "end")}
    groups = "".join(f"group {name} id {' '.join(map(str, ids))}\n" for name, ids in rows.items())
    good, _ = lammps(checks, folder, head("si", reach=6) + "read_data data.driven\n" + TAIL + groups + "group free subtract all wall end\nvelocity wall set 0 0 0\n"
                     "fix 1 free nve\nfix 2 wall nve\nfix 3 wall setforce 0 0 0\n"
                     f"variable px equal {speed}*step*dt\nvariable vx equal {speed}\n"
                     f"variable py equal {amplitude}*sin({2 * np.pi * frequency:.17g}*step*dt)\nvariable vy equal {2 * np.pi * frequency * amplitude:.17g}*cos({2 * np.pi * frequency:.17g}*step*dt)\n"
                     "variable none equal 0\nfix 4 end move variable v_px v_py v_none v_vx v_vy v_none\n"
                     + DUMP.replace("custom 1", f"custom {steps // 4}") + f"thermo {steps}\ntimestep {dt!r}\nrun {steps}\n")
    if not good:
        return
    theirs = np.array([frame[:, 1:4] for frame in dumped(folder / "out.dump")])
    checks.true("driven lattice: all frames", theirs.shape == x.shape, f"{theirs.shape}, {x.shape}")
    checks.near("driven lattice: positions at every frame", theirs, x, 1e-10)
    inner = np.setdiff1d(np.arange(x.shape[1]), np.concatenate([rows["wall"], rows["end"]]) - 1)
    checks.below("which is far enough to tell", 0.2, np.abs(x[-1, inner] - x[0, inner]).max())


def torn(checks, folder):
    """The notched plate, smaller: no export has a broken spring, and the bonds of its data file have the elastic energy of the frame in LAMMPS."""
    subprocess.run([checks.program, "-options_file", REPO / "options/problems/notched_plate.yaml", "-bs_lattice_size", "24,18", "-bs_break_notch", "-1,7.5,6,7.5", "-bs_load_steps", "12",
                    "-bs_output", "torn.h5md", "-bs_overwrite", "-bs_progress_interval", "-1"], cwd=folder, env=environment(1), check=True, capture_output=True, timeout=120)
    with h5py.File(folder / "torn.h5md") as f:
        whole, elastic, drawn = f["backspring/broken/value"][...] == 0, f["observables/elastic_energy/value"][...], f["backspring/drawn/value"][...]
    frames = len(whole)
    left = whole.sum(axis=1)
    checks.true("notched plate: springs break on the way", len(whole[0]) > left[0] > left[-1] > 0.5 * len(whole[0]), f"{len(whole[0])}, {left[0]} ... {left[-1]} in {frames} frames")
    checks.true("notched plate: the sidecar's lines are the whole springs", np.array_equal(drawn[:, :, 0] != drawn[:, :, 1], whole))
    for frame in (0, int(np.argmax(elastic)), frames - 1):
        said = convert(checks, folder, "torn.h5md", "-o", "data.torn", "--frame", frame)
        checks.true(f"notched plate, frame {frame}: broken springs are told", f"{len(whole[0]) - left[frame]} broken springs" in said and "rules of breaking (-bs_break_" in said, said.strip())
        good, tables = lammps(checks, folder, head("si", reach=2.5) + "special_bonds lj/coul 1 1 1\nread_data data.torn\n" + TAIL.replace("step pe ke", "step ebond ke") + "run 0\n")
        if good:
            checks.near(f"notched plate, frame {frame}: energy of LAMMPS' bonds", tables[0][0, 1], elastic[frame], 1e-10 * elastic.max())
        for ending in (".vtu", ".vtp"):
            convert(checks, folder, "torn.h5md", "-o", "torn" + ending, "--frame", frame)
            count = int(re.search(r'NumberOf(?:Cells|Lines)="(\d+)"', (folder / ("torn" + ending)).read_text()).group(1))
            checks.true(f"notched plate, frame {frame}: lines of {ending}", count == left[frame], f"{count} of {left[frame]}")
    try:
        import gsd.hoomd
    except ImportError:
        return checks.skip("notched plate, GSD", "apt install python3-gsd")
    convert(checks, folder, "torn.h5md", "-o", "torn.gsd")
    with gsd.hoomd.open(str(folder / "torn.gsd"), "rb") as file:
        checks.true("notched plate: bonds of GSD in every frame", [frame.bonds.N for frame in file] == left.tolist())


def main():
    checks = Checks(__doc__)
    if not shutil.which("lmp"):
        print("no lmp: apt install lammps")
        sys.exit(SKIPPED)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        ids = np.random.default_rng(1).permutation(90)[:30] + 3
        for what, numbers, law in (("rows", None, "hooke"), ("ids", ids, "hooke"), ("strain", None, "strain")):
            if checks.wants("export"):
                with checks.group(f"export of {what}"):
                    exported(checks, folder, what, numbers, law)
        for style in UNITS if checks.wants("units") else ():
            with checks.group(f"units {style}"):
                units(checks, folder, style)
        if checks.wants("notched plate"):
            with checks.group("notched plate"):
                torn(checks, folder)
        if checks.wants("driven"):
            with checks.group("driven"):
                driven(checks, folder)
        cube = ["-bs_lattice_type", "cubic", "-bs_lattice_size", "4,5,4", "-bs_lattice_periodic", "xyz", "-bs_lattice_perturbation", "0.1", "-bs_lattice_spacing", "1",
                "-bs_lattice_stiffness", "30", "-bs_lattice_velocity", "0.3,0.1,0"]
        net = ["-bs_lattice_type", "triangular", "-bs_lattice_dim", "2", "-bs_lattice_size", "6,6", "-bs_lattice_periodic", "xy", "-bs_lattice_perturbation", "0.1",
               "-bs_lattice_spacing", "1", "-bs_lattice_stiffness", "30"]
        for what, lattice, strain in (("sheared cube", cube, "xy=velocity:0.3,xz=velocity:-0.2,yz=velocity:0.1"), ("turned cube", cube, "yx=velocity:0.5,zx=velocity:0.2"),
                                      ("sheared far", cube, "xy=velocity:2,xx=velocity:0.1"), ("net of two dimensions", net, "xy=velocity:0.2,yy=velocity:0.1"),
                                      ("periodic along x alone", [*cube, "-bs_lattice_periodic", "x"], "xx=velocity:0.2"),
                                      ("periodic along x and y", [*cube, "-bs_lattice_periodic", "xy"], "xy=velocity:0.2")):
            if checks.wants("periodic"):
                with checks.group(what):
                    endless(checks, folder, what, lattice, strain)
        if checks.wants("periodic"):
            subprocess.run([checks.program, *net, "-bs_lattice_size", "2,2", "-bs_lattice_perturbation", "0", "-ts_max_steps", "1", "-bs_output", "small.h5md"], cwd=folder, env=environment(1), check=True,
                           capture_output=True, timeout=120)
            done = subprocess.run([sys.executable, REPO / "postprocess/convert.py", "small.h5md", "-o", "data.small"], cwd=folder, capture_output=True, text=True, timeout=120)
            checks.true("springs that LAMMPS does not have are refused", done.returncode != 0 and "does not join the nearest images" in done.stderr, done.stderr.strip()[-200:])
        if checks.wants("import"):
            with checks.group("import"):
                imported(checks, folder)
                moved(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
