#!/bin/bash
# Held-out torque errors of another tool on the log of README, beside ours: writes docs/results/peers.json.
#   benches/peers/run.sh CFT-IDENT [FOLDER]     (FOLDER: where the virtual environment is kept)
# Needs python3 with venv, and figaroh, which brings Pinocchio.
set -euo pipefail
cd "$(dirname "$0")/../.."
tool=$(realpath "$1")
folder=${2:-target/peers}
python=$folder/bin/python
if [ ! -x "$python" ]; then
  python3 -m venv "$folder"
  "$folder/bin/pip" install --quiet figaroh==1.0.2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
(
  cd "$work"
  "$tool" example ur10 -q
  "$tool" new arm --urdf ur10/ur10.urdf --log ur10/ur10.csv -q
  "$tool" lsq 'ur10/ur10.csv@0..70%' -r arm.toml -o model.toml -q
  "$tool" validate 'ur10/ur10.csv@70..100%' -m model.toml --json ur10/fit.json -q
  "$tool" diagnose 'ur10/ur10.csv@0..70%' -m model.toml --holdout 'ur10/ur10.csv@70..100%' \
    --json ur10/diagnosis.json -q
) > "$work/said.txt" 2>&1
"$python" benches/peers/figaroh_ur10.py "$work/ur10" docs/results/peers.json
