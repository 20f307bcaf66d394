"""Compensation in a control loop: a PD controller alone, and with the torque of the model along the desired motion.

The robot is a simulation by the same model; in its place stands the driver of yours.

cft-ident example ur10
cft-ident lsq ur10/ur10.csv -r ur10/ur10.toml -o model.toml
python compensation.py model.toml

`Model.to_c` writes the same torque, with effects that remember the motion too, for a real-time controller.
"""

import sys

import numpy as np

import cft_ident as ci

PERIOD, STEPS, BANDWIDTH = 5e-3, 10, 15.0  # of the controller [s], of the robot in it, of the loop [rad/s]

model = ci.Model.load(sys.argv[1])
n = len(model.joints)
rest = np.zeros((1, n))
inertia = np.diag(model.mass_matrix(rest)[0])


def tracking_error(compensated: bool) -> float:
    """Root mean square of the position error along a second and a half of a sine on every joint."""
    t = PERIOD * np.arange(300)[:, None] + np.zeros((1, n))
    w, amplitude = 2.0, 0.3
    desired = amplitude * (1 - np.cos(w * t))
    speed, acceleration = amplitude * w * np.sin(w * t), amplitude * w**2 * np.cos(w * t)
    # the torque of the model along the desired motion; gravity in any case
    ahead = model.torque(desired, speed, acceleration) if compensated else model.gravity(desired)
    q, v = np.zeros((1, n)), np.zeros((1, n))
    errors = []
    for k in range(len(t)):
        off = desired[k] - q
        errors.append(off)
        command = ahead[k] + inertia * (BANDWIDTH**2 * off + 2 * BANDWIDTH * (speed[k] - v))
        # the robot
        mass = model.mass_matrix(q)[0]
        for _ in range(STEPS):
            left = command - model.torque(q, v, rest)
            v = v + np.linalg.solve(mass, left[0]) * PERIOD / STEPS
            q = q + v * PERIOD / STEPS
    return float(np.sqrt(np.mean(np.square(errors))))


for compensated in (False, True):
    print(f"compensation {compensated}: rms tracking error {1e3 * tracking_error(compensated):.2f} mrad or mm")
