#!/usr/bin/env python3
"""Netlists of SPICE: two filters and every source against ngspice, closed forms and SciPy; ranks, names, units, warnings.

  netlists.py --program build/release/backspring [--filter WORD]

The trapezoidal rule leaves about h^2/12 |x'''| a unit of time, and a circuit forgets it in its decay time T: |error| <= h^2/12 max|x'''| T. Where ngspice's
points fall between steps, straight lines between these add h^2/8 max|x''|. ngspice's own rule and largest step are the same, so its error is as large.
"""
import io
import math
import pathlib
import subprocess
import sys
import tempfile

from harness import Checks
from oracles_linear import States
import h5py
import numpy as np
from program import environment, words
import scipy.integrate

LOW_PASS = """An RC low-pass
V1 in 0 PULSE(0 1 0.1m 20u 40u 0.3m)
* a comment
R1 in out 1kOhm ; 1000 ohm
C1 out
+ GND 100N      $ 1e-7 F
.end
Q1 after the end
"""
BAND_PASS = """A band-pass
V1 IN 0 SIN(0 1 5K)
L1 in mid 10mH
C1 mid out 0.1u
R1 out 0 50
"""
SOURCES = """Every source
V1 a 0 PULSE (0 2 0.1m 20u 40u 0.1m 0.4m)
V2 b 0 DC 3 SIN(0.5 1 5k 0.1m 1k)
V3 c 0 EXP(0 1 0.1m 50u 0.4m 100u)
V4 d 0 PWL(0 0, 0.2m 1, 0.3m -1)
V5 e 0 2.5
I1 0 f SIN(0 1m 5k)
R1 a 0 1
R2 b 0 1
R3 c 0 1
R4 d 0 1
R5 e 0 1
R6 f 0 1k
"""


RINGING = """A circuit that starts from what its cards say
V1 in 0 PULSE(2 1 0.2m 10u 10u 1)
R1 in a 20
L1 a b 1m IC=-50mA
C1 0 b 1u ic = -3
R2 b c 100
C2 c 0 0.5uF
L2 c d 2mH
R3 d 0 10
"""


def ngspice(netlist, vectors, step, end, folder, uic=""):
    """(times, one column for each of `vectors`) of a transient analysis with steps of at most `step`."""
    cards = netlist.split(".end")[0]
    control = (f".options reltol=1e-7 abstol=1e-15 vntol=1e-12 method=trap\n.tran {step} {end} 0 {step} {uic}\n.control\nrun\nset wr_singlescale\n"
               f"set numdgt=15\nwrdata out.txt {' '.join(vectors)}\nquit\n.endc\n.end\n")
    (folder / "check.cir").write_text(cards + control)
    subprocess.run(["ngspice", "-b", "check.cir"], cwd=folder, check=True, capture_output=True, timeout=300)
    table = np.loadtxt(folder / "out.txt")
    return table[:, 0], table[:, 1:]


def run(checks, folder, netlist, step, end, ranks=1, **more):
    (folder / "circuit.cir").write_text(netlist)
    return States(checks, {"bs_netlist": folder / "circuit.cir", "ts_type": "cn", "ts_dt": step, "ts_max_time": end, **more}, ranks=ranks)


def compare(checks, name, states, netlist, columns, folder, step, end, bound, curvature):
    """Against ngspice, where its points are; `columns`: {label: ngspice's name}."""
    times, theirs = ngspice(netlist, columns.values(), step, end, folder)
    for k, label in enumerate(columns):
        ours = np.interp(times, states.time, states.value[:, states.labels.index(label)])
        size = 1 if label.startswith("V") else np.abs(theirs[:, k]).max()
        checks.below(f"{name}, {label}: ngspice", np.abs(ours - theirs[:, k]).max() / size, 2 * bound + step ** 2 / 8 * curvature)


