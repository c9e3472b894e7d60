#!/usr/bin/env python3
"""A truss beam in two dimensions, clamped at its left end: make_lattice.py [beam.h5]. An example of the lattice file."""
import sys

try:
    import h5py
    import numpy as np
except ImportError:
    sys.exit("make_lattice.py: needs h5py: sudo apt-get install python3-h5py, then /usr/bin/python3 " + sys.argv[0])

columns, side = 20, 0.1                                                        # bays, length of a side [m]
x, y = np.meshgrid(np.arange(columns + 1), [0, 1], indexing="ij")
position = side * np.stack([x.ravel(), y.ravel()], axis=1)                     # particle 2i below, 2i + 1 above
bays = [(2 * i, 2 * i + 2) for i in range(columns)] + [(2 * i + 1, 2 * i + 3) for i in range(columns)]
posts = [(2 * i, 2 * i + 1) for i in range(columns + 1)]
diagonals = [(2 * i, 2 * i + 3) for i in range(columns)] + [(2 * i + 1, 2 * i + 2) for i in range(columns)]
pairs = np.array(bays + posts + diagonals, dtype=np.int64)

with h5py.File(sys.argv[1] if len(sys.argv) > 1 else "beam.h5", "w") as f:
    f["particles/position"] = position                                         # (N, d) [m]
    f["particles/mass"] = np.full(len(position), 0.01)                         # (N) [kg]
    f["particles/fixed"] = (position[:, 0] == 0).astype(np.uint8)              # (N) 1: held still
    f["springs/pairs"] = pairs                                                 # (M, 2) rows of position, from 0
    f["springs/stiffness"] = np.full(len(pairs), 2000.0)                       # (M) [N/m]
    f["springs/damping"] = np.full(len(pairs), 0.2)                            # (M) [kg/s]
    f.attrs["spring_law"], f.attrs["damping_law"] = "hooke", "axial"
