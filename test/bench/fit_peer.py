"""What a careful user would write with numpy and scipy for the same two tasks: the peer of kphi_fit_bench.

fit_peer.py fit STEPS.csv       robust k per occlusion with its covariance, then the weighted line; JSON on stdout
"""
import json
import sys
import time


def fit(path):
    import csv
    import numpy as np
    from scipy.optimize import curve_fit, least_squares
    with open(path) as file:
        rows = [(float(r["occlusion_deg"]), float(r["speed_rad_s"]), float(r["thrust_n"]), float(r["commanded_speed_rad_s"]))
                for r in csv.DictReader(file)]
    data = np.array(rows)
    data = data[data[:, 3] >= 3000 * np.pi / 30]
    table = []
    for phi in np.unique(data[:, 0]):
        x, t = data[data[:, 0] == phi, 1] ** 2, data[data[:, 0] == phi, 2]
        k0 = (x * t).sum() / (x * x).sum()
        sigma = 1.4826 * np.median(np.abs(t - k0 * x))
        scale = x.max() / t.max()
        solution = least_squares(lambda p: (t - p[0] * x / scale) / sigma, [k0 * scale], loss="huber", f_scale=1.345)
        r = solution.fun
        psi = np.clip(r, -1.345, 1.345)
        inner = np.mean(np.abs(r) <= 1.345)
        variance = (psi ** 2).sum() / (len(t) - 1) / inner ** 2
        design = x / scale / sigma
        table.append((phi, solution.x[0] / scale, np.sqrt(variance / (design ** 2).sum()) / scale))
    table = np.array(table)
    occluded = table[table[:, 0] > 0]
    unit = table[0, 1]
    line, covariance = curve_fit(lambda p, a, b: a + b * p, occluded[:, 0], occluded[:, 1] / unit,
                                 sigma=occluded[:, 2] / unit, absolute_sigma=True)
    print(json.dumps({"K_T": table[0, 1], "table": table.tolist(), "line": (line * unit).tolist(),
                      "covariance": (covariance * unit ** 2).tolist()}))


fit(sys.argv[2])
