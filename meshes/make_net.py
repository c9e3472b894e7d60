#!/usr/bin/env python3
"""Writes net.xsp: a net of 12 x 8 masses that hangs by its top corners. Usage: make_net.py [file]"""
import os
import sys

NX, NY, H = 12, 8, 30.0      # columns, rows, mesh width [px]
X0, TOP = 156.0, 500.0       # top left corner, in a window of 642 x 550 with y pointing up

def mass_id(i, j):           # column i, row j from the top
    return j * NX + i + 1

lines = ["#1.0 a net that hangs by its top corners, written by make_net.py",
         "cent -1", "frce 0 1 10.0 0.0", "visc 0.1", "step 0.025", "wall 0 0 0 0"]
for j in range(NY):
    for i in range(NX):
        fixed = j == 0 and i in (0, NX - 1)
        lines.append(f"mass {mass_id(i, j)} {X0 + H * i} {TOP - H * j} 0.0 0.0 {-1.0 if fixed else 1.0} 1.0")
pairs = [(mass_id(i, j), mass_id(i + 1, j)) for j in range(NY) for i in range(NX - 1)]
pairs += [(mass_id(i, j), mass_id(i, j + 1)) for j in range(NY - 1) for i in range(NX)]
for k, (a, b) in enumerate(pairs, 1):
    lines.append(f"spng {k} {a} {b} 200.0 1.0 {H}")

target = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "net.xsp")
with open(target, "w") as out:
    out.write("\n".join(lines) + "\n")
