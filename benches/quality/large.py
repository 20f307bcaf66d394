"""Long logs through every command that takes logs, ten thousand logs at once, and rows without end.

    large.py TOOL RESULT.json [MEGABYTES [LOGS [HOURS]]] [--short]

A log of so many MB (2048) and one of an eighth of it, as text and as a recording: memory must not depend on the
length, and time must be in proportion to it.
"""

import os
import subprocess
import sys
import tempfile
import time

import numpy as np

import arm_logs
from tool import Tool, record

MB = 1 << 20
# Most memory of a command [MB]; `diagnose` holds rows of its logs in a thinned form.
MEMORY, OF_DIAGNOSE = 50.0, 300.0
COMMANDS = (
    "inspect {} -r arm.toml --json -",
    "lsq {} -r arm.toml -o out.toml --json -",
    "validate {} -m model.toml --json -",
    "convert {} out.csv",
    "reduce {} -r arm.toml -o out.cfi",
    "torque {} -m model.toml -o out.csv",
    "diagnose {} -m model.toml -o out.toml --json -",
)


def period(seconds=64.0, rate=1000.0):
    """A motion that ends as it began, so that it can go on for as long as one likes."""
    t = np.arange(int(seconds * rate)) / rate
    q, v, a = np.zeros((3, len(t), 2))
    for j, waves in enumerate(((7, 13, 31, 46), (5, 17, 29, 50))):
        for k in waves:
            w = 2 * np.pi * k / seconds
            q[:, j] += 2.0 / k * np.sin(w * t + k)
            v[:, j] += 2.0 / k * w * np.cos(w * t + k)
            a[:, j] -= 2.0 / k * w**2 * np.sin(w * t + k)
    return q, v, arm_logs.torque(q, v, a)


class Rows:
    """Rows of text without end: times go on, noise is drawn anew in every period."""

    def __init__(self, seed=1):
        self.q, _, self.tau = period()
        self.rng, self.k = np.random.default_rng(seed), 0

    def next(self):
        n = len(self.q)
        tau = self.tau + 0.1 * self.rng.standard_normal(self.tau.shape)
        q = self.q + 2e-6 * self.rng.standard_normal(self.q.shape)
        t = (self.k + np.arange(n)) / 1000.0
        self.k += n
        table = np.column_stack([t, q, tau]).tolist()
        return "".join("%.3f,%.7f,%.7f,%.5f,%.5f\n" % tuple(row) for row in table)


HEADER = "t," + ",".join(f"{kind}_{joint}" for kind in ("q", "tau") for joint in arm_logs.JOINTS) + "\n"


def text_log(path, megabytes):
    rows = Rows()
    with open(path, "w") as file:
        file.write(HEADER)
        while file.tell() < megabytes * MB:
            file.write(rows.next())
    return rows.k


def long_logs(tool, megabytes, commands):
    found = []
    for form in ("csv", "mcap"):
        ends = {}
        for size in (megabytes / 8, megabytes):
            log = tool.folder / f"long.{form}"
            text_log(tool.folder / "long.csv", size)
            if form == "mcap":
                ended = tool.run("convert long.csv long.mcap -r arm.toml -q", 36000)
                assert ended.status == 0, ended.said
                (tool.folder / "long.csv").unlink()
            for line in commands:
                ended = tool.run(line.replace("{}", log.name) + " -q", 36000)
                ends.setdefault(line, []).append((ended, log.stat().st_size / MB))
                for file in tool.folder.glob("out*"):
                    file.unlink()
            log.unlink()
        for line, ((small, before), (large, after)) in ends.items():
            most = OF_DIAGNOSE if line.startswith("diagnose") else MEMORY
            growth = (large.seconds / after) / (small.seconds / before)
            found.append({
                "command": line.split()[0], "log": form, "MB": round(after), "processor time [s]": f"{large.seconds:.1f}",
                "time per MB, to that of an eighth": f"{growth:.2f}", "memory [MB]": round(large.megabytes),
                "memory for an eighth [MB]": round(small.megabytes),
                "held": large.status == small.status == 0 and large.megabytes < most,
            })  # fmt: skip
            print(found[-1], large.said.splitlines()[:2] if large.status else "", flush=True)
    return found


def many_logs(tool, logs):
    """So many short logs in one `reduce`, and as many parts in one `track`."""
    for k in range(logs):
        arm_logs.write_csv(tool.folder / f"l{k}.csv", arm_logs.drive(100 + k, 4.0, 100.0))
    names = [f"l{k}.csv" for k in range(logs)]
    found = []
    for words in (["reduce", *names, "-r", "arm.toml", "-o", "all.cfi"], ["track", "all.cfi", "-o", "track.csv"],
                  ["lsq", "all.cfi", "-r", "arm.toml", "-o", "all.toml"]):  # fmt: skip
        ended = tool.run([*words, "-q"], 36000)
        found.append({"command": words[0], "log": f"{logs} logs", "MB": round(sum((tool.folder / n).stat().st_size for n in names) / MB),
                      "processor time [s]": f"{ended.seconds:.1f}", "memory [MB]": round(ended.megabytes),
                      "held": ended.status == 0 and ended.megabytes < OF_DIAGNOSE})  # fmt: skip
        print(found[-1], ended.said.splitlines()[:2] if ended.status else "", flush=True)
    return found


def resident(pid):
    with open(f"/proc/{pid}/status") as file:
        return next(int(line.split()[1]) / 1024 for line in file if line.startswith("VmRSS"))


def endless(tool, hours):
    """Rows of so many hours at 1 kHz through `watch`; resident memory after a twentieth and at the end."""
    rows, began, first = Rows(2), time.monotonic(), None
    line = [tool.program, "watch", "-", "-m", "model.toml"]
    with open(os.devnull, "w") as nothing:
        child = subprocess.Popen(line, cwd=tool.folder, stdin=subprocess.PIPE, stdout=nothing, stderr=nothing, text=True)
        child.stdin.write(HEADER)
        while rows.k < hours * 3.6e6:
            child.stdin.write(rows.next())
            if first is None and rows.k > hours * 3.6e6 / 20:
                first = resident(child.pid)
        last = resident(child.pid)
        child.stdin.close()
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = status
    row = {"command": "watch", "log": f"{hours} h at 1 kHz", "MB": None,
           "processor time [s]": f"{used.ru_utime + used.ru_stime:.1f}", "memory [MB]": round(last),
           "memory for a twentieth [MB]": round(first), "held": status == 0 and last < first + 1.0}  # fmt: skip
    print(row, round(time.monotonic() - began), "s", flush=True)
    return [row]


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    short = "--short" in sys.argv
    asked = [float(word) for word in words[2:]]
    megabytes, logs, hours = (asked + [2048.0, 10000.0, 24.0][len(asked) :]) if not short else (24.0, 200.0, 0.1)
    with tempfile.TemporaryDirectory() as folder:
        tool = Tool(words[0], folder)
        (tool.folder / "arm.toml").write_text(arm_logs.ROBOT)
        text_log(tool.folder / "model.csv", 4)
        ended = tool.run("lsq model.csv -r arm.toml -o model.toml -q")
        assert ended.status == 0, ended.said
        rows = long_logs(tool, megabytes, COMMANDS[:4] if short else COMMANDS)
        rows += many_logs(tool, int(logs)) + endless(tool, hours)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    rows = [{key: row.get(key) for key in columns} for row in rows]
    record(words, "long and many logs", "large", rows, short)
    return not all(row["held"] for row in rows)


if __name__ == "__main__":
    sys.exit(main())
