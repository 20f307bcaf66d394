# Sourced by each `run`: three models of one protocol, and a row of the table for each log that they are judged on.
set -euo pipefail
here=$(realpath "$(dirname "$0")")
name=$(basename "$here")
tool=$(realpath "${1:-target/release/cft-ident}")
published=$(dirname "$here")
root=$(realpath "$published/../..")
shared=$root/../shared/data
result=${RESULT:-$root/docs/results/published}/$name.json
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$root"
"$python" -c 'import scipy' 2> /dev/null || { echo "$name: SKIPPED, $python has no scipy"; exit 0; }
count=0

# needs FOLDER: ends the row where its logs are not there
needs() {
  [ -d "$1" ] || { echo "$name: SKIPPED, $1 is not there: $here/get says where the logs are"; exit 0; }
}

# quietly COMMAND...: runs it, and shows what it says only where it fails
quietly() {
  "$@" > "$work/said" 2>&1 || { cat "$work/said" >&2; exit 1; }
}

# three ROBOT LOG...: plain least squares, the default, and what diagnose makes of it
three() {
  local robot=$1
  shift
  quietly "$tool" lsq --unconstrained --estimator ols "$@" -r "$robot" -o "$work/ols.toml" -q
  quietly "$tool" lsq "$@" -r "$robot" -o "$work/default.toml" -q
  quietly "$tool" diagnose "$@" -m "$work/default.toml" -o "$work/diagnosed.toml" -q
}

# row MACHINE DATA ERROR PUBLISHED FILTER SPAN LOG: the three models on a log; SPAN is "" or FROM..TO
row() {
  local model
  count=$((count + 1))
  jq -n --arg machine "$1" --arg data "$2" --arg error "$3" --arg published "$4" \
    '{machine: $machine, data: $data, error: $error, "published": $published}' > "$work/row$count.json"
  for model in ols default diagnosed; do
    quietly "$tool" validate "$7" -m "$work/$model.toml" -o "$work/$model.csv" -q
  done
  "$python" "$published/metric.py" "$work/row$count.json" "$5" ${6:+"$6"} "$work"/{ols,default,diagnosed}.csv
}

# value MACHINE DATA ERROR PUBLISHED OLS DEFAULT DIAGNOSED: a row of numbers that no residual file holds
value() {
  count=$((count + 1))
  jq -n --args '$ARGS.positional | {machine: .[0], data: .[1], error: .[2], published: .[3],
    "plain least squares": .[4], default: .[5], "after diagnose": .[6], "joints worse": "-"}' "$@" \
    | tee "$work/row$count.json"
}

# finish: writes the rows of this folder
finish() {
  # shellcheck disable=SC2046
  jq -s '{command: $command, rows: .}' --arg command "benches/published/$name/run" $(seq -f "$work/row%g.json" $count) > "$result"
}
