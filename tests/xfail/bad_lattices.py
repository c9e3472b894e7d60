#!/usr/bin/env python3
"""Lattices that cannot be: each bad input must end with exit code 2 and one line that says what to mend.

  bad_lattices.py --program build/release/backspring [--ranks 2] [--filter WORD] [--jobs 2] [--verbose | --list]

What is asked for is told in corpus.py. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import sys

try:
    import h5py
    import numpy as np
except ImportError as missing:
    sys.exit(f"{missing}\nneeded: apt install python3-h5py python3-numpy, and run with /usr/bin/python3")

import corpus

STEP = ["-ts_type", "euler", "-ts_dt", "1e-4", "-ts_max_steps", "1"]


# --- HDF5 -------------------------------------------------------------------------------------------------------------

def tables():
    """A good lattice: five particles on a zigzag, four springs, two anchors."""
    return {
        "particles/position": np.array([[0, 0, 0], [1, 0.5, 0], [2, 0, 0], [3, 0.5, 0], [4, 0, 0]], float),
        "particles/mass": np.full(5, 2.0),
        "springs/pairs": np.array([[0, 1], [1, 2], [2, 3], [3, 4]]),
        "springs/stiffness": np.full(4, 10.0),
        "anchors/particle": np.array([0, 4]),
        "anchors/point": np.array([[-1, 0, 0], [5, 0, 0]], float),
        "anchors/stiffness": np.full(2, 3.0),
    }


def write(path, data, attributes=()):
    with h5py.File(path, "w") as file:
        for name, value in data.items():
            file[name] = value
        for name, value in dict(attributes).items():
            file.attrs[name] = value


def hdf5(change=None, options=(), **attributes):
    """A maker of the good lattice with `change(data)` applied."""
    def make(folder):
        data = tables()
        if change:
            change(data)
        write(folder / "l.h5", data, attributes)
        return ["-bs_lattice_file", folder / "l.h5", *options]
    return make


def put(name, value, at=None):
    """A change: one entry of a dataset, or all of it."""
    def change(data):
        if at is None:
            data[name] = np.asarray(value)
        else:
            data[name][at] = value
    return change


def drop(*names):
    def change(data):
        for name in names:
            del data[name]
    return change


def both(*changes):
    def change(data):
        for one in changes:
            one(data)
    return change


def raw(edit, ending="h5"):
    """A maker of the good HDF5 file whose bytes went through `edit`."""
    def make(folder):
        write(folder / "whole.h5", tables())
        path = folder / f"l.{ending}"
        path.write_bytes(edit((folder / "whole.h5").read_bytes()))
        return ["-bs_lattice_file", path]
    return make


def sparse(name, shape, dtype, **how):
    """A maker of a lattice one of whose datasets only declares its size."""
    def make(folder):
        data = tables()
        data.pop(name, None)
        write(folder / "l.h5", data)
        with h5py.File(folder / "l.h5", "a") as file:
            file.create_dataset(name, shape, dtype, **how)
        return ["-bs_lattice_file", folder / "l.h5"]
    return make


def link_to_nowhere(folder):
    write(folder / "l.h5", {name: value for name, value in tables().items() if name != "particles/mass"})
    with h5py.File(folder / "l.h5", "a") as file:
        file["particles/mass"] = h5py.SoftLink("/nowhere")
    return ["-bs_lattice_file", folder / "l.h5"]


def damaged_chunk(folder):
    """Compressed data that do not unpack."""
    data = tables()
    position = data.pop("particles/position")
    write(folder / "l.h5", data)
    with h5py.File(folder / "l.h5", "a") as file:
        made = file.create_dataset("particles/position", data=position, chunks=(5, 3), compression="gzip")
        file.flush()
        offset, size = made.id.get_chunk_info(0).byte_offset, made.id.get_chunk_info(0).size
    content = bytearray((folder / "l.h5").read_bytes())
    content[offset:offset + size] = b"\xff" * size
    (folder / "l.h5").write_bytes(bytes(content))
    return ["-bs_lattice_file", folder / "l.h5"]


def trajectory(frames=2, **change):
    """A maker of a trajectory as the program writes it, with datasets replaced."""
    def make(folder):
        data = {"particles/trajectory/position/value": np.arange(frames * 9.0).reshape(frames, 3, 3),
                "particles/trajectory/velocity/value": np.zeros((frames, 3, 3)),
                "particles/trajectory/mass": np.ones(3), "connectivity/bonds": np.array([[0, 1], [1, 2]]),
                "connectivity/bonds_stiffness": np.ones(2), "connectivity/bonds_rest_length": np.ones(2)}
        data.update({name.replace("__", "/"): value for name, value in change.items()})
        write(folder / "run.h5md", data)
        return ["-bs_lattice_file", folder / "run.h5md"]
    return make


at_one_place = put("particles/position", [1, 0.5, 0], 0)  # on particle 1

HDF5 = {
    "missing file": (lambda folder: ["-bs_lattice_file", folder / "none.h5"], "none.h5: no such file"),
    "a folder": (lambda folder: [(folder / "d.h5").mkdir(), "-bs_lattice_file", folder / "d.h5"][1:], "is a folder"),
    "not HDF5": (raw(lambda b: b"position 1 2 3\n"), "is not an HDF5 file"),
    "empty file": (raw(lambda b: b""), "is not an HDF5 file (0 bytes)"),
    "truncated to a half": (raw(lambda b: b[:len(b) // 2]), "truncated or damaged HDF5 file"),
    "last bytes missing": (raw(lambda b: b[:-8]), "truncated or damaged HDF5 file"),
    "superblock only": (raw(lambda b: b[:96]), "truncated or damaged HDF5 file"),
    "compressed data damaged": (damaged_chunk, "/particles/position: rows 0 to"),
    "no positions": (hdf5(drop("particles/position")), "has no dataset /particles/position; write one of shape (N, d)"),
    "no masses": (hdf5(drop("particles/mass")), "has no dataset /particles/mass; write one of shape (5)"),
    "no pairs": (hdf5(drop("springs/pairs")), "has no dataset /springs/pairs; write one of shape (M, 2)"),
    "no stiffness": (hdf5(drop("springs/stiffness")), "has no dataset /springs/stiffness"),
    "anchors without points": (hdf5(drop("anchors/point")), "has no dataset /anchors/point; write one of shape (2, 3)"),
    "link to nowhere": (link_to_nowhere, "/particles/mass is not a dataset"),
    "position is a group": (hdf5(both(drop("particles/position"), put("particles/position/x", np.zeros(5)))),
                            "/particles/position is not a dataset"),
    "four dimensions": (hdf5(put("particles/position", np.zeros((5, 4)))), "shape (5, 4), needs (N, d) with d = 1, 2 or 3"),
    "no components": (hdf5(put("particles/position", np.zeros((5, 0)))), "shape (5, 0), needs (N, d)"),
    "flat positions": (hdf5(put("particles/position", np.zeros(15))), "shape (15), needs (N, d)"),
    "scalar mass": (hdf5(put("particles/mass", 1.0)), "/particles/mass: shape (), needs (5)"),
    "no particles": (hdf5(put("particles/position", np.zeros((0, 3)))), "has no particles"),
    "too few masses": (hdf5(put("particles/mass", np.ones(4))), "/particles/mass: shape (4), needs (5)"),
    "velocity of another d": (hdf5(put("particles/velocity", np.zeros((5, 2)))), "velocity: shape (5, 2), needs (5, 3)"),
    "too many fixed flags": (hdf5(put("particles/fixed", np.zeros(6, "u1"))), "/particles/fixed: shape (6), needs (5)"),
    "pairs of three": (hdf5(put("springs/pairs", np.zeros((4, 3), int))), "shape (4, 3), needs (M, 2)"),
    "too many stiffnesses": (hdf5(put("springs/stiffness", np.ones(5))), "/springs/stiffness: shape (5), needs (4)"),
    "rest lengths of other size": (hdf5(put("springs/rest_length", np.ones(3))), "rest_length: shape (3), needs (4)"),
    "anchor points of other d": (hdf5(put("anchors/point", np.zeros((2, 2)))), "/anchors/point: shape (2, 2), needs (2, 3)"),
    "pairs as floats": (hdf5(put("springs/pairs", np.ones((4, 2)))), "holds floating-point numbers, needs integers"),
    "masses as text": (hdf5(put("particles/mass", np.full(5, b"2"))), "/particles/mass: holds strings, needs numbers"),
    "complex positions": (hdf5(put("particles/position", np.ones((5, 3), complex))), "holds compounds, needs numbers"),
    "fixed as floats": (hdf5(put("particles/fixed", np.zeros(5))), "/particles/fixed: holds floating-point numbers"),
    "fixed is 2": (hdf5(put("particles/fixed", np.array([0, 0, 0, 2, 0], "u1"))), "particle 3, /particles/fixed: 2"),
    "NaN position": (hdf5(put("particles/position", np.nan, (4, 1))), "particle 4, /particles/position: position nan"),
    "infinite velocity": (hdf5(put("particles/velocity", np.full((5, 3), np.inf))),
                          "particle 0, /particles/velocity: velocity inf"),
    "mass 0": (hdf5(put("particles/mass", 0, 3)), "particle 3, /particles/mass: mass 0"),
    "negative mass": (hdf5(put("particles/mass", -1, 0)), "particle 0, /particles/mass: mass -1"),
    "NaN mass": (hdf5(put("particles/mass", np.nan, 2)), "particle 2, /particles/mass: mass nan"),
    "negative radius": (hdf5(put("particles/radius", np.full(5, -0.1))), "particle 0, /particles/radius: radius -0.1"),
    "a stiffness whose square overflows": (hdf5(put("springs/stiffness", 1e300, 1)), "spring 1, /springs/stiffness: stiffness 1e+300; its square cannot be computed"),
    "a coordinate whose square overflows": (hdf5(put("particles/position", 1e200, (1, 0))), "particle 1, /particles/position: position 1e+200; its square cannot be computed"),
    "a mass whose square overflows": (hdf5(put("particles/mass", 1e200, 2)), "particle 2, /particles/mass: mass 1e+200; its square cannot be computed"),
    "negative drag": (hdf5(put("particles/drag", np.array([1, 0, 2, -0.25, 1]))), "particle 3, /particles/drag: drag -0.25; write a finite drag >= 0 [kg/s]"),
    "NaN drag": (hdf5(put("particles/drag", np.array([1, np.nan, 2, 0, 1]))), "particle 1, /particles/drag: drag nan"),
    "too many drag coefficients": (hdf5(put("particles/drag", np.ones(6))), "/particles/drag: shape (6), needs (5)"),
    "drag of two columns": (hdf5(put("particles/drag", np.ones((5, 2)))), "/particles/drag: shape (5, 2), needs (5)"),
    "forces of another d": (hdf5(put("particles/force", np.zeros((5, 2)))), "/particles/force: shape (5, 2), needs (5, 3)"),
    "forces without components": (hdf5(put("particles/force", np.zeros(5))), "/particles/force: shape (5), needs (5, 3)"),
    "too many forces": (hdf5(put("particles/force", np.zeros((6, 3)))), "/particles/force: shape (6, 3), needs (5, 3)"),
    "NaN force": (hdf5(put("particles/force", np.array([[0, 0, 0], [0, 0, 0], [0, np.nan, 0], [0, 0, 0], [0, 0, 0]]))), "particle 2, /particles/force: force nan; write a finite force [N]"),
    "a force whose square overflows": (hdf5(put("particles/force", np.full((5, 3), 1e200))), "particle 0, /particles/force: force 1e+200; its square cannot be computed"),
    "forces as text": (hdf5(put("particles/force", np.full((5, 3), b"1"))), "/particles/force: holds strings, needs numbers"),
    "drag as text": (hdf5(put("particles/drag", np.full(5, b"1"))), "/particles/drag: holds strings, needs numbers"),
    "spring to nobody": (hdf5(put("springs/pairs", 5, (3, 1))), "spring 3, /springs/pairs: there is no particle 5; write 0 to 4"),
    "spring to -1": (hdf5(put("springs/pairs", -1, (1, 0))), "spring 1, /springs/pairs: there is no particle -1"),
    "end beyond 64 bits": (hdf5(put("springs/pairs", np.full((4, 2), 2**64 - 1, "u8"))), "/springs/pairs: row 0 holds a whole number of 2^63 - 1 or more in size"),
    "spring to itself": (hdf5(put("springs/pairs", [2, 2], 2)), "spring 2, /springs/pairs: joins particle 2 to itself"),
    "negative stiffness": (hdf5(put("springs/stiffness", -3, 2)), "spring 2, /springs/stiffness: stiffness -3"),
    "infinite stiffness": (hdf5(put("springs/stiffness", np.inf, 2)), "spring 2, /springs/stiffness: stiffness inf"),
    "negative damping": (hdf5(put("springs/damping", np.full(4, -1.0))), "spring 0, /springs/damping: damping -1"),
    "negative rest length": (hdf5(put("springs/rest_length", np.array([1, 1, 1, -2.0]))),
                             "spring 3, /springs/rest_length: rest length -2"),
    "NaN rest length": (hdf5(put("springs/rest_length", np.array([1, np.nan, 1, 1]))),
                        "spring 1, /springs/rest_length: rest length nan"),
    "two ends at one place": (hdf5(both(at_one_place, put("springs/rest_length", np.ones(4)))),
                              "spring 0: its ends, particles 0 and 1 (from 0), are at one place, its rest length is 1"),
    "two ends at one place, no rest length": (hdf5(at_one_place), "the initial distance cannot be its rest length"),
    "damping without direction": (hdf5(both(at_one_place, put("springs/rest_length", np.zeros(4)),
                                            put("springs/damping", np.ones(4)))), "write -bs_damping_law simple, or damping 0"),
    "group of nobody": (hdf5(put("groups/ends", np.array([0, 9]))), "/groups/ends: there is no particle in row 9; write rows from 0 to 4"),
    "group of a mask that is too short": (hdf5(put("groups/ends", np.array([True, False]))), "/groups/ends: 2 truth values for 5 particles; write one for each"),
    "springs of truth values": (hdf5(put("springs/pairs", np.ones((4, 2), bool))), "/springs/pairs: holds truth values (an enumeration), needs integers"),
    "group of fractions": (hdf5(put("groups/ends", np.array([0.5]))), "/groups/ends"),
    "group with a bad name": (hdf5(put("groups/left end", np.array([0]))), "/groups/left end: no name of a group: write letters, digits and underscores"),
    "anchor of nobody": (hdf5(put("anchors/particle", 9, 1)), "anchor 1, /anchors/particle: there is no particle 9"),
    "NaN anchor": (hdf5(put("anchors/point", np.nan, (0, 2))), "anchor 0, /anchors/point: point nan"),
    "negative anchor stiffness": (hdf5(put("anchors/stiffness", -1, 1)), "anchor 1, /anchors/stiffness: stiffness -1"),
    "negative anchor rest length": (hdf5(put("anchors/rest_length", np.array([1, -1.0]))), "anchor 1, /anchors/rest_length"),
    "anchor where its particle is": (hdf5(both(put("anchors/point", [0, 0, 0], 0), put("anchors/rest_length", np.ones(2)))),
                                     "anchor 0: its point is where particle 0 (from 0) is, its rest length is 1"),
    "unknown spring law": (hdf5(spring_law="rubber"), "attribute spring_law of / is 'rubber'; write hooke, strain, tension, polynomial, plastic or maxwell"),
    "unknown damping law": (hdf5(damping_law=np.bytes_("viscous")), "damping_law of / is 'viscous'; write axial or simple"),
    "unknown law among many": (hdf5(put("springs/law", np.zeros(4, int)), spring_laws=["hooke", "rubber"]), "attribute spring_laws of / names 'rubber'; write hooke, strain"),
    "law that is no index": (hdf5(put("springs/law", np.array([0, 1, 2, 0])), spring_laws=["hooke", "tension"]),
                             "spring 2, /springs/law: 2 is not an index of attribute spring_laws; write 0 to 1"),
    "negative law": (hdf5(put("springs/law", np.array([0, 1, 0, -1])), spring_laws="hooke,tension"), "spring 3, /springs/law: -1 is not an index"),
    "laws without names": (hdf5(put("springs/law", np.zeros(4, int))), "attribute spring_laws of /, which names its laws, is not"),
    "names of laws as numbers": (hdf5(put("springs/law", np.zeros(4, int)), spring_laws=np.arange(3)), "attribute spring_laws of / is not a list of strings"),
    "laws of other size": (hdf5(put("springs/law", np.zeros(3, int)), spring_laws=["hooke"]), "law: shape (3), needs (4)"),
    "laws that are no integers": (hdf5(put("springs/law", np.zeros(4)), spring_laws=["hooke"]), "/springs/law"),
    "one law for all beside one for each": (hdf5(put("springs/law", np.zeros(4, int)), ("-bs_spring_law", "strain"), spring_laws=["hooke"]),
                                            "has a law for each spring: leave the option out"),
    "plastic without a yield force": (hdf5(spring_law="plastic"), "needs yield_force: give -bs_spring_yield_force, or the dataset /springs/yield_force [N]"),
    "polynomial of the first order": (hdf5(spring_law="polynomial"), "needs stiffness_2: give -bs_spring_stiffness_2"),
    "one spring of four without what it needs": (hdf5(put("springs/law", np.array([0, 0, 1, 0])), spring_laws=["hooke", "plastic"]), "obey the law plastic, which needs yield_force"),
    "negative yield force": (hdf5(put("springs/yield_force", np.array([1, 1, -2.0, 1])), spring_law="plastic"),
                             "spring 2, /springs/yield_force: -2; write a finite number >= 0 [N]"),
    "yield force that is no number": (hdf5(put("springs/yield_force", np.array([1, np.nan, 1, 1])), spring_law="plastic"), "spring 1, /springs/yield_force: nan"),
    "maxwell without a relaxation time": (hdf5(spring_law="maxwell"), "needs relaxation_time: give -bs_spring_relaxation_time, or the dataset /springs/relaxation_time [s]"),
    "relaxation time 0": (hdf5(put("springs/relaxation_time", np.array([1, 1, 0, 1.0])), spring_law="maxwell"), "spring 2, /springs/relaxation_time: 0; write a finite number > 0 [s]"),
    "relaxation time 0 as an option": (hdf5(options=("-bs_spring_law", "maxwell", "-bs_spring_relaxation_time", "0")), "-bs_spring_relaxation_time"),
    "maxwell without a rest length": (hdf5(both(put("springs/relaxation_time", np.ones(4)), put("springs/rest_length", np.array([1, 1, 0, 1.0]))), spring_law="maxwell"),
                                      "spring 2: rest length 0, where the law maxwell has no direction"),
    "negative hardening": (hdf5(both(put("springs/yield_force", np.ones(4)), put("springs/hardening", np.array([1, 1, 1, -1.0]))), spring_law="plastic"),
                           "spring 3, /springs/hardening: -1; write a finite number >= 0 [N/m]"),
    "infinite third stiffness": (hdf5(put("springs/stiffness_3", np.array([1, 1, np.inf, 1])), spring_law="polynomial"), "spring 2, /springs/stiffness_3: inf; write a finite number [N/m^3]"),
    "column of other size": (hdf5(put("springs/yield_force", np.ones(5)), spring_law="plastic"), "yield_force: shape (5), needs (4)"),
    "plastic stretch that is no number": (hdf5(both(put("springs/yield_force", np.ones(4)), put("springs/plastic_stretch", np.full(4, np.nan))), spring_law="plastic"),
                                          "spring 0, /springs/plastic_stretch: nan"),
    "negative plastic path": (hdf5(both(put("springs/yield_force", np.ones(4)), put("springs/plastic_path", np.array([0, 0, -1.0, 0]))), spring_law="plastic"),
                              "spring 2, /springs/plastic_path: -1; write a finite number >= 0 [m]"),
    "ids beyond what can be counted": (hdf5(put("particles/id", np.array([0, 1, 2, 2**63, 4], np.uint64))), "/particles/id: row 3 holds a whole number of 2^63 - 1 or more in size"),
    "ends beyond what can be counted": (hdf5(put("springs/pairs", np.array([[0, 1], [1, 2], [2, 2**64 - 1], [3, 4]], np.uint64))), "/springs/pairs: row 2 holds a whole number"),
    "group of rows beyond what can be counted": (hdf5(put("groups/g", np.array([0, -2**63]))), "/groups/g: row 1 holds a whole number"),
    "plastic without a rest length": (hdf5(both(put("springs/yield_force", np.ones(4)), put("springs/rest_length", np.array([1, 1, 0, 1.0]))), spring_law="plastic"),
                                      "spring 2: rest length 0, where the law plastic has no direction"),
    "option that is none of a scene's": (hdf5(implied_options="-bs_gravity 0,-1 -bs_output x"), "attribute implied_options of /: '-bs_output' is no option of an .xsp scene with its value; write NAME VALUE"),
    "option without its value": (hdf5(implied_options="-bs_gravity"), "attribute implied_options of /: '-bs_gravity' is no option of an .xsp scene with its value"),
    "options as a list": (hdf5(implied_options=["-bs_gravity", "1"]), "attribute implied_options of / is not one string"),
    "force at zero length": (hdf5(force_at_zero_length="some"), "attribute force_at_zero_length of / is 'some'; write none or error"),
    "law as a number": (hdf5(spring_law=1), "attribute spring_law of / is not one string"),
    "more unknowns than indices": (sparse("particles/position", (2**30, 3), "f8"), "more unknowns than PETSc's indices can count"),
    "more springs than indices": (sparse("springs/pairs", (2**33, 2), "i8"), "more than PETSc's indices can count"),
    "declares what it does not hold": (sparse("particles/position", (10**8, 3), "f8"), "declares 100000000 rows (2400000000 bytes), the file"),
    "declares springs it does not hold": (sparse("springs/pairs", (10**9, 2), "i8"), "does not hold them"),
    "declares compressed springs it does not hold": (sparse("springs/pairs", (10**9, 2), "i8", chunks=(1024, 2),
                                                            compression="gzip"), "does not hold them"),
    "trajectory without a frame": (trajectory(frames=0), "holds no frame"),
    "trajectory with a bond to nobody": (trajectory(connectivity__bonds=np.array([[0, 1], [1, 3]])), "there is no particle 3"),
    "trajectory with too few masses": (trajectory(particles__trajectory__mass=np.ones(2)), "shape (2), needs (3)"),
}


def angles(change=None, options=()):
    """A maker of the good lattice with three angle springs, `change(data)` applied."""
    def add(data):
        data["angles/triples"] = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]])
        data["angles/stiffness"] = np.full(3, 0.5)
        data["angles/rest_angle"] = np.full(3, np.pi)
        if change:
            change(data)
    return hdf5(add, options)


def hinges(change):
    """A maker of the good lattice with two hinges, `change(data)` applied."""
    def add(data):
        data["hinges/quads"] = np.array([[0, 1, 2, 3], [1, 2, 0, 4]])
        data["hinges/stiffness"], data["hinges/rest_angle"] = np.full(2, 0.5), np.zeros(2)
        change(data)
    return hdf5(add)


def boxed(change=None, boundary=("periodic",) * 3, options=()):
    """A maker of the good lattice in a periodic box of 6 x 4 x 4, `change(data)` applied."""
    def make(folder):
        data = tables()
        data["box/edges"] = np.diag([6.0, 4, 4])
        if change:
            change(data)
        write(folder / "l.h5", data)
        with h5py.File(folder / "l.h5", "a") as file:
            file.require_group("box").attrs["boundary"] = list(boundary)
        return ["-bs_lattice_file", folder / "l.h5", *options]
    return make


def bent(triple):
    return lambda data: data.update({"angles/triples": np.array([triple]), "angles/stiffness": np.ones(1), "angles/rest_angle": np.full(1, 2.0)})


def unshifted(data):
    data["springs/shift"] = np.zeros((4, 3), int)


def flat(data, at=slice(None)):
    data["particles/position"][at, 1] = 0


ANGLES = {
    "angles without triples": (angles(drop("angles/triples")), "has no dataset /angles/triples; write one of shape (A, 3)"),
    "angles without rest angles": (angles(drop("angles/rest_angle")), "has no dataset /angles/rest_angle"),
    "triples of two": (angles(put("angles/triples", np.zeros((3, 2), int))), "/angles/triples: shape (3, 2), needs (A, 3)"),
    "triples as floats": (angles(put("angles/triples", np.ones((3, 3)))), "holds floating-point numbers, needs integers"),
    "too few angle stiffnesses": (angles(put("angles/stiffness", np.ones(2))), "/angles/stiffness: shape (2), needs (3)"),
    "angle of nobody": (angles(put("angles/triples", 5, (1, 2))), "angle spring 1, /angles/triples: there is no particle 5; write 0 to 4"),
    "angle of -1": (angles(put("angles/triples", -1, (2, 0))), "angle spring 2, /angles/triples: there is no particle -1"),
    "angle with one particle twice": (angles(put("angles/triples", [1, 2, 1], 1)), "angle spring 1, /angles/triples: names particle 1 twice"),
    "negative angle stiffness": (angles(put("angles/stiffness", -2, 1)), "angle spring 1, /angles/stiffness: angle stiffness -2; write a finite number >= 0"),
    "infinite angle stiffness": (angles(put("angles/stiffness", np.inf, 1)), "angle spring 1, /angles/stiffness: angle stiffness inf"),
    "NaN rest angle": (angles(put("angles/rest_angle", np.nan, 2)), "angle spring 2, /angles/rest_angle: rest angle nan"),
    "rest angle beyond pi in space": (angles(put("angles/rest_angle", 3.5, 0)), "rest angle 3.5; write an angle > 0 and at most pi"),
    "rest angle 0": (angles(put("angles/rest_angle", 0, 0)), "rest angle 0; write an angle > 0"),
    "straight, bent at rest, in space": (angles(both(flat, put("angles/rest_angle", np.full(3, 2.0)))), "angle spring 0, /angles/triples: starts with a straight angle"),
    "folded angle": (angles(both(flat, put("particles/position", [0.5, 0, 0], 2))), "angle spring 0, /angles/triples: starts with an angle of 0"),
    "angle with an arm of no length": (angles(both(put("particles/position", [0, 0, 0], 1), drop("springs/pairs", "springs/stiffness"))),
                                       "angle spring 0, /angles/triples: starts with an arm of zero length"),
    "angles in one dimension": (angles(both(put("particles/position", np.arange(5.0)[:, None]), drop("anchors/point", "anchors/particle", "anchors/stiffness"))),
                                "angle springs need a lattice of at least 2 dimensions, this one has 1"),
    "quads of three": (hinges(put("hinges/quads", np.zeros((1, 3), int))), "/hinges/quads: shape (1, 3), needs (A, 4)"),
    "rest angle of -pi": (hinges(put("hinges/rest_angle", -np.pi, 0)), "hinge 0, /hinges/rest_angle: rest angle -3.141592653589793; write an angle above -pi and at most pi"),
    "wing without area": (hinges(put("hinges/quads", [0, 2, 1, 4], 1)), "hinge 1, /hinges/quads: starts with a second wing without area"),
    "hinges in the plane": (hinges(both(lambda data: data.update({"particles/position": data["particles/position"][:, :2].copy()}), drop("anchors/point", "anchors/particle", "anchors/stiffness"))), "hinges need a lattice of at least 3 dimensions, this one has 2"),
    "limit of an angle 0": (angles(put("angles/critical_change", np.array([0.1, 0, 1]))), "angle spring 1, /angles/critical_change: 0; write a number > 0, or inf for an angle spring that does not break"),
    "moments of fewer angles": (angles(put("angles/critical_moment", np.ones(2))), "/angles/critical_moment: shape (2), needs (3)"),
    "limit of a hinge that is no number": (hinges(put("hinges/critical_energy", np.array([1, np.nan]))), "hinge 1, /hinges/critical_energy: nan; write a number > 0, or inf for a hinge that does not break"),
    "half broken hinge": (hinges(put("hinges/broken", np.array([0, 0.5]))), "hinge 1, /hinges/broken: 0.5; write 1 (broken) or 0"),
    "declares angles it does not hold": (sparse("angles/triples", (10**9, 3), "i8"), "does not hold them"),
}


# --- text files -------------------------------------------------------------------------------------------------------

def text(name, content, *options):
    def make(folder):
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return ["-bs_lattice_file", folder / name, *options]
    return make


SCENE = "#1.0 *** scene\nmass 1 10 20 0 0 1 0.5\nmass 2 40 20 0 0 1 0.5\nspng 1 1 2 5 0 30\n"


def scene(old="", new="", *options):
    return text("scene.xsp", SCENE.replace(old, new, 1) if old else SCENE, *options)


XSP = {
    "xsp: missing": (lambda folder: ["-bs_lattice_file", folder / "none.xsp"], "none.xsp: no such file"),
    "xsp: empty": (text("scene.xsp", ""), "scene.xsp"),
    "xsp: not a scene": (scene("#1.0", "#9.7"), "scene.xsp:1:"),
    "xsp: no masses": (text("scene.xsp", "#1.0\n"), "scene.xsp"),
    "xsp: a word for a number": (scene("10 20", "ten 20"), "scene.xsp:2:"),
    "xsp: NaN": (scene("40 20", "nan 20"), "scene.xsp:3:"),
    "xsp: too few numbers": (scene("spng 1 1 2 5 0 30", "spng 1 1 2 5"), "scene.xsp:4:"),
    "xsp: one id twice": (scene("mass 2", "mass 1"), "scene.xsp:3:"),
    "xsp: negative rest length": (scene("5 0 30", "5 0 -30"), "scene.xsp:4:"),
    "xsp: binary": (text("scene.xsp", b"#1.0\nmass \x00\xff\x80\n"), "scene.xsp:2:"),
    "xsp: window of width 0": (scene("", "", "-bs_lattice_width", "0"), "-bs_lattice_width"),
    "xsp: three dimensions": (scene("", "", "-bs_lattice_dim", "3"), "-bs_lattice_dim 3: the file has d = 2"),
}


# --- options ----------------------------------------------------------------------------------------------------------

def options(*words):
    return lambda folder: list(words)


CHAIN = ("-bs_lattice_type", "chain", "-bs_lattice_size", "5")

OPTIONS = {
    "no lattice": (options(), "no lattice is given; write -bs_lattice_file"),
    "file and generator": (hdf5(options=CHAIN), "are both given; write one of them"),
    "a Gmsh mesh": (text("l.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"), "postprocess/convert.py makes an .h5 of Gmsh"),
    "unknown ending": (text("l.vtu", "<VTKFile/>"), "postprocess/convert.py"),
    "no ending": (text("lattice", "x"), "unknown ending; lattices are read from .h5"),
    "unknown generator": (options("-bs_lattice_type", "hexagonal"), "hexagonal"),
    "generator without size": (options("-bs_lattice_type", "chain"), "-bs_lattice_size is missing"),
    "generator of size 0": (options("-bs_lattice_type", "chain", "-bs_lattice_size", "0"), "-bs_lattice_size 0"),
    "generator beyond the indices": (options("-bs_lattice_type", "cubic", "-bs_lattice_size", "1000,1000,1000"),
                                     "more unknowns than PETSc's indices can count"),
    "option spring law": (hdf5(options=("-bs_spring_law", "rubber")), "-bs_spring_law"),
    "negative yield force as an option": (hdf5(options=("-bs_spring_law", "plastic", "-bs_spring_yield_force", "-1")), "-bs_spring_yield_force"),
    "generated plastic chain without a yield force": (options(*CHAIN, "-bs_spring_law", "plastic"), "needs yield_force: give -bs_spring_yield_force"),
    "option damping law": (hdf5(options=("-bs_damping_law", "viscous")), "-bs_damping_law"),
    "option dim": (hdf5(options=("-bs_lattice_dim", "2")), "-bs_lattice_dim 2: the file has d = 3"),
    "misspelt option": (hdf5(options=("-bs_latice_fixed", "xmin")), "-bs_lattice_fixed"),
    "fixed face": (hdf5(options=("-bs_lattice_fixed", "left")), "-bs_lattice_fixed left: no such face"),
    "fixed particle": (hdf5(options=("-bs_lattice_fixed_particles", "5")), "-bs_lattice_fixed_particles 5"),
    "velocity of four components": (hdf5(options=("-bs_lattice_velocity", "1,2,3,4")), "-bs_lattice_velocity"),
    "anchor particle": (hdf5(options=("-bs_anchor_particles", "5", "-bs_anchor_stiffness", "1")), "-bs_anchor_particles 5"),
    "anchor point of d 2": (options(*CHAIN, "-bs_lattice_dim", "3", "-bs_anchor_particles", "0", "-bs_anchor_stiffness", "1",
                                    "-bs_anchor_point", "1,2"), "-bs_anchor_point has 2 numbers: write 3"),
    "anchors without stiffness": (options(*CHAIN, "-bs_anchor_particles", "0"), "add -bs_anchor_stiffness"),
    "anchors of nobody": (options(*CHAIN, "-bs_anchor_stiffness", "1"), "add -bs_anchor_particles"),
    "anchor with a rest length in place": (options(*CHAIN, "-bs_anchor_particles", "3", "-bs_anchor_stiffness", "1",
                                                   "-bs_anchor_rest_length", "0.5"), "its point is where particle 3"),
    "angle springs of a lattice without lines": (options("-bs_lattice_type", "honeycomb", "-bs_lattice_size", "3", "-bs_angle_stiffness", "1"),
                                                 "-bs_angle_stiffness: in a honeycomb lattice no three neighbours lie on a straight line: use chain"),
    "rest angle of no springs": (options(*CHAIN, "-bs_rest_angle", "2"), "-bs_rest_angle needs the angle springs of -bs_angle_stiffness"),
    "angle springs of a line": (options(*CHAIN, "-bs_angle_stiffness", "1"), "one dimension has no angles: write -bs_lattice_dim 2 or 3"),
    "negative angle stiffness of a chain": (options(*CHAIN, "-bs_lattice_dim", "2", "-bs_angle_stiffness", "-1"), "-bs_angle_stiffness"),
    "straight chain bent at rest in space": (options(*CHAIN, "-bs_lattice_dim", "3", "-bs_angle_stiffness", "1", "-bs_rest_angle", "2"),
                                             "angle spring 0: starts with a straight angle"),
    "rest angle of a full turn": (options(*CHAIN, "-bs_lattice_dim", "2", "-bs_angle_stiffness", "1", "-bs_rest_angle", "6.3"), "rest angle 6.3; write"),
    "negative anchor damping": (options(*CHAIN, "-bs_anchor_particles", "3", "-bs_anchor_damping", "-1"), "-bs_anchor_damping"),
}

GOOD = {
    "good: HDF5": hdf5(),
    "good: HDF5, all that is optional": hdf5(both(put("particles/velocity", np.zeros((5, 3))), put("particles/radius", np.ones(5)), put("particles/drag", np.ones(5)), put("particles/force", np.zeros((5, 3))),
                                                  put("particles/fixed", np.array([1, 0, 0, 0, 1], bool)),
                                                  put("springs/rest_length", np.ones(4)), put("springs/damping", np.ones(4))),
                                             spring_law="strain", damping_law=np.bytes_("simple")),
    "good: angles": angles(),
    "good: limits of angles": angles(both(put("angles/critical_moment", np.array([0.1, np.inf, 2])), put("angles/broken", np.array([0.0, 1, 0])))),
    "good: cross-sections": hdf5(put("springs/area", np.full(4, 1e-4))),
    "good: limits of springs": hdf5(both(put("springs/critical_strain", np.array([0.1, np.inf, 1, 2])), put("springs/broken", np.array([0.0, 0, 1, 0])))),
    "good: limits for all": options(*CHAIN, "-bs_break_strain", "0.5", "-bs_break_uniform", "0.1,3", "-bs_break", "worst"),
    "good: periodic box": boxed(),
    "good: periodic box, strained": boxed(unshifted, options=("-bs_box_strain", "xy=velocity:0.1")),
    "good: HDF5, laws by name": hdf5(both(put("springs/law", np.array([0, 1, 2, 3])), put("springs/stiffness_3", np.ones(4)), put("springs/yield_force", np.ones(4)),
                                          put("springs/plastic_stretch", np.array([np.nan, 0, 0, 0.1]))), spring_laws=["strain", "tension", "polynomial", "plastic"]),
    "good: polynomial chain": options(*CHAIN, "-bs_spring_law", "polynomial", "-bs_spring_stiffness_2", "0.25"),
    "good: trajectory": trajectory(),
    "good: xsp": scene(),
    "good: chain with anchors": options(*CHAIN, "-bs_anchor_particles", "0,4", "-bs_anchor_stiffness", "1"),
}

PERIODIC = ("-bs_lattice_type", "triangular", "-bs_lattice_size", "4,4")


def statics(*more):
    return options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_task", "statics", *more)


BOX = {
    "boundary of one word": (boxed(boundary=("periodic",)), "attribute boundary of /box has 1 word; write 3, periodic or none along each edge"),
    "boundary unknown": (boxed(boundary=("periodic", "open", "none")), "attribute boundary of /box has 'open'; write periodic or none"),
    "no edges": (boxed(drop("box/edges")), "/box/edges is missing; write the edge vectors of the periodic box as rows [m]"),
    "edges in a row": (boxed(put("box/edges", np.ones((2, 3)))), "/box/edges has the wrong shape; write (3, 3)"),
    "edges in a plane": (boxed(put("box/edges", np.ones((3, 3)))), "/box/edges: the edges span no volume"),
    "edges that are not finite": (boxed(put("box/edges", np.diag([6.0, 4, np.nan]))), "/box/edges: the edges span no volume"),
    "shifts of another d": (boxed(put("springs/shift", np.zeros((4, 2), int))), "/springs/shift: shape (4, 2), needs (4, 3)"),
    "shift too far": (boxed(both(unshifted, put("springs/shift", 64, (1, 0)))), "spring 1, /springs/shift: a shift of 64 boxes; write -63 to 63"),
    "shift without an absolute value": (boxed(both(unshifted, put("springs/shift", -2**63, (1, 0)))), "row 1 holds a whole number of 2^63 - 1 or more in size"),
    "shift beyond 63 the other way": (boxed(both(unshifted, put("springs/shift", -64, (1, 0)))), "spring 1, /springs/shift: a shift of -64 boxes; write -63 to 63"),
    "shift along an open edge": (boxed(both(unshifted, put("springs/shift", 1, (2, 1))), ("periodic", "none", "periodic")), "spring 2, /springs/shift: a shift of 1 boxes; write 0 along edges that are not periodic"),
    "two images equally near": (boxed(put("springs/pairs", [0, 3], 0)), "spring 0: two images of particle 3 are equally near to particle 0, so it is not known which one it joins; write /springs/shift"),
    "particle joined to itself": (boxed(both(unshifted, put("springs/pairs", [1, 1], 1))), "joins particle 1 to itself"),
    "angle spring between equal images": (boxed(bent([3, 0, 1])), "angle spring 0: two images of particle 3 are equally near to particle 0, so it is not known which one it joins; write /angles/shift"),
    "angle spring too far": (boxed(both(bent([0, 1, 2]), put("angles/shift", np.full((1, 9), 64)))), "angle spring 0, /angles/shift: a shift of 64 boxes; write -63 to 63"),
    "angle spring over the world": (boxed(both(bent([0, 1, 2]), put("angles/shift", np.repeat([[-40, 0, 40]], 3, 1)))), "angle spring 0: its ends are more than 63 boxes apart"),
    "angle spring with one image twice": (boxed(both(bent([1, 0, 1]), put("angles/shift", np.ones((1, 9), int)))), "angle spring 0, /angles/triples: names particle 1 twice"),
    "shifts of two ends": (boxed(both(bent([0, 1, 2]), put("angles/shift", np.ones((1, 6), int)))), "/angles/shift: shape (1, 6), needs (1, 9)"),
    "repeated along an axis it has not": (options(*PERIODIC, "-bs_lattice_periodic", "z"), "-bs_lattice_periodic z: a triangular lattice is repeated along x and y: write x, y or xy"),
    "repeated along one axis twice": (options(*PERIODIC, "-bs_lattice_periodic", "xx"), "-bs_lattice_periodic xx"),
    "odd number of shifted rows": (options("-bs_lattice_type", "triangular", "-bs_lattice_size", "4,5", "-bs_lattice_periodic", "xy"), "5 rows of a triangular lattice do not repeat along y"),
    "more springs removed than there are": (options(*PERIODIC, "-bs_lattice_remove_fraction", "1.2"), "-bs_lattice_remove_fraction 1.2: write a share from 0 to 1"),
    "share of springs that is none": (options(*PERIODIC, "-bs_lattice_remove_fraction", "-0.2"), "-bs_lattice_remove_fraction -0.2: write a number >= 0"),
    "rule of pruning that is none": (options(*PERIODIC, "-bs_lattice_prune", "loose"), "option -bs_lattice_prune"),
    "nothing left after pruning": (options(*PERIODIC, "-bs_lattice_remove_fraction", "1", "-bs_lattice_prune", "dangling"), "no particle is left: remove fewer springs, or write -bs_lattice_prune none"),
    "rows anchored where rows change": (options(*PERIODIC, "-bs_lattice_prune", "dangling", "-bs_anchor_particles", "3", "-bs_anchor_stiffness", "1"), "write -bs_group_NAME ids:... and -bs_anchor_group NAME"),
    "strain without a box": (options(*PERIODIC, "-bs_box_strain", "xy=velocity:1"), "option -bs_box_strain: triangular lattice 4 x 4, 6 neighbours has no periodic box"),
    "strain of a missing component": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_strain", "xz=velocity:1"), "option -bs_box_strain: xz: the lattice has 2 dimensions"),
    "strain without a component": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_strain", "velocity:1"), "option -bs_box_strain: 'velocity:1': write components such as xy=velocity:0.01"),
    "strain given twice": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_strain", "xy=velocity:1,xy=velocity:2"), "option -bs_box_strain: xy: the component is given twice"),
    "rate that is none": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_rate", "xy=fast"), "option -bs_box_rate: xy: 'fast' is no finite number: write components with their rates"),
    "strain and rate of one component": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_rate", "xx=1", "-bs_box_strain", "xx=velocity:1"), "option -bs_box_rate: xx: the component is given twice: write each once, as a strain, a rate or a stress"),
    "strain and stress of one component": (statics("-bs_box_stress", "xx=1", "-bs_box_strain", "xx=velocity:1"), "option -bs_box_stress: xx: the component is given twice"),
    "stress that is none": (statics("-bs_box_stress", "xx=free"), "option -bs_box_stress: xx: say under which stress it is free: write components with their stress at full load"),
    "stress under which the box could turn": (statics("-bs_box_stress", "xy=0,yx=0"), "option -bs_box_stress: xy: with yx free as well the box could turn: leave one of them out"),
    "stress along an open edge": (options(*PERIODIC, "-bs_lattice_periodic", "y", "-bs_task", "statics", "-bs_box_stress", "xx=0"), "option -bs_box_stress: xx: the box is not periodic along x, where no stress acts"),
    "stress in a motion": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_stress", "xx=0"), "option -bs_box_stress does not go with -bs_task dynamics: give -bs_task statics"),
    "stress in modes about the start": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_stress", "xx=0", "-bs_task", "modes"), "option -bs_box_stress does not go with -bs_modes_about start"),
    "strain that is none": (options(*PERIODIC, "-bs_lattice_periodic", "xy", "-bs_box_strain", "xy=fast"), "option -bs_box_strain: xy: 'fast' is no motion of a component"),
}

BREAKING = {
    "limit 0": (hdf5(put("springs/critical_strain", np.array([0.1, 0, 1, 2]))), "spring 1, /springs/critical_strain: 0; write a number > 0"),
    "limit that is no number": (hdf5(put("springs/critical_force", np.array([0.1, 1, np.nan, 2]))), "spring 2, /springs/critical_force: nan; write a number > 0"),
    "cross-section 0": (hdf5(put("springs/area", np.array([1e-4, 1e-4, 0, 1e-4]))), "spring 2, /springs/area: 0; write a finite area > 0"),
    "limits of fewer springs": (hdf5(put("springs/critical_energy", np.array([0.1, 1]))), "/springs/critical_energy"),
    "half broken": (hdf5(put("springs/broken", np.array([0.5, 0, 0, 0]))), "spring 0, /springs/broken: 0.5; write 1 (broken) or 0"),
    "negative strain": (options(*CHAIN, "-bs_break_strain", "-1"), "option -bs_break_strain"),
    "no strain at rest length 0": (options(*CHAIN, "-bs_lattice_rest_length_factor", "0", "-bs_break_strain", "0.1"), "has the rest length 0, so that it has no strain"),
    "two scatters": (options(*CHAIN, "-bs_break_strain", "1", "-bs_break_weibull", "5,1", "-bs_break_uniform", "0.1,1"), "-bs_break_weibull and -bs_break_uniform: give one of them"),
    "scatter without a seed": (options(*CHAIN, "-bs_break_strain", "1", "-bs_break_weibull", "5"), "option -bs_break_weibull: give the modulus, > 0, and a whole number as the seed"),
    "scatter beyond 1": (options(*CHAIN, "-bs_break_strain", "1", "-bs_break_uniform", "1.5,1"), "option -bs_break_uniform: give the half width, between 0 and 1"),
    "spared group that is not there": (options(*CHAIN, "-bs_break_strain", "1", "-bs_break_spare", "edge"), "option -bs_break_spare: there is no group edge"),
    "negative moment": (options(*CHAIN, "-bs_break_angle_moment", "-1"), "option -bs_break_angle_moment"),
    "limit of hinges without hinges": (options(*CHAIN, "-bs_break_hinge_change", "1"), "option -bs_break_hinge_change: the lattice has no hinges: leave it out"),
    "with springs, and nothing to go along": (options(*CHAIN, "-bs_break_strain", "1", "-bs_break_with_springs"), "option -bs_break_with_springs: the lattice has neither angle springs nor hinges"),
    "with springs that do not break": (options("-bs_lattice_type", "square", "-bs_lattice_size", "4,4", "-bs_angle_stiffness", "1", "-bs_break_with_springs"),
                                       "option -bs_break_with_springs: no spring may break: give a limit of springs"),
    "side that is none": (options(*CHAIN, "-bs_break_strain", "1", "-bs_break_in", "shear"), "option -bs_break_in"),
    "notch in a chain": (options(*CHAIN, "-bs_break_notch", "0,0,1,1"), "option -bs_break_notch: notches are for lattices in 2 dimensions"),
    "notch of three numbers": (options("-bs_lattice_type", "triangular", "-bs_lattice_size", "4,4", "-bs_break_notch", "0,0,1"), "option -bs_break_notch: give four numbers"),
    "notch beside the lattice": (options("-bs_lattice_type", "triangular", "-bs_lattice_size", "4,4", "-bs_break_notch", "90,90,91,91"), "option -bs_break_notch: no spring crosses that line"),
}

GROUPS = {"springs that break": BREAKING, "periodic boxes": BOX, "HDF5 lattice": HDF5, "angle springs and hinges": ANGLES, "XSpringies scene": XSP, "options of lattices": OPTIONS}

if __name__ == "__main__":
    sys.exit(corpus.main(__doc__, GROUPS, GOOD, step=STEP))
