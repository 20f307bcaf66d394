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
  venv=$(.ci/venv "$work/venv" scipy 2> "$work/venv.log") ||
    { echo "== published: SKIPPED, $(cat "$work/venv.log")"; exit 0; }
  python=$venv/bin/python
fi
failed=0
for row in emps tx40 panda ur10 kr300 pendulum cogging; do
  RESULT=$work PYTHON=$python benches/published/$row/run "$tool" > "$work/said" || { cat "$work/said"; exit 1; }
  "$python" - "$work/$row.json" "docs/results/published/$row.json" << 'END' || failed=1
import json
import sys

new, old = ([[r["machine"], r["data"], r.get("joints", r["default"])] for r in json.load(open(f))["rows"]] for f in sys.argv[1:])


def near(a, b):
    """Percents as rounded on any processor; names and structure alike."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(near(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(near, a, b))
    return abs(a - b) <= 0.02 if isinstance(a, float) and isinstance(b, float) else a == b


if not near(new, old):
    print(f"== published: not what {sys.argv[2]} has: {new}")
    sys.exit(1)
END
done
exit $failed
