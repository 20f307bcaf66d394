#!/bin/bash
# Logs drawn by chance, so many of each kind, read or cured: writes docs/results/drawn_logs.json.
#   benches/drawn/run.sh [NUMBER]
set -euo pipefail
cd "$(dirname "$0")/../.."
DRAWN_LOGS=${1:-100} cargo test --locked --features parquet -p cft-ident-logs --test logs -- drawn_ \
  text_logs_are recordings_are --nocapture | sed -n 's/^.*drawn: //p' | sort |
  python3 -c "
import json, sys
rows = [json.loads(line) for line in sys.stdin]
study = {'study': 'logs drawn by chance', 'command': 'benches/drawn/run.sh ${1:-100}', 'rows': rows}
json.dump(study, open('docs/results/drawn_logs.json', 'w'), indent=1)
print(sum(row['drawn'] for row in rows), 'logs of', len(rows), 'kinds')
"
