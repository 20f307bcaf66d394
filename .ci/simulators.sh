#!/bin/bash
# Exported files in the programs that they are for: MuJoCo, Pinocchio, Drake, newton and PyBullet.
#   .ci/simulators.sh TOOL [REPLAY.json]
# Compares the torques that each program computes of each file with
# those of the exported C, of made arms (fixtures/simulators/matrix.py) and along measured logs (check.py). With
# REPLAY.json, writes the errors of logs that are replayed in MuJoCo, and what the programs read into the file beside it.
# Says so, and passes, where packages or logs cannot be had. Real descriptions, whose packages are large, by hand:
#   pip install mujoco pin drake newton newton-usd-schemas pybullet usd-core numpy example-robot-data
#   fixtures/simulators/matrix.py TOOL all --write docs/results/simulators_robots.json
set -u
tool=$(realpath "${1:?the built cft-ident}") || exit 1
replay=${2:+$(realpath -m "$2")}
cd "$(dirname "$0")/.." || exit 1

skip() {
  echo "== simulators: SKIPPED, $1"
  exit 0
}

command -v cc > /dev/null || skip "there is no C compiler \`cc\`"
command -v python3 > /dev/null || skip "python3 is not installed"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
venv=$(.ci/venv "$work/venv" simulators 2> "$work/venv.log") || skip "$(cat "$work/venv.log")"
"$venv/bin/pip" list --disable-pip-version-check 2> /dev/null |
  grep -iE "^(mujoco|pin|drake|newton|pybullet|usd-core|numpy) "
export PYTHONDONTWRITEBYTECODE=1
status=0
facts=(--check docs/results/simulators_readers.json)
[ -z "$replay" ] || facts=(--write docs/results/simulators_readers.json)
"$venv/bin/python" fixtures/simulators/matrix.py "$tool" "${facts[@]}" || status=1
data=../shared/data
if [ -d "$data/ur10" ]; then
  "$venv/bin/python" fixtures/simulators/check.py "$tool" "$data" ${replay:+"$replay"} || status=1
else
  echo "== simulators: measured logs SKIPPED, $data is not there (docs/results/measured/data.md says where it is from)"
fi
exit $status
