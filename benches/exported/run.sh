#!/bin/bash
# CPU time of a call of exported C for the Panda: its torque with seven joints alone, and with four effects at each, one
# of which remembers the motion; and a row of the observer of external torques. Writes docs/results/exported.json.
#   benches/exported/run.sh [TOOL]        (target/release/cft-ident where absent)
set -euo pipefail
tool=$(realpath "${1:-target/release/cft-ident}")
cd "$(dirname "$0")/../.."
log=../shared/data/panda/panda_exciting.csv
[ -f "$log" ] || { echo "exported: SKIPPED, $log is not there (docs/results/measured/data.md says where it is from)"; exit 0; }
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

# NAME FUNCTION: a program that calls it a million times along a motion; the median of five runs in microseconds
measure() {
  local name=$1
  shift
  cat > "$work/$name.c" <<END
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "$name.h"
int main(void)
{
    enum { CALLS = 1000000 };
    double q[7] = {0.1, 0.2, -0.3, -1.2, 0.4, 1.1, 0.3}, v[7] = {0.0}, a[7] = {0.0}, tau[7] = {0.0}, sum = 0.0;
    struct timespec begin, end;
    $1
    int k, j;
    $2
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    for (k = 0; k < CALLS; k++) {
        for (j = 0; j < 7; j++) {
            q[j] += 1e-6;
            v[j] = 0.001 * (k % 500 - 250);
            a[j] = 0.01 * j + 1e-5 * k;
        }
        $3
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    fprintf(stderr, "$name: sum %g\n", sum + v[0] + a[0]);
    printf("%.4f\n", ((end.tv_sec - begin.tv_sec) * 1e9 + (end.tv_nsec - begin.tv_nsec)) / 1e3 / CALLS);
    return 0;
}
END
  cc -std=c99 -O2 -o "$work/$name" "$work/$name.c" -lm
  for _ in 1 2 3 4 5; do "$work/$name" 2>> "$work/sums"; done | sort -n | sed -n 3p
}

"$tool" export -q -m "$work/alone.toml" --c "$work/alone.h" > /dev/null
"$tool" export -q -m "$work/effects.toml" --c "$work/effects.h" > /dev/null
"$tool" export -q -m "$work/effects.toml" --c "$work/observer.h" --observer 1000 > /dev/null
step='_step(&state, 1e-3, q, v, a, tau); sum += tau[0];'
alone=$(measure alone 'alone_state state;' 'alone_init(&state, q);' "alone$step")
effects=$(measure effects 'effects_state state;' 'effects_init(&state, q);' "effects$step")
observer=$(measure observer 'observer_observer o; observer_observed out;' 'observer_observer_init(&o);' \
  'if (observer_observe(&o, q, tau, &out)) sum += out.std[0];')
jq -n --argjson alone "$alone" --argjson effects "$effects" --argjson observer "$observer" '
  def row($what; $us): {"exported C, seven joints, one core": $what, "a call [us]": $us,
    "ratio to the arm alone": ($us / $alone)};
  {study: "time of a call of exported C", command: "benches/exported/run.sh",
   rows: [row("torque of the arm alone"; $alone),
          row("torque with four effects at each joint, one with memory"; $effects),
          row("row of the observer by that model, deviations of the parameters in it"; $observer)]}
' | tee docs/results/exported.json
