#!/usr/bin/env python3
"""Films and stills of a particle run: springs coloured by strain, or particles by speed.

  postprocess/movie.py run.h5md -o film.mp4
  postprocess/movie.py run.h5md -o turn.mp4 --turn 90 --zoom 1.2 --theme dark
  postprocess/movie.py modes.h5md -o mode.mp4 --mode 7                 a mode of free vibration, one period
  postprocess/movie.py run.h5md -o still.png --frame -1 --theme dark --elev 30 --azim -50
"""
import argparse
import os
import shutil
import subprocess
import sys

if __name__ == "__main__":
    import launch
    launch.require("numpy", "h5py", "matplotlib", "PIL", "tqdm")

import matplotlib  # noqa: E402
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from backspring_io import RunError, open_run  # noqa: E402
from camera import AXES, finite_number  # noqa: E402
from figure_style import bar_beside, number  # noqa: E402
from modes import ModeRun  # noqa: E402
from scene import Scene  # noqa: E402
from scene_marks import THEMES  # noqa: E402

STILLS, FILMS = (".png", ".pdf", ".svg"), (".mp4", ".webm", ".gif", ".mkv")
CODECS = {".mp4": ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"],
          ".mkv": ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18"],
          ".webm": ["-c:v", "libvpx-vp9", "-pix_fmt", "yuv420p", "-crf", "30", "-b:v", "0", "-row-mt", "1"],
          ".gif": ["-vf", "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=none"]}


class FfmpegWriter:
    """Pipes raw pictures to ffmpeg; the file appears under its name only when it is whole."""

    def __init__(self, path, size, fps):
        stem, ending = os.path.splitext(path)
        self.path, self.part = path, f"{stem}.part{ending}"
        command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba", "-s", f"{size[0]}x{size[1]}",
                   "-r", str(fps), "-i", "-", "-an", *CODECS[ending.lower()], "file:" + self.part]  # else a name such as http:x.mp4 is an address
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)

    def add(self, picture):
        try:
            self.process.stdin.write(picture.tobytes())
        except BrokenPipeError:
            self.close(keep=False)
            raise RunError(f"{self.path}: ffmpeg stopped: {self.said}") from None

    def close(self, keep=True):
        self.said = (self.process.communicate()[1].decode(errors="replace").strip().splitlines() or ["no message"])[0]
        if keep and self.process.returncode == 0:
            os.replace(self.part, self.path)
            return
        if os.path.exists(self.part):
            os.remove(self.part)
        if keep:
            raise RunError(f"{self.path}: ffmpeg failed: {self.said}")


class GifWriter:
    """Animated GIF by Pillow, for machines without ffmpeg."""

    def __init__(self, path, fps):
        self.path, self.fps, self.pictures = path, fps, []

    def add(self, picture):
        from PIL import Image
        self.pictures.append(Image.fromarray(picture[..., :3]).quantize(128, dither=Image.Dither.NONE))

    def close(self, keep=True):
        if keep and self.pictures:
            self.pictures[0].save(self.path, save_all=True, append_images=self.pictures[1:], loop=0,
                                  duration=max(20, round(1000 / self.fps)))


def make_writer(path, size, fps):
    """The writer for `path`; without ffmpeg a GIF beside it, and a line that says so."""
    if shutil.which("ffmpeg"):
        return FfmpegWriter(path, size, fps)
    stem, ending = os.path.splitext(path)
    if ending.lower() != ".gif":
        print(f"movie.py: no ffmpeg here, writing {stem}.gif instead (sudo apt-get install ffmpeg)", file=sys.stderr)
    return GifWriter(stem + ".gif", fps)


