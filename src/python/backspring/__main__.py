"""python3 -m backspring TOOL ...: the tools of postprocess by name (plot, movie, convert, sweep, compare)."""

from __future__ import annotations

import runpy
import sys

from .trajectories import tools

TOOLS = ("plot", "movie", "convert", "sweep", "compare")


def main() -> None:
    """Runs the tool that the command line names."""
    if len(sys.argv) < 2 or sys.argv[1] not in TOOLS:
        sys.exit(f"usage: python3 -m backspring {{{','.join(TOOLS)}}} ...; each says more under --help")
    script = tools() / f"{sys.argv[1]}.py"
    sys.path.insert(0, str(script.parent))
    sys.argv = [str(script), *sys.argv[2:]]
    runpy.run_path(str(script), run_name="__main__")


if __name__ == "__main__":
    main()
