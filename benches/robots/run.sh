#!/bin/bash
# The robots of example-robot-data, fitted to torques that Pinocchio computed: ranks, and torques on another motion.
#   benches/robots/run.sh [FOLDER]     (FOLDER: where the virtual environment is kept)
# Needs python3 with venv and the packages of the first line below. Writes docs/results/robots.json.
set -euo pipefail
cd "$(dirname "$0")/../.."
packages=(pin example-robot-data)
folder=${1:-target/robots}
python=$folder/bin/python
if [ ! -x "$python" ]; then
  python3 -m venv "$folder"
  "$folder/bin/pip" install --quiet "${packages[@]}"
fi
prefix=$("$python" -c 'import os, pinocchio; print(os.path.realpath(os.path.dirname(pinocchio.__file__) + "/../../../.."))')
cargo build --locked --release --quiet
"$python" benches/robots/study.py "${CARGO_TARGET_DIR:-target}/release/cft-ident" \
  "$prefix/share/example-robot-data" docs/results/robots.json
