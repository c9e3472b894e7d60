"""What a run has that a format may have no place for: kept, dropped with a message, or refused by name (the table of README.md)."""
import numpy as np

from backspring_io import RunError
from run_data import TURN_LIMITS, TURNS, counted

# Columns of TABLE. A dump and a data file are for LAMMPS; .h5md is the one in nanometres; .vtu stands for .vtp and .pvd, too.
FORMATS = ("xyz", "dump", "gsd", "h5md", "vtu", "data")
KEPT, DROPPED, REFUSED = "kept", "dropped", "refused"


def row(letters):
    return {form: {"k": KEPT, "d": DROPPED, "r": REFUSED}[letter] for form, letter in zip(FORMATS, letters)}


TABLE = {
    "springs": row("ddkdkk"),
    "stiffness and rest lengths": row("ddddkk"),
    "broken springs": row("dddddd"),
    "springs that carry nothing": row("dddddd"),
    "law strain": row("ddddkk"),
    "law tension": row("ddddkr"),
    "law polynomial": row("ddddkr"),
    "law plastic": row("ddddkr"),
    "law maxwell": row("ddddkr"),
    "dampers": row("ddddkd"),
    "limits of springs": row("ddddkd"),
    "rules of breaking": row("dddddd"),
    "angle springs": row("ddkdkk"),
    "stiffness and rest angles": row("ddddkk"),
    "broken angle springs": row("dddddd"),
    "limits of angle springs": row("ddddkd"),
    "hinges": row("ddddkd"),
    "broken hinges": row("dddddd"),
    "limits of hinges": row("ddddkd"),
    "anchors": row("ddddkd"),
    "fixed particles": row("kdkdkd"),
    "ids": row("kkdkkk"),
    "drag and radii of particles": row("ddddkd"),
    "forces on particles": row("ddddkd"),
    "groups": row("ddddkd"),
    "motion of groups": row("dddddd"),
    "motion of anchors": row("dddddd"),
    "strain of the box": row("dddddd"),
    "forces on groups": row("dddddd"),
    "gravity": row("dddddd"),
    "drag": row("dddddd"),
    "other forces": row("dddddd"),
    "units": row("dddkdk"),
}
# What is read: columns of READ; "" where a format has no such thing. .vtu stands for .vtp, too.
READ_FORMATS = ("vtu", "vtk", "xdmf", "obj", "ply", "stl", "off", "msh", "data", "pdb")


def read_row(letters):
    return {form: {"k": KEPT, "d": DROPPED, "r": REFUSED, "-": ""}[letter] for form, letter in zip(READ_FORMATS, letters)}


READ = {
    "lines": read_row("kkkkk--kk-"),
    "polylines": read_row("kk-k------"),
    "triangles and quadrangles": read_row("kkkkkkkk--"),
    "triangle strips": read_row("kk--r-----"),
    "polygons": read_row("kk-kk-r---"),
    "solid elements": read_row("kkk----k--"),
    "elements of second order": read_row("kkk----k--"),
    "elements of third order": read_row("rrr----r--"),
    "points without elements": read_row("ddddd-dd--"),
    "mass, stiffness, rest lengths": read_row("kkk-----k-"),
    "velocities": read_row("kkk-----k-"),
    "ids": read_row("kkk-----kk"),
    "fixed particles": read_row("kkk-------"),
    "laws, limits, states of springs": read_row("k---------"),
    "angle springs": read_row("k-------k-"),
    "hinges": read_row("k---------"),
    "anchors and groups of particles": read_row("k---------"),
    "periodic box": read_row("k-------k-"),
    "further data, normals, colours": read_row("ddddd--d--"),
    "names of groups": read_row("---d---k--"),
    "molecules cut by the box": read_row("--------d-"),
    "bonds that are not harmonic": read_row("--------r-"),
    "angles that are not harmonic": read_row("--------d-"),
    "dihedrals, pair forces, charges": read_row("--------d-"),
    "alternative places, other models": read_row("---------d"),
    "other atoms than C-alpha": read_row("---------d"),
    "numbers that are not finite": read_row("rrrrrrrrrr"),
}
NAMES_OF_ONE = {"springs that carry nothing": "spring that carries nothing", "limits of springs": "limit of a spring", "limits of angle springs": "limit of an angle spring",
                "limits of hinges": "limit of a hinge"}
INSIDE = {"springs": ("stiffness and rest lengths", "broken springs", "springs that carry nothing", "dampers", "limits of springs", "rules of breaking",
                      *(name for name in TABLE if name.startswith("law "))),
          "angle springs": ("stiffness and rest angles", "broken angle springs", "limits of angle springs"),
          "hinges": ("broken hinges", "limits of hinges")}
BROKEN = ("broken springs", "springs that carry nothing", "broken angle springs", "broken hinges")  # what VTK files keep if they are asked to
OFF = ("none", "false", "no", "off")
OPTIONS = {  # options by which a feature is there, and the values by which it is not
    "gravity": (("bs_gravity",), ()),
    "drag": (("bs_stokes_drag", "bs_viscosity", "bs_sphere_drag", "bs_shape_drag"), OFF),
    "other forces": (("bs_central_M0", "bs_central_M0_", "bs_xsp_attraction", "bs_xsp_walls", "bs_xsp_center_of_mass", "bs_xsp_center_of_mass_damping", "bs_buoyancy", "bs_added_mass"), OFF),
    "rules of breaking": (("bs_break", "bs_break_"), (*OFF, "inf")),
    "motion of anchors": (("bs_anchor_motion",), ("fixed",)),
    "motion of groups": (("bs_motion_",), ("fixed",)),
    "forces on groups": (("bs_force_",), ()),
    "strain of the box": (("bs_box_strain", "bs_box_rate", "bs_box_stress"), ()),
}


