#!/usr/bin/env python3
"""Writes what the documents say of options from the program's own -help.

  options/reference/make_reference.py --program build/release/backspring           writes the three below
  options/reference/make_reference.py --program build/release/backspring --check   exit code 1 if one is out of date

options/reference/README.md (every option), backspring.1 beside it (the man page), and the table of topics in options/README.md.
"""
import argparse
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BEGIN, END = "<!-- options: written by options/reference/make_reference.py -->", "<!-- end of options -->"


def sections(program):
    """{title: [(name, default, meaning)]} of every task and both kinds of model, every option once, in the order of -help."""
    found, title = {}, None
    done = subprocess.run([program, "-help"], capture_output=True, text=True, timeout=60)
    if done.returncode:
        sys.exit(f"{program} -help ended with {done.returncode}: {done.stderr.strip()[-200:]}")
    for line in done.stdout.splitlines():
        option = re.match(r"  (-bs_\w+): <(.*?)>: (.*)", line)
        if option:
            found.setdefault(title, []).append(option.groups())
        elif line and not line.startswith((" ", "-")):
            title = line.rstrip(":")
    if sum(len(options) for options in found.values()) < 50:
        sys.exit(f"{program} -help lists only {found}")
    return found


def not_listed(found):
    """Options that the source reads and -help keeps silent about."""
    listed = {name for options in found.values() for name, _, _ in options}
    read = {name for path in (ROOT / "src").rglob("*.[ch]pp") for name in re.findall(r'\bo\.\w+\(\s*"(-bs_\w+)"', path.read_text())}
    return sorted(read - listed)


def cell(text):
    return text.replace("|", "\\|")


def reference(found):
    out = ["# Every option of backspring", "",
           "Written by `make_reference.py` from `backspring -help`; a test holds it to that.",
           "Options of PETSc itself (`-ts_*`, `-snes_*`, `-ksp_*`, `-pc_*`, `-mat_*`, `-log_view`, ...) are in the same output of `-help`",
           "and in PETSc's manual. Units stand in brackets. [The man page](backspring.1) has the same list.", ""]
    for title, options in found.items():
        out += [f"## {title}", "", "| option | default | meaning |", "|---|---|---|"]
        out += [f"| `{name}` | {f'`{cell(default)}`' if default else ''} | {cell(meaning)} |" for name, default, meaning in options] + [""]
    return "\n".join(out)


def shortened(names):
    """Three and more names that begin with the same word as one: `-bs_lattice_*`."""
    groups = {}
    for name in names:
        groups.setdefault("_".join(name.split("_")[:2]), []).append(name)
    out = []
    for stem, members in groups.items():
        out += members if len(members) < 3 else [stem + ("*" if stem in members else "_*")]
    return out


def topics_table(found):
    rows = [f"| {title} | {', '.join(f'`{n}`' for n in shortened([name for name, _, _ in options]))} |" for title, options in found.items()]
    return "\n".join([BEGIN, "", "| topic | options |", "|---|---|", *rows, "", END])


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text[:1] in (".", "'") else text


def man_page(found, version):
    out = [f'.TH BACKSPRING 1 "" "backspring {version}" "User Commands"', ".SH NAME",
           "backspring \\- implicit time stepping of mass\\-spring systems, in parallel", ".SH SYNOPSIS",
           ".B backspring", "[\\fB\\-options_file\\fR \\fIFILE\\fR]... [\\fIOPTION\\fR]...", ".br",
           ".B mpirun \\-n", "\\fIRANKS\\fR \\fBbackspring\\fR [\\fIOPTION\\fR]...", ".SH DESCRIPTION",
           "Advances lattices of particles, springs, dampers, gravity and drag, M x'' = f(t, x, x'), or linear systems",
           "G x + C x' = B u(t), by any time stepper of PETSc, and writes one HDF5 trajectory (H5MD) that h5py and ParaView open.",
           "Every option of PETSc (\\-ts_type, \\-snes_type, \\-ksp_type, \\-pc_type, \\-log_view, ...) works as PETSc's manual says.",
           ".PP", "Option files are YAML (.yaml) or plain lists of options. Several combine; the last one wins, and options after a file",
           "override it. A name that is no file in the present folder is looked for among the files that come with the program",
           "(see FILES), so", ".PP", ".RS", "backspring \\-options_file cloth.yaml \\-options_file direct \\-bs_output cloth.h5md", ".RE", ".PP",
           "works anywhere. So do the meshes that those files name."]
    for title, options in found.items():
        out += [f".SH {roff(title).upper()}"]
        for name, default, meaning in options:
            out += [".TP", f"\\fB{roff(name)}\\fR" + (f" ({roff(default)})" if default else ""), roff(meaning)]
    out += [".SH EXIT STATUS"]
    for code, meaning in (("0", "done"), ("2", "bad input or options"), ("3", "a solve failed; the last good frame is kept"),
                          ("4", "output failed"), ("130, 143", "stopped by a signal after the present step")):
        out += [".TP", f".B {code}", meaning]
    out += [".SH FILES"]
    for path, meaning in (("PREFIX/share/backspring/options/problems, solvers", "option files found by name"),
                          ("PREFIX/share/backspring/meshes", "the meshes they name, and make_lattice.py, an example of the format"),
                          ("PREFIX/share/backspring/postprocess", "plot.py, movie.py, convert.py, ...; also as backspring-plot, ..."),
                          ("RUN.h5md", "the trajectory given to -bs_output"), ("RUN.h5md.xdmf", "beside it, for ParaView")):
        out += [".TP", f".I {roff(path)}", roff(meaning)]
    out += [".SH EXAMPLES", ".nf", "backspring \\-options_file free_fall.yaml \\-bs_output fall.h5md",
            "mpirun \\-n 2 backspring \\-options_file cubic_lattice.yaml \\-bs_output block.h5md", "backspring\\-plot block.h5md \\-o block.png", ".fi"]
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the built program")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if a file is out of date")
    args = parser.parse_args()
    found = sections(args.program)
    if silent := not_listed(found):
        sys.exit(f"-help does not list {', '.join(silent)}: does their section have the title of another one? PETSc lists a title once")
    version = subprocess.run([args.program, "-bs_version"], capture_output=True, text=True).stdout.split()[1]
    front = ROOT / "options/README.md"
    text = front.read_text()
    if BEGIN not in text or END not in text:
        sys.exit(f"{front}: has no lines '{BEGIN}' and '{END}'")
    head, rest = text.split(BEGIN)
    wanted = {HERE / "README.md": reference(found), HERE / "backspring.1": man_page(found, version),
              front: head + topics_table(found) + rest.split(END)[1]}
    stale = [path for path, content in wanted.items() if not path.exists() or path.read_text() != content]
    for path in stale:
        if not args.check:
            path.write_text(content := wanted[path])
        print(f"{path.relative_to(ROOT)}: {'out of date; run make_reference.py without --check' if args.check else f'{len(content)} characters written'}")
    sys.exit(1 if args.check and stale else 0)


if __name__ == "__main__":
    main()
