#!/bin/bash
# Reading of logs beside the readers that people have, in one run: a text log beside pandas, a recording of joint
# states beside the official Python reader of MCAP and a loop over the Rust crate's messages.
#   benches/reading/run.sh [FOLDER]     (FOLDER: where the virtual environment is kept)
# Needs python3 with venv and the packages of the first line below. Writes docs/results/reading.json.
set -euo pipefail
cd "$(dirname "$0")/../.."
packages=(pandas mcap mcap-ros2-support)
folder=${1:-target/reading}
python=$folder/bin/python
if [ ! -x "$python" ]; then
  python3 -m venv "$folder"
  "$folder/bin/pip" install --quiet "${packages[@]}"
fi
cargo bench --locked --quiet --bench logs
"$python" benches/reading/compare.py "${CARGO_TARGET_DIR:-target}/criterion" docs/results/reading.json
