#!/bin/bash
# Follows what the program proposes: on every machine whose logs are there, fits, diagnoses and validates as a new user
# would, takes each command that an output ends with (`cft-ident ...` behind "Next:", or in lines of its own), puts logs
# and robot files in their places, and runs it; and what that proposes, once more.
#   .ci/next.sh TOOL
set -u
tool=$(realpath "${1:?the built cft-ident}") || exit 1
cd "$(dirname "$0")/.." || exit 1
data=$(realpath ../shared/data 2> /dev/null)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0 run=0

# one NAME ROBOT LOG HELD [COMMAND]: the walk on one machine, in a folder of its own.
one() {
  local name=$1 robot=$2 log=$3 held=$4
  mkdir "$work/walk-$name" && cd "$work/walk-$name" || exit 1
  local -a queue=(
    "cft-ident inspect $log -r $robot"
    "cft-ident lsq $log -r $robot -o model.toml"
    "cft-ident diagnose $log -m model.toml --holdout $held -o refined.toml"
    "cft-ident validate $held -m refined.toml"
    "cft-ident show refined.toml"
    ${5:+"$5"}
  )
  local seen=" "
  while [ ${#queue[@]} -gt 0 ]; do
    local line=${queue[0]}
    queue=("${queue[@]:1}")
    case $seen in *"|$line|"*) continue ;; esac
    seen+="|$line|"
    run=$((run + 1))
    if ! PATH=$work/bin:$PATH bash -c "$line" > said 2> warned; then
      echo "== next: $name: FAILED: $line"
      tail -n 3 warned
      failed=$((failed + 1))
      continue
    fi
    while IFS= read -r next; do
      # a search takes logs that are long enough to fit
      case $next in *" --search"* | *" --holdout "*) next=${next//LOG/$log} ;; *) next=${next//LOG/$held} ;; esac
      next=${next//ROBOT.toml/$robot}
      queue+=("$next")
    done < <(proposed < said)
  done
  cd - > /dev/null || exit 1
  echo "== next: $name: done"
}

# Commands in an output: in lines of their own, that may go on with a backslash; between backticks, broken across lines;
# and behind "next: " at its end.
proposed() {
  awk '
    /\\$/ { sub(/ *\\$/, " "); held = held $0; next }
    { line = held $0; held = "" }
    line ~ /^ *cft-ident / { sub(/^ */, "", line); gsub(/  +/, " ", line); print line; next }
    line ~ /^next: / { tail = " " }
    tail != "" { tail = tail " " line }
    { text = text " " line }
    END {
      gsub(/  +/, " ", text)
      while (match(text, /`cft-ident [^`]*`/)) {
        print substr(text, RSTART + 1, RLENGTH - 2)
        text = substr(text, RSTART + RLENGTH)
      }
      gsub(/  +/, " ", tail)
      if (match(tail, /cft-ident .*/)) print substr(tail, RSTART)
    }'
}

mkdir "$work/bin" && ln -s "$tool" "$work/bin/cft-ident"
(cd "$work" && for machine in ur10 tx40 bldc; do "$tool" example -q $machine > /dev/null; done)
one ur10 "$work/ur10/ur10.toml" "$work/ur10/ur10.csv@0..70%" "$work/ur10/ur10.csv@70..100%" \
  "cft-ident new arm --urdf $work/ur10/ur10.urdf --log $work/ur10/ur10.csv@0..70%"
one tx40 "$work/tx40/tx40.toml" "$work/tx40/tx40.csv@0..70%" "$work/tx40/tx40.csv@70..100%"
one bldc "$work/bldc/bldc.toml" "$work/bldc/bldc.csv@15.2..23s" "$work/bldc/bldc.csv@23..29.5s"
if [ -n "$data" ]; then
  one panda configs/panda.toml "$data/panda/panda_exciting.csv@0..70%" "$data/panda/panda_exciting.csv@70..100%"
  one emps configs/emps.toml "$data/emps/emps_id.csv@0..70%" "$data/emps/emps_id.csv@70..100%"
else
  echo "== next: panda and emps SKIPPED, ../shared/data is not there (docs/results/measured/data.md says where it is from)"
fi
echo "== next: $run commands run, $failed failed"
[ "$failed" -eq 0 ]
