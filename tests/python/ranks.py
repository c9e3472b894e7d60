"""Calls that are wrong on one rank, or raise there, end on all."""
import os
import pathlib
import subprocess
import sys
import tempfile

from cases import SQUARE
from helpers import HERE, PYTHON, python


def on_two_ranks():
    """An exception of one rank ends the call on all; many sessions end with the interpreter; changes of one rank's frame are all ranks'."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "square.msh").write_text(SQUARE)
        done = python(f"""
import backspring as bs
from mpi4py import MPI
comm, rank = MPI.COMM_WORLD, MPI.COMM_WORLD.rank
net = bs.read("{folder}/square.msh", stiffness=100, mass=1.0)
assert comm.allgather(net.pairs.tolist()) == [net.pairs.tolist()] * 2 and len(net) == 4
said = ""
try: bs.read("{folder}/square.msh", stiffness=100, mass=1.0 + rank)
except bs.InputError as error: said = str(error)
assert "mass" in said, said
try: bs.read("{folder}/none.msh", stiffness=100)
except bs.InputError as error: said = str(error)
assert "no such file" in said, said
""", 2, timeout=60)
        assert done.returncode == 0, done.stdout + done.stderr
    head = f"import sys; sys.path.insert(0, {str(HERE)!r}); import backspring as bs, numpy as np; from mpi4py import MPI; from cases import sheet; rank = MPI.COMM_WORLD.rank; net = bs.Lattice(**sheet()); say = lambda *words: [print(one) for one in MPI.COMM_WORLD.gather(' '.join(map(str, words))) or []]; "
    for code, expected in (('''
def forces(t, x, v, rows):
    if rank == 1 and t > 0.0045: raise KeyError("here")
    return 0 * x
simulation = bs.Simulation(net, dt=1e-3, forces=forces)
try: simulation.run_until(1.0)
except Exception as error: say(rank, type(error).__name__, simulation.steps)
''', ["0 Stopped 4", "1 KeyError 4"]), ('''
def stop(step, *_):
    if rank == 0 and step == 3: raise KeyError("here")
simulation = bs.Simulation(net, dt=1e-3)
simulation.on_step(stop)
try: simulation.step(10)
except Exception as error: say(rank, type(error).__name__)
''', ["0 KeyError", "1 Stopped"]), ('''
all = [bs.Simulation(net, dt=1e-3) for _ in range(12)]
for one in all: one.step()
del all
say(rank, "ended")
''', ["0 ended", "1 ended"]), ('''
simulation = bs.Simulation(net, dt=1e-3)
simulation.step()
try: stepper = simulation.petsc()
except ImportError as error: say(rank, error); raise SystemExit
from petsc4py import PETSc
try: stepper.getSNES().getJacobian()[0].getDiagonalBlock()
except PETSc.Error as error: said = error.ierr > 0
try: stepper.getSNES().getKSP().setType("nix")
except PETSc.Error as error: simulation.step(); say(rank, simulation.steps, said, error.ierr > 0)
''', ["0 2 True True", "1 2 True True"]), ('''
last = None
for frame in bs.run(net, dt=1e-3, until=4e-3, every=2e-3):
    if rank == 0 and frame.t > 1e-3 and last is None: frame.v *= 0.5
    last = frame.t
say(rank, last)
''', ["0 0.004", "1 0.004"]), ('''
def raises(s, state):
    if rank == 1 and s > 0.4: raise KeyError("here")
for name in ("observe", "stop"):
    try: bs.statics(net, loads={"bottom": (0, -1.0)}, load_steps=4, **{name: raises})
    except Exception as error: say(rank, name, type(error).__name__)
''', ["0 observe Stopped", "0 stop Stopped", "1 observe KeyError", "1 stop KeyError"]), ('''
simulation, told = bs.Simulation(net, dt=1e-3, bs_motion_bottom="given"), []
for call in (lambda: simulation.set("velocity", net.x[:3] if rank else net.x), lambda: simulation.set("velocity", net.x * (np.nan if rank else 1)),
             lambda: simulation.change(stiffness=[1.0, 2] if rank else 5.0), lambda: simulation.drive("bottom", net.x[: 2 if rank else 7], 1.0),
             lambda: bs.statics(net, loads={"bottom": (0, -1.0)}, total=["nix"] if rank else False), lambda: bs.statics(net, observe=3 if rank else None),
             lambda: bs.statics(net, load_steps=2.5 if rank else 2), lambda: bs.Statics(net, load_steps=2.5 if rank else 2),
             lambda: bs.modes(net, 2.5 if rank else 2), lambda: bs.moduli(net, load_steps=2.5 if rank else 2),
             lambda: bs.run(net, dt=1e-3, until="a" if rank else 1.0, progress=True), lambda: bs.run(net, dt=1e-3, until=1.0, every=-1 if rank else 0.1),
             lambda: bs.Simulation(net, dt=1e-3, stop=3 if rank else None), lambda: simulation.drive("nix" if rank else "bottom", net.x[:7], 1.0),
             lambda: simulation.drive("bottom", net.x[:7], np.nan if rank else 1.0), lambda: simulation.step(-1 if rank else 1),
             lambda: simulation.run_until(np.nan if rank else 1.0), lambda: simulation.get("nix" if rank else "position"),
             lambda: bs.Statics(net).sensitivities(np.zeros(3 if rank else net.x.shape))):
    try: call()
    except bs.InputError as error: told.append(str(error).startswith("rank 1: ") == (rank == 0))
simulation.step()
for call in (lambda: simulation.step(2 + rank), lambda: simulation.run_until(1.0 + rank), lambda: simulation.drive("bottom", net.x[:7], 1.0 + rank),
             lambda: simulation.set("velocity", net.x * (1.0 + rank)), lambda: simulation.set("velocity", net.x[simulation.rows], whole=rank == 0)):
    try: call()
    except bs.InputError as error: told.append("rank 1 gives something else" in str(error))
simulation.step()
say(rank, len(told), all(told), simulation.steps)
''', ["0 24 True 2", "1 24 True 2"]), ('''
net = bs.Lattice([[0.0, 0], [1, 0], [2, 0]], [[0, 1], [1, 2]], stiffness=1.0, rest_length=1.0, fixed=[0], groups={"end": [2]})
half = bs.statics(net, loads={"end": (1.0, 0)}, load_steps=4, bs_motion_end="y=fixed", stop=lambda s, eq: s > 0.4)
say(rank, *(round(bs.modes(half, 3, comm=comm).omega2[1], 6) for comm in (None, MPI.COMM_SELF)))
''', ["0 0.666667 0.666667", "1 0.666667 0.666667"]), ('''
import os, shutil, tempfile
folder = MPI.COMM_WORLD.bcast(tempfile.mkdtemp())
for one in (net, bs.statics(net)): one.plot(f"{folder}/{type(one).__name__}.png")
frames = list(bs.run(net, dt=1e-3, until=1.0, ts_max_steps=3))
frames[0].plot(f"{folder}/Frame{rank}.png")
MPI.COMM_WORLD.barrier()
say(rank, len(frames), *sorted(os.listdir(folder)))
if rank == 0: shutil.rmtree(folder)
''', [f"{rank} 4 Equilibrium.png Frame0.png Frame1.png Lattice.png" for rank in (0, 1)])):
        done = subprocess.run(["mpirun", "-n", "2", sys.executable, "-c", head + code], capture_output=True, text=True, timeout=120, env=dict(os.environ, PYTHONPATH=PYTHON))
        found = sorted(done.stdout.splitlines())
        if "simulation.petsc()" in code and "was built without petsc4py" in done.stdout:  # that of another PETSc is there, or none
            expected = [line for rank, line in enumerate(found) if line.startswith(f"{rank} the extension")]
        assert done.returncode == 0 and found == expected, done.stdout + done.stderr
