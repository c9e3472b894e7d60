#!/usr/bin/env python3
"""Installed into a folder of its own, or unpacked from the .deb, the program works from anywhere and finds its files."""
import gzip
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
from program import environment
import numpy as np

SHORT = ["-ts_max_time", "0.05", "-bs_progress_interval", "-1"]


def call(command, folder, timeout=300):
    done = subprocess.run([str(c) for c in command], cwd=folder, env=environment(3), capture_output=True, text=True, timeout=timeout)
    return done.returncode, done.stdout, done.stderr


def shipped():
    """What a user needs of options/, meshes/, postprocess/ and the notebooks, from the source tree itself."""
    kept = [f.relative_to(REPO / "src/python") for f in (REPO / "src/python/notebooks").glob("*.ipynb")]
    for folder, endings in (("options", (".yaml", ".md", ".png")), ("meshes", (".xsp", ".cir", ".py", ".md")), ("postprocess", (".py", ".md"))):
        kept += [f.relative_to(REPO) for f in (REPO / folder).rglob("*") if f.suffix in endings and f.name != "make_reference.py" and "gallery" not in f.parts]
    return {str(f) for f in kept}


def layout(checks, prefix, name):
    share = prefix / "share/backspring"
    found = {str(f.relative_to(share)) for f in share.rglob("*") if f.is_file()}
    checks.true(f"{name}: share/backspring holds the source's files and no others", found == shipped(), f"{sorted(found ^ shipped())[:5]}")
    for file in ("bin/backspring", "share/man/man1/backspring.1.gz", "share/doc/backspring/copyright", "share/doc/backspring/README.md"):
        checks.true(f"{name}: {file}", (prefix / file).is_file())
    for file in sorted((prefix / "bin").iterdir()):
        checks.true(f"{name}: {file.name} can be run", file.resolve().is_file() and file.resolve().stat().st_mode & 0o111 == 0o111
                    and prefix in file.resolve().parents)
    man = gzip.open(prefix / "share/man/man1/backspring.1.gz", "rt").read()
    checks.true(f"{name}: the man page has the options", man.startswith(".TH BACKSPRING 1") and "\\-bs_lattice_file" in man)


def works_anywhere(checks, program, folder, name):
    """`folder` is empty and far from the program's files."""
    for file, ranks in (("free_fall.yaml", 1), ("springies_net.yaml", 2), ("cloth", 1), ("options/problems/pendulum.yaml", 1)):
        command = (["mpirun", "-n", ranks] if ranks > 1 else []) + [program, "-options_file", file, *SHORT, "-bs_output", "run.h5md", "-bs_overwrite"]
        code, out, err = call(command, folder)
        checks.true(f"{name}: -options_file {file} on {ranks} rank(s)", code == 0, (out + err).strip().splitlines()[-1])
    code, out, err = call([program, "-options_file", "cubic_lattice", "-options_file", "second_order.yaml", *SHORT, "-ts_view"], folder)
    checks.true(f"{name}: two files combine", code == 0 and "type: cn" in out, err.strip()[-200:])


def errors(checks, program, folder):
    """One line that says where it looked, once on any number of ranks, exit code 2."""
    share = str(program.parent.parent / "share/backspring")
    for ranks in (1, 3):
        for file, says in (("cloht.yaml", ["cloht.yaml: no such file", "this folder", share + "/options", "did you mean cloth.yaml?"]),
                           ("quite/another.yaml", ["no such file", "one of", "pendulum"]), ("/nowhere/x.yaml", ["/nowhere/x.yaml: no such file"])):
            command = (["mpirun", "-n", ranks] if ranks > 1 else []) + [program, "-options_file", file, "-ts_dt", "0.1"]
            code, out, err = call(command, folder)
            lines = [line for line in err.splitlines() if "backspring:" in line]
            checks.true(f"missing {file} on {ranks} rank(s)", code == 2 and len(lines) == 1 and all(s in lines[0] for s in says)
                        and "PETSC ERROR" not in err, f"{code}: {err.strip()[:160]}")
    code, _, err = call([program, "-bs_lattice_file", "nowhere.h5"], folder)
    checks.true("missing lattice", code == 2 and "nowhere.h5: no such file" in err and share in err, err.strip())


