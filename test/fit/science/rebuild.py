"""K_T, its uncertainty and the number of the verdict of a campaign, from steps.csv by docs/science.md alone.

For campaigns of good steps alone, whose repetitions were mounted anew, on a bench of which nothing was measured. Numbers
of equations are those of the page. Usage: rebuild.py steps.csv …; a line each: K_T, u, number.
"""
import csv, itertools, math, sys

import numpy as np
from scipy.special import fdtrc, stdtr, stdtrit

ENDLESS = math.inf
LEAST_SPEED, FLOOR, MOST_TREND, LEVEL = 3000 * math.pi / 30, 0.1, 0.3, 0.05
CALIBRATION, CROSS_AXIS, ALIGNMENT, CLOCK = 0.006, 0.002, math.radians(2), 0.002  # assumed


def student(nu):
    return 1.959963984540054 if nu > 1e15 else stdtrit(nu, 0.975)


def p_of(t, nu):
    return 2 * stdtr(nu, -abs(t))


def joint(rows):
    """u and its degrees of freedom, of independent (u, ν)."""
    u = math.sqrt(sum(one * one for one, _ in rows))
    spread = sum(one ** 4 / nu for one, nu in rows)
    return u, u ** 4 / spread if spread > 0 else ENDLESS


class Run:
    def __init__(self, rows):
        number = lambda key: np.array([float(row.get(key) or "nan") for row in rows])
        self.step, self.w, self.T = number("step"), number("speed_rad_s"), number("thrust_n")
        self.x = self.w ** 2
        self.zero_u = np.nan_to_num(number("zero_u_n"))
        self.begin, self.end = number("window_begin_s"), number("window_end_s")
        own = number("zero_moved_n")[-1]
        self.moved2 = (np.ptp(number("zero_n")) if math.isnan(own) else own) ** 2
        self.noise2 = (2 * self.zero_u.min()) ** 2  # n² of (9): halfway both count half
        self.k = self.x @ self.T / (self.x @ self.x)  # (12)
        u, sd, n = number("thrust_u_n"), number("thrust_sd_n"), np.maximum(1, number("thrust_samples"))
        self.u = np.where(np.isnan(u), sd / np.sqrt(n), np.sqrt(np.maximum(0, u ** 2 - self.zero_u ** 2)))

    def zero_error(self, weight, moved2):
        """(8) for these weights of the steps."""
        w, middle = weight / weight.sum(), 0.5 * (self.begin + self.end)
        begin, span = self.begin.min(), self.end.max() - self.begin.min()
        s, mean = (middle - begin) / span, w @ (middle - begin) / span
        first, last = middle.argmin(), middle.argmax()
        half = np.abs(middle - 0.5 * (middle[first] + middle[last])).argmin()
        at = [first, half, last]
        measured = np.polynomial.Polynomial.fit(middle[at], self.zero_u[at] ** 2, 2)(begin + mean * span)
        wander = w @ np.minimum.outer(s, s) @ w - mean ** 2
        return math.sqrt(max(0.0, measured) + moved2 * max(0.0, wander))

    def line(self):
        """Offset and slope of T on x, and what one newton of each step changes of the offset."""
        n, x, xx = len(self.x), self.x.sum(), self.x @ self.x
        det = n * xx - x * x
        in_offset = (xx - x * self.x) / det
        self.leverage = (xx - 2 * x * self.x + n * self.x ** 2) / det
        return in_offset @ self.T, (n * (self.x @ self.T) - x * self.T.sum()) / det, in_offset


class Angle:
    """The runs of one occlusion."""

    def __init__(self, phi, runs, wandered2):
        self.phi, self.runs, self.n = phi, runs, len(runs)
        x, T = (np.concatenate([getattr(run, name) for run in runs]) for name in ("x", "T"))
        self.k, self.per_n = x @ T / (x @ x), x.sum() / (x @ x)
        self.z = np.array([run.zero_error(run.x, wandered2(run)) for run in runs])
        lines = [run.line() for run in runs]
        rest = np.array([run.T - a - b * run.x for run, (a, b, _) in zip(runs, lines)])
        left = np.maximum(0.1, 1 - np.mean([run.leverage for run in runs], axis=0))
        s2, spare = rest.var(axis=0, ddof=1) / left, rest.shape[1] / (rest.shape[1] - 2)
        part, xx = np.mean([run.x for run in runs], axis=0) ** 2, np.mean([run.x @ run.x for run in runs])
        self.a = part @ s2 / xx ** 2  # (13)
        self.a_freedom = part.sum() ** 2 / (part ** 2).sum() * (self.n - 1) / spare
        self.offset = np.array([a for a, _, _ in lines])
        in_offset = np.mean([one for _, _, one in lines], axis=0) ** 2
        offset_z = np.array([run.zero_error(one, wandered2(run)) for run, (_, _, one) in zip(runs, lines)])
        self.b = in_offset @ s2 + offset_z ** 2
        self.shares = (np.array([run.k for run in runs]) / self.k,  # and their variance, and what a newton changes
                       (self.a + (self.z * self.per_n) ** 2) / self.k ** 2, np.full(self.n, self.per_n / self.k))
        self.z_mean = math.sqrt((self.z ** 2).sum()) / self.n


