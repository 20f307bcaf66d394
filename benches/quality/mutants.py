#!/usr/bin/env python3
"""A sample of mutants of the core, drawn by a seed: how many the core's own tests notice.

    benches/quality/mutants.py CHECKOUT [NUMBER [RESULT.json [SEED]]]

CHECKOUT is one that nobody else works in (git worktree add CHECKOUT): mutants are written into it. Needs cargo-mutants,
which lists them, and cargo-nextest (cargo install cargo-mutants cargo-nextest --locked). Takes a quarter of a minute a
mutant; a run that is stopped goes on where it was, as long as the commit is the same.
"""

import json
import os
import random
import signal
import subprocess
import sys
from math import sqrt
from pathlib import Path

SEED = 61
ENDS = ("caught", "missed", "timeout", "unviable")
# compiled anew for every mutant: quickly, and only what the mutant changes
BUILD = {"CARGO_INCREMENTAL": "1", "CARGO_PROFILE_DEV_OPT_LEVEL": "1", "CARGO_PROFILE_DEV_DEBUG": "0"}
# many times what the sound tests take [s]
PATIENCE = 300


def printed(checkout, *words):
    return subprocess.run(words, cwd=checkout, check=True, capture_output=True, text=True).stdout


def ended(checkout, *words, patience=PATIENCE):
    """The status of a command; none where it takes too long."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    run = subprocess.Popen(words, cwd=checkout, env=os.environ | BUILD, start_new_session=True, **quiet)
    try:
        return run.wait(patience)
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        return None


def tests(checkout, *more, **patience):
    return ended(checkout, "cargo", "nextest", "run", "-p", "cft-ident-core", *more, **patience)


def end_of(checkout, mutant):
    """How the tests end with one mutant."""
    file = checkout / mutant["file"]
    sound = file.read_text()
    try:
        subprocess.run(["patch", "--quiet", "--unified", file], input=mutant["diff"], check=True, text=True)
        if tests(checkout, "--no-run") != 0:
            return "unviable"
        return {None: "timeout", 0: "missed"}.get(tests(checkout), "caught")
    finally:
        file.write_text(sound)


def wilson(p, n, z=1.96):
    middle, half = p + z * z / (2 * n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return [(middle + by) / (1 + z * z / n) for by in (-half, half)]


def summed(commit, seed, of, ends):
    count = {end: sum(e == end for e in ends.values()) for end in ENDS}
    noticed, n = count["caught"] + count["timeout"], count["caught"] + count["timeout"] + count["missed"]
    row = {"mutants of core": of, "drawn": len(ends), "do not compile": count["unviable"], "noticed": noticed,
           "not noticed": count["missed"]}
    if n:
        low, high = wilson(noticed / n, n)
        row["share noticed"] = f"{100 * noticed / n:.0f} % ({100 * low:.0f}..{100 * high:.0f})"
    return {"study": f"mutants of the core, seed {seed}", "command": "benches/quality/mutants.py CHECKOUT", "rows": [row],
            "commit": commit, "ends": ends}


def main():
    checkout = Path(sys.argv[1])
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 150
    result = Path(sys.argv[3] if len(sys.argv) > 3 else "docs/results/quality_mutants.json")
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else SEED
    commit = printed(checkout, "git", "rev-parse", "--short", "HEAD").strip()
    every = json.loads(printed(checkout, "cargo", "mutants", "--list", "--json", "-p", "cft-ident-core"))
    every.sort(key=lambda mutant: mutant["name"])
    # all that the core needs is compiled first, however long that takes
    tests(checkout, "--no-run", patience=None)
    if tests(checkout) != 0:
        sys.exit(f"{checkout}: the tests fail, or take longer than {PATIENCE} s, without a mutant")
    known = json.loads(result.read_text()) if result.exists() else {}
    ends = known["ends"] if known.get("commit") == commit else {}
    for mutant in random.Random(seed).sample(every, min(number, len(every))):
        name = mutant["name"]
        if name not in ends:
            ends[name] = end_of(checkout, mutant)
            result.write_text(json.dumps(summed(commit, seed, len(every), ends), indent=1) + "\n")
            print(ends[name], name, flush=True)


main()