def order_of_search(checks, program, folder):
    """The present folder first; what an option file names, beside that file, too."""
    folder = pathlib.Path(folder)
    (folder / "pendulum.yaml").write_text("bs:\n  lattice:\n    file: own.xsp\nts:\n  dt: 0.01\n  max_time: 0.02\n")
    code, _, err = call([program, "-options_file", "pendulum.yaml"], folder)
    checks.true("a file of the present folder comes first", code == 2 and "own.xsp: no such file" in err, err.strip()[-160:])
    (folder / "deep").mkdir()
    (folder / "deep/own.yaml").write_text((folder / "pendulum.yaml").read_text())
    shutil.copy(REPO / "meshes/net.xsp", folder / "deep/own.xsp")
    for file in ("deep/own.yaml", str(folder / "deep/own.yaml")):
        code, _, err = call([program, "-options_file", file], folder)
        checks.true(f"a mesh beside the option file {file}", code == 0, err.strip()[-160:])
    (folder / "plain").write_text("-ts_max_time 0.03\n-ts_dt 0.01\n")
    code, out, _ = call([program, "-bs_lattice_type", "chain", "-bs_lattice_size", "3", "-ts_dt", "0.02", "-options_file", "plain"], folder)
    checks.true("a plain file after an option overrides it", code == 0 and "steps=3" in out, out.strip()[-100:])
    code, out, _ = call([program, "-options_file", "plain", "-bs_lattice_type", "chain", "-bs_lattice_size", "3", "-ts_dt", "0.015"], folder)
    checks.true("an option after a file overrides it", code == 0 and "steps=2" in out, out.strip()[-100:])


def tools(checks, prefix, folder):
    code, _, err = call([prefix / "bin/backspring", "-options_file", "pendulum", "-ts_max_time", "0.2", "-bs_output", "p.h5md"], folder)
    checks.true("a run to draw", code == 0, err)
    code, _, err = call([prefix / "bin/backspring-plot", "p.h5md", "-o", "p.png"], folder)
    checks.true("backspring-plot", code == 0 and (pathlib.Path(folder) / "p.png").stat().st_size > 5000, err.strip()[-200:])
    for tool in sorted((prefix / "bin").glob("backspring-*")):
        code, out, err = call([tool, "--help"], folder)
        checks.true(f"{tool.name} --help", code == 0 and "usage" in out.lower(), err.strip()[-200:])


def library(checks, prefix, folder):
    """find_package(backspring) from outside; what the library computes against numpy."""
    source = pathlib.Path(folder) / "example"
    shutil.copytree(REPO / "src/package/example", source)
    code, out, err = call(["cmake", "-S", source, "-B", source / "build", f"-DCMAKE_PREFIX_PATH={prefix}"], folder)
    checks.true("find_package(backspring)", code == 0, err.strip()[-300:])
    code, out, err = call(["cmake", "--build", source / "build"], folder)
    checks.true("a program on backspring::core builds", code == 0, (out + err).strip()[-300:] if code else "")
    headers = {str(f.relative_to(REPO / "src")) for f in (REPO / "src").rglob("*.hpp") if not {"cli", "python", "package"} & set(f.parts)}
    there = {str(f.relative_to(prefix / "include/backspring")) for f in (prefix / "include/backspring").rglob("*") if f.is_file()}
    checks.true("every header but those of the command line and of Python is installed", headers == there, f"{sorted(headers ^ there)[:5]}")
    code, out, err = call([source / "build/two_masses"], folder)
    lines = [line.split() for line in out.splitlines()]
    checks.true("it runs without files or options", code == 0 and len(lines) == 11 and not err, (out + err)[:200])
    steps = np.array(lines[:10], dtype=float)
    # each mass is on a spring of stiffness 2k to its place: (1 + h^2 w^2) v' = v - h w^2 u, u' = u + h v'
    h, w2, u, v, expected = 0.01, 2 * 50 / 2, 0.1, 0.0, []
    for n in range(10):
        v = (v - h * w2 * u) / (1 + h * h * w2)
        u += h * v
        expected.append([(n + 1) * h, -u, 1 + u])
    checks.near("its positions are backward Euler's recurrence", float(np.abs(steps - expected).max()), 0.0, 1e-12)
    checks.near("its frequency", float(lines[10][1]), w2, 1e-10 * w2)
    code, out, err = call([source / "build/water"], folder)
    checks.true("a law from outside the library runs", code == 0 and len(out.splitlines()) == 2 and not err, (out + err)[:200])
    if code == 0:
        water(checks, *(np.array(line.split(), dtype=float) for line in out.splitlines()))


def water(checks, x, omega2):
    """Morse bonds and an angle spring by the complex step: forces at the equilibrium, and the eigenvalues of their Hessian."""
    mass = np.repeat([1.008, 1.008], 3)
    pull = np.tile([30.0, -20, 5], 2)

    def energy(h):
        a, b = h[:3], h[3:]
        la, lb = np.sqrt(a @ a), np.sqrt(b @ b)
        theta = np.arccos(a @ b / (la * lb))
        return sum(432.6 * (1 - np.exp(-2.2855 * (l - 0.9419))) ** 2 for l in (la, lb)) + 383 / 2 * (theta - 1.8242) ** 2 - pull @ h

    unit, h = np.eye(6), x[3:]
    gradient = lambda y: np.array([energy(y + 1e-30j * e).imag / 1e-30 for e in unit])
    checks.near("its forces balance", float(np.abs(gradient(h)).max()), 0.0, 1e-7)
    H = np.array([(gradient(h + 1e-5 * e) - gradient(h - 1e-5 * e)) / 2e-5 for e in unit])
    expected = np.linalg.eigvalsh(H / np.sqrt(mass[:, None] * mass))
    checks.near("it turns about the force without resistance", float(expected[0]), 0.0, 1e-5 * expected[-1])
    checks.near("its vibrations", float(np.abs(omega2 - expected[1:]).max()) if len(omega2) == 5 else np.inf, 0.0, 1e-5 * expected[-1])