def _zero(value):
    try:
        return not any(float(v) for v in value.split(","))
    except ValueError:
        return False


def by_options(run, feature):
    """The options that say so, "-name value" each; '' where none does."""
    names, off = OPTIONS[feature]
    given = [(k, v) for k, v in sorted(run.parameters.items()) if any(k == n or n.endswith("_") and k.startswith(n) for n in names)]
    return ", ".join(f"-{k} {v}".strip() for k, v in given if v not in off and not _zero(v) or v == "" and k.endswith("drag"))


def _counts(count):
    """{feature: its number and name} of {feature: number}, those that are there."""
    return {name: f"{number} {name if number > 1 else NAMES_OF_ONE.get(name, name[:-1])}" for name, number in count.items() if number}


def _limited(limits):
    """How many have a limit, of {name: (M,)}."""
    return int(np.any([np.isfinite(v) for v in limits.values()] or [[]], axis=0).sum())


def _of_turns(run, row):
    """Angle springs and hinges, those that are broken, and limits."""
    angles, hinges = run.angles, run.hinges or {}
    count = {"angle springs": len(angles or ()), "hinges": len(hinges.get("quads", ()))}
    for kind, limits in (("angles", angles.limits if angles else {}), ("hinges", {k: hinges[k] for k in TURN_LIMITS if k in hinges})):
        broken = run.broken_turns(kind, row)
        count.update({f"broken {TURNS[kind]}s": 0 if broken is None else int(broken.sum()), f"limits of {TURNS[kind]}s": _limited(limits)})
    return {**_counts(count), **({"stiffness and rest angles": "stiffness and rest angles of angle springs"} if angles else {})}


def _of_springs(run, row):
    springs, found = run.springs, {}
    if not len(springs):
        return found
    broken = run.broken(row)
    laws, acting = run.spring_laws, run.acting(row)
    count = {"springs": len(springs), "broken springs": 0 if broken is None else int(broken.sum()), "springs that carry nothing": int(springs.idle.sum()),
             "dampers": 0 if springs.damping is None else np.count_nonzero(springs.damping[acting]),
             "limits of springs": _limited(springs.limits)}
    found.update(_counts(count))
    found["stiffness and rest lengths"] = "stiffness and rest lengths of springs"
    for law in sorted(set(laws[acting]) - {"hooke"} if laws is not None else ()):
        found["law " + law] = f"the law {law} of {counted(np.count_nonzero(laws[acting] == law), 'spring')}"
    return found


def found_in(run, row):
    """{feature: words for it} of a frame."""
    found = {**_of_springs(run, row), **_of_turns(run, row)}
    if run.anchors:
        found["anchors"] = counted(len(run.anchors["particle"]), "spring") + " to given points (anchors)"
    elif any(name in run.parameters for name in ("bs_anchor_particles", "bs_anchor_group")):  # of a file of an earlier version
        found["anchors"] = "springs to given points (anchors)"
    if run.fixed.any():
        found["fixed particles"] = f"which particles are fixed ({np.count_nonzero(run.fixed)})"
    if not np.array_equal(run.id - run.id[:1], np.arange(run.particles)):
        found["ids"] = "ids"
    columns = [name for name in ("drag", "radius") if run.particle_column(name) is not None]
    if columns:
        found["drag and radii of particles"] = " and ".join(columns) + " of particles"
    if run.particle_column("force") is not None:
        found["forces on particles"] = "forces on particles"
    if run.groups:
        found["groups"] = "groups " + ", ".join(run.groups)
    for feature in OPTIONS:
        said = by_options(run, feature)
        if said:
            found[feature] = f"{feature} ({said})"
    if "motion of anchors" in found and "anchors" in found:
        found["motion of anchors"] = found["motion of anchors"][:-1] + "; the points are those at the start)"
    said = [unit for unit in (run.stated_unit("position"), run.stated_unit("time")) if unit]
    if said:
        found["units"] = "units (" + ", ".join(said) + ")"
    return found


def check(run, rows, form, output, whole=True):
    """Refuses by name what a format cannot say truly, and returns a line about what it leaves out, or ''. `whole`: of VTK files, what is broken and springs that carry nothing
    are left out."""
    found = found_in(run, rows[-1])
    verdict = {name: TABLE[name][form] for name in found}
    if form == "vtu" and not whole:
        verdict.update(dict.fromkeys(BROKEN, KEPT))
    refused = [found[name] for name, word in verdict.items() if word == REFUSED]
    if refused:
        raise RunError(f"{run.path}: {', '.join(refused)}: a file {output} has no such thing and would mean other forces; convert to .vtu, which keeps them")
    dropped = [found[name] for name, word in verdict.items() if word == DROPPED]
    for owner, parts in INSIDE.items():  # what belongs to springs goes with them
        if verdict.get(owner) == DROPPED:
            dropped = [found[n] for n, word in verdict.items() if word == DROPPED and n not in parts]
            verdict = {n: word for n, word in verdict.items() if n not in parts}
    return f"{output}: left out: {', '.join(dropped)}" if dropped else ""
