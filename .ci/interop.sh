#!/bin/bash
# The official Python packages of MCAP, ROS 2 and protobuf against this tool, both ways.
#   .ci/interop.sh TOOL
# Has the packages write a log that no fixture holds in every
# format and runs the tests of the fixtures on it; then has them read what this tool writes. Says so,
# and passes, where the packages cannot be had.
set -u
tool=$(realpath "${1:?the built cft-ident}") || exit 1
cd "$(dirname "$0")/.." || exit 1

skip() {
  echo "== interop: SKIPPED, $1"
  exit 0
}

command -v python3 > /dev/null || skip "python3 is not installed"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
venv=$(.ci/venv "$work/venv" formats 2> "$work/venv.log") || skip "$(cat "$work/venv.log")"
"$venv/bin/pip" list --disable-pip-version-check 2> /dev/null |
  grep -iE "^(mcap|rosbags|protobuf|zstandard)"
export PYTHONDONTWRITEBYTECODE=1

# Theirs, read by this tool: another motion and another seed than those of the fixtures.
tool() { "$tool" "$@" < /dev/null; }
tool simulate -q -r configs/cft.toml --seconds 3 --seed 20 -o "$work/sim.csv" > /dev/null || exit 1
"$venv/bin/python" fixtures/logs/make.py "$work/sim.csv" "$work/logs" || exit 1
# the whole workspace's build, which the tests have made already: one package alone has other features
CFT_IDENT_LOGS="$work/logs" cargo test --locked --test logs log_fixtures || exit 1

# This tool's, read by them.
if ! tool help convert > /dev/null 2>&1; then
  echo "== interop: this version writes no recordings, so the packages have none to read"
  exit 0
fi
tool convert -q "$work/sim.csv" "$work/converted.mcap" > /dev/null || exit 1
tool simulate -q -r configs/cft.toml --seconds 3 --seed 20 -o "$work/simulated.mcap" > /dev/null ||
  exit 1
"$venv/bin/python" fixtures/logs/read.py "$work/sim.csv" \
  "$work/converted.mcap" "$work/simulated.mcap" || exit 1

# What Rerun and PlotJuggler show of it: joints by their names, residuals beside the torques.
.ci/venv "$work/venv" viewers > "$work/venv.log" 2>&1 || skip "viewers: $(head -n 1 "$work/venv.log")"
tool example -q ur10 -o "$work/ur10" > /dev/null || exit 1
tool lsq -q "$work/ur10/ur10.csv" -r configs/ur10.toml -o "$work/model.toml" > /dev/null || exit 1
tool validate -q "$work/ur10/ur10.mcap" -m "$work/model.toml" -o "$work/residual.mcap" > /dev/null || exit 1
"$venv/bin/python" fixtures/logs/read_viewers.py q1,q2,q4,q5 /joint_states \
  "$work/converted.mcap" "$work/simulated.mcap" || exit 1
"$venv/bin/python" fixtures/logs/read_viewers.py q1,q2,q3,q4,q5,q6 \
  /joint_states,/tau_hat,/residual,/band_lower,/band_upper "$work/residual.mcap"
