#!/bin/bash
# newton 1.8.0, ModelBuilder.add_mjcf: <option gravity="-9.81 0 0"/> is not read and nothing is said, though options are parsed by
# default (parse_mujoco_options=True); the model's gravity is along -z. Seen 2026-11-29:
#   newton gravity [0.0, 0.0, -9.81]
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check newton==1.8.0
"$work/venv/bin/python" - <<'PYTHON' 2> /dev/null
import sys
import newton
builder = newton.ModelBuilder()
builder.add_mjcf(
    '<mujoco model="arm"><option gravity="-9.81 0 0"/><worldbody><body name="base"><body name="link"><joint name="j" axis="0 1 0"/>'
    '<inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.04"/></body></body></worldbody></mujoco>',
    floating=False,
)
read = [round(float(x), 4) + 0.0 for x in builder.finalize(device="cpu").gravity.numpy().reshape(-1)[:3]]
print("newton gravity", read)
sys.exit(0 if read == [0.0, 0.0, -9.81] else 1)
PYTHON
