"""A robot file of a chain of so many revolute joints, and a log in which only drives and friction have torques.

Usage: joints.py JOINTS ROWS ROBOT.toml LOG.csv
"""

import sys

import numpy as np

joints, rows = (int(x) for x in sys.argv[1:3])
names = [f"q{j + 1}" for j in range(joints)]
turned = [0.0, 1.5707963267948966]
with open(sys.argv[3], "w") as out:
    print('[robot]\nmodel = "serial"\ndrive_inertia = true', file=out)
    for j, name in enumerate(names):
        print(f'\n[[robot.link]]\njoint = "{name}"\nxyz = [0.1, 0.0, 0.2]\nrpy = [{turned[j % 2]}, 0.0, 0.0]', file=out)
    print('\n[friction]\nlaw = "viscous-coulomb"\nfitted_with_inertias = true\noffset = true', file=out)
    print('\n[log]\ntorque_is = "joint"\n[log.joint]', file=out)
    for name in names:
        print(f'{name} = {{ position = "{name}", torque = "tau_{name}" }}', file=out)
    print("\n[filter]\ncutoff_hz = 10.0", file=out)

rng = np.random.default_rng(1)
t = np.arange(rows) * 1e-3
q, v, a = np.zeros((3, joints, rows))
for j in range(joints):
    for harmonic in range(1, 6):
        w = 2 * np.pi * 0.1 * harmonic
        size, phase = rng.uniform(0.05, 0.15), rng.uniform(0, 2 * np.pi)
        q[j] += size * np.sin(w * t + phase)
        v[j] += size * w * np.cos(w * t + phase)
        a[j] -= size * w * w * np.sin(w * t + phase)
tau = 2.0 * a + 0.5 * v + 0.3 * np.sign(v) + rng.normal(0, 0.01, v.shape)
header = ",".join(["t", *names, *[f"tau_{name}" for name in names]])
np.savetxt(sys.argv[4], np.vstack([t, q, tau]).T, delimiter=",", header=header, comments="", fmt="%.9g")