def low_pass(checks, folder):
    """v = sum of the responses s (t - T + T exp(-t/T)) to ramps s t that begin at the four knots."""
    tau, step, end = 1e-4, 2e-7, 1e-3
    states = run(checks, folder, LOW_PASS, step, end)
    checks.true("labels", states.labels == ["V(in)", "V(out)", "I(V1)"], str(states.labels))
    v = np.zeros_like(states.time)
    for knot, slope in ((1e-4, 5e4), (1.2e-4, -5e4), (4.2e-4, -2.5e4), (4.6e-4, 2.5e4)):
        t = np.maximum(states.time - knot, 0)
        v += slope * (t - tau + tau * np.exp(-t / tau))
    bound = step ** 2 / 12 * (5e4 / tau ** 2) * tau
    checks.below("low-pass: closed form", np.abs(states.value[:, 1] - v).max(), bound)
    checks.below("low-pass: the current through V1 is that of R1", np.abs(states.value[:, 2] + (states.value[:, 0] - states.value[:, 1]) / 1e3).max(), 1e-15)
    compare(checks, "low-pass", states, LOW_PASS, {"V(in)": "v(in)", "V(out)": "v(out)", "I(V1)": "i(v1)"}, folder, step, end, bound, 5e4 / tau)


def band_pass(checks, folder):
    """L i' = u - R i - v, C v' = i by an integrator of order 8."""
    R, L, C, w, step, end = 50.0, 1e-2, 1e-7, 2 * math.pi * 5e3, 1e-7, 1e-3
    states = run(checks, folder, BAND_PASS, step, end)
    checks.true("spelling of the first mention", states.labels == ["V(IN)", "V(mid)", "V(out)", "I(V1)", "I(L1)"], str(states.labels))
    exact = scipy.integrate.solve_ivp(lambda t, y: [(math.sin(w * t) - R * y[0] - y[1]) / L, y[0] / C], (0, end), [0, 0], "DOP853", states.time, rtol=1e-12,
                                      atol=1e-18)
    peak = R * np.abs(exact.y[0]).max()
    bound = step ** 2 / 12 * w ** 3 * peak * (2 * L / R)
    checks.below("band-pass, V(out): SciPy", np.abs(states.value[:, 2] - R * exact.y[0]).max(), bound)
    checks.below("band-pass, I(L1): SciPy", R * np.abs(states.value[:, 4] - exact.y[0]).max(), bound)
    checks.below("band-pass: currents of V1 and L1", np.abs(states.value[:, 3] + states.value[:, 4]).max(), 1e-15)
    compare(checks, "band-pass", states, BAND_PASS, {"V(out)": "v(out)", "I(L1)": "i(l1)"}, folder, step, end, bound / peak, w ** 2)
    energy = 0.5 * (L * states.value[:, 4] ** 2 + C * (states.value[:, 1] - states.value[:, 2]) ** 2)
    checks.below("energy of L and C", np.abs(states.energy - energy).max(), 1e-12 * energy.max())


def sources(checks, folder):
    step, end = 1e-7, 6e-4
    states = run(checks, folder, SOURCES, step, end)
    compare(checks, "sources", states, SOURCES, {f"V({n})": f"v({n})" for n in "abcdef"}, folder, step, end, 1e-12, (2 * math.pi * 5e3) ** 2)
    other = run(checks, folder, SOURCES, step * 10, end, ranks=3)
    checks.true("labels on 3 ranks", other.labels == states.labels)
    checks.near("values on 3 ranks", other.value, states.value[::10], 1e-11)


def operating_point(checks, folder):
    """v_b (1/R1 + 1/R2) = 10/R1 + 1 mA from the start, as SPICE; 0 there where it is not wanted."""
    netlist = "Divider\nV1 a 0 10\nR1 a b 1k\nR2 b gnd 2kOhm\nI1 0 b DC 1m\nC1 b 0 1u\n.TRAN 1u 1m\n"
    states = run(checks, folder, netlist, 1e-5, 1e-4)
    v = (10 / 1e3 + 1e-3) / (1 / 1e3 + 1 / 2e3)
    checks.near("operating point", states.value, np.tile([10, v, -(10 - v) / 1e3], (len(states.time), 1)), 1e-12)
    checks.true(".tran is warned of", "line 7: .tran is passed over: write -ts_dt 1e-06 -ts_max_time 0.001" in states.stderr, states.stderr[:100])
    states = run(checks, folder, netlist, 1e-5, 1e-4, bs_linear_dc=False, ts_type="beuler")
    checks.true("zero state", states.value[0].tolist() == [0, 0, 0] and 0 < states.value[1, 1] < v)
    states = run(checks, folder, "V1 a 0 1\n" + netlist.split("\n", 1)[1], 1e-5, 1e-4)
    checks.true("a card as the title is warned of", "line 1: 'V1 a 0 1' counts as the title" in states.stderr, states.stderr[:100])
    done = checks.run({"bs_netlist": folder / "circuit.cir", "ts_type": "cn", "ts_dt": 1e-5, "ts_max_time": 1e-4, "bs_output": "units.h5md"}, keep=("units.h5md",))
    with h5py.File(io.BytesIO(done.files["units.h5md"])) as f:
        found = [[w.decode() for w in f[name][...]] for name in ("states/units", "sources/units", "sources/labels")]
    checks.true("units, and names of sources; linear by the netlist alone", found == [["V", "V", "A"], ["V", "A"], ["V1", "I1"]], str(found))


