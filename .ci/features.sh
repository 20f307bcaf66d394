#!/bin/bash
# One build of every crate for the program, its examples, the tests and the Python package: none of them may ask a crate
# for features that another does not ask for.
#   .ci/features.sh
set -euo pipefail
cd "$(dirname "$0")/.."

# crates SELECTION...: each crate of a selection with its features, once.
crates() {
  cargo tree --locked --prefix none -f '{p} {f}' "$@" | sed 's/ (\*)$//' | sort -u
}

program=$(crates -e no-dev)
differ=0
for selection in "" "-p cft-ident-python" "-p cft-ident -e no-dev"; do
  # shellcheck disable=SC2086
  again=$(awk 'NR == FNR { held[$0]; crate[$1, $2]; next } ($1, $2) in crate && !($0 in held)' <(echo "$program") <(crates $selection))
  [ -z "$again" ] && continue
  echo "cargo tree $selection: compiled once more, with features that the program's build has not (name them in Cargo.toml):"
  echo "$again"
  differ=1
done
exit $differ
