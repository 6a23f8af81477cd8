#!/usr/bin/python3
"""The reduction of daq/reduction.hpp by numpy and h5py: campaign folder in, the first columns of steps.csv out.

The peer of `kphi replay` in replay_bench. Vectorised over samples, and over bins where one formula does for all; what
depends on the step before (the search for a settled window, the window of the autocorrelation) is a loop over steps.
Not in it, to its advantage: flags of events, gates of the motor, electrical means.
"""
import glob
import math
import sys

import h5py
import numpy as np

BIN_NS = 10_000_000
S = 1.5


def clock(arrival, ft, rate):
    """Bench time of every sample: minimum delay per half second, and a line through these."""
    tick = 1e9 / rate
    device = (ft - ft[0]).astype(np.uint32).astype(np.float64) * tick
    delay = (arrival - arrival[0]).astype(np.float64) - device
    last = np.append(arrival[1:] != arrival[:-1], True)
    device_last, delay_last = device[last], delay[last]
    half = np.floor(device_last / 0.5e9)
    starts = np.flatnonzero(np.append(True, half[1:] != half[:-1]))
    least = np.minimum.reduceat(delay_last, starts)
    ends = np.append(starts[1:], len(delay_last))
    at = [a + int(np.argmin(delay_last[a:b])) for a, b in zip(starts, ends)]
    x = device_last[at]
    skew, offset = (np.polyfit(x - x.mean(), least, 1) if len(x) >= 4 else (0.0, least.min()))
    offset = offset - skew * x.mean() if len(x) >= 4 else offset
    return np.rint(offset + arrival[0] + device + skew * device).astype(np.int64)


