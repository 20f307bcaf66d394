#!/bin/bash
# Pinocchio 4.1.0, buildModelFromMJCF: <compiler eulerseq="XYZ"/>, whose capitals are turns about axes that stand still (MuJoCo's
# documentation), is read as turns about axes that turn too, and nothing is said. Seen 2026-11-29, the z axis of a body with
# euler="90 0 90":
#   mujoco [1.0, 0.0, 0.0]
#   pinocchio [0.0, -1.0, 0.0]
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 mujoco==4.0.0
"$work/venv/bin/python" - "$work/arm.xml" <<'PYTHON'
import sys
import mujoco, numpy, pinocchio
with open(sys.argv[1], "w") as file:
    file.write(
        '<mujoco model="arm"><compiler angle="degree" eulerseq="XYZ"/><worldbody><body name="base"><body name="link" '
        'euler="90 0 90"><joint name="j" axis="0 1 0"/><inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.04"/>'
        "</body></body></worldbody></mujoco>"
    )
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
stated = (data.body("link").xmat.reshape(3, 3)[:, 2].round(6) + 0.0).tolist()
read = (pinocchio.buildModelFromMJCF(sys.argv[1]).jointPlacements[1].rotation[:, 2].round(6) + 0.0).tolist()
print("mujoco", stated)
print("pinocchio", read)
sys.exit(0 if read != stated else 1)
PYTHON
