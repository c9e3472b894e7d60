"""Networks in memory."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import looks
from ._library import require_same, started
from .arguments import mask_of, name_of, named, names_in, numbers_in, real_array, refuse_duplicates, rows_in, truths_in, whole_in
from .errors import InputError, check, pass_on
from .kinds import Comm, Floats, Mask, Observables, Option, Settings, Whole
from .options import text_of

if TYPE_CHECKING:
    from ._core import LatticeArrays
    from matplotlib.figure import Figure

Path = Union[str, os.PathLike[str]]

# Interactions of several particles by the program's names of their kinds: what their ends are called, and how many there are.
INTERACTIONS = {"angles": ("triples", 3), "hinges": ("quads", 4)}
CENTRES = {"angles": 1, "hinges": 0}  # the end that the nearest images of the others are sought at
TURN_LIMITS = ("critical_change", "critical_moment", "critical_energy", "broken")  # what they can bear, and which are broken


class Lattice:
    """A network of N particles and S springs in d dimensions.

    x: (N, d) positions [m]; (N,) in one dimension.
    pairs: (S, 2) rows of the particles at the ends, from 0.
    stiffness: (S,) or one number [N/m] (strain law: [N]); rest_length: (S,) or one number [m], by default the initial distances.
    damping: (S,) or one number [kg/s]. area: (S,) or one number, cross-sections for stresses [m^2].
    mass: (N,) or one number [kg], > 0; velocity: (N, d) [m/s], beside that of a box that strains, v - L x, which a motion adds.
    fixed: rows of particles, or a mask (N,). groups: {name: rows or mask}, for loads, motions and reactions.
    box: (d,) lengths or (d, d) edges of a periodic box, rows [m]; periodic: which of the edges repeat, by default all; shift: (S, d) the image of the
    box in which a spring's second end lies, by default the nearest.
    law: hooke, strain, zero and the other laws of the option bs_spring_law, or (S,) names; damping_law: axial or simple. spring_columns: {name: (S,)}
    numbers that a law takes beyond these; particle_columns: {name: (N,) or (N, d)}: radius, drag, force.
    anchors: springs to points, {"particle": (A,), "point": (A, d), "stiffness", "rest_length", "damping": (A,) or one number}.
    angles: angle springs, {"triples": (n, 3), "stiffness" [N m], "rest_angle" [rad]: (n,) or one number}; hinges: likewise with "quads": (n, 4). What they
    can bear: "critical_change" [rad], "critical_moment" [N m], "critical_energy" [J] in the same way.
    breaking: {"critical_strain", "critical_force", "critical_energy": (S,) or one number}, what springs can bear, inf: whatever comes.
    parallel: allows several springs between the same particles, as lattices of files may have them. options: {name: text} of the program that go with the lattice.
    """

    x: Floats
    pairs: Whole
    stiffness: Floats
    rest_length: Optional[Floats]
    damping: Floats
    area: Optional[Floats]
    mass: Floats
    velocity: Floats
    fixed: Mask
    groups: Dict[str, Mask]
    box: Optional[Floats]
    periodic: Tuple[bool, ...]
    shift: Optional[Whole]
    law: Union[str, List[str]]
    damping_law: str
    spring_columns: Dict[str, Floats]
    particle_columns: Dict[str, Floats]
    anchors: Optional[Dict[str, Any]]
    angles: Optional[Dict[str, Any]]
    hinges: Optional[Dict[str, Any]]
    breaking: Dict[str, Floats]
    parallel: bool
    options: Dict[str, str]

    def __init__(self, x: ArrayLike, pairs: ArrayLike = (), *, stiffness: ArrayLike = 1.0, rest_length: Optional[ArrayLike] = None, damping: ArrayLike = 0.0,
                 area: Optional[ArrayLike] = None, mass: ArrayLike = 1.0, velocity: ArrayLike = 0.0, fixed: ArrayLike = (),
                 groups: Optional[Mapping[str, ArrayLike]] = None, box: Optional[ArrayLike] = None, periodic: Optional[Sequence[bool]] = None,
                 shift: Optional[ArrayLike] = None, law: Union[str, Sequence[str]] = "hooke", damping_law: str = "axial",
                 spring_columns: Optional[Mapping[str, ArrayLike]] = None, particle_columns: Optional[Mapping[str, ArrayLike]] = None,
                 anchors: Optional[Mapping[str, Any]] = None, angles: Optional[Mapping[str, Any]] = None, hinges: Optional[Mapping[str, Any]] = None,
                 breaking: Optional[Mapping[str, ArrayLike]] = None, parallel: bool = False, options: Optional[Mapping[str, Option]] = None) -> None:
        x = real_array("x", x)
        x = x[:, None] if x.ndim == 1 else x
        if x.ndim != 2 or not 1 <= x.shape[1] <= 3 or len(x) == 0:
            raise InputError(f"x has the shape {x.shape}: give (N, d) with at least one particle in 1 to 3 dimensions")
        n, d = x.shape
        self.x = numbers_in("x", x, n, d)
        self.pairs = rows_in("pairs", pairs, 2, n)
        s = len(self.pairs)
        self.stiffness = numbers_in("stiffness", stiffness, s)
        self.rest_length = None if rest_length is None else numbers_in("rest_length", rest_length, s)
        self.damping = numbers_in("damping", damping, s)
        self.area = None if area is None else numbers_in("area", area, s, positive=True)
        self.mass = numbers_in("mass", mass, n, positive=True)
        self.velocity = np.zeros((n, d)) if np.ndim(velocity) == 0 and velocity == 0 else numbers_in("velocity", velocity, n, d)
        self.fixed = mask_of("fixed", fixed, n)
        self.groups = {name: mask_of(f"groups[{name!r}]", rows, n) for name, rows in named("groups", groups).items()}
        self._set_box(box, periodic, shift, s, d)
        self.parallel = bool(parallel)
        if not self.parallel:
            refuse_duplicates(self.pairs, self.shift)
        self.law, self.damping_law = names_in("law", law, s), name_of("damping_law", damping_law)
        self.options = {name: text_of(name, value) for name, value in named("options", options).items()}
        self.spring_columns = {name: numbers_in(f"spring_columns[{name!r}]", v, s) for name, v in named("spring_columns", spring_columns).items()}
        self.breaking = {name: numbers_in(f"breaking[{name!r}]", v, s, limit=name != "broken") for name, v in named("breaking", breaking).items()}
        columns = {name: real_array(f"particle_columns[{name!r}]", v) for name, v in named("particle_columns", particle_columns).items()}
        self.particle_columns = {name: numbers_in(f"particle_columns[{name!r}]", v, n, v.shape[1] if v.ndim == 2 else None) for name, v in columns.items()}
        self.anchors = self._anchors(anchors, n, d)
        self.angles, self.hinges = self._several("angles", angles, n), self._several("hinges", hinges, n)

    def _set_box(self, box: Optional[ArrayLike], periodic: Optional[Sequence[bool]], shift: Optional[ArrayLike], s: int, d: int) -> None:
        self.box, self.periodic, self.shift = None, (False,) * d, None
        if box is None:
            if periodic is not None or shift is not None:
                raise InputError("periodic and shift: give the box, too")
            return
        edges = real_array("box", box)
        if edges.shape not in ((d,), (d, d)):
            raise InputError(f"box has the shape {edges.shape}: give ({d},) lengths or ({d}, {d}) edges, one in each row")
        self.box = numbers_in("box", np.diag(edges) if edges.ndim == 1 else edges, d, d)
        self.periodic = (True,) * d if periodic is None else truths_in("periodic", periodic, d)
        if shift is not None:
            self.shift = whole_in("shift", shift, s, d)

    @staticmethod
    def _known(name: str, given: Mapping[str, Any], names: Sequence[str]) -> None:
        unknown = sorted(set(given) - set(names))
        if unknown:
            raise InputError(f"{name}: {unknown[0]!r} is none of {', '.join(names)}")

    def _anchors(self, given: Optional[Mapping[str, Any]], n: int, d: int) -> Optional[Dict[str, Any]]:
        given = {key: value for key, value in named("anchors", given).items() if value is not None}
        if not given:
            return None
        self._known("anchors", given, ("particle", "point", "stiffness", "rest_length", "damping"))
        if "particle" not in given or "point" not in given or "stiffness" not in given:
            raise InputError("anchors: give particle, point and stiffness")
        particle = rows_in("anchors['particle']", given["particle"], None, n)
        a = len(particle)
        return {"particle": particle, "point": numbers_in("anchors['point']", given["point"], a, d),
                **{name: numbers_in(f"anchors[{name!r}]", given.get(name, 0.0), a) for name in ("stiffness", "rest_length", "damping")}}

    def _several(self, kind: str, given: Optional[Mapping[str, Any]], n: int) -> Optional[Dict[str, Any]]:
        given = named(kind, given)
        if not given:
            return None
        name, count = INTERACTIONS[kind]
        self._known(kind, given, (name, "stiffness", "rest_angle", "shift", *TURN_LIMITS))
        if name not in given or "stiffness" not in given:
            raise InputError(f"{kind}: give {name} and stiffness")
        ends = rows_in(f"{kind}[{name!r}]", given[name], count, n)
        found: Dict[str, Any] = {name: ends, **{key: numbers_in(f"{kind}[{key!r}]", given.get(key, 0.0), len(ends)) for key in ("stiffness", "rest_angle")}}
        found.update({key: numbers_in(f"{kind}[{key!r}]", given[key], len(ends), limit=key != "broken") for key in TURN_LIMITS if given.get(key) is not None})
        if given.get("shift") is not None:
            shift, rows, width = real_array(f"{kind}['shift']", given["shift"]), len(ends), count * self.dim
            if shift.shape not in ((rows, width), (rows, count, self.dim)):
                raise InputError(f"{kind}['shift'] has the shape {shift.shape}: give {(rows, count, self.dim)}, images of the box in which the ends lie")
            found["shift"] = whole_in(f"{kind}['shift']", shift.reshape(rows, width), rows, width)
        return found

    @property
    def dim(self) -> int:
        """Dimensions of space, d."""
        return int(self.x.shape[1])

    def __len__(self) -> int:
        """Particles, N."""
        return len(self.x)

    def nearest_shift(self) -> Whole:
        """(S, d) images of the box in which springs' second ends are nearest to the first ones [boxes]; of a lattice with a box."""
        return self._nearest(self.pairs[:, 0], self.pairs[:, 1])

    def _nearest(self, first: Whole, second: Whole) -> Whole:
        """The images in which the second of pairs of particles are nearest to the first."""
        if self.box is None:
            raise InputError("nearest_shift: the lattice has no box")
        return self._nearest_along(self.x[second] - self.x[first])

    def _nearest_along(self, ways: Floats, box: Optional[Floats] = None) -> Whole:
        """Images of the box, or of one with other edges, that make these ways (n, d) the shortest."""
        from ._core import nearest_images

        return nearest_images((self._edges() if box is None else box).ravel().tolist(), self.periodic, ways)

    def _edges(self) -> Floats:
        """(d, d) edges that span a volume: one along which nothing repeats may be given as 0, and is then of length 1."""
        assert self.box is not None
        edges = self.box.copy()
        for k in np.flatnonzero(~edges.any(axis=1) & ~np.asarray(self.periodic)):
            edges[k, k] = 1.0
        if not abs(np.linalg.det(edges)) > 1e-12 * np.prod(np.linalg.norm(edges, axis=1)):
            raise InputError("box: the edges span no volume: give finite vectors [m] that do not lie in one plane or line")
        return edges

    def with_images(self) -> Lattice:
        """A copy in which every image that a spring, angle spring or hinge joins is named: it stays the one that is nearest now, wherever particles are moved."""
        if self.box is None:
            return self
        several: Dict[str, Any] = {}
        for kind, (name, count) in INTERACTIONS.items():
            rows = getattr(self, kind)
            if rows is not None and rows.get("shift") is None:
                ends, centre = rows[name], CENTRES[kind]
                nearest = [self._nearest(ends[:, centre], ends[:, k]) * (k != centre) for k in range(count)]
                several[kind] = {**rows, "shift": np.concatenate(nearest, axis=1)}
        return self.replace(shift=self.nearest_shift() if self.shift is None else self.shift, **several)

    def ways(self) -> Floats:
        """(S, d) from the first end of every spring to the second [m]."""
        return self._ways_at(self.x)

    def _ways_at(self, x: Floats, box: Optional[Floats] = None) -> Floats:
        """The same where the particles are at x and the box has other edges, if they are given: springs join the images that they join now."""
        way = x[self.pairs[:, 1]] - x[self.pairs[:, 0]]
        if self.box is None:
            return np.asarray(way, float)
        shift = self.nearest_shift() if self.shift is None else self.shift
        return np.asarray(way + shift @ (self.box if box is None else box), float)

    def _box_of(self, observables: Observables) -> Optional[Floats]:
        """(d, d) edges of the box at the moment of these observables [m]."""
        edges = self.box if self.box is None else np.atleast_1d(observables.get("/particles/trajectory/box/edges", self.box))
        return edges if edges is None or edges.ndim == 2 else np.diag(edges)

    def lengths(self) -> Floats:
        """(S,) lengths of the springs as they are [m]."""
        return np.asarray(np.linalg.norm(self.ways(), axis=1), float)

    def replace(self, **changes: Any) -> Lattice:
        """A copy with other values of some arguments of the constructor, in their shapes and units; `parallel` is what the lattice was made with. box=None: without
        the box, and so without the images in it, unless they are given."""
        names = ("x", "pairs", "stiffness", "rest_length", "damping", "area", "mass", "velocity", "fixed", "groups", "box", "shift", "law", "damping_law",
                 "spring_columns", "particle_columns", "anchors", "angles", "hinges", "breaking", "options")
        given: Dict[str, Any] = {name: getattr(self, name) for name in names}
        again = {"pairs", "shift", "parallel"} & set(changes)  # what has not changed was looked through before
        given.update(periodic=self.periodic if self.box is not None else None, parallel=self.parallel if again else True)
        if "box" in changes and changes["box"] is None:
            given.update(periodic=None, shift=None)
            given.update({kind: {**given[kind], "shift": None} for kind in INTERACTIONS if given[kind]})
        net = Lattice(**{**given, **changes})
        net.parallel = net.parallel if again else self.parallel
        return net

    def _outdone(self, settings: Settings) -> List[str]:
        """What the lattice itself says in the place of options of these settings."""
        from ._core import kept_name

        own = {f"-bs_break_{name.split('_')[1]}": f"breaking[{name!r}]" for name in self.breaking if name != "broken"}
        for kind in INTERACTIONS:
            limits = [name for name in getattr(self, kind) or () if name in TURN_LIMITS and name != "broken"]
            own.update({f"-bs_break_{kind[:-1]}_{name.split('_')[1]}": f"{kind}[{name!r}]" for name in limits})
        return [f"the lattice has its own {own[kept_name(name)]}; ignored: {name[1:]}" for name, _ in settings if kept_name(name) in own]

    def save(self, path: Path, overwrite: bool = False, comm: Comm = None) -> None:
        """Writes a lattice file (.h5) that the program reads by bs_lattice_file. Collective on `comm`."""
        core, handle = started(comm)
        require_same(comm, {**vars(self), "path": str(path), "overwrite": overwrite})
        error, told = core.write_lattice(handle, self._arrays(), [("-bs_overwrite", "true")] if overwrite else [], str(path))
        pass_on(told)
        check(error)

    def plot(self, file: Optional[Path] = None, **look: Any) -> Figure:
        """A picture of it, springs in grey, fixed particles as squares; written to `file` if one is named. Returns the figure of
        matplotlib. look: size [inch], dpi, cmap."""
        from .picture import draw

        return draw(self, self.x, file=file, **look)

    def _repr_html_(self) -> str:
        return looks.page("Lattice", looks.of_lattice(self), looks.picture(self, self.x))

    def __repr__(self) -> str:
        box = "" if self.box is None else f", periodic along {sum(self.periodic)} edges"
        return f"<backspring.Lattice: {len(self)} particles and {len(self.pairs)} springs in {self.dim} dimensions, {int(self.fixed.sum())} fixed{box}>"

    def _arrays(self) -> LatticeArrays:
        """For the extension."""
        from . import _core

        arrays = _core.LatticeArrays()
        arrays.dim = self.dim
        arrays.position, arrays.velocity, arrays.mass, arrays.fixed = self.x, self.velocity, self.mass, self.fixed
        arrays.springs, arrays.stiffness, arrays.damping = self.pairs, self.stiffness, self.damping
        for name in ("rest_length", "area", "shift"):
            if getattr(self, name) is not None:
                setattr(arrays, name, getattr(self, name))
        arrays.spring_columns, arrays.particle_columns, arrays.break_columns, arrays.groups = self.spring_columns, self.particle_columns, self.breaking, self.groups
        arrays.implied_options = [("-" + name, text) for name, text in self.options.items()]
        arrays.damping_law = self.damping_law
        if isinstance(self.law, str):
            arrays.spring_law = self.law
        else:
            arrays.laws = sorted(set(self.law))
            arrays.law = [arrays.laws.index(one) for one in self.law]
        if self.box is not None:
            arrays.box = (list(self.periodic), self.box.ravel().tolist())
        if self.anchors:
            arrays.anchors = tuple(self.anchors[name] for name in ("particle", "point", "stiffness", "rest_length", "damping"))
        for kind, (name, _) in INTERACTIONS.items():
            given = getattr(self, kind)
            if given:
                arrays.add_interactions(kind, given[name], np.stack([given["stiffness"], given["rest_angle"]], axis=1), given.get("shift", np.zeros(0, np.int64)),
                                        {key: given[key] for key in TURN_LIMITS if key in given})
        return arrays
