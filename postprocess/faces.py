"""Triangles of a sheet of springs, for pictures in which a cloth is a surface and no wire."""
import numpy as np


def three_cliques(pairs, count):
    """(T, 3) rows of all triples whose particles are joined each to each by `pairs` (M, 2) of `count` particles."""
    ends = np.unique(np.sort(pairs, axis=1), axis=0)
    ends = ends[ends[:, 0] != ends[:, 1]]
    if not len(ends):
        return np.zeros((0, 3), int)
    first = np.searchsorted(ends[:, 0], np.arange(count + 1))  # the pairs that begin with each particle
    degree = np.diff(first)[ends[:, 1]]
    which = np.repeat(np.arange(len(ends)), degree)
    third = ends[first[ends[which, 1]] + np.arange(len(which)) - np.repeat(np.cumsum(degree) - degree, degree), 1]
    keys, wanted = ends[:, 0] * count + ends[:, 1], ends[which, 0] * count + third
    there = keys[np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)] == wanted
    return np.column_stack([ends[which], third])[there]


def triangles_of(run):
    """(T, 3) rows of the triangles of a lattice: of its hinges, else of its springs, those left out that pass over a particle (the bending springs of a cloth)."""
    hinges = run.hinges
    if hinges:
        quads = hinges["quads"]
        return np.unique(np.sort(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 1, 3]]]), axis=1), axis=0)
    x, springs = run.position(0), run.springs
    pairs = np.sort(springs.pairs[springs.inside & ~springs.idle], axis=1)
    triples = three_cliques(pairs, run.particles)
    if not len(triples):
        return triples
    sides = np.stack([np.linalg.norm(x[triples[:, a]] - x[triples[:, b]], axis=1) for a, b in ((0, 1), (0, 2), (1, 2))], axis=1)
    flat = sides.max(axis=1) > 0.97 * (sides.sum(axis=1) - sides.max(axis=1))
    longest = np.array([(0, 1), (0, 2), (1, 2)])[sides[flat].argmax(axis=1)]
    over = triples[flat][np.arange(flat.sum())[:, None], longest]
    keys = lambda p: p[:, 0] * run.particles + p[:, 1]  # noqa: E731
    return three_cliques(pairs[~np.isin(keys(pairs), keys(over))], run.particles)


def is_sheet(run, triangles):
    """Whether the triangles make up a surface: as many as particles at least, and no edge in more than four (two triangles, or two squares with both diagonals)."""
    if run.dim != 3 or len(triangles) < 0.9 * run.particles:
        return False
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [0, 2]], triangles[:, [1, 2]]]), axis=1)
    shared = np.unique(edges, axis=0, return_counts=True)[1]
    return len(shared) < 4.05 * run.particles and np.mean(shared <= 4) > 0.98


def shaded(points, triangles, basis):
    """(T,) brightness of the triangles of points (N, 3): smooth, by the normals of their corners, lit from the upper left of the picture on either side."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals *= np.where(normals @ basis[2] < 0, -1.0, 1.0)[:, None]  # towards the eye
    corners = np.zeros_like(points)
    for k in range(3):
        for axis in range(3):
            corners[:, axis] += np.bincount(triangles[:, k], normals[:, axis], len(points))
    smooth = corners[triangles].sum(axis=1) @ basis.T
    smooth /= np.maximum(np.linalg.norm(smooth, axis=1), 1e-300)[:, None]
    return 0.74 + 0.62 * np.clip(smooth @ np.array([-0.45, 0.6, 0.66]), 0, 1)
