#!/usr/bin/env python3
"""Checkpoints from somebody else: what they name is not written, what chooses the method is taken, changed tables are noticed."""
import os
import pathlib
import re
import shutil
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "faults"))
import h5py
import numpy as np
from runs import BLOCK, difference, frames, run, run_parts, told, write_lattice
from watch import Watch

RUN = dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_max_time=0.1, bs_output="o.h5md", bs_checkpoint="ck", ksp_rtol=1e-9, condensed_pc_type="lu", condensed_pc_factor_mat_ordering_type="natural")
VALUE = b"something of value\n"
LEFT = "not taken over from it"


def forge(path, options):
    """Puts `options` into a checkpoint, with the checksum that belongs to them."""
    with h5py.File(path, "r+") as f:
        group = f["options"]
        for name, value in options.items():
            if name in group.attrs:
                del group.attrs[name]
            if value is not None:
                data = value.encode()
                group.attrs.create(name, np.array(data, f"S{max(1, len(data))}"))
        total = 0xcbf29ce484222325
        for name in sorted(group.attrs):
            for piece in (name.encode(), bytes(group.attrs[name])):
                for byte in (*piece, 0x100):
                    total = ((total ^ byte) * 0x100000001b3) % 2**64
        f.attrs.modify("options_checksum", np.int64(np.uint64(total)))


def made(checks, folder):
    code, _, err = run(checks, folder, RUN)
    checks.true("a checkpoint", code == 0, err.strip()[:120])
    return (folder / "ck").read_bytes(), (folder / "o.h5md").read_bytes()


def attacks(checks, folder):
    """Every option that could write a file or load code, each alone and all at once."""
    state, trajectory = made(checks, folder)
    loot = folder / "loot"
    loot.mkdir()
    victim = loot / "victim"
    v = str(victim)
    planted = {"bs_report": v, "BS_REPORT": v, "bs_output": v, "Bs_Output": v, "bs_checkpoint": v, "log_view": f":{v}", "log_view_memory": f":{v}", "log_trace": v, "log": v, "log_mpe": v,
               "ksp_view": f"ascii:{v}", "KSP_View": f"ascii:{v}", "snes_view": f"ascii:{v}", "ts_view": f"ascii:{v}", "mat_view": f"binary:{v}", "vec_view": f"hdf5:{v}",
               "condensed_ksp_view": f"ascii:{v}", "condensed_ksp_monitor": f"ascii:{v}", "ksp_monitor": f"ascii:{v}", "snes_monitor": f"ascii:{v}", "ts_monitor": f"ascii:{v}",
               "ts_monitor_solution": f"binary:{v}", "ts_monitor_solution_vtk": v + "%d.vts", "ksp_converged_reason": f"ascii:{v}", "snes_converged_reason": f"ascii:{v}",
               "ts_converged_reason": f"ascii:{v}", "options_view": f"ascii:{v}", "options_monitor": "", "dll_append": v, "dll_prepend": v, "options_file": v, "options_file_yaml": v,
               "info": v, "malloc_dump": v, "malloc_log": v, "objects_dump": "all", "on_error_attach_debugger": "gdb", "on_error_abort": "", "start_in_debugger": "gdb", "on_error_emacs": v,
               "ts_save_trajectory": "", "ts_trajectory_dirname": str(loot / "dir"), "ts_trajectory_type": "basic", "pc_python_type": "evil.PC", "snes_python_type": "evil.S",
               "pc_type": "python", "pc_mg_dump_binary": v, "mat_partitioning_view": f"ascii:{v}", "viewer_binary_filename": v, "citations": v, "saws_options": "", "history": v,
               "debugger_pause": "9", "mat_mumps_ooc_tmpdir": str(loot), "mat_mumps_icntl_22": "1", "x -bs_report": v, "ts_dt x": v, "ksp_type": f"ascii:{v}", "snes_linesearch_monitor": f"ascii:{v}",
               "snes_linesearch_monitor_update": f"ascii:{v}", "draw_save": v, "pc_hypre_euclid_filename": v, "dm_plex_filename": v, "vec_type": "../" + v}
    silent = {"options_file", "options_file_yaml"}
    for group in ([planted] + [{name: planted[name]} for name in ("bs_report", "ksp_view", "bs_output")]):
        name = next(iter(group)) if len(group) == 1 else f"{len(group)} options"
        for ranks in ((1, 2) if len(group) > 1 else (1,)):
            victim.write_bytes(VALUE)
            (folder / "ck").write_bytes(state)
            (folder / "o.h5md").write_bytes(trajectory)
            forge(folder / "ck", group)
            code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.15}, ranks)
            lines = [line for line in err.splitlines() if LEFT in line]
            checks.true(f"{name}, {ranks} rank(s): the run goes on", code == 0, f"exit {code}: {err.strip()[-160:]}")
            checks.true(f"{name}: nothing is written", victim.read_bytes() == VALUE and os.listdir(loot) == ["victim"], str(os.listdir(loot)))
            missing = [n for n in group if n not in silent and "-" + n not in "".join(lines)]
            checks.true(f"{name}: named in one line", len(lines) == 1 and not missing, str(missing))
    checks.true("nothing of it lies in this folder", not [p for p in folder.iterdir() if p.name not in ("ck", "ck.previous", "o.h5md", "o.h5md.xdmf", "loot")], str(os.listdir(folder)))


