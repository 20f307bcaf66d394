#!/usr/bin/env python3
"""Every option of every command that reads logs or models, alone and in pairs, on measured logs: command, exit, verdict.

    options.py TOOL DATA [TABLE.tsv] [--short]

DATA is the folder of measured logs (`../shared/data` beside the repository). The options are those that `--help-all`
names; each effect that `diagnose` tried is accepted alone and in pairs at one joint. A verdict is

    used      the document or the files differ from those without it
    refused   exit 2, 3 or 4, and the message names the option, the effect or the input
    ignored   taken, and nothing differs
    wrong     the error of what is written is more than 1.2 times that without the option
    unread    `show` refuses the model that was written
    crash     any other end

`--short` leaves the pairs and the arm out. Ends with 1 where a verdict is one of the last four. Takes about an hour.
"""

import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

MOST = 1.2
BAD = ("ignored", "wrong", "unread", "crash")
COMMON = {"json", "quiet", "verbose", "open", "threads", "help", "help-all"}
# changes a result only where the set-up is contradicted
IDLE = {"as-declared", "fix-setup"}
MACHINES = {
    "emps": ("emps/emps_id.csv", "@0..60%", "configs/emps.toml", "q1"),
    "motor": ("bldc-cogging/speed_test1.txt@15.2..23s", None, "configs/bldc.toml", "motor"),
    "pendulum": ("pendulum/055032.csv", "@0..60%", "configs/pendulum.toml", "q2"),
    "ur10": ("ur10/ur10_exciting.csv@0..70%", None, "configs/ur10.toml", "q3"),
}
# what an option is given; {joint} is the machine's
VALUES = {
    "leave-out": "1..2s",
    "estimator": "ols",
    "accept": "delay:{joint}",
    "false-alarms": "500",
    "max-relative-error": "1e-9",
    "joint": "{joint}",
    "seed": "7",
}


def run(tool, folder, words):
    done = subprocess.run(
        [tool, *words, "--json", "-", "-q"], cwd=folder, capture_output=True, text=True, timeout=1800
    )
    try:
        document = json.loads(done.stdout)
    except ValueError:
        document = {}
    return done.returncode, document, done.stderr


def options(tool, command):
    """Options of a command, each with the name of its value."""
    text = subprocess.run([tool, command, "--help-all"], capture_output=True, text=True).stdout
    found = re.findall(r"^ +(?:-\w, )?--([a-z][a-z-]*)(?:[ =\[]+<?([^>\s\]]+))?", text, re.M)
    return [(name, value) for name, value in found if name not in COMMON | IDLE]


def error(document):
    joints = document.get("joints") or []
    if not joints or not isinstance(joints[0], dict):
        return None
    values = [j.get("relative_error_moving") or j.get("relative_error") for j in joints]
    return None if None in values else sum(values) / len(values)


class Table:
    def __init__(self, tool, root):
        self.tool, self.root, self.rows = tool, root, []

    def one(self, machine, base, words, inputs):
        """Runs a line with and without an option in folders of their own."""
        with tempfile.TemporaryDirectory(dir=self.root) as folder:
            for name in inputs:
                os.symlink(self.root / name, Path(folder) / name.split("-", 1)[1])
            status, plain, _ = run(self.tool, folder, base)
            files = {p.name: p.read_bytes() for p in Path(folder).iterdir() if not p.is_symlink()}
            for name in files:
                (Path(folder) / name).unlink()
            code, document, said = run(self.tool, folder, base + words)
            written = {p.name: p.read_bytes() for p in Path(folder).iterdir() if not p.is_symlink()}
            verdict = self.verdict(folder, base, words, (status, plain, files), (code, document, written), said)
        self.rows.append((machine, " ".join(base + words), code, verdict))

    def verdict(self, folder, base, words, plain, used, said):
        code, document, written = used
        if code not in (0, 1, 2, 3, 4) or "panicked" in said:
            return "crash"
        if code > 1:
            keys = [w.lstrip("-").split(":")[0].split("=")[0] for w in words]
            return "refused" if plain[0] > 1 or "--" in said or any(k in said for k in keys) else "crash"
        # a fit of currents is the plain one already
        plain_already = words == ["--unconstrained"] and b"consistent = " not in plain[2].get("out.toml", b"")
        if words and used == plain and not plain_already:
            return "ignored"
        model = next((name for name in ("out.toml",) if name in written and "[robot]" in written[name].decode()), None)
        if model:
            status, _, _ = run(self.tool, folder, ["show", model])
            if status:
                return "unread"
        if base[0] in ("lsq", "diagnose") and model:
            log = base[1]
            now = error(run(self.tool, folder, ["validate", log, "-m", model])[1])
            if base[0] == "lsq":
                before = error(plain[1])
            else:
                before = error(run(self.tool, folder, ["validate", log, "-m", "m.toml"])[1])
            if now and before and not now <= MOST * before:
                return "wrong"
        return "used"


