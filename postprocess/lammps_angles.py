"""Angles of LAMMPS data files. LAMMPS writes E = K (theta - theta_0)^2 with theta_0 in degrees: the stiffness is kappa = 2 K."""
import numpy as np

import lammps_units
from backspring_io import RunError
from run_data import counted
from lammps_numbers import columns, harmonic, once, whole


class NotRead(Exception):
    """Why the angles cannot become angle springs."""


def read_angles(path, data, header, sections, row_of):
    """Sets data.angles: {"triples" (A, 3), "stiffness" (A), "rest_angle" (A) [rad]}, or None; a note says why they are left out."""
    data.angles = None
    rows = sections.get("Angles", ("", []))[1]
    if header.get("angles") and "Angles" not in sections:
        data.notes.append(f"{counted(header['angles'], 'angle')} left out: the file has no section Angles")
        return
    if header.get("angles", len(rows)) != len(rows):
        raise RunError(f"{path}: announces {counted(header.get('angles', 0), 'angle')}, section Angles has {counted(len(rows), 'row')}")
    if not rows:
        return
    for number, words in rows:
        columns(path, number, words, "id type atom1 atom2 atom3", "Angles")
    try:
        found = _coefficients(path, data, sections, rows)
    except NotRead as why:
        data.notes.append(f"{len(rows)} angles left out: {why}")
        return
    triples = np.array([[row_of(number, word) for word in words[2:5]] for number, words in rows], dtype=np.int64)
    data.angles = {"triples": triples, "stiffness": 2.0 * lammps_units.factor(data.units) * found[:, 0], "rest_angle": np.radians(found[:, 1])}


def _coefficients(path, data, sections, rows):
    """K and theta_0 [degree] of every angle."""
    hint, lines = sections.get("Angle Coeffs", ("", []))
    if not lines:
        raise NotRead("the file has no Angle Coeffs (write_data of LAMMPS puts them in)")
    if hint and hint not in ("harmonic", "hybrid"):
        raise NotRead(f"angle style {hint} is no angle spring, only harmonic is")
    names = {w[1]: int(w[0]) for _, w in sections.get("Angle Type Labels", ("", []))[1]}
    types = [names.get(w[1]) or whole(path, n, w[1], "Angles") for n, w in rows]
    table, seen = {}, {}
    for number, words in lines:
        if len(words) < 2:
            columns(path, number, words, "type K theta0", "Angle Coeffs")
        once(path, number, f"type {words[0]}", seen, "Angle Coeffs")
        style, numbers = (words[1], words[2:]) if words[1][0].isalpha() else ("harmonic", words[1:])
        kind = names.get(words[0]) or whole(path, number, words[0], "Angle Coeffs")
        if (style != "harmonic" or len(numbers) != 2) and kind in types:
            raise NotRead(f"angle coefficients '{' '.join(words)}' are not harmonic K theta0")
        if kind in types:
            table[kind] = harmonic(path, number, kind, numbers, "Angle Coeffs")
            if not 0 < table[kind][1] <= 180:
                raise RunError(f"{path}:{number}: '{kind} {' '.join(numbers)}' in Angle Coeffs: a rest angle lies above 0 and not above 180 degrees")
    unknown = sorted(set(types) - set(table))
    if unknown:
        raise NotRead(f"Angle Coeffs has no angle type {unknown[0]}")
    if data.units is None:
        raise NotRead("the file does not say the units of its Angle Coeffs; add --units")
    return np.array([table[t] for t in types])


def in_the_plane(position, angles, box):
    """Triples turned so that their angle, counted counter-clockwise as backspring does in two dimensions, starts below pi. Arms go to nearest images."""
    from lammps_box import nearest
    a, b, c = (position[angles["triples"][:, k]] for k in range(3))
    arms = [end - b for end in (a, c)]
    if box:
        edges, periodic = np.eye(3), [*box[1], False]
        edges[:2, :2] = box[0]
        arms = [arm + (nearest(edges, np.pad(arm, ((0, 0), (0, 1))), periodic) @ edges)[:, :2] for arm in arms]
    clockwise = np.cross(*arms) < 0
    angles["triples"][clockwise] = angles["triples"][clockwise][:, ::-1]
