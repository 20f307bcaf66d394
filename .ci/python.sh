#!/bin/bash
# The Python package in a virtual environment: installed as `pip install ./python` does it, its program run, tested
# by pytest against the command line that is given, and the notebooks in a short form.
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
venv=$(.ci/venv "$work/venv" python 2> "$work/venv.log") || skip "$(cat "$work/venv.log")"

# brings PURPOSE: whether the packages for a purpose are there.
brings() {
  .ci/venv "$venv" "$1" > "$work/venv.log" 2>&1 || { echo "SKIPPED: $(head -n 1 "$work/venv.log")"; return 1; }
}

# the tests of a cluster are skipped aloud by pytest without them
brings dask || true
brings ray || true
export VIRTUAL_ENV=$venv PATH=$venv/bin:$PATH PYTHONDONTWRITEBYTECODE=1
pip install -q --no-build-isolation ./python

# the wheel holds the program
installed=$venv/bin/cft-ident
[ "$("$installed" --version)" = "$("$tool" --version)" ]
(cd "$work" && "$installed" example ur10 && "$installed" inspect ur10/ur10.csv -r ur10/ur10.toml -q)

# types: the package, its stubs against the built module, and what a user writes against them
if brings types; then
  (cd "$work" && mypy --config-file "$OLDPWD/python/pyproject.toml" --cache-dir "$work/mypy" -p cft_ident && stubtest cft_ident._native)
fi

# the programs to copy
(
  cd "$work"
  "$installed" example cft -q
  "$installed" lsq ur10/ur10.csv@0..70% -r ur10/ur10.toml -o model.toml -q
  while read -r program arguments; do
    echo "$program.py"
    # shellcheck disable=SC2086
    timeout 120 python "$OLDPWD/examples/$program.py" $arguments < /dev/null
  done << 'END'
identify_arm ur10/ur10.toml ur10/ur10.csv refined.toml
joint_friction cft/robot.toml friction.toml cft/q4.csv cft/q5.csv
payload model.toml ur10/ur10.csv@70..100%
compensation model.toml
fleet ur10/ur10.toml ur10/ur10.csv@0..50% ur10/ur10.csv@50..100%
END
)

CFT_IDENT=$tool timeout 600 pytest -q -rs -p no:cacheprovider python/tests

if brings notebooks; then
  for notebook in python/notebooks/*.ipynb; do
    echo "$notebook"
    ! grep -q '"import mujoco' "$notebook" || brings mujoco || continue
    CFT_IDENT_SHORT=1 timeout 300 jupyter-execute "$notebook"
  done
fi
