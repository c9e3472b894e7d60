#!/usr/bin/env python3
"""PETSc's own test of the assembled Jacobian, law by law and at several states, and the ways to do without it."""
import pathlib
import re
import tempfile

import numpy as np
from harness import Checks, write_lattice
from program import run

STEPS = 3


def cloud(folder, name, d, springs, **extra):
    """Free particles of unequal mass with velocities of both signs; a few springs between them if asked for."""
    rng = np.random.default_rng(d)
    n = 7
    x = rng.uniform(-1, 1, (n, d)) + 2 * np.arange(n)[:, None]
    pairs = [(i, i + 1) for i in range(n - 1)] + [(0, 3)] if springs else None
    path = pathlib.Path(folder) / f"{name}{d}.h5"
    write_lattice(path, x, rng.uniform(0.2, 3, n), velocity=rng.uniform(-2, 2, (n, d)), radius=np.full(n, 0.05), pairs=pairs,
                  fixed=[0] * (n - 1) + [1], **extra)
    return path


def laws(d):
    zero, some = (0.0,) * d, (0.3, -0.2, 0.5)[:d]
    springs = {"stiffness": 30.0, "damping": 2.0}
    anchors = {"particle": [1, 2], "point": np.ones((2, d)), "stiffness": [20.0, 30.0], "rest_length": [0.5, 0.0],
               "damping": [1.0, 0.0]}
    yield "hooke springs, axial dampers", dict(springs, spring_law="hooke", damping_law="axial"), {}
    yield "strain springs, simple dampers", dict(springs, spring_law="strain", damping_law="simple"), {}
    yield "cables", dict(springs, rest_length=[1.5, 3.5, 1.0, 4.0, 0.8, 3.0, 5.0], spring_law="tension"), {}
    softening = dict(springs, rest_length=2.0, spring_law="polynomial", columns={"stiffness_2": -30.0, "stiffness_3": 4.0})
    yield "polynomial springs, some softening", softening, {}
    yielding = dict(stiffness=30.0, rest_length=2.0, spring_law="plastic", columns={"yield_force": 2.0, "hardening": 6.0, "plastic_stretch": 0.1})
    yield "plastic springs", yielding, {}
    relaxing = dict(springs, rest_length=2.0, spring_law="maxwell", columns={"relaxation_time": 0.08, "viscous_stretch": 0.1})
    yield "maxwell springs", relaxing, {}
    mixed = dict(springs, rest_length=2.0, laws=["hooke", "strain", "tension", "polynomial", "plastic", "maxwell", "plastic"],
                 columns={"stiffness_2": -10.0, "stiffness_3": 4.0, "yield_force": 3.0, "hardening": 0.0, "relaxation_time": 0.05})
    yield "springs of every law", mixed, {}
    yield "zero rest length", dict(stiffness=30.0, rest_length=0.0, damping=0.0), {}
    yield "driven anchors", {"anchors": anchors}, {"bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": some,
                                                  "bs_anchor_frequency": 3.0}
    yield "central gravity", {}, {"bs_central_G": 1.0, "bs_central_M0": 50.0, "bs_central_point": (-4.0,) * d}
    yield "two central masses", {}, {"bs_central_G": 1.0, "bs_central_M0": 50.0, "bs_central_point": (-4.0,) * d, "bs_central_M0_b": 300.0, "bs_central_point_b": (40.0,) * d}
    yield "Stokes drag", {}, {"bs_stokes_drag": 3.0}
    yield "drag of each particle", {"particle_columns": {"drag": np.linspace(0, 6, 7)}}, {"bs_stokes_drag": 0.5}
    yield "drag per mass", {}, {"bs_viscosity": 2.0}
    yield "sphere drag", {}, {"bs_sphere_drag": True, "bs_sphere_drag_rho": 900.0, "bs_sphere_drag_mu": 1.0, "bs_fluid_velocity": some}
    yield "sphere in a liquid", {}, {"bs_sphere_drag": True, "bs_sphere_drag_rho": 900.0, "bs_sphere_drag_mu": 1.0, "bs_gravity": some, "bs_buoyancy": True, "bs_added_mass": 0.5}
    yield "shape drag", {}, {"bs_shape_drag": "cube", "bs_shape_drag_rho": 900.0, "bs_shape_drag_area": 0.01,
                             "bs_fluid_velocity": zero}
    if d == 2:
        yield "attraction", {}, {"bs_xsp_attraction": 300.0, "bs_xsp_attraction_exponent": 1.5, "bs_xsp_attraction_center": (-3, 1)}
        yield "attraction to a particle", {}, {"bs_xsp_attraction": 300.0, "bs_xsp_attraction_exponent": 1.5, "bs_xsp_center_particle": 2}
        yield "centre of mass", {}, {"bs_xsp_center_of_mass": 40.0, "bs_xsp_center_of_mass_damping": 7.0}
        yield "centre of mass, to a particle", {}, {"bs_xsp_center_of_mass": 40.0, "bs_xsp_center_of_mass_damping": 7.0, "bs_xsp_center_particle": 1}
        yield "walls", {}, {"bs_xsp_walls": 500.0, "bs_xsp_walls_exponent": 1.0, "bs_xsp_walls_box": (-20, 40, -20, 40), "bs_xsp_walls_sides": (1, 1, 1, 1)}


