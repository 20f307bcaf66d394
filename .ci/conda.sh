#!/bin/bash
# The recipe of the conda package, rendered in a fresh virtual environment; nothing is built.
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
"$python" -m venv "$work/venv" || skip "python3 has no venv (on Debian: apt install python3-venv)"
"$work/venv/bin/pip" install -q py-rattler-build || skip "pip cannot install py-rattler-build"
"$work/venv/bin/python" packaging/conda/rendered.py