def listed(checks, folder):
    """What -help says of every task and model: {name without dash: (default, meaning)} of the program's own options, and of PETSc's."""
    own, others = {}, {}
    for more in ({}, {"bs_task": "statics"}, {"bs_task": "modes"}, {"bs_model": "linear"}, {"ksp_type": "gmres", "pc_type": "gamg"}):
        _, out, _ = run(checks, folder, dict(more, help=True))
        for line in out.splitlines():
            mine, other = re.match(r"  -(bs_\w+): <(.*?)>: (.*)", line), re.match(r" +-([a-z]\w+)\b(.*)", line)
            if mine:
                own[mine[1]] = mine.groups()[1:]
            elif other:
                others.setdefault(other[1], other[2])
    return own, others


def every_option(checks, folder):
    """Every option that -help lists and whose value is neither a number nor one of given words, as a checkpoint's, with a name elsewhere: the run opens,
    makes and changes nothing there, and names what it leaves out. Which options name files is not known to this test but by their help."""
    home, loot = folder / "home", folder / "loot"
    home.mkdir()
    loot.mkdir()
    own, others = listed(checks, home)
    words = {n: h for n, (d, h) in own.items() if not re.fullmatch(r"[-+0-9.e,inf]+|true|false", d) and "(one of " not in h}
    files = {n for n in words if re.search(r"\bFILE\b|[Ff]iles? (to|with|for|P_)|CSV|[Mm]atrix (Market|[GCB])|checkpoint to", words[n])}
    checks.true("options are listed", len(own) > 100 and len(words) > 20 and len(files) > 10 and len(others) > 300, f"{len(own)}, {len(words)} of words, {len(files)} of files, PETSc's {len(others)}")
    quiet = {"ts_dt": 0.01, "ts_max_time": 0.05, "bs_progress_interval": -1, "bs_advise": False, "bs_checkpoint": "ck", "bs_overwrite": True}
    bases = {"box": dict(quiet, bs_lattice_type="square", bs_lattice_size="4,4", bs_lattice_periodic="xy"), "net": dict(quiet, bs_lattice_type="square", bs_lattice_size="4,4", bs_group_g="xmin"),
             "statics": dict(quiet, bs_task="statics", bs_lattice_type="square", bs_lattice_size="4,4", bs_lattice_fixed="xmin", ts_dt=None, ts_max_time=None),
             "linear": dict(quiet, bs_model="linear", bs_linear_type="heat1d", bs_linear_size=4, bs_linear_source="step(1)")}
    made = {}
    for base, options in bases.items():
        code, _, err = run(checks, home, options)
        made[base] = (home / "ck").read_bytes()
        checks.true(f"a checkpoint, {base}", code == 0, err.strip()[:120])
    besides = {"bs_anchor_table": {"bs_anchor_motion": "table"}, "bs_lattice_file": {"bs_lattice_type": None, "bs_lattice_size": None}, "bs_linear_source_table": {"bs_linear_source": None}}
    victim = loot / "victim"
    (home / "way").symlink_to(victim)
    for name, help in words.items():
        base = "statics" if name.startswith(("bs_load", "bs_compliance")) else "linear" if name.startswith("bs_linear") else "box" if name.startswith("bs_box") else "net"
        forms = {"bs_force_NAME": ["table:{},0", "0,table:{},total"], "bs_motion_NAME": ["table:{}", "x=table:{},y=free"], "bs_box_strain": ["xx=table:{}"], "bs_box_stress": ["xx=table:{}"]}.get(name, ["{}"])
        for value in [form.format(path) for form in forms for path in ([victim, "way"] if name in files else [victim])]:
            victim.write_text("0,0,0\n9,0,0\n")
            (home / "ck").write_bytes(made[base])
            forge(home / "ck", {**besides.get(name, {}), name.replace("NAME", "g"): value})
            with Watch(loot) as watch:
                code, _, err = run(checks, home, {"bs_restart": "ck", "ts_max_time": None if base == "statics" else 0.06})
                touched = watch.names()
            told_of = "-" + name.replace("NAME", "g") in err and (LEFT in err or "somebody else" in err)
            checks.true(f"-{name} {value}: nothing there is opened or made{', and it is told' if name in files else ''}",
                        not touched and code in (0, 2) and (told_of or name not in files or name == "bs_restart"), f"exit {code}, {touched}: {err.strip()[-200:]}")
    show = {n for n, h in others.items() if re.search("saws|[Ff]ile|[Vv]iew|[Mm]onitor|[Dd]ump|[Pp]rint", h) and n not in ("help", "options_file", "options_file_yaml", "options_left")}
    for value in ("binary", "hdf5", "ascii", "draw"):
        (home / "ck").write_bytes(made["net"])
        forge(home / "ck", {n: value for n in show})
        before = set(os.listdir(home))
        code, _, err = run(checks, home, {"bs_restart": "ck", "ts_max_time": 0.06})
        missing = [n for n in show if f"-{n} {value}" not in err]
        checks.true(f"PETSc's {len(show)} options that view, print or name files, {value}: left out", len(show) > 60 and code == 0 and not missing and set(os.listdir(home)) <= before | {"ck.previous"}, f"exit {code}: {missing}")


