"""What the program warned of in the points of a study, and options that are varied to no effect."""
import os
import re

MARK = "backspring: warning: "


def warnings_of(folder):
    """The warnings of a point's run, in order."""
    try:
        with open(os.path.join(folder, "output.txt"), encoding="utf-8", errors="replace") as f:
            return [line.strip().removeprefix(MARK) for line in f if line.startswith(MARK)]
    except OSError:
        return []


def told(study, points):
    """A line for every different warning, with the number of its points where it is not of all."""
    of = {}
    for point in points:
        for text in dict.fromkeys(warnings_of(os.path.join(study, point.name))):
            of.setdefault(text, []).append(point)
    return [f"warning{'' if len(some) == len(points) else f' ({len(some)} of {len(points)} points)'}: {text}" for text, some in of.items()]


def unused(folder):
    """Names, without dashes, of the options that the run did not use."""
    said = [re.match(r"options? (-.*?) (?:is|are) not used by this run", text) for text in warnings_of(folder)]
    return {name.lstrip("-").lower() for found in said if found for name in found[1].split(", ")}


def without_effect(study, points):
    """Varied options that no point used, each of those that have it."""
    idle = {point.name: unused(os.path.join(study, point.name)) for point in points}
    names = list(dict.fromkeys(name for point in points for name in point.setting if name != "np"))
    return [name for name in names if all(name.lower() in idle[point.name] for point in points if name in point.setting)]
