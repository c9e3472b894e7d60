"""LAMMPS data files: atoms, harmonic bonds and harmonic angles. LAMMPS writes E = K (r - r0)^2, so the stiffness is k = 2 K."""
import gzip
import itertools
import zlib

import numpy as np

import lammps_angles
import lammps_box
import lammps_units
import run_data
from backspring_io import RunError
from lammps_numbers import columns, harmonic, once, reals, whole

# Columns of "Atoms": place of the type, of x, and their number without image flags. Earlier ones are preferred where none is named.
STYLES = {"atomic": (1, 2, 5), "bond": (2, 3, 6), "angle": (2, 3, 6), "molecular": (2, 3, 6), "full": (2, 4, 7), "charge": (1, 3, 6),
          "sphere": (1, 4, 7), "ellipsoid": (1, 4, 7), "body": (1, 4, 7), "peri": (1, 4, 7), "dpd": (1, 3, 6), "mdpd": (1, 3, 6),
          "edpd": (1, 4, 7), "line": (2, 5, 8), "tri": (2, 5, 8), "electron": (1, 5, 8), "sph": (1, 5, 8), "dipole": (1, 3, 9),
          "spin": (1, 2, 9), "dielectric": (2, 4, 15), "wavepacket": (1, 8, 11), "bpm/sphere": (2, 5, 8)}
# Columns of "Velocities", where there are more than id vx vy vz.
TURNING = {**dict.fromkeys(("sphere", "line", "bpm/sphere"), " wx wy wz"), **dict.fromkeys(("ellipsoid", "body", "tri"), " lx ly lz"),
           **dict.fromkeys(("electron", "wavepacket"), " ervel")}
GUESSED = ("atomic", "bond", "full", "charge")
NUMBERS = ("Velocities", "Bonds", "Angles")  # sections whose rows must be numbers
LEFT_OUT = ("dihedrals", "impropers")  # by their numbers, all others by the name of their section
READ = ("Atoms", "Velocities", "Masses", "Bonds", "Bond Coeffs", "Angles", "Angle Coeffs", "Dihedrals", "Dihedral Coeffs", "Impropers", "Improper Coeffs")


class Data:
    """What a data file says, in the order of its "Atoms": see read_lammps."""


def is_lammps(path):
    """Whether the file has the header of a LAMMPS data file: "N atoms" within its first lines of text."""
    try:
        with _open(path) as file:
            lines = [line.partition("#")[0].split() for line in itertools.islice(file, 200)]
    except (OSError, EOFError, zlib.error):
        return False
    return any(len(w) == 2 and w[0].isdigit() and w[1] == "atoms" for w in lines)


def read_lammps(path, style=None, units=None, boundary="p,p,p", coefficients=("stiffness", "rest_length")):
    """position (N, 3), velocity (N, 3) or None, mass (N) or None, ids (N), pairs (M, 2), stiffness (M) and rest_length (M) or None, units
    or None, angles: see lammps_angles, box: None, or edges (3, 3) and which axes are periodic, with shift (M, 3) the images of second ends; notes: lines for the user. Stiffnesses are in the file's mass/time^2. `coefficients`: what is wanted of Bond Coeffs."""
    try:
        return _read(path, style, units, lammps_box.periods(boundary), coefficients)
    except (ValueError, IndexError, OverflowError, EOFError, OSError, zlib.error) as error:
        raise RunError(f"{path}: malformed LAMMPS data ({error})") from None


def _read(path, style, units, periodic, coefficients):
    header, sections = _split(path)
    data, data.notes = Data(), []
    if not sections.get("Atoms", ("", []))[1]:
        raise RunError(f"{path}: no section Atoms; is this a LAMMPS data file?")
    for name, counted in (("Atoms", "atoms"), ("Bonds", "bonds"), ("Velocities", "atoms")):
        rows = len(sections.get(name, ("", []))[1])
        if counted in header and rows != header[counted] and (rows or name == "Bonds"):
            raise RunError(f"{path}: announces {run_data.counted(header[counted], counted[:-1])}, section {name} has {run_data.counted(rows, 'row')}"
                           + ("; truncated?" if rows < header[counted] else ""))
    _units(path, data, header, units)
    types, row_of, images = _atoms(path, data, sections, style, header)
    _masses(path, data, sections, types)
    data.velocity = _velocities(path, data, sections["Velocities"][1], row_of) if "Velocities" in sections else None
    bonds = sections.get("Bonds", ("", []))[1]
    for number, words in bonds:
        columns(path, number, words, "id type atom1 atom2", "Bonds")
    data.pairs = np.array([[_row(path, n, row_of, w[2]), _row(path, n, row_of, w[3])] for n, w in bonds], dtype=np.int64).reshape(-1, 2)
    cell = lammps_box.edges(header)
    data.position, cut, data.shift = lammps_box.unwrap(cell, data.position, images, data.pairs, periodic)
    data.box = None if data.shift is None else (cell, periodic)
    if data.box:
        data.notes.append(f"{cut} bond{'s cross' if cut != 1 else ' crosses'} the periodic box so that networks join their own images: the lattice is periodic (--boundary f,f,f: no periodic box)")
    elif cut:
        data.notes.append(f"{cut} bond{'s cross' if cut != 1 else ' crosses'} the periodic box, molecules were put together (--boundary f,f,f: no periodic box)")
    _coefficients(path, data, sections, bonds, coefficients)
    lammps_angles.read_angles(path, data, header, sections, lambda number, word: _row(path, number, row_of, word))
    left = [f"{header[k]} {k}" for k in LEFT_OUT if header.get(k)] + ["charges"] * data.charged + [name for name in sections if name not in READ and not name.endswith("Type Labels")]
    if left:
        data.notes.append(f"{', '.join(left)} left out: only bonds and angles become springs")
    return data


