"""Models compute with arrays: torques, their parts and their derivatives belong together."""

import copy
import ctypes
import pathlib
import pickle
import re
import shutil
import subprocess

import cft_ident as ci
import numpy as np
import pytest


@pytest.fixture(scope="module")
def model(measured):
    return ci.lsq("configs/ur10.toml", measured("ur10/ur10_exciting.csv")).model


def motion(count, joints, seed=1):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-1.0, 1.0, (count, joints)) for _ in range(3)]


def test_torques_are_links_and_friction_and_one_row_is_a_row_of_many(model):
    q, v, a = motion(40, 6)
    tau = model.torque(q, v, a)
    theta = np.array([p.in_use for p in model.parameters.itertuples() if p.joint is None])
    offset = np.array([p.in_use for p in model.parameters.itertuples() if p.parameter == "offset"])
    offset = offset if len(offset) else np.zeros(6)
    assert np.allclose(tau, model.regressor(q, v, a) @ theta + model.friction(v) + offset)
    assert np.allclose(model.torque(q[3], v[3], a[3]), tau[3])
    still = np.zeros_like(q)
    assert np.allclose(model.torque(q, still, still), model.gravity(q) + offset)


def test_blocks_of_the_regressor_are_its_rows_one_after_the_other(model):
    motions = motion(25, 6)
    blocks = list(model.regressor_blocks(*motions, rows=10))
    assert [len(block) for block in blocks] == [10, 10, 5]
    assert np.array_equal(np.concatenate(blocks), model.regressor(*motions))


def test_the_mass_matrix_is_symmetric_positive_and_the_derivative_of_the_torque(model):
    q, v, a = motion(20, 6)
    mass = model.mass_matrix(q)
    assert mass.shape == (20, 6, 6)
    assert np.allclose(mass, np.swapaxes(mass, 1, 2))
    assert np.linalg.eigvalsh(mass).min() > 0.0
    step = model.torque(q, v, a + 1.0) - model.torque(q, v, a)
    assert np.allclose(step, mass.sum(axis=2))


def test_the_covariance_is_named_as_the_parameters_and_has_their_deviations(model):
    frame = model.parameters
    names = [p.parameter if p.joint is None else f"{p.parameter}:{p.joint}" for p in frame.itertuples()]
    covariance = model.covariance
    for name, std in zip(names, frame["std"]):
        if name in covariance.columns and np.isfinite(std):
            assert np.isclose(np.sqrt(covariance.loc[name, name]), std, rtol=1e-6)


def test_arrays_that_do_not_belong_are_refused_by_name(model):
    q, v, a = motion(3, 6)
    with pytest.raises(ci.UsageError, match=re.escape("q has shape (3, 5)") + ".*q1, q2, q3, q4, q5, q6"):
        model.torque(q[:, :5], v[:, :5], a[:, :5])
    with pytest.raises(ci.UsageError, match=re.escape("v has shape (2, 6), and q (3, 6)")):
        model.torque(q, v[:2], a)
    with pytest.raises(ci.UsageError, match=re.escape("a has shape (6,), and q (3, 6)")):
        model.load_torque(q, v, a[0])
    a[1, 4] = np.nan
    with pytest.raises(ci.UsageError, match="a is NaN in row 1, joint q5"):
        model.torque(q, v, a)
    with pytest.raises(ci.UsageError, match="takes one sample"):
        model.start(q[0]).step(0.001, q, v, v)
    with pytest.raises(ci.UsageError, match="dt is 0"):
        model.start(q[0]).step(0.0, q[0], v[0], v[0])


@pytest.fixture(scope="module")
def remembering(model):
    """The model with an effect at every joint that remembers the motion."""
    effect = """[[effect]]
name = "presliding"
joint = "{}"
[effect.parameters]
sigma0 = {{ value = 600.0 }}
sigma1 = {{ value = 1.0 }}
fc = {{ value = 0.5 }}

"""
    head, rest = model.text.split("[provenance]")
    return ci.Model.parse(head + "".join(map(effect.format, model.joints)) + "[provenance]" + rest)


def wave(count=400, joints=6, dt=0.002):
    t = dt * np.arange(count)[:, None]
    w, phase = 3.0 + np.arange(joints), 0.3 * np.arange(joints)
    return 0.4 * np.sin(w * t + phase), 0.4 * w * np.cos(w * t + phase), -0.4 * w**2 * np.sin(w * t + phase), dt


