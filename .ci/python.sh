#!/bin/bash
# The Python package from a fresh virtual environment: built by maturin, tested by pytest against the command
# line that is given.
#   .ci/python.sh TOOL
set -eu
cd "$(dirname "$0")/.."
tool=$(realpath "$1")

skip() {
  echo "SKIPPED: $*"
  exit 0
}

python=$(command -v python3) || skip "python3 is not installed"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' || skip "python3 is older than 3.10"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m venv "$work/venv" || skip "python3 has no venv (on Debian: apt install python3-venv)"
"$work/venv/bin/pip" install -q 'maturin>=1.7,<2' numpy pandas pytest ||
  skip "pip cannot install maturin, numpy, pandas and pytest"
# the cluster's test is skipped aloud by pytest without it
"$work/venv/bin/pip" install -q distributed || echo "SKIPPED: distributed cannot be installed"
export VIRTUAL_ENV=$work/venv PATH=$work/venv/bin:$PATH
# the crates below are built once for the program and the package
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
(cd python && maturin develop --release --locked -q)
cd python
CFT_IDENT=$tool timeout 300 python -m pytest -q -rs -p no:cacheprovider
