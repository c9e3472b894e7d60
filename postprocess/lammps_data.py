"""LAMMPS data files: atoms and harmonic bonds. LAMMPS writes E = K (r - r0)^2, so the stiffness is k = 2 K."""
import numpy as np

from backspring_io import RunError

# Columns of "Atoms": position of type, of x, and their number without image flags
STYLES = {"atomic": (1, 2, 5), "charge": (1, 3, 6), "bond": (2, 3, 6), "angle": (2, 3, 6), "molecular": (2, 3, 6),
          "full": (2, 4, 7), "sphere": (1, 4, 7)}
SECTIONS = ("Atoms", "Velocities", "Masses", "Bonds", "Bond Coeffs")
CONSISTENT = ("lj", "si", "cgs", "micro", "nano")


class Data:
    """What a data file says, in the order of its "Atoms": see read_lammps."""


def read_lammps(path, style=None):
    """position (N, 3), velocity (N, 3) or None, mass (N) or None, ids (N), pairs (M, 2), stiffness (M) and rest_length
    (M) or None, notes: lines for the user."""
    try:
        return _read(path, style)
    except (ValueError, IndexError, OverflowError) as error:
        raise RunError(f"{path}: malformed LAMMPS data ({error})") from None


def _read(path, style):
    header, sections = _split(path)
    data, data.notes = Data(), []
    if "Atoms" not in sections or not sections["Atoms"][1]:
        raise RunError(f"{path}: no section Atoms; is this a LAMMPS data file?")
    units = header["title"].partition("units = ")[2].split()[:1]
    if units and units[0] not in CONSISTENT:
        data.notes.append(f"units {units[0]}: force, mass, length and time do not fit together; numbers are taken as they are")
    hint, lines = sections["Atoms"]
    types, row_of = _atoms(path, data, lines, style or hint, header)
    if "Masses" in sections:
        table = {int(r[0]): float(r[1]) for _, r in sections["Masses"][1]}
        unknown = sorted(set(types) - set(table))
        if unknown:
            raise RunError(f"{path}: Masses has no atom type {unknown[0]}")
        data.mass = np.array([table[t] for t in types])
    else:
        data.mass = None
    data.velocity = None
    if "Velocities" in sections:
        data.velocity = np.zeros_like(data.position)
        for number, r in sections["Velocities"][1]:
            data.velocity[_row(path, number, row_of, r[0])] = [float(v) for v in r[1:4]]
    _bonds(path, data, sections, row_of)
    return data


def _split(path):
    """Header {"title", "xlo xhi": (lo, hi), ...} and sections {name: (hint, [(line number, words)])}."""
    header, sections, current = {"title": ""}, {}, None
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            text, _, comment = line.partition("#")
            words = text.split()
            if number == 1:
                header["title"] = line.strip()
            elif words and words[0][0].isalpha():
                current = " ".join(words)
                sections[current] = (comment.strip().split(" ")[0], [])
            elif words and current:
                sections[current][1].append((number, words))
            elif words and words[-1] in ("xhi", "yhi", "zhi"):
                header[words[-1][0]] = (float(words[0]), float(words[1]))
    for name in SECTIONS:
        for number, words in sections.get(name, ("", []))[1]:
            try:
                [float(w) for w in words if not (name == "Bond Coeffs" and w[0].isalpha())]
            except ValueError:
                raise RunError(f"{path}:{number}: '{' '.join(words)[:60]}' in {name} is not a row of numbers") from None
    return header, sections


def _atoms(path, data, lines, style, header):
    width = len(lines[0][1])
    if style not in STYLES:  # not said: by the number of columns, with or without three image flags
        by_width = {5: "atomic", 8: "atomic", 6: "bond", 9: "bond", 7: "full", 10: "full"}
        if style or width not in by_width:
            raise RunError(f"{path}: atom style '{style}' with {width} columns is unknown; use --atom_style "
                           + "|".join(STYLES))
        style = by_width[width]
        data.notes.append(f"Atoms does not name its style, read as {style} (--atom_style says otherwise)")
    at_type, at_x, columns = STYLES[style]
    for number, words in lines:
        if len(words) not in (columns, columns + 3):
            raise RunError(f"{path}:{number}: {len(words)} columns, atom style {style} has {columns}, or {columns + 3} with image flags")
    data.ids = np.array([int(w[0]) for _, w in lines])
    row_of = {int(i): k for k, i in enumerate(data.ids)}
    if len(row_of) < len(data.ids):
        raise RunError(f"{path}: Atoms names an id twice")
    data.position = np.array([[float(v) for v in w[at_x:at_x + 3]] for _, w in lines])
    for k, axis in enumerate("xyz"):  # image flags: unwrap periodic boxes
        if axis in header:
            flags = np.array([int(w[columns + k]) if len(w) > columns else 0 for _, w in lines])
            data.position[:, k] += flags * (header[axis][1] - header[axis][0])
    return [int(w[at_type]) for _, w in lines], row_of


