"""How lattices, equilibria, modes and frames look in a notebook: a small table beside a picture in SVG, without matplotlib."""

from __future__ import annotations

import base64
import html
from itertools import groupby
from typing import TYPE_CHECKING, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from .kinds import Floats

if TYPE_CHECKING:
    from .lattice import Lattice

MOST = 6000  # springs that are drawn as lines
CELL = 3  # edge of a square of the map of a larger net
TENTHS = 10  # to a pixel: lines begin and end at whole tenths
GREY, FIXED = "#6b7280", "#111827"
# pushed, at rest, pulled: dark enough for thin lines on white and on black
COLOURS = np.array([[33, 102, 172], [103, 149, 206], [160, 160, 160], [226, 120, 92], [178, 24, 43]], float)


def number(value: Optional[float], unit: str) -> str:
    """Four digits and the unit."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.4g} {unit}".strip()


def vector(value: Floats, unit: str) -> str:
    """Four digits of each component and the unit."""
    largest = np.abs(value).max() if np.size(value) else 0.0
    return "(" + ", ".join(f"{0.0 if abs(one) < 1e-9 * largest else one:.4g}" for one in value) + f") {unit}"


def most(values: Floats) -> Optional[float]:
    """The largest of those that are numbers; None where none is positive."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size and finite.max() > 0 else None


def stretches(lattice: Lattice, x: Floats, motion: Floats, box: Optional[Floats] = None) -> Floats:
    """(S,) of springs at x, in a box of these edges if they are given, by which they lengthen along a motion, as a part of the largest."""
    way = lattice._ways_at(x, box)
    length = np.linalg.norm(way, axis=1)
    along = ((motion[lattice.pairs[:, 1]] - motion[lattice.pairs[:, 0]]) * way).sum(axis=1) / np.where(length > 0, length, 1.0)
    return np.asarray(along / (np.abs(along).max(initial=0.0) or 1.0), float)


def of_lattice(lattice: Lattice) -> Dict[str, str]:
    """Rows of the table of a lattice."""
    rows = {"particles": f"{len(lattice):,} in {lattice.dim} dimension{'s' * (lattice.dim != 1)}", "springs": f"{len(lattice.pairs):,}",
            "fixed": f"{int(lattice.fixed.sum()):,}", "mass in all": number(lattice.mass.sum(), "kg")}
    if len(lattice.pairs):
        low, high = lattice.stiffness.min(), lattice.stiffness.max()
        rows["stiffness"] = number(low, "N/m") if low == high else f"{low:.4g} to {high:.4g} N/m"
    if lattice.box is not None:
        rows["periodic along"] = " and ".join(f"edge {k}" for k, one in enumerate(lattice.periodic) if one) or "no edge"
    if lattice.groups:
        rows["groups"] = html.escape(", ".join(f"{name} ({int(mask.sum()):,})" for name, mask in lattice.groups.items()))
    return rows


def _flat(points: Floats) -> Tuple[Floats, Floats]:
    """Points of one to three dimensions on the page, y upwards, and their depths; three dimensions as seen from in front, a little from the right and above."""
    if points.shape[-1] < 3:
        flat = np.zeros((*points.shape[:-1], 2))
        flat[..., : points.shape[-1]] = points
        return flat, np.zeros(points.shape[:-1])
    turn, rise = np.radians(30.0), np.radians(22.0)
    x, y, z = np.moveaxis(points, -1, 0)
    across, away = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    return np.stack([across, z * np.cos(rise) + away * np.sin(rise)], axis=-1), away * np.cos(rise) - z * np.sin(rise)


def _colours(values: Floats, largest: float) -> Floats:
    """(n, 3) from 0 to 255."""
    place = np.rint((np.clip(values / largest, -1, 1) + 1) * 20) / 40 * (len(COLOURS) - 1)
    return np.stack([np.interp(place, np.arange(len(COLOURS)), one) for one in COLOURS.T], axis=1)


def _lines(ends: Floats, depth: Floats, colour: Sequence[str], size: Floats) -> str:
    """Springs as lines, the nearest last, in the plane the colours of the largest values last; one path for those of a colour that follow each other."""
    stroke = TENTHS * float(np.clip(30 / np.sqrt(len(ends) + 1), 0.5, 2.2))
    near = -depth.mean(axis=1)
    if not near.any():
        largest = dict(sorted(zip(colour, size.tolist()), key=lambda one: float(one[1])))
        near = np.array([largest[one] for one in colour])
    order = [k for k in np.argsort(near, kind="stable").tolist() if colour[k]]
    places = np.rint(TENTHS * ends[order]).astype(int).reshape(-1, 2)
    moves = np.diff(places, axis=0, prepend=0)  # to a spring's beginning from the end of the one before, and along it
    drawn, first = [], 0
    for one, same in groupby(colour[k] for k in order):
        last = first + 2 * len(list(same))
        moves[first] = places[first]
        path = "".join(f"m{a} {b}l{c} {d}" for a, b, c, d in moves[first:last].reshape(-1, 4).tolist()).replace(" -", "-")
        drawn.append(f'<path stroke="{one}" d="{path}"/>')
        first = last
    return f'<g stroke-width="{stroke:.0f}" stroke-linecap="round" fill="none">{"".join(drawn)}</g>'


