#!/bin/bash
# Two threads against one for `diagnose` and `reduce` of a log of the CFT robot (1 kHz, four joints). The serial share is
# what the main thread spends of all processor time, which other work of the machine does not change; the times by the
# clock want a quiet machine. Writes docs/results/scale_threads.json.
#   benches/scale/threads.sh [TOOL] [ROWS]       (target/release/cft-ident and 100000 where absent)
set -euo pipefail
tool=$(realpath "${1:-target/release/cft-ident}")
rows=${2:-100000}
cd "$(dirname "$0")/../.."
command -v perf > /dev/null || { echo "threads: SKIPPED, \`perf\` is not installed (Debian: linux-perf)"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$tool" identify -q -o "$work/run" > "$work/said" 2>&1
model=$work/run/model.toml log=$work/log.csv
"$tool" simulate -r configs/cft.toml -m "$model" --seconds "$((rows / 1000))" --seed 1 -o "$log" -q > "$work/said" 2>&1

# run THREADS COMMAND...: seconds by the clock
run() {
  local threads=$1 times
  shift
  times=$( { TIMEFORMAT=%R; time "$tool" "$@" -q --threads "$threads" > "$work/said" 2>&1; } 2>&1 ) ||
    { cat "$work/said" >&2; exit 1; }
  echo "$times"
}

# serial COMMAND...: share of the processor time that the main thread spends, while those of the pool wait
serial() {
  perf record -q -F 499 -o "$work/perf" "$tool" "$@" -q --threads 2 > "$work/said" 2>&1
  perf script -i "$work/perf" -F pid,tid 2> /dev/null | tr / ' ' | awk '
    NF == 2 { all++; main += $1 == $2 }
    END { printf "%.3f", main / all }'
}

for what in diagnose reduce; do
  case $what in
    diagnose) command=(diagnose "$log" -m "$model" -o "$work/refined.toml") ;;
    reduce) command=(reduce "$log" -r configs/cft.toml -m "$model" -o "$work/part.cfi") ;;
  esac
  one=$(run 1 "${command[@]}") two=$(run 2 "${command[@]}") share=$(serial "${command[@]}")
  jq -n --arg what "$what" --argjson one "$one" --argjson two "$two" --argjson share "$share" '
    {command: $what, "one thread [s]": $one, "two threads [s]": $two, "of linear": ($one / $two * 50 | round / 100),
     "serial share": "\($share * 1000 | round / 10) %"}'
done | jq -s --arg rows "$rows" --arg load "$(cut -d' ' -f1 /proc/loadavg)" '
  {study: "two threads against one on a log of \($rows) rows of four joints",
   command: "benches/scale/threads.sh target/release/cft-ident \($rows)", load: ($load | tonumber), rows: .}
' | tee docs/results/scale_threads.json
