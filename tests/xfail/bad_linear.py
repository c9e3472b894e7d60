#!/usr/bin/env python3
"""Linear systems that cannot be: each bad input must end with exit code 2 and one line that says what to mend.

  bad_linear.py --program build/release/backspring [--ranks 2] [--filter WORD] [--jobs 2] [--verbose | --list]

What is asked for is told in corpus.py. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import struct
import sys

import corpus

GENERAL = "%%MatrixMarket matrix coordinate real general\n"
G = GENERAL + "2 2 4\n1 1 2\n1 2 -1\n2 1 -1\n2 2 2\n"
C = GENERAL + "2 2 2\n1 1 1\n2 2 1\n"
B = GENERAL + "2 1 1\n1 1 1\n"
STEP = ("-ts_dt", "0.1", "-ts_max_time", "1", "-ts_max_steps", "2", "-ts_type")


def system(*words, G=G, C=C, B=B, kind="beuler", source="step(1)", extra=None, ending="mtx"):
    """A maker of the good system with the given texts (None: no such file), options and further files."""
    def make(folder):
        line = ["-bs_model", "linear"]
        for name, content in (("G", G), ("C", C), ("B", B)):
            if content is not None:
                path = folder / f"{name}.{ending if name == 'G' else 'mtx'}"
                path.write_bytes(content if isinstance(content, bytes) else content.encode())
                line += ["-bs_linear_" + name, path]
        for name, content in (extra or {}).items():
            (folder / name).write_text(content)
        if source is not None:
            line += ["-bs_linear_source", source]
        return line + list(words) + list(STEP) + [kind]
    return make


def first_line(text):
    return system(G=text + "\n" + G.split("\n", 1)[1])


def coordinate(body, banner=GENERAL):
    return system(G=banner + body)


def table(text, *words):
    return system("-bs_linear_source_table", "t.csv", *words, source=None, extra={"t.csv": text})


def generator(*words, kind="beuler"):
    return lambda folder: ["-bs_model", "linear", *words, *STEP, kind]


def petsc(rows=2, columns=2, lengths=(2, 2), at=(0, 1, 0, 1), values=(2, -1, -1, 2), count=None, more=b""):
    """A PETSc binary matrix with 32-bit indices; by default the good G."""
    head = (1211216, rows, columns, len(at) if count is None else count)
    return system(G=struct.pack(f">{4 + len(lengths) + len(at)}i", *head, *lengths, *at) + struct.pack(f">{len(values)}d", *values) + more, ending="bin")


def petsc_x0(*values, count=None):
    def make(folder):
        (folder / "x.bin").write_bytes(struct.pack(">2i", 1211214, len(values) if count is None else count) + struct.pack(f">{len(values)}d", *values))
        return system("-bs_linear_x0", "x.bin")(folder)
    return make


MATRICES = {
    "G empty": (system(G=""), "begin the file with '%%MatrixMarket"),
    "G without banner": (first_line("2 2 4"), "no Matrix Market banner"),
    "G is a vector": (first_line("%%MatrixMarket vector coordinate real general"), "no Matrix Market banner"),
    "G complex": (first_line("%%MatrixMarket matrix coordinate complex general"), "'complex': write real, integer or pattern"),
    "G hermitian": (first_line("%%MatrixMarket matrix coordinate real hermitian"), "write general, symmetric or skew-symmetric"),
    "G elemental": (first_line("%%MatrixMarket matrix elemental real general"), "write coordinate or array"),
    "array of a pattern": (first_line("%%MatrixMarket matrix array pattern general"), "an array has no pattern"),
    "no sizes": (coordinate("% nothing\n"), "the line of sizes is missing"),
    "two sizes": (coordinate("2 2\n"), "write 'rows columns entries'"),
    "sizes are words": (coordinate("two two four\n"), "write 'rows columns entries'"),
    "negative size": (coordinate("-2 2 1\n1 1 1\n"), "sizes must be positive"),
    "size beyond 64 bits": (coordinate("99999999999999999999 2 1\n1 1 1\n"), "write 'rows columns entries'"),
    "size beyond the indices": (coordinate("4000000000 4000000000 1\n1 1 1\n"), "64-bit indices"),
    "row 0": (coordinate("2 2 1\n0 1 1\n"), "line 3: entry (0, 1) lies outside 2 x 2"),
    "column 3": (coordinate("2 2 1\n1 3 1\n"), "rows and columns count from 1"),
    "entry without value": (coordinate("2 2 1\n1 1\n"), "write 'row column value'"),
    "entry with two values": (coordinate("2 2 1\n1 1 1 0\n"), "write 'row column value'"),
    "value is a word": (coordinate("2 2 1\n1 1 one\n"), "write 'row column value'"),
    "value nan": (coordinate("2 2 1\n1 1 nan\n"), "not finite"),
    "too few entries": (coordinate("2 2 3\n1 1 1\n2 2 1\n"), "after 2 of 3 entries"),
    "too many entries": (coordinate("2 2 1\n1 1 1\n2 2 1\n"), "more entries than the 1"),
    "too few of an array": (coordinate("2 2\n1\n2\n3\n", "%%MatrixMarket matrix array real general\n"), "ends after 3 values"),
    "too many of an array": (coordinate("2 2\n1\n2\n3\n4\n5\n", "%%MatrixMarket matrix array real general\n"), "more entries than the 4"),
    "upper triangle": (coordinate("2 2 1\n1 2 1\n", GENERAL.replace("general", "symmetric")), "write the lower triangle only"),
    "skew diagonal": (coordinate("2 2 1\n1 1 1\n", GENERAL.replace("general", "skew-symmetric")), "has no diagonal"),
    "symmetric, not square": (coordinate("3 2 1\n1 1 1\n", GENERAL.replace("general", "symmetric")), "cannot be symmetric"),
    "line without end": (coordinate("2 2 1\n1 1 " + "0" * 70000 + "\n"), "longer than"),
    "zero bytes": (system(G=b"\0" * 4096), "no Matrix Market banner"),
    "PETSc binary, wrong class": (system(G=struct.pack(">4i", 1211214, 2, 0, 0), ending="bin"), "neither Matrix Market text nor a PETSc binary matrix"),
    "PETSc binary, empty": (system(G=b"", ending="petsc"), "neither Matrix Market text nor a PETSc binary matrix"),
    "PETSc binary, column -1": (petsc(at=(0, -1, 0, 1)), "G.bin: row 1: column -1 (from 0) lies outside 2 x 2"),
    "PETSc binary, column 2": (petsc(at=(0, 1, 0, 2)), "G.bin: row 2: column 2 (from 0) lies outside 2 x 2"),
    "PETSc binary, column twice": (petsc(at=(0, 0, 0, 1)), "G.bin: row 1: column 0 (from 0) stands there twice"),
    "PETSc binary, value nan": (petsc(values=(2, -1, float("nan"), 2)), "G.bin: row 2: the value in column 0 (from 0) is not finite"),
    "PETSc binary, lengths do not add up": (petsc(lengths=(2, 1)), "G.bin: the lengths of its rows do not add up to its 4 entries"),
    "PETSc binary, negative length": (petsc(lengths=(5, -1)), "G.bin: row 1 has 5 entries in 2 columns"),
    "PETSc binary, absurd count": (petsc(count=2**31 - 1), "its head asks for"),
    "PETSc binary, absurd rows": (petsc(rows=2**31 - 1), "its head asks for"),
    "PETSc binary, negative size": (petsc(rows=-2), "they must be positive"),
    "PETSc binary, dense": (petsc(count=-1), "G.bin: holds a dense matrix: save a sparse one"),
    "PETSc binary, cut off": (petsc(values=(2, -1, -1)), "G.bin: has 64 bytes, its head asks for 72"),
    "PETSc binary of 64-bit indices, cut off": (system(G=struct.pack(">5q", 1211216, 1, 1, 1, 1), ending="bin"), "G.bin: has 40 bytes, its head asks for 56"),
    "PETSc binary, more behind it": (petsc(more=b"1234"), "G.bin: has 76 bytes, its head asks for 72"),
    "PETSc binary, not square": (petsc(columns=3), "G is 2 x 3: it must be square"),
    "no such file": (system("-bs_linear_G", "nowhere.mtx"), "nowhere.mtx: no such file"),
    "a folder": (system("-bs_linear_C", "."), "is a folder"),
    "fault after many entries": (coordinate("70000 70000 70001\n" + "".join(f"{k} {k} 1\n" for k in range(1, 70001)) + "1 0 1\n"), "line 70003"),
}

SYSTEMS = {
    "nothing given": (generator(), "-bs_linear_G is missing"),
    "no C": (system(C=None), "-bs_linear_C is missing"),
    "generator and files": (system("-bs_linear_type", "rlc"), "takes no -bs_linear_G"),
    "G not square": (coordinate("2 3 1\n1 1 1\n"), "G is 2 x 3: it must be square"),
    "C of another size": (system(C=GENERAL + "3 3 1\n1 1 1\n"), "C is 3 x 3, G is 2 x 2"),
    "B of another size": (system(B=GENERAL + "3 1 1\n1 1 1\n"), "B must have as many rows"),
    "source without B": (system(B=None), "no matrix B says where it acts"),
    "B without source": (system(source=None), "no source is given"),
    "two sources, one column": (system(source="step(1);step(2)"), "2 sources for the 1 column of B"),
    "euler, singular C": (system(C=GENERAL + "2 2 1\n1 1 1\n", kind="euler"), "C is singular"),
    "rk, singular C without empty rows": (system(C=GENERAL + "2 2 4\n1 1 1\n1 2 -1\n2 1 -1\n2 2 1\n", kind="rk"), "C is singular"),
    "arkimex, C not diagonal": (system(C=GENERAL + "2 2 3\n1 1 2\n1 2 1\n2 2 2\n", kind="arkimex"), "needs a diagonal C"),
    "empty row in both": (system(G=GENERAL + "2 2 1\n1 1 1\n", C=GENERAL + "2 2 1\n1 1 1\n"), "row 2 of both G and C is empty"),
    "singular pencil": (system(G=GENERAL + "2 2 4\n1 1 1\n1 2 -1\n2 1 -1\n2 2 1\n", C=GENERAL + "2 2 4\n1 1 3\n1 2 -3\n2 1 -3\n2 2 3\n"),
                        "the pencil (G, C) determines no solution"),
    "singular pencil, uneven entries": (system(G=GENERAL + "2 2 4\n1 1 0.1\n1 2 -0.1\n2 1 -0.3\n2 2 0.3\n",
                                               C=GENERAL + "2 2 4\n1 1 0.7\n1 2 -0.7\n2 1 -0.1\n2 2 0.1\n", kind="cn"),
                                        "the pencil (G, C) determines no solution"),
    "symplectic": (system(kind="symplectic"), "symplectic"),
    "be_steps with bdf": (system("-bs_linear_be_steps", "1", kind="bdf"), "needs -ts_type cn, theta or beuler"),
    "be_steps negative": (system("-bs_linear_be_steps", "-1"), "-bs_linear_be_steps"),
    "dc and x0": (system("-bs_linear_dc", "-bs_linear_x0", "x.csv", extra={"x.csv": "1\n2\n"}), "give one of them"),
    "dc, singular G": (system("-bs_linear_dc", G=GENERAL + "2 2 4\n1 1 1\n1 2 -1\n2 1 -1\n2 2 1\n"), "there is no operating point"),
    "x0 too short": (system("-bs_linear_x0", "x.csv", extra={"x.csv": "1\n"}), "1 number for 2 states"),
    "x0 with a word": (system("-bs_linear_x0", "x.csv", extra={"x.csv": "1\ntwo\n"}), "line 2: 'two'"),
    "x0 Matrix Market, two columns": (system("-bs_linear_x0", "x.mtx", extra={"x.mtx": C}), "a vector has one"),
    "x0 PETSc binary, value nan": (petsc_x0(1, float("nan")), "x.bin: value 2 is not finite"),
    "x0 PETSc binary, value inf": (petsc_x0(float("inf"), 1), "x.bin: value 1 is not finite"),
    "x0 PETSc binary, too short": (petsc_x0(1), "x.bin has 1 entry for 2 states"),
    "x0 PETSc binary, cut off": (petsc_x0(1, count=2), "x.bin: has 16 bytes, its head asks for 24"),
    "x0 PETSc binary, absurd length": (petsc_x0(1, 2, count=2**31 - 1), "its head asks for"),
    "x0 PETSc binary, negative length": (petsc_x0(1, 2, count=-2), "x.bin: has 24 bytes"),
    "labels too few": (system("-bs_linear_labels", "l.txt", extra={"l.txt": "a\n"}), "has 1 line for 2 states"),
    "size missing": (generator("-bs_linear_type", "rc_ladder"), "-bs_linear_size"),
    "size of rlc": (generator("-bs_linear_type", "rlc", "-bs_linear_size", "5"), "leave the size out"),
    "size 0": (generator("-bs_linear_type", "heat2d", "-bs_linear_size", "0,3"), "needs positive numbers"),
    "grid beyond the indices": (generator("-bs_linear_type", "heat2d", "-bs_linear_size", "100000,100000"), "too large"),
    "negative resistance": (generator("-bs_linear_type", "rlc", "-bs_linear_resistance", "-1"), "-bs_linear_resistance"),
    "vary 1": (generator("-bs_linear_type", "rc_ladder", "-bs_linear_size", "3", "-bs_linear_vary", "1"), "give a number below 1"),
    "unknown type": (generator("-bs_linear_type", "wave"), "-bs_linear_type"),
    "unknown model": (lambda folder: ["-bs_model", "linaer"], "-bs_model"),
    "misspelt option": (system("-bs_linear_dcc"), "-bs_linear_dc"),
}

SOURCES = {
    "no brackets": (system(source="step"), "like pulse(amp=5"),
    "unknown waveform": (system(source="puls(1,0,0,1)"), "did you mean pulse?"),
    "unknown parameter": (system(source="sine(amp=1,frequency=5)"), "no parameter 'frequency'"),
    "missing parameter": (system(source="sine(1)"), "freq is missing"),
    "parameter twice": (system(source="step(1,amp=2)"), "amp is given twice"),
    "too many parameters": (system(source="step(1,2,3,4)"), "too many parameters"),
    "position after name": (system(source="step(amp=1,2)"), "after a named one"),
    "not a number": (system(source="step(1V)"), "amp = '1V' is not a number"),
    "negative rise": (system(source="pulse(1,0,-1,1)"), "rise = -1"),
    "period too short": (system(source="pulse(amp=1,width=2,period=1)"), "period is shorter"),
    "exp tau 0": (system(source="exp(0,1,0,0)"), "must be positive"),
    "pwl odd": (system(source="pwl(0,1,2)"), "do not form pairs"),
    "pwl backwards": (system(source="pwl(1,0,0,1)"), "is not after"),
    "nothing after ;": (system(source="step(1);"), "write a number, or one of"),
    "table ends early": (table("t,u\n0,1\n0.5,1\n"), "the table reaches from t = 0 to 0.5 s"),
    "table begins late": (table("0.1,1\n5,1\n"), "the table reaches from t = 0.1"),
    "table with a column too many": (table("0,1,2\n5,1,2\n"), "2 sources for the 1 column of B"),
    "table backwards": (table("0,1\n0,2\n"), "t.csv line 2"),
    "table and waveform": (table("0,1\n5,1\n", "-bs_linear_source", "step(1)"), "give one of them"),
    "no such table": (system("-bs_linear_source_table", "nowhere.csv", source=None), "nowhere.csv: no such file"),
}


def netlist(cards, *words, title="t\n", kind="beuler"):
    def make(folder):
        (folder / "n.cir").write_text(title + cards)
        return ["-bs_netlist", folder / "n.cir", *words, *STEP, kind]
    return make


RC = "V1 in 0 1\nR1 in out 1k\nC1 out 0 1u\n"
NETLISTS = {
    "no such netlist": (netlist("", "-bs_netlist", "nowhere.cir"), "nowhere.cir: no such file"),
    "empty": (netlist("", title=""), "n.cir: no cards: after the first line, the title"),
    "a title alone": (netlist("* nothing\n.end\nR1 a 0 1\n"), "n.cir: no cards"),
    "a transistor": (netlist(RC + "Q1 out b 0 npn\n"), "n.cir line 5: 'Q1 out b 0 npn' is not among what is read: cards are Rname N1 N2 ohm"),
    "another analysis": (netlist(RC + "\n.ac dec 10 1 1k\n"), "n.cir line 6: '.ac dec 10 1 1k' is not among what is read"),
    "a value is missing": (netlist(RC + "R2 out 0\n"), "n.cir line 5: 'R2 out 0' lacks nodes or a value"),
    "source without value": (netlist("V1 a 0 DC\nR1 a 0 1\n"), "line 2: V1: a value is missing: write DC 5"),
    "a word for a number": (netlist(RC + "R2 out 0 big\n"), "line 5: R2: 'big' is not a number"),
    "resistance 0": (netlist(RC + "R2 out 0 0\n"), "line 5: R2: 0: a resistance must not be 0"),
    "capacitance negative": (netlist(RC + "C2 out 0 -1u\n"), "line 5: C2: -1u: give a number > 0"),
    "one name twice": (netlist(RC + "r1 out 0 5\n"), "line 5: r1 is there already, in line 3"),
    "initial condition of a resistor": (netlist(RC + "R2 out 0 1 IC=5\n"), "line 5: R2: 'IC=5' after the value is not read"),
    "initial condition without a number": (netlist(RC + "C2 out 0 1u IC=big\n"), "line 5: C2: IC: 'big' is not a number"),
    "two initial conditions": (netlist(RC + "C2 out 0 1u IC=5 6\n"), "line 5: C2: write IC=volt behind the value, and nothing else"),
    "initial conditions that contradict": (netlist(RC + "C2 in 0 1u IC=7\n"), "C2 closes a loop of capacitors and voltage sources, which do not leave it its 7 V: give capacitors of the loop an IC that fits"),
    "capacitor that is charged at once": (netlist(RC + "C2 out x 1u IC=5\nC3 x 0 1u\nR9 x 0 1k\n"), "C3 closes a loop of capacitors and voltage sources, which charge it at once: give"),
    "inductors alone at the start": (netlist(RC + "L1 out x 1m IC=1\nL2 x 0 1m IC=1\n"), "the node x floats at the start from IC, where inductors keep their currents"),
    "voltage of a node that is none": (netlist(RC + ".ic V(nowhere)=1\n"), "n.cir: .ic V(nowhere): no card names this node"),
    "voltage of a node without capacitors": (netlist(RC + ".ic V(in)=1\n"), ".ic V(in): no capacitor at this node keeps a voltage: leave it out"),
    "voltage of a node in other words": (netlist(RC + ".ic out=1 x\n"), "'.ic out=1 x': write .ic V(NODE)=VOLT"),
    "voltage of a node that is a current": (netlist(RC + ".ic I(L1)=1\n"), "'.ic I(L1)=1': write .ic V(NODE)=VOLT"),
    "voltage of a node that is no number": (netlist(RC + ".ic V(out)=high\n"), "line 5: .ic V(out): 'high' is not a number"),
    "a word after the value": (netlist(RC + "R2 out 0 5 tc=1\n"), "line 5: R2: 'tc=1' after the value is not read"),
    "unknown source": (netlist("V1 a 0 SFFM(0 1)\nR1 a 0 1\n"), "line 2: V1: 'SFFM' is no source"),
    "AC": (netlist("V1 a 0 AC 1\nR1 a 0 1\n"), "line 2: V1: AC is of small-signal analyses"),
    "SIN without a frequency": (netlist("V1 a 0 SIN(0 1)\nR1 a 0 1\n"), "FREQ is missing"),
    "continuation of nothing": (netlist("+ 5\n" + RC), "n.cir line 2: '+' goes on with a card, and there is none before"),
    "floating nodes": (netlist(RC + "R2 a b 5\nI1 0 a 1m\n"), "n.cir: the nodes a, b float: no resistor"),
    "loop of voltage sources": (netlist(RC + "V2 in mid 1\nV3 mid 0 2\n"), "n.cir: V3 closes a loop of voltage sources between the nodes mid and 0"),
    "source onto itself": (netlist(RC + "V2 out out 1\n"), "V2 closes a loop of voltage sources between the nodes out and out"),
    "no operating point": (netlist("I1 0 a 1m\nC1 a 0 1u\n"), "there is no operating point: give -bs_linear_x0 or -bs_linear_dc false"),
    "matrices, too": (netlist(RC, "-bs_linear_type", "rlc"), "a netlist takes no -bs_linear_type"),
    "rk": (netlist(RC, kind="rk"), "C is singular"),
}

GOOD = {
    "good: files": system(),
    "good: netlist": netlist(RC + ".TRAN 1u 1m\n.END\n"),
    "good: no sources": system(B=None, source=None),
    "good: singular C": system(C=GENERAL + "2 2 1\n1 1 1\n"),
    "good: euler": system(kind="euler"),
    "good: euler, C not diagonal": system(C=GENERAL + "2 2 4\n1 1 2\n1 2 1\n2 1 1\n2 2 2\n", kind="euler"),
    "good: arkimex": system(kind="arkimex"),
    "good: rosw": system(kind="rosw"),
    "good: bdf": system(kind="bdf"),
    "good: newtonls": system("-snes_type", "newtonls"),
    "good: table": table("0,1\n1,1\n"),
    "good: blanks and comments": coordinate("% hello\n\n  2   2  1 \r\n\t1 1 +1.5e0  \r\n% end\n\n"),
    "good: pattern": coordinate("2 2 2\n1 1\n2 2\n", GENERAL.replace("real", "pattern")),
    "good: PETSc binary": petsc(),
    "good: PETSc binary x0": petsc_x0(1, 2),
    "good: upper case": coordinate("2 2 1\n1 1 1\n", "%%MatrixMarket MATRIX Coordinate Real General\n"),
    "good: CG and algebraic multigrid": generator("-bs_linear_type", "heat2d", "-bs_linear_size", "20,20", "-ksp_type", "cg", "-pc_type", "gamg"),
}

GROUPS = {"matrices": MATRICES, "linear systems": SYSTEMS, "sources": SOURCES, "netlists": NETLISTS}

if __name__ == "__main__":
    sys.exit(corpus.main(__doc__, GROUPS, GOOD))