def _cells(ends: Floats, colour: Sequence[str], values: Floats) -> str:
    """Where there are more springs than can be told apart: squares, each coloured as the spring of the largest value in it."""
    where = np.floor(ends.mean(axis=1) / CELL).astype(np.int64)
    seen = {(a, b): colour[k] for k, (a, b) in sorted(enumerate(where.tolist()), key=lambda one: float(values[one[0]])) if colour[k]}
    squares: Dict[str, List[str]] = {}
    for (a, b), one in seen.items():
        squares.setdefault(one, []).append(f"M{CELL * a} {CELL * b}h{CELL}v{CELL}h-{CELL}z")
    drawn = "".join(f'<path d="{"".join(some)}" fill="{one}"/>' for one, some in squares.items())
    return f'<g shape-rendering="crispEdges" transform="scale({TENTHS})">{drawn}</g>'


def _colouring(values: Optional[Floats], count: int, label: str, unit: str) -> Tuple[Sequence[str], Floats, str]:
    """Colours of the springs, empty where they are broken; the sizes of their values; what the colours say."""
    if values is None or not np.isfinite(values).any() or np.nanmax(np.abs(values)) == 0:
        return [GREY] * count, np.zeros(count), ""
    size = np.abs(np.nan_to_num(values))
    rgb = np.rint(_colours(np.nan_to_num(values), size.max())).astype(int).tolist()
    colours = ["#%02x%02x%02x" % tuple(one) if there else "" for one, there in zip(rgb, np.isfinite(values).tolist())]
    return colours, size, f"{label} &minus;{size.max():.3g} to {size.max():.3g} {unit}".strip() if label else ""


def picture(lattice: Lattice, x: Floats, values: Optional[Floats] = None, label: str = "", unit: str = "", width: int = 360, caption: str = "",
            box: Optional[Floats] = None) -> str:
    """An SVG of the springs at x, coloured by values (blue: pushed, red: pulled), fixed particles as squares; of large nets a map. It is
    an image of its own: of notebooks that are not trusted, viewers leave out what is drawn in the page. box: its edges, where they are others than the
    lattice's."""
    count = len(lattice.pairs)
    first = x[lattice.pairs[:, 0]]
    ends, depth = _flat(np.stack([first, first + lattice._ways_at(x, box)], axis=1))
    spots, _ = _flat(x)
    everything = np.concatenate([ends.reshape(-1, 2), spots])
    low = everything.min(axis=0)
    span = everything.max(axis=0) - low
    room = np.array([width - 16.0, 300.0])
    wide = span > 1e-12 * span.max()
    scale = float((room[wide] / span[wide]).min()) if wide.any() else 1.0
    height = int(16 + scale * span[1])
    corner = np.array([(width - scale * span[0]) / 2, 8 + scale * span[1]])
    ends, spots = ((points - low) * [scale, -scale] + corner for points in (ends, spots))
    colour, size, note = _colouring(values, count, label, unit)
    drawn = _lines(ends, depth, colour, size) if count <= MOST else _cells(ends, colour, size)
    held = spots[lattice.fixed]
    squares = "".join(f'<rect x="{a - 20:.0f}" y="{b - 20:.0f}" width="40" height="40"/>' for a, b in (TENTHS * held[:: max(1, len(held) // 300)]).tolist())
    svg = (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {TENTHS * width} {TENTHS * height}">{drawn}'
           f'<g fill="{FIXED}">{squares}</g></svg>')
    under = f'<div style="font-size:85%;opacity:.75;text-align:center">{caption or note}</div>' if caption or note else ""
    return f'<div><img alt="springs" width="{width}" height="{height}" src="data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"/>{under}</div>'


def page(title: str, rows: Mapping[str, str], *pictures: str) -> str:
    """The table, and the pictures beside it."""
    cells = "".join(f'<tr><td style="text-align:left;opacity:.75">{name}</td><td style="text-align:left">{value}</td></tr>' for name, value in rows.items())
    return (f'<div style="display:flex;gap:1em;align-items:center;flex-wrap:wrap"><table><thead><tr><th colspan="2" style="text-align:left">{title}</th></tr></thead>'
            f'<tbody>{cells}</tbody></table>{"".join(pictures)}</div>')
