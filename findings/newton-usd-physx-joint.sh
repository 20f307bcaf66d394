#!/bin/bash
# newton 1.8.0, ModelBuilder.add_usd: of a joint that says armature, friction and damping by PhysxJointAPI and
# PhysxJointAxisAPI alone, as Isaac Sim reads them, all three arrive as 0, and nothing is said; by newton's own attributes they
# arrive, damping per degree. Seen 2026-11-29:
#   PhysX attributes: armature 0.0 friction 0.0 damping 0.0
#   newton attributes: armature 0.25 friction 0.5 damping 42.971836
# Ends with another status than 0 where that has changed.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check newton==1.8.0 newton-usd-schemas==0.6.0 usd-core==26.11
"$work/venv/bin/python" - "$work" <<'PYTHON' 2> /dev/null
import sys
import newton
TEXT = """#usda 1.0
(
    defaultPrim = "arm"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
)
def Xform "arm" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{
    def PhysicsScene "scene"
    {
    }
    def Xform "base" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI"]
    )
    {
    }
    def PhysicsFixedJoint "root"
    {
        rel physics:body1 = </arm/base>
    }
    def Xform "link" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
    )
    {
        float physics:mass = 1
        float3 physics:diagonalInertia = (0.1, 0.1, 0.1)
    }
    def PhysicsRevoluteJoint "j" (
        prepend apiSchemas = ["PhysxJointAxisAPI:angular", "PhysxJointAPI", "NewtonJointAPI"]
    )
    {
        rel physics:body0 = </arm/base>
        rel physics:body1 = </arm/link>
        uniform token physics:axis = "Z"
NUMBERS
    }
}
"""
PHYSX = """
        float physxJoint:armature = 0.25
        float physxJointAxis:angular:armature = 0.25
        float physxJointAxis:angular:staticFrictionEffort = 0.5
        float physxJointAxis:angular:dynamicFrictionEffort = 0.5
        float physxJointAxis:angular:viscousFrictionCoefficient = 0.75
"""
OWN = """
        float newton:armature = 0.25
        float newton:friction = 0.5
        float newton:damping = 0.75
"""
found = []
for what, numbers in [("PhysX attributes:", PHYSX), ("newton attributes:", OWN)]:
    # a file that was opened once stays as it was under its name
    path = f"{sys.argv[1]}/{what[:5]}.usda"
    with open(path, "w") as file:
        file.write(TEXT.replace("NUMBERS", numbers))
    builder = newton.ModelBuilder()
    builder.add_usd(path)
    model = builder.finalize(device="cpu")
    read = [float(x.numpy()[-1]) for x in [model.joint_armature, model.joint_friction, model.joint_damping]]
    print(what, "armature", round(read[0], 6), "friction", round(read[1], 6), "damping", round(read[2], 6))
    found.append([round(x, 6) for x in read])
sys.exit(0 if found == [[0.0, 0.0, 0.0], [0.25, 0.5, 42.971836]] else 1)
PYTHON
