#!/bin/bash
# Loads, interruptions, hostile input: the figures of docs/results/quality.md, written to docs/results/quality_*.json.
#   benches/quality/run.sh TOOL [short] [hostile|files|interrupted|same|large]...
# `short` takes minutes and writes nothing. Needs python3 with venv; says so, and passes, where its packages
# (.ci/venv) cannot be had. `coverage.sh`, `mutants.py` and `fuzz/run` make the other figures of that page.
set -u
tool=$(realpath "$1")
shift
cd "$(dirname "$0")" || exit 1
short=()
[ "${1:-}" = short ] && short=(--short) && shift
studies=("$@")
[ ${#studies[@]} -gt 0 ] || studies=(hostile files interrupted same large)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if ! venv=$(../../.ci/venv "$work/venv" quality 2> "$work/log"); then
  echo "== quality: SKIPPED, $(cat "$work/log")"
  exit 0
fi
export PYTHONDONTWRITEBYTECODE=1
other=()
# a processor without AVX, where its emulator is (Debian's qemu-user)
if command -v qemu-x86_64 > /dev/null && [ ${#short[@]} -eq 0 ]; then
  printf '#!/bin/sh\nexec qemu-x86_64 -cpu Nehalem "%s" "$@"\n' "$tool" > "$work/without-avx"
  chmod +x "$work/without-avx"
  other=(--other "$work/without-avx")
fi
failed=()
for study in "${studies[@]}"; do
  result=()
  [ ${#short[@]} -eq 0 ] && result=("$PWD/../../docs/results/quality_$study.json")
  more=()
  [ "$study" = same ] && more=("${other[@]}")
  echo "== quality: $study"
  "$venv/bin/python" "$study.py" "$tool" "${result[@]}" "${short[@]}" "${more[@]}" || failed+=("$study")
done
[ ${#failed[@]} -eq 0 ] || { echo "== quality: FAILED: ${failed[*]}"; exit 1; }
