#!/bin/bash
# Runs the commands of the manual: the ```sh blocks of each page, one after the other, in a folder of
# the page's own.
#   .ci/manual.sh TOOL [PAGE...]        (pages: README.md, all of docs, and examples/README.md where absent)
# `cargo` stands for the build that is there already, examples for those beside TOOL. A page whose logs are not there is skipped aloud.
set -u
tool=$(realpath "${1:?the built cft-ident}") || exit 1
shift
cd "$(dirname "$0")/.." || exit 1
repository=$PWD
pages=("$@")
[ ${#pages[@]} -gt 0 ] || pages=(README.md docs/*.md docs/results/measured/*.md examples/README.md)

export CFT_IDENT_EXAMPLES=${tool%/*}/examples
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/bin" "$work/pages"
ln -s "$tool" "$work/bin/cft-ident"
cat > "$work/bin/cargo" <<'END'
#!/bin/bash
# The tool is built already; its tests are a step of their own.
case "$*" in
  "build --release" | "test") echo "(cargo $*: done by other steps)" ;;
  "run --release -- "*) shift 3; exec cft-ident "$@" ;;
  "run --release --example "*) name=$4; shift 5; exec "$CFT_IDENT_EXAMPLES/$name" "$@" ;;
  "run --release -p cft-ident-studies "*) echo "(cargo $*: a study, which takes long; not run)" ;;
  *) echo "cargo $*: not known to .ci/manual.sh" >&2; exit 1 ;;
esac
END
chmod +x "$work/bin/cargo"
if [ -d "$repository/../shared/data" ]; then
  ln -s "$(realpath "$repository/../shared")" "$work/pages/shared"
fi

failed=() skipped=() run=0
for page in "${pages[@]}"; do
  script=$(awk '/^```sh$/ { on = 1; next } /^```/ { on = 0 } on' "$page")
  [ -n "$script" ] || continue
  echo
  if [[ $script == *../shared/* && ! -e $work/pages/shared ]]; then
    echo "== manual: $page SKIPPED, ../shared/data is not there (docs/results/measured/data.md says where it is from)"
    skipped+=("$page")
    continue
  fi
  echo "== manual: $page"
  folder=$work/pages/$(basename "$page" .md)
  mkdir -p "$folder"
  from=$SECONDS
  if (cd "$folder" && PATH=$work/bin:$PATH bash -euo pipefail -c "$script") > "$work/said" 2>&1; then
    echo "== manual: $page passed in $((SECONDS - from)) s"
    run=$((run + 1))
  else
    tail -n 20 "$work/said"
    echo "== manual: $page FAILED"
    failed+=("$page")
  fi
  rm -rf "$folder"
done
echo
echo "== manual: $run pages run, ${#skipped[@]} skipped, ${#failed[@]} failed"
[ ${#failed[@]} -eq 0 ]