def from_conditions(checks, folder):
    """IC of C and L, 0 where a card has none, .ic and UIC: the state at the start by hand, the motion by SciPy and by ngspice with `uic`."""
    step, end, labels = 1e-7, 1e-3, ["V(in)", "V(a)", "V(b)", "V(c)", "V(d)", "I(V1)", "I(L1)", "I(L2)"]

    def exact(y0):
        def rate(t, y):
            b, c, first, second = y
            source = np.interp(t, [2e-4, 2.1e-4], [2, 1])
            return [(first - (b - c) / 100) / 1e-6, ((b - c) / 100 - second) / 5e-7, (source - 20 * first - b) / 1e-3, (c - 10 * second) / 2e-3]
        return scipy.integrate.solve_ivp(rate, (0, end), y0, "DOP853", states.time, rtol=1e-11, atol=1e-13, max_step=5e-6).y
    said = {"on cards": (RINGING, [3, 0, -0.05, 0]), ".ic": (RINGING.replace(" ic = -3", "").replace(" IC=-50mA", "") + ".ic V(b)=3 v(C) = -1\n", [3, -1, 0, 0]),
            ".ic, and a card that says otherwise": (RINGING.replace("0.5uF", "0.5uF IC=2") + ".ic V(b)=1 V(c)=-1\n", [3, 2, -0.05, 0]),
            "UIC alone": (RINGING.replace(" ic = -3", "").replace(" IC=-50mA", "") + ".tran 1u 1m UIC\n", [0, 0, 0, 0])}
    for name, (netlist, y0) in said.items():
        states = run(checks, folder, netlist, step, end)
        checks.true(f"{name}: labels", states.labels == labels, str(states.labels))
        b, c, first, second = y0
        checks.near(f"{name}: the state at the start", states.value[0], [2, 2 - 20 * first, b, c, 10 * second, -first, first, second], 1e-14)
        y = exact(y0)
        ours = states.value[:, [labels.index(n) for n in ("V(b)", "V(c)", "I(L1)", "I(L2)")]]
        checks.near(f"{name}: SciPy", ours / [1, 1, 0.1, 0.1], (y / np.array([1, 1, 0.1, 0.1])[:, None]).T, 2e-5)
        times, theirs = ngspice("\n".join(line for line in netlist.splitlines() if not line.startswith(".tran")) + "\n", ["v(b)", "v(c)", "v(a)", "i(l1)", "i(l2)"], step, end, folder, "uic")
        later = times > 20 * step
        for k, label in enumerate(("V(b)", "V(c)", "V(a)", "I(L1)", "I(L2)")):
            mine = np.interp(times[later], states.time, states.value[:, labels.index(label)])
            checks.below(f"{name}: ngspice with uic, {label}", np.abs(mine - theirs[later, k]).max() / (1 if label.startswith("V") else 0.1), 5e-4)
        other = run(checks, folder, netlist, step * 10, end / 10, ranks=3)
        checks.near(f"{name}: on 3 ranks", other.value, run(checks, folder, netlist, step * 10, end / 10).value, 1e-11)
    states = run(checks, folder, RINGING + "C3 in 0 1n\n", 1e-6, 1e-5, ts_type="beuler")
    checks.near("a capacitor across a source has its voltage", states.value[0], [2, 3, 3, 0, 0, 0.05, -0.05, 0], 1e-14)
    states = run(checks, folder, RINGING + ".tran 1u 1m\n", 1e-6, 1e-5)
    checks.true(".tran without UIC: said that SPICE would not start from IC", "as SPICE does where .tran ends in UIC" in states.stderr, states.stderr[:200])
    checks.near("and IC counts", states.value[0, 2], 3, 1e-14)
    for more, expected in ((dict(bs_linear_dc=True), 2 * 110 / 130), (dict(bs_linear_dc=False), 0)):
        states = run(checks, folder, RINGING, 1e-6, 1e-5, **more, ts_type="beuler")
        checks.near(f"-bs_linear_dc {str(more['bs_linear_dc']).lower()} counts before IC", states.value[0, 2], expected, 1e-12)


