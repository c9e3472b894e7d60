#!/usr/bin/env python3
"""Links planted where a run will write, and input files whose numbers lie in other files: nothing is followed.
--shim: the library that notes and swaps the files a run creates."""
import os
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "faults"))
import h5py
import numpy as np
from runs import BLOCK, frames, run, run_parts, told, write_lattice

RUN = dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_max_time=0.1, bs_output="o.h5md", bs_checkpoint="ck", bs_checkpoint_every=3, bs_report="r.json")
VALUE = b"something of value\n"


def guessed_names(checks, folder):
    """Names that could be guessed lead to a file of value: it stays, and so do the links."""
    victim = folder / "victim"
    names = [n + t for n in ("o.h5md", "o.h5md.xdmf", "r.json", "ck", "ck.previous") for t in (".tmp", ".new", "~")]
    for ranks in (1, 2):
        victim.write_bytes(VALUE)
        for name in names:
            (folder / name).unlink(missing_ok=True)
            (folder / name).symlink_to(victim)
        code, _, err = run(checks, folder, dict(RUN, bs_overwrite=True), ranks)
        checks.true(f"links at temporary names, {ranks} rank(s): the run ends well", code == 0 and frames(folder / "o.h5md") == 5, err.strip()[:120])
        checks.true(f"and the file they lead to is untouched, {ranks} rank(s)", victim.read_bytes() == VALUE and all((folder / n).is_symlink() for n in names))


def planted_names(checks, folder):
    """A link at a name that the program gives by itself, or a dangling one at a name it was given."""
    victim = folder / "victim"
    victim.write_bytes(VALUE)
    for name, target in (("o.h5md.xdmf", victim), ("ck.previous", victim), ("o.h5md.lock", victim), ("ck.lock", folder / "none"), ("r.json.lock", victim),
                         ("o.h5md", folder / "none"), ("ck", folder / "none"), ("r.json", folder / "none")):
        link = folder / name
        link.symlink_to(target)
        for ranks in ((1, 3) if name in ("ck.previous", "o.h5md") else (1,)):
            code, _, err = run(checks, folder, dict(RUN, bs_overwrite=True), ranks)
            checks.true(f"a link at {name}, {ranks} rank(s): exit 2, one line", code == 2 and len(told(err)) == 1 and name in told(err)[0], f"exit {code}: {err.strip()[:140]}")
        checks.true(f"a link at {name}: nothing is touched", link.is_symlink() and victim.read_bytes() == VALUE and not (folder / "none").exists())
        link.unlink()
    link = folder / "o.h5md.checkpoint"
    link.symlink_to(victim)
    code, _, err = run(checks, folder, {k: v for k, v in RUN.items() if not k.startswith("bs_checkpoint")})
    checks.true("a link at o.h5md.checkpoint", code == 2 and link.name in err and victim.read_bytes() == VALUE, err.strip()[:140])
    link.unlink()


def created(checks, folder, shim):
    """Every temporary file: O_EXCL and O_NOFOLLOW, in the same folder, another name each time."""
    names = []
    for k in range(2):
        log = folder / f"log{k}"
        code, _, err = run(checks, folder, dict(RUN, bs_overwrite=True), extra={"LD_PRELOAD": shim, "BS_CREATED": str(log)})
        checks.true("a run whose files are noted", code == 0, err.strip()[:120])
        lines = [line.split(None, 1) for line in log.read_text().splitlines()]
        # (MPI-IO puts files of its own beside what it opens, under longer names)
        ours = [(int(flags, 8), name) for flags, name in lines if re.search(r"(^|/)(o\.h5md|o\.h5md\.xdmf|ck|ck\.previous|r\.json)\.[0-9a-f]{16}\.(tmp|tail)$", name)]
        wanted = os.O_EXCL | os.O_NOFOLLOW | os.O_CREAT
        checks.true("all created with O_EXCL and O_NOFOLLOW", len(ours) > 8 and all(flags & wanted == wanted for flags, _ in ours), f"{len(ours)} files")
        checks.true("in the folder of the file itself", all(pathlib.Path(name).resolve().parent == folder.resolve() or "/" not in name for _, name in ours))
        names += [name for _, name in ours]
    checks.true("no name comes twice", len(set(names)) == len(names), f"{len(names)} names, for example {names[0]}")
    checks.true("none is left", not list(folder.glob("*.tmp")))


def swapped(checks, folder, shim):
    """The file just created is exchanged for a link to another HDF5 file before it is opened by its name."""
    for name, option in (("o.h5md.", "bs_output"), ("ck.", "bs_checkpoint")):
        with h5py.File(folder / "victim.h5", "w") as f:
            f["numbers"] = np.arange(100.0)
        kept = (folder / "victim.h5").read_bytes()
        for ranks in (1, 2):
            options = dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_max_time=0.1, **{option: name[:-1]})
            code, _, err = run(checks, folder, options, ranks, extra={"LD_PRELOAD": shim, "BS_SWAP": name, "BS_SWAP_TO": str(folder / "victim.h5")})
            checks.true(f"-{option}, {ranks} rank(s): exchanged for a link: refused", code in (2, 4) and len(told(err)) == 1, f"exit {code}: {' '.join(told(err))[:140]}")
            checks.true(f"-{option}, {ranks} rank(s): the other file is untouched", (folder / "victim.h5").read_bytes() == kept)
            for old in folder.glob(name + "*"):
                old.unlink()


def lattice(path):
    x = np.array([[k, 0.0] for k in range(6)])
    return write_lattice(path, x, 1.0, pairs=[[k, k + 1] for k in range(5)], stiffness=100.0, rest_length=1.0, damping=0.1, fixed=[1, 0, 0, 0, 0, 0])