def _open(path):
    return gzip.open(path, "rt", encoding="utf-8", errors="replace") if path.endswith(".gz") \
        else open(path, encoding="utf-8", errors="replace")


def _split(path):
    """Header {"title", "atoms": N, ..., "x": (lo, hi), "tilt": (xy, xz, yz)} and sections {name: (hint, [(line number, words)])}."""
    header, sections, current = {"title": ""}, {}, None
    with _open(path) as file:
        for number, line in enumerate(file, 1):
            text, _, comment = line.partition("#")
            words = text.split()
            if number == 1:
                header["title"] = line.strip()
            elif words and words[0][0].isalpha():
                current = " ".join(words)
                sections[current] = ((comment.split() or [""])[0].rstrip(":"), [])
            elif words and current:
                sections[current][1].append((number, words))
            elif words:
                _heading(path, number, words, header)
    for name in NUMBERS:
        for number, words in sections.get(name, ("", []))[1]:
            labelled = 1 if name in ("Bonds", "Angles") else -1  # the type may be a name
            reals(path, number, [w for k, w in enumerate(words) if not (k == labelled and w[0].isalpha())], name)
    return header, sections


def _heading(path, number, words, header):
    if words[-1] in ("avec", "bvec", "cvec"):
        raise RunError(f"{path}:{number}: a general triclinic box ({words[-1]}); write the restricted one (write_data without "
                       "triclinic/general)")
    if words[-1] in ("xhi", "yhi", "zhi"):
        low, high = header[words[-1][0]] = tuple(reals(path, number, words[:2], "the header"))
        if low > high:
            raise RunError(f"{path}:{number}: '{' '.join(words)[:60]}': the box ends below where it begins; write the lower bound first")
    elif words[-3:] == ["xy", "xz", "yz"]:
        header["tilt"] = tuple(reals(path, number, words[:3], "the header"))
    elif words[0].isdigit():
        header[" ".join(words[1:])] = int(words[0])


def _units(path, data, header, given):
    said = (header["title"].partition("units = ")[2].split() or [None])[0]
    said = said.rstrip(",") if said else None
    if said and said not in lammps_units.UNITS:
        raise RunError(f"{path}:1: units {said} are unknown; there are {', '.join(lammps_units.UNITS)}")
    if given and said and given != said:
        raise RunError(f"{path}:1: says units = {said}, --units says {given}")
    data.units = given or said


def _atoms(path, data, sections, style, header):
    """Types, {id: row} and image flags; sets position and ids."""
    hint, lines = sections["Atoms"]
    names = {w[1]: int(w[0]) for _, w in sections.get("Atom Type Labels", ("", []))[1]}
    style = style or (hint if hint in STYLES or hint in ("hybrid", "template") else "")
    width = len(lines[0][1])
    if not style:  # not said: by the number of columns, with or without three image flags
        able = ("bond", "angle", "molecular", "full", "bpm/sphere") if header.get("bonds") else STYLES
        fits = [s for s in able if width in (STYLES[s][2], STYLES[s][2] + 3) and _types_fit(lines, STYLES[s], names, header)]
        if hint or not fits or fits[0] not in GUESSED:
            raise RunError(f"{path}: Atoms " + (f"has the unknown style '{hint}'" if hint else f"does not name its style and has {width} columns")
                           + ("; add --atom_style " + "|".join(fits) if fits else "; styles that can be read: hybrid, " + ", ".join(STYLES)))
        style = fits[0]
        data.notes.append(f"Atoms does not name its style, read as {style} (--atom_style says otherwise)")
    if style == "template":
        raise RunError(f"{path}: atom style template: the bonds are in a molecule file, not here; write the data file by atom style molecular")
    if style != "hybrid" and style not in STYLES:
        raise RunError(f"--atom_style {style}: unknown; there are hybrid, {', '.join(STYLES)}")
    at_type, at_x, count = STYLES.get(style, (1, 2, width))  # hybrid: id type x y z, then what its parts add, of unknown number
    for number, words in lines:
        if len(words) != width or width not in (count, count + 3):
            raise RunError(f"{path}:{number}: {len(words)} columns, atom style {style} has {count}, or {count + 3} with image flags")
    if style == "hybrid":
        data.notes.append("atom style hybrid: image flags are not looked for, bonds say what belongs together")
    data.style, seen = style, {}
    data.ids = np.array([whole(path, n, w[0], "Atoms") for n, w in lines], dtype=np.int64)
    for (number, _), i in zip(lines, data.ids.tolist()):
        once(path, number, f"atom {i}", seen, "Atoms")
    row_of = {i: k for k, i in enumerate(data.ids.tolist())}
    data.position = np.array([reals(path, n, w[at_x:at_x + 3], "Atoms") for n, w in lines])
    data.charged = style in ("full", "charge") and any(reals(path, n, [w[at_x - 1]], "Atoms")[0] != 0 for n, w in lines)
    images = np.array([[whole(path, n, v, "Atoms") for v in w[width - 3:]] if width > count else [0, 0, 0] for n, w in lines])
    return [names.get(w[at_type]) or whole(path, n, w[at_type], "Atoms") for n, w in lines], row_of, images


