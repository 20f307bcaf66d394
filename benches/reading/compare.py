"""Reads logs like those of benches/logs.rs with pandas and with MCAP's Python reader, beside the benchmark's medians.

Usage: compare.py CRITERION RESULT.json
CRITERION holds the results of the benchmark. Times are those of the processor, the least of five readings.
"""

import importlib.metadata
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer

ROWS, JOINTS = 50_000, 6
NAMES = [f"q{j + 1}" for j in range(JOINTS)]
JOINT_STATE = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
criterion, result_file = sys.argv[1:3]
k = np.arange(ROWS)
channels = np.sin(np.outer(k * 1e-3, np.arange(1, 2 * JOINTS + 1))) * 3.0
q, tau = channels[:, :JOINTS], channels[:, JOINTS:] * 40.0


def text(path, decimals):
    number = repr if decimals is None else (lambda x: f"{x:.{decimals}f}")
    with open(path, "w") as file:
        file.write(",".join(["t", *(f"q_{n}" for n in NAMES), *(f"tau_{n}" for n in NAMES)]) + "\n")
        for t, positions, torques in zip((k * 2e-4).tolist(), q.tolist(), tau.tolist()):
            file.write(",".join([repr(t), *map(number, positions), *map(number, torques)]) + "\n")


def recording(path, compression):
    with open(path, "wb") as file:
        writer = Writer(file, compression=compression)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for row in range(ROWS):
            ns = 1_700_000_000_000_000_000 + row * 200_000
            stamp = {"sec": ns // 10**9, "nanosec": ns % 10**9}
            state = {"header": {"stamp": stamp, "frame_id": "base"}, "name": NAMES, "velocity": []}
            state |= {"position": q[row].tolist(), "effort": tau[row].tolist()}
            writer.write_message("/joint_states", schema, state, log_time=ns, publish_time=ns, sequence=row)
        writer.finish()


def states(path):
    positions, efforts = [], []
    with open(path, "rb") as file:
        for _, _, _, state in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            positions.append(state.position)
            efforts.append(state.effort)
    return np.array(positions), np.array(efforts)


def least(read, times):
    found = []
    for _ in range(times):
        began = time.process_time()
        read()
        found.append(time.process_time() - began)
    return min(found)


def benchmark(group, name):
    place = Path(criterion) / group.replace(":", "_").replace("/", "_") / name.replace(":", "_") / "new/estimates.json"
    return json.loads(place.read_text())["median"]["point_estimate"] * 1e-9


def line(what, beside, theirs, mine):
    row = {"what": what, "beside": beside, "its us a row": f"{theirs / ROWS * 1e6:.2f}"}
    return row | {"ours": f"{mine / ROWS * 1e6:.2f}", "ratio": f"{theirs / mine:.1f}"}


def main():
    rows = []
    pandas_name = f"pandas {pandas.__version__}"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        for group, decimals in [("text of 13 columns, 7 decimals", 7), ("text of 13 columns, 17 digits", None)]:
            text(path, decimals)
            mine = benchmark(group, "reader")
            theirs = least(lambda: pandas.read_csv(path), 5)
            rows.append(line(group, f"{pandas_name}, read_csv", theirs, mine))
        path = Path(folder) / "log.mcap"
        official = f"mcap {importlib.metadata.version('mcap')} and its ROS 2 support, Python"
        for name, compression in [
            ("lz4", CompressionType.LZ4),
            ("zstd", CompressionType.ZSTD),
            ("not compressed", CompressionType.NONE),
        ]:
            group = f"recording of joint states, {name}"
            recording(path, compression)
            found = states(path)
            assert np.array_equal(found[0], q) and np.array_equal(found[1], tau)
            mine = benchmark(group, "reader")
            rows.append(line(group, official, least(lambda: states(path), 2), mine))
            plain = benchmark(group, "plain: the crate's messages, fields at fixed places")
            rows.append(line(group, "messages of the Rust crate alone, no checks", plain, mine))
    result = {
        "study": f"reading of {ROWS} rows of {JOINTS} joints beside other readers, in one run on one core",
        "command": "benches/reading/run.sh",
        "numpy": np.__version__,
        "rows": rows,
    }
    Path(result_file).write_text(json.dumps(result, indent=1) + "\n")
    for row in rows:
        print(row)


main()
