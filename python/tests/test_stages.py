"""The package gives the numbers of the command line, bit for bit, and its errors as exceptions."""

import copy
import os
import pickle
import re
import signal
import threading
import time

import cft_ident as ci
import numpy as np
import pandas
import pytest

SAME = ["parameters", "condition", "rank", "samples", "effective_samples", "joints", "position_cutoffs", "inputs", "warnings"]


@pytest.mark.parametrize(
    ("log", "robot", "options"),
    [
        ("emps/emps_id.csv", "configs/emps.toml", {}),
        ("emps/emps_id.csv", "configs/emps.toml", {"estimator": "irls"}),
        ("ur10/ur10_exciting.csv", "configs/ur10.toml", {}),
        ("ur10/ur10_exciting.csv", "configs/ur10.toml", {"unconstrained": True}),
    ],
)
def test_a_fit_and_its_validation_are_those_of_the_command_line(measured, tool, tmp_path, log, robot, options):
    log = measured(log)
    words = ["--estimator", options["estimator"]] if "estimator" in options else []
    words += ["--unconstrained"] if options.get("unconstrained") else []
    theirs = tool("lsq", log, "-r", robot, "-o", "model.toml", *words)
    fit = ci.lsq(ci.Robot.load(robot), log, **options)
    ours = fit.to_dict()
    for key in SAME:
        assert ours[key] == theirs[key], key
    assert fit.model.text == (tmp_path / "model.toml").read_text()
    theirs = tool("validate", log, "-m", "model.toml")
    assert ci.validate(fit.model, log).to_dict() == theirs
    frame = fit.parameters
    assert list(frame.columns) == ["parameter", "joint", "value", "std", "in_use", "unit"]
    assert len(frame) == len(ours["parameters"])


def test_errors_are_the_numbers_that_are_printed(measured, tmp_path):
    log = measured("ur10/ur10_exciting.csv")
    fit = ci.lsq("configs/ur10.toml", log + "@0..70%")
    judged = ci.validate(fit.model, log + "@70..100%")
    found = ci.diagnose(fit.model, log + "@0..70%", holdout=log + "@70..100%")
    for result in (fit, judged, found):
        printed = re.search(r"error ([\d.]+) %", repr(result)).group(1)
        assert f"{printed} %" in str(result).splitlines()[0], (repr(result), str(result)[:200])
    assert repr(fit).endswith("58 parameters)") and repr(judged).endswith("6 joints)")
    moving = [joint["relative_error_moving"] for joint in fit.to_dict()["joints"]]
    assert np.array_equal(fit.errors["error"], moving)
    assert (fit.errors["error_all_rows"] > fit.errors["error"]).any()
    assert set(found.errors) == {"joint", "before", "before_all_rows", "after", "after_all_rows"}


def test_rows_give_the_errors_again(measured):
    log = measured("ur10/ur10_exciting.csv")
    fit = ci.lsq("configs/ur10.toml", log + "@0..70%")
    judged = ci.validate(fit.model, log + "@70..100%")
    rows = judged.rows()
    assert rows.q.shape == rows.v.shape == rows.torque.shape == rows.moving.shape == (len(rows.t), 6)
    raw = np.sqrt((rows.residual**2).sum(axis=0) / (rows.torque**2).sum(axis=0))
    assert np.allclose(raw, [joint["relative_error_raw"] for joint in judged.to_dict()["joints"]])
    assert rows.moving.any(axis=0).all() and not rows.moving.all()
    assert np.abs(rows.v[~rows.moving]).max() < np.abs(rows.v).max() / 10


def test_results_are_pickled_and_copied_with_their_pages(slide, slide_robot):
    fit = ci.lsq(slide_robot, ci.Log.arrays(*slide(3)))
    again = pickle.loads(pickle.dumps(fit))
    assert repr(copy.deepcopy(again)) == repr(fit)
    assert again.html == fit.html and "<svg" in fit.html


