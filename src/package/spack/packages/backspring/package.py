"""Builds the checkout that this recipe lies in: `spack repo add src/package/spack`, `spack install backspring`."""
import pathlib

from spack.package import *

CHECKOUT = pathlib.Path(__file__).resolve().parents[5]


class Backspring(CMakePackage):
    """Implicit time integration of mass-spring systems in parallel, built on PETSc."""

    homepage = CHECKOUT.as_uri()
    git = CHECKOUT.as_uri()
    license("BSD-2-Clause")

    version("main", branch="main")

    variant("native", default=False, description="compile for this machine's own instruction set")
    variant("python", default=False, description="the Python package, NumPy arrays in and out")
    variant("tools", default=True, description="what plots, films, converters and studies need to run")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi")
    depends_on("petsc@3.18:3.25+mpi+hdf5+mumps~complex+double")
    # a SLEPc goes with the PETSc of its release
    for release in range(18, 26):
        depends_on(f"slepc@3.{release}", when=f"^petsc@3.{release}")
    depends_on("hdf5@1.10:+mpi")
    depends_on("libyaml")
    depends_on("lapack")

    depends_on("python@3.9:", type=("build", "run"), when="+python")
    depends_on("python@3.9:", type="run", when="+tools")
    for needed in ("py-numpy", "py-mpi4py"):
        depends_on(needed, type=("build", "run"), when="+python")
    depends_on("py-pybind11", type="build", when="+python")
    for needed in ("py-h5py", "py-numpy", "py-scipy", "py-matplotlib", "py-pandas", "py-tqdm", "py-meshio", "py-pyyaml", "ffmpeg"):
        depends_on(needed, type="run", when="+tools")
    extends("python", when="+python")

    generator("ninja")

    def cmake_args(self):
        arguments = [
            self.define_from_variant("BS_NATIVE", "native"),
            self.define("BS_TESTS", False),
            self.define("PETSC_DIR", self.spec["petsc"].prefix),
            self.define("SLEPC_DIR", self.spec["slepc"].prefix),
            self.define("HDF5_ROOT", self.spec["hdf5"].prefix),
        ]
        if self.spec.satisfies("+python"):
            arguments.append(self.define("BS_PYTHON", self.spec["python"].command.path))
            arguments.append(self.define("BS_PYTHON_SITE", python_platlib))
        return arguments

    def setup_run_environment(self, env):
        env.set("OMP_NUM_THREADS", "1")