def petscrc(checks, folder):
    """.petscrc and petscrc of the working folder and of the home: not opened, but where they are asked for."""
    home, work = folder / "home", folder / "work"
    home.mkdir()
    work.mkdir()
    code, _, err = run(checks, work, {"bs_lattice_type": "chain", "bs_lattice_size": 5, "ts_max_steps": 1, "bs_checkpoint": "ck"})
    state = (work / "ck").read_bytes()
    for at, name, size in ((work, ".petscrc", 7), (work, "petscrc", 8), (home, ".petscrc", 9)):
        (at / name).write_text(f"-bs_lattice_type chain\n-bs_lattice_size {size}\n-bs_report r{size}\n-dll_append ./evil.so\n")
    (work / "evil.so").write_bytes(b"")
    keywords = {"extra": {"HOME": str(home)}}
    for name, options, expected in (("no lattice", {"ts_max_steps": 1}, 2), ("-help", {"help": True}, 0), ("restart", {"bs_restart": "ck", "ts_max_steps": 2}, 0), ("version", {"bs_version": True}, 0)):
        for ranks in ((1, 2) if name == "restart" else (1,)):
            (work / "ck").write_bytes(state)
            with Watch(work) as watch, Watch(home) as other:
                code, out, err = run(checks, work, options, ranks, **keywords)
                touched = {n for n in watch.names() | other.names() if "petscrc" in n or "evil" in n}
            checks.true(f"{name}, {ranks} rank(s): none is opened", code == expected and not touched and "<7>" not in out and not list(work.glob("r?")), f"exit {code}, {touched} {err.strip()[:160]}")
    with h5py.File(work / "ck") as f:
        checks.true("and nothing is said of it in checkpoints", "skip_petscrc" not in f["options"].attrs)
    for file in (work / ".petscrc", work / "petscrc", home / ".petscrc"):
        file.write_text(file.read_text().replace("-dll_append ./evil.so\n", ""))
    code, out, err = run(checks, work, {"skip_petscrc": False, "ts_max_steps": 1}, **keywords)
    checks.true("-skip_petscrc false: they are read, the last one wins", code == 0 and (work / "r8").exists() and "\n8 particles" in out, f"exit {code}: {err.strip()[:160]}")


