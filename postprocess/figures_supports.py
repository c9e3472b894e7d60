"""What supports do: the force on a group over time, or against how far it has been moved."""
import numpy as np

from figure_style import COLORS, axis_label, finish, missing, width
from scene import sample


def groups_of(run):
    """Names of the groups with a reaction."""
    return [name.split("/", 1)[1] for name in run.series if name.startswith("reaction/")]


def mean_displacement(run, rows, members):
    """(len(rows), d): mean displacement of particles since the first frame [m]."""
    start = run.position(0)[members].mean(axis=0)
    return np.array([run.position(int(row))[members].mean(axis=0) - start for row in rows])


def moved_most(run):
    """The group whose mean displacement comes furthest, and the direction to there (unit vector); (None, None) where all stay, but for rounding."""
    frames, name, direction = sample(range(run.frames), 50), None, None
    best = 1e-12 * np.linalg.norm(np.ptp(run.position(0), axis=0))
    for group in groups_of(run):
        path = mean_displacement(run, frames, run.group(group))
        far = path[np.argmax(np.linalg.norm(path, axis=1))]
        if np.linalg.norm(far) > best:
            best, name, direction = np.linalg.norm(far), group, far / np.linalg.norm(far)
    return name, direction


def strongest(run, names):
    """Where no group moves: the direction of the largest reaction of any of these groups, its largest component positive, and words for it."""
    values = [run.series[key].reshape(len(run.observable_times), -1) for key in (f"reaction/{name}" for name in names) if key in run.series]
    if not values:
        return None, ""
    largest = max((v[np.linalg.norm(v, axis=1).argmax()] for v in values), key=np.linalg.norm)
    size = np.linalg.norm(largest)
    if not size > 0:
        largest, size = np.eye(len(largest))[0], 1.0
    direction = largest / size * np.sign(largest[np.abs(largest).argmax()])
    axis = np.flatnonzero(np.abs(direction) > 1 - 1e-6)
    return direction, "xyz"[axis[0]] if len(axis) else "(" + ", ".join(f"{c:.2g}" for c in direction) + ")"


def force(ax, runs, labels, args):
    """Reaction of groups, the force their support exerts on them, along the direction in which the group moved most, or, where none moves, of the largest reaction;
    over time, or (--against displacement) against how far that group has been moved."""
    several, drawn, along_what = len(runs) > 1, False, set()
    displaced = getattr(args, "against", "time") == "displacement"
    for i, run in enumerate(runs):
        leader, direction = moved_most(run)
        names = getattr(args, "groups", None) or ([leader] if leader else groups_of(run))
        if leader is None:
            direction, said = strongest(run, names)
            along_what.add(said)
        for k, name in enumerate(names):
            value = run.series.get("reaction/" + name)
            if value is None:
                continue
            value = value.reshape(len(value), -1)
            along = value @ direction
            rows = np.arange(min(run.frames, len(along)))
            if displaced and leader is None:
                continue
            across = mean_displacement(run, rows, run.group(leader)) @ direction if displaced else run.observable_times[rows]
            ax.plot(across, along[rows], color=COLORS[(i if several else k) % len(COLORS)], lw=width(i, several),
                    label=None if several and len(names) == 1 else name)
            drawn = True
    if not drawn:
        return missing(ax, "reactions of a group that moves" if displaced else "reactions")
    ax.axhline(0, color="#999999", lw=0.6)
    finish(ax, runs[0], axis_label("force of the support" + "".join(f" along {said}" for said in sorted(along_what) if len(along_what) == 1), runs[0].unit("reaction/" + groups_of(runs[0])[0])))
    if displaced:
        ax.set_xlabel(axis_label("displacement", runs[0].unit("position")))


def work_of(run):
    """Work of all that is driven (T,), 0 where nothing is."""
    done = [value for name, value in run.series.items() if name.startswith("work/")]
    return np.sum(done, axis=0) if done else np.zeros(len(run.observable_times))
