#!/bin/bash
# Pinocchio 4.1.0, buildModelFromMJCF: damping="0.5 0.2 0.1", which MuJoCo 4.0.0 takes for d0 v + d1 v |v| + d2 v^3, is read as
# no damping at all, and nothing is said; damping="0.5" is read. Seen 2026-11-29:
#   one number: mujoco 0.5 pinocchio 0.5
#   three numbers: mujoco 0.5 pinocchio 0.0
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 mujoco==4.0.0
"$work/venv/bin/python" - "$work/arm.xml" <<'PYTHON'
import sys
import mujoco, numpy, pinocchio
found = []
for what, damping in [("one number", "0.5"), ("three numbers", "0.5 0.2 0.1")]:
    text = (
        '<mujoco model="arm"><worldbody><body name="base"><body name="link"><joint name="j" axis="0 1 0" '
        f'damping="{damping}"/><inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.04"/></body></body></worldbody></mujoco>'
    )
    open(sys.argv[1], "w").write(text)
    first = float(numpy.ravel(mujoco.MjModel.from_xml_path(sys.argv[1]).dof_damping)[0])
    other = float(pinocchio.buildModelFromMJCF(sys.argv[1]).damping[0])
    print(f"{what}: mujoco {first} pinocchio {other}")
    found += [first, other]
sys.exit(0 if found == [0.5, 0.5, 0.5, 0.0] else 1)
PYTHON
