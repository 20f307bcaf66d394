"""What single steps of a protocol are worth, where a row of the table is above the published figure.

Usage: steps.py TOOL RESULT.json
Each line changes one step against the line of its machine that is "as in the table": the filter of fit and error, or the
rows that count. Three fits: plain least squares, the default without physical limits, the default.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from metric import errors

tool, result = sys.argv[1:]
root = pathlib.Path(__file__).resolve().parents[2]
data = root.parent / "shared" / "data"
FITS = {
    "plain least squares": ["--unconstrained", "--estimator", "ols"],
    "weighed, links free": ["--unconstrained"],
    "default": [],
}


def filtered(robot, lines):
    """The robot file with other lines of its filter."""
    head, _, rest = robot.partition("[filter]")
    for line in lines:
        key = line.split(" = ")[0]
        rest, found = re.subn(rf"(?m)^{key} = .*$", line, rest, count=1)
        rest = rest if found else f"\n{line}{rest}"
    return f"{head}[filter]{rest}"


def fits(robot, logs, judged, work):
    """Residual files of the fits of a robot file to logs, on a log."""
    file = work / "robot.toml"
    file.write_text(robot)
    for name, options in FITS.items():
        model, out = work / "model.toml", work / f"{name}.csv"
        run([tool, "lsq", *map(str, logs), "-r", file, "-o", model, "-q", *options])
        run([tool, "validate", str(judged), "-m", model, "-o", out, "-q"])
        yield name, out


def run(command):
    subprocess.run(command, check=True, capture_output=True, cwd=root)


def parallel(hz):
    return f"butter:4:{hz}", [f"cutoff_hz = {hz}.0"]


def machine(name, robot, logs, judged, steps, joint=None):
    for step, (kind, lines), span in steps:
        with tempfile.TemporaryDirectory() as folder:
            row = {"machine": name, "step": step}
            for fit, out in fits(filtered(robot, lines), logs, judged, pathlib.Path(folder)):
                joints, together = errors(out, kind, span)
                row[fit] = f"{100 * (joints[joint] if joint else together):.2f}"
            print(row, flush=True)
            yield row


ALL = [-np.inf, np.inf]
coupling = '\n[[robot.coupling]]\nmotor = "q6"\nother = "q5"\nratio = 1.0\n'
tx40 = (root / "configs/tx40.toml").read_text() + coupling
log = data / "tx40" / "tx40_joint.csv"
decimate = ['kind = "chebyshev-decimate"', "order = 8", "ripple_db = 0.05", "decimation = 100"]
rows = list(
    machine(
        "Staubli TX40",
        tx40,
        [log],
        log,
        [
            ("as in the table: Butterworth of order 4, 20 Hz", parallel(20), ALL),
            ("the filter of decimation to 50 Hz", ("cheby:8:0.05:20", decimate), ALL),
            ("the same, rows up to 7.4 s, where joints come to rest", ("cheby:8:0.05:20", decimate), [0, 7.4]),
            ("Butterworth of order 4, 10 Hz", parallel(10), ALL),
        ],
    )
)
log = data / "panda" / "panda_exciting.csv"
rows += machine(
    "Franka Emika Panda",
    (root / "configs/panda.toml").read_text(),
    [log],
    log,
    [
        ("as in the table: Butterworth of order 4, 10 Hz", parallel(10), ALL),
        ("5 Hz", parallel(5), ALL),
        ("2 Hz", parallel(2), ALL),
    ],
)
judged = data / "pendulum" / "061157.csv"
logs = sorted(set((data / "pendulum").glob("*.csv")) - {judged})
for joint in ["q1", "q2"]:
    rows += machine(
        f"double pendulum, {joint}",
        (root / "configs/pendulum.toml").read_text(),
        logs,
        judged,
        [
            ("as in the table: Butterworth of order 4, 20 Hz", parallel(20), ALL),
            ("10 Hz", parallel(10), ALL),
            ("5 Hz", parallel(5), ALL),
        ],
        joint,
    )
study = {
    "study": "single steps of a protocol and the errors by them [%]",
    "command": f"benches/published/steps.py target/release/cft-ident {result}",
    "rows": rows,
}
json.dump(study, open(result, "w"), indent=1)
