#!/usr/bin/env python3
"""A sample of mutants of the core, drawn by a seed: how many the core's own tests notice.

    benches/quality/mutants.py CHECKOUT [NUMBER [RESULT.json]]

CHECKOUT is one that nobody else works in (git worktree add CHECKOUT): mutants are written into it. Needs cargo-mutants
(cargo install cargo-mutants --locked). Takes a minute or two a mutant; a run that is stopped goes on where it was, as
long as the commit is the same.
"""

import json
import random
import re
import subprocess
import sys
import tempfile
from math import sqrt
from pathlib import Path

SEED = 45
ENDS = ("caught", "missed", "timeout", "unviable")
# 2: mutants were missed; 3: some took too long, which a test notices too
FINE = (0, 2, 3)


def lines(checkout, *words):
    return subprocess.run(words, cwd=checkout, check=True, capture_output=True, text=True).stdout.splitlines()


def end_of(checkout, mutant):
    """How the tests end with one mutant."""
    with tempfile.TemporaryDirectory() as work:
        words = ["cargo", "mutants", "-p", "cft-ident-core", "--re", f"^{re.escape(mutant)}$", "--in-place", "--baseline",
                 "skip", "--timeout", "600", "--build-timeout", "1200", "-o", work]
        done = subprocess.run(words, cwd=checkout, capture_output=True, text=True)
        if done.returncode not in FINE:
            sys.exit(done.stdout + done.stderr)
        out = Path(work) / "mutants.out"
        return next(end for end in ENDS if (out / f"{end}.txt").read_text().strip())


def wilson(p, n, z=1.96):
    middle, half = p + z * z / (2 * n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return [(middle + by) / (1 + z * z / n) for by in (-half, half)]


def summed(commit, of, ends):
    count = {end: sum(e == end for e in ends.values()) for end in ENDS}
    noticed, n = count["caught"] + count["timeout"], count["caught"] + count["timeout"] + count["missed"]
    row = {"mutants of core": of, "drawn": len(ends), "do not compile": count["unviable"], "noticed": noticed,
           "not noticed": count["missed"]}
    if n:
        low, high = wilson(noticed / n, n)
        row["share noticed"] = f"{100 * noticed / n:.0f} % ({100 * low:.0f}..{100 * high:.0f})"
    return {"study": f"mutants of the core, seed {SEED}", "command": "benches/quality/mutants.py CHECKOUT", "rows": [row],
            "commit": commit, "ends": ends}


def main():
    checkout = sys.argv[1]
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 150
    result = Path(sys.argv[3] if len(sys.argv) > 3 else "docs/results/quality_mutants.json")
    [commit] = lines(checkout, "git", "rev-parse", "--short", "HEAD")
    every = sorted(lines(checkout, "cargo", "mutants", "--list", "-p", "cft-ident-core"))
    known = json.loads(result.read_text()) if result.exists() else {}
    ends = known["ends"] if known.get("commit") == commit else {}
    for mutant in random.Random(SEED).sample(every, min(number, len(every))):
        if mutant not in ends:
            ends[mutant] = end_of(checkout, mutant)
            result.write_text(json.dumps(summed(commit, len(every), ends), indent=1) + "\n")
            print(ends[mutant], mutant, flush=True)


main()