def words_of(name, value, joint):
    if name in VALUES:
        return [f"--{name}", VALUES[name].format(joint=joint)]
    if not value:
        return [f"--{name}"]
    ending = re.search(r"\.(\w+)", value)
    return [f"--{name}", f"written.{ending.group(1)}"] if ending and "toml" not in value.lower() else None


def main():
    short = "--short" in sys.argv
    tool, data, *to = [a for a in sys.argv[1:] if a != "--short"]
    tool, data = str(Path(tool).resolve()), Path(data).resolve()
    root = Path(tempfile.mkdtemp())
    table, jobs = Table(tool, root), []
    for machine, (log, part, robot, joint) in MACHINES.items():
        if not (data / log.split("@")[0]).exists() or short and machine == "ur10":
            print(f"SKIPPED: {machine}", file=sys.stderr)
            continue
        log = str(data / log)
        fit = ["lsq", log, "-r", robot, "-o", f"{machine}-m.toml"]
        if run(tool, root, fit)[0]:
            raise SystemExit(f"{machine}: no model")
        inputs = [f"{machine}-m.toml"]
        lines = [fit[:-1] + ["out.toml"], ["inspect", log, "-r", robot], ["show", "m.toml"]]
        for rows in {log, log + (part or "")}:
            lines += [
                ["validate", rows, "-m", "m.toml"],
                ["diagnose", rows, "-m", "m.toml", "-o", "out.toml"],
                ["torque", rows, "-m", "m.toml", "-o", "out.csv"],
                ["watch", rows, "-m", "m.toml"],
            ]
        for line in lines:
            known = [words_of(name, value, joint) for name, value in options(tool, line[0])]
            known = [w for w in known if w and w[0] not in line]
            taken = [[]] + known
            if not short:
                taken += [a + b for a, b in itertools.combinations(known, 2)]
            jobs += [(machine, line, words, inputs) for words in taken]
        found = run(tool, root, ["diagnose", log, "-m", inputs[0]])[1]
        effects = {(c["effect"], c["joint"]) for c in found.get("candidates", []) if c["joint"] in (joint, None)}
        each = sorted(name if of is None else f"{name}:{of}" for name, of in effects)
        accepts = [["--accept", name] for name in each]
        if not short and machine != "ur10":
            accepts += [a + b for a, b in itertools.combinations(accepts, 2)]
        line = ["diagnose", log, "-m", "m.toml", "-o", "out.toml"]
        jobs += [(machine, line, words, inputs) for words in accepts]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda job: table.one(*job), jobs))
    shutil.rmtree(root)
    lines = ["machine\tcommand\texit\tverdict"]
    lines += ["\t".join(map(str, row)).replace(f"{data}/", "") for row in sorted(table.rows)]
    if to:
        Path(to[0]).write_text("\n".join(lines) + "\n")
    bad = [line for line in lines if line.rsplit("\t", 1)[1] in BAD]
    print("\n".join(bad))
    counts = {v: sum(row[3] == v for row in table.rows) for v in ("used", "refused", *BAD)}
    print(len(table.rows), "commands:", ", ".join(f"{n} {v}" for v, n in counts.items()))
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
