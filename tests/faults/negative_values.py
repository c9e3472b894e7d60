#!/usr/bin/env python3
"""Values that begin with a dash: every option that takes one gives it on the command line, in a text file and in a YAML file alike, and a continued run has
what the run before it had. The options are those that -help lists with numbers as their defaults and that a run takes with -0.5 in their places."""
import re
import sys
import pathlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import h5py
from runs import difference, run, run_parts

H = 2.0**-10  # times are exact
QUIET = {"ts_dt": H, "ts_max_time": 10 * H, "bs_progress_interval": -1, "bs_advise": False, "bs_overwrite": True, "bs_output": "o.h5md", "bs_checkpoint": "ck", "bs_checkpoint_every": 10}
NET = dict(QUIET, bs_lattice_type="square", bs_lattice_size="4,4", bs_lattice_fixed="xmin", bs_group_g="xmax", bs_lattice_radius=0.1)
BASES = {"net": NET, "box": dict(QUIET, bs_lattice_type="square", bs_lattice_size="4,4", bs_lattice_periodic="xy", bs_lattice_perturbation=0.05),
         "statics": {k: v for k, v in dict(NET, bs_task="statics", bs_gravity="0,-1").items() if not k.startswith("ts_") and k != "bs_checkpoint_every"},
         "linear": dict(QUIET, bs_model="linear", bs_linear_type="heat1d", bs_linear_size=4, bs_linear_source="step(1)")}
# what some options need beside them, and values that are no lists of -0.5
BESIDES = {"bs_spring_stiffness_": {"bs_spring_law": "polynomial"}, "bs_anchor_": {"bs_anchor_group": "g", "bs_anchor_stiffness": 10}, "bs_anchor_velocity": {"bs_anchor_motion": "velocity"},
           "bs_anchor_amplitude": {"bs_anchor_motion": "sinusoid", "bs_anchor_frequency": 3}, "bs_anchor_phase": {"bs_anchor_motion": "sinusoid", "bs_anchor_frequency": 3, "bs_anchor_amplitude": "0.1,0"},
           "bs_fluid_velocity": {"bs_shape_drag": "sphere", "bs_shape_drag_rho": 1, "bs_shape_drag_area": 1}, "bs_central_point": {"bs_central_M0": 1e10},
           "bs_xsp_attraction_": {"bs_xsp_attraction": 3, "bs_xsp_attraction_exponent": 1}}
GIVEN = {"net": {"bs_gravity": ["-1,0", "-.5e-1,-9.81"], "bs_motion_g": ["velocity:-0.5,0", "x=expression:-0.1*t -sin(t),y=free", "x=sinusoid:-0.1,2,-1"], "bs_lattice_origin": ["-1,-2"]},
         "box": {"bs_box_rate": ["xy=-0.1"], "bs_box_strain": ["xx=expression:-sin(t)", "xy=velocity:-0.1"], "bs_lattice_velocity": ["-0.5,0"]},
         "statics": {"bs_gravity": ["-1,0"]},
         "linear": {"bs_linear_source": ["step(-1)", "constant(-0.5)"]}}
LENGTHS = (1, 2, 3, 4)


def lines(form, options):
    return "".join(f'-{n} "{v}"\n' if form == "opts" else f'{n}: "{v}"\n' for n, v in options.items())


def recalled(path, name):
    with h5py.File(path) as f:
        value = f["options"].attrs.get(name)
    return None if value is None else value.decode()


def candidates(checks, folder, base, options):
    """(name, value) of the options of -help that this base takes with a negative value."""
    _, out, _ = run(checks, folder, dict(options, help=True))
    found = []
    for name, default, help in re.findall(r"^  -(bs_\w+): <([-+0-9.e,inf]+)>: (.*)", out, re.M):
        if name.startswith(("bs_output", "bs_checkpoint", "bs_progress", "bs_modes", "bs_step", "bs_atol", "bs_rtol", "bs_lattice_size")) or name in GIVEN[base]:
            continue
        if base != "net" and name.startswith(("bs_lattice", "bs_anchor", "bs_xsp", "bs_shape", "bs_sphere", "bs_central", "bs_fluid", "bs_break")):
            continue  # as there
        if re.search(r">=? 0|number of|seed|largest|fraction|length|mass|0 to 1", help):
            continue
        beside = next((more for begin, more in sorted(BESIDES.items(), key=lambda one: -len(one[0])) if name.startswith(begin)), {})
        for length in LENGTHS if "," in default else (1,):
            value = ",".join(["-0.5"] * length)
            code, _, _ = run(checks, folder, {**options, **beside, name: value})
            if code == 0:
                found.append((name, value, beside))
                break
    found += [(name, value, {}) for name, values in GIVEN[base].items() for value in values]
    return found


def walk(checks, folder, base):
    options = BASES[base]
    end = None if base == "statics" else 20 * H
    found = candidates(checks, folder, base, options)
    checks.true(f"{base}: options that take negative values are found", len(found) >= {"net": 12, "box": 3, "statics": 2, "linear": 2}[base], str([n for n, _, _ in found]))
    for k, (name, value, beside) in enumerate(found):
        whole = {**options, "bs_output": "w.h5md", "bs_checkpoint": "wk", **beside, name: value, **({"ts_max_time": end} if end else {})}
        code, _, err = run(checks, folder, whole)
        checks.true(f"{base}, -{name} {value}: runs", code == 0, err.strip()[-200:])
        for form in ("command", "opts", "yaml") if name in GIVEN[base] else (("command", "opts", "yaml")[k % 3],):
            given = {**beside, name: value}
            if form != "command":
                (folder / f"o.{form}").write_text(lines(form, given))
            first = dict({k: v for k, v in options.items() if k not in given}, **(given if form == "command" else {"options_file": f"o.{form}"}))
            code, _, err = run(checks, folder, first)
            checks.true(f"{base}, -{name} {value}, {form}: the checkpoint has it", code == 0 and recalled(folder / "ck", name) == value, f"{code} {recalled(folder / 'ck', name)} {err.strip()[-200:]}")
            code, _, err = run(checks, folder, {"bs_restart": "ck", "bs_progress_interval": -1, **({"ts_max_time": end} if end else {})})
            checks.true(f"{base}, -{name} {value}, {form}: continued without a word", code == 0 and not [line for line in err.splitlines() if name in line], f"{code} {err.strip()[-300:]}")
            worst, _ = difference(folder / "o.h5md", folder / "w.h5md")
            checks.true(f"{base}, -{name} {value}, {form}: as uninterrupted", worst == 0, f"{worst:g}")
            checks.true(f"{base}, -{name} {value}, {form}: and is kept", recalled(folder / "ck", name) == value, str(recalled(folder / "ck", name)))


def net(checks, folder):
    walk(checks, folder, "net")


def box(checks, folder):
    walk(checks, folder, "box")


def statics(checks, folder):
    walk(checks, folder, "statics")


def linear(checks, folder):
    walk(checks, folder, "linear")


if __name__ == "__main__":
    run_parts(__doc__, (net, box, statics, linear))