def by_name(checks, folder):
    """-bs_linear_x0 with names gives each state its own number, whatever the order of its rows; names that are none of the circuit's are refused. A pulse that jumps at the
    start is told of, and as one that rises in some time is SPICE's."""
    netlist = "Two nodes\nC1 a 0 1u\nR1 a b 1k\nC2 b 0 10u\nR2 b 0 10k\n"
    options = {"bs_netlist": folder / "circuit.cir", "ts_type": "cn", "ts_dt": 1e-5, "ts_max_time": 1e-3}
    (folder / "circuit.cir").write_text(netlist)
    for ranks in (1, 2):
        for rows in ("V(b),1\nV(a),5\n", "v(A),5\nV(b),1\n"):
            (folder / "x0.csv").write_text(rows)
            states = States(checks, {**options, "bs_linear_x0": folder / "x0.csv"}, ranks=ranks)
            checks.true(f"names of states, {ranks} ranks", states.labels == ["V(a)", "V(b)"], str(states.labels))
            checks.near(f"each has its number, {ranks} ranks", states.value[0], [5, 1], 1e-15)
    for rows, word in (("V(x),5\nV(b),1\n", "no value of the state V(a)"), ("V(b),5\nV(b),1\n", "V(b) is there twice")):
        (folder / "x0.csv").write_text(rows)
        done = subprocess.run([checks.program, *words({**options, "bs_linear_x0": folder / "x0.csv"})], cwd=folder, capture_output=True, text=True, env=environment(1))
        checks.true(word, done.returncode == 2 and word in done.stderr, done.stderr[-200:])
    jumps = "Pulse\nV1 a 0 PULSE(0 5 0 0 0 0.5m 2m)\nR1 a b 1k\nC1 b 0 1u\n"
    checks.true("a jump at the start is told of", "source 1 jumps from 0 to 5 at the start" in run(checks, folder, jumps, 1e-6, 1e-5).stderr)
    states = run(checks, folder, jumps.replace("0 0 0 0.5m", "0 1n 1n 0.5m"), 1e-6, 3e-4)
    checks.true("one that rises is not", "jumps" not in states.stderr, states.stderr[:200])
    checks.below("and is SPICE's", abs(states.value[-1, 1] - 5 * (1 - math.exp(-0.3))), 5e-3)


