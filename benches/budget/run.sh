#!/bin/bash
# Where the processor time of `lsq` of the TX40 and of the built-in `identify` goes: samples of `perf` by what a stage
# calls. Writes docs/results/budget.json.
#   benches/budget/run.sh [TOOL]        (target/release/cft-ident where absent)
set -euo pipefail
tool=$(realpath "${1:-target/release/cft-ident}")
cd "$(dirname "$0")/../.."
log=../shared/data/tx40/tx40_joint.csv
[ -f "$log" ] || { echo "budget: SKIPPED, $log is not there (docs/results/measured/data.md says where it is from)"; exit 0; }
command -v perf > /dev/null || { echo "budget: SKIPPED, \`perf\` is not installed (Debian: linux-perf)"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# stage: name, then the functions that are it, none of which calls another of the table
stages=$(cat <<'END'
check of the set-up|stages::setup::trial::Trial::new
rows of the fit and their filters|motion::window::FilterWindow::process
data set aside: errors, bands, observer|held_out::hold_out::Trial::run
parameters that can exist|fit::consistent::consistent,fit::consistent::project_in
solving and its uncertainty|fit::estimate::estimate
position cut-offs|cutoff_costs::{{closure}}
look at the log|inspect::gate::findings,inspect::look::look
friction by the Kalman filter|friction::estimate::estimate
simulated campaign|plant::simulate::order::run_any
diagnosis|core::diagnose::run::diagnose
figures of the report|stages::replay::residual::residual,ReplayedDiagnosis::new
END
)

# shares COMMAND...: processor seconds, then the share of each stage
shares() {
  local times
  times=$( { TIMEFORMAT='%U %S'; time perf record -q -F 199 --call-graph dwarf,8192 -o "$work/perf" \
    "$@" > "$work/said" 2>&1; } 2>&1 )
  perf report -i "$work/perf" --no-inline --children --stdio -g none --percent-limit 0 2> /dev/null > "$work/report"
  while IFS='|' read -r stage functions; do
    awk -v functions="$functions" -v stage="$stage" '
      BEGIN { n = split(functions, f, ",") }
      { for (i = 1; i <= n; i++) if (index($0, f[i]) && !done[i]) { sum += $1; done[i] = 1 } }
      END { printf "%s|%.1f\n", stage, sum }
    ' "$work/report"
  done <<< "$stages" > "$work/stages"
  jq -Rn --arg times "$times" '[inputs | split("|") | {key: .[0], value: (.[1] | tonumber)}] | from_entries
    | {seconds: ($times | split(" ") | map(tonumber) | add), stages: .}' < "$work/stages"
}

fit=$(shares "$tool" lsq "$log@0..7.4s" -r benches/pinocchio/tx40.toml -q --threads 1 -o "$work/model.toml")
whole=$(shares "$tool" identify -q --threads 1 -o "$work/run")
jq -n --argjson fit "$fit" --argjson whole "$whole" '
  def percent: if . < 0.05 then "-" else "\(.) %" end;
  {study: "processor time by stage, samples of perf, one thread", command: "benches/budget/run.sh",
   seconds: {lsq: $fit.seconds, identify: $whole.seconds},
   rows: [$fit.stages | keys_unsorted[] | {stage: ., "lsq of the TX40": ($fit.stages[.] | percent),
     "built-in identify": ($whole.stages[.] | percent)}]}
' | tee docs/results/budget.json
