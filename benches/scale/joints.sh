#!/bin/bash
# Processor time and memory of `lsq` over the joints of a chain, logs of so many rows, on one thread, with the slopes in the
# log-log plot. Writes docs/results/scale_joints.json.
#   PYTHON=python3 benches/scale/joints.sh [TOOL] [ROWS]     (PYTHON with numpy; 10000 rows where absent)
set -euo pipefail
tool=$(realpath "${1:-target/release/cft-ident}")
rows=${2:-10000}
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for n in 1 2 4 8 16 32; do
  "${PYTHON:-python3}" benches/scale/joints.py "$n" "$rows" "$work/robot.toml" "$work/log.csv"
  /usr/bin/time -o "$work/cost" -f "%U %S %M" "$tool" lsq "$work/log.csv" -r "$work/robot.toml" -o "$work/m.toml" -q \
    --threads 1 > "$work/said" 2>&1 || { cat "$work/said" >&2; exit 1; }
  tail -n 1 "$work/cost" | awk -v n="$n" '{ printf "%d,%.3f,%.1f\n", n, $1 + $2, $3 / 1024 }'
done | tee "$work/costs"
jq -Rn --arg rows "$rows" '
  def slope($k): map([(.[0] | log10), (.[$k] | log10)]) as $p | ($p | length) as $n
    | ([$p[][0]] | add / $n) as $mx | ([$p[][1]] | add / $n) as $my
    | (([$p[] | (.[0] - $mx) * (.[1] - $my)] | add) / ([$p[] | pow(.[0] - $mx; 2)] | add)) * 100 | round / 100;
  [inputs | split(",") | map(tonumber)] as $all
  | {study: "processor time and peak memory of lsq over the joints of a chain, \($rows) rows, one thread",
     command: "benches/scale/joints.sh target/release/cft-ident \($rows)",
     rows: ([$all[] | {joints: .[0], "lsq [s]": .[1], "lsq [MB]": .[2]}]
       + [{joints: "slope", "lsq [s]": ($all | slope(1)), "lsq [MB]": ($all | slope(2))}])}
' "$work/costs" > docs/results/scale_joints.json
