#!/usr/bin/env python3
"""Do the intervals of `drive` hold the truth? One log of 6 s of a simulated servo, its numbers drawn.

    coverage.py TOOL [RUNS [RESULT.json]]

Of each drive, motion and delay so many logs are simulated, each with an armature, a dry friction and a delay of its
own, and identified. Counted are the 95 % intervals that hold the truth, and the logs of which the right delay is named.
"""

import json
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

DRIVES = {"volts": ("json", ["--kp", "16"]), "torque": ("csv", ["--kp", "10", "--kd", "0.4"])}
MOTIONS = ("places", "sines")
DELAYS = ("command_delay", "loop_delay")
# what stands in the file of the truth under another name
ALSO = {"viscous": "damping"}


def truth_of(path):
    found = re.findall(r'name = "(\w+)"\n(?:joint = .*\n)?value = ([-\d.e]+)', path.read_text())
    return {name: float(value) for name, value in found}


def identified(tool, folder, drive, motion, delay, seed):
    """The parameters of one log with its truth, and whether the right delay is written."""
    kind, gains = DRIVES[drive]
    draw = random.Random(f"{drive} {motion} {delay} {seed}")
    numbers = {"armature": draw.uniform(0.01, 0.03), "coulomb": draw.uniform(0.03, 0.15), delay: draw.uniform(0.008, 0.025)}
    asked = ",".join(f"{name}={value:.5f}" for name, value in numbers.items())
    log = folder / f"log.{kind}"
    run = [tool, "simulate", "--servo", motion, *gains, "--seed", str(seed), "--drive", asked, "-o", log, "-q"]
    subprocess.run(run, check=True, capture_output=True)
    of = ["-r", folder / "log.urdf", "--command", "q_des_*", "--position", "q_*", *gains] if drive == "torque" else []
    run = [tool, "drive", log, *of, "-o", folder / "model.toml", "--json", "-", "-q"]
    found = json.loads(subprocess.run(run, check=True, capture_output=True, text=True).stdout)
    truth = truth_of(folder / "log.truth.toml")
    # a law without a delay has none of it
    truth = {**{name: 0.0 for name in DELAYS}, **truth}
    pairs = []
    for own in found["parameters"]:
        true = truth.get(own["name"], truth.get(ALSO.get(own["name"])))
        if own["interval_95"] and true is not None:
            low, high = own["interval_95"]
            pairs.append((own["name"], low <= true <= high, abs(own["value"] / true - 1) if true else None))
    written = [step["effect"] for step in found["steps"] if step["written"]]
    return pairs, delay.replace("_", "-") in written


def main():
    tool = Path(sys.argv[1]).resolve()
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    rows = []
    for drive in DRIVES:
        for delay in DELAYS:
            held, off, named = [], [], 0
            for motion in MOTIONS:
                for seed in range(1, runs // len(MOTIONS) + 1):
                    with tempfile.TemporaryDirectory() as folder:
                        pairs, right = identified(tool, Path(folder), drive, motion, delay, seed)
                    named += right
                    held += [holds for _, holds, _ in pairs]
                    off += [error for _, _, error in pairs if error is not None]
            off.sort()
            rows.append({
                "drive": drive, "late": delay.removesuffix("_delay"), "logs": runs // len(MOTIONS) * len(MOTIONS),
                "right delay named": named, "intervals": len(held), "hold the truth": f"{100 * sum(held) / len(held):.0f} %",
                "median error": f"{100 * off[len(off) // 2]:.2f} %", "largest error": f"{100 * off[-1]:.1f} %",
            })
            print(rows[-1], flush=True)
    if len(sys.argv) > 3:
        result = {"study": "intervals of drives", "command": "benches/drive/coverage.py TOOL", "rows": rows}
        Path(sys.argv[3]).write_text(json.dumps(result, indent=1) + "\n")


main()
