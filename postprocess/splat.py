"""Discs for up to millions of particles, drawn by numpy into an image with a depth buffer."""
import numpy as np

WORK = 1e8  # particles that may be seen times pixels of a disc, at most


def splat(plane, depth, rgb, fog, window, shape, radius, background, shaded):
    """An image (h, w, 4) of `shape` = (w, h) pixels; row 0 is at the bottom.

    plane (n, 2), depth (n,) growing towards the eye, rgb (n, 3), fog (n,) share of background; radius in units of the plane.
    """
    width, height = shape
    x0, x1, y0, y1 = window
    scale = min(width / (x1 - x0), height / (y1 - y0))      # pixels per unit of length
    reach = max(0.5, radius * scale)
    order = np.argsort(depth, kind="stable")                # far to near: of equal pixels the last one stays
    column = ((plane[order, 0] - x0) / (x1 - x0) * width).astype(np.int64)
    row = ((plane[order, 1] - y0) / (y1 - y0) * height).astype(np.int64)
    z = depth[order] * scale                                # in pixels
    seen = _maybe_visible(column, row, z, reach, width, height)
    order, column, row, z = order[seen], column[seen], row[seen], z[seen]
    reach = float(min(reach, max(0.5, np.sqrt(WORK / (3.2 * len(order))))))
    nearest = np.full(height * width, -np.inf)
    owner = np.full(height * width, -1, dtype=np.int64)
    index = np.arange(len(order))
    steps = int(np.ceil(reach))
    for dy in range(-steps, steps + 1):
        for dx in range(-steps, steps + 1):
            if dx * dx + dy * dy <= reach * reach + 0.3:
                bulge = np.sqrt(max(reach * reach - dx * dx - dy * dy, 0.0))
                _lay(column + dx, row + dy, z + bulge, index, width, height, nearest, owner)
    hit = owner >= 0
    image = np.concatenate([np.tile(background, (height * width, 1)), np.zeros((height * width, 1))], axis=1)
    who = order[owner[hit]]
    light = _light(nearest.reshape(height, width), reach).reshape(-1)[hit, None] if shaded else 1.0
    haze = fog[who, None]
    image[hit, :3] = np.clip((1 - haze) * rgb[who] * light + haze * np.asarray(background), 0, 1)
    image[hit, 3] = 1.0
    return image.reshape(height, width, 4)


def _lay(column, row, z, index, width, height, nearest, owner):
    """One pixel of every disc. z ascends, so that of two discs with one pixel the nearer is written last."""
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    pixel = row * width + column
    if not inside.all():
        pixel, z, index = pixel[inside], z[inside], index[inside]
    closer = z > nearest[pixel]
    pixel = pixel[closer]
    nearest[pixel] = z[closer]
    owner[pixel] = index[closer]


def _maybe_visible(column, row, z, reach, width, height):
    """Those that are not hidden for certain; z ascends. A disc covers a square of side reach/sqrt(2) that holds its centre,
    nowhere deeper than its own z: whatever lies behind that in all squares it touches cannot be seen."""
    side = int(reach / np.sqrt(2))
    if side < 2:
        return np.arange(len(z))
    margin = 3 + int(np.ceil(reach / side))
    across, down = width // side + 2 * margin + 1, height // side + 2 * margin + 1
    cx = np.clip(column // side + margin, 0, across - 1)
    cy = np.clip(row // side + margin, 0, down - 1)
    front = np.full((down, across), -np.inf)
    front[cy, cx] = z
    touched = int(np.ceil(reach / side)) + 1
    for axis in (0, 1):  # the least over all squares around
        front = np.min([np.roll(front, k, axis) for k in range(-touched, touched + 1)], axis=0)
    return np.flatnonzero(z + reach >= front[cy, cx])


def _light(z, reach):
    """Brightness from the slope of the depth buffer, smoothed over a disc; edges against the void are left alone."""
    filled = np.isfinite(z)
    level = np.where(filled, z, 0.0)
    for _ in range(2):
        level, weight = _blur(level * filled, reach), _blur(filled.astype(float), reach)
        level = np.where(filled, level / np.maximum(weight, 1e-9), 0.0)
    gy, gx = np.gradient(level)
    bad = ~filled
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        bad |= ~np.roll(filled, shift, axis=(0, 1))
    gx, gy = np.where(bad, 0.0, gx), np.where(bad, 0.0, gy)
    norm = np.sqrt(1 + gx * gx + gy * gy)
    lamp = np.array([-0.45, 0.6, 0.66])
    lambert = (-gx * lamp[0] - gy * lamp[1] + lamp[2]) / norm
    return 0.62 + 0.5 * np.clip(lambert, 0, 1)


def _blur(a, reach):
    """Mean over a square of about twice the disc's radius, by running sums."""
    k = max(1, int(round(reach)))
    for axis in (0, 1):
        total = np.cumsum(np.concatenate([np.zeros_like(np.take(a, [0], axis)), a], axis), axis)
        n = a.shape[axis]
        i = np.arange(n)
        hi, lo = np.minimum(i + k + 1, n), np.maximum(i - k, 0)
        a = np.take(total, hi, axis) - np.take(total, lo, axis)
    return a
