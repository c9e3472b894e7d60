"""An XSpringies scene read in plain Python, and the acceleration of its particles, independent of the program."""
import numpy as np

WIDTH, HEIGHT = 642.0, 550.0


class Scene:
    """x, v (n, 2); mass (n); fixed (n); id (n). y points up, the origin is at the bottom left of the window."""

    def __init__(self, path):
        masses, springs, self.forces = {}, [], {}
        self.centre_id, self.viscosity, self.walls = -1, 0.0, (0, 0, 0, 0)
        for line in path.read_text(errors="replace").splitlines():
            word = line.split()
            if not word:
                continue
            number = word[1:]
            if word[0] == "mass":
                masses[int(number[0])] = [float(q) for q in number[1:6]]
            elif word[0] == "spng":
                springs.append([int(q) for q in number[1:3]] + [float(q) for q in number[3:6]])
            elif word[0] == "frce" and int(number[1]) > 0:
                self.forces[int(number[0])] = [float(q) for q in number[2:4]]
            elif word[0] == "cent":
                self.centre_id = int(number[0])
            elif word[0] == "visc":
                self.viscosity = float(number[0])
            elif word[0] == "wall":
                self.walls = tuple(int(q) for q in number[:4])
        self.id = np.array(list(masses))
        row = {i: k for k, i in enumerate(masses)}
        table = np.array(list(masses.values()))
        self.fixed = table[:, 4] < 0
        self.mass = np.where(table[:, 4] == 0, 1.0, np.abs(table[:, 4]))
        self.x, self.v = table[:, :2], np.where(self.fixed[:, None], 0.0, table[:, 2:4])
        self.radius = np.clip(np.trunc(2 * np.log(4 * self.mass + 1)), 1, 64)
        kept = [s for s in springs if s[0] in row and s[1] in row and s[0] != s[1]]
        self.ends = np.array([[row[s[0]], row[s[1]]] for s in kept], int).reshape(-1, 2)
        self.ks, self.kd, self.rest = np.array([s[2:] for s in kept], float).reshape(-1, 3).T
        self.centre = row.get(self.centre_id)

    def size(self):
        return max(np.ptp(self.x, axis=0).max(), 1.0)

    def acceleration(self, x, v):
        a = -self.viscosity * v
        C = x[self.centre] if self.centre is not None else np.array([WIDTH, HEIGHT]) / 2
        if 0 in self.forces:
            g, angle = self.forces[0]
            a = a + g * np.array([np.sin(np.deg2rad(angle)), -np.cos(np.deg2rad(angle))])
        others = np.arange(len(x)) != (-1 if self.centre is None else self.centre)
        if 1 in self.forces:
            g, damping = self.forces[1]
            w = self.mass * (~self.fixed & others)
            S = w.sum()
            if S > 0:
                a = a - others[:, None] * (g * (w @ x / S - C) + damping * (w @ v / S)) / S
        if 2 in self.forces:
            g, power = self.forces[2]
            r, inner = np.linalg.norm(C - x, axis=1), self.radius + 1
            size = np.where(r < inner, g / inner ** power * (r / inner) ** 2, g / np.maximum(r, inner) ** power)
            a = a + (np.where(r > 0, size, 0) / np.where(r > 0, r, 1))[:, None] * (C - x)
        if 3 in self.forces:
            g, power = self.forces[3]
            top, left, right, bottom = self.walls
            def push(gap):
                return np.where(gap >= 0, g / np.maximum(gap, 1) ** power, 0.0)
            r = self.radius
            a = a + np.stack([left * push(x[:, 0] - r) - right * push(WIDTH - r - x[:, 0]),
                              bottom * push(x[:, 1] - r) - top * push(HEIGHT - r - x[:, 1])], axis=1)
        i, j = self.ends.T
        d = x[i] - x[j]
        l = np.linalg.norm(d, axis=1)
        safe = np.where(l > 0, l, 1.0)
        f = self.ks * (self.rest - l) - self.kd * ((v[i] - v[j]) * d).sum(1) / safe
        pull = (np.where(l > 0, f, 0.0) / safe)[:, None] * d
        np.add.at(a, i, pull / self.mass[i, None])
        np.add.at(a, j, -pull / self.mass[j, None])
        return np.where(self.fixed[:, None], 0.0, a)
