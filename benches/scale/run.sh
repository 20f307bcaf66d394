#!/bin/bash
# Processor time and memory over the rows of a log of the CFT robot (1 kHz, four joints), on one thread, with the slopes in
# the log-log plot. Writes docs/results/scale.json.
#   benches/scale/run.sh [TOOL] [ROWS...]     (target/release/cft-ident and 10^4 to 10^6 where absent)
set -euo pipefail
tool=$(realpath "${1:-target/release/cft-ident}")
shift || true
rows=("$@")
[ ${#rows[@]} -gt 0 ] || rows=(10000 30000 100000 300000 1000000)
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$tool" identify -q -o "$work/run" > "$work/said" 2>&1
model=$work/run/model.toml

# cost COMMAND ARGUMENT...: seconds of the processor and peak megabytes, as "s,MB"
cost() {
  /usr/bin/time -o "$work/cost" -f "%U %S %M" "$tool" "$@" -q --threads 1 > "$work/said" 2>&1 ||
    { cat "$work/said" >&2; exit 1; }
  tail -n 1 "$work/cost" | awk '{ printf "%.3f,%.1f", $1 + $2, $3 / 1024 }'
}

for n in "${rows[@]}"; do
  log=$work/log.csv
  "$tool" simulate -r configs/cft.toml -m "$model" --seconds "$((n / 1000))" --seed 1 -o "$log" -q > "$work/said" 2>&1
  echo "$n,$(cost lsq "$log" -r configs/cft.toml -m "$model" -o "$work/fit.toml"),$(
    cost diagnose "$log" -m "$model" -o "$work/refined.toml"),$(
    cost reduce "$log" -r configs/cft.toml -m "$model" -o "$work/part.cfi"),$(
    cost validate "$log" -m "$model")"
done | tee "$work/costs"

jq -Rn --arg rows "${rows[*]}" '
  def names: ["rows"] + [("lsq", "diagnose", "reduce", "validate") | "\(.) [s]", "\(.) [MB]"];
  def slope($k): map([(.[0] | log10), (.[$k] | log10)]) as $p | ($p | length) as $n
    | ([$p[][0]] | add / $n) as $mx | ([$p[][1]] | add / $n) as $my
    | (([$p[] | (.[0] - $mx) * (.[1] - $my)] | add) / ([$p[] | pow(.[0] - $mx; 2)] | add));
  [inputs | split(",") | map(tonumber)] as $all
  | {study: "processor time and peak memory over the rows of a log of four joints, one thread",
     command: "benches/scale/run.sh target/release/cft-ident \($rows)",
     rows: ([$all[] | [., names] | transpose | map({key: .[1], value: .[0]}) | from_entries]
       + [[range(1; 9) as $k | {key: names[$k], value: ($all | slope($k) | . * 100 | round / 100)}] | from_entries
          | {rows: "slope"} + .])}
' "$work/costs" | tee docs/results/scale.json
