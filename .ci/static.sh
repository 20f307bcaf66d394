#!/bin/bash
# The program without shared libraries, run where nothing else is: an empty folder as its root.
#   .ci/static.sh
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
mkdir "$root"
packaging/static "$root/cft-ident" quick
if ldd "$root/cft-ident" > "$work/needs" 2>&1 && ! grep -q "statically linked" "$work/needs"; then
  cat "$work/needs"
  echo "== static: the program needs shared libraries"
  exit 1
fi
enter=(chroot "$root")
if [ "$(id -u)" -ne 0 ]; then
  if ! unshare -r true 2> /dev/null; then
    echo "== static: built; SKIPPED in an empty root, this user may not change it"
    exit 0
  fi
  enter=(unshare -r chroot "$root")
fi
"${enter[@]}" /cft-ident --version
"${enter[@]}" /cft-ident example ur10 -o /ur10 -q
"${enter[@]}" /cft-ident lsq /ur10/ur10.csv@0..70% -r /ur10/ur10.toml -o /model.toml -q
"${enter[@]}" /cft-ident validate /ur10/ur10.csv@70..100% -m /model.toml --report /report.html
test -s "$root/report.html"
echo "== static: runs in an empty root"
