#!/usr/bin/env python3
"""What `diagnose` does to measured data that nobody used, before and after on the same rows.

Usage: run.py TOOL RESULT.json [--label NAME] [--only TEXT] [--jobs N] [--diagnose TOOL]

Every measured robot with logs enough is rotated: each log, or third of a log, is unseen in turn, and the others are
fitted. `lsq` writes the model before, `diagnose` the model after, without held-out data; `validate` gives the errors of
both on the unseen part, of the rows in which each joint moves and of all. --diagnose takes another build for `diagnose`
alone, --named-only what is named alone.
Cases that RESULT.json (committed: result.json beside this file) holds under the label are not run again.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
THIRDS = ["@0..33%", "@33..67%", "@67..100%"]


def logs(folder, names):
    return [str(DATA / folder / name) for name in names]


def rotations():
    """(machine, robot file, fitted logs, unseen log)"""
    for machine, log in [("ur10", "ur10_exciting.csv"), ("panda", "panda_exciting.csv"), ("tx40", "tx40_joint.csv")]:
        path = measured(machine, log)
        if not path:
            continue
        for k, unseen in enumerate(THIRDS):
            others = [path + span for span in THIRDS if span != unseen]
            yield machine, f"configs/{machine}.toml", others, path + unseen
            yield machine, f"configs/{machine}.toml", [path + THIRDS[(k + 1) % 3]], path + unseen
    whole = {
        "kr300": ["A.csv", "B.csv", "C.csv"],
        "pendulum": sorted(p.name for p in (DATA / "pendulum").glob("*.csv"))[:4],
    }
    for machine, names in whole.items():
        paths = logs(machine, names)
        for k, unseen in enumerate(paths):
            others = [p for p in paths if p != unseen]
            yield machine, f"configs/{machine}.toml", others, unseen
            yield machine, f"configs/{machine}.toml", [paths[(k + 1) % len(paths)]], unseen
    emps = logs("emps", ["emps_id.csv", "emps_pulses_val.csv"])
    yield "emps", "configs/emps.toml", emps[:1], emps[1]
    yield "emps", "configs/emps.toml", emps[1:], emps[0]
    motor = str(DATA / "bldc-cogging" / "speed_test1.txt")
    yield "motor", "configs/bldc.toml", [motor + "@15.2..23s"], motor + "@23..29.5s"


def measured(machine, name):
    for path in [DATA / machine / name, *sorted((DATA / machine).glob("*.csv*"))]:
        if path.exists():
            return str(path)
    return None


def name_of(machine, fitted, unseen):
    short = lambda p: pathlib.Path(p).name
    return f"{machine}: {' + '.join(map(short, fitted))} -> {short(unseen)}"


def run(command):
    done = subprocess.run([str(c) for c in command], cwd=ROOT, capture_output=True, text=True)
    return done.returncode, done.stderr


def errors(tool, log, model, work):
    out = work / "errors.json"
    code, error = run([tool, "validate", log, "-m", model, "--json", out, "-q"])
    if code not in (0, 2):
        raise RuntimeError(error)
    joints = json.loads(out.read_text())["joints"]
    moving = {j["joint"]: j.get("relative_error_moving") or j["relative_error"] for j in joints}
    return moving, {j["joint"]: j["relative_error"] for j in joints}


def case(args, machine, robot, fitted, unseen):
    row = {"case": name_of(machine, fitted, unseen), "machine": machine, "label": args.label}
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        before, after, found = work / "before.toml", work / "after.toml", work / "found.json"
        code, error = run([args.tool, "lsq", *fitted, "-r", robot, "-o", before, "-q"])
        if code == 0:
            diagnose = args.diagnose or args.tool
            alone = ["--named-only"] if args.named_only else []
            code, error = run([diagnose, "diagnose", *fitted, "-m", before, "-o", after, "--json", found, "-q", *alone])
        if code != 0:
            return {**row, "exit": code, "error": error.strip()[:400]}
        document = json.loads(found.read_text())
        steps = document["steps"]
        row["written"] = [[s["effect"], s["joint"], s["status"], round(s["shrinkage"], 3)] for s in steps if s["written"]]
        predicting = document.get("prediction_only", [])
        row["predicting"] = [[t["effect"], t["joint"], round(t["shrinkage"], 3)] for t in predicting]
        row["seen"] = [[s["effect"], s["joint"], round(s["shrinkage"], 3)] for s in steps if not s["written"]]
        try:
            row["before"], row["before_all"] = errors(args.tool, unseen, before, work)
            row["after"], row["after_all"] = errors(args.tool, unseen, after, work)
        except RuntimeError as error:
            return {**row, "exit": 3, "error": str(error).strip()[:400]}
        return {**row, "exit": 0}


def summary(rows):
    for label in dict.fromkeys(r["label"] for r in rows):
        own = [r for r in rows if r["label"] == label and r["exit"] == 0]
        print(f"{label}: {len(own)} cases")
        for machine in [*dict.fromkeys(r["machine"] for r in own), "all"]:
            of = [r for r in own if machine in ("all", r["machine"])]
            print(f"   {machine:9}", "; ".join(filter(None, [gains(of, ""), gains(of, "_all"), terms(of)])))
        for name, joint, before, after in sorted(ratios(own, ""), key=lambda x: x[2] / x[3])[:8]:
            if after > 1.02 * before:
                print(f"   {name}, {joint}: {before:.2%} -> {after:.2%}")


def ratios(rows, which):
    """Case, joint, error before and after, of joints that the model explains."""
    all_of = [(r["case"], j, e, r["after" + which][j]) for r in rows for j, e in r.get("before" + which, {}).items()]
    return [x for x in all_of if x[2] < 0.5]


def gains(rows, which):
    own = sorted(1 - after / before for _, _, before, after in ratios(rows, which))
    if not own:
        return ""
    worse = sum(g < -.02 for g in own)
    rows_of = "all rows" if which else "in motion"
    return f"{rows_of}: {len(own)} joints, gain {sum(own) / len(own):.1%}, {worse} more than 2 % worse, worst {own[0]:.1%}"


def terms(rows):
    return f"{sum(len(r['written']) for r in rows)} named, {sum(len(r.get('predicting', [])) for r in rows)} for prediction only"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tool")
    parser.add_argument("result", type=pathlib.Path)
    parser.add_argument("--label", default="now")
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--diagnose")
    parser.add_argument("--named-only", action="store_true")
    args = parser.parse_args()
    rows = json.loads(args.result.read_text()) if args.result.exists() else []
    done = {(r["case"], r["label"]) for r in rows}
    cases = [c for c in rotations() if args.only in name_of(c[0], c[2], c[3])]
    cases = [c for c in cases if (name_of(c[0], c[2], c[3]), args.label) not in done]
    with ThreadPoolExecutor(args.jobs) as pool:
        for row in pool.map(lambda c: case(args, *c), cases):
            rows.append(row)
            args.result.write_text(json.dumps(rows, indent=1) + "\n")
            shown = row.get("error") or ", ".join(f"{e[0]} {e[1]} {e[-1]}" for e in row["written"] + row["predicting"])
            print(f"{row['case']}: {shown}", file=sys.stderr, flush=True)
    summary(rows)


if __name__ == "__main__":
    main()
