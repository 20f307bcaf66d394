"""Identifies an arm: fits 70 % of a log, judges the model on the rest, and looks for effects that it lacks.

cft-ident example ur10
python identify_arm.py ur10/ur10.toml ur10/ur10.csv refined.toml
"""

import sys

import cft_ident as ci

robot, log, output = sys.argv[1:]
fitted, held_out = f"{log}@0..70%", f"{log}@70..100%"

model = ci.lsq(robot, fitted).model
for joint in ci.validate(model, held_out).to_dict()["joints"]:
    print(f"{joint['joint']}: misses {100 * joint['relative_error']:.1f} % of its torque")

found = ci.diagnose(model, fitted, holdout=held_out)
for step in found.to_dict()["steps"]:
    if step["written"]:
        print(f"missing: {step['effect']} of {step['joint'] or 'all joints'}")
if found.model is not None:
    found.model.save(output)
