"""Times of reducing a fleet's logs by one process and by two workers; see run.sh."""

import hashlib
import json
import os
import sys
import time
from pathlib import Path

import cft_ident as ci
import numpy as np
import pandas
from cft_ident.fleet import merge_bytes, reduce_one, tree
from distributed import Client, LocalCluster

#: Logs that are made, reduced both ways and deleted together.
CHUNK = 50
SECONDS = 20.0


def make(frame, seed, path):
    """A log of the fleet: 20 s of the measured one from a seeded start, with noise of 1 % of each torque's rms."""
    chance = np.random.default_rng(seed)
    t = frame["t"].to_numpy()
    start = t[0] + chance.uniform(0.0, t[-1] - t[0] - SECONDS)
    cut = frame[(t >= start) & (t < start + SECONDS)].copy()
    for k in range(1, 7):
        torque = cut[f"tau{k}"].to_numpy()
        cut[f"tau{k}"] = torque + 0.01 * np.sqrt(np.mean(torque**2)) * chance.standard_normal(len(torque))
    cut.to_csv(path, index=False, float_format="%.9g")


def memory():
    """Resident memory of this process [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def whole(rows):
    """SHA-256 of all parts as one, and the bytes of one part."""
    bad = [row for row in rows if "error" in row]
    if bad:
        sys.exit(f"a log is not reduced: {bad[0]}")
    parts = {row["key"]: row["part"] for row in rows}
    return hashlib.sha256(tree(parts.items(), merge_bytes)).hexdigest(), sum(map(len, parts.values())) / len(parts)


def chunk(first, count, frame, robot, folder, client):
    """Both ways over logs of these seeds."""
    names = [str(folder / f"log{seed}.csv") for seed in range(first, first + count)]
    for seed, name in enumerate(names, first):
        make(frame, seed, name)
    csv = sum(os.path.getsize(name) for name in names) / count
    ways = {}

    def one():
        begun = time.perf_counter()
        rows = [reduce_one(name, robot, None, None) for name in names]
        return time.perf_counter() - begun, rows

    def two():
        begun = time.perf_counter()
        rows = client.gather(client.map(reduce_one, names, robot=robot, model=None, store=None, pure=False, batch_size=1))
        return time.perf_counter() - begun, rows

    # each goes first as often as the other
    order = [("one", one), ("two", two)]
    for name, way in order if first // CHUNK % 2 == 0 else order[::-1]:
        seconds, rows = way()
        ways[name] = (seconds, *whole(rows))
    for name in names:
        os.remove(name)
    if ways["one"][1] != ways["two"][1]:
        sys.exit(f"logs {first} and on: the two ways differ in their bytes")
    return {
        "first": first, "logs": count, "one_s": ways["one"][0], "two_s": ways["two"][0], "csv_bytes": csv,
        "part_bytes": ways["one"][2], "workers_mb": max(client.run(memory).values()), "load": os.getloadavg()[0],
    }


def summary(rows, cores):
    """The document: what was measured, and what it comes to for 10^6 logs."""
    logs = sum(row["logs"] for row in rows)
    one, two = (sum(row[key] for row in rows) for key in ["one_s", "two_s"])
    middle = float(np.median([row["one_s"] / row["two_s"] for row in rows]))
    early, late = (np.mean([row["workers_mb"] for row in part]) for part in [rows[: max(1, len(rows) // 4)], rows[-max(1, len(rows) // 4):]])
    part, csv = (np.mean([row[key] for row in rows]) for key in ["part_bytes", "csv_bytes"])
    lines = [
        ("logs of 20 s, six joints, 125 Hz", f"{logs}"),
        ("one process, one thread", f"{1e3 * one / logs:.0f} ms a log"),
        ("two workers of one thread", f"{1e3 * two / logs:.0f} ms a log"),
        ("two workers over one, all logs", f"{one / two:.2f}"),
        (f"the same, median of {len(rows)} groups of {CHUNK} logs", f"{middle:.2f}"),
        ("of twice", f"{one / two / 2:.2f}"),
        ("memory of a worker, first and last quarter", f"{early:.0f} MB, {late:.0f} MB"),
        ("bytes of a log as CSV, and reduced", f"{csv / 1e3:.0f} kB, {part / 1e3:.0f} kB"),
        ("load of the machine meanwhile, average over groups", f"{np.mean([row['load'] for row in rows]):.1f} on {cores} cores"),
        ("extrapolated: 10^6 such logs on 100 workers", f"{1e6 * two / logs * 2 / 100 / 3600:.1f} h, {1e6 * part / 1e9:.0f} GB of parts"),
    ]
    return {
        "study": "a fleet's logs reduced by two workers beside one process",
        "command": f"benches/fleet/run.sh {logs}",
        "rows": [{"what": what, "measured": value} for what, value in lines],
        "groups": rows,
    }


def main():
    logs, folder, result = int(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    done = folder / "groups.jsonl"
    rows = [json.loads(line) for line in done.read_text().splitlines()] if done.exists() else []
    ci.example("ur10", folder / "ur10")
    frame = pandas.read_csv(folder / "ur10" / "ur10.csv")
    robot = (folder / "ur10" / "ur10.toml").read_text()
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        # both have begun before the first is timed
        warm = [str(folder / f"warm{k}.csv") for k in range(4)]
        for k, name in enumerate(warm):
            make(frame, 10**6 + k, name)
            reduce_one(name, robot, None, None)
        client.gather(client.map(reduce_one, warm, robot=robot, model=None, store=None, pure=False))
        for first in range(sum(row["logs"] for row in rows), logs, CHUNK):
            rows.append(chunk(first, min(CHUNK, logs - first), frame, robot, folder, client))
            with open(done, "a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            print(rows[-1], file=sys.stderr, flush=True)
    with open(result, "w", encoding="utf-8") as file:
        file.write(json.dumps(summary(rows, os.cpu_count()), indent=1) + "\n")


if __name__ == "__main__":
    main()
