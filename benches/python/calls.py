"""Times of calls from Python: one sample of the UR10, arrays of samples, and a loop of 1 kHz.

    python benches/python/calls.py [RESULT.json]        (with the package installed: pip install ./python)
"""

import json
import sys
import tempfile
import time

import numpy as np

import cft_ident as ci

CALLS, ROWS, SECONDS = 10_000, 100_000, 5.0


def microseconds(call):
    """Median and 99th percentile of many calls, each timed alone."""
    times = np.empty(CALLS)
    for k in range(CALLS):
        begun = time.perf_counter_ns()
        call()
        times[k] = time.perf_counter_ns() - begun
    return [round(float(x) / 1e3, 2) for x in np.percentile(times, [50, 99])]


def late(state, sample):
    """Share of the samples of a loop of 1 kHz whose torque is not there within its millisecond."""
    begun, missed = time.perf_counter(), 0
    count = int(1000 * SECONDS)
    for k in range(count):
        while time.perf_counter() < begun + 1e-3 * k:
            pass
        state.step(1e-3, *sample)
        missed += time.perf_counter() > begun + 1e-3 * (k + 1)
    return missed / count


with tempfile.TemporaryDirectory() as folder:
    ci.example("ur10", folder + "/ur10")
    model = ci.lsq(folder + "/ur10/ur10.toml", folder + "/ur10/ur10.csv").model
chance = np.random.default_rng(1)
q, v, a = (chance.uniform(-1.0, 1.0, (ROWS, 6)) for _ in range(3))
one = q[0], v[0], a[0]
state = model.start(one[0])
calls = {
    "torque": lambda: model.torque(*one),
    "load": lambda: model.load_torque(*one),
    "friction": lambda: model.friction(one[1]),
    "gravity": lambda: model.gravity(one[0]),
    "step": lambda: state.step(1e-3, *one),
}
rows = [{"call": name, "median_us": times[0], "p99_us": times[1]} for name, times in
        ((name, microseconds(call)) for name, call in calls.items())]
begun = time.perf_counter()
model.torque(q, v, a)
result = {
    "study": "calls from Python, one sample of the UR10", "command": "python benches/python/calls.py", "calls": CALLS,
    "rows": rows, "array": {"rows": ROWS, "us_a_row": round(1e6 * (time.perf_counter() - begun) / ROWS, 3)},
    "late_at_1_kHz": late(state, one),
}
print(json.dumps(result, indent=1))
if len(sys.argv) > 1:
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)
