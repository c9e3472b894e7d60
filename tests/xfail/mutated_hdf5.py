#!/usr/bin/env python3
"""HDF5 files that somebody has damaged: flipped bytes, truncation, other types, absurd sizes.

  mutated_hdf5.py --program build/release/backspring [--ranks 1] [--count 60] [--seed 1] [--filter WORD] [--jobs 2]

Every file of FILES is read whole once (it must run), then changed `count` times, by a generator with a fixed seed. Asked
for: an end within 60 s; exit code 0 (the change does no harm), 2, or 3 (numbers that are legal and cannot be computed with);
with 2 or 3 exactly one line of error, with 2 one that names the file; no "PETSC ERROR", no crash that is told as the
program's own; and no more memory than the whole file takes, but for 64 MB (a process may not even ask for 1 GB).
Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import sys

try:
    import h5py
    import numpy as np
except ImportError as missing:
    sys.exit(f"{missing}\nneeded: apt install python3-h5py python3-numpy, and run with /usr/bin/python3")

import argparse
import concurrent.futures
import itertools
import os
import pathlib
import resource
import subprocess
import tempfile

import bad_lattices
from program import environment

PROGRAM = None  # set by main
TIMEOUT = 60  # [s]
MARGIN = 64 * 1024  # [kB]
MOST = 1 << 30  # [bytes] a process may ask for
STEP = ["-ts_type", "euler", "-ts_dt", "1e-4", "-ts_max_steps", "1"]


# --- the whole files ------------------------------------------------------------------------------------------------------

def lattice(path, version="earliest", **how):
    with h5py.File(path, "w", libver=version) as file:
        for name, value in bad_lattices.tables().items():
            file.create_dataset(name, data=value, **how)
        file["particles/velocity"] = np.zeros((5, 3))
        file["particles/fixed"] = np.array([1, 0, 0, 0, 0], bool)
        file["springs/rest_length"] = np.ones(4)
        file.attrs["spring_law"] = "strain"
        file.attrs["damping_law"] = np.string_("axial")


def trajectory(path):
    with h5py.File(path, "w") as file:
        for name, value in {"particles/trajectory/position/value": np.arange(27.0).reshape(3, 3, 3),
                            "particles/trajectory/velocity/value": np.zeros((3, 3, 3)), "particles/trajectory/mass": np.ones(3),
                            "particles/trajectory/id": np.arange(3), "connectivity/bonds": np.array([[0, 1], [1, 2]]),
                            "connectivity/bonds_stiffness": np.ones(2), "connectivity/bonds_rest_length": np.ones(2)}.items():
            chunked = value.ndim == 3
            file.create_dataset(name, data=value, **(dict(chunks=(1, 3, 3), maxshape=(None, 3, 3)) if chunked else {}))
        file.create_group("parameters/options").attrs["bs_spring_law"] = "hooke"
        file.create_group("particles/trajectory/box").attrs["dimension"] = 3


CHAIN = ["-bs_lattice_type", "chain", "-bs_lattice_size", "5"]


def checkpoint(path):
    """Written by the program itself, on one rank."""
    code, said, _ = run(PROGRAM, 1, [*CHAIN, "-bs_checkpoint", path, *STEP], path.parent)
    assert code == 0 and path.exists(), said


def read_as_restart(path):
    return [*CHAIN, "-bs_restart", path]


def read_as_lattice(path):
    return ["-bs_lattice_file", path]


# name: who writes the whole file, and the words that make the program read it
FILES = {
    "lattice.h5": (lattice, read_as_lattice),
    "newest.h5": (lambda path: lattice(path, "latest"), read_as_lattice),
    "packed.h5": (lambda path: lattice(path, chunks=True, compression="gzip", shuffle=True, fletcher32=True), read_as_lattice),
    "run.h5md": (trajectory, read_as_lattice),
    "state.h5": (checkpoint, read_as_restart),
}


# --- the damage -----------------------------------------------------------------------------------------------------------

def flip(content, chance):
    """A few bytes become others."""
    for at in chance.integers(0, len(content), chance.integers(1, 9)):
        content[at] ^= chance.integers(1, 256)
    return content


def flip_metadata(content, chance):
    """As flip, but among bytes that are not zero and at the beginning, where the descriptions are."""
    used = np.flatnonzero(np.frombuffer(bytes(content), np.uint8)[:4096])
    for at in chance.choice(used, chance.integers(1, 5)):
        content[at] ^= 1 << chance.integers(0, 8)
    return content


def truncate(content, chance):
    return content[:chance.integers(0, len(content))]


def absurd_number(content, chance):
    """A number of 1 to 8 bytes becomes very large, or minus something."""
    width = int(chance.choice([1, 2, 4, 8]))
    at = int(chance.integers(0, len(content) - width))
    number = [2**(8 * width) - 1, 2**(8 * width - 1), 2**(8 * width - 1) - 1, 2**(4 * width)][chance.integers(4)]
    content[at:at + width] = number.to_bytes(width, "little")
    return content


def swap(content, chance):
    """A block of 16 to 256 bytes is written over another."""
    size = int(chance.integers(16, 257))
    source, target = (int(at) for at in chance.integers(0, max(1, len(content) - size), 2))
    content[target:target + size] = content[source:source + size]
    return content


def zero(content, chance):
    """A block never reached the disk."""
    at = int(chance.integers(0, len(content)))
    size = int(chance.integers(1, 600))
    content[at:at + size] = bytes(len(content[at:at + size]))
    return content


BYTES = [flip, flip_metadata, truncate, absurd_number, swap, zero]
TYPES = ["i1", ">i8", "u8", "f2", ">f4", "f8", "S5", "c16", "V7", h5py.string_dtype(), h5py.vlen_dtype("f8"), h5py.ref_dtype,
         np.dtype([("a", "i4"), ("b", "f8")]), np.dtype(("f8", (3,))), h5py.enum_dtype({"no": 0, "yes": 1})]




def retype(path, chance):
    """A dataset of another type, or of an absurd size that nobody wrote, or of another shape."""
    with h5py.File(path, "a") as file:
        names = datasets_of(file)
        name = names[chance.integers(len(names))]
        shape = file[name].shape
        del file[name]
        kind = chance.integers(4)
        if kind == 0:
            file.create_dataset(name, shape, TYPES[chance.integers(len(TYPES))])
        elif kind == 1:
            file.create_dataset(name, (10**int(chance.integers(6, 15)),) + shape[1:], "f8", chunks=(1,) + (1,) * len(shape[1:]))
        elif kind == 2:
            file.create_dataset(name, (2**int(chance.integers(25, 34)),) * max(1, len(shape)), "i8", chunks=(64,) * max(1, len(shape)), compression="gzip")
        else:
            file.create_dataset(name, tuple(chance.integers(0, 7, chance.integers(0, 5))), "i8")


def datasets_of(file):
    names = []
    file.visititems(lambda name, thing: names.append(name) if isinstance(thing, h5py.Dataset) else None)
    return names


def damage(path, number, seed):
    """Changes the file; returns what was done."""
    chance = np.random.default_rng([seed, number])
    if number % 5 == 4:
        retype(path, chance)
        return "another type or size"
    edit = BYTES[number % len(BYTES)]
    path.write_bytes(bytes(edit(bytearray(path.read_bytes()), chance)))
    return edit.__name__


# --- the runs -------------------------------------------------------------------------------------------------------------

def limit():
    resource.setrlimit(resource.RLIMIT_DATA, (MOST, MOST))


def run(program, ranks, words, folder):
    """Returns the exit code (None: did not end), what was said, and the largest process [kB]."""
    command = [str(word) for word in [*(["mpirun", "-n", ranks] if int(ranks) > 1 else []), program, *words, *STEP]]
    said = folder / "said"
    with open(said, "wb") as out:
        process = subprocess.Popen(["timeout", "--foreground", str(TIMEOUT), *command], cwd=folder, env=environment(int(ranks)),
                                   stdin=subprocess.DEVNULL, stdout=out, stderr=out, preexec_fn=limit)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return None if process.returncode == 124 else process.returncode, said.read_text(errors="replace"), usage.ru_maxrss


def faults(code, said, memory, most, name):
    if code is None:
        yield f"did not end within {TIMEOUT} s"
        return
    lines = [line for line in said.splitlines() if "backspring: error:" in line]
    if code not in (0, 2, 3):
        yield f"exit code {code}"
    if len(lines) != (1 if code else 0):
        yield f"exit code {code} with {len(lines)} lines of error"
    if code == 2 and not any(name in line for line in lines):
        yield f"the line does not name {name}"
    if "PETSC ERROR" in said:
        yield "a PETSc error came through"
    if "no memory" in said or "Out of memory" in said:
        yield "asked for more memory than there is"
    if memory > most:
        yield f"took {memory} kB, more than {most}"


def check(name, number, most, arguments):
    write, words = FILES[name]
    with tempfile.TemporaryDirectory(prefix="mutated_hdf5_") as folder:
        folder = pathlib.Path(folder)
        path = folder / name
        write(path)
        done = "whole" if number is None else damage(path, number, arguments.seed)
        code, said, memory = run(arguments.program, arguments.ranks, words(path), folder)
        wrong = list(faults(code, said, memory, most, name))
        if number is None and code != 0:
            wrong.append(f"the whole file is not read: exit code {code}")
        if wrong and arguments.keep:
            path.rename(arguments.keep / f"{number}_{name}")
    line = next((line for line in said.splitlines() if "backspring: error:" in line), "")
    return f"{name} {number}: {done}", wrong, code, line, said, memory


def main(doc=__doc__):
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--program", required=True, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--count", type=int, default=60, help="changes to each file")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--filter", default="", help="only files whose name holds this")
    parser.add_argument("--only", type=int, help="only the change of this number")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time")
    parser.add_argument("--keep", type=lambda path: pathlib.Path(path).resolve(), help="folder for the files that fail")
    parser.add_argument("--verbose", action="store_true", help="show each message")
    arguments = parser.parse_args()
    if not arguments.program.exists():
        sys.exit(f"{arguments.program}: no such program; build it first")

    global PROGRAM
    PROGRAM = arguments.program
    failed, ends = 0, {}
    names = [name for name in FILES if arguments.filter in name]
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        whole = list(pool.map(lambda name: check(name, None, float("inf"), arguments), names))
        most = max(row[-1] for row in whole) + MARGIN
        rows = [(name, number) for name in names for number in range(arguments.count) if arguments.only in (None, number)]
        for title, wrong, code, line, said, _ in itertools.chain(whole, pool.map(lambda row: check(*row, most, arguments), rows)):
            ends[code] = ends.get(code, 0) + 1
            if wrong or arguments.verbose:
                print(f"{'FAIL' if wrong else 'ok  '} {title}\n       {line}", flush=True)
            if wrong:
                failed += 1
                print("       " + "\n       ".join(wrong + said.splitlines()[:20]))
    total = sum(ends.values())
    print("; ".join(f"exit code {code}: {count}" for code, count in sorted(ends.items(), key=str)))
    print(f"{total - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed or not names else 0


if __name__ == "__main__":
    sys.exit(main())
