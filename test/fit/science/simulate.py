"""Equations of docs/science.md against a thousand draws each of what they speak of: expectation and scatter.

A line each: number, what, ratio of what the equation says to what the draws do, the error of that ratio, and what the
page may be off by. Exit 1 if one is further off.
"""
import sys

import numpy as np
from scipy.stats import f as fisher, norm, t as student

DRAWS = 1000
rng = np.random.default_rng(20210530)
failed = False


def holds(number, what, said, drawn, error, tolerated):
    """`said` over `drawn` is 1 within `tolerated` and three times `error`, the relative standard error of both."""
    global failed
    ratio = said / drawn
    failed |= not abs(ratio - 1) <= tolerated + 3 * error
    print(f"({number}) {what}: {ratio:.3f} ± {error:.3f}, {tolerated:g} tolerated")


def variance(number, what, said, draws, tolerated):
    """A variance that is said, one number or one a draw, against that of the draws."""
    said = np.atleast_1d(said)
    scatter = said.std() / said.mean() / np.sqrt(len(said))
    holds(number, what, said.mean(), np.var(draws, ddof=1), np.hypot(np.sqrt(2 / len(draws)), scatter), tolerated)


def share(number, what, found, expected, tolerated):
    holds(number, what, expected, found.mean(), np.sqrt(expected * (1 - expected) / found.size) / expected, tolerated)


def autoregressive(rho, *shape):
    """Noise of variance 1 that remembers, along the last axis."""
    noise = rng.standard_normal(shape)
    for i in range(1, shape[-1]):
        noise[..., i] = rho * noise[..., i - 1] + np.sqrt(1 - rho ** 2) * noise[..., i]
    return noise


