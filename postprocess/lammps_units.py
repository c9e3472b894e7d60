"""Units of LAMMPS, and what a stiffness in them is worth in the equation of motion.

A file's mass, length and time stay as they are; only energies do not always fit to them. With mass m, length l, time t and energy e
of a style, m l^2/t^2 is the energy that fits, so a stiffness [e/l^2] becomes `factor` times as many [m/t^2], factor = e t^2/(m l^2).
"""
from backspring_io import RunError

MOLE = 6.02214076e23
DALTON, ANGSTROM, BOHR, HARTREE, ELECTRON_VOLT = 1e-3 / MOLE, 1e-10, 5.29177210903e-11, 4.3597447222071e-18, 1.602176634e-19

# mass [kg], length [m], time [s], energy [J], and what their numbers are called
UNITS = {
    "real": (DALTON, ANGSTROM, 1e-15, 4184 / MOLE, "g/mol, Angstrom, fs"),
    "metal": (DALTON, ANGSTROM, 1e-12, ELECTRON_VOLT, "g/mol, Angstrom, ps"),
    "electron": (DALTON, BOHR, 1e-15, HARTREE, "u, Bohr, fs"),
    "si": (1.0, 1.0, 1.0, 1.0, "kg, m, s"),
    "cgs": (1e-3, 1e-2, 1.0, 1e-7, "g, cm, s"),
    "micro": (1e-15, 1e-6, 1e-6, 1e-15, "pg, um, us"),
    "nano": (1e-21, 1e-9, 1e-9, 1e-21, "ag, nm, ns"),
    "lj": None,
}


def factor(style):
    """Stiffness in mass/time^2 of one stiffness in energy/length^2 of the style: 1 but for real, metal and electron."""
    if style not in ("real", "metal", "electron"):
        return 1.0
    mass, length, time, energy, _ = UNITS[style]
    return energy * time ** 2 / (mass * length ** 2)


def named(style):
    """The units that a lattice of this style is in, for people."""
    return "reduced (lj) units" if UNITS[style] is None else UNITS[style][4]


def length_of(style):
    """The unit of lengths of a lattice of this style; '' where they are relative."""
    return "" if UNITS[style] is None else UNITS[style][4].split(", ")[1]


def to_si(style):
    """(mass, length, time): one of the style's in SI."""
    if UNITS[style] is None:
        raise RunError("--si: units lj are relative to a mass, a length and an energy that no file names")
    return UNITS[style][:3]
