"""C-alpha atoms of a PDB file and the springs of its elastic network (anisotropic network model)."""
import re

import numpy as np

from backspring_io import RunError


MARK = b"\xef\xbb\xbf".decode("latin-1")  # some editors' first bytes of a file in UTF-8
ODD = re.compile(r"[^A-Za-z]*(ATOM\b|HETATM|MODEL\b)|atom  |hetatm")  # a record that is spoilt, and whose atoms would be passed over


class Protein:
    """position (N, 3) [angstrom], serial, chain, residue (N), b_factor (N) [angstrom^2]; notes: what was left out."""

    def __init__(self):
        self.position, self.serial, self.chain, self.residue, self.b_factor, self.notes = [], [], [], [], [], []


def _number(path, number, line, columns, what):
    word = line[columns].strip()
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise RunError(f"{path} line {number}: '{word}' is no {what} (columns {columns.start + 1} to {columns.stop})")
    return value


def _atoms(path):
    """(line number, model, line) of every ATOM and HETATM record; models count from 1."""
    model, found = 1, 0
    try:
        with open(path, encoding="latin-1") as f:  # a character each byte, as columns count them
            for number, line in enumerate(f, 1):
                line = line.removeprefix(MARK) if number == 1 else line
                if line.startswith("MODEL"):
                    found += 1
                    model = found
                elif line.startswith(("ATOM  ", "HETATM")):
                    yield number, model, line.rstrip("\n")
                elif ODD.match(line):
                    raise RunError(f"{path} line {number}: {ascii(line.strip()[:30])} is no record; "
                                   "write ATOM, HETATM or MODEL in capitals from column 1, and blanks up to column 6")
    except OSError as error:
        raise RunError(f"{path}: {error.strerror}") from None


def read_pdb(path, chains=None, model=1, altloc=None):
    """The C-alpha atoms of one model. chains: their letters, None: all. altloc: of alternative places the one with this letter, None:
    the first of each residue. HETATM counts where it is a C-alpha, too (modified residues); calcium (name in column 13) does not."""
    out, taken, skipped, others, models, seen = Protein(), {}, 0, 0, set(), set()
    for number, at, line in _atoms(path):
        models.add(at)
        if at != model or line[12:16] != " CA ":
            others += at == model
            continue
        chain, place, key = line[21:22], line[16:17].strip(), (line[21:22], line[22:27])
        seen.add(chain)
        if chains is not None and chain not in chains:
            continue
        if place and altloc is not None and place != altloc:
            skipped += 1
            continue
        if key in taken:
            skipped += 1
            continue
        taken[key] = number
        out.position.append([_number(path, number, line, slice(c, c + 8), "coordinate") for c in (30, 38, 46)])
        out.serial.append(line[6:11].strip())
        out.chain.append(chain)
        out.residue.append(line[22:27].strip())
        out.b_factor.append(_number(path, number, line, slice(60, 66), "B-factor") if line[60:66].strip() else np.nan)
    if models and model not in models:
        raise RunError(f"{path}: no model {model}; there are {len(models)}, counted from 1")
    if chains is not None and set(chains) - seen:
        raise RunError(f"{path}: no C-alpha in chain {sorted(set(chains) - seen)[0]}; there are {', '.join(sorted(seen)) or 'none'}")
    if not out.position:
        raise RunError(f"{path}: no C-alpha atom (ATOM records named ' CA ')")
    if len(models) > 1:
        out.notes.append(f"model {model} of {len(models)}")
    if skipped:
        out.notes.append(f"{skipped} alternative places left out")
    if others:
        out.notes.append(f"{others} atoms other than C-alpha left out")
    out.position, out.b_factor = np.array(out.position), np.array(out.b_factor)
    return out


def network(position, cutoff):
    """Pairs (M, 2) of points closer than `cutoff` or as close, by rows."""
    from scipy.spatial import cKDTree
    pairs = cKDTree(position).query_pairs(cutoff, output_type="ndarray")
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].astype(np.int64)
