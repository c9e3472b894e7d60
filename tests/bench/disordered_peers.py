"""Equilibria of nets of linear springs by other methods, for disordered.py: FIRE, L-BFGS of SciPy, and Newton's method with sparse factors of SuperLU, with and without shifts
that keep the tangent positive definite. All work on the same forces, one load step after the other, from the last state moved along."""
import time

import numpy as np
import scipy.optimize as opt
import scipy.sparse as sp
import scipy.sparse.linalg as la

LEAST_SHIFT = 1e-10  # of the springs' stiffness: motions that no spring resists, as in the program


class Ended(Exception):
    """The residual is met, or the time is over."""


class SpringNet:
    """Springs of one stiffness each in the plane; a spring's second end may be an image, `shift` edges of the box away. Vectors are of the free components."""

    def __init__(self, pairs, stiffness, rest, shift, free):
        self.pairs, self.stiffness, self.rest, self.shift = pairs, stiffness, rest, shift
        self.free = np.flatnonzero(np.repeat(free, 2))
        rows = np.arange(len(pairs))
        ends = np.concatenate([np.ones(len(pairs)), -np.ones(len(pairs))]), (np.tile(rows, 2), np.concatenate([pairs[:, 1], pairs[:, 0]]))
        self.across = sp.csr_matrix(ends, shape=(len(pairs), len(free)))
        self.gather = self.across.T.tocsr()
        self.evaluations = self.factors = 0
        self._pattern()

    def place(self, x, edges):
        """The places that are searched from, with what is held in them, and the edges of the box."""
        self.x, self.offset = x.copy(), self.shift @ edges
        return x.ravel()[self.free]

    def at(self, z):
        self.x.ravel()[self.free] = z
        return self.x

    def forces(self, z):
        """(forces on the free components, energy)"""
        self.evaluations += 1
        u = self.across @ self.at(z) + self.offset
        length = np.sqrt(u[:, 0]**2 + u[:, 1]**2)
        stretch = length - self.rest
        pull = (self.stiffness * stretch / length)[:, None] * u
        return -(self.gather @ pull).ravel()[self.free], 0.5 * float(self.stiffness @ stretch**2)

    def _pattern(self):
        """Where each entry of each spring's block goes in the compressed columns of the tangent."""
        number = np.full(2 * self.across.shape[1], -1)
        number[self.free] = np.arange(len(self.free))
        a, b = self.pairs.T
        where = [(2 * p + r, 2 * q + c) for p, q in ((a, a), (b, b), (a, b), (b, a)) for r in range(2) for c in range(2)]
        rows, columns = (number[np.concatenate(w)] for w in zip(*where))
        self.kept = np.flatnonzero((rows >= 0) & (columns >= 0))
        n = len(self.free)
        every = np.concatenate([columns[self.kept] * n + rows[self.kept], np.arange(n) * (n + 1)])
        entries, self.slot = np.unique(every, return_inverse=True)
        self.diagonal, self.slot = self.slot[len(self.kept):], self.slot[:len(self.kept)]
        self.rows, self.starts = entries % n, np.searchsorted(entries // n, np.arange(n + 1))

    def tangent(self, z):
        u = self.across @ self.at(z) + self.offset
        length = np.sqrt(u[:, 0]**2 + u[:, 1]**2)
        u /= length[:, None]
        across = self.stiffness * (1 - self.rest / length)
        blocks = np.concatenate([(across * (r == c) + (self.stiffness - across) * u[:, r] * u[:, c]) for r in range(2) for c in range(2)])
        values = np.concatenate([blocks, blocks, -blocks, -blocks])[self.kept]
        n = len(self.free)
        return sp.csc_matrix((np.bincount(self.slot, values, len(self.rows)), self.rows, self.starts), shape=(n, n))

    def factor(self, K, shift):
        """(factors of K + shift I by diagonal pivots, how many of these are negative)"""
        self.factors += 1
        K = K.copy()
        K.data[self.diagonal] += shift
        factors = la.splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        return factors, int(np.count_nonzero(factors.U.diagonal() < 0))


def fire(net, z, goal, end):
    """Bitzek et al., Phys. Rev. Lett. 97, 170201 (2006), unit masses; the longest step is a little below the stability limit 2/sqrt(6) of a triangular lattice."""
    first, longest, least, rise, fall, alpha_0, alpha_fall = 0.07, 0.7, 5, 1.1, 0.5, 0.1, 0.99
    v, step, alpha, downhill, count = np.zeros_like(z), first, alpha_0, 0, 0
    f, _ = net.forces(z)
    while (size := np.sqrt(f @ f)) > goal and time.process_time() < end:
        if v @ f > 0:
            v += alpha * (np.sqrt(v @ v) / size * f - v)
            downhill += 1
            if downhill > least:
                step, alpha = min(rise * step, longest), alpha * alpha_fall
        elif count:
            v[:], step, alpha, downhill = 0, fall * step, alpha_0, 0
        v += step * f
        z = z + step * v
        f, _ = net.forces(z)
        count += 1
    return z, count


def lbfgs(net, z, goal, end):
    """SciPy's L-BFGS-B with a history of 20; where its line search ends before the goal it begins anew from there, as long as that halves the residual."""
    best, count, last = z, 0, np.inf

    def function(place):
        nonlocal best, count
        f, energy = net.forces(place)
        count, best = count + 1, place.copy()
        if np.sqrt(f @ f) <= goal or time.process_time() > end:
            raise Ended
        return energy, -f

    try:
        while True:
            best = opt.minimize(function, z, jac=True, method="L-BFGS-B", options={"maxcor": 20, "ftol": 0, "gtol": 0, "maxiter": 10**7, "maxfun": 10**7, "maxls": 40}).x
            f, _ = net.forces(best)
            if np.sqrt(f @ f) > 0.5 * last:
                break
            z, last = best, np.sqrt(f @ f)
    except Ended:
        pass
    return best, count


def newton(net, z, goal, end, shifts=True, most=1000):
    """Directions of K + shift I, the shift raised until its pivots are positive (Nocedal and Wright, algorithm 3.3), as far along them as the energy falls. Without
    shifts: of K as it is, and where no part of the direction lowers the energy the search ends."""
    shift, count = 0.0, 0
    f, energy = net.forces(z)
    while np.sqrt(f @ f) > goal and count < most and time.process_time() < end:
        K = net.tangent(z)
        shift = shift / 10 if shift > 1e-6 else 0.0
        factors, negative = net.factor(K, shift + LEAST_SHIFT)
        while shifts and negative:
            shift = max(4 * shift, 1e-4)
            factors, negative = net.factor(K, shift + LEAST_SHIFT)
        direction = factors.solve(f)
        slope, part = -f @ direction, 1.0
        while True:
            trial, there = net.forces(z + part * direction)
            if there <= energy + 1e-4 * part * slope + 1e-14 * energy:
                break
            part *= 0.5
            if part < 1e-12:
                return z, count
        z, f, energy, count = z + part * direction, trial, there, count + 1
    return z, count


def plain_newton(net, z, goal, end):
    return newton(net, z, goal, end, shifts=False, most=200)


PEERS = {"Newton, sparse LU, shifts": newton, "Newton, sparse LU, no shifts": plain_newton, "L-BFGS": lbfgs, "FIRE": fire}
