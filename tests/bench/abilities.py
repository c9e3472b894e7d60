#!/usr/bin/env python3
"""Linear solves of one shape with and without an ability: angle springs, a periodic box, given motions, springs that bear tension alone, breaking.

Krylov iterations for six digits of one Newton step (K), with the ability and without it. --check: with it at most 1.5 times as many, for small
shapes on one rank and on three; counts, so that a busy machine does not matter.
"""
import argparse
import pathlib
import sys
import tempfile

from shapes import REPO, SOLVERS, cloth, cubic, solve

MOST = 1.5
SHAPES = {"cube 16 x 16 x 16": cubic((16, 16, 16), 25), "cube, h omega 250": cubic((16, 16, 16), 250), "beam 4 x 4 x 250": cubic((4, 4, 250), 240, 1e-5),
          "plate 40 x 40 x 3": cubic((40, 40, 3), 24000, 1e-6, "xmin"), "cloth 60 x 60": cloth(60),
          "cube 12, 10 % of the springs 10^4 stiffer": cubic((12, 12, 12), 25, bs_lattice_stiff_fraction=0.1, bs_lattice_stiff_factor=1e4),
          "cube 12, 30 % of the springs removed": cubic((12, 12, 12), 250, bs_lattice_remove_fraction=0.3)}


def spacing_and_stiffness(options):
    stiffness = options["bs_lattice_stiffness"]
    return options["bs_lattice_spacing"], stiffness if isinstance(stiffness, tuple) else (stiffness,)


def free(options):
    """Nothing is held; particles are a little out of place, so that there is something to solve."""
    return dict({name: value for name, value in options.items() if not name.startswith("bs_lattice_fixed")}, bs_lattice_perturbation=1e-4)


def boxed(options):
    return dict(free(options), bs_lattice_periodic="".join(axis for axis, n in zip("xyz", options["bs_lattice_size"]) if n > 4))


def without_drag(change):
    """A fluid at rest and a box that flows exclude each other."""
    return lambda options: {name: value for name, value in change(options).items() if name != "bs_stokes_drag"}


def angles(part):
    def add(options):
        spacing, stiffness = spacing_and_stiffness(options)
        return dict(options, bs_angle_stiffness=part * stiffness[0] * spacing)
    return add


def stretched(law):
    """Springs of Hooke's law, or of its tension alone, in a periodic box that stretches all of them."""
    def change(options):
        spacing, stiffness = spacing_and_stiffness(options)
        return dict(boxed(options), bs_spring_law=law, bs_lattice_stiffness=tuple(k / spacing for k in stiffness), bs_lattice_rest_length_factor=0.9)
    return change


def driven(motion):
    """The last layer of a body moves as given; of a cloth, whose corners are held, the corners."""
    def add(options):
        size = options["bs_lattice_size"]
        given = dict(options, bs_group_end="zmax" if size[-1] > 4 and len(size) == 3 else "xmax", bs_motion_end=motion)
        if len(size) < 3:
            corners = given.pop("bs_lattice_fixed_particles")
            given["bs_group_end"] = "ids:" + ",".join(str(row) for row in corners)
        return given
    return add


# name: (with the ability, what it is compared with)
ABILITIES = {"soft angle springs": (angles(0.01), dict), "stiff angle springs": (angles(1), dict), "periodic box": (boxed, free),
             "strained box": (without_drag(lambda options: dict(boxed(options), bs_box_rate="xx=0.001")), without_drag(free)),
             "driven end": (driven("velocity:0.001,0,0"), dict), "rollers": (driven("x=velocity:0.001,y=free,z=free"), dict),
             "tension alone": (stretched("tension"), stretched("hooke")),
             "may break": (lambda options: dict(options, bs_break_strain=0.5), dict)}
# Where sides are free, or springs pull unevenly, some that bear tension alone become slack: another net, with fewer springs.
SLACK = {("beam 4 x 4 x 250", "tension alone"), ("cube 12, 10 % of the springs 10^4 stiffer", "tension alone")}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(REPO / "build" / "release" / "backspring"))
    parser.add_argument("--ranks", default="1,3")
    parser.add_argument("--filter", default="", help="only shapes and abilities whose name contains this")
    parser.add_argument("--check", action="store_true")
    a = parser.parse_args()
    program = str(pathlib.Path(a.program).resolve())
    wrong = []
    print("| shape | ability | ranks | K with it | without |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for shape, options in SHAPES.items():
            for ability, changes in ABILITIES.items():
                for ranks in (int(r) for r in a.ranks.split(",")):
                    if a.filter not in f"{shape}, {ability}" or (a.check and (shape, ability) in SLACK):
                        continue
                    found = [solve(program, dict(change(options), **SOLVERS["default"]), ranks, pathlib.Path(folder), 300) for change in changes]
                    cells = [one.get("failed") or format(one["K"], ".1f") for one in found]
                    fine = all("K" in one for one in found) and found[0]["K"] <= MOST * found[1]["K"]
                    print(f"| {shape} | {ability} | {ranks} | {cells[0]} | {cells[1]} |", flush=True)
                    if not fine:
                        wrong.append(f"{shape}, {ability}, {ranks}")
    sys.exit(f"more than {MOST} times the iterations: {wrong}" if wrong and a.check else 0)


if __name__ == "__main__":
    main()
