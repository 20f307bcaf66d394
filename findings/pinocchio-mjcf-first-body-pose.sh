#!/bin/bash
# Pinocchio 4.1.0, buildModelFromMJCF: the pose of the first body below <worldbody>, where it has no joint, is not read and
# nothing is said; that of a body in it is. MuJoCo 4.0.0 puts the same joint 1 m higher. Seen 2026-11-29:
#   pinocchio base with a pose [0.0, 2.0, 0.0]
#   pinocchio base in a body without one [0.0, 2.0, 1.0]
#   mujoco [0.0, 2.0, 1.0] [0.0, 2.0, 1.0]
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 mujoco==4.0.0
"$work/venv/bin/python" - "$work" <<'PYTHON'
import sys
import mujoco, pinocchio
JOINT = '<joint name="j" axis="0 1 0"/><inertial pos="0 0 1" mass="1" diaginertia="0.1 0.1 0.1"/>'
BASE = f'<body name="base" pos="0 0 1"><body name="link" pos="0 2 0">{JOINT}</body></body>'
theirs, stated = [], []
for text in [BASE, f'<body name="world_body">{BASE}</body>']:
    path = sys.argv[1] + "/arm.xml"
    with open(path, "w") as file:
        file.write(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    theirs.append(pinocchio.buildModelFromMJCF(path).jointPlacements[1].translation.tolist())
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    stated.append(data.body("link").xpos.tolist())
print("pinocchio base with a pose", theirs[0])
print("pinocchio base in a body without one", theirs[1])
print("mujoco", *stated)
sys.exit(0 if theirs == [[0, 2, 0], [0, 2, 1]] and stated == [[0, 2, 1], [0, 2, 1]] else 1)
PYTHON
