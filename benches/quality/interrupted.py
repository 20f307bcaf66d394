"""kill -9 at random moments of a run: every file is there whole, or not at all, and the next run is not hindered.

    interrupted.py TOOL [RESULT.json] [--short]

Every command that writes, over files that are there already where it may. After each kill every file under
its own name must be byte for byte that of the run before or of a run that ended; what a killed run leaves has a name
that no command takes, and is gone after a run of a minute later.
"""

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import arm_logs
from tool import record

KILLS = 200
# of the commands that are no fit
KILLS_OF_OTHERS = 60
# what the commands below work on, made once
PREPARED = (
    "lsq first.csv -r arm.toml -o given.toml",
    "diagnose second.csv -m given.toml -o refined.toml",
    "reduce first.csv -r arm.toml -o first.cfi",
    "reduce second.csv -r arm.toml -o second.cfi",
    "simulate --servo sines -o first.json",
    "simulate --servo places -o second.json",
)
CASES = {
    "identify": "identify arm.toml {log}.csv -o run -q",
    "lsq": "lsq {log}.csv -r arm.toml -o model.toml --json out.json --report out.html -q",
    "validate": "validate {log}.csv -m given.toml -o out.csv --json out.json --report out.html -q",
    "diagnose": "diagnose {log}.csv -m given.toml -o out.toml --json out.json --report out.html -q",
    "payload": "payload {log}.csv -m given.toml -o out.toml --json out.json -q",
    "drive": "drive {log}.json -o out.toml --json out.json --report out.html -q",
    "tool": "tool {log}-wrenches.csv -o out.toml --json out.json --report out.html -q",
    "reduce": "reduce {log}.csv -r arm.toml -o out.cfi -q",
    "track": "track first.cfi second.cfi -o out.csv --json out.json --report out.html -q",
    "compare": "compare given.toml refined.toml {log}.csv --json out.json --report out.html -q",
    "convert": "convert {log}.csv out.mcap -q",
    "convert, compressed": "convert {log}.csv out.csv.gz -q",
    "torque": "torque {log}.csv -m given.toml -o out.csv -q",
    "watch": "watch {log}.csv -m given.toml -o out.csv -q",
    "export": "export -m given.toml --c out.h -q",
    "show": "show given.toml --report out.html -q",
    "simulate": "simulate --servo sines -o out.json -q",
    "excite": "excite --check motion.toml --json out.json --plot out.svg -q",
    "new": "new fresh --log {log}.csv -q",
    "example": "example ur10 -q",
}
# these write over nothing: what they wrote is taken away before each run
NEW_FILES = ("new", "example")


MOTION = Path(__file__).resolve().parents[2] / "configs/table3.toml"


def wrenches(path, seed):
    """A load of 8 N at a wrist, held in twelve poses."""
    rng, rows = np.random.default_rng(seed), []
    for pose in range(12):
        x, y, z, w = (quaternion := rng.standard_normal(4)) / np.linalg.norm(quaternion)
        weight = -8.0 * np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        moment = np.cross([0.0, 0.0, 0.05], weight)
        for k in range(40):
            noise = rng.standard_normal(6)
            rows.append([(pose * 40 + k) * 0.05, x, y, z, w, *weight + 0.02 * noise[:3], *moment + 0.002 * noise[3:]])
    np.savetxt(path, rows, "%.5f", ",", header="t,qx,qy,qz,qw,fx,fy,fz,mx,my,mz", comments="")


def contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def clear(folder, inputs):
    """Takes away what is no input."""
    for path in set(contents(folder)) - inputs:
        (folder / path).unlink()


def whole(tool, folder, line):
    began = time.monotonic()
    subprocess.run([tool, *line.split()], cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return contents(folder), time.monotonic() - began


def kills(tool, folder, name, many, chance):
    """So many kills; how many hit a run, and what was wrong after them."""
    lines = [CASES[name].replace("{log}", log) for log in ("first", "second")]
    inputs = set(contents(folder))
    new = name in NEW_FILES
    ends = []
    for line in lines:
        if new:
            clear(folder, inputs)
        ends.append(whole(tool, folder, line))
    length = max(seconds for _, seconds in ends)
    known = {path: {files[path] for files, _ in ends if path in files} for files, _ in ends for path in files}
    hit, left, faults, strays = 0, 0, [], []
    for k in range(many):
        if new:
            clear(folder, inputs)
        child = subprocess.Popen(
            [tool, *lines[k % 2].split()], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        # half of the kills in the last tenth, where files are written
        late = k % 4 < 2
        time.sleep(length * (chance.uniform(0.85, 1.05) if late else chance.uniform(0.0, 1.0)))
        child.kill()
        hit += child.wait() == -9
        after = contents(folder)
        for path, content in after.items():
            if path in known and content not in known[path]:
                faults.append(f"{name}, kill {k}: {path} is neither the old nor the new one")
        missing = [path for path in known if path not in after and (path in inputs or name != "identify" and not new)]
        if missing:
            faults.append(f"{name}, kill {k}: {missing} are gone")
        strays = [path for path in after if path not in known]
        left += bool(strays)
        named = [path for path in strays if not re.search(r"(^|/)\.cft-ident-\w+\.part$", path)]
        if named:
            faults.append(f"{name}, kill {k}: {named} could be taken for results")
    # a minute later
    for path in strays:
        os.utime(folder / path, (0, 0))
    if new:
        clear(folder, inputs | set(strays))
    again, _ = whole(tool, folder, lines[0])
    if any(content not in known.get(path, ()) for path, content in again.items()):
        faults.append(f"{name}: the run after all kills differs, or leaves {set(again) - set(known)}")
    return {"command": f"cft-ident {name}", "kills": many, "hit a run": hit, "left a part": left}, faults


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    tool = str(Path(words[0]).resolve())
    short = "--short" in sys.argv
    rows, faults = [], []
    for name in ("identify", "lsq") if short else CASES:
        many = 12 if short else KILLS if name in ("identify", "lsq") else KILLS_OF_OTHERS
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            (folder / "arm.toml").write_text(arm_logs.ROBOT)
            for seed, log in ((3, "first.csv"), (4, "second.csv")):
                arm_logs.write_csv(folder / log, arm_logs.drive(seed, 10.0))
            wrenches(folder / "first-wrenches.csv", 1)
            wrenches(folder / "second-wrenches.csv", 2)
            shutil.copy(MOTION, folder / "motion.toml")
            for line in PREPARED:
                whole(tool, folder, line + " -q")
            row, found = kills(tool, folder, name, many, random.Random(9))
            rows.append(row | {"files half written, lost or in the way": len(found)})
            faults += found
            print(rows[-1], flush=True)
    for fault in faults[:30]:
        print(fault)
    record(words, "kill -9 at random moments", "interrupted", rows, short)
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
