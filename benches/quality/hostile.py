"""Every fault of a log in every container, through the commands that take logs: what is true must be said.

    hostile.py TOOL [RESULT.json] [--short] [--fits] [--all]

A fit of a faulty log is held against the machine's own torques along another motion. It is wrong where it errs there
by more than twice what the fit of the sound log does and more than it says of its own log, or where it states a
parameter as known that is 5 standard deviations and 5 % off. A wrong fit without a warning is a failure; so is a panic,
10 s of processor time, 500 MB, an error that does not name its file and say a way out. `--fits` leaves the other
commands out; `--all` writes every case to hostile_rows.json.
"""

import json
import re
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

import arm_logs
from log_faults import FAULTS
from tool import Tool, complaint, record

# A fit is wrong beyond: times the error of the sound fit; standard deviations and share of a parameter.
ERROR, STDS, SHARE = 2.0, 5.0, 0.05
COMMANDS = (
    "inspect {log} -r arm.toml --json -",
    "validate {log} -m sound.toml --json -",
    "torque {log} -m sound.toml -o out.csv",
    "convert {log} out.csv",
    "convert {log} out.mcap -r arm.toml",
    "reduce {log} -r arm.toml -o out.cfi",
    "diagnose {log} -m sound.toml -o out.toml",
    "watch {log} -m sound.toml",
    "friction {log} -r arm.toml --joint elbow -o out.toml",
    "payload {log} -m sound.toml",
    "new out --log {log}",
)


def fitted(ended):
    """Value, standard deviation of each parameter that a fit calls identified."""
    known = [p for p in ended.document()["parameters"] if p["verdict"] == "identified" and not p["negligible"]]
    return {f"{p['name']} {p['joint']}": (p["value"], p["std"]) for p in known}


class Bench:
    def __init__(self, program, folder):
        self.tool, self.folder = Tool(program, folder), Path(folder)
        (self.folder / "arm.toml").write_text(arm_logs.ROBOT)
        arm_logs.write_csv(self.folder / "exact.csv", arm_logs.drive(1, 60.0, noise=1e-5))
        arm_logs.write_csv(self.folder / "unseen.csv", arm_logs.drive(2, noise=0.0))
        self.sound = arm_logs.drive(3)
        arm_logs.write_csv(self.folder / "sound.csv", self.sound)
        self.truth = fitted(self.run("lsq exact.csv -r arm.toml --unconstrained -o truth.toml --json - -q"))
        self.usual = self.run("lsq sound.csv -r arm.toml -o sound.toml --verbose").warnings()
        self.error = self.errors("sound.toml")

    def run(self, line):
        ended = self.tool.run(line)
        assert ended.status == 0, f"{line}: {ended.said}"
        return ended

    def errors(self, model):
        ended = self.tool.run(f"validate unseen.csv -m {model} --json - -q")
        if ended.status != 0:
            return np.array([np.inf, np.inf])
        return np.array([joint["relative_error"] for joint in ended.document()["joints"]])

    def wrong(self, ended):
        """In what a fit is wrong, or None."""
        errors = self.errors("out.toml")
        stated = np.array([joint["relative_error"] for joint in ended.document()["joints"]])
        if (errors > np.maximum(ERROR * self.error, stated)).any():
            return f"errs by {errors.round(3)}, says {stated.round(3)}"
        for name, (value, std) in fitted(ended).items():
            true = self.truth.get(name)
            off = abs(value - true[0]) if true else 0.0
            if off > STDS * std and off > SHARE * abs(true[0]):
                return f"{name} is {value:.4g} +- {std:.2g}, truly {true[0]:.4g}"
        return None


def of_fit(bench, log, words):
    """Outcome of a fit, and what is wrong with it."""
    for file in bench.folder.glob("out*"):
        file.unlink()
    ended = bench.tool.run(f"lsq {log} -r arm.toml -o out.toml --json - --verbose")
    fault = complaint(ended)
    if fault:
        return "fault", fault, ended
    if ended.status == 0:
        wrong = bench.wrong(ended)
        said = " ".join(line for line in ended.warnings() if line not in bench.usual)
        if wrong is None:
            return "right, with a warning" if said else "right", None, ended
        if not said:
            return "wrong without a word", wrong, ended
        named = not words or any(word in said for word in words)
        return ("wrong, with a warning" if named else "wrong, warned of something else"), wrong, ended
    if log.split("@")[0] not in ended.said:
        return "fault", "the file is not named", ended
    named = not words or any(word in ended.said for word in words)
    return ("refused" if named else "refused for something else"), None, ended


def product(bench, faults, containers, commands, each):
    rows = []
    for at, (name, (fault, words)) in enumerate(faults.items()):
        for container in containers:
            log = f"log.{container}"
            faulty = fault(bench.sound, np.random.default_rng(7))
            arm_logs.CONTAINERS[container](bench.folder / log, faulty)
            outcome, why, ended = of_fit(bench, log, words)
            said = [line for line in ended.said.splitlines() if re.match("warning|error|hint", line)]
            rows.append({"fault": name, "container": container, "outcome": outcome, "why": why, "said": said})
            for file in bench.folder.glob("out*"):
                file.unlink()
            for line in commands[(at + len(rows)) % len(commands) :: each] if commands else ():
                other = bench.tool.run(line.format(log=log))
                fault_of = complaint(other, (0, 1, 2, 3, 4))
                if fault_of:
                    rows.append(
                        {
                            "fault": name,
                            "container": container,
                            "outcome": "fault",
                            "why": f"{line}: {fault_of}",
                            "said": other.said.splitlines()[:3],
                        }
                    )
                for file in bench.folder.glob("out*"):
                    file.unlink()
            (bench.folder / log).unlink()
        print(f"{at + 1} of {len(faults)}: {name}: {Counter(r['outcome'] for r in rows if r['fault'] == name)}", flush=True)
    return rows


def summary(rows):
    """How many cases of a group of faults ended in which way."""
    groups = {}
    for row in rows:
        name = row["fault"].split(",")[0].removeprefix("small ").split(" in ")[0]
        name = "clocks and rows" if re.match("clock|times|halves|rows", name) else name
        group = groups.setdefault(name, Counter())
        group[row["outcome"]] += 1
    ways = ("right", "right, with a warning", "wrong, with a warning", "wrong, warned of something else", "refused",
            "refused for something else", "wrong without a word", "fault")  # fmt: skip
    table = [{"faults": name} | {way: group[way] for way in ways} for name, group in groups.items()]
    table.append({"faults": "all"} | {way: sum(row[way] for row in table) for way in ways})
    return table


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    short = "--short" in sys.argv
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(words[0], folder)
        faults = FAULTS
        if short:
            faults = {name: FAULTS[name] for k, name in enumerate(FAULTS) if k % 7 == 0}
        rows = product(bench, faults, list(arm_logs.CONTAINERS), () if short or "--fits" in sys.argv else COMMANDS, 4)
    record(words, "faults of a log in six containers, fitted", "hostile", summary(rows), short)
    if "--all" in sys.argv:
        Path("hostile_rows.json").write_text(json.dumps(rows, indent=1))
    bad = [row for row in rows if row["outcome"] in ("fault", "wrong without a word")]
    for row in bad:
        print(row)
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
