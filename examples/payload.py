"""Mass and centre of what an arm carries, from a model of the empty arm and a log of the loaded one.

cft-ident example ur10
cft-ident lsq ur10/ur10.csv@0..70% -r ur10/ur10.toml -o empty.toml
python payload.py empty.toml ur10/ur10.csv@70..100%

This arm carries nothing in either part of its log: give a log of yours with its load.
"""

import json
import subprocess
import sys

model, log = sys.argv[1:]
# the program comes with the package
answer = subprocess.run(
    [sys.executable, "-m", "cft_ident", "payload", log, "-m", model, "--json", "-", "-q"], check=True, stdout=subprocess.PIPE
)
found = json.loads(answer.stdout)
for reading in found["readings"]:
    print(f"on {found['link']}, gains of the torques {'free' if reading['gains_free'] else 'as the model has them'}:")
    for name, number in zip(["mass", "x", "y", "z"], [reading["mass"], *reading["centre"]]):
        if number["value"] is None or number["std"] is None:
            print(f"  {name}: these data do not determine it")
        else:
            print(f"  {name} = {number['value']:.3f} ± {1.96 * number['std']:.3f} {number['unit']}")
