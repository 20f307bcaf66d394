#!/bin/bash
# Pinocchio 4.1.0, buildModelFromMJCF: <option gravity="-9.81 0 0"/> is not read and nothing is said; model.gravity is
# (0, 0, -9.81). MuJoCo 4.0.0 holds the joint of the same file with the gravity that it states. Seen 2026-11-29:
#   pinocchio gravity [0.0, 0.0, -9.81]
#   mujoco gravity [-9.81, 0.0, 0.0]
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 mujoco==4.0.0
cat > "$work/arm.xml" <<'XML'
<mujoco model="arm">
  <option gravity="-9.81 0 0"/>
  <worldbody>
    <body name="base">
      <body name="link">
        <joint name="j" axis="0 1 0"/>
        <inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.04"/>
      </body>
    </body>
  </worldbody>
</mujoco>
XML
"$work/venv/bin/python" - "$work/arm.xml" <<'PYTHON'
import sys
import mujoco, pinocchio
read = pinocchio.buildModelFromMJCF(sys.argv[1]).gravity.linear.tolist()
stated = mujoco.MjModel.from_xml_path(sys.argv[1]).opt.gravity.tolist()
print("pinocchio gravity", read)
print("mujoco gravity", stated)
sys.exit(0 if read == [0.0, 0.0, -9.81] and stated == [-9.81, 0.0, 0.0] else 1)
PYTHON