def compose(scene, size, dpi):
    """A figure of `size` pixels with the scene, colour bar and time stamp."""
    theme = scene.theme
    figure = plt.figure(figsize=(size[0] / dpi, size[1] / dpi), dpi=dpi, facecolor=theme.background)
    mapping = scene.mapping()
    bar_at = 1 - 1.22 * dpi / size[0]  # the bar and its letters take 1.22 inches
    points = size[1] * 72 / dpi  # height of the picture; the time stamp takes 26 of them
    ax = figure.add_axes([0.0, 0.0, max(0.4, bar_at - 0.015) if mapping is not None else 1.0, 1 - 26 / points])
    scene.setup(ax)
    if mapping is not None:
        bar = figure.colorbar(mapping, cax=figure.add_axes([max(0.42, bar_at), 0.22, 0.15 * dpi / size[0], 0.56]), extend="both")
        bar.set_label(scene.label(), color=theme.ink, fontsize=9)
        bar.ax.tick_params(colors=theme.ink, labelsize=8)
        bar_beside(bar)
        bar.outline.set_edgecolor(theme.faint)
    stamp = figure.text(0.025, 1 - 8 / points, "", color=theme.ink, fontsize=11, va="top")
    return figure, ax, stamp


def show(scene, ax, stamp, row):
    scene.draw_frame(ax, row)
    run = scene.run
    shown = run.series["load_factor"] if run.static else run.times
    digits = max(0, int(np.ceil(-np.log10(max(np.ptp(shown), 1e-300) / 1000)))) if run.frames > 1 else 3
    words = scene.title(row, f".{min(digits, 9)}f")
    stamp.set_text(f"{run.title(number)}, {words}" if isinstance(run, ModeRun) else words)


def film(scene, rows, args, size):
    from tqdm import tqdm
    figure, ax, stamp = compose(scene, size, args.dpi)
    writer = make_writer(args.output, size, args.fps)
    finished = False
    try:
        for row in tqdm(rows, unit="frame", disable=None if not args.quiet else True):
            show(scene, ax, stamp, row)
            figure.canvas.draw()
            writer.add(np.asarray(figure.canvas.buffer_rgba()))
        finished = True
    finally:
        writer.close(keep=finished) if finished or not isinstance(sys.exc_info()[1], RunError) else None
    return writer.path


def still(scene, row, args, size):
    figure, ax, stamp = compose(scene, size, args.dpi)
    show(scene, ax, stamp, row)
    figure.savefig(args.output, dpi=args.dpi, facecolor=scene.theme.background)
    return args.output


def parse(argv=None):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("file", help="trajectory written with -bs_output")
    p.add_argument("-o", "--output", required=True, help="film .mp4 .webm .mkv .gif, or still .png .pdf .svg")
    p.add_argument("--frame", type=int, default=-1, help="frame of a still; negative: from the end (default -1)")
    p.add_argument("--frames", metavar="A:B", help="frames of a film, B excluded (default all)")
    p.add_argument("--stride", type=int, default=1, help="every STRIDE-th frame (default 1)")
    p.add_argument("--mode", type=int, metavar="K", help="film of mode K of -bs_task modes, as the program lists them (from 0; rigid motions are not "
                   "among them where they are so many): one period")
    p.add_argument("--amplitude", type=float, default=0.1, help="largest displacement of --mode, of the lattice's size (default 0.1)")
    p.add_argument("--every", type=float, metavar="DT", help="one picture per DT of simulated time")
    p.add_argument("--fps", type=float, default=25, help="pictures a second (default 25)")
    p.add_argument("--size", default="1280x720", metavar="WxH", help="pixels (default 1280x720)")
    p.add_argument("--dpi", type=float, default=120, help="pixels per inch of the lettering (default 120)")
    p.add_argument("--elev", type=float, default=18, help="elevation of the eye [degree] (default 18)")
    p.add_argument("--azim", type=float, default=-60, help="azimuth of the eye [degree] (default -60)")
    p.add_argument("--perspective", type=float, default=0.3, help="0: parallel projection (default 0.3)")
    p.add_argument("--zoom", type=float, default=1.0, help="above 1: closer (default 1: all that is ever seen)")
    p.add_argument("--turn", type=float, default=0.0, help="degrees by which the eye goes round during the film (default 0)")
    p.add_argument("--follow", action="store_true", help="keep the centre of mass in the middle")
    p.add_argument("--deform", type=finite_number, metavar="F", help="draw displacements since the first frame F times as large, and the shape of that frame behind")
    p.add_argument("--reactions", action="store_true", help="draw the reactions of groups as arrows, with their sizes")
    p.add_argument("--up", choices=AXES, default="", help="axis that points up (default: against gravity); write --up=-x")
    p.add_argument("--color", choices=("auto", "strain", "tension", "stress", "speed", "none"), default="auto", help="default: strain if any")
    p.add_argument("--limits", metavar="A:B", help="ends of the colour scale (default: from the frames shown)")
    p.add_argument("--draw", choices=("auto", "springs", "triangles", "particles"), default="auto",
                   help="lines, shaded triangles, or shaded discs (default: triangles of a sheet of 400 particles and more, else by --max_springs)")
    p.add_argument("--max_springs", type=int, default=20000, help="more springs than this are not drawn as lines")
    p.add_argument("--length_unit", metavar="U", help="what the unit of lengths is called, for example angstrom (default: as the file says, else m)")
    p.add_argument("--theme", choices=sorted(THEMES), default="light")
    p.add_argument("--quiet", action="store_true", help="no progress bar")
    return p.parse_args(argv)


