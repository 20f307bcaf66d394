"""Fits every URDF of a folder to torques that Pinocchio computed, and compares ranks and torques with Pinocchio's.

    study.py TOOL FOLDER RESULT.json [SECONDS]

For each robot, its root fixed: `new --urdf --log` on a simulated log (a sum of sines at every joint, 20 s at 200 Hz,
inverse dynamics of Pinocchio, no noise), `lsq`, and `validate` on another motion. The rank is that of Pinocchio's
regressor over random states, with the inertia of each drive. A robot that takes longer than SECONDS counts as not done.
"""

import json
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin

RATE, SECONDS = 200.0, 20.0
# what an angle that is written with five digits adds to the regressor is no direction of its own
EDGE = 1e-5


def motion(model, seed):
    """Configurations, velocities and accelerations along sums of sines about the middle of the ranges."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(RATE * SECONDS)) / RATE
    free = [joint.nq != joint.nv for joint in list(model.joints)[1:]]
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    q, v, a = (np.zeros((len(t), model.nv)) for _ in range(3))
    for k, joint in enumerate(list(model.joints)[1:]):
        at = joint.idx_v
        low, high = (-np.pi, np.pi) if free[k] else (lower[joint.idx_q], upper[joint.idx_q])
        if not np.isfinite(high - low) or high - low > 2 * np.pi or high <= low:
            low, high = -np.pi, np.pi
        sliding = "P" in joint.shortname()
        reach = min(0.4 * (high - low), 0.3 if sliding else 1.0)
        frequency = rng.uniform(0.1, 1.0, 5)
        share = rng.uniform(0.5, 1.0, 5)
        amplitude = reach * share / share.sum()
        phase = rng.uniform(0.0, 2 * np.pi, 5)
        turn = 2 * np.pi * frequency
        angle = np.outer(t, turn) + phase
        q[:, at] = 0.5 * (low + high) + np.sin(angle) @ amplitude
        v[:, at] = np.cos(angle) @ (amplitude * turn)
        a[:, at] = -np.sin(angle) @ (amplitude * turn**2)
    return t, q, v, a


def configuration(model, angles):
    q = pin.neutral(model)
    for joint in list(model.joints)[1:]:
        x = angles[joint.idx_v]
        if joint.nq == 2:
            q[joint.idx_q : joint.idx_q + 2] = np.cos(x), np.sin(x)
        else:
            q[joint.idx_q] = x
    return q


def write(model, path, seed):
    data = model.createData()
    t, q, v, a = motion(model, seed)
    tau = np.array([pin.rnea(model, data, configuration(model, x), y, z) for x, y, z in zip(q, v, a)])
    names = list(model.names)[1:]
    header = ["t", *(f'"q_{name}"' for name in names), *(f'"tau_{name}"' for name in names)]
    np.savetxt(path, np.column_stack([t, q, tau]), delimiter=",", header=",".join(header), comments="", fmt="%.12g")
    return tau


def rank(model):
    """Rank of the regressor of the inertial parameters and of the inertia of each drive over random states."""
    data = model.createData()
    rng = np.random.default_rng(1)
    rows = []
    for _ in range(300):
        q = configuration(model, rng.uniform(-1, 1, model.nv))
        v, a = rng.normal(size=model.nv), rng.normal(size=model.nv) * 3
        links = pin.computeJointTorqueRegressor(model, data, q, v, a)
        rows.append(np.hstack([links, np.diag(a)]))
    singular = np.linalg.svd(np.linalg.qr(np.vstack(rows), mode="r"), compute_uv=False)
    return int((singular > EDGE * singular[0]).sum())


def run(tool, limit, folder, *arguments):
    line = [tool, *map(str, arguments), "-q"]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=limit)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().split("\n")[-1 if "error" not in done.stderr else 0][:200])
    return json.loads(done.stdout) if "--json" in line else None


def robot(tool, urdf, limit):
    model = pin.buildModelFromUrdf(str(urdf))
    tree = xml.etree.ElementTree.parse(urdf)
    found = {"robot": urdf.stem, "joints": model.nv}
    moving = {"revolute", "prismatic", "continuous"}
    mimic = [
        joint.get("name")
        for joint in tree.iter("joint")
        if joint.find("mimic") is not None and joint.get("type") in moving
    ]
    if model.nv == 0 or mimic:
        why = "no joint moves" if model.nv == 0 else "joints that follow others, which Pinocchio's regressor lacks"
        return found | {"skipped": why}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        write(model, folder / "fit.csv", 1)
        tau = write(model, folder / "other.csv", 2)
        run(tool, limit, folder, "new", "robot", "--urdf", urdf, "--log", "fit.csv")
        base = run(
            tool, limit, folder, "lsq", "fit.csv", "-r", "robot.toml", "-o", "model.toml", "--unconstrained",
            "--as-declared", "--json", "-",
        )
        errors = run(tool, limit, folder, "validate", "other.csv", "-m", "model.toml", "--json", "-")
    friction = {"viscous", "coulomb", "offset"}
    inertial = [p for p in base["parameters"] if p["name"] not in friction]
    found["rank"] = {"pinocchio": rank(model), "cft_ident": len(inertial)}
    moved = np.sqrt((tau**2).mean(axis=0))
    known = dict(zip(list(model.names)[1:], moved))
    worst = [j for j in errors["joints"] if known.get(j["joint"], 1.0) > 1e-6 * moved.max()]
    found["largest_error"] = max((j["relative_error"] for j in worst), default=0.0)
    return found


def main(tool, folder, result, limit="600"):
    tool, found = Path(tool).resolve(), []
    for urdf in sorted(Path(folder).rglob("*.urdf"), key=lambda path: (path.stem, path)):
        try:
            one = robot(tool, urdf, float(limit))
        except subprocess.TimeoutExpired:
            one = {"robot": urdf.stem, "failed": f"takes longer than {limit} s"}
        except Exception as error:
            one = {"robot": urdf.stem, "failed": str(error).replace(str(urdf), urdf.name)[:200]}
        print(one, flush=True)
        found.append(one)
    fitted = [one for one in found if "largest_error" in one]
    whole = [one for one in fitted if one["rank"]["cft_ident"] >= one["rank"]["pinocchio"]]
    row = {
        "URDF files": len(found),
        "fitted": len(fitted),
        "refused": sum("failed" in one for one in found),
        "not compared": sum("skipped" in one for one in found),
        "rank of Pinocchio's regressor": f"{len(whole)} of {len(fitted)}",
        "every joint within 0.5 % of Pinocchio": f"{sum(one['largest_error'] < 0.005 for one in fitted)} of {len(fitted)}",
        "largest error of a joint": f"{max(one['largest_error'] for one in fitted):.1e}",
    }
    summary = {
        "study": f"URDF files of example-robot-data fitted to torques of Pinocchio {pin.__version__}, another motion",
        "command": "benches/robots/run.sh",
        "rows": [row],
        "robots": found,
    }
    Path(result).write_text(json.dumps(summary, indent=1) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
