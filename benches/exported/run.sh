#!/bin/bash
# CPU time of a call of exported C for the Panda: seven joints alone, and with four effects at each, one of
# which remembers the motion.
#   benches/exported/run.sh [TOOL]        (target/release/cft-ident where absent)
set -euo pipefail
tool=$(realpath "${1:-target/release/cft-ident}")
cd "$(dirname "$0")/../.."
log=../shared/data/panda/panda_exciting.csv
[ -f "$log" ] || { echo "exported: SKIPPED, $log is not there (docs/data.md says where it is from)"; exit 0; }
command -v cc > /dev/null || { echo "exported: SKIPPED, there is no C compiler \`cc\`"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$tool" lsq -q "$log@0..20%" -r configs/panda.toml -o "$work/alone.toml" > /dev/null
# before [provenance], a table of its own
awk '
  function effect(name, joint, keys) {
    printf "[[effect]]\nname = \"%s\"\njoint = \"q%d\"\n[effect.parameters]\n%s\n\n", name, joint, keys
  }
  /^\[provenance\]/ {
    for (j = 1; j <= 7; j++) {
      effect("stribeck", j, "c = { value = 0.4 }\nvs = { value = 0.1 }")
      effect("load-friction", j, "mu_c = { value = 0.03 }\nmu_v = { value = 0.01 }\nw = { value = 50.0 }")
      effect("presliding", j, "sigma0 = { value = 600.0 }\nsigma1 = { value = 1.0 }\nfc = { value = 0.5 }")
      effect("ripple", j, "order = { value = 20.0 }\nsin = { value = 0.1 }\ncos = { value = 0.1 }")
    }
  }
  { print }
' "$work/alone.toml" > "$work/effects.toml"

for name in alone effects; do
  "$tool" export -q -m "$work/$name.toml" --c "$work/$name.h" > /dev/null
  cat > "$work/$name.c" <<END
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "$name.h"
int main(void)
{
    enum { CALLS = 1000000 };
    double q[7] = {0.1, 0.2, -0.3, -1.2, 0.4, 1.1, 0.3}, v[7], a[7], tau[7], sum = 0.0;
    struct timespec begin, end;
    ${name}_state state;
    int k, j;
    ${name}_init(&state, q);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    for (k = 0; k < CALLS; k++) {
        for (j = 0; j < 7; j++) {
            q[j] += 1e-6;
            v[j] = 0.001 * (k % 500 - 250);
            a[j] = 0.01 * j + 1e-5 * k;
        }
        ${name}_step(&state, 1e-3, q, v, a, tau);
        sum += tau[0];
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    printf("$name: %.3f us a call (sum %g)\n",
           ((end.tv_sec - begin.tv_sec) * 1e9 + (end.tv_nsec - begin.tv_nsec)) / 1e3 / CALLS, sum);
    return 0;
}
END
  cc -std=c99 -O2 -o "$work/$name" "$work/$name.c" -lm
  "$work/$name"
done
