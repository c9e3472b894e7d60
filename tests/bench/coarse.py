"""What the coarse grid of the block factors costs and saves: its time by its size on one rank, Krylov iterations as ranks grow with the lattice."""
import cases
from running import Failed, program

RANKS = {1: (1, 1, 1), 2: (1, 1, 2), 4: (1, 2, 2), 8: (2, 2, 2)}  # cubes of each rank, along the axes
FINE, FEW, PARTICLES = 60, 2200, 0.3  # as in coarse_space.cpp
SMALL, LARGE = 81, 6000  # unknowns of a coarse grid that takes next to no time, and of one whose time is measured


def unknowns(particles, ranks=1, given=None):
    """Of the coarse grid of a cube: three at each node of the finest grid of at most a third as many nodes as are given, or as the program chooses."""
    wanted = given or min(3 * particles / FINE, max(FEW, (PARTICLES * particles / ranks) ** 0.75))
    nodes = int(wanted / 3)
    edge = round(nodes ** (1 / 3))
    edge -= edge**3 > nodes
    return 3 * edge**3 if edge > 1 else 0


def growing(n, ranks):
    """B1 of n^3 particles on each rank, at the h omega_max of n = 40."""
    along = RANKS[ranks]
    return dict(cases.problem("B1", n, cases.equal_swing(n), 3), bs_lattice_size=tuple(n * k for k in along), bs_lattice_total_mass=1000.0 * ranks)


def iterations(context, n):
    """Krylov iterations of a step as the lattice grows with the ranks: counts, which do not depend on how many ranks share a core."""
    rows = []
    for ranks in RANKS:
        row = {"ranks": ranks, "particles": ranks * n**3}
        for key, more in (("krylov", {}), ("krylov_without", {"condensed_pc_bicc_coarse": 0})):
            report = program(context, dict(growing(n, ranks), condensed_pc_type="bicc", **more), ranks)["report"]
            row[key] = report["krylov"] / report["steps"]
        context.say(f"coarse grid, {ranks} rank(s): {row['krylov']:.1f} Krylov iterations a step, without it {row['krylov_without']:.1f}")
        rows.append(row)
    return rows


def times(context, n):
    """[{unknowns, s_per_application, s_per_set_up}] of a small and a large coarse grid over the same cube on one rank: the least of the repeats, since other
    processes only add to it."""
    rows = []
    for given in (SMALL, LARGE):
        options = dict(cases.problem("B1", n, cases.equal_swing(n), 3), condensed_pc_type="bicc", condensed_pc_bicc_coarse=given)
        runs = [program(context, options)["events"] for _ in range(context.repeats)]
        one = {key: min(events[name]["time"] / events[name]["count"] for events in runs)
               for key, name in (("s_per_application", "BSCoarse"), ("s_per_set_up", "BSCoarseSetUp"))}
        rows.append({"unknowns": unknowns(1e12, given=given), **one})
        context.say(f"coarse grid of {rows[-1]['unknowns']} unknowns: {one['s_per_application']:.3g} s an application, {one['s_per_set_up']:.3g} s a set-up")
    return rows


def run(context):
    """{"iterations": rows, "times": rows}, or {"failed": why}."""
    try:
        return {"iterations": iterations(context, max(2, context.n // 2)), "times": times(context, max(12, context.n))}
    except Failed as why:
        context.say(f"coarse grid: {why}")
        return {"failed": str(why)}
