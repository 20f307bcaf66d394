"""Rolls out actuators that `cft-ident export --mjcf-actuators` wrote against logs of a rig, in MuJoCo.

    python mujoco_rig.py servo.xml LOG.json...        prints the mean error of each log [mrad]

A log's gain must be the one of the file. The rig is a rod with a mass at its end; 0 is down.
"""

import json
import math
import re
import sys

try:
    import mujoco
    import numpy as np
except ImportError as error:
    print(f"SKIPPED: {error}")
    sys.exit(0)


def model_of(actuators: str, log: dict):
    joint, armature, damping, friction = re.search(
        r'joint (\S+): armature="(\S+)" damping="(\S+)" frictionloss="(\S+)"', actuators
    ).groups()
    option = re.search(r"<option.*?/>", actuators).group(0)
    body = re.search(r"<actuator>.*</actuator>", actuators, re.S).group(0)
    mass, rod, length = log["mass"], log.get("arm_mass", 0.0), log["length"]
    rod = max(rod, 1e-6)
    inertia = rod * length**2 / 12
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>{option}<worldbody><body>
  <joint name="{joint}" axis="0 -1 0" armature="{armature}" damping="{damping}" frictionloss="{friction}"/>
  <inertial pos="0 0 {-length / 2}" mass="{rod}" diaginertia="{inertia} {inertia} {inertia * 1e-3 + 1e-9}"/>
  <body><inertial pos="0 0 {-length}" mass="{mass}" diaginertia="1e-9 1e-9 1e-9"/></body>
</body></worldbody>{body}</mujoco>""")


def rolled_out(model, log: dict) -> tuple:
    entries = log["entries"]
    t = np.array([e["timestamp"] for e in entries])
    goal = np.array([e["goal_position"] for e in entries])
    measured = np.array([e["position"] for e in entries])
    data = mujoco.MjData(model)
    data.qpos[0] = measured[0]
    # the delay line and the limited set point begin at the first command
    data.act[:] = measured[0] if model.na else 0
    data.ctrl[0] = goal[0]
    if model.nhistory:
        stamps = np.array([-(k + 1) * model.opt.timestep for k in range(model.actuator_history[0][0])][::-1])
        mujoco.mj_initCtrlHistory(model, data, 0, stamps, np.full(len(stamps), goal[0]))
    predicted = [measured[0]]
    for k in range(1, len(t)):
        while data.time + 0.5 * model.opt.timestep < t[k] - t[0]:
            data.ctrl[0] = np.interp(data.time + t[0], t, goal)
            mujoco.mj_step(model, data)
        predicted.append(data.qpos[0])
    return measured, np.array(predicted)


def main() -> int:
    actuators = open(sys.argv[1], encoding="utf-8").read()
    errors = []
    for path in sys.argv[2:]:
        log = json.load(open(path, encoding="utf-8"))
        measured, predicted = rolled_out(model_of(actuators, log), log)
        errors.append(1e3 * np.mean(np.abs(predicted - measured)))
        print(f"{path}: {errors[-1]:.3f} mrad")
    print(f"mean: {np.mean(errors):.3f} mrad")
    return 0 if math.isfinite(errors[-1]) else 1


sys.exit(main())
