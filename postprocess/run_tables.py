"""The part of a Run that reads tables over time, observables, the log of steps, sources, and the units of all quantities."""
import os

import numpy as np

from open_hdf5 import RunError, h5py
from run_data import PARTICLES, SI, TENSOR, Series, text


class TabledRun:
    """Observables, log, sources, units."""

    def unit(self, name):
        """The unit of a quantity: what the file says, else SI; '' for what has none."""
        said = self.stated_unit(name)
        if name == "position" and self.length_unit:
            return self.length_unit
        if name == "position" and said is None and self.length_unit_of_lattice is not None:
            return self.length_unit_of_lattice
        if name == "stress" and said is None:
            return ["N", "N/m", "Pa"][self.dim - 1]
        return SI.get(name.partition("/")[0], "") if said is None else said

    @property
    def length_unit_of_lattice(self):
        """The unit of lengths that the lattice file of the run says (attribute length_unit, of convert.py), or None: also where the file is not there any more, or is
        of other particles. Its name is meant from where the program ran, as that of the trajectory is."""
        if "length_unit" not in self._cache:
            named, written = (self.parameters.get(name, "") for name in ("bs_lattice_file", "bs_output"))
            here = os.path.abspath(self.path)
            from_there = here[:-len(written)] if written and here.endswith(os.sep + written) else os.path.dirname(here)
            places = filter(os.path.isfile, (os.path.join(folder, named) for folder in (from_there, os.getcwd()))) if named else []
            self._cache["length_unit"] = next((unit for unit in map(self._unit_in, places) if unit is not None), None)
        return self._cache["length_unit"]

    def _unit_in(self, path):
        try:
            with h5py.File(path, "r") as lattice:
                same = np.isin(self.id, lattice["particles/id"][...] if "particles/id" in lattice else np.arange(len(lattice["particles/position"]))).all()
                return text(lattice.attrs["length_unit"]) if same else None
        except (OSError, KeyError, TypeError, ValueError):
            return None

    def stated_unit(self, name):
        """The unit that the file says, or None."""
        group = PARTICLES if name in ("position", "velocity") else "/observables"
        owner = self._get(f"{PARTICLES}/position/time" if name == "time" else f"{group}/{name}/value")
        said = owner.attrs.get("unit") if owner is not None else None
        return None if said is None else text(said)

    @property
    def units(self):
        """{name: unit} of time, positions, velocities and every observable."""
        return {name: self.unit(name) for name in ("time", "position", "velocity", *self.series)}

    @property
    def series(self):
        """The observables as arrays {name: (T,) or (T, k)}; all have the length of observable_times."""
        return self._observables()[0]

    @property
    def observable_times(self):
        return self._observables()[1]

    def _observables(self):
        if "observables" not in self._cache:
            found, times = {}, self.times
            items = dict(self._file.get("/observables", {}).items())
            items.pop("springs", None)  # fields, a number of every spring
            for name, item in list(items.items()):  # reaction/NAME and work/NAME lie one level deeper
                if isinstance(item, h5py.Group):
                    items.update({f"{name}/{own}": inner for own, inner in item.items() if isinstance(inner, h5py.Group)})
            for name, item in items.items():
                value = self._array(f"/observables/{name}/value") if isinstance(item, h5py.Group) else None
                if value is not None and value.ndim and len(value):
                    flat = value.reshape(len(value), -1).astype(float)
                    found[name] = flat[:, 0] if flat.shape[1] == 1 else flat
                    own = self._array(f"/observables/{name}/time")
                    times = own if own is not None and own.ndim and len(own) else times
            count = min([len(times)] + [len(v) for v in found.values()])
            if count > self.frames and np.array_equal(times[:self.frames], self.times):
                count = self.frames  # a run that goes on has written more since the frames were counted
            self._cache["observables"] = {k: v[:count] for k, v in found.items()}, np.asarray(times[:count], float)
        return self._cache["observables"]

    def components(self, name, count):
        """Names of the `count` columns of an observable."""
        if name.startswith("stress") and count == len(TENSOR.get(self.dim, ())):
            return TENSOR[self.dim]
        asked = [word.partition("=")[0].strip() for word in self.parameters.get("bs_box_stress", "").split(",")]
        if name == "free_strain" and len(asked) == count:
            return asked
        return list("xyz"[:count]) if count <= 3 else [str(i) for i in range(count)]

    @property
    def static(self):
        """Whether the frames are equilibria under a load factor (-bs_task statics), and no motion."""
        return "load_factor" in self.series

    @property
    def observables(self):
        """The observables as a pandas DataFrame: one row a frame, its index the time, vectors as name_x, name_y, name_z, stresses as name_xx, name_yy, ..."""
        try:
            import pandas
        except ImportError:
            raise RunError("no pandas in this Python; install with: sudo apt-get install python3-pandas") from None
        columns = {}
        for name, value in self.series.items():
            if value.ndim == 1:
                columns[name] = value
            else:
                columns.update({f"{name}_{part}": value[:, i] for i, part in enumerate(self.components(name, value.shape[1]))})
        return pandas.DataFrame(columns, index=pandas.Index(self.observable_times, name="time"))

    @property
    def log(self):
        """One row a step: {"step", "time", "dt", "newton", "krylov", "rejected"}; {} where the file has none."""
        if "log" not in self._cache:
            group = self._file.get("/backspring/log", {})
            found = {k: self._array(f"/backspring/log/{k}") for k in group if self._get(f"/backspring/log/{k}") is not None}
            found = {k: v.reshape(-1) for k, v in found.items()}
            count = min([len(v) for v in found.values()], default=0)
            self._cache["log"] = {k: v[:count] for k, v in found.items()} if count else {}
        return self._cache["log"]

    @property
    def sources(self):
        """Sources of a linear system over time; value is None where the file has none."""
        value = self._get("/sources/value")
        if value is None:
            return Series()
        times = self._array("/sources/time")
        labels = self._labels("/sources", value.shape[1] if value.ndim > 1 else 1, "u")
        return Series(value, self.times if times is None else times, labels, self._units_of("/sources", labels))

    def _labels(self, group, count, letter):
        labels = self._array(f"{group}/labels")
        found = [] if labels is None else [text(v) for v in labels.ravel()]
        return found + [f"{letter}{i}" for i in range(len(found), count)]


    def _units_of(self, group, labels):
        """The unit of each state or source: as the file says (units, a dataset), else, of circuits, by the letter that its label begins with."""
        said = self._array(f"{group}/units")
        if said is not None:
            return ([text(v) for v in said.ravel()] + [""] * len(labels))[:len(labels)]
        circuit = self.parameters.get("bs_linear_type") in ("rc_ladder", "rlc") or "bs_netlist" in self.parameters
        return [{"v": "V", "i": "A", "u": "V"}.get(label[:1].lower(), "") if circuit else "" for label in labels]