class Bins:
    """Exact sums of equal bins of one window."""

    def __init__(self, run, begin, end):
        n = (end - begin) // BIN_NS
        edges = begin + BIN_NS * np.arange(n + 1)
        at = np.searchsorted(run.time, edges)
        self.begin, self.n = begin, np.diff(at)
        force = run.force[at[0]:at[-1]].astype(np.int64)
        torque = run.torque[at[0]:at[-1]].astype(np.int64)
        self.origin, self.torque_origin = int(force[0]), int(torque[0])
        force, torque, starts = force - self.origin, torque - self.torque_origin, (at - at[0])[:-1]
        self.sum = np.add.reduceat(force, starts)
        self.squares = np.add.reduceat(force * force, starts)
        self.torque_sum = np.add.reduceat(torque, starts)
        self.torque_squares = np.add.reduceat(torque * torque, starts)
        counts = run.counts[at[0]:at[-1]]
        self.status = np.bitwise_or.reduceat(run.status[at[0]:at[-1]], starts)
        self.high = np.maximum.reduceat(counts, starts, axis=0)
        self.low = np.minimum.reduceat(counts, starts, axis=0)
        self.lost = int((np.diff(run.ft[max(at[0] - 1, 0):at[-1] + 1].astype(np.int64)) // run.stride - 1).sum())
        self.centre = begin + BIN_NS * (np.arange(n) + 0.5)

    def force(self):
        return self.origin + self.sum / self.n

    def over(self, first):
        def mean_and_deviation(sums, squares, origin):
            n, s, q = int(self.n[first:].sum()), int(sums[first:].sum()), int(squares[first:].sum())
            return origin + s / n, math.sqrt((q * n - s * s) / n / (n - 1)), n
        force = mean_and_deviation(self.sum, self.squares, self.origin)
        torque = mean_and_deviation(self.torque_sum, self.torque_squares, self.torque_origin)
        return force, torque


def mean_error(values, fitted=1):
    """Gamma method, or slow cosines where the values swing: standard uncertainty of the mean, degrees of freedom."""
    n = len(values)
    centred = values - values.mean()
    variance = centred @ centred / n
    if variance <= 0:
        return 0.0, n - 1
    chance = variance / math.sqrt(n)
    covariances = np.array([centred[:-k] @ centred[k:] / (n - k) for k in range(1, min(10, n // 2) + 1)])
    if covariances[0] < -chance or covariances[1:].min() < -2.5 * chance:
        waves = max(n // 8, fitted + 3)
        power = np.cos(np.pi / n * np.outer(np.arange(1, waves + 1), np.arange(n) + 0.5)) @ centred
        freedom = waves - (fitted - 1)
        return math.sqrt(2 * (power @ power) / n / freedom / n), freedom
    total, window = 0.5, 0
    while window < max(n // 4, 1):
        window += 1
        total += centred[:-window] @ centred[window:] / (n - window) / variance
        tau = 1e-12 if total <= 0.5 else S / math.log((total + 0.5) / (total - 0.5))
        if math.exp(-window / tau) < tau / math.sqrt(window * n):
            break
    width = 2 * window + 1
    return math.sqrt(variance * max(2 * total, 1 / n) * (1 + width / n) / n), max(n / width - 1, 1.0)


T95 = {}


def student_95(freedom):
    """Two-sided 95 % point of Student's t (Cornish-Fisher, good to 1e-3 from 4 degrees of freedom on)."""
    z = 1.959963984540054
    return (z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)
            + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * freedom**3))


def settle(thrust, first, planned):
    """First bin of the settled window."""
    n, least = len(thrust), max(min(50, planned // 2), 6)
    if n < first + least:
        return min(first, n)
    x = np.arange(least) - 0.5 * (least - 1)
    parts = 2 if n >= first + 2 * least else 1
    ends = thrust[n - parts * least:].reshape(parts, least)
    rest = ends - ends.mean(axis=1, keepdims=True) - np.outer(ends @ x / (x @ x), x)
    u, freedom = mean_error(rest.ravel(), 2 * parts)
    noise, factor = u * u * parts * least, student_95(freedom)
    for begin in range(first, n - least + 1, max(1, planned // 20)):
        rest = thrust[begin:]
        x = np.arange(len(rest)) - 0.5 * (len(rest) - 1)
        spread = x @ x
        change = abs(x @ rest / spread) * len(rest)
        if change <= max(factor * math.sqrt(noise / spread) * len(rest), 0.001 * abs(rest.mean())):
            return begin
    return n - least


class Lag:
    """Delay of the thrust after the speed, all steps at once: rows are steps, columns bins. Without the time constant
    that daq/lag.hpp finds besides."""

    def __init__(self, thrust, before, speeds, marks):
        self.h, nb = BIN_NS * 1e-9, before.shape[1]
        self.y = np.concatenate([before, thrust[:, :120]], axis=1)
        self.y = self.y - self.y.mean(axis=1, keepdims=True)
        self.yy = (self.y * self.y).sum()
        self.edges = marks[:, None] * 1e-9 + self.h * np.arange(-nb, 121)
        # Until a command the motor held what it held before.
        t, w, at = speeds[0] * 1e-9, speeds[1] ** 2, np.searchsorted(speeds[0], marks)
        self.t, self.w = np.insert(t, at, marks * 1e-9), np.insert(w, at, w[np.maximum(at - 1, 0)])
        self.integral = np.append(0, np.cumsum(0.5 * (self.w[1:] + self.w[:-1]) * np.diff(self.t)))

    def squares(self, delay):
        edges = self.edges - delay
        k = np.searchsorted(self.t, edges, side="right") - 1
        value = np.interp(edges, self.t, self.w)
        x = np.diff(self.integral[k] + (edges - self.t[k]) * 0.5 * (self.w[k] + value), axis=1) / self.h
        x -= x.mean(axis=1, keepdims=True)
        xy, xx = (x * self.y).sum(axis=1), (x * x).sum(axis=1)
        return self.yy - np.where(xy > 0, xy * xy / xx, 0).sum()

    def estimate(self):
        grid = np.arange(-0.01, 0.6, 0.04)
        at = grid[int(np.argmin([self.squares(d) for d in grid]))]
        step = 0.02
        while step > 5e-5:  # parabola through three delays
            a, b, c = self.squares(at - step), self.squares(at), self.squares(at + step)
            bend = a - 2 * b + c
            at += min(max(0.5 * (a - c) / bend, -1), 1) * step if bend > 0 else math.copysign(step, a - c)
            step *= 0.4
        return at


class Run:
    def __init__(self, path):
        with h5py.File(path, "r") as run:
            cell, a = run["load_cell"], run.attrs
            n = int(cell.attrs["n_valid"])
            self.counts = cell["counts"][:n]
            self.ft, self.status = cell["ft_sequence"][:n], cell["status"][:n]
            arrival = cell["t_arrival_ns"][:n]
            axis = int(a["thrust_axis"])
            self.force, self.torque = self.counts[:, axis], self.counts[:, axis + 3]
            self.newtons = int(a["thrust_sign"]) / float(a["counts_per_newton"])
            self.newton_metres = int(a["thrust_sign"]) / float(a["counts_per_newton_metre"])
            self.stride = int(a["ft_stride"])
            self.spin, self.discard = int(a["spin"]), round(1e9 * float(a["minimum_discard_s"]))
            self.time = clock(arrival, self.ft, float(a["device_rate_hz"]))
            self.phase, self.mark = run["commands/phase"][:], run["commands/t_ns"][:]
            self.commanded = run["commands/speed_rad_s"][:]
            self.speed = (run["motor/speed/t_ns"][:], run["motor/speed/value"][:])

    def zeros(self):
        found = []
        for i in range(len(self.phase) - 1):
            if self.phase[i] not in (0, 3):
                continue
            begin, end = int(self.mark[i]), int(self.mark[i + 1])
            if self.phase[i] == 3:
                turning = self.speed[0][(self.speed[0] >= begin) & (self.speed[0] < end) & (abs(self.speed[1]) > 5)]
                begin = max([begin + min(self.discard, (end - begin) // 2)] + [int(t) + 1 for t in turning[-1:]])
            bins = Bins(self, begin, end)
            force, torque = bins.over(0)
            u, _ = mean_error(bins.force())
            found.append((begin + BIN_NS * len(bins.n) / 2, force[0], torque[0], u))
        return found

    def reduce(self):
        (ta, fa, qa, ua), (tb, fb, qb, ub) = self.zeros()

        def zero(t):
            share = (t - ta) / (tb - ta)
            return fa + share * (fb - fa), qa + share * (qb - qa), np.hypot((1 - share) * ua, share * ub)

        steps = [i for i in range(len(self.phase) - 1) if self.phase[i] == 1]
        bins = [Bins(self, int(self.mark[i]), int(self.mark[i + 1])) for i in steps]
        before = [Bins(self, int(self.mark[i]) - 20 * BIN_NS, int(self.mark[i])) for i in steps]
        thrust = [self.newtons * (b.force() - zero(b.centre)[0]) for b in bins]
        level = np.array([self.newtons * (b.force() - zero(b.centre)[0]) for b in before])
        lag = Lag(np.array(thrust), level, self.speed, self.mark[steps]).estimate()
        lag_ns = round(1e9 * lag)
        for i, b, t in zip(steps, bins, thrust):
            begin = int(self.mark[i])
            first = min(-(-(self.discard + lag_ns) // BIN_NS), len(t))
            tolerance = max(0.01 * self.commanded[i], 2.0)
            inside = (self.speed[0] >= begin + self.discard) & (self.speed[0] < self.mark[i + 1])
            near = inside & (abs(self.spin * self.speed[1] - self.commanded[i]) <= tolerance)
            if near.any():
                first = max(first, -(-(int(self.speed[0][near.argmax()]) + lag_ns - begin - 20_000_000) // BIN_NS))
            first = settle(t, first, len(t) - first)
            force, torque = b.over(first)
            window = (begin + first * BIN_NS, begin + len(t) * BIN_NS)
            inside = (self.speed[0] >= window[0] - lag_ns) & (self.speed[0] < window[1] - lag_ns)
            speed = self.spin * self.speed[1][inside]
            f0, q0, u0 = zero(0.5 * (window[0] + window[1]))
            u, _ = mean_error(t[first:])
            mean_error(speed)
            yield (speed.mean(), self.newtons * (force[0] - f0), abs(self.newtons) * force[1],
                   self.newton_metres * (torque[0] - q0), math.hypot(u, abs(self.newtons) * u0), lag, force[2])


if __name__ == "__main__":
    print("speed_rad_s,thrust_n,thrust_sd_n,torque_nm,thrust_u_n,lag_s,thrust_samples")
    for name in sorted(glob.glob(sys.argv[1] + "/runs/*.h5"), key=lambda path: (len(path), path)):
        for row in Run(name).reduce():
            print(",".join(repr(float(x)) for x in row))
