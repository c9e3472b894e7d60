#!/usr/bin/env python3
"""The archives of a release and their checksums: make_release.py [--commit HEAD] [-o build/release_VERSION]

  backspring-VERSION.tar.gz            the source, as the commit has it
  backspring-VERSION-examples.tar.gz   option files, meshes, notebooks and the gallery: what runs are started from
  SHA256SUMS                           sha256sum --check SHA256SUMS

The same commit gives the same bytes, whenever and wherever the script runs with the same zlib: names, times and modes are those that git archive writes, and no time stands in
the compressed file. What the commit says of its version in several places must agree, and CHANGELOG.md must have a date for it.
"""
import argparse
import gzip
import hashlib
import pathlib
import re
import subprocess
import sys

REPO = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ("options", "meshes", "src/python/notebooks", "postprocess/gallery", "LICENSE", "CITATION.cff")
# where the version stands beside CMakeLists.txt
PLACES = {
    "CITATION.cff": r"^version: (\S+)$",
    "CHANGELOG.md": r"^## (\S+)",
    "README.md": r"\bVersion (\d+\.\d+\.\d+)",
    "options/reference/backspring.1": r'"backspring (\S+)"',
    "src/package/conda/recipe.yaml": r'^  version: "(\S+)"$',
    "src/package/example/CMakeLists.txt": r"^find_package\(backspring (\S+) REQUIRED\)$",
    "src/package/site/cite.md": r"program, version (\d\S+)\}",
    "src/python/backspring/__init__.py": r'^__version__ = "(\S+)"$',
}


def git(*words):
    return subprocess.run(["git", "-C", REPO, "-c", "tar.umask=0022", *words], check=True, capture_output=True).stdout


def faults(read, unreleased=False):
    """(version, what of the places does not agree with it); `read` gives the text of a file of the commit. `unreleased`: it need not have a date yet."""
    version = re.search(r"^project\(backspring VERSION (\S+)", read("CMakeLists.txt"), re.M)[1]
    found = []
    for path, pattern in PLACES.items():
        said = re.search(pattern, read(path), re.M)
        if not said or said[1] != (version.rpartition(".")[0] if "find_package" in pattern else version):  # programs ask for major and minor
            found.append(f"{path} says {said[1] if said else 'nothing'}, CMakeLists.txt {version}")
    dated = re.search(rf"^## {re.escape(version)} \((\d{{4}}-\d\d-\d\d)\)$", read("CHANGELOG.md"), re.M)
    released = re.search(r"^date-released: (\S+)$", read("CITATION.cff"), re.M)
    if unreleased and f"\n## {version} (unreleased)\n" in read("CHANGELOG.md"):
        return version, found
    if not dated or not released or dated[1] != released[1]:
        found.append(f"CHANGELOG.md dates {version} {dated[1] if dated else 'not at all'}, CITATION.cff {released[1] if released else 'not at all'}")
    return version, found


def pack(commit, prefix, paths, file):
    """A .tar.gz of what the commit has below the paths; its SHA-256."""
    tar = git("archive", "--format=tar", f"--prefix={prefix}/", commit, "--", *paths)
    with open(file, "wb") as raw, gzip.GzipFile(filename="", mode="wb", compresslevel=9, fileobj=raw, mtime=0) as packed:
        packed.write(tar)
    return hashlib.sha256(file.read_bytes()).hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commit", default="HEAD", help="what is released")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="folder of the archives")
    arguments = parser.parse_args()
    commit = git("rev-parse", "--verify", f"{arguments.commit}^{{commit}}").decode().strip()
    version, wrong = faults(lambda path: git("show", f"{commit}:{path}").decode())
    if wrong:
        sys.exit("\n".join(wrong))
    output = arguments.output or REPO / f"build/release_{version}"
    output.mkdir(parents=True, exist_ok=True)
    sums = ""
    for name, paths in ((f"backspring-{version}", ["."]), (f"backspring-{version}-examples", EXAMPLES)):
        file = output / f"{name}.tar.gz"
        sums += f"{pack(commit, name, paths, file)}  {file.name}\n"
        print(f"{file}  {file.stat().st_size / 1e6:.1f} MB")
    (output / "SHA256SUMS").write_text(sums)
    print(f"{output / 'SHA256SUMS'}  of commit {commit}")


if __name__ == "__main__":
    main()
