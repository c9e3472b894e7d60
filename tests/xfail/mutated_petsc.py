#!/usr/bin/env python3
"""PETSc-binary matrices and vectors that somebody has damaged: flipped bytes, truncation, absurd numbers.

  mutated_petsc.py --program build/release/backspring [--ranks 1] [--count 60] [--seed 1] [--filter WORD] [--jobs 2]

What is done and asked for is told in mutated_hdf5.py. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import sys

import mutated_hdf5
import numpy as np
import scipy.sparse

SIZE = 12


def matrices():
    """G and C of a diffusing chain, the state it starts from."""
    G = scipy.sparse.diags([-np.ones(SIZE - 1), 3 * np.ones(SIZE), -np.ones(SIZE - 1)], [-1, 0, 1], format="csr")
    return {"G": G, "C": scipy.sparse.identity(SIZE, format="csr"), "x0": np.linspace(0, 1, SIZE)}


def binary(thing):
    if isinstance(thing, np.ndarray):
        return np.array([1211214, len(thing)], ">i4").tobytes() + thing.astype(">f8").tobytes()
    head = np.array([1211216, *thing.shape, thing.nnz], ">i4")
    return head.tobytes() + np.diff(thing.indptr).astype(">i4").tobytes() + thing.indices.astype(">i4").tobytes() + thing.data.astype(">f8").tobytes()


def write(name):
    def all_of_them(path):
        for other, thing in matrices().items():
            (path.parent / f"{other}.bin").write_bytes(binary(thing))
        assert path.name == f"{name}.bin"
    return all_of_them


def read(path):
    folder = path.parent
    return ["-bs_model", "linear", "-bs_linear_G", folder / "G.bin", "-bs_linear_C", folder / "C.bin", "-bs_linear_x0", folder / "x0.bin",
            "-ts_type", "beuler"]


def damage(path, number, seed):
    chance = np.random.default_rng([seed, number])
    edits = [mutated_hdf5.flip, mutated_hdf5.truncate, mutated_hdf5.absurd_number, swapped_number, mutated_hdf5.swap, mutated_hdf5.zero]
    edit = edits[number % len(edits)]
    path.write_bytes(bytes(edit(bytearray(path.read_bytes()), chance)))
    return edit.__name__


def swapped_number(content, chance):
    """An integer of the file's first half becomes a small one, negative ones among them."""
    at = 4 * int(chance.integers(0, len(content) // 8))
    content[at:at + 4] = int(chance.integers(-3, 2 * SIZE)).to_bytes(4, "big", signed=True)
    return content


if __name__ == "__main__":
    mutated_hdf5.FILES = {f"{name}.bin": (write(name), read) for name in ("G", "C", "x0")}
    mutated_hdf5.damage = damage
    mutated_hdf5.STEP = ["-ts_dt", "1e-2", "-ts_max_steps", "1"]
    sys.exit(mutated_hdf5.main(__doc__))
