"""The TX40 fit with Pinocchio's regressor and numpy, beside that of `cft-ident lsq --estimator ols`.

Usage: compare.py DATA BUILD RESULT.json [CPP_REGRESSOR]
DATA holds the log and the URDF, BUILD the built tool and the results of its benchmark; CPP_REGRESSOR
is a program that prints seconds per sample (regressor.cpp).
Both read the first 7.4 s of the same log and process them alike (tx40.toml): positions through a 4th-order Butterworth at
100 Hz forward and backward, central differences twice, 0.1 s off each end, torque and every column through
a 4th-order Butterworth at 20 Hz forward and backward, 0.1 s off each end, every 25th row, ordinary
least squares. Base parameters are found here anew, by the same rule: a column that depends on those
before it is grouped into them.
"""

import json
import os
import subprocess
import sys
import time
import tomllib


def processor():
    """Processor time of this process and of those it waited for [s]."""
    own = os.times()
    return own.user + own.system, own.children_user + own.children_system


import numpy as np  # noqa: E402
import pinocchio as pin  # noqa: E402
from scipy.signal import butter, sosfiltfilt  # noqa: E402

folder, build, result_file = sys.argv[1:4]
urdf, log = f"{folder}/tx40_mdh_modified.urdf", f"{folder}/tx40_joint.csv"
model = pin.buildModelFromUrdf(urdf)
data = model.createData()
n = model.nv
# the columns of the log in one pass
table = np.loadtxt(log, delimiter=",", skiprows=1)
# afterwards joints rest, where the sign of the speed is that of a rounding error
table = table[table[:, 0] < 7.4]
t, q, tau = table[:, 0], table[:, 1 : 1 + n], table[:, 1 + n : 1 + 2 * n]
dt = (t[-1] - t[0]) / (len(t) - 1)

smooth = sosfiltfilt(butter(4, 100.0, fs=1 / dt, output="sos"), q, axis=0)
v = np.zeros_like(smooth)
a = np.zeros_like(smooth)
v[1:-1] = (smooth[2:] - smooth[:-2]) / (2 * dt)
a[1:-1] = (v[2:] - v[:-2]) / (2 * dt)
edge = round(0.1 / dt)
inside = slice(edge, len(t) - edge)
smooth, v, a, tau = smooth[inside], v[inside], a[inside], tau[inside]
rows = len(smooth)

# Pinocchio: m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the joint's frame
NAMES = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"]
ORDER = ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "mx", "my", "mz", "m"]
order = [10 * link + NAMES.index(name) for link in range(n) for name in ORDER]
names = [f"{name}{link + 1}" for link in range(n) for name in ORDER]
names += [f"Ia{j + 1}" for j in range(n)]


def regressors(q, v, a):
    out = np.empty((len(q), n, 10 * n))
    for k in range(len(q)):
        out[k] = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
    return out


def with_drives(y, a):
    drives = np.zeros((len(a), n, n))
    drives[:, range(n), range(n)] = a
    return np.concatenate([y[:, :, order], drives], axis=2)


loop = time.perf_counter()
y = regressors(smooth, v, a)
per_sample_python = (time.perf_counter() - loop) / rows
y = with_drives(y, a)

chance = np.random.default_rng(1)
state = [chance.uniform(-s, s, (200, n)) for s in (3.0, 2.0, 8.0)]
random = with_drives(regressors(*state), state[2]).reshape(-1, y.shape[2])
kept, basis = [], np.zeros((len(random), 0))
largest = np.linalg.norm(random, axis=0).max()
for j in range(random.shape[1]):
    column = random[:, j]
    rest = column.copy()
    for _ in range(2):
        rest -= basis @ (basis.T @ rest)
    # what no state shows is a column of the URDF's rounded angles
    shown = np.linalg.norm(column) > 1e-9 * largest
    if shown and np.linalg.norm(rest) > 1e-9 * np.linalg.norm(column):
        kept.append(j)
        basis = np.column_stack([basis, rest / np.linalg.norm(rest)])

p = len(kept)
columns = np.zeros((rows, n, p + 3 * n))
columns[:, :, :p] = y[:, :, kept]
for j in range(n):
    columns[:, j, p + 3 * j] = v[:, j]
    columns[:, j, p + 3 * j + 1] = np.sign(v[:, j])
    columns[:, j, p + 3 * j + 2] = 1.0
