"""Friction of single joints, from logs in which one joint moves at a time.

cft-ident example cft
python joint_friction.py cft/robot.toml friction.toml cft/q4.csv cft/q5.csv
"""

import sys

import cft_ident as ci

robot, output, *logs = sys.argv[1:]
found = ci.friction(robot, logs)
for joint in found.to_dict()["joints"]:
    for name, parameter in joint["parameters"].items():
        # no value: these data do not determine it
        if parameter["value"] is not None and parameter["std"] is not None:
            print(f"{joint['joint']}: {name} = {parameter['value']:.3f} ± {parameter['std']:.3f} {parameter['unit']}")
# `lsq` takes this file as its friction
found.model.save(output)