def in_python(checks, prefix, folder, name):
    """The Python package computes, and finds the tools beside it."""
    site = prefix / "lib/python3/dist-packages"
    code = ("import sys; sys.path.insert(0, sys.argv[1]); import backspring as bs; "
            "eq = bs.statics(bs.Lattice([[0.0], [1.0]], [[0, 1]], stiffness=50.0, fixed=[0]), bs_gravity=10.0); "
            "from backspring.trajectories import tools; print(bs.__file__, abs(eq.x[1, 0] - 1.2) < 1e-12, tools())")
    typed = [one for one in ("py.typed", "_core.pyi", "motion.py") if not (site / "backspring" / one).is_file()]
    checks.true(f"{name}: the package comes with its types", not typed, f"{typed}")
    status, out, err = call([sys.executable, "-c", code, site], folder)
    checks.true(f"{name}: import backspring", status == 0 and out.split() == [str(site / "backspring/__init__.py"), "True",
                                                                              str(prefix / "share/backspring/postprocess")], (out + err).strip()[-300:])


def package(checks, build, folder):
    missing = [tool for tool in ("dpkg-shlibdeps", "dpkg-deb", "file") if not shutil.which(tool)]
    if missing:
        checks.skip("package", f"no {', '.join(missing)}: apt install dpkg-dev file")
        return
    code, out, err = call(["cpack", "-G", "DEB", "--config", build / "CPackConfig.cmake", "-B", pathlib.Path(folder)], build)
    debs = {re.match(r"[a-z0-9-]*?(?=_)", f.name)[0]: f for f in pathlib.Path(folder).rglob("*.deb")}
    checks.true("cpack makes three packages", code == 0 and set(debs) == {"backspring", "backspring-dev", "python3-backspring"}, f"{sorted(debs)} {err.strip()[-200:]}")
    fields = {name: call(["dpkg-deb", "-f", deb], folder)[1] for name, deb in debs.items()}
    for needed in ("libpetsc-real3", "libopenmpi3", "libhdf5-openmpi", "openmpi-bin", "libc6"):
        checks.true(f"the package depends on {needed}", needed in fields["backspring"].split("Depends:")[1].split("\n")[0])
    for needed in ("libpetsc-real3", "python3-numpy", "python3-mpi4py"):
        checks.true(f"the Python package depends on {needed}", needed in fields["python3-backspring"].split("Depends:")[1].split("\n")[0])
    checks.true("the -dev package depends on petsc-dev", "petsc-dev" in fields["backspring-dev"])
    root = pathlib.Path(folder) / "root"
    for deb in debs.values():
        call(["dpkg-deb", "-x", deb, root], folder)
    layout(checks, root / "usr", ".deb")
    checks.true(".deb: the library", bool(list((root / "usr").rglob("libbackspring_core.a"))))
    owners = call(["dpkg-deb", "-c", debs["backspring"]], folder)[1]
    checks.true(".deb: root owns all, only usr/", all("root/root" in line and "./usr/" in line for line in owners.splitlines()))
    empty = pathlib.Path(folder) / "empty"
    empty.mkdir()
    works_anywhere(checks, root / "usr/bin/backspring", empty, ".deb")
    in_python(checks, root / "usr", empty, ".deb")


def main():
    checks = Checks(__doc__)
    build = pathlib.Path(checks.program).parent
    with tempfile.TemporaryDirectory(prefix="backspring_") as scratch:
        scratch, folder = pathlib.Path(scratch).resolve(), None
        prefix = scratch / "prefix"
        code, out, err = call(["cmake", "--install", build, "--prefix", prefix], scratch)
        checks.true("cmake --install", code == 0, err.strip()[-200:])
        program = prefix / "bin/backspring"
        for name, group in (("layout", lambda f: layout(checks, prefix, "installed")), ("anywhere", lambda f: works_anywhere(checks, program, f, "installed")),
                            ("built", lambda f: works_anywhere(checks, checks.program, f, "built")), ("errors", lambda f: errors(checks, program, f)),
                            ("order", lambda f: order_of_search(checks, program, f)), ("tools", lambda f: tools(checks, prefix, f)),
                            ("library", lambda f: library(checks, prefix, f)), ("python", lambda f: in_python(checks, prefix, f, "installed")),
                            ("package", lambda f: package(checks, build, f))):
            folder = scratch / name
            folder.mkdir()
            if checks.wants(name):
                with checks.group(name):
                    group(folder)
    checks.finish()


if __name__ == "__main__":
    main()
