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
    """The group whose mean displacement comes furthest, and the direction to there (unit vector)."""
    frames, best, name, direction = sample(range(run.frames), 50), 0.0, None, None
    for group in groups_of(run):
        path = mean_displacement(run, frames, run.group(group))
        far = path[np.argmax(np.linalg.norm(path, axis=1))]
        if np.linalg.norm(far) > best:
            best, name, direction = np.linalg.norm(far), group, far / np.linalg.norm(far)
    return name, direction


def force(ax, runs, labels, args):
    """Reaction of groups, the force their support exerts on them, along the direction in which the group moved most; over time, or
    (--against displacement) against how far that group has been moved."""
    several, drawn = len(runs) > 1, False
    displaced = getattr(args, "against", "time") == "displacement"
    for i, run in enumerate(runs):
        leader, direction = moved_most(run)
        names = getattr(args, "groups", None) or ([leader] if leader else groups_of(run))
        for k, name in enumerate(names):
            value = run.series.get("reaction/" + name)
            if value is None:
                continue
            value = value.reshape(len(value), -1)
            along = value @ direction if direction is not None else np.linalg.norm(value, axis=1)
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
    finish(ax, runs[0], axis_label("force of the support", runs[0].unit("reaction/" + groups_of(runs[0])[0])))
    if displaced:
        ax.set_xlabel(axis_label("displacement", runs[0].unit("position")))


def work_of(run):
    """Work of all that is driven (T,), 0 where nothing is."""
    done = [value for name, value in run.series.items() if name.startswith("work/")]
    return np.sum(done, axis=0) if done else np.zeros(len(run.observable_times))
