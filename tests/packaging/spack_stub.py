"""The Spack package without Spack: a module that records what the recipe declares, and a spec that answers its questions."""
import contextlib
import importlib.util
import pathlib
import re
import sys
import types

import project

NOTED = ("version", "variant", "depends_on", "license", "extends", "generator")


class Spec:
    """A concrete package: prefixes of what it depends on, variants that are on."""

    def __init__(self, on):
        self.on = set(on)
        self.prefix = "/spack/backspring"
        self.command = types.SimpleNamespace(path="/spack/python/bin/python3")

    def __getitem__(self, name):
        return types.SimpleNamespace(prefix=f"/spack/{name}", command=self.command)

    def satisfies(self, text):
        return text in self.on


def load(path):
    """(class, [(directive, arguments, keywords)]) of the package file."""
    noted = []
    module = types.ModuleType("spack.package")
    for name in NOTED:
        setattr(module, name, lambda *arguments, _name=name, **keywords: noted.append((_name, arguments, keywords)))

    class CMakePackage:
        def define(self, name, value):
            return f"-D{name}={ {True: 'ON', False: 'OFF'}.get(value, value) }"

        def define_from_variant(self, name, variant):
            return self.define(name, self.spec.satisfies("+" + variant))
    module.CMakePackage, module.python_platlib = CMakePackage, "/spack/backspring/lib/python3.11/site-packages"
    with swapped({"spack": types.ModuleType("spack"), "spack.package": module}):
        spec = importlib.util.spec_from_file_location("recipe", path)
        recipe = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(recipe)
    return recipe.Backspring, noted


@contextlib.contextmanager
def swapped(modules):
    before = {name: sys.modules.get(name) for name in modules}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name, module in before.items():
            sys.modules.pop(name) if module is None else sys.modules.update({name: module})


def check(checks, package):
    path = package / "spack/packages/backspring/package.py"
    recipe, noted = load(path)
    variants = {arguments[0]: keywords for name, arguments, keywords in noted if name == "variant"}
    checks.true("spack: variants", set(variants) == {"native", "python", "tools"} and all("description" in k for k in variants.values()), f"{sorted(variants)}")
    conditions = {word for _, _, keywords in noted for word in re.findall(r"\+(\w+)", keywords.get("when", ""))}
    checks.true("spack: conditions name its variants", conditions <= set(variants), f"{conditions}")
    needs = [arguments[0] for name, arguments, _ in noted if name == "depends_on"]
    names = {re.split(r"[@+~]", need)[0] for need in needs}
    checks.true("spack: what CMake looks for", {"mpi", "petsc", "slepc", "hdf5", "libyaml", "lapack", "cmake", "pkgconfig", "cxx"} <= names, f"{sorted(names)}")
    oldest, newest = re.search(r"PETSc (3\.\d+) to (3\.\d+)", (project.REPO / "README.md").read_text()).groups()
    checks.true(f"spack: PETSc {oldest} to {newest}", any(f"petsc@{oldest}:{newest}+mpi" in need for need in needs), f"{needs}")
    pairs = [(arguments[0][len("slepc@"):], keywords["when"]) for name, arguments, keywords in noted if name == "depends_on" and arguments[0].startswith("slepc@")]
    first, last = (int(v.split(".")[1]) for v in (oldest, newest))
    checks.true("spack: each with its SLEPc", pairs == [(f"3.{n}", f"^petsc@3.{n}") for n in range(first, last + 1)], f"{pairs}")
    minimum = re.search(r"VERSION (\d+\.\d+)", (project.REPO / "CMakeLists.txt").read_text())[1]
    checks.true("spack: the oldest CMake", f"cmake@{minimum}:" in needs)
    checks.true("spack: the checkout is this one", pathlib.Path(recipe.git.removeprefix("file://")) == project.REPO and recipe.homepage == recipe.git)
    for on in ([], ["+native"], ["+python", "+tools"]):
        instance = recipe()
        instance.spec = Spec(on)
        given = instance.cmake_args()
        wrong = project.wrong_calls(["cmake " + " ".join(given)])
        expected = {"-DBS_TESTS=OFF", "-DPETSC_DIR=/spack/petsc", f"-DBS_NATIVE={'ON' if '+native' in on else 'OFF'}"}
        checks.true(f"spack: arguments of CMake for {' '.join(on) or 'the defaults'}", not wrong and expected <= set(given) and ("-DBS_PYTHON=/spack/python/bin/python3" in given) == ("+python" in on),
                    f"{wrong} {given}")
