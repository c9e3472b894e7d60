"""What a finished sheet is held to: ticks do not run into each other, titles stay within their panel, legends cover no data."""
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.ticker import FixedLocator, MaxNLocator

SPACING = 3.0  # pixels between the points that stand for a line


def settle(figure):
    """Puts right what only the drawn sheet shows."""
    figure.canvas.draw()
    for ax in figure.axes:
        fit_title(ax)
        if ax.name != "3d":
            legend = ax.get_legend()
            if getattr(legend, "movable", False):
                free(ax, legend)
            for axis in (ax.xaxis, ax.yaxis):
                thin(axis)


def shown_labels(axis):
    """Boxes [pixels] of the labels of the ticks in view, in order."""
    renderer = axis.figure.canvas.get_renderer()
    return [tick.label1.get_window_extent(renderer) for tick in axis._update_ticks() if tick.label1.get_visible() and tick.label1.get_text()]


def _crowded(axis):
    boxes = sorted(shown_labels(axis), key=lambda box: (box.x0, box.y0))
    along = 4 if axis.axis_name == "x" else 1  # pixels between neighbours
    return any(a.x0 - along < b.x1 and b.x0 < a.x1 + along and a.y0 < b.y1 and b.y0 < a.y1 for a, b in zip(boxes, boxes[1:]))


def thin(axis):
    """Fewer ticks until no two labels meet."""
    if not axis.get_visible():
        return
    for _ in range(8):
        if not _crowded(axis):
            return
        locator, count = axis.get_major_locator(), len(shown_labels(axis))
        if isinstance(locator, MaxNLocator) and count > 2:
            axis.set_major_locator(MaxNLocator(count - 2, integer=locator._integer))
        else:
            low, high = sorted(axis.get_view_interval())
            axis.set_major_locator(FixedLocator([v for v in axis.get_majorticklocs() if low <= v <= high][::2]))


def fit_title(ax):
    """A title wider than its panel gets a second line, then smaller letters."""
    title = ax._left_title
    if not title.get_text():
        return
    room = ax.get_window_extent().width + 0.35 * ax.figure.dpi

    def wide():
        return title.get_window_extent(ax.figure.canvas.get_renderer()).width > room
    if wide():
        title.set_text(title.get_text().replace("   ", "\n", 1))
    while wide() and title.get_fontsize() > 5:
        title.set_fontsize(title.get_fontsize() - 0.5)


def _dense(points):
    """Points [pixels] along the polygon through `points` (n, 2), SPACING apart at most."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 2:
        return points
    counts = np.minimum(1 + np.abs(np.diff(points, axis=0)).max(axis=1) // SPACING, 2000).astype(int)
    which = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[which]
    return np.concatenate([points[which] + share[:, None] * (points[which + 1] - points[which]), points[-1:]])


def _of_line(line):
    x, y = line.get_xydata().astype(float).T
    if line.get_drawstyle() == "steps-pre":
        x, y = np.repeat(x, 2)[:-1], np.repeat(y, 2)[1:]
    points = line.get_transform().transform(np.stack([x, y], axis=1))
    return points if line.get_linestyle() in ("None", "none", "") else _dense(points)


def _inside(path, ax):
    """Points of a grid over the panel that lie in a filled region."""
    box = ax.get_window_extent()
    x, y = np.meshgrid(np.linspace(box.x0, box.x1, 80), np.linspace(box.y0, box.y1, 60))
    grid = np.stack([x.ravel(), y.ravel()], axis=1)
    return grid[path.contains_points(grid)]


def data_points(ax):
    """Points (n, 2) [pixels] that stand for all that is drawn of data, and for the words beside it."""
    found = [np.zeros((0, 2))]
    found += [_of_line(line) for line in ax.lines if line.get_visible() and len(line.get_xydata()) and line.get_transform() == ax.transData]
    for patch in ax.patches:
        found.append(_dense(patch.get_path().transformed(patch.get_transform()).vertices))
    for drawn in ax.collections:
        if isinstance(drawn, LineCollection):
            found += [_dense(ax.transData.transform(s)) for s in drawn.get_segments()[:5000]]
        elif isinstance(drawn, PolyCollection) and len(drawn.get_paths()) <= 50:
            for path in (p.transformed(drawn.get_transform()) for p in drawn.get_paths()):
                found += [_dense(path.vertices), _inside(path, ax)]
        elif len(drawn.get_offsets()):
            found.append(ax.transData.transform(drawn.get_offsets()))
    renderer = ax.figure.canvas.get_renderer()
    for words in ax.texts:
        box = words.get_window_extent(renderer)
        found.append(_dense(np.array([[box.x0, box.y0], [box.x1, box.y1], [box.x0, box.y1], [box.x1, box.y0]])))
    return np.concatenate(found)


def covered(points, box, pad=2.0):
    """How many of `points` lie under a box [pixels]."""
    return int(((points > [box[0] - pad, box[1] - pad]) & (points < [box[2] + pad, box[3] + pad])).all(axis=1).sum())


def _place(ax, legend, x, y):
    """Puts the upper left corner at (x, y), shares of the panel; returns its box [pixels]."""
    legend.set_bbox_to_anchor((x, y), ax.transAxes)
    return legend.get_window_extent(ax.figure.canvas.get_renderer()).extents


def free(ax, legend):
    """Moves a legend to where it covers nothing; where it would everywhere, the vertical axis is made longer above the data."""
    panel = ax.get_window_extent()
    box = _place(ax, legend, 0, 1)
    width, height = (box[2] - box[0]) / panel.width, (box[3] - box[1]) / panel.height
    edge = 0.01
    across = (max(0.0, 1 - width - edge), edge, max(0.0, (1 - width) / 2))
    points = data_points(ax)
    for y in (1 - edge, height + edge, 0.5 + height / 2):
        for x in across:
            if not covered(points, _place(ax, legend, x, y)):
                return
    tops = []
    for x in across:
        box = _place(ax, legend, x, 1 - edge)
        under = points[(points[:, 0] > box[0] - 2) & (points[:, 0] < box[2] + 2), 1]
        tops.append((under.max() - panel.y0) / panel.height if len(under) else 0.0)
    best = int(np.argmin(tops))
    bottom, _ = ax.get_ylim()
    share = min(tops[best], 1.0) / max(0.25, 1 - height - 2 * edge - 6 / panel.height)
    _, top = ax.transData.inverted().transform((panel.x0, panel.y0 + panel.height * max(share, 1.0)))
    ax.set_ylim(bottom, top)
    _place(ax, legend, across[best], 1 - edge)
