#!/bin/bash
# Pinocchio 4.1.0: rnea, crba and computeKineticEnergy count the armature of a joint; computeJointTorqueRegressor and
# computeKineticEnergyRegressor leave it out, so that regressor times parameters is not the model's own torque, by
# armature times acceleration, and a fit with the regressor puts the drive's inertia into the link. Seen 2026-11-29, an
# armature of 0.7 kg m^2, v = 1 rad/s, a = 2 rad/s^2:
#   torque: rnea 1.46 regressor 0.06
#   kinetic energy: model 0.365 regressor 0.015
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0
"$work/venv/bin/python" - <<'PYTHON'
import sys
import numpy, pinocchio
text = """<robot name="arm"><link name="base"/><link name="link"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="2" effort="3"/></joint></robot>"""
model = pinocchio.buildModelFromXML(text)
model.armature[:] = 0.7
data = model.createData()
q, v, a = (numpy.array([x]) for x in (0.3, 1.0, 2.0))
parameters = model.inertias[1].toDynamicParameters()
torque = float(pinocchio.rnea(model, data, q, v, a)[0])
regressor = pinocchio.computeJointTorqueRegressor(model, data, q, v, a)
by_regressor = float(numpy.ravel(regressor @ parameters)[0])
energy = float(pinocchio.computeKineticEnergy(model, data, q, v))
regressor = pinocchio.computeKineticEnergyRegressor(model, data, q, v)
energy_by_regressor = float(numpy.ravel(regressor @ parameters)[0])
print(f"torque: rnea {torque:.3g} regressor {by_regressor:.3g}")
print(f"kinetic energy: model {energy:.3g} regressor {energy_by_regressor:.3g}")
seen = [torque, by_regressor, energy, energy_by_regressor]
sys.exit(0 if numpy.allclose(seen, [1.46, 0.06, 0.365, 0.015], atol=1e-9) else 1)
PYTHON