def scatter(samples, averaged=True):
    """(15) and (16): τ, its ν, ζ, its ν. samples: freedom, squares, known, of τ², of ζ²."""
    f, S, known, *C = (np.array(column) for column in zip(*samples))
    known, C = np.maximum.reduce([known, 1e-6 * S, np.full(len(S), 1e-30)]), np.array(C)

    def fit(with_both):
        on = np.array(with_both, bool)
        v = np.array([max((S / f)[c > 0] / c[c > 0]) if one else 0.0 for one, c in zip(on, C)])
        for _ in range(400):
            w = 0.5 / (known + v @ C) ** 2
            I, g = (C * f * w) @ C.T, C @ ((S - f * known) * w)
            alone, following = np.maximum(0, g / I.diagonal()) * on, np.zeros(2)
            following = np.linalg.solve(I, g) if on.all() else alone
            if following.min() < 0:
                following = alone * (following > 0)
            before, v = v, 0.5 * (v + following)
            if (np.abs(v - before) <= 1e-14 * v).all():
                break
        V = known + v @ C
        return v, -(f @ np.log(V) + (S / V).sum()) - (2 * on.sum() if averaged else 0)

    models = [fit(on) for on in ((0, 0), (1, 0), (0, 1), (1, 1))]
    best = max(likelihood for _, likelihood in models)
    weights = [math.exp(0.5 * (one - best)) if averaged else one == best for _, one in models]
    v = np.average([one for one, _ in models], axis=0, weights=weights)
    I = 0.5 * (C ** 2 * f / (known + v @ C) ** 2).sum(axis=1)
    nu = np.where(v > 0, np.maximum(1.0, 2 * v ** 2 * I), [f[C[0] > 0].sum(), 0])
    return math.sqrt(v[0]), nu[0], math.sqrt(v[1]), nu[1]


def k_sample(share, variance, per_n):
    return len(share) - 1, ((share - share.mean()) ** 2).sum(), variance.mean(), 1.0, (per_n ** 2).mean()


def samples_of(angles):
    for one in angles:
        k = k_sample(*one.shares)
        yield k
        yield one.n - 1, ((one.offset - one.offset.mean()) ** 2).sum(), one.b.mean(), 0.0, one.b.mean() * k[4] / k[2]


def outlying(angles):
    """By how much the run that stands out most is off, by φ."""
    data = []
    for one in angles:
        k, xx = np.array([run.k for run in one.runs]), np.array([run.x @ run.x for run in one.runs])
        noise2 = np.array([((run.x * run.u) ** 2).sum() for run in one.runs])
        per_n, middle = np.array([run.x.sum() for run in one.runs]) / xx, np.median(k)
        data.append((k / middle, (noise2 / xx ** 2 + (one.z * per_n) ** 2) / middle ** 2, per_n / middle))
    count, found = sum(len(k) for k, _, _ in data), {}
    for i, (k, u2, per_n) in enumerate(data):
        for j in range(len(k)):
            keep = np.arange(len(k)) != j
            others = [(a[keep], b[keep], c[keep]) if i == m else (a, b, c) for m, (a, b, c) in enumerate(data)]
            t, _, z, _ = scatter([k_sample(*one) for one in others if len(one[0]) > 1], averaged=False)
            whole = u2 + t ** 2 + (z * per_n) ** 2
            nu = sum(len(one[0]) - 1 for one in others)
            p = count * p_of((k[j] - k[keep].mean()) / math.sqrt(whole[j] + whole[keep].sum() / keep.sum() ** 2), nu)
            away = abs(k[j] / k[keep].mean() - 1)
            if p < LEVEL and away > 0.003:
                found[angles[i].phi] = max(found.get(angles[i].phi, 0), away)
    return found


