#!/bin/bash
# Exported files in the programs that they are for: MuJoCo, Pinocchio and OpenUSD.
#   .ci/simulators.sh TOOL [REPLAY.json]
# Compares the torques of each file with those of the
# exported C along measured logs (fixtures/simulators/check.py). With REPLAY.json, writes the errors of logs
# that are replayed in MuJoCo. Says so, and passes, where packages or logs cannot be had.
set -u
tool=$(realpath "${1:?the built cft-ident}") || exit 1
cd "$(dirname "$0")/.." || exit 1

skip() {
  echo "== simulators: SKIPPED, $1"
  exit 0
}

data=../shared/data
[ -d "$data/ur10" ] || skip "$data is not there (docs/results/measured/data.md says where it is from)"
command -v cc > /dev/null || skip "there is no C compiler \`cc\`"
command -v python3 > /dev/null || skip "python3 is not installed"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
venv=$(.ci/venv "$work/venv" simulators 2> "$work/venv.log") || skip "$(cat "$work/venv.log")"
"$venv/bin/pip" list --disable-pip-version-check 2> /dev/null |
  grep -iE "^(mujoco|pin|usd-core|numpy) "
export PYTHONDONTWRITEBYTECODE=1
"$venv/bin/python" fixtures/simulators/check.py "$tool" "$data" ${2:+"$2"}