def test_steps_are_the_rows_of_whole_motions(model, remembering):
    q, v, a, dt = wave()
    with pytest.raises(ci.UsageError, match="remember the motion.*model.start"):
        remembering.torque(q, v, a)
    for of in (model, remembering):
        state = of.start(q[0])
        steps = np.array([state.step(dt, *row) for row in zip(q, v, a)])
        assert np.isclose(state.t, dt * len(q))
        assert np.allclose(steps, of.torque(q, v, a, dt=dt), atol=1e-9)


def test_steps_are_those_of_exported_c(remembering, tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler `cc`")
    remembering.to_c(tmp_path / "arm.h")
    (tmp_path / "arm.c").write_text("""#include "arm.h"
static arm_state state;
void start(const double *q) { arm_init(&state, q); }
void step(double dt, const double *q, const double *v, const double *a, double *tau) { arm_step(&state, dt, q, v, a, tau); }
""")
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "arm.c", "-o", "arm.so", "-lm"], cwd=tmp_path, check=True)
    code = ctypes.CDLL(str(tmp_path / "arm.so"))
    pointer = lambda x: x.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    q, v, a, dt = wave()
    code.start(pointer(q[0]))
    state, theirs = remembering.start(q[0]), np.zeros(6)
    for row in zip(q, v, a):
        code.step(ctypes.c_double(dt), *map(pointer, row), pointer(theirs))
        assert np.allclose(state.step(dt, *row), theirs, atol=1e-9)


def test_models_robots_and_logs_are_pickled_and_copied(model, slide, slide_robot):
    q, v, a = motion(4, 6)
    for again in (pickle.loads(pickle.dumps(model)), copy.copy(model), copy.deepcopy(model)):
        assert again.text == model.text and np.array_equal(again.torque(q, v, a), model.torque(q, v, a))
    robot = pickle.loads(pickle.dumps(slide_robot))
    log = copy.deepcopy(ci.Log.arrays(*slide(3), name="monday"))
    assert log.name == "monday" and robot.name == "slide.toml"
    assert ci.lsq(robot, log).json == ci.lsq(slide_robot, ci.Log.arrays(*slide(3), name="monday")).json


def test_a_model_is_written_for_other_programs(model, tmp_path):
    model.to_c(tmp_path / "arm.h")
    model.to_urdf(tmp_path / "arm.urdf")
    model.to_mjcf(tmp_path / "arm.xml")
    assert "_tau(" in (tmp_path / "arm.h").read_text()
    assert (tmp_path / "arm.toml").exists() and (tmp_path / "arm.xml").exists()


def test_friction_compensation_is_silent_at_rest_continuous_and_friction_at_speed(model):
    still = np.zeros((1, 6))
    assert not model.friction_compensation(still + 0.0099, still).any()
    fast = still + 0.3
    assert np.allclose(model.friction_compensation(fast, fast), model.friction(fast))
    wanted = np.linspace(-0.05, 0.05, 2001)[:, None] + still
    steps = np.diff(model.friction_compensation(np.zeros_like(wanted), wanted), axis=0)
    # no more than the friction over one speed of rest, of which a step is 1/200
    assert np.abs(steps).max() <= np.abs(model.friction(still + 0.01)).max() / 150


def test_the_loop_of_the_manual_runs(model, tmp_path, monkeypatch):
    page = (pathlib.Path(__file__).parents[2] / "docs/use.md").read_text()
    monkeypatch.chdir(tmp_path)
    model.save("model.toml")
    words = {}
    exec(page.split("```python\n")[1].split("```")[0], words)
    q = np.array([0.1, -1.0, 0.5, 0.2, 0.4, 0.0])
    rest = np.zeros(6)
    tau = words["control"](np.ones(6), np.ones(6), q, rest, q, rest, rest)
    assert np.allclose(tau, model.gravity(q))


def test_every_command_takes_the_model(model, measured, tmp_path):
    log = measured("ur10/ur10_exciting.csv") + "@70..100%"
    assert "parameters" in ci.show(model).to_dict()
    assert ci.compare(model, model, log).to_dict()["schema"] == "cft-ident/compare/1"
    ci.torque(model, log, tmp_path / "tau.csv")
    ci.watch(model, log, tmp_path / "external.csv", false_alarms=2.0)
    ci.convert(log, tmp_path / "log.mcap", robot="configs/ur10.toml")
    found = ci.payload(model, log, tmp_path / "loaded.toml")
    assert found.to_dict()["readings"] and found.model.joints == model.joints
    model.to_ros2_control(tmp_path / "gains.yaml")
    assert "joint_trajectory_controller" in (tmp_path / "gains.yaml").read_text()
