"""The benchmark's problems as options of the program, at any size."""
import pathlib

REPO = pathlib.Path(__file__).resolve().parents[2]

# Position [m] of particle (39, 39, 39) of B1 at n = 40 after five steps of 0.01 s, which independent solvers agree on.
CHECK_N, CHECK_H, CHECK_STEPS = 40, 0.01, 5
CHECK_POSITION = (1.00967097, 0.97495582, 0.95586798)
CHECK_TOLERANCE = 2e-6  # Newton stops at 1e-6

# The path PETSc would take by itself, on the full Jacobian of both rows.
FULL = {1: {"mat_type": "aij", "ksp_type": "gmres", "pc_type": "ilu"},
        2: {"mat_type": "aij", "ksp_type": "gmres", "pc_type": "bjacobi", "sub_pc_type": "ilu"}}

# Point-block Jacobi instead of incomplete factors.
LOW_MEMORY = {"condensed_pc_type": "jacobi"}


def problem(name, n, h=0.01, steps=5, layers=None):
    """Options of B1 or B2 at n x n x `layers` (n by default) particles, `steps` steps of h [s]."""
    layers = layers or n
    return {"options_file": str(REPO / "options" / "problems" / f"bench_{name.lower()}.yaml"),
            "bs_lattice_size": (n, n, layers), "bs_lattice_spacing": 1.0 / n, "bs_lattice_total_mass": 1000.0 * layers / n,
            "ts_dt": h, "ts_max_steps": steps, "ts_max_time": 1.001 * h * steps}


def particles(n, layers=None):
    return n * n * (layers or n)


def springs(n, layers=None):
    """Springs of the cubic lattice on 18 neighbours: along three axes and six face diagonals."""
    m = layers or n
    edges = 2 * (n - 1) * n * m + n * n * (m - 1)
    return edges + 2 * (n - 1) ** 2 * m + 4 * n * (n - 1) * (m - 1)


def equal_swing(n):
    """The step [s] at which h omega_max is that of n = 40 at 0.01 s: omega_max grows as n^2."""
    return 0.01 * (40 / n) ** 2
