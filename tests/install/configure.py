#!/usr/bin/env python3
"""A part that is missing, too old or of another kind ends CMake's configuration with a message that names it, and what to install or to give.

  configure.py --source . [--filter WORD]

The part is hidden: pkg-config sees a folder that has links to the system's .pc files but for it, or one that is made up; CMake's own packages are switched off.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

MODULES = ("PETSc", "SLEPc", "hdf5-openmpi", "yaml-0.1")
EVERYWHERE = ("Debian, Ubuntu:  apt install", "Fedora:          ", "macOS:           brew install")


def pc_files(folder, leave_out=(), made_up=None):
    """A folder of .pc files with the system's MODULES but for `leave_out`, and those of `made_up` {module: text}."""
    folder.mkdir()
    for module in set(MODULES) - set(leave_out) - set(made_up or {}):
        found = subprocess.run(["pkg-config", "--variable=pcfiledir", module], capture_output=True, text=True, check=True).stdout.strip()
        (folder / f"{module}.pc").symlink_to(pathlib.Path(found) / f"{module}.pc")
    for module, text in (made_up or {}).items():
        (folder / f"{module}.pc").write_text(text)
    return folder


def petsc(folder, version="3.20.0", defines=("PETSC_USE_REAL_DOUBLE",)):
    """PETSc.pc of a PETSc that was configured so."""
    (folder / "petsc/include").mkdir(parents=True)
    (folder / "petsc/include/petscconf.h").write_text("".join(f"#define {name} 1\n" for name in defines))
    return f"prefix={folder}/petsc\nName: PETSc\nDescription: made up\nVersion: {version}\nCflags: -I${{prefix}}/include\nLibs: -lm\n"


SLEPC = "prefix=/nowhere\nName: SLEPc\nDescription: made up\nVersion: {}\nLibs: -lm\n"