def mean_with_memory():
    n, x = 400, autoregressive(0.8, DRAWS, 400)
    d = x - x.mean(1, keepdims=True)
    C = np.array([(d[:, : n - t] * d[:, t:]).sum(1) / (n - t) for t in range(n // 4)]).T
    said = np.empty(DRAWS)
    for i, c in enumerate(C):  # Wolff's window, S = 1.5
        tau_int, W = 0.5, len(c) - 1
        for w in range(1, len(c)):
            tau_int = 0.5 + (c[1 : w + 1] / c[0]).sum()
            tau = 1.5 / np.log((2 * tau_int + 1) / (2 * tau_int - 1)) if tau_int > 0.5 else 1e-9
            if np.exp(-w / tau) - tau / np.sqrt(w * n) < 0:
                W = w
                break
        said[i] = c[0] / n * (1 + 2 * (c[1 : W + 1] / c[0]).sum()) * (1 + (2 * W + 1) / n)
    variance(4, "a mean whose noise remembers", said, x.mean(1), 0.08)


def mean_that_alternates():
    n, x = 400, autoregressive(-0.8, DRAWS, 400)
    waves, i = n // 8, np.arange(n)
    cosines = np.cos(np.pi * np.outer(np.arange(1, waves + 1), i + 0.5) / n)
    power = 2 / n * (x @ cosines.T) ** 2
    variance(5, "a mean whose noise alternates", power.mean(1) / n, x.mean(1), 0.05)
    holds(5, "its freedom", waves, 2 * np.mean(power.mean(1)) ** 2 / np.var(power.mean(1)), np.sqrt(8 / DRAWS), 0.05)


def shared_zero():
    w = np.linspace(0.1, 1, 40) ** 4
    w /= w.sum()
    s = (np.arange(40) + 0.5) / 40
    mean = w @ s
    said = w @ np.minimum.outer(s, s) @ w - mean ** 2
    walk = rng.standard_normal((DRAWS, 80)) / np.sqrt(80)  # m = 1 between both zeros
    at_step = walk.cumsum(1)[:, ::2]  # in the middle of each step
    variance(8, "the zero that walks", said, at_step @ w - mean * walk.sum(1), 0.02)
    jumped = (s > rng.random((DRAWS, 1))) * rng.choice([-1, 1], (DRAWS, 1))
    jump = jumped @ w - mean * np.where(jumped[:, -1] != 0, jumped[:, -1], rng.choice([-1, 1], DRAWS))
    variance(8, "the zero that jumps once", said, jump, 0.05)
    u_a, u_b = 0.3, 0.5
    ends = rng.standard_normal((DRAWS, 2)) * [u_a, u_b]
    moved = (walk.sum(1) + ends[:, 1] - ends[:, 0]) ** 2 - u_a ** 2 - u_b ** 2
    holds(9, "how far a zero moves", moved.mean(), 1, moved.std() / np.sqrt(DRAWS), 0)
    line = rng.standard_normal((DRAWS, 2)) * [u_a, u_b] @ np.array([1 - mean, mean])
    variance(7, "a zero between two", (1 - mean) ** 2 * u_a ** 2 + mean ** 2 * u_b ** 2, line, 0)


def noise_within_a_run():
    levels, runs = 12, 3
    x = np.linspace(0.1, 1, levels) ** 2
    s = 0.02 + 0.05 * x  # the noise of a level
    factor, zero = rng.standard_normal((2, 4 * DRAWS, runs, 1)) * 0.03
    T = x * (1.5 + factor) + zero + s * rng.standard_normal((4 * DRAWS, runs, levels))
    design = np.array([np.ones(levels), x]).T
    hat = design @ np.linalg.pinv(design)
    s2 = (T - T @ hat).var(axis=1, ddof=1) / (1 - hat.diagonal())
    a = (x ** 2 * s2).sum(1) / (x @ x) ** 2
    own = (T - x * (1.5 + factor) - zero)[:, 0] @ x / (x @ x)
    variance(13, "noise of k within a run", a, own, 0.08)


def scatter_of_runs():
    occlusions, runs, a, tau, k = 5, 3, 1e-5, 0.01, np.linspace(1, 0.6, 5)
    V = a + tau ** 2 * k ** 2
    S = (V * rng.chisquare(runs - 1, (DRAWS, occlusions)))
    found = np.full(DRAWS, tau ** 2)
    for _ in range(60):  # scoring of (15) with τ alone
        now = np.maximum(a + np.maximum(found, 0)[:, None] * k ** 2, 1e-12)
        weight = (runs - 1) / (2 * now ** 2)
        found = (weight * k ** 2 * (S / (runs - 1) - a)).sum(1) / (weight * k ** 4).sum(1)
    information = ((runs - 1) * k ** 4 / (2 * V ** 2)).sum()
    nu = 2 * tau ** 4 * information
    variance(16, "τ² by restricted likelihood", 2 * tau ** 4 / nu, found, 0.1)
    holds(15, "its expectation", found.mean(), tau ** 2, found.std() / found.mean() / np.sqrt(DRAWS), 0.03)


def sum_of_few():
    nu, u = np.array([4, 9]), np.array([1.0, 0.7])
    error = rng.standard_normal((20 * DRAWS, 2)) * u
    found = np.sqrt(rng.chisquare(nu, error.shape) / nu) * u
    freedom = (found ** 2).sum(1) ** 2 / (found ** 4 / nu).sum(1)
    share(18, "± of two sources holds", abs(error.sum(1)) <= student.ppf(0.975, freedom) * np.hypot(*found.T), 0.95, 0.01)
    alpha = rng.standard_normal(20 * DRAWS) * 0.035
    variance(18, "the alignment, of second order", 0.035 ** 4 / 2, np.cos(alpha), 0.02)


def line():
    phi, sigma = np.array([45, 90, 135, 180.0]) / 180, np.array([1, 2, 1.5, 3]) * 1e-2
    k = 1.2 - 0.5 * phi + sigma * rng.standard_normal((DRAWS, 4))
    J, W = np.array([np.ones(4), phi]).T, np.diag(sigma ** -2)
    C = np.linalg.inv(J.T @ W @ J)
    found = k @ (C @ J.T @ W).T
    for i, name in enumerate(["the intercept", "the slope"]):
        variance(20, name, C[i, i], found[:, i], 0.02)
    chi2 = (((k - found @ J.T) / sigma) ** 2).sum(1) / 2
    share(21, "a line is called bent", chi2 > fisher.ppf(0.95, 2, 1e9), 0.05, 0.02)
    A = np.column_stack([J, phi ** 2])
    C3 = np.linalg.inv(A.T @ W @ A)
    bend = k @ (C3 @ A.T @ W).T[:, 2]
    share(21, "its third term is", bend ** 2 / C3[2, 2] > fisher.ppf(0.95, 1, 1e9), 0.05, 0.02)


def between_knots():
    bend, a, b = rng.uniform(-3, 3, DRAWS), 0.2, 0.3
    off = bend * (0.2 ** 2 - (0 + 0.5 * 0.2)) / 2 + 0 * b  # parabola less chord at 0.2 of [0, 0.5]
    variance(22, "a bend between two knots", (3 * a * b / (2 * np.sqrt(3))) ** 2, off, 0)


def freedom_of_residuals():
    n = 10
    C = 0.8 ** abs(np.subtract.outer(np.arange(n), np.arange(n)))
    squares = (rng.standard_normal((4 * DRAWS, n)) @ np.linalg.cholesky(C).T) ** 2
    total = squares.sum(1)
    nu = np.trace(C) ** 2 / np.trace(C @ C)
    variance(24, "squares with memory, by their freedom", 2 * np.trace(C) ** 2 / nu, total, 0.02)


def window_with_memory():
    tau, t, delta, per = 0.3, 1.0, 1.4, 200
    x = autoregressive(np.exp(-1 / (per * tau)), DRAWS, int((delta + t) * per))
    first, second = x[:, : int(t * per)].mean(1), x[:, int(delta * per) :].mean(1)
    v = (1 - tau / t * (1 - np.exp(-t / tau))) / t
    r = tau / t * (1 - np.exp(-t / tau)) ** 2 * np.exp(-(delta - t) / tau) / (2 * t * v)
    variance(29, "the mean over a window", 2 * tau * v, first, 0.02)
    found = np.corrcoef(first, second)[0, 1]
    holds(29, "neighbours, as 1 + r", 1 + r, 1 + found, 1 / np.sqrt(DRAWS), 0)


def between_campaigns():
    u, B = np.array([1, 1.5, 2, 1, 0.7, 1.2, 0.9, 1.4]), 4.0
    y = rng.standard_normal((DRAWS, 8)) * np.sqrt(u ** 2 + B)
    low, high = np.zeros(DRAWS) - 0.4, np.full(DRAWS, 200.0)  # below 0, where the squares are too few
    for _ in range(60):
        middle = 0.5 * (low + high)
        w = 1 / (u ** 2 + middle[:, None])
        many = (w * (y - ((w * y).sum(1) / w.sum(1))[:, None]) ** 2).sum(1) > 7
        low, high = np.where(many, middle, low), np.where(many, high, middle)
    holds(32, "scatter between campaigns", middle.mean(), B, middle.std() / B / np.sqrt(DRAWS), 0.03)


def triangle():
    for cycles, tolerated in [(0.3, 0), (0.9, 0)]:  # in steps of the grid
        s = np.linspace(-1, 1, 2001)
        phase = rng.uniform(0, 2 * np.pi, DRAWS)
        passed = np.trapz(np.cos(2 * np.pi * cycles * s + phase[:, None]) * (1 - abs(s)), s)
        variance(39, f"what passes of {cycles:g}/d", np.sinc(cycles) ** 4 / 2, passed, 0.02)


def thrust_factor():
    n, rho = 4000, 0.9
    x = 9.8 + autoregressive(0.99, n)
    e = 0.4 * autoregressive(rho, DRAWS, n)
    w = 0.999 ** np.arange(n)[::-1]
    factor = (e + x) @ (w * x) / (w @ x ** 2)
    left = e - (factor - 1)[:, None] * x
    s2 = (left ** 2 @ w) / w.sum()
    found = (left[:, 1:] * left[:, :-1]) @ w[1:] / (left ** 2 @ w)
    variance(41, "the factor in flight", s2 * (1 + found) / (1 - found) * (w ** 2 @ x ** 2) / (w @ x ** 2) ** 2, factor, 0.08)


def number_of_the_verdict():
    b, u = 0.7, 1.0
    q = np.linspace(0, 5, 500001)
    q = q[np.searchsorted(norm.cdf((q - b) / u) - norm.cdf((-q - b) / u), 0.95)]
    share(27, "the number holds", abs(b + u * rng.standard_normal(20 * DRAWS)) <= q, 0.95, 0)


for simulated in (mean_with_memory, mean_that_alternates, shared_zero, noise_within_a_run, scatter_of_runs, sum_of_few, line,
                  between_knots, freedom_of_residuals, window_with_memory, between_campaigns, triangle, thrust_factor,
                  number_of_the_verdict):
    simulated()
sys.exit(failed)