def taken(checks, folder):
    """What a run that goes on in the same folder takes: all that decides its course, in silence."""
    made(checks, folder)
    code, _, err = run(checks, folder, dict(RUN, ts_max_time=0.2, bs_output="full.h5md", bs_checkpoint=None))
    code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.2})
    checks.true("continued in silence", code == 0 and not err.strip(), err.strip()[:160])
    checks.true("as the undisturbed run, in every bit", difference(folder / "full.h5md", folder / "o.h5md")[1])
    with h5py.File(folder / "ck") as f:
        now = dict(f["options"].attrs)
    kept = [n for n in RUN if n in now]
    checks.true("its options are in force", len(kept) == len(RUN), str(set(RUN) - set(kept)))


def elsewhere(checks, folder):
    """The recorded trajectory and checkpoint: only beside the checkpoint given, and only if they are such."""
    (folder / "a").mkdir()
    (folder / "b").mkdir()
    a, b = folder / "a", folder / "b"
    code, _, err = run(checks, folder, dict(RUN, bs_output="a/o.h5md", bs_checkpoint="a/ck"))
    kept = (a / "o.h5md").read_bytes()
    shutil.copy(a / "ck", b / "ck")
    code, _, err = run(checks, folder, {"bs_restart": "b/ck", "ts_max_time": 0.2})
    line = "".join(x for x in err.splitlines() if LEFT in x)
    checks.true("a checkpoint carried elsewhere: trajectory and checkpoint of the other folder stay, and are named", code == 0 and (a / "o.h5md").read_bytes() == kept
                and "-bs_output a/o.h5md" in line and "-bs_checkpoint a/ck" in line, err.strip()[:160])
    code, _, err = run(checks, folder, {"bs_restart": "a/ck", "ts_max_time": 0.2})
    checks.true("with its folder named: both are gone on with", code == 0 and not err.strip() and frames(a / "o.h5md") == 9, err.strip()[:160])
    code, _, err = run(checks, a, {"bs_restart": "ck", "ts_max_time": 0.3})
    checks.true("from another folder the recorded names lead elsewhere: left out", code == 0 and LEFT in err and frames(a / "o.h5md") == 9, err.strip()[:160])
    state = (a / "ck").read_bytes()
    for name, make in (("a text", lambda p: p.write_bytes(VALUE)), ("a link", lambda p: p.symlink_to(folder / "value"))):
        (folder / "value").write_bytes(VALUE)
        for option in ("bs_checkpoint", "bs_output"):
            (b / "ck").write_bytes(state)
            forge(b / "ck", {"bs_checkpoint": "b/ck", "bs_output": None, option: "b/profile"})
            (b / "profile").unlink(missing_ok=True)
            make(b / "profile")
            code, _, err = run(checks, folder, {"bs_restart": "b/ck", "ts_max_time": 0.3})
            left = name == "a link" or option == "bs_checkpoint"
            checks.true(f"-{option} names {name} beside it: {'left out' if left else 'refused'}, untouched", (b / "profile").read_bytes() == VALUE and
                        (code == 0 and LEFT in err if left else code == 2 and "is not the trajectory" in err), f"exit {code}: {err.strip()[:200]}")