# name: (folder -> arguments of pc_files, definitions given to CMake, what the message says)
CASES = {
    "PETSc": (lambda f: dict(leave_out=["PETSc"]), [], ["PETSc 3.18 or newer was not found", "petsc-dev", "petsc-openmpi-devel", "brew install petsc", "-DPETSC_DIR=DIR", *EVERYWHERE]),
    "PETSc too old": (lambda f: dict(made_up={"PETSc": petsc(f, "3.17.4")}), [], ["PETSc 3.17.4", "too old: 3.18 or newer"]),
    "PETSc of complex numbers": (lambda f: dict(made_up={"PETSc": petsc(f, defines=("PETSC_USE_REAL_DOUBLE", "PETSC_USE_COMPLEX")), "SLEPc": SLEPC.format("3.20.1")}), [],
                                 ["does not count in real numbers of double precision", "--with-scalar-type=real"]),
    "PETSc of single precision": (lambda f: dict(made_up={"PETSc": petsc(f, defines=("PETSC_USE_REAL_SINGLE",)), "SLEPc": SLEPC.format("3.20.1")}), [],
                                  ["does not count in real numbers of double precision"]),
    "PETSc that does not compile": (lambda f: dict(made_up={"PETSc": petsc(f), "SLEPc": SLEPC.format("3.20.1")}), [], ["cannot be compiled: they must be of one MPI", "petscts.h"]),
    "folder of no PETSc": (lambda f: {}, ["-DPETSC_DIR=/nowhere", "-DPETSC_ARCH=fast"], ["-DPETSC_DIR=/nowhere -DPETSC_ARCH=fast: no PETSc is built there"]),
    "folder of no SLEPc": (lambda f: {}, ["-DSLEPC_DIR=/nowhere"], ["-DSLEPC_DIR=/nowhere: no SLEPc"]),
    "SLEPc": (lambda f: dict(leave_out=["SLEPc"]), [], ["SLEPc 3.18 or newer was not found", "slepc-dev", "brew install slepc", "-DSLEPC_DIR=DIR", *EVERYWHERE]),
    "SLEPc of another release": (lambda f: dict(made_up={"SLEPc": SLEPC.format("3.99.0")}), [], ["SLEPc 3.99.0", "does not go with PETSc"]),
    "SLEPc of another PETSc": (lambda f: dict(made_up={"PETSc64": petsc(f), "SLEPc": SLEPC.format("3.20.1") + "Requires: PETSc\n"}), ["-DBS_PETSC_MODULE=PETSc64"],
                               ["SLEPc 3.20.1 (SLEPc) was built with another PETSc than PETSc64", "-DBS_SLEPC_MODULE=SLEPc64"]),
    "HDF5": (lambda f: dict(leave_out=["hdf5-openmpi"]), ["-DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON"], ["an HDF5 for MPI was not found", "libhdf5-openmpi-dev", "hdf5-openmpi-devel", "brew install hdf5-mpi",
                                                                                                   "-DHDF5_ROOT=DIR", *EVERYWHERE]),
    "libyaml": (lambda f: dict(leave_out=["yaml-0.1"]), [], ["libyaml was not found", "libyaml-dev", *EVERYWHERE]),
    "MPI": (lambda f: {}, ["-DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON"], ["MPI was not found", "libopenmpi-dev openmpi-bin", "openmpi-devel", "brew install open-mpi", *EVERYWHERE]),
    "pkg-config": (lambda f: {}, ["-DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON"], ["pkg-config was not found", *EVERYWHERE]),
    "LAPACK": (lambda f: {}, ["-DCMAKE_DISABLE_FIND_PACKAGE_LAPACK=ON"], ["LAPACK was not found", "liblapack-dev", *EVERYWHERE]),
    "Catch2": (lambda f: {}, ["-DCMAKE_DISABLE_FIND_PACKAGE_Catch2=ON", "-DBS_TESTS=ON"], ["Catch2 was not found", "apt install catch2", "-DBS_TESTS=OFF", *EVERYWHERE]),
}
# What may be missing: a program without it is configured.
OPTIONAL = {"pybind11": (["-DCMAKE_DISABLE_FIND_PACKAGE_pybind11=ON", "-DBS_TESTS=ON"], ["the Python package is left out", "pybind11-dev", "Configuring done"])}


def configure(source, folder, pc, definitions):
    env = {**os.environ, "PKG_CONFIG_LIBDIR": str(pc), "PKG_CONFIG_PATH": ""}
    for name in ("PETSC_DIR", "PETSC_ARCH", "SLEPC_DIR", "HDF5_ROOT"):
        env.pop(name, None)
    done = subprocess.run(["cmake", "-S", source, "-B", folder / "build", "-G", "Ninja", "-DBS_TESTS=OFF", *definitions], env=env, capture_output=True, text=True, timeout=300)
    return done.returncode, " ".join((done.stdout + done.stderr).split())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--source", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2])
    parser.add_argument("--filter", default="")
    arguments = parser.parse_args()
    passed = failed = 0
    cases = {**{name: (pc, definitions, says, True) for name, (pc, definitions, says) in CASES.items()},
             **{name: (lambda f: {}, definitions, says, False) for name, (definitions, says) in OPTIONAL.items()}}
    for name, (pc, definitions, says, ends) in cases.items():
        if arguments.filter not in name:
            continue
        folder = pathlib.Path(tempfile.mkdtemp())
        code, text = configure(arguments.source, folder, pc_files(folder / "pc", **pc(folder)), definitions)
        lacks = [word for word in says if " ".join(word.split()) not in text]
        good = (code != 0) == ends and not lacks
        passed, failed = passed + good, failed + (not good)
        print(f"  {'ok' if good else 'FAILED':6} {name}" + ("" if good else f": exit code {code}, lacks {lacks}: {text[-600:]}"), flush=True)
        shutil.rmtree(folder)
    print(f"{passed} passed, {failed} failed, 0 skipped")
    return failed > 0 or passed == 0


if __name__ == "__main__":
    sys.exit(main())
