"""A cluster gives the bytes of one process, whatever becomes of its workers and of bad logs."""

import os
import signal
import time

import cft_ident as ci
import numpy as np
import pytest
from cft_ident.fleet import merge_bytes, reduce_dask, reduce_one, texts, tree
from conftest import SLIDE


@pytest.fixture
def logs(slide, tmp_path):
    names = []
    for k in range(10):
        name = tmp_path / f"log{k}.csv"
        np.savetxt(name, np.column_stack(slide(k)), delimiter=",", header="t,q_slide,tau_slide", comments="")
        names.append(str(name))
    (tmp_path / "robot.toml").write_text(SLIDE)
    (tmp_path / "bad.csv").write_text("t,q_slide,tau_slide\n0,nan,x\n")
    return names


def in_one_process(names, robot):
    rows = [reduce_one(name, robot, None, None) for name in names]
    return tree(((row["key"], row["part"]) for row in rows), merge_bytes)


def test_a_tree_depends_on_nothing_but_the_keys(logs):
    whole = in_one_process(logs, SLIDE)
    assert in_one_process(logs[::-1], SLIDE) == whole
    assert ci.merge([ci.reduce(ci.Robot.parse(SLIDE), name) for name in logs]).to_bytes() == whole


def test_what_is_done_is_not_done_again_and_what_is_broken_is(logs, tmp_path):
    store = str(tmp_path / "store")
    first = reduce_one(logs[0], SLIDE, None, store)
    assert first["reused"] is False and reduce_one(logs[0], SLIDE, None, store)["reused"] is True
    kept = os.path.join(store, first["key"] + ".cfi")
    with open(kept, "r+b") as file:
        file.truncate(100)
    again = reduce_one(logs[0], SLIDE, None, store)
    assert again["reused"] is False and again["part"] == first["part"]
    other = reduce_one(logs[0], SLIDE.replace("80.0", "70.0"), None, store)
    assert other["key"] != first["key"]


def test_dask_gives_the_same_bytes_with_a_worker_killed_and_a_bad_log_told(logs, tmp_path):
    distributed = pytest.importorskip("distributed")
    whole = in_one_process(logs, SLIDE)
    bad = str(tmp_path / "bad.csv")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with distributed.Client(cluster) as client:
            pids = client.run(os.getpid)
            first = next(iter(pids.values()))
            # it dies in the middle of the work, which is slow enough to be there
            client.submit(slow_kill, first, pure=False)
            found = reduce_dask(client, [*logs, bad, logs[0]], str(tmp_path / "robot.toml"))
    assert found.part.to_bytes() == whole
    told = {os.path.basename(row["url"]): row["error"] for row in found.failures}
    assert set(told) == {"bad.csv", "log0.csv"}
    assert "bad.csv" in told["bad.csv"] and "twice" in told["log0.csv"]


def slow_kill(pid):
    time.sleep(0.05)
    os.kill(pid, signal.SIGKILL)


def test_a_robot_file_with_a_urdf_is_one_text_and_the_key_holds_the_urdf(tmp_path):
    ci.example("ur10", tmp_path / "ur10")
    log = str(tmp_path / "ur10/ur10.csv")
    urdf = tmp_path / "ur10/ur10.urdf"
    robot = ci.new(tmp_path / "arm", urdf=urdf, log=log).path
    text, _ = texts(robot, None)
    row = reduce_one(log, text, None, None)
    assert row["part"] == ci.reduce(robot, log).to_bytes()
    assert texts(ci.Robot.load(robot), None)[0] == text
    assert texts("configs/ur10.toml", None)[0]
    before = urdf.read_text()
    urdf.write_text(before.replace("0.1273", "0.1274"))
    assert before != urdf.read_text()
    assert reduce_one(log, texts(robot, None)[0], None, None)["key"] != row["key"]


def test_a_robot_that_cannot_be_read_and_logs_that_all_fail_are_one_error(logs, tmp_path):
    distributed = pytest.importorskip("distributed")
    with pytest.raises(ci.InputError, match="none.toml"):
        reduce_dask(None, logs, tmp_path / "none.toml")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with distributed.Client(cluster) as client:
            with pytest.raises(ci.InputError, match="none of 1 logs can be reduced; .*bad.csv"):
                reduce_dask(client, [str(tmp_path / "bad.csv")], tmp_path / "robot.toml")


def test_ray_gives_the_same_bytes_and_tells_a_bad_log(logs, tmp_path):
    ray = pytest.importorskip("ray")
    from cft_ident.fleet import reduce_ray

    ray.init(num_cpus=2, include_dashboard=False)
    try:
        found = reduce_ray([*logs, str(tmp_path / "bad.csv")], str(tmp_path / "robot.toml"))
    finally:
        ray.shutdown()
    assert found.part.to_bytes() == in_one_process(logs, SLIDE)
    assert [os.path.basename(row["url"]) for row in found.failures] == ["bad.csv"]
