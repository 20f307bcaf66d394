#!/bin/bash
# Line and branch coverage of each crate by its tests and those of the whole program.
#   benches/quality/coverage.sh [RESULT.json] [CARGO-TEST-ARGUMENTS...]
# Needs cargo-llvm-cov (cargo install cargo-llvm-cov --locked) and llvm-cov and llvm-profdata of the version that
# `rustc -vV` names: `rustup component add llvm-tools`, or Debian's package llvm-VERSION. Branches need a nightly
# toolchain (RUSTUP_TOOLCHAIN=nightly BRANCH=--branch).
set -euo pipefail
cd "$(dirname "$0")/../.."
result=${1:-docs/results/quality_coverage.json}
shift || true
version=$(rustc -vV | sed -n 's/^LLVM version: \([0-9]*\).*/\1/p')
if [ -x "/usr/bin/llvm-cov-$version" ]; then
  export LLVM_COV=/usr/bin/llvm-cov-$version LLVM_PROFDATA=/usr/bin/llvm-profdata-$version
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo llvm-cov --locked --no-report ${BRANCH:-} "$@"
# a report is of the packages that it names
members=(-p cft-ident)
for crate in crates/*/; do members+=(-p "cft-ident-$(basename "$crate")"); done
cargo llvm-cov report "${members[@]}" --json --summary-only --output-path "$work/coverage.json" ${BRANCH:-}
python3 - "$work/coverage.json" "$result" "${*:-all tests}" "$*" << 'END'
import json, re, sys
from collections import defaultdict

sums = defaultdict(lambda: defaultdict(int))
for file in json.load(open(sys.argv[1]))["data"][0]["files"]:
    crate = re.search(r"crates/(\w+)/src/", file["filename"])
    name = crate.group(1) if crate else "src" if re.search(r"/src/(cli|main|lib)", file["filename"]) else None
    if name is None or name in ("studies", "support"):
        continue
    for kind in ("lines", "branches", "functions"):
        for part in ("count", "covered"):
            sums[name][f"{kind} {part}"] += file["summary"][kind][part]


def share(of, kind):
    return f"{100 * of[kind + ' covered'] / of[kind + ' count']:.1f} %" if of[kind + " count"] else None


rows = [{"crate": name, "lines": of["lines count"], "lines covered": share(of, "lines"),
         "branches covered": share(of, "branches"), "functions covered": share(of, "functions")}
        for name, of in sorted(sums.items())]
result = {"study": f"coverage by {sys.argv[3]}", "command": f"benches/quality/coverage.sh RESULT.json {sys.argv[4]}".strip(), "rows": rows}
json.dump(result, open(sys.argv[2], "w"), indent=1)
for row in rows:
    print(row)
END