def _types_fit(lines, columns, names, header):
    """Whether what would be types are types, and what would be image flags are whole numbers."""
    at_type, _, count = columns
    known = {str(k + 1) for k in range(header.get("atom types", 0))} | set(names)
    return all(w[at_type] in known and all(v.lstrip("+-").isdigit() for v in w[count:]) for _, w in lines)


def _row(path, number, row_of, word):
    if whole(path, number, word, "the column of an atom") not in row_of:
        raise RunError(f"{path}:{number}: there is no atom {word}")
    return row_of[int(word)]


def _velocities(path, data, rows, row_of):
    """(N, 3) of the atoms, each named once."""
    names, seen = "id vx vy vz" + TURNING.get(data.style, ""), {}
    velocity = np.zeros_like(data.position)
    for number, words in rows:
        if data.style != "hybrid" or len(words) < 4:  # hybrid: more columns, of unknown number
            columns(path, number, words, names, f"Velocities of atom style {data.style}")
        row = _row(path, number, row_of, words[0])
        once(path, number, f"atom {data.ids[row]}", seen, "Velocities")
        velocity[row] = reals(path, number, words[1:4], "Velocities")
    missing = next((i for i in row_of if f"atom {i}" not in seen), None)
    if missing is not None:
        raise RunError(f"{path}: Velocities has no row of atom {missing}; write one for each atom, or leave the section out")
    return velocity


def _masses(path, data, sections, types):
    data.mass = None
    if "Masses" in sections:
        table, seen = {}, {}
        for number, words in sections["Masses"][1]:
            columns(path, number, words, "type mass", "Masses")
            once(path, number, f"type {words[0]}", seen, "Masses")
            mass = reals(path, number, words[:2], "Masses")[1]
            if mass <= 0:
                raise RunError(f"{path}:{number}: '{' '.join(words)[:60]}' in Masses: a mass must be positive")
            table[whole(path, number, words[0], "Masses")] = mass
        unknown = sorted(set(types) - set(table))
        if unknown:
            raise RunError(f"{path}: Masses has no atom type {unknown[0]}")
        data.mass = np.array([table[t] for t in types])


def _coefficients(path, data, sections, bonds, wanted):
    data.stiffness = data.rest_length = None
    if not wanted or "Bond Coeffs" not in sections or not bonds:
        return
    hint, rows = sections["Bond Coeffs"]
    names = {w[1]: int(w[0]) for _, w in sections.get("Bond Type Labels", ("", []))[1]}
    types = [names.get(w[1]) or whole(path, n, w[1], "Bonds") for n, w in bonds]
    if hint and hint not in ("harmonic", "hybrid"):
        raise RunError(f"{path}: bond style {hint} is not a spring, only harmonic is; put springs in its place by --stiffness and --rest_length")
    table, seen = {}, {}
    for number, words in rows:
        if len(words) < 2:
            columns(path, number, words, "type K r0", "Bond Coeffs")
        once(path, number, f"type {words[0]}", seen, "Bond Coeffs")
        style, numbers = (words[1], words[2:]) if words[1][0].isalpha() else ("harmonic", words[1:])
        kind = names.get(words[0]) or whole(path, number, words[0], "Bond Coeffs")
        if (style != "harmonic" or len(numbers) != 2) and kind in types:
            raise RunError(f"{path}:{number}: bond coefficients '{' '.join(words)}' are not harmonic K r0; put springs in their place by "
                           "--stiffness and --rest_length")
        if kind in types:
            table[kind] = harmonic(path, number, kind, numbers, "Bond Coeffs")
    unknown = sorted(set(types) - set(table))
    if unknown:
        raise RunError(f"{path}: Bond Coeffs has no bond type {unknown[0]}")
    if data.units is None and "stiffness" in wanted:
        raise RunError(f"{path}: does not say the units of its Bond Coeffs; add --units " + "|".join(lammps_units.UNITS)
                       + " (lj where all numbers fit together as they are)")
    found = np.array([table[t] for t in types])
    data.rest_length = found[:, 1]
    if "stiffness" in wanted:
        data.stiffness = 2.0 * lammps_units.factor(data.units) * found[:, 0]