def weighted(rows, y, variance):
    w = 1 / np.sqrt(variance)
    A, b = rows * w[:, None], y * w
    scale = np.abs(A).max(axis=0)
    inverse = np.linalg.pinv(A / scale)
    beta = inverse @ b / scale
    return beta, (inverse @ inverse.T) / np.outer(scale, scale), y - rows @ beta


def against_speed(angles, usual):
    """(23), (24): per angle the trend (share per rad/s, u, ν), what the model lacks, and the levels."""
    for one in angles:
        one.zero_u = np.array([run.zero_error(np.ones_like(run.x), usual ** 2) for run in one.runs])
        one.free = not (one.zero_u > 0).all()
        one.mean_k, one.mean_x = np.mean([run.k for run in one.runs]), np.mean([run.x for run in one.runs], axis=0)
    thrust = np.concatenate([one.mean_k * one.mean_x for one in angles])
    rest = lambda run: run.T - run.line()[0] - run.line()[1] * run.x
    variance = np.concatenate([np.var([rest(run) for run in one.runs], axis=0, ddof=1) for one in angles])
    scale, average = thrust.max(), variance.mean()
    alpha, beta = average, 0.0
    for _ in range(5):
        rows = np.stack([np.ones_like(thrust), (thrust / scale) ** 2], 1)
        (a, b), _, _ = weighted(rows, variance, (alpha + beta * thrust ** 2) ** 2)
        alpha, beta = max(a, 0.01 * average), max(b, 0) / scale ** 2
    contrasts = []
    for one in angles:
        noise = lambda x: alpha + beta * (one.mean_k * x) ** 2
        w = np.mean([run.w for run in one.runs], axis=0)
        one.slow, one.fast = w.min(), w.max()
        residuals, one.trends, explained, wander = [], [], 0.0, 0.0
        for run, z in zip(one.runs, one.zero_u):
            c = one.mean_k * run.x * (run.w - 0.5 * (one.slow + one.fast)) / (one.fast - one.slow)
            rows, y, v = np.stack([run.x, np.ones_like(run.x), c], 1), run.T, noise(run.x)
            if not one.free:
                rows, y, v = np.vstack([rows, [0, 1, 0]]), np.append(y, 0), np.append(v, z * z)
            scales = np.sqrt(np.append(noise(one.mean_x), [] if one.free else z * z))
            residuals.append(weighted(rows[:, :2], y, v)[2] / scales)
            estimate, covariance, _ = weighted(rows, y, v)
            one.trends.append(estimate[2])
            explained += covariance[2, 2]
            if not one.free and usual > 0:
                n, steps = len(run.x), np.arange(len(run.x))
                influence, d = rows[:n] @ covariance[2] / noise(run.x), np.abs(np.subtract.outer(steps, steps)) / n
                wander += max(0.0, influence @ (1 / 12 - d / 2 + d * d / 2) @ influence) * usual ** 2
        one.trend_u, one.wander_share = math.sqrt((explained + wander) / one.n), wander / (explained + wander)
        one.residuals = r = np.array(residuals)
        contrasts += [(r[:j].sum(axis=0) - j * r[j]) / math.sqrt(j * (j + 1)) for j in range(1, one.n)]
    products = np.array([(u @ v) ** 2 for i, u in enumerate(contrasts) for v in contrasts[:i] if len(u) == len(v)])
    trace = np.mean([u @ u for u in contrasts])
    freedom = max(1.0, trace ** 2 / (products.mean() + math.sqrt(products.var(ddof=1) / len(products))))
    runs, nu = sum(one.n for one in angles), sum(one.n - 1 for one in angles)
    more = sum((one.n - 1) * np.var(one.trends, ddof=1) / one.trend_u ** 2 for one in angles) / nu
    for one in angles:
        value, u = np.mean(one.trends), one.trend_u * math.sqrt(more / one.n)
        change_freedom = 1 / (1 / nu + one.wander_share ** 2 / runs)
        one.trend = np.array([value, u]) / (one.fast - one.slow), change_freedom
        p = p_of(value / u, change_freedom)
        means, within = one.residuals.mean(axis=0), one.residuals.var(axis=0, ddof=1).sum()
        lack = fdtrc(freedom, freedom * (one.n - 1), one.n * (means ** 2).sum() / ((one.n - 1) * within) * (one.n - 1))
        one.lacks = 0.0
        if min(lack, p) < LEVEL / 2:
            rest = np.array([run.T - run.k * run.x for run in one.runs])
            excess = (rest.mean(axis=0) ** 2 - rest.var(axis=0, ddof=1) / one.n).sum()
            one.lacks = math.sqrt(max(0.0, excess / (one.mean_x ** 2).sum()))
        if p < LEVEL / 2:
            x, w = (np.concatenate([getattr(run, name) for run in one.runs]) for name in ("x", "w"))
            offset = (x * x) @ ((w - one.slow) / (one.fast - one.slow) - 0.5) / (x @ x)
            one.lacks = max(one.lacks, abs(value) * one.mean_k * math.sqrt(1 / 12 + offset ** 2))
        one.lacks *= -1 if value < 0 else 1


