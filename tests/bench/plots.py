"""results.png: what a step costs here and elsewhere, and how the cost grows."""
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt


def bars(axes, results, case):
    """Seconds per 0.01 s simulated, one bar a program, 1 rank."""
    entries = [(f"backspring h={r['h']:g}" + (", full AIJ" if r["solver"] == "full" else ""), r["s_per_step"] * 0.01 / r["h"])
               for r in results.get("steps", []) if r["case"] == case and r["ranks"] == 1 and "s_per_step" in r]
    entries += [(r["peer"] + (f" h={r['h']:g}" if r["kind"] == "implicit" else ""), r["s_per_10ms"])
                for r in results.get("peers", []) if r["case"] == case and r["ranks"] == 1 and "s_per_10ms" in r]
    entries.sort(key=lambda e: -e[1])
    colors = ["tab:blue" if name.startswith("backspring") else "tab:gray" for name, _ in entries]
    axes.barh([name for name, _ in entries], [value for _, value in entries], color=colors)
    axes.set_xscale("log")
    axes.set_xlabel("s per 0.01 s simulated")
    axes.set_title(f"{case}, n = {results['n']}, 1 rank")
    axes.tick_params(axis="y", labelsize=7)


def growth(axes, results):
    rows = [r for r in results.get("sizes", []) if "us_per_particle" in r]
    for ranks in sorted({r["ranks"] for r in rows}):
        mine = [r for r in rows if r["ranks"] == ranks]
        axes.plot([r["particles"] for r in mine], [r["us_per_particle"] for r in mine], "o-", label=f"{ranks} rank(s)")
    axes.set_xscale("log")
    axes.set_ylim(bottom=0)
    axes.set_xlabel("particles")
    axes.set_ylabel("us per particle and step")
    axes.set_title("cost at equal h omega_max")
    if rows:
        axes.legend()


def draw(results, path):
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.2), gridspec_kw={"width_ratios": [1, 1, 0.9]})
    bars(axes[0], results, "B1")
    bars(axes[1], results, "B2")
    growth(axes[2], results)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
