#!/usr/bin/env python3
"""Logs as people have them: what the commands make of each, told apart as right, refused or wrong.

    cases.py TOOL FOLDER [NAME]...

FOLDER holds a URDF of the arm, `arm3.urdf`, a log that is in order, `good.csv`, and folders with a log each. Of each
log `new`, `inspect`, `lsq` and `identify` are run. A fit is right where its parameters are those of the log in order,
within four standard deviations and 3 %; what is refused names its way out, and lines for the robot file are tried.
"""

import concurrent.futures
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ENDS = (".csv", ".mcap", ".db3", ".bag", ".mat", ".json", ".npz", ".lvm", ".xml", ".yaml", ".parquet", ".gz", ".txt", ".xz", ".lz4")


def run(tool, folder, *words):
    done = subprocess.run([tool, *map(str, words)], cwd=folder, capture_output=True, text=True, timeout=600)
    return done.returncode, done.stderr + done.stdout


def fit(tool, folder, log, robot="a.toml"):
    status, text = run(tool, folder, "lsq", log, "-r", robot, "-o", "m.toml", "--json", "m.json", "-q")
    (folder / "m.toml").unlink(missing_ok=True)
    if status:
        return status, text, {}
    found = json.loads((folder / "m.json").read_text())
    return 0, text, {p["name"]: (p["value"], p["std"]) for p in found["parameters"] if p["value"] is not None}


def off(found, reference):
    """The parameter that is furthest off, by how much of what it may be."""
    worst = (0.0, "")
    for name, (value, std) in reference.items():
        if name not in found or std > 0.1 * abs(value):
            continue
        own, own_std = found[name]
        within = 4 * (std**2 + (own_std or 0) ** 2) ** 0.5 + 0.03 * abs(value)
        worst = max(worst, (abs(own - value) / within, f"{name} {own:.4g} for {value:.4g}"))
    return worst


def lines_of(text):
    return re.findall(r"`((?:rate_hz|stamp|time_unit|header_line|topic) = [^`]+)`", text)


def case(tool, root, reference, log):
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        urdf = next((u for u in [log.parent / "arm.urdf", root / "arm3.urdf"] if u.exists()), None)
        status, told = run(tool, folder, "new", "a", "--urdf", urdf, "--log", log)
        if status:
            return "refused", "new", told
        robot = (folder / "a.toml").read_text()
        checks = [line for line in robot.splitlines() if "CHECK IT" in line]
        seen, inspected = run(tool, folder, "inspect", log, "-r", "a.toml")
        status, text, found = fit(tool, folder, log)
        how = f"{len(checks)} to check"
        if status:
            for line in lines_of(text):
                (folder / "b.toml").write_text(robot.replace("\n[log]\n", f"\n[log]\n{line}\n", 1))
                again, _, found = fit(tool, folder, log, "b.toml")
                if not again and off(found, reference)[0] <= 1:
                    return "refused, way out works", line, text
            return "refused", "lsq", text
        ratio, worst = off(found, reference)
        shared = len(set(found) & set(reference))
        kind = "right" if ratio <= 1 and shared > len(reference) / 2 else "WRONG"
        refused = "error:" in inspected
        return kind + (", but inspect says error" if refused else ""), f"{how}; {worst}", text


def main():
    tool, root = os.path.abspath(sys.argv[1]), Path(sys.argv[2]).resolve()
    wanted = sys.argv[3:]
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        run(tool, folder, "new", "a", "--urdf", root / "arm3.urdf", "--log", root / "good.csv")
        status, text, reference = fit(tool, folder, root / "good.csv")
        if status:
            sys.exit(f"the log in order is refused: {text}")
    logs = []
    for folder in sorted(p for p in root.iterdir() if p.is_dir()):
        if wanted and not any(folder.name.startswith(name) for name in wanted):
            continue
        logs += sorted(p for p in folder.rglob("*") if p.is_file() and p.suffix in ENDS)
    counts = {}
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        jobs = [(log, pool.submit(case, tool, root, reference, log)) for log in logs]
        for log, job in jobs:
            try:
                kind, how, text = job.result()
            except Exception as error:
                kind, how, text = "failed", str(error), ""
            counts[kind] = counts.get(kind, 0) + 1
            print(f"{log.relative_to(root)}: {kind} ({how})")
            if not kind.startswith("right"):
                print("    " + "\n    ".join(text.strip().splitlines()[:8]))
    print(counts)
    sys.exit(1 if counts.get("WRONG") else 0)


if __name__ == "__main__":
    main()
