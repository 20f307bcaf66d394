#!/bin/bash
# The HTML reports in headless Chromium: they load without an error, every figure is drawn, zooming
# works, on a wide and a narrow window, in light and dark, with and without a script.
#   .ci/browser.sh [PAGE.html...]        (no page: only brings what opens them; CI_BROWSER=FOLDER keeps it there)
# Says so, and passes, where Chromium, node or the package that drives it cannot be had.
set -u
cd "$(dirname "$0")/.." || exit 1

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
browser=${CI_BROWSER:-$work}
mkdir -p "$browser"
exec 9> "$browser/lock"
flock 9

skip() {
  echo "== browser: SKIPPED, $1"
  echo "$1" > "$browser/missing"
  exit 0
}

[ -s "$browser/missing" ] && skip "$(cat "$browser/missing")"

for program in node npm; do
  command -v "$program" > /dev/null || skip "$program is not installed"
done
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) || {
  # a machine for tests may have it in its packages
  if [ "$(id -u)" -eq 0 ] && command -v apt-get > /dev/null; then
    timeout 300 apt-get install -y --no-install-recommends chromium > /dev/null 2>&1 ||
      { timeout 120 apt-get update && timeout 300 apt-get install -y --no-install-recommends chromium; } > /dev/null 2>&1
  fi
  chromium=$(command -v chromium) || skip "Chromium is not installed"
}
for page in "$@"; do
  [ -f "$page" ] || { echo "== browser: there is no $page"; exit 1; }
done
pages=()
for page in "$@"; do pages+=("$(realpath "$page")"); done
driver=$(realpath .ci/browser.mjs)
cd "$browser" || exit 1
if [ ! -d node_modules/playwright-core ]; then
  echo '{"private":true}' > package.json
  timeout 120 npm install --silent --no-audit --no-fund playwright-core > npm.log 2>&1 ||
    skip "playwright-core cannot be installed: $(tail -n 1 npm.log)"
fi
[ ${#pages[@]} -gt 0 ] || exit 0
"$chromium" --version 2> /dev/null
node "$driver" "$chromium" "${pages[@]}"
