"""From positions in 1, 2 or 3 dimensions to the plane of the picture."""
import numpy as np

AXES = ("x", "y", "z", "-x", "-y", "-z")


def finite_number(text):
    """A number of the command line that is not infinite; for argparse."""
    if not np.isfinite(float(text)):
        raise ValueError(text)
    return float(text)


def guess_up(dim, gravity):
    """The axis that points up: against the gravity of the run ("0,-9.8"), else the usual one."""
    try:
        g = [float(v) for v in (gravity or "").replace(" ", "").split(",") if v][:dim]
    except ValueError:
        g = []
    if g and max(abs(v) for v in g) > 0:
        axis = int(np.argmax(np.abs(g)))
        return ("-" if g[axis] > 0 else "") + "xyz"[axis]
    return {1: "", 2: "y", 3: "z"}[dim]


class Camera:
    """Maps points (n, d) to the plane (n, 2) and a depth (n,) that grows towards the eye.

    d = 1: a line, upright if `up` names its axis. d = 2: the plane itself, `up` upwards. d = 3: seen from elevation
    and azimuth [degrees] around `target`; `perspective` 0 is parallel projection, 0.3 a usual lens.
    """

    def __init__(self, dim, up="", elev=20.0, azim=-60.0, target=None, size=1.0, perspective=0.0):
        self.dim = dim
        self.target = np.zeros(dim) if target is None else np.asarray(target, dtype=float)
        self.eye_distance = 1.5 * size / perspective if dim == 3 and perspective > 0 else np.inf
        self.basis = self._basis(up, np.radians(elev), np.radians(azim))  # rows: right, up, towards the eye

    def _basis(self, up, elev, azim):
        axis = max("xyz".find(up[-1:]), 0) if up else {1: -1, 2: 1, 3: 2}[self.dim]
        if axis >= self.dim:
            axis, up = self.dim - 1, up[:-1] + "xyz"[self.dim - 1]
        sign = -1.0 if up.startswith("-") else 1.0
        unit = np.eye(3)[:, :self.dim]
        if self.dim == 1:
            return np.array([[0.0], [sign], [0.0]]) if axis == 0 else np.array([[1.0], [0.0], [0.0]])
        if self.dim == 2:
            return np.array([unit[1 - axis], sign * unit[axis], [0.0, 0.0]])
        a, b, c = unit[(axis + 1) % 3], unit[(axis + 2) % 3], sign * unit[axis]
        if sign < 0:
            a, b = b, a  # keep a right-handed frame
        flat = np.cos(azim) * a + np.sin(azim) * b
        eye = np.cos(elev) * flat + np.sin(elev) * c
        return np.array([-np.sin(azim) * a + np.cos(azim) * b, np.cos(elev) * c - np.sin(elev) * flat, eye])

    def project(self, x):
        """(n, d) -> plane (n, 2), depth (n,)."""
        local = (np.asarray(x, dtype=float) - self.target) @ self.basis.T
        depth = local[:, 2]
        if np.isfinite(self.eye_distance):
            scale = self.eye_distance / np.maximum(self.eye_distance - depth, 0.05 * self.eye_distance)
            return local[:, :2] * scale[:, None], depth
        return local[:, :2], depth

    def plane_coordinates(self):
        """d <= 2: (axis shown to the right, sign), (axis shown upwards, sign); None for no axis."""
        found = []
        for row in self.basis[:2]:
            axis = int(np.argmax(np.abs(row)))
            found.append((axis, float(np.sign(row[axis]))) if row[axis] else None)
        return found
