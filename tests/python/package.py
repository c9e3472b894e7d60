#!/usr/bin/env python3
"""The Python package by itself: its errors, states that are written back, observers, interruptions, sessions side by side, memory, pictures, tools."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from helpers import HERE, PYTHON, python, raised  # noqa: E402

import backspring as bs  # noqa: E402
import numpy as np  # noqa: E402
from analyses import balanced, breaking_turns, changed_numbers, closed_forms, flat_nets, held_groups, load_steps, modes_where_it_stands, rests  # noqa: E402
from motions import every_step, interrupted, observers, remembered, side_by_side, so_many_steps, without_steps, written_back  # noqa: E402
from ends_of_runs import dragged, ends_of_calls, ends_of_tables, given_back, long_boxes, names_of_checkpoints, strained_starts, told_apart, what_estimates_miss  # noqa: E402
from own_laws import barriers, coupled, flying_pair, implicit_forces, in_petsc, own_forces, random_forces  # noqa: E402
from own_pairs import between_on_ranks, between_particles  # noqa: E402
from ranks import on_two_ranks  # noqa: E402
from three_ranks import balanced_on_ranks, kicked_on_ranks, loops_at_the_end, loops_left  # noqa: E402
from refusals import bad_arguments, copied, failures, misuse, told_once  # noqa: E402
from cases import MESHES, SQUARE, cell, parts, sheet  # noqa: E402
from copies import bound, found_alone, frames_alone, pooled, views  # noqa: E402
from design import bent, designed, followed, followed_on_ranks, on_ranks, sensitivities, soft_beside_stiff  # noqa: E402
from crossings import after_failures, followed_boxes, forces_in_no_file, from_equilibria, led, losses, removed, without_tangent  # noqa: E402
from paths_and_boxes import first_moments, images, load_factors, skewed, said_plainly, steps_of_loads, strained_boxes, where_motions_begin  # noqa: E402
from shown import flowing_boxes, modes_about, read_only, solvers_that_ended, without_an_end  # noqa: E402
from states import foreign_states, healed, histories, removed_for_good, restored, resumed, room  # noqa: E402
from warned import flags, misspelt, so_many_modes, told_at_the_end, told_by_analyses, told_by_the_interpreter  # noqa: E402


def files():
    """Networks go to files and come back as they were, also those that the program has read or generated."""
    with tempfile.TemporaryDirectory() as folder:
        diamond = bs.generate("diamond", (2, 2, 2), periodic="xyz", perturbation=0.05)
        for k, net in enumerate((bs.Lattice(**sheet()), bs.Lattice(**cell()), bs.Lattice(**parts()), bs.read(MESHES / "net.xsp"), diamond)):
            net.save(f"{folder}/{k}.h5")
            back = bs.read(f"{folder}/{k}.h5")
            for name, value in vars(net).items():
                found = getattr(back, name)
                for key in value if isinstance(value, dict) else ():
                    assert np.array_equal(value[key], found[key]), (k, name, key)
                assert isinstance(value, dict) or name == "parallel" or np.array_equal(value, found), (k, name, value, found)
            assert back.parallel  # files may have such springs
            assert repr(back) == repr(net)
        with raised(bs.InputError, "0.h5"):
            back.save(f"{folder}/0.h5")
        back.save(f"{folder}/0.h5", overwrite=True)
        assert len(bs.read(f"{folder}/0.h5")) == len(diamond) == 64 and diamond.periodic == (True, True, True)
        with raised(bs.InputError, "nowhere.h5"):
            bs.read(f"{folder}/nowhere.h5")
        with raised(bs.InputError, "bs_lattice_sise"):
            bs.generate("chain", 5, sise=3)
        mesh = pathlib.Path(folder) / "square.msh"
        mesh.write_text(SQUARE)
        square = bs.read(mesh, stiffness=100, total_mass=2.0, fixed=["held"], bs_group_top="ymax")
        assert square.pairs.shape == (5, 2) and set(square.groups) >= {"held", "plate", "top"} and square.fixed.tolist() == [True, True, False, False], square.groups
        assert (square.stiffness == 100).all() and np.allclose(square.mass, 0.5) and np.allclose(square.lengths().max(), 2**0.5) and square.dim == 2
        assert bs.read(mesh, stiffness=100, mass=1, dim=3, bs_gravity=None).dim == 3
        for words, options in (("stiffnes_", dict(stiffnes_=1)), ("positive", dict(stiffness=1, mass=-1)), ("bs_group_tip", dict(stiffness=1, mass=1, bs_group_tip="zmax_"))):
            with raised(bs.InputError, words):
                bs.read(mesh, **options)
        with raised(bs.InputError, "nowhere.msh: no such file"):
            bs.read(f"{folder}/nowhere.msh", stiffness=1)
        with raised(bs.InputError, "stiffness", "replace"):
            bs.read(f"{folder}/0.h5", stiffness=3)
    part = parts()
    for words, more in ((("anchors['particle'], row 1",), dict(anchors={**part["anchors"], "particle": [0, 6]})), (("anchors", "'spot'"), dict(anchors={"spot": 1})),
                        (("angles['triples']", "(n, 3)"), dict(angles={**part["angles"], "triples": [[0, 1]]})), (("hinges", "quads"), dict(hinges={"stiffness": 1.0})),
                        (("hinges['stiffness'], row 0",), dict(hinges={**part["hinges"], "stiffness": np.nan})), (("area, row 0", "positive"), dict(area=0.0))):
        with raised(bs.InputError, *words):
            bs.Lattice(**{**part, **more})
    with raised(bs.InputError, "critical_stress"):
        bs.Simulation(bs.Lattice(**{**part, "breaking": {"critical_stress": 1.0}}), dt=1e-3)


def memory():
    """A thousand solves in one process."""
    net = bs.Lattice(**sheet())
    resident = lambda: int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    for _ in range(100):
        bs.statics(net, loads={"bottom": (0, -1.0)})
    before = resident()
    for _ in range(1000):
        bs.statics(net, loads={"bottom": (0, -1.0)})
    grown = resident() - before
    assert grown < 1e6, f"{grown} bytes in 1000 solves"


def pictures_and_tools():
    with tempfile.TemporaryDirectory() as folder:
        eq = bs.statics(bs.Lattice(**sheet()), loads={"bottom": (0, -1.0)})
        eq.plot(f"{folder}/state.png")
        assert os.path.getsize(f"{folder}/state.png") > 20000
        for frame in bs.run(bs.Lattice(**sheet()), dt=1e-3, until=5e-3, every=1e-3, bs_output=f"{folder}/run.h5md"):
            last = frame
        run = bs.open(f"{folder}/run.h5md")
        assert np.array_equal(run.position(len(run.times) - 1), last.x)
        done = subprocess.run([sys.executable, "-m", "backspring", "plot", f"{folder}/run.h5md", "-o", f"{folder}/energy.png", "--kind", "energy"],
                              capture_output=True, text=True, env=dict(os.environ, PYTHONPATH=PYTHON))
        assert done.returncode == 0 and os.path.exists(f"{folder}/energy.png"), done.stderr


def documented():
    """The commands of the page run as they stand."""
    page = (HERE.parents[1] / "src/python/README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", page, re.S)
    assert blocks
    with tempfile.TemporaryDirectory() as folder:
        done = python(blocks[0], cwd=folder, timeout=120)
        assert done.returncode == 0 and len(done.stdout.splitlines()) >= 8 and os.path.exists(f"{folder}/state.png"), done.stdout + done.stderr


def imported():
    """Without a launcher, ended without a word, and without the options of a file that lies in the home folder or in the working one."""
    done = python("import sys, backspring; print([name for name in ('mpi4py', 'h5py', 'matplotlib') if name in sys.modules])", timeout=60)
    assert done.stdout == "[]\n", done.stdout + done.stderr
    with tempfile.TemporaryDirectory() as home:
        for name in (".petscrc", "petscrc"):
            (pathlib.Path(home) / name).write_text("-options_left\n-options_view\n")
        done = python("import backspring as bs; s = bs.Simulation(bs.Lattice([0.0, 1.0], [[0, 1]]), dt=0.1); s.step()", timeout=60, cwd=home,
                      env=dict(os.environ, PYTHONPATH=PYTHON, HOME=home))
    assert done.returncode == 0 and done.stdout + done.stderr == "", done.stdout + done.stderr


def main():
    chosen = sys.argv[sys.argv.index("--filter") + 1] if "--filter" in sys.argv else ""
    for part in (on_two_ranks, on_ranks, balanced_on_ranks, kicked_on_ranks, loops_left, loops_at_the_end, pooled, followed_on_ranks, between_on_ranks, foreign_states, healed, resumed, told_by_the_interpreter,  # before this process starts MPI
                 after_failures, led, losses, removed, from_equilibria, without_tangent, followed_boxes, forces_in_no_file,
                 bad_arguments, copied, closed_forms, changed_numbers, restored, removed_for_good, told_at_the_end, told_by_analyses, flags, misspelt, so_many_modes, modes_where_it_stands, rests, histories, room, sensitivities, bent, designed, followed, soft_beside_stiff, load_steps, flat_nets, breaking_turns, written_back, told_once, ends_of_calls, ends_of_tables, names_of_checkpoints, given_back, long_boxes, what_estimates_miss, told_apart, strained_starts, dragged, load_factors, steps_of_loads, where_motions_begin, first_moments, images, skewed, strained_boxes, said_plainly, read_only, modes_about, without_an_end, flowing_boxes, solvers_that_ended, own_forces, implicit_forces, random_forces, barriers, flying_pair, between_particles, coupled, in_petsc, files, misuse, every_step, so_many_steps, frames_alone, found_alone, bound, views, held_groups, balanced, remembered, without_steps, observers, interrupted, side_by_side, failures, memory, pictures_and_tools, documented, imported):
        if chosen in part.__name__:
            begin = time.time()
            part()
            print(f"{part.__name__}: ok, {time.time() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