def common_trend(angles):
    value, u = np.array([one.trend[0] for one in angles]).T
    weight = (1 / u ** 2).sum()
    mean = (value / u ** 2).sum() / weight
    birge = max(1.0, (((value - mean) / u) ** 2).sum() / (len(angles) - 1)) if len(angles) > 1 else 1.0
    return mean, math.sqrt(birge / weight), max(1.0, sum(one.trend[1] for one in angles))


def folded(b, u):  # (27)
    inside = lambda q: 0.5 * (math.erf((q - b) / u / math.sqrt(2)) + math.erf((q + b) / u / math.sqrt(2)))
    low, high = b, b + 2 * u
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if inside(middle) < 0.95 else (low, middle)
    return high


class Verdict:
    def __init__(self, angles, sources, stray, plate, independent):
        self.sources, self.stray, self.plate, self.u = sources, stray, plate, independent
        self.phi, self.k = np.array([one.phi for one in angles]), np.array([one.k for one in angles])
        sigma = np.maximum(independent, 1e-3 * np.abs(self.k).max())[1:]
        J = np.stack([np.ones(len(sigma)), self.phi[1:]], 1) / sigma[:, None]
        self.line = np.linalg.inv(J.T @ J) @ (J.T / sigma)  # (20)
        w = np.concatenate([run.w for one in angles for run in one.runs])
        self.reference = (w ** 5).sum() / (w ** 4).sum()  # (25)
        value, u, nu = common_trend(angles)
        flown = value if p_of(value / u, nu) < LEVEL and abs(value * self.reference) <= MOST_TREND else 0.0
        self.speed = []
        for one in angles:
            w = np.mean([run.w for run in one.runs], axis=0)
            ratios = np.array([run.T / run.x for run in one.runs])
            k, error2 = ratios.mean(axis=0), ratios.var(axis=0, ddof=1) / one.n
            expected = one.k * (1 + flown * (w - self.reference))
            excess = (w ** 4 @ ((k / expected - 1) ** 2 - error2 / expected ** 2)) / (w ** 4).sum()
            reach = max(w.max() - self.reference, self.reference - w.min())
            self.speed.append((max(math.sqrt(max(0.0, (value - flown) ** 2 - u ** 2)) * reach, math.sqrt(max(0.0, excess))), u * reach, nu))

    def between(self, i, j, share, phi):
        """Weights of the chord and of the other end of where k may lie."""
        unit, k = np.eye(len(self.k)), self.k
        chord = (1 - share) * unit[i] + share * unit[j]
        if i == j:
            return chord, chord
        rise = lambda a, width: width / (self.phi[a + 1] - self.phi[a]) * (unit[a + 1] - unit[a])
        on, left = phi - self.phi[i], self.phi[j] - phi
        beyond = 1.0 if j + 1 < len(k) else 1 - share
        aside = [rise(i - 1, on * beyond) - rise(i, on * beyond)] if i > 0 else []
        aside += [rise(i, left) - rise(j, left)] if j + 1 < len(k) else []
        other = chord + min(aside, key=lambda one: abs(one @ k))
        high, low = (unit[i], unit[j]) if k[i] > k[j] else (unit[j], unit[i])
        return chord, high if other @ k > high @ k else low if other @ k < low @ k else other

    def at(self, phi):
        j = int((self.phi >= phi - 1e-6).argmax())
        i = j if abs(self.phi[j] - phi) < 1e-6 else j - 1
        share = (phi - self.phi[i]) / (self.phi[j] - self.phi[i]) if i < j else 0.0
        line = np.concatenate([[0], np.array([1, phi]) @ self.line])
        factor = 1.0 if phi <= 0 else min(1.0, max(FLOOR, line @ self.k / self.k[0]))
        if factor <= FLOOR:
            return None
        flown, flies = self.k[0] * factor, np.eye(len(self.k))[0] if factor >= 1 else line
        chord, other = self.between(i, j, share, phi)
        noise = lambda w: math.sqrt(((w * self.u) ** 2).sum()) / flown
        near, far = (math.sqrt(max(0.0, (end @ self.k / flown - 1) ** 2 - noise(end - flies) ** 2)) for end in (chord, other))
        off, end = (far, other) if far > near else (near, chord)
        speed = self.speed[i] if self.speed[i][0] > self.speed[j][0] else self.speed[j]
        rows = []
        for effects, nu, common in self.sources:
            part = end / flown * effects
            if isinstance(nu, list):
                rows.append(joint(list(zip(np.abs(part), nu))))
            else:
                rows.append((abs(part.sum()) if common else math.sqrt((part ** 2).sum()), nu))
        u, nu = joint(rows + [(speed[1], speed[2])])
        b = off + speed[0] + max(self.stray.get(self.phi[i], 0), self.stray.get(self.phi[j], 0))
        b += self.plate if phi < self.phi[1] else 0
        return folded(b, u * student(nu) / student(ENDLESS))  # (26)

    def number(self):
        each = map(self.at, sorted(set(self.phi) | {0.01} | {self.phi[-1] * i / 60 for i in range(1, 60)}))
        return max(itertools.takewhile(lambda here: here is not None, each))


