"""A vertical arm of two joints whose torques are known, and writers of every container that logs come in.

The torques are those of closed equations; nothing of the program under test is used.
"""

import json
import sqlite3
import struct

import numpy as np

JOINTS = ["shoulder", "elbow"]
EPOCH_NS = 1_700_000_000_000_000_000

ROBOT = """\
[robot]
model = "serial"

[[robot.link]]
joint = "shoulder"
alpha = 1.5707963267948966

[[robot.link]]
joint = "elbow"
a = 0.4

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
torque_is = "joint"
"""

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


def torque(q, v, a):
    """Torques [Nm]: two links of 3 and 2 kg, centres 0.2 and 0.15 m away, friction, an offset."""
    l1, m1r1, m2, m2r2, i1, i2, g = 0.4, 0.6, 2.0, 0.3, 0.16, 0.06, 9.81
    c2, s2 = np.cos(q[:, 1]), np.sin(q[:, 1])
    both = i2 * (a[:, 0] + a[:, 1]) + g * m2r2 * np.cos(q[:, 0] + q[:, 1])
    first = (i1 + m2 * l1**2) * a[:, 0] + both + g * (m1r1 + m2 * l1) * np.cos(q[:, 0])
    first += l1 * m2r2 * ((2 * a[:, 0] + a[:, 1]) * c2 - (2 * v[:, 0] * v[:, 1] + v[:, 1] ** 2) * s2)
    second = both + l1 * m2r2 * (a[:, 0] * c2 + v[:, 0] ** 2 * s2)
    return np.column_stack([first, second]) + v * [1.2, 0.5] + np.sign(v) * [1.5, 0.8] + [0.3, -0.2]


def drive(seed, seconds=20.0, rate=250.0, noise=0.01):
    """A log: t, q, dq, tau. Positions have steps of 10 urad, torques white noise of a share of their rms."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * rate)) / rate
    q, v, a = np.zeros((3, len(t), 2))
    for j in range(2):
        for hz in rng.uniform(0.1, 0.9, 4):
            size, phase, w = rng.uniform(0.1, 0.35), rng.uniform(0, 2 * np.pi), 2 * np.pi * hz
            q[:, j] += size * np.sin(w * t + phase)
            v[:, j] += size * w * np.cos(w * t + phase)
            a[:, j] -= size * w**2 * np.sin(w * t + phase)
    tau = torque(q, v, a)
    tau += rng.standard_normal(tau.shape) * noise * np.sqrt((tau**2).mean(0))
    q = np.round((q + 2e-6 * rng.standard_normal(q.shape)) / 1e-5) * 1e-5
    return {"t": t, "q": q, "dq": v, "tau": tau, "publisher": np.zeros(len(t), int)}


def columns(log):
    kinds = [("q", log["q"]), ("dq", log["dq"]), ("tau", log["tau"])]
    named = {f"{kind}_{joint}": x[:, j] for kind, x in kinds for j, joint in enumerate(JOINTS)}
    return {"t": log["t"], **named}


def write_csv(path, log):
    table = columns(log)
    rows = zip(*(column.tolist() for column in table.values()))
    with open(path, "w") as file:
        file.write(",".join(table) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in rows)


def write_npz(path, log):
    np.savez(path, **columns(log))


def write_parquet(path, log):
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(columns(log)), path)


def nanoseconds(t):
    """The stamp of a time; one that no stamp can hold is 0, as of a clock that is not set."""
    whole = EPOCH_NS + round(t * 1e9) if np.isfinite(t) and abs(t) < 1e30 else 0
    return whole if 0 <= whole < 2**31 * 10**9 else 0


def arrivals(log):
    """Times of recording: rows arrive one after the other, whatever their stamps say."""
    return [EPOCH_NS + 4_000_000 * k for k in range(len(log["t"]))]


def cdr(stamp, q, dq, tau):
    out = bytearray(b"\x00\x01\x00\x00" + struct.pack("<iI", *divmod(stamp, 10**9)))

    def align(size):
        out.extend(b"\x00" * (-(len(out) - 4) % size))

    def text(word):
        align(4)
        out.extend(struct.pack("<I", len(word) + 1) + word.encode() + b"\x00")

    text("base")
    align(4)
    out.extend(struct.pack("<I", len(JOINTS)))
    for name in JOINTS:
        text(name)
    for values in (q, dq, tau):
        align(4)
        out.extend(struct.pack("<I", len(values)))
        align(8)
        out.extend(struct.pack(f"<{len(values)}d", *values))
    return bytes(out)


def plain_json(stamp, q, dq, tau):
    sec, nanosec = divmod(stamp, 10**9)
    header = {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "base"}
    return json.dumps({"header": header, "name": JOINTS, "position": q, "velocity": dq, "effort": tau}).encode()


def messages(log, encode):
    rows = zip(log["t"].tolist(), log["q"].tolist(), log["dq"].tolist(), log["tau"].tolist())
    return [encode(nanoseconds(t), q, dq, tau) for t, q, dq, tau in rows]


def write_mcap(path, log, encode, schema, encoding):
    from mcap.writer import CompressionType, Writer

    with open(path, "wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start("", "")
        known = writer.register_schema("sensor_msgs/msg/JointState", *schema)
        channels = [writer.register_channel("/joint_states", encoding, known) for _ in range(2)]
        for at, data, publisher in zip(arrivals(log), messages(log, encode), log["publisher"]):
            writer.add_message(channels[publisher], at, data, at)
        writer.finish()


def write_mcap_cdr(path, log):
    write_mcap(path, log, cdr, ("ros2msg", JOINT_STATE.encode()), "cdr")


def write_mcap_json(path, log):
    write_mcap(path, log, plain_json, ("jsonschema", b'{"type": "object"}'), "json")


def write_db3(path, log):
    with sqlite3.connect(path) as base:
        base.execute(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
            "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)"
        )
        base.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
            "timestamp INTEGER NOT NULL, data BLOB NOT NULL)"
        )
        base.execute("INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '')")
        rows = zip(arrivals(log), messages(log, cdr))
        base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)", rows)
    base.close()


CONTAINERS = {
    "csv": write_csv,
    "json.mcap": write_mcap_json,
    "cdr.mcap": write_mcap_cdr,
    "db3": write_db3,
    "npz": write_npz,
    "parquet": write_parquet,
}