def differences(checks, folder):
    for d in (1, 2, 3):
        for name, lattice, options in laws(d):
            path = cloud(folder, re.sub(r"\W", "_", name), d, "stiffness" in lattice, **lattice)
            # a step that yielded ends on the edge of the elastic range, where differences may see either slope: later iterates, of which
            # springs on a line, linear piece by piece, have few
            edges = "plastic" in (lattice.get("laws") or [lattice.get("spring_law")])
            result = run(checks.program, dict(options, bs_lattice_file=path, ts_dt=0.05, ts_max_steps=STEPS * (4 if edges else 1), ts_type="beuler",
                                              snes_test_jacobian=True, snes_monitor=True, ts_adapt_type="none"), ranks=checks.ranks)
            found, iteration = [], 0
            for line in result.stdout.splitlines():
                at, error = re.match(r"\s*(\d+) SNES Function norm", line), re.search(r"\|\|J - Jfd\|\|_F/\|\|J\|\|_F = (\S+),", line)
                iteration = int(at[1]) if at else iteration
                if error and not (edges and iteration == 0):
                    found.append(float(error[1]))
            # one-sided differences of step 1e-8 leave 1e-7; a wrong sign leaves 1e-2 and more
            checks.true(f"{name}, d = {d}: {len(found)} states", len(found) >= (1 if edges and d == 1 else STEPS) and max(found) < 2e-6, f"{max(found, default=9):.1e}")


def alternatives(checks, folder):
    """Matrix-free and coloured Jacobians, Krylov solvers and the low-rank operator reach the direct solve's motion."""
    path = cloud(folder, "alternatives", 2, True, stiffness=30.0, damping=2.0, spring_law="strain")
    base = dict(bs_lattice_file=path, bs_gravity=(0, -9.8), bs_xsp_center_of_mass=40.0, bs_xsp_center_of_mass_damping=7.0, ts_dt=0.05,
                ts_max_time=0.5, ts_type="beuler")
    expected = run(checks.program, base, interval=0.5, ranks=checks.ranks).trajectory.position[-1]
    for name, options in (("-snes_mf", {"snes_mf": True}), ("-snes_mf_operator", {"snes_mf_operator": True}),
                          ("-snes_fd_color", {"snes_fd_color": True}), ("-snes_fd", {"snes_fd": True}),
                          ("GMRES + ILU", {"ksp_type": "gmres", "pc_type": "bjacobi", "sub_pc_type": "ilu"}),
                          ("BAIJ", {"mat_type": "baij", "ksp_type": "gmres", "pc_type": "bjacobi"}),
                          ("low-rank operator", {"bs_dense_coupling_max": 0, "ksp_type": "gmres", "pc_type": "bjacobi", "ksp_rtol": 1e-10})):
        found = run(checks.program, dict(base, **options), interval=0.5, ranks=checks.ranks).trajectory.position[-1]
        checks.below(name + " against the direct solve", np.abs(found - expected).max() / np.abs(expected).max(), 1e-7)


def spring_laws(checks, folder):
    """The same for springs of every law."""
    for name, lattice, _ in laws(2):
        if not (lattice.get("laws") or lattice.get("spring_law") in ("tension", "polynomial", "plastic", "maxwell")):
            continue
        path = cloud(folder, "ways", 2, True, **lattice)
        base = dict(bs_lattice_file=path, bs_gravity=(0, -9.8), ts_dt=0.02, ts_max_time=0.4, ts_type="beuler", snes_rtol=1e-10)
        expected = run(checks.program, base, interval=0.4, ranks=checks.ranks).trajectory.position[-1]
        for way, options in (("-snes_mf", {"snes_mf": True}), ("-snes_mf_operator", {"snes_mf_operator": True}), ("-bs_tangent definite", {"bs_tangent": "definite"}),
                             ("absolute curvatures", {"condensed_pc_type": "bicc"}),
                             ("full Jacobian", {"bs_operator": "assembled", "pc_type": "lu", "ksp_type": "preonly"} if checks.ranks == 1 else {"snes_linesearch_type": "energy"})):
            found = run(checks.program, dict(base, **options), interval=0.4, ranks=checks.ranks).trajectory.position[-1]
            checks.below(f"{name}, {way} against the chosen solver", np.abs(found - expected).max() / np.abs(expected).max(), 1e-7)


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        differences(checks, folder)
        spring_laws(checks, folder)
        alternatives(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
