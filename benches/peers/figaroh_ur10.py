"""Held-out torque errors of figaroh's weighted least squares on the log of README, beside those of cft-ident.

Usage: figaroh_ur10.py FOLDER RESULT.json     (FOLDER: `cft-ident example ur10`, fit.json and diagnosis.json)
Positions and torques pass figaroh's filters (median of 5, Butterworth of 4th order) at 5 Hz, which serves it better than
10 or 20 Hz; the first 70 % are fitted, the last 30 % judged, filtered in the same way.
"""

import csv
import importlib.metadata
import json
import pathlib
import re
import sys
import tempfile

import numpy as np
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.load_robot import load_robot
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced

folder, result = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
with open(folder / "ur10.csv") as file:
    head, *rows = csv.reader(line for line in file if not line.startswith("#"))
table = np.array(rows, dtype=float)
columns = {kind: [k for k, name in enumerate(head) if name.startswith(kind)] for kind in ("q", "tau")}
JOINTS = len(columns["q"])
FILTER = {"nbutter": 4, "f_butter": 5, "med_fil": 5, "f_sample": 125}


class Arm(BaseIdentification):
    """The arm of the log, with viscous and Coulomb friction, offset and drive inertia of every joint."""

    def load_param(self, config_file, setting_type="identification"):
        n = self.model.nv
        zeros = {key: [0.0] * n for key in ("fv", "fs", "Ia", "off", "Iam6", "fvm6", "fsm6")}
        self.identif_config = zeros | {
            "robot_name": self.model.name,
            "active_joints": [name for name in self.model.names if name != "universe"],
            "act_idxq": list(range(n)),
            "act_idxv": list(range(n)),
            "is_joint_torques": True,
            "is_external_wrench": False,
            "force_torque": None,
            "has_friction": True,
            "has_actuator_inertia": True,
            "has_joint_offset": True,
            "has_coupled_wrist": False,
            "is_static_regressor": True,
            "is_inertia_regressor": True,
            "filter_config": {"differentiation_method": "gradient", "filter_params": FILTER},
        }

    def load_trajectory_data(self, data_source=None):
        t = table[:, 0]
        end = t[0] + 0.7 * (t[-1] - t[0])
        part = table[t < end] if data_source is None else table[t >= end]
        return {
            "timestamps": part[:, 0],
            "positions": part[:, columns["q"]],
            "velocities": None,
            "accelerations": None,
            "torques": part[:, columns["tau"]],
        }

    def process_torque_data(self, **_):
        return self._apply_filters(self.raw_data["torques"], **FILTER)


def errors(arm, phi):
    """Relative error of each joint on the last part."""
    arm.raw_data = arm.load_trajectory_data("last")
    arm.process_kinematics_data(arm.filter_config)
    tau = arm.process_torque_data()
    motion = [arm.processed_data[key] for key in ("positions", "velocities", "accelerations")]
    whole = build_regressor_basic(arm.robot, *motion, arm.identif_config)
    reduced = build_regressor_reduced(whole, arm._idx_eliminated)
    hat = (reduced[:, list(arm._base_indices)] @ phi).reshape(JOINTS, -1).T
    return (np.linalg.norm(tau - hat, axis=0) / np.linalg.norm(tau, axis=0)).tolist()


with tempfile.TemporaryDirectory() as place:
    # meshes are of no use here, and are not there
    text = (folder / "ur10.urdf").read_text()
    bare = pathlib.Path(place) / "arm.urdf"
    bare.write_text(re.sub(r"<(visual|collision)\b.*?</\1>", "", text, flags=re.DOTALL))
    robot = load_robot(str(bare), package_dirs=place)
arm = Arm(robot, "")
arm.initialize()
phi = arm.solve(decimate=False, plotting=False, wls=True)


def ours(name, *keys):
    """Errors of the joints in a document of cft-ident."""
    found = json.loads((folder / name).read_text())
    for key in keys:
        found = found[key]
    return [joint["relative_error"] for joint in found["joints"]]


figaroh = "figaroh " + importlib.metadata.version("figaroh") + ", weighted least squares"
rows = [(figaroh, errors(arm, phi)), ("cft-ident, lsq", ours("fit.json"))]
rows.append(("cft-ident, diagnose", ours("diagnosis.json", "after", "holdout")))
found = {
    "study": "the first 70 % of the log of README fitted, relative torque error of each joint on the last 30 %",
    "command": "benches/peers/run.sh",
    "rows": [{"tool": tool, "joints [%]": " ".join(f"{100 * x:.1f}" for x in joints)} for tool, joints in rows],
}
result.write_text(json.dumps(found, indent=1) + "\n")
for row in found["rows"]:
    print(row)