def _row(path, number, row_of, word):
    if int(word) not in row_of:
        raise RunError(f"{path}:{number}: there is no atom {word}")
    return row_of[int(word)]


def _bonds(path, data, sections, row_of):
    lines = sections.get("Bonds", ("", []))[1]
    data.pairs = np.array([[_row(path, n, row_of, w[2]), _row(path, n, row_of, w[3])] for n, w in lines],
                          dtype=np.int64).reshape(-1, 2)
    data.stiffness = data.rest_length = None
    if "Bond Coeffs" not in sections or not lines:
        return
    hint, rows = sections["Bond Coeffs"]
    if hint and hint not in ("harmonic", "hybrid"):
        raise RunError(f"{path}: bond style {hint} is not a spring; only harmonic is")
    table = {}
    for number, words in rows:
        style, numbers = (words[1], words[2:]) if words[1][0].isalpha() else ("harmonic", words[1:])
        if style != "harmonic" or len(numbers) != 2:
            raise RunError(f"{path}:{number}: bond coefficients '{' '.join(words)}' are not harmonic K r0")
        table[int(words[0])] = (2.0 * float(numbers[0]), float(numbers[1]))
    unknown = sorted({int(w[1]) for _, w in lines} - set(table))
    if unknown:
        raise RunError(f"{path}: Bond Coeffs has no bond type {unknown[0]}")
    coefficients = np.array([table[int(w[1])] for _, w in lines])
    data.stiffness, data.rest_length = coefficients[:, 0], coefficients[:, 1]


def write_lammps(path, title, position, velocity, mass, fixed, ids, pairs, stiffness, rest_length):
    """A data file of atom style bond. Types gather equal masses (fixed atoms apart) and equal springs."""
    kinds, atom_type = np.unique(np.stack([mass, fixed.astype(float)], axis=1), axis=0, return_inverse=True)
    lo, hi = position.min(axis=0), position.max(axis=0)
    margin = 0.5 * max(float((hi - lo).max()), 1e-6)
    with open(path, "w", encoding="utf-8") as f:
        f.write(f"{title}\n\n{len(position)} atoms\n{len(kinds)} atom types\n")
        if len(pairs):
            bonds, bond_type = np.unique(np.stack([0.5 * stiffness, rest_length], axis=1), axis=0, return_inverse=True)
            f.write(f"{len(pairs)} bonds\n{len(bonds)} bond types\n")
        f.write("\n" + "".join(f"{lo[k] - margin:.17g} {hi[k] + margin:.17g} {a}lo {a}hi\n" for k, a in enumerate("xyz")))
        f.write("\nMasses\n\n" + "".join(f"{i + 1} {m:.17g}{'  # fixed' if held else ''}\n" for i, (m, held) in enumerate(kinds)))
        if len(pairs):
            f.write("\nBond Coeffs # harmonic\n\n" + "".join(f"{i + 1} {k:.17g} {r:.17g}\n" for i, (k, r) in enumerate(bonds)))
        f.write("\nAtoms # bond\n\n")
        f.writelines(f"{i} 1 {t + 1} {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}\n" for i, t, x in zip(ids, atom_type, position))
        if velocity is not None:
            f.write("\nVelocities\n\n")
            f.writelines(f"{i} {v[0]:.17g} {v[1]:.17g} {v[2]:.17g}\n" for i, v in zip(ids, velocity))
        if len(pairs):
            f.write("\nBonds\n\n")
            f.writelines(f"{i + 1} {t + 1} {ids[a]} {ids[b]}\n" for i, (t, (a, b)) in enumerate(zip(bond_type, pairs)))
