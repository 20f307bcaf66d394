#!/bin/bash
# Published figures: runs the rows whose logs are in ../shared/data, and compares them with the committed ones.
#   .ci/published.sh TOOL
set -euo pipefail
tool=$(realpath "${1:?the built cft-ident}")
cd "$(dirname "$0")/.."
[ -d ../shared/data ] || { echo "== published: SKIPPED, ../shared/data is not there"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python=${PYTHON:-python3}
if ! "$python" -c 'import scipy' 2> /dev/null; then
  python3 -m venv "$work/venv" && "$work/venv/bin/pip" -q install numpy scipy > "$work/pip" 2>&1 ||
    { echo "== published: SKIPPED, scipy cannot be installed"; exit 0; }
  python=$work/venv/bin/python
fi
failed=0
for row in emps tx40 panda ur10 kr300 pendulum cogging; do
  RESULT=$work PYTHON=$python benches/published/$row/run "$tool" > "$work/said" || { cat "$work/said"; exit 1; }
  if ! cmp -s "$work/published_$row.json" "docs/results/published_$row.json"; then
    echo "== published: $row is not what docs/results/published_$row.json has: run benches/published/$row/run"
    diff "docs/results/published_$row.json" "$work/published_$row.json" || true
    failed=1
  fi
done
exit $failed