def rebuild(path):
    by_run = {}
    for row in csv.DictReader(open(path)):
        if float(row["commanded_speed_rad_s"]) >= LEAST_SPEED * (1 - 1e-9):
            by_run.setdefault((float(row["occlusion_deg"]), int(row["repetition"])), []).append(row)
    runs = {key: Run(rows) for key, rows in by_run.items()}
    usual2 = np.mean([run.moved2 for run in runs.values()])
    walk2 = usual2 - np.mean([run.noise2 for run in runs.values()])
    wandered2 = lambda run: max(0.0, 0.5 * (walk2 + run.moved2 - run.noise2))  # (9)
    phis = sorted({key[0] for key in runs})
    angles = [Angle(phi, [run for key, run in sorted(runs.items()) if key[0] == phi], wandered2) for phi in phis]
    t, t_freedom, z, z_freedom = scatter(list(samples_of(angles)))
    n, k = np.array([one.n for one in angles]), np.array([one.k for one in angles])
    told, beyond = sum(one.z_mean ** 2 for one in angles), (z * z / n).sum()
    spread = (told ** 2 / len(runs) if usual2 > 0 else 0) + (beyond ** 2 / z_freedom if beyond > 0 else 0)
    zero_freedom = (told + beyond) ** 2 / spread if spread > 0 else ENDLESS
    noise = np.array([math.sqrt(one.a / one.n) for one in angles])
    zero = np.array([math.hypot(one.z_mean, z / math.sqrt(one.n)) * one.per_n for one in angles])
    independent = np.sqrt(noise ** 2 + zero ** 2 + (t * k) ** 2 / n)  # (17)
    against_speed(angles, math.sqrt(usual2))
    sources = [(noise, [one.a_freedom for one in angles], False),  # effects, ν (or one of each φ), common
               (t * k / np.sqrt(n), t_freedom if t_freedom > 0 else ENDLESS, False), (zero, zero_freedom, False)]
    sources += [(u * k, ENDLESS, True) for u in (CALIBRATION, CROSS_AXIS, ALIGNMENT ** 2 / math.sqrt(2), -2 * CLOCK)]
    u_of_K_T = math.sqrt(sum(effects[0] ** 2 for effects, _, _ in sources) + angles[0].lacks ** 2)  # (18)
    fall, degrees = k[0] - k[1], angles[1].phi
    apart = math.sqrt(sum((e[0] - e[1]) ** 2 if common else e[0] ** 2 + e[1] ** 2 for e, _, common in sources)
                      + (angles[0].lacks - angles[1].lacks) ** 2)
    steep = (k[1] - k[-1]) / (angles[-1].phi - degrees) * degrees
    plate = (steep - fall) / k[0] if steep > 6 * apart and fall + 2 * apart < steep / 2 else 0.0
    stray = {phi: share / n[phis.index(phi)] for phi, share in outlying(angles).items()}
    return k[0], u_of_K_T, Verdict(angles, sources, stray, plate, independent).number()


if __name__ == "__main__":
    for path in sys.argv[1:]:
        print(*("%.17g" % value for value in rebuild(path)))