def through_restart(checks, folder, name, options):
    """A run that stops before, at and after a jump goes on to the same numbers in every bit; on three ranks to the same but for rounding."""
    def run_to(steps, file, ranks=1, **more):
        line = words({**options, "bs_output": folder / file, "bs_output_interval": 0.05, "bs_overwrite": True, **({"ts_max_steps": steps} if steps else {}), **more})
        done = subprocess.run([*(["mpirun", "-n", str(ranks)] if ranks > 1 else []), checks.program, *line], cwd=folder, capture_output=True, text=True, env=environment(ranks))
        with h5py.File(folder / file) as f:
            return f["states/value"][:], f["states/time"][:], done

    whole, _, done = run_to(0, "whole.h5")
    count = int(done.stdout.split("steps=")[-1].split()[0])
    with h5py.File(folder / "whole.h5") as f:
        ends = [k + 1 for k, t in enumerate(f["backspring/log/time"][:].ravel()) if abs(t - 0.1) < 1e-12 or abs(t - 0.3) < 1e-12]
    for steps in sorted({count // 3, count - 3, *(k + more for k in ends for more in (-1, 0, 1))}):
        run_to(steps, "some.h5", bs_checkpoint=folder / "some.ck")
        again = subprocess.run([checks.program, *words({"bs_restart": folder / "some.ck", "ts_max_steps": 10**6})], cwd=folder, capture_output=True, text=True, env=environment(1))
        with h5py.File(folder / "some.h5") as f:
            checks.true(f"{name} through step {steps} of {count}", again.returncode == 0 and np.array_equal(f["states/value"][:], whole), again.stderr[-200:])
    if count < 80:
        checks.below(f"{name}: 3 ranks", np.abs(run_to(0, "three.h5", 3)[0] - whole).max(), 1e-10)


def error_control(checks, folder):
    """Adaptive steps go through the jumps of a source, with which states that have no derivative jump: v of an RC low-pass in closed form. Where states with a
    derivative jump as well (two plates of a capacitor), the error names the source."""
    jumps = "Jumps\nV1 in 0 PULSE(0 1 0.1 0 0 0.2 0.5)\nR1 in a 1\nC1 a 0 0.1\n"
    for name, bound in (("bdf", 2e-3), ("rosw", 1e-3), ("beuler", 1e-2), ("cn", 1e-3)):
        states = run(checks, folder, jumps, 0.01, 0.5, ts_type=name, ts_adapt_type="basic")
        t = states.time
        v = np.where(t < 0.1, 0, np.where(t < 0.3, 1 - np.exp(np.minimum(1 - 10 * t, 0)), (1 - math.exp(-2)) * np.exp(np.minimum(3 - 10 * t, 0))))
        u = np.where((t >= 0.1) & (t < 0.3), 1, 0)
        away = np.minimum(np.abs(t - 0.1), np.abs(t - 0.3)) > 1e-9
        checks.below(f"{name}: the capacitor", np.abs(states.value[:, 1] - v).max(), bound)
        checks.below(f"{name}: the source", np.abs(states.value[away, 0] - u[away]).max(), 1e-12)
        checks.below(f"{name}: its current", np.abs(states.value[away, 2] + (states.value[away, 0] - states.value[away, 1])).max(), 1e-12)
    (folder / "coupled.cir").write_text(jumps.replace("C1 a 0 0.1", "C1 a b 0.1\nR2 b 0 1"))
    for ranks in (1, 3):
        line = words({"bs_netlist": folder / "coupled.cir", "ts_type": "bdf", "ts_dt": 0.01, "ts_max_time": 0.5})
        done = subprocess.run([*(["mpirun", "-n", str(ranks)] if ranks > 1 else []), checks.program, *line], cwd=folder, capture_output=True, text=True, env=environment(ranks))
        checks.true(f"a jump that no step gets past, {ranks} ranks", done.returncode == 3 and "V1 jumps at t = 0.1 s" in done.stderr, done.stderr[-300:])
    (folder / "two.cir").write_text("Two nodes\nI1 0 a PULSE(0 1 0.1 0 0 0.2 0.5)\nR1 a 0 1\nC1 a 0 0.1\nR2 a b 1\nC2 b 0 0.05\n")
    for name, more in (("bdf", {"ts_bdf_order": 4}), ("rosw", {"ts_rosw_type": "sandu3"}), ("cn", {"ts_adapt_type": "basic"})):
        through_restart(checks, folder, name, {"bs_netlist": folder / "two.cir", "ts_type": name, **more, "ts_rtol": 1e-5, "ts_atol": 1e-5, "ts_dt": 0.01, "ts_max_time": 0.5})
    midpoint = words({"bs_netlist": folder / "coupled.cir", "ts_type": "theta", "ts_theta_endpoint": 0, "ts_dt": 0.01, "ts_max_time": 0.5})
    done = subprocess.run([checks.program, *midpoint], cwd=folder, capture_output=True, text=True, env=environment(1))
    checks.true("the midpoint form is refused where there are algebraic equations", done.returncode == 2 and "-ts_theta_endpoint" in done.stderr, done.stderr[-300:])


def main():
    checks = Checks(__doc__)
    for part in (low_pass, band_pass, sources, operating_point, from_conditions, by_name, error_control):
        if checks.wants(part.__name__):
            with checks.group(part.__name__), tempfile.TemporaryDirectory() as folder:
                part(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    sys.exit(main())