def tables(checks, folder):
    """Tables that options name: their contents are part of the checkpoint."""
    write_lattice(folder / "l.h5", [[0.0, 0.0], [1.0, 0.0]], 1.0, pairs=[[0, 1]], stiffness=100.0, rest_length=1.0,
                  anchors={"particle": [0], "point": [[0.0, 1.0]], "stiffness": [10.0], "rest_length": [0.5], "damping": [0.0]})
    common = {"ts_dt": 0.01, "ts_max_time": 0.1, "bs_progress_interval": -1, "bs_advise": False, "bs_overwrite": True, "bs_output": "o.h5md", "bs_checkpoint": "ck"}
    heat = dict(common, bs_model="linear", bs_linear_type="heat1d", bs_linear_size=4)
    (folder / "x.txt").write_text("a\nb\nc\nd\n")
    for name, option, text, changed, options in (
            ("anchors' table", "bs_anchor_table", "0,0,0\n1,0.1,0\n", "0,0,0\n1,0.2,0\n", dict(common, bs_lattice_file="l.h5", bs_anchor_motion="table")),
            ("sources' table", "bs_linear_source_table", "0,0\n1,1\n", "0,0\n1,2\n", heat),
            ("labels", "bs_linear_labels", "a\nb\nc\nd\n", "a\nb\nc\ne\n", dict(heat, bs_linear_source="step(1)"))):
        table = folder / "t.csv"
        for ranks in (1, 2):
            table.write_text(text)
            code, _, err = run(checks, folder, dict(options, **{option: "t.csv"}), ranks)
            checks.true(f"{name}, {ranks} rank(s): first part", code == 0, err.strip()[:120])
            state, whole = (folder / "ck").read_bytes(), (folder / "o.h5md").read_bytes()
            table.write_text(changed)
            code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.2}, ranks)
            checks.true(f"{name}, {ranks} rank(s), changed: exit 2, one line", code == 2 and len(told(err)) == 1 and "-" + option in told(err)[0] and "changed" in told(err)[0], f"exit {code}: {err.strip()[:160]}")
            checks.true(f"{name}: nothing is touched", (folder / "ck").read_bytes() == state and (folder / "o.h5md").read_bytes() == whole)
            code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.15, option: "t.csv"}, ranks)
            checks.true(f"{name}, {ranks} rank(s), changed and named anew: goes on, and says so", code == 0 and "other contents of -" + option in err, f"exit {code}: {err.strip()[:160]}")
            (folder / "ck").write_bytes(state)
            (folder / "o.h5md").write_bytes(whole)
            table.write_text(text)
            code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.2}, ranks)
            checks.true(f"{name}, {ranks} rank(s), as it was: goes on in silence", code == 0 and not err.strip(), err.strip()[:160])


    pair = dict(common, bs_lattice_type="square", bs_lattice_size="3,3", bs_group_g="xmin", bs_motion_g="x=table:t.csv,y=table:u.csv")
    for name in ("t.csv", "u.csv"):
        for file in ("t.csv", "u.csv"):
            (folder / file).write_text("0,0\n1,0.1\n")
        code, _, err = run(checks, folder, pair)
        (folder / name).write_text("0,0\n1,0.2\n")
        again, _, said = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.15})
        checks.true(f"two tables of one motion, {name} changed: exit 2, one line", code == 0 and again == 2 and len(told(said)) == 1 and "changed" in said, f"exit {code}, {again}: {said.strip()[:160]}")


