#!/bin/bash
# The recipe of the conda package, rendered; nothing is built.
#   .ci/conda.sh
set -eu
cd "$(dirname "$0")/.."

skip() {
  echo "SKIPPED: $*"
  exit 0
}

python=$(command -v python3) || skip "python3 is not installed"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || skip "python3 is older than 3.11"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
venv=$(.ci/venv "$work/venv" conda 2> "$work/venv.log") || skip "$(cat "$work/venv.log")"
"$venv/bin/python" packaging/conda/rendered.py