def external(path, name, other):
    """The numbers of `name` from the raw file `other`."""
    with h5py.File(path, "r+") as f:
        shape = f[name].shape
        np.asarray(f[name][...], "<f8").tofile(other)
        del f[name]
        f.create_dataset(name, shape, "<f8", external=[(str(other), 0, h5py.h5f.UNLIMITED)])


def links(path, name, other, soft=False):
    lattice(other)
    with h5py.File(path, "r+") as f:
        del f[name]
        f["extra/way" if soft else name] = h5py.ExternalLink(str(other), "/" + name)
        if soft:
            f[name] = h5py.SoftLink("/extra/way")


def virtual(path, name, other):
    lattice(other)
    with h5py.File(path, "r+") as f:
        shape = f[name].shape
        del f[name]
        layout = h5py.VirtualLayout(shape, "f8")
        layout[...] = h5py.VirtualSource(str(other), name, shape)
        f.create_virtual_dataset(name, layout)


def packed(path, name, kind):
    with h5py.File(path, "r+") as f:
        values = f[name][...]
        del f[name]
        f.create_dataset(name, data=values, chunks=True, compression=kind)


def inputs(checks, folder):
    other = folder / "other.h5"
    mass, pairs = "particles/mass", "springs/stiffness"
    cases = [("external storage", lambda p: external(p, mass, folder / "raw"), mass, "external storage"),
             ("external storage of an optional dataset", lambda p: external(p, "springs/damping", folder / "raw"), "springs/damping", "external storage"),
             ("external link", lambda p: links(p, mass, other), mass, "link to another file"),
             ("external link by a soft one", lambda p: links(p, mass, other, True), mass, "link to another file"),
             ("external link to an optional dataset", lambda p: links(p, "springs/damping", other), "springs/damping", "link to another file"),
             ("external link to a group", lambda p: links(p, "springs", other), "springs", "link to another file"),
             ("virtual dataset", lambda p: virtual(p, pairs, other), pairs, "virtual dataset"),
             ("lzf", lambda p: packed(p, mass, "lzf"), mass, "filter lzf")]
    options = {"ts_dt": 0.01, "ts_max_time": 0.02, "bs_progress_interval": -1, "bs_lattice_file": "l.h5"}
    for name, spoil, dataset, words in cases:
        lattice(folder / "l.h5")
        spoil(folder / "l.h5")
        for ranks in ((1, 3) if dataset == mass else (1,)):
            code, _, err = run(checks, folder, options, ranks)
            lines = told(err)
            checks.true(f"{name}, {ranks} rank(s): exit 2, one line that names the dataset", code == 2 and len(lines) == 1 and "/" + dataset in lines[0] and words in lines[0], f"exit {code}: {err.strip()[:160]}")
    for name, change in (("gzip", lambda p: packed(p, mass, "gzip")), ("a soft link within the file", lambda p: soften(p, mass))):
        lattice(folder / "l.h5")
        change(folder / "l.h5")
        code, _, err = run(checks, folder, options)
        checks.true(f"{name} is read", code == 0, err.strip()[:120])


def soften(path, name):
    with h5py.File(path, "r+") as f:
        f.move(name, "elsewhere")
        f[name] = h5py.SoftLink("/elsewhere")


def continued(checks, folder):
    """A trajectory to be gone on with, and a checkpoint, whose parts lie in other files."""
    code, _, err = run(checks, folder, RUN)
    checks.true("first part", code == 0, err.strip()[:120])
    whole, state = (folder / "o.h5md").read_bytes(), (folder / "ck").read_bytes()
    for part in ("backspring/log/newton", "observables/kinetic_energy"):
        with h5py.File(folder / "victim.h5", "w") as v, h5py.File(folder / "o.h5md", "r+") as f:
            f.copy(part, v, "part")
            del f[part]
            f[part] = h5py.ExternalLink(str(folder / "victim.h5"), "/part")
        kept = (folder / "victim.h5").read_bytes()
        code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.2})
        checks.true(f"a trajectory with a link at {part}: exit 2", code == 2 and len(told(err)) == 1 and part in told(err)[0], f"exit {code}: {err.strip()[:160]}")
        checks.true("the file it leads to is untouched", (folder / "victim.h5").read_bytes() == kept)
        (folder / "o.h5md").write_bytes(whole)
    with h5py.File(folder / "o.h5md", "r+") as f:
        rows = len(f["backspring/log/newton"])
        del f["backspring/log/newton"]
        (folder / "victim").write_bytes(VALUE * 40)
        f.create_dataset("backspring/log/newton", (rows,), "<i8", external=[(str(folder / "victim"), 0, h5py.h5f.UNLIMITED)])
    code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.2})
    checks.true("a trajectory with external storage: exit 2, the other file untouched", code == 2 and (folder / "victim").read_bytes() == VALUE * 40, f"exit {code}: {err.strip()[:160]}")
    (folder / "o.h5md").write_bytes(whole)
    for part in ("state/position", "options", "run"):
        (folder / "ck").write_bytes(state)
        (folder / "other.h5").write_bytes(state)
        with h5py.File(folder / "ck", "r+") as f:
            del f[part]
            f[part] = h5py.ExternalLink(str(folder / "other.h5"), "/" + part)
        for ranks in ((1, 3) if part == "options" else (1,)):
            code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.2}, ranks)
            checks.true(f"a checkpoint with a link at {part}, {ranks} rank(s): exit 2", code == 2 and len(told(err)) == 1, f"exit {code}: {err.strip()[:160]}")


if __name__ == "__main__":
    run_parts(__doc__, (guessed_names, planted_names, created, swapped, inputs, continued), library="--shim", with_library=(created, swapped,))