low = butter(4, 20.0, fs=1 / dt, output="sos")
take = slice(edge, rows - edge)
columns = sosfiltfilt(low, columns, axis=0)[take][::25]
tau = sosfiltfilt(low, tau, axis=0)[take][::25]
stacked = columns.transpose(1, 0, 2).reshape(-1, p + 3 * n)
target = tau.T.reshape(-1)
scale = np.linalg.norm(stacked, axis=0)
theta = np.linalg.lstsq(stacked / scale, target, rcond=None)[0] / scale
whole = processor()[0]

model_file = f"{build}/pinocchio_fit.toml"
command = [f"{build}/release/cft-ident", "lsq", f"{log}@0..7.4s", "-r", "benches/pinocchio/tx40.toml"]
command += ["--estimator", "ols", "--unconstrained", "-q", "--threads", "1", "-o", model_file]


def tool(*more):
    before = processor()[1]
    subprocess.run([*command, *more], check=True, capture_output=True)
    return processor()[1] - before


alone, ours = tool("--as-declared"), tool()

found = {}
for parameter in tomllib.load(open(model_file, "rb"))["parameter"]:
    joint = parameter.get("joint")
    found[f"{parameter['name']}:{joint}" if joint else parameter["name"]] = parameter["value"]
theirs = dict(zip([names[j] for j in kept], theta[:p]))
for j in range(n):
    for i, name in enumerate(["viscous", "coulomb", "offset"]):
        theirs[f"{name}:q{j + 1}"] = theta[p + 3 * j + i]
assert set(found) == set(theirs), sorted(set(found) ^ set(theirs))
# a difference in a parameter counts by what it does to the torque, over the torque's size
size = np.linalg.norm(target)
keys = [names[j] for j in kept]
keys += [f"{name}:q{j + 1}" for j in range(n) for name in ["viscous", "coulomb", "offset"]]
off = max(abs(found[k] - theirs[k]) * s / size for k, s in zip(keys, scale))
relative = max(abs(found[k] / theirs[k] - 1) for k in theirs)
result = {
    "pinocchio": pin.__version__,
    "numpy": np.__version__,
    "parameters": len(theirs),
    "samples": len(t),
    "largest_difference_of_torque": off,
    "largest_relative_difference": relative,
    "python_s": whole,
    "tool_s": ours,
    "tool_alone_s": alone,
    "python_regressor_s_per_sample": per_sample_python,
}


def benchmark(name):
    estimate = f"{build}/criterion/regressor of six joints/{name}/new/estimates.json"
    return json.load(open(estimate))["median"]["point_estimate"] * 1e-9 / 1000


result["tool_regressor_s_per_sample"] = benchmark("regressor")
result["tool_regressor_and_factor_s_per_sample"] = benchmark("regressor and R factor")
if len(sys.argv) > 4:
    program = subprocess.run([sys.argv[4]], capture_output=True, text=True, check=True)
    result["cpp_regressor_s_per_sample"] = float(program.stdout)


def line(what, beside, theirs, mine, unit):
    scale = {"s": 1.0, "us": 1e6}[unit]
    times = [f"{x * scale:.3g} {unit}" for x in (theirs, mine)]
    return {"what": what, "beside": beside, "it takes": times[0], "cft-ident": times[1], "ratio": f"{theirs / mine:.1f}"}


python = f"Pinocchio {pin.__version__} in Python, numpy {np.__version__}"
regressor = "regressor of six joints, a sample"
result["rows"] = [
    line("log of 37 thousand rows to 58 parameters, whole process", python, whole, ours, "s"),
    line("the same without the check of the set-up (`--as-declared`)", python, whole, alone, "s"),
    line(regressor, python, per_sample_python, result["tool_regressor_s_per_sample"], "us"),
]
if "cpp_regressor_s_per_sample" in result:
    cpp, mine = result["cpp_regressor_s_per_sample"], result["tool_regressor_s_per_sample"]
    result["rows"].append(line(regressor, f"Pinocchio {pin.__version__} in C++", cpp, mine, "us"))
result["study"] = (
    "the TX40 fit beside Pinocchio's, processor time on one thread; rows of joints at rest, which `lsq` leaves out, "
    f"move the torques by {100 * off:.2f} % of their size at most"
)
result["command"] = "benches/pinocchio/run.sh"
json.dump(result, open(result_file, "w"), indent=1)
print(json.dumps(result, indent=1))
