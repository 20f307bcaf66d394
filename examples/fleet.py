"""Many logs of robots: each log is reduced once, then parameters are followed from log to log.

cft-ident example ur10
python fleet.py ur10/ur10.toml ur10/ur10.csv@0..50% ur10/ur10.csv@50..100%

A change needs six logs before it and six after.
"""

import sys

import cft_ident as ci

robot, *logs = sys.argv[1:]
parts = [ci.reduce(robot, log) for log in logs]
for log, part in zip(logs, parts):
    print(f"{log}: {len(part.to_bytes())} bytes")
followed = ci.track({robot: parts}).to_dict()
for one in followed["robots"]:
    for parameter in one["parameters"]:
        if parameter["name"] == "viscous":
            course = " ".join("-" if value is None else f"{value:.2f}" for value in parameter["values"])
            print(f"viscous of {parameter['joint']} [{parameter['unit']}]: {course}")
    for change in one["changes"]:
        print(f"{change['parameter']} of {change['joint']} changed by {change['size']:.3f} {change['unit']} at {one['logs'][change['log']]}")
