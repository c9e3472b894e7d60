#!/usr/bin/env python3
"""A release: the version is one wherever it is said (CMake, citation, changelog, documents, recipes, Python package, program); the archives of a commit are complete, the same
bytes each time, hold against their checksums, and the source of one configures."""
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO

sys.path.insert(0, str(REPO / "src/package"))
import make_release  # noqa: E402


def versions(checks):
    version, wrong = make_release.faults(lambda path: (REPO / path).read_text(), unreleased=True)
    checks.true(f"{version} in CMakeLists.txt and {len(make_release.PLACES)} other files", not wrong, "; ".join(wrong))
    told = subprocess.run([checks.program, "-bs_version"], capture_output=True, text=True).stdout
    checks.true("the program's own", told.startswith(f"backspring {version} (PETSc "), told.strip())
    package = pathlib.Path(checks.program).parent / "python"
    if (package / "backspring").is_dir():
        done = subprocess.run([sys.executable, "-c", "import backspring; print(backspring.__version__)"], env={"PYTHONPATH": str(package), "PATH": "/usr/bin"}, capture_output=True, text=True)
        checks.true("the Python package's", done.stdout.strip() == version, done.stdout.strip() + done.stderr[-200:])
    for path in ("CITATION.cff", "README.md", "src/python/backspring/__init__.py"):
        _, found = make_release.faults(lambda name: (REPO / name).read_text().replace(version, "9.8.7") if name == path else (REPO / name).read_text(), unreleased=True)
        checks.true(f"another one in {path} is seen", len(found) == 1 and path in found[0], f"{found}")
    _, found = make_release.faults(lambda name: re.sub(rf"^(## {version}) .*$", r"\1 (unreleased)", (REPO / name).read_text(), flags=re.M))
    checks.true("a release without a date is seen", len(found) == 1 and "not at all" in found[0], f"{found}")


def dated(text):
    """CHANGELOG.md as at a release: on the day that CITATION.cff has."""
    day = re.search(r"^date-released: (\S+)$", (REPO / "CITATION.cff").read_text(), re.M)[1]
    return text.replace(" (unreleased)\n", f" ({day})\n", 1)


def commit_of_tree(folder):
    """A repository with what lies in the checkout, in one commit, as if it were released."""
    copy = folder / "copy"
    names = subprocess.run(["git", "-C", REPO, "ls-files", "-co", "--exclude-standard"], capture_output=True, text=True, check=True).stdout.splitlines()
    for name in names:
        if (REPO / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(REPO / name, copy / name)
    (copy / "CHANGELOG.md").write_text(dated((REPO / "CHANGELOG.md").read_text()))
    git = ["git", "-C", copy, "-c", "user.name=a", "-c", "user.email=a@b", "-c", "core.autocrlf=false"]
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-q", "-m", "all"]):
        subprocess.run([*git, *words], check=True, capture_output=True)
    return copy


def archives(checks):
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch).resolve()
        copy = commit_of_tree(folder)
        made = []
        for name in ("one", "two"):
            done = subprocess.run([copy / "src/package/make_release.py", "-o", folder / name], capture_output=True, text=True)
            checks.true(f"archives are made, {name}", done.returncode == 0, done.stderr[-300:])
            made.append({path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in (folder / name).iterdir()})
        checks.true("the same bytes twice", len(made[0]) == 3 and made[0] == made[1], f"{sorted(made[0])}")
        sums = lambda: subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=folder / "two", capture_output=True, text=True).returncode
        right = sums()
        for path in folder.glob("two/*-examples.tar.gz"):
            path.write_bytes(path.read_bytes()[:-1] + b"x")
        checks.true("checksums hold, and one byte more or less is seen", right == 0 and sums() != 0)
        for path in sorted((folder / "one").glob("*.tar.gz")):
            with tarfile.open(path) as archive:
                archive.extractall(folder / "out")
        source, examples = sorted((folder / "out").iterdir(), key=lambda path: path.name.endswith("-examples"))
        names = lambda top: {str(path.relative_to(top)) for path in top.rglob("*") if path.is_file() and ".git" not in path.relative_to(top).parts}
        checks.true(f"the source archive has all {len(names(copy))} files", names(source) == names(copy), f"{sorted(names(source) ^ names(copy))[:5]}")
        told = subprocess.run(["cmake", "--preset", "package"], cwd=source, capture_output=True, text=True)
        checks.true("its source configures without git", told.returncode == 0 and (source / "build/package/build.ninja").is_file(), told.stderr[-300:])
        told = subprocess.run([checks.program, "-options_file", "options/problems/springies_net.yaml", "-ts_max_time", "0.1"], cwd=examples, capture_output=True, text=True)
        checks.true("an example runs in the folder of the examples", told.returncode == 0 and "backspring: ok" in told.stdout, told.stderr[-200:])
        checks.true("with their licence, notebooks and pictures", all((examples / name).exists() for name in ("LICENSE", "src/python/notebooks", "postprocess/gallery/crack.png", "meshes/net.xsp")))


def main():
    checks = Checks(__doc__)
    if checks.wants("versions"):
        with checks.group("versions"):
            versions(checks)
    if checks.wants("archives"):
        if (REPO / ".git").exists() and shutil.which("git"):
            with checks.group("archives"):
                archives(checks)
        else:
            checks.skip("archives", "this is no clone of the repository, or git is not there")
    checks.finish()


if __name__ == "__main__":
    main()