def inputs_elsewhere(checks, folder):
    """Lattices that a checkpoint names: read below the working folder and below the checkpoint's, elsewhere only if they are named again."""
    far, home, other = folder / "far", folder / "home", folder / "other"
    for one in (far, home / "deep", other):
        one.mkdir(parents=True)
    x = np.array([[float(k), 0.0] for k in range(4)])
    for path in (far / "l.h5", home / "deep" / "l.h5", home / "l.h5"):
        write_lattice(path, x, 1.0, pairs=[[k, k + 1] for k in range(3)], stiffness=100.0, rest_length=1.0)
    (home / "pipe.h5").symlink_to("/dev/null")
    (home / "way.h5").symlink_to(far / "l.h5")
    for name, given, at, again, expected in (
            ("deeper", "deep/l.h5", home, {}, 0), ("absolute", home / "l.h5", home, {}, 0), ("beside the checkpoint, from another folder", home / "l.h5", other, {}, 0), ("elsewhere", far / "l.h5", home, {}, 2),
            ("up and down", "../far/l.h5", home, {}, 2), ("by a link", "way.h5", home, {}, 2), ("elsewhere, named again", far / "l.h5", home, {"bs_lattice_file": far / "l.h5"}, 0)):
        for ranks in ((1, 2) if name == "elsewhere" else (1,)):
            code, _, err = run(checks, home, {"bs_lattice_file": given, "ts_dt": 0.01, "ts_max_time": 0.05, "bs_checkpoint": "ck", "bs_overwrite": True})
            checks.true(f"{name}: a checkpoint", code == 0, err.strip()[:120])
            code, _, err = run(checks, at, dict(again, bs_restart=home / "ck", ts_max_time=0.1), ranks)
            good = len(told(err)) == 1 and "-bs_lattice_file" in told(err)[0] and "again" in told(err)[0] if expected else not told(err)
            checks.true(f"{name}, {ranks} rank(s): exit {expected}", code == expected and good, f"exit {code}: {err.strip()[-200:]}")
    forge(home / "ck", {"bs_lattice_file": "pipe.h5"})
    code, _, err = run(checks, home, {"bs_restart": "ck", "ts_max_time": 0.1})
    checks.true("a device by a link: exit 2", code == 2 and "no regular file" in err, f"exit {code}: {err.strip()[-160:]}")


def long_values(checks, folder):
    """A waveform of more than 60,000 characters: continued as it was, on any ranks."""
    points = ",".join(f"{0.00002 * k:.6g},{np.sin(0.7 * k):.12f}" for k in range(5100))
    options = {"bs_model": "linear", "bs_linear_type": "heat1d", "bs_linear_size": 10, "bs_linear_source": f"pwl({points})", "ts_dt": 0.001, "bs_output_interval": 0.01, "bs_progress_interval": -1}
    checks.true("the value is long", len(options["bs_linear_source"]) > 100000, f"{len(options['bs_linear_source'])} characters")
    code, _, err = run(checks, folder, dict(options, ts_max_time=0.1, bs_output="full.h5md"))
    checks.true("undisturbed", code == 0, err.strip()[:120])
    for ranks in (1, 2):
        code, _, err = run(checks, folder, dict(options, ts_max_time=0.05, bs_output="o.h5md", bs_checkpoint="ck", bs_overwrite=True), ranks)
        code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.1}, ranks)
        worst, same = difference(folder / "full.h5md", folder / "o.h5md")
        checks.true(f"{ranks} rank(s): continued as the undisturbed run", code == 0 and not err.strip() and (same if ranks == 1 else worst < 1e-12), f"off by {worst:.3g} {err.strip()[:120]}")
    with h5py.File(folder / "o.h5md") as f:
        group = f["parameters/options"]
        there = group["bs_linear_source"][()] if "bs_linear_source" in group else group.attrs["bs_linear_source"]
        there = there[0] if isinstance(there, np.ndarray) else there
        checks.true("the trajectory tells it whole, too", (there.decode() if isinstance(there, bytes) else there) == options["bs_linear_source"], f"{len(there)} characters")


if __name__ == "__main__":
    run_parts(__doc__, (attacks, every_option, petscrc, taken, elsewhere, tables, inputs_elsewhere, long_values))
