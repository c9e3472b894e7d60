"""The part of a Run that reads springs and all else that joins particles, and the periodic box that they cross."""
import numpy as np

from run_data import BONDS, HISTORIES, LAW_DATA, LIMITS, PARTICLES, TURN_LIMITS, TURNS, Angles, Springs, counted, text


class JoinedRun:
    """Springs, their laws and states, angle springs, hinges, anchors, box."""

    @property
    def springs(self):
        """Springs between particles; length 0 where the file has none."""
        if "springs" not in self._cache:
            self._cache["springs"] = self._read_springs()
        return self._cache["springs"]

    def _read_springs(self):
        pairs = self._array(BONDS)
        if pairs is None or pairs.size == 0:
            return Springs(np.zeros((0, 2), dtype=np.int64), *(np.zeros(0),) * 3)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise self._error(f"{BONDS} has shape {pairs.shape}, expected (springs, 2)")
        pairs = pairs.astype(np.int64)
        if pairs.min() < 0 or pairs.max() >= self.particles:
            row = int(np.argmax(((pairs < 0) | (pairs >= self.particles)).any(axis=1)))
            raise self._error(f"{BONDS} row {row} joins {pairs[row, 0]} and {pairs[row, 1]}; rows go from 0 to "
                              f"{self.particles - 1}")
        columns = {name: self._column_of_springs(name, len(pairs)) for name in ("stiffness", "rest_length", "damping")}
        shift = self._array(f"{BONDS}_shift")
        law_data = {name: self._column_of_springs(name, len(pairs)) for name in LAW_DATA if self._get(f"{BONDS}_{name}") is not None}
        drawn = {name: self._column_of_springs(name.replace("critical", "threshold"), len(pairs)) for name in LIMITS}
        limits = {name: law_data.get(name) if drawn[name] is None else drawn[name] for name in LIMITS}
        springs = Springs(pairs, **columns, shift=None if shift is None else shift.astype(np.int64), law_data=law_data,
                          limits={name: values for name, values in limits.items() if values is not None})
        self._cache["springs"] = springs  # lengths() looks at it
        if springs.rest_length is None:
            springs.rest_length, springs.rest_length_assumed = self.lengths(0), True
        return springs

    def _column_of_springs(self, name, count):
        data = self._array(f"{BONDS}_{name}")
        if data is not None and data.size != count:
            raise self._error(f"{BONDS}_{name} has {counted(data.size, 'row')} for {counted(count, 'spring')}")
        return None if data is None else data.astype(float).reshape(-1)

    @property
    def periodic(self):
        """[bool] * d: along which edges of its box the lattice is repeated."""
        box = self._file.get(f"{PARTICLES}/box")
        words = [text(w) for w in np.atleast_1d(box.attrs.get("boundary", []))] if box is not None else []
        return ([w == "periodic" for w in words] + [False] * self.dim)[:self.dim]

    def box_edges(self, frame):
        """Edge vectors (d, d) of the box of a frame as rows [m]."""
        edges = np.asarray(self._read(f"{PARTICLES}/box/edges/value", frame), float)
        return (np.diag(edges) if edges.ndim == 1 else edges)[:self.dim, :self.dim]

    def lengths(self, frame):
        """Lengths (M,) of the springs [m], to the image of the second end that they join."""
        x, springs = self.position(frame), self.springs
        apart = x[springs.pairs[:, 1]] - x[springs.pairs[:, 0]]
        if springs.shift is not None:
            apart = apart + springs.shift @ self.box_edges(frame)
        return np.sqrt((apart ** 2).sum(axis=1))

    def broken(self, frame):
        """Which springs (M,) are broken; None in a run whose springs cannot break."""
        path = "/backspring/broken/value"
        return None if self._get(path) is None else np.asarray(self._read(path, frame)) != 0

    def acting(self, frame):
        """Which springs (M,) are there: neither broken nor without any stiffness and damping."""
        broken = self.broken(frame)
        return ~self.springs.idle if broken is None else ~(self.springs.idle | broken)

    def slack(self, frame):
        """Which springs (M,) only pull and are shorter than their rest length, so that they carry nothing."""
        laws = self.spring_laws
        if laws is None or not np.any(laws == "tension"):
            return np.zeros(len(self.springs), bool)
        return (laws == "tension") & (self.lengths(frame) < self.springs.rest_length * (1 - 1e-12)) & self.acting(frame)

    def spring_state(self, name, frame):
        """What springs carry from step to step (M,), plastic_stretch and the like; None where no law has it."""
        path = f"/backspring/{name}/value"
        return None if self._get(path) is None else np.asarray(self._read(path, frame), float)

    def _carried(self, name, frame):
        """/observables/springs/NAME (M,), which -bs_output_springs writes; None in a run without it."""
        path = f"/observables/springs/{name}/value"
        return None if self._get(path) is None else np.asarray(self._read(path, frame), float)

    def stresses(self, frame):
        """Tensions by cross-sections (M,) [Pa]; NaN where the spring is broken or carries nothing. None in a run that did not write them."""
        return self._carried("stress", frame)

    def strains(self, frame):
        """Strains (M,) = (l - L)/L; NaN where the rest length L is 0 and where the spring is broken or carries nothing."""
        rest = self.springs.rest_length
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where((rest > 0) & self.acting(frame), (self.lengths(frame) - rest) / rest, np.nan)

    def tensions(self, frame):
        """Elastic forces (M,) of the springs [N], positive where they pull, as written or else by their laws; 0 where broken or slack, without what dampers carry.
        None where the file does not say all that its laws need."""
        written = self._carried("tension", frame)
        if written is not None:
            return np.nan_to_num(written)
        springs, laws = self.springs, self.spring_laws
        if laws is None or springs.stiffness is None:
            return None
        rest, k, length = springs.rest_length, springs.stiffness, self.lengths(frame)
        stretch, out = length - rest, np.full(len(springs), np.nan)
        data = {**springs.law_data, **{name: self.spring_state(name, frame) for name in HISTORIES}}
        for law in set(laws):
            here = laws == law
            forces = {"hooke": lambda: k * stretch, "tension": lambda: k * np.maximum(stretch, 0.0),
                      "strain": lambda: k * np.where(rest > 0, stretch / np.where(rest > 0, rest, 1.0), length),
                      "polynomial": lambda: sum(c * stretch ** p for p, c in ((1, k), (2, data.get("stiffness_2", 0.0)), (3, data.get("stiffness_3", 0.0)))),
                      "plastic": lambda: k * (stretch - data["plastic_stretch"]), "maxwell": lambda: k * (stretch - data["viscous_stretch"])}
            needed = {"plastic": ["plastic_stretch"], "maxwell": ["viscous_stretch"]}.get(law, [])
            if law not in forces or any(data.get(name) is None for name in needed) or law == "polynomial" and not {"stiffness_2", "stiffness_3"} & set(springs.law_data):
                return None
            out[here] = forces[law]()[here]
        return np.where(self.acting(frame), out, 0.0)

    @property
    def spring_law(self):
        """The name of the law that all springs obey; None where the file does not say, or has a law for each (spring_laws)."""
        return self.parameters.get("bs_spring_law", self.parameters.get("spring_law"))

    @property
    def spring_laws(self):
        """The name of each spring's law (M,); None where the file does not say."""
        places = self._array(f"{BONDS}_law")
        if places is None:
            return None if self.spring_law is None else np.full(len(self.springs), self.spring_law)
        names = text(self._get(f"{BONDS}_law").attrs.get("spring_laws", "")).split(",")
        if places.size != len(self.springs) or places.min(initial=0) < 0 or places.max(initial=0) >= len(names):
            raise self._error(f"{BONDS}_law does not name a law of attribute spring_laws for each of {len(self.springs)} springs")
        return np.array(names)[places.reshape(-1).astype(np.int64)]

    @property
    def angles(self):
        """Angle springs, or None."""
        triples = self._array("/connectivity/angles")
        if triples is None:
            return None
        columns = [self._array("/connectivity/angles_" + k) for k in ("stiffness", "rest_angle")]
        return Angles(triples, *columns, self._shift("angles", 3), self._turn_limits("angles", len(triples)), np.arange(len(triples)))

    def angles_at(self, frame):
        """Angle springs that are whole in a frame, or None where there are none."""
        angles, broken = self.angles, self.broken_turns("angles", frame)
        angles = angles if angles is None or broken is None else angles.taken(~broken)
        return angles if angles else None

    def _turn_limits(self, kind, count):
        """{critical_change, ...: (A,)}: what each angle spring or hinge (`kind`: angles, hinges) bears, as drawn where limits scatter; inf: it does not break."""
        found = {}
        for name in TURN_LIMITS:
            drawn = self._array(f"/connectivity/{kind}_{name.replace('critical', 'threshold')}")
            values = self._array(f"/connectivity/{kind}_{name}") if drawn is None else drawn
            if values is not None:
                if values.size != count:
                    raise self._error(f"/connectivity/{kind}_{name} has {counted(values.size, 'row')} for {counted(count, TURNS[kind])}")
                found[name] = values.astype(float).reshape(-1)
        return found

    def broken_turns(self, kind, frame):
        """Which angle springs or hinges (A,) (`kind`: angles, hinges) are broken; None where they cannot break."""
        path = f"/backspring/broken_{kind}/value"
        return None if self._get(path) is None else np.asarray(self._read(path, frame)) != 0

    def _shift(self, kind, ends):
        """The periodic box that each end is in, (A, ends, d), or None."""
        shift = self._array(f"/connectivity/{kind}_shift")
        return None if shift is None else shift.reshape(len(shift), ends, -1)

    @property
    def hinges(self):
        """Hinges between triangles, {"quads" (H, 4), "stiffness", "rest_angle" (H)}: the edge's ends, then the wings; "shift" (H, 4 d) in periodic boxes;
        "critical_change", ... (H): what each bears; or None."""
        found = {k: self._array("/connectivity/hinges" + name) for k, name in (("quads", ""), ("stiffness", "_stiffness"), ("rest_angle", "_rest_angle"), ("shift", "_shift"))}
        if found["quads"] is None:
            return None
        return {k: v for k, v in (found | self._turn_limits("hinges", len(found["quads"]))).items() if v is not None}

    def hinges_at(self, frame):
        """Hinges that are whole in a frame, or None where there are none."""
        hinges, broken = self.hinges, self.broken_turns("hinges", frame)
        hinges = hinges if hinges is None or broken is None else {k: v[~broken] for k, v in hinges.items()}
        return hinges if hinges and len(hinges["quads"]) else None

    @property
    def anchors(self):
        """Springs to given points, {"particle" (A), "point" (A, d), "stiffness", "rest_length", "damping" (A)}, or None."""
        path = "/backspring/anchors/"
        return None if self._get(path + "particle") is None else {k: self._array(path + k) for k in ("particle", "point", "stiffness", "rest_length", "damping")}
