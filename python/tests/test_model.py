"""Models compute with arrays: torques, their parts and their derivatives belong together."""

import pathlib

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


def test_arrays_of_another_robot_are_refused(model):
    with pytest.raises(ci.UsageError, match="6 joints"):
        model.torque(np.zeros((3, 5)), np.zeros((3, 5)), np.zeros((3, 5)))


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
