"""Bars: stiffness and mass of springs by Young's modulus, cross section and density, of the whole lattice or of groups of its springs."""
import numpy as np

from backspring_io import RunError
from lattices import ids_of, lengths

OPTIONS = ("youngs", "area", "density")


class Values:
    """What an option says: a number of all springs, and numbers of groups, which go before it."""

    def __init__(self, option, texts):
        self.option, self.rest, self.of_group = option, None, {}
        for item in ",".join(texts).split(","):
            group, equals, number = item.strip().rpartition("=")
            value = self._positive(number, item)
            if equals and not group:
                raise RunError(f"{option} {item}: names no group before the =: write {option} GROUP=VALUE")
            if (group in self.of_group) if equals else (self.rest is not None):
                raise RunError(f"{option}: gives two values of " + (f"group {group}" if equals else "the whole"))
            if equals:
                self.of_group[group] = value
            else:
                self.rest = value

    def _positive(self, number, item):
        try:
            value = float(number)
        except ValueError:
            raise RunError(f"{self.option} {item}: write a number, or GROUP=NUMBER, with commas between several") from None
        if not (np.isfinite(value) and value > 0):
            raise RunError(f"{self.option} {item}: must be positive")
        return value

    def of_springs(self, lattice, path):
        """The value (M,) of every spring."""
        out = np.full(len(lattice.pairs), np.nan if self.rest is None else self.rest)
        owner = np.full(len(out), None)
        for group, value in self.of_group.items():
            if group not in lattice.spring_groups:
                known = ", ".join(lattice.spring_groups) or "none: physical groups of curves, surfaces and volumes of Gmsh are"
                raise RunError(f"{path}: {self.option} {group}: no group with springs has this name; there are {known}")
            rows = lattice.spring_groups[group]
            twice = rows[(owner[rows] != None) & (out[rows] != value)]  # noqa: E711
            if len(twice):
                raise RunError(f"{path}: {self.option}: {_named(lattice, twice[0])} is of the groups {owner[twice[0]]} and {group}, which have different values")
            out[rows], owner[rows] = value, group
        bare = np.flatnonzero(np.isnan(out))
        if len(bare):
            raise RunError(f"{path}: {self.option}: {_named(lattice, bare[0])} is in none of the groups {', '.join(self.of_group)}; add a value of all others, as in "
                           f"{self.option} VALUE,{next(iter(self.of_group))}={next(iter(self.of_group.values())):g}")
        return out


def _named(lattice, spring):
    a, b = ids_of(lattice)[lattice.pairs[spring]]
    return f"the spring between points {a} and {b}"


def of_bars(args, lattice):
    """Stiffness and mass of bars of Young's modulus E, area A and density rho: k = E A/L, in strain form K = E A; each end has half of rho A L. L is the rest length.
    The lattice keeps A, of which the program makes stresses."""
    if args.youngs is None and args.density is None:
        return
    if not len(lattice.pairs):
        raise RunError(f"{args.input}: has no springs that --youngs or --density could be of")
    length = lattice.rest_length if lattice.rest_length is not None else lengths(lattice)
    short = np.flatnonzero(~(length > 0))
    if len(short):
        raise RunError(f"{args.input}: spring {short[0]} has no length; --youngs and --density are for bars")
    area = args.area.of_springs(lattice, args.input)
    lattice.spring_columns = {**lattice.spring_columns, "area": area}
    if args.youngs is not None:
        strain = lattice.laws == "strain" if args.spring_law is None and lattice.laws is not None else args.spring_law == "strain"
        lattice.stiffness = args.youngs.of_springs(lattice, args.input) * area / np.where(strain, 1.0, length)
    if args.density is not None:
        half = 0.5 * args.density.of_springs(lattice, args.input) * area * length
        lattice.mass = np.bincount(lattice.pairs.ravel(), np.repeat(half, 2), len(lattice.position))
        bare = np.flatnonzero(lattice.mass == 0)
        if len(bare):
            raise RunError(f"{args.input}: point {ids_of(lattice)[bare[0]]} has no springs, so that --density gives it no mass; leave it out, or give --mass in place of --density")