def check(args):
    """Returns (width, height), even; raises RunError for what no parser catches."""
    ending = os.path.splitext(args.output)[1].lower()
    if ending not in STILLS + FILMS:
        raise RunError(f"{args.output}: unknown ending '{ending}'; use one of {' '.join(FILMS + STILLS)}")
    if not os.path.isdir(os.path.dirname(args.output) or "."):
        raise RunError(f"{args.output}: no such folder")
    try:
        width, height = (int(v) for v in args.size.lower().split("x"))
        args.limits = None if args.limits is None else tuple(float(v) for v in args.limits.split(":", 1))
    except ValueError:
        raise RunError("--size wants pixels as WxH, --limits two numbers as A:B") from None
    if not (64 <= width <= 16384 and 64 <= height <= 16384 and args.fps > 0 and args.dpi > 0 and args.max_springs > 0
            and args.zoom > 0):
        raise RunError("--size must lie between 64 and 16384 pixels; --fps, --dpi, --zoom and --max_springs must be positive")
    if not 0 < args.amplitude < 1e6:
        raise RunError("--amplitude must be positive")
    if args.limits is not None and (len(args.limits) != 2 or not args.limits[0] < args.limits[1]):
        raise RunError("--limits A:B wants A < B")
    return width + width % 2, height + height % 2, ending


def main(argv=None):
    args = parse(argv)
    width, height, ending = check(args)
    with (open_run(args.file) if args.mode is None else ModeRun(args.file, args.mode, args.amplitude)) as run:
        if run.kind != "particles":
            raise RunError(f"{args.file}: a linear system has nothing to film; use plot.py")
        run.length_unit = args.length_unit
        is_still = ending in STILLS
        rows = [run.index(args.frame)] if is_still else run.pick(args.frames, args.stride, args.every)
        seen = run.pick(args.frames) if is_still and args.frames else rows
        scene = Scene(run, seen, args.color, args.theme, args.up, args.elev, args.azim, args.perspective,
                      args.max_springs, args.draw, args.limits, args.zoom, args.turn, args.follow, args.deform, args.reactions)
        made = still(scene, rows[0], args, (width, height)) if is_still else film(scene, rows, args, (width, height))
        if args.mode is not None:
            print(run.words())
    print(f"{made}: {len(rows)} frame{'s' if len(rows) > 1 else ''}, {width}x{height}")


if __name__ == "__main__":
    launch.run(main, RunError)
