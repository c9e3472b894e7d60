"""Modes of free vibration (-bs_task modes) as motions."""
import numpy as np

from backspring_io import Run, RunError

FRAMES = 48  # of one period


def per_time(run):
    """The unit of cycles a time."""
    return "Hz" if run.unit("time") == "s" else f"1/{run.unit('time')}"


def modes_of(run, name):
    values = run._array("/modes/" + name)
    if values is None:
        raise RunError(f"{run.path}: holds no modes; write them with -bs_task modes -bs_output")
    return values


class ModeRun(Run):
    """Mode `number` (from 0) as one period of motion about the frame it was taken at, with its largest displacement `scale` of
    the lattice's size. Rows are moments of the period; a mode that grows or costs no force is shown as if it swung, in 1 s. Strains are those of the mode, linear in
    its displacements: a rotation has none, however large it is drawn."""
    strain_name = r"strain of the mode $\mathbf{n}\cdot(\mathbf{q}_2-\mathbf{q}_1)/L$"
    static = False  # about an equilibrium or not, it swings

    def __init__(self, path, number, scale):
        super().__init__(path)
        try:
            if self.kind != "particles":
                raise RunError(f"{self.path}: a linear system has no modes")
            squared = modes_of(self, "omega_squared")
            if not 0 <= number < len(squared):
                raise RunError(f"{self.path}: no mode {number}; there are {len(squared)}, counted from 0")
            self.number, self.count, self.omega_squared = number, len(squared), float(squared[number])
            shape = self._read("/modes/shape", number)
            x = self.position(0)
            size = float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0
            q = scale * size * shape / np.sqrt((shape ** 2).sum(axis=1).max())
        except RunError:
            self.close()
            raise
        period = 2 * np.pi / np.sqrt(self.omega_squared) if self.omega_squared > 0 else 1.0
        phase = 2 * np.pi * np.arange(FRAMES) / FRAMES
        self.sine = np.sin(phase)
        self._largest = self._strain_at_largest(q)
        self.frames, self.times, self.step = FRAMES, phase / (2 * np.pi) * period, np.arange(FRAMES)
        self.positions = x[None] + self.sine[:, None, None] * q[None]
        self.velocities = (2 * np.pi / period) * np.cos(phase)[:, None, None] * q[None]

    def title(self, written=format):
        """Its number and how it moves; `written` makes words of a number."""
        rate = np.sqrt(abs(self.omega_squared))
        growth = f"growing at {written(rate, '.5g')} 1/{self.unit('time')}" if rate else "without any force"
        how = f"{written(rate / (2 * np.pi), '.5g')} {per_time(self)}" if self.omega_squared > 0 else growth
        return f"mode {self.number}: {how}"

    def words(self):
        """The title, and which mode that is for people who count from 1."""
        return f"{self.title()}; modes count from 0, it is number {self.number + 1} of the {self.count} in the file"

    def _strain_at_largest(self, q):
        """(M,): n.(q_2 - q_1)/L with the spring's direction n where the mode was taken."""
        springs = self.springs
        apart = self.position(0)[springs.pairs[:, 1]] - self.position(0)[springs.pairs[:, 0]]
        if springs.shift is not None:
            apart = apart + springs.shift @ self.box_edges(0)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (apart * (q[springs.pairs[:, 1]] - q[springs.pairs[:, 0]])).sum(axis=1) / np.sqrt((apart ** 2).sum(axis=1))
            return np.where((springs.rest_length > 0) & self.acting(0), along / springs.rest_length, np.nan)

    def strains(self, frame):
        """Strains (M,) of the mode alone, first order in its displacements; NaN as in any run."""
        return self.sine[frame] * self._largest

    def tensions(self, frame):
        """None: how large a mode is drawn says nothing of forces."""
        return None

    stresses = tensions

    def box_edges(self, frame):
        return super().box_edges(0)

    def broken(self, frame):
        return super().broken(0)

    def spring_state(self, name, frame):
        return super().spring_state(name, 0)
