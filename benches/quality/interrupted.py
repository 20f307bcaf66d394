"""kill -9 at random moments of a run: every file is there whole, or not at all, and the next run is not hindered.

    interrupted.py TOOL [RESULT.json] [--short]

`identify` from a robot and its log, and `lsq -o` over a model that is there already. After each kill every file under
its own name must be byte for byte that of the run before or of a run that ended; what a killed run leaves has a name
that no command takes, and is gone after a run of a minute later.
"""

import os
import random
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import arm_logs
from tool import record

KILLS = 200
CASES = {
    "identify": "identify arm.toml first.csv -o run -q",
    "lsq": "lsq {log} -r arm.toml -o model.toml --json out.json --report out.html -q",
}


def contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def whole(tool, folder, line):
    began = time.monotonic()
    subprocess.run([tool, *line.split()], cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return contents(folder), time.monotonic() - began


def kills(tool, folder, name, many, chance):
    """So many kills; how many hit a run, and what was wrong after them."""
    lines = [CASES[name].replace("{log}", log) for log in ("first.csv", "second.csv")]
    inputs = set(contents(folder))
    ends = [whole(tool, folder, line) for line in lines]
    length = max(seconds for _, seconds in ends)
    known = {path: {files[path] for files, _ in ends if path in files} for files, _ in ends for path in files}
    hit, left, faults, strays = 0, 0, [], []
    for k in range(many):
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
        missing = [path for path in known if path not in after and (path in inputs or name == "lsq")]
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
    again, _ = whole(tool, folder, lines[0])
    if any(content not in known.get(path, ()) for path, content in again.items()):
        faults.append(f"{name}: the run after all kills differs, or leaves {set(again) - set(known)}")
    return {"command": f"cft-ident {CASES[name].split()[0]}", "kills": many, "hit a run": hit, "left a part": left}, faults


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    tool = str(Path(words[0]).resolve())
    short = "--short" in sys.argv
    many = 12 if short else KILLS
    rows, faults = [], []
    for name in CASES:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            (folder / "arm.toml").write_text(arm_logs.ROBOT)
            for seed, log in ((3, "first.csv"), (4, "second.csv")):
                arm_logs.write_csv(folder / log, arm_logs.drive(seed, 10.0))
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