def test_a_robot_of_a_urdf_is_that_of_new(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ci.example("ur10", "ur10")
    urdf, log = "ur10/ur10.urdf", "ur10/ur10.csv@0..70%"
    made = ci.new("arm", urdf=urdf, log=log)
    theirs = ci.lsq(made.path, log)
    for robot in (ci.Robot.from_urdf(urdf), ci.Robot.from_urdf(urdf, log=log)):
        ours = ci.lsq(robot, log)
        assert ours.to_dict()["parameters"] == theirs.to_dict()["parameters"]
        assert len(ours.html) > 0.9 * len(theirs.html)
    kept = ci.lsq(ci.Robot.from_urdf(urdf, cutoff_hz=7.5), log)
    assert kept.to_dict()["processing"]["cutoff_hz"] == 7.5 != ours.to_dict()["processing"]["cutoff_hz"]
    # the same of arrays, and everything after it
    rows = theirs.rows()
    arrays = ci.Log.arrays(rows.t, rows.q, rows.torque)
    fit = ci.lsq(ci.Robot.from_urdf(urdf), arrays)
    assert fit.to_dict()["processing"]["cutoff_hz"] == ours.to_dict()["processing"]["cutoff_hz"]
    found = ci.identify(urdf, arrays, "run")
    assert len(found.errors["error"]) == 6 and found.html == (tmp_path / "run/report.html").read_text()
    assert repr(found).startswith("Identification(error ")
    assert ci.watch(found.model, arrays, "external.csv", false_alarms=2.0).to_dict()


def test_arguments_in_the_wrong_place_are_refused_by_name(slide, slide_robot):
    t, q, tau = slide(3)
    with pytest.raises(ci.UsageError, match="t runs backwards.*order is t, q, tau"):
        ci.Log.arrays(q, t, tau)
    with pytest.raises(ci.UsageError, match="tau has shape"):
        ci.Log.arrays(t, q, tau[:-1])
    with pytest.raises(ci.UsageError, match="q is nan in row 4, column 0"):
        ci.Log.arrays(t, np.where(np.arange(len(t)) == 4, np.nan, q), tau)
    log = ci.Log.arrays(t, q, tau)
    with pytest.raises(ci.UsageError, match="a log is asked for.*Robot.*robot or model first"):
        ci.lsq(log, slide_robot)
    with pytest.raises(ci.UsageError, match="a robot or the path of its file is asked for first"):
        ci.lsq(log, log)
    with pytest.raises(ci.UsageError, match="a log is asked for.*configs/ur10.toml"):
        ci.lsq(slide_robot, "configs/ur10.toml")
    with pytest.raises(ci.UsageError, match="a log is asked for.*Model.*robot or model first"):
        ci.validate(log, ci.lsq(slide_robot, log).model)


@pytest.mark.parametrize(("log", "robot"), [("emps/emps_id.csv", "configs/emps.toml"), ("ur10/ur10_exciting.csv", "configs/ur10.toml")])
def test_documents_are_those_of_the_program(measured, tool, log, robot):
    words = {part: measured(log) + span for part, span in (("fit", "@0..70%"), ("held out", "@70..100%"))}
    logs = {part: ci.Log.load(path) for part, path in words.items()}
    fit = ci.lsq(ci.Robot.load(robot), logs["fit"])
    assert fit.to_dict() == tool("lsq", words["fit"], "-r", robot, "-o", "model.toml")
    theirs = tool("validate", words["held out"], "-m", "model.toml")
    # the second call takes the log that the first one read
    assert all(ci.validate(fit.model, logs["held out"]).to_dict() == theirs for _ in range(2))
    theirs = tool("diagnose", words["fit"], "-m", "model.toml", "--holdout", words["held out"])
    assert ci.diagnose(fit.model, logs["fit"], holdout=logs["held out"]).to_dict() == theirs


def test_reduced_logs_are_those_of_the_command_line(measured, tool, tmp_path):
    log = measured("ur10/ur10_exciting.csv")
    tool("reduce", log, "-r", "configs/ur10.toml", "-o", "part.cfi")
    part = ci.reduce("configs/ur10.toml", log)
    assert part.to_bytes() == (tmp_path / "part.cfi").read_bytes()
    assert pickle.loads(pickle.dumps(part)).to_bytes() == part.to_bytes()
    theirs = tool("lsq", "part.cfi", "-r", "configs/ur10.toml", "-o", "model.toml")
    assert ci.lsq("configs/ur10.toml", part).to_dict()["parameters"] == theirs["parameters"]
    assert part.logs[0]["name"] == "ur10_exciting.csv"


def test_friction_and_diagnosis_are_those_of_the_command_line(measured, tool, tmp_path):
    log = measured("emps/emps_id.csv")
    theirs = tool("friction", log, "-r", "configs/emps.toml", "-o", "friction.toml")
    fit = ci.friction("configs/emps.toml", log)
    assert fit.to_dict()["joints"] == theirs["joints"]
    assert fit.model.text == (tmp_path / "friction.toml").read_text()
    model = ci.lsq("configs/emps.toml", log).model
    model.save(tmp_path / "model.toml")
    theirs = tool("diagnose", log + "@0..30%", "-m", "model.toml")
    ours = ci.diagnose(model, log + "@0..30%").to_dict()
    assert ours["verdict"] == theirs["verdict"] and ours["candidates"] == theirs["candidates"]


def test_arrays_and_frames_are_the_file(slide, slide_robot, tmp_path):
    t, q, tau = slide(3)
    frame = pandas.DataFrame({"t": t, "q_slide": q, "tau_slide": tau})
    frame.to_csv(tmp_path / "log.csv", index=False)
    of_file = ci.lsq(slide_robot, tmp_path / "log.csv").to_dict()
    of_arrays = ci.lsq(slide_robot, ci.Log.arrays(t, q, tau)).to_dict()
    of_frame = ci.lsq(slide_robot, ci.Log.frame(frame, ["slide"])).to_dict()
    assert of_arrays["parameters"] == of_file["parameters"] == of_frame["parameters"]
    values = [p["value"] for p in of_file["parameters"]]
    assert np.allclose(values, [12.0, 30.0, 8.0, 4.0], rtol=0.05)


def test_parts_merge_in_any_order_and_are_followed(slide, slide_robot):
    logs = [ci.Log.arrays(*slide(k, start=3600.0 * k), name=f"log{k}") for k in range(6)]
    parts = [ci.reduce(slide_robot, log) for log in logs]
    whole = ci.merge(parts)
    assert ci.merge([ci.merge(parts[4:]), ci.merge(parts[:4])]).to_bytes() == whole.to_bytes()
    together, alone = ci.lsq(slide_robot, whole).to_dict(), ci.lsq(slide_robot, logs).to_dict()
    for one, other in zip(together["parameters"], alone["parameters"]):
        assert abs(one["value"] - other["value"]) < 1e-9 * max(abs(other["value"]), other["std"])
    found = ci.track(parts)
    assert found.to_dict()["robots"][0]["changes"] == []
    assert len(found.courses()) == 4 * 6 and found.changes().empty
    assert "<svg" in found.html


def test_files_are_looked_at_simulated_designed_and_exported(tmp_path):
    log = tmp_path / "q4.csv"
    made = ci.simulate("configs/cft.toml", log, move="q4", seconds=6.0, seed=2)
    assert made.path == str(log) and log.exists()
    seen = ci.inspect(log, "configs/cft.toml").to_dict()
    assert seen["rate_hz"] > 100.0
    fit = ci.friction("configs/cft.toml", log)
    assert fit._repr_html_().startswith("<iframe") and "q4" in str(fit)
    judged = ci.inspect(log)
    assert judged._repr_html_().startswith("<pre>")


def test_errors_are_exceptions_that_say_file_and_remedy(slide, slide_robot, tmp_path):
    with pytest.raises(ci.InputError, match="none.csv.*check the path"):
        ci.lsq("configs/emps.toml", "none.csv")
    bad = tmp_path / "bad.csv"
    bad.write_text("t,q_slide,tau_slide\n0,0,1\n0.01,x,1\n")
    with pytest.raises(ci.InputError, match="bad.csv"):
        ci.lsq(slide_robot, bad)
    with pytest.raises(ci.UsageError, match="no estimator `best`"):
        ci.lsq(slide_robot, ci.Log.arrays(*slide(1)), estimator="best")
    with pytest.raises(ci.InputError, match="ci.toml|robot|key"):
        ci.Robot.parse("[robot]\nmodell = 1\n", "ci.toml")
    part = ci.reduce(slide_robot, ci.Log.arrays(*slide(1)))
    with pytest.raises(ci.InputError, match="damaged"):
        data = bytearray(part.to_bytes())
        data[len(data) // 2] ^= 1
        ci.Part.from_bytes(bytes(data))
    with pytest.raises(ci.InputError, match="twice|same rows|holds rows"):
        ci.merge([part, part, ci.reduce(slide_robot, ci.Log.arrays(*slide(2)))])
    with pytest.raises(ci.UsageError):
        ci.inspect([])
    still = ci.Log.arrays(np.arange(0, 5, 0.01), np.zeros(500), np.ones(500))
    with pytest.raises(ci.CftIdentError):
        ci.lsq(slide_robot, still)


def test_ctrl_c_ends_a_stage_and_other_threads_run_meanwhile(measured):
    log = measured("ur10/ur10_exciting.csv")
    fit = ci.lsq("configs/ur10.toml", log)
    ticks, done = [], threading.Event()

    def interrupt():
        begun = time.monotonic()
        while time.monotonic() < begun + 0.5:
            ticks.append(0)
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)
        done.set()

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(100):
            ci.diagnose(fit.model, log)
    thread.join()
    assert done.is_set() and len(ticks) > 10
