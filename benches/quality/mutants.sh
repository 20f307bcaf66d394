#!/bin/bash
# A sample of mutants of the core, drawn by a seed: how many the core's own tests notice.
#   benches/quality/mutants.sh [NUMBER [RESULT.json]]
# Needs cargo-mutants (cargo install cargo-mutants --locked). Takes about two minutes a mutant on two quiet cores.
set -euo pipefail
cd "$(dirname "$0")/../.."
number=${1:-150}
result=${2:-docs/results/quality_mutants.json}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo mutants --list --json -p cft-ident-core > "$work/all.json"
python3 - "$work/all.json" "$number" > "$work/names" << 'END'
import json, random, re, sys

names = sorted(mutant["name"] for mutant in json.load(open(sys.argv[1])))
print("\n".join("^" + re.escape(name) + "$" for name in random.Random(45).sample(names, min(int(sys.argv[2]), len(names)))))
END
choose=()
while IFS= read -r name; do choose+=(--re "$name"); done < "$work/names"
# 2: mutants were missed; 3: some took too long, which a test notices too
cargo mutants -p cft-ident-core "${choose[@]}" --in-place --baseline skip --timeout 600 --build-timeout 1200 \
  -o "$work/out" --no-shuffle || [ $? -le 3 ]
python3 - "$work/out/mutants.out" "$work/all.json" "$result" << 'END'
import json, sys
from math import sqrt
from pathlib import Path

folder = Path(sys.argv[1])
ends = {kind: (folder / f"{kind}.txt").read_text().splitlines() for kind in ("caught", "missed", "timeout", "unviable")}
caught, missed = len(ends["caught"]) + len(ends["timeout"]), len(ends["missed"])
n, z = caught + missed, 1.96
p = caught / n
# Wilson's interval
middle, half = (p + z * z / (2 * n)) / (1 + z * z / n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
row = {"mutants of core": len(json.load(open(sys.argv[2]))), "drawn": sum(map(len, ends.values())),
       "do not compile": len(ends["unviable"]), "noticed": caught, "not noticed": missed,
       "share noticed": f"{100 * p:.0f} % ({100 * (middle - half):.0f}..{100 * (middle + half):.0f})"}
result = {"study": "mutants of the core, seed 45", "command": "benches/quality/mutants.sh", "rows": [row], "missed": ends["missed"]}
json.dump(result, open(sys.argv[3], "w"), indent=1)
print(row, *ends["missed"], sep="\n")
END
