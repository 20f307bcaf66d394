#!/bin/bash
# A fleet's logs reduced by two workers of Dask beside one process with one thread: times, bytes, memory.
#   benches/fleet/run.sh [LOGS] [FOLDER]     (FOLDER: where the virtual environment and what is done are kept)
# Logs of 20 s are cut from the UR10 example, with seeded noise added so that no two are alike. They are made, reduced both
# ways and deleted 50 at a time; a run that was ended goes on where it was. Needs python3 with venv, and numpy,
# pandas and distributed from the package index. Writes docs/results/fleet.json. Run it on a quiet machine of two
# cores or more.
set -euo pipefail
cd "$(dirname "$0")/../.."
logs=${1:-1000}
folder=${2:-target/fleet}
mkdir -p "$folder"
if [ ! -x "$folder/venv/bin/python" ]; then
  python3 -m venv "$folder/venv"
  "$folder/venv/bin/pip" install --quiet numpy pandas distributed
fi
"$folder/venv/bin/pip" install --quiet ./python
RAYON_NUM_THREADS=1 OMP_NUM_THREADS=1 "$folder/venv/bin/python" benches/fleet/fleet.py "$logs" "$folder" \
  docs/results/fleet.json
