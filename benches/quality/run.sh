#!/bin/bash
# Loads, interruptions, hostile input: the figures of docs/results/quality.md, written to docs/results/quality_*.json.
#   benches/quality/run.sh TOOL [short] [hostile|files|interrupted|same|large]...
# `short` takes minutes and writes nothing. Needs python3 with venv; says so, and passes, where the packages of the
# first line below cannot be had. `coverage.sh`, `mutants.py` and `fuzz/run` make the other figures of that page.
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
if ! python3 -m venv "$work/venv" > "$work/log" 2>&1 ||
  ! timeout 300 "$work/venv/bin/pip" install --quiet --disable-pip-version-check numpy mcap pyarrow > "$work/log" 2>&1; then
  echo "== quality: SKIPPED, no Python packages: $(tail -n 1 "$work/log")"
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
  "$work/venv/bin/python" "$study.py" "$tool" "${result[@]}" "${short[@]}" "${more[@]}" || failed+=("$study")
done
[ ${#failed[@]} -eq 0 ] || { echo "== quality: FAILED: ${failed[*]}"; exit 1; }
