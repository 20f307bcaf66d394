"""Errors of torques from the residual files of `cft-ident validate -o`, recomputed with numpy and scipy alone.

Usage: metric.py ROW.json FILTER [FROM..TO] OLS.csv DEFAULT.csv DIAGNOSED.csv
FILTER is none, butter:ORDER:HZ or cheby:ORDER:RIPPLE:HZ, run forward and backward over torques and residuals alike;
FROM..TO are seconds of the log's clock. ROW.json comes with `machine`, `data`, `error` ("all", "rms of joints" or a
joint's name) and `published` [%], and gets the errors of the three models.
"""

import json
import sys

import numpy as np
from scipy.signal import butter, cheby1, sosfiltfilt


def errors(file, kind, span):
    """Norm of the filtered residual over that of the filtered torque: of each joint, and of all together."""
    x = np.genfromtxt(file, delimiter=",", names=True, deletechars="")
    names = [n[9:] for n in x.dtype.names if n.startswith("residual_")]
    pair = np.array([[x[k + n] for n in names] for k in ("residual_", "tau_")])
    step = np.median(np.diff(x["t"]))
    design, *numbers = kind.split(":")
    order, *band, hz = [float(n) for n in numbers] or [0, 0]
    sos = {"butter": butter, "cheby": cheby1, "none": None}[design]
    sos = sos and sos(int(order), *band, hz, fs=1 / step, output="sos")
    pieces = np.split(np.arange(len(x)), 1 + np.flatnonzero(np.diff(x["t"]) > 1.5 * step))
    pieces = [p for p in pieces if len(p) > 60]
    smooth = [sosfiltfilt(sos, pair[:, :, p]) if design != "none" else pair[:, :, p] for p in pieces]
    t = np.concatenate([x["t"][p] for p in pieces])
    kept = np.concatenate(smooth, axis=2)[:, :, (t >= span[0]) & (t <= span[1])]
    square = (kept**2).sum(axis=2)
    return dict(zip(names, np.sqrt(square[0] / square[1]))), np.sqrt(square[0].sum() / square[1].sum())


def main():
    file, kind, *rest = sys.argv[1:]
    span = [float(s) for s in rest.pop(0).split("..")] if ".." in rest[0] else [-np.inf, np.inf]
    row = json.load(open(file))
    found = [errors(one, kind, span) for one in rest]
    of = {
        "all": lambda joints, together: together,
        "rms of joints": lambda joints, together: np.sqrt(np.mean(np.square(list(joints.values())))),
    }.get(row["error"], lambda joints, together: joints[row["error"]])
    for name, (joints, together) in zip(["plain least squares", "default", "after diagnose"], found):
        row[name] = round(100 * float(of(joints, together)), 2)
    before, after = found[1][0], found[2][0]
    worse = [j for j in before if after[j] > 1.02 * before[j]]
    row["joints worse"] = f"{len(worse)} of {len(before)}"
    row["joints"] = {j: [round(100 * float(one[0][j]), 2) for one in found] for j in before}
    json.dump(row, open(file, "w"), indent=1)
    print({k: v for k, v in row.items() if k != "joints"})


if __name__ == "__main__":
    main()
