"""Runs of the program within bounds, and what is wrong with how one ended."""

import json
import os
import re
import resource
import subprocess
import threading
from dataclasses import dataclass
from pathlib import Path

# What no run on some MB may take: seconds of processor time and MB of resident memory.
SECONDS = 10.0
MEGABYTES = 500.0


@dataclass
class Ended:
    line: str
    status: int
    out: str
    said: str
    seconds: float
    megabytes: float

    def document(self):
        return json.loads(self.out)

    def warnings(self):
        return [line for line in self.said.splitlines() if line.startswith("warning")]


class Tool:
    def __init__(self, program, folder):
        self.program, self.folder = str(Path(program).resolve()), Path(folder)

    def run(self, line, seconds=6 * SECONDS, environment=None, start=None):
        """Runs a line of words; ended for it after so many seconds of processor time, or ten times as many on the wall."""
        limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 1))
        words = [self.program, *(line.split() if isinstance(line, str) else line)]
        with open(self.folder / ".out", "w+") as out, open(self.folder / ".said", "w+") as said:
            child = subprocess.Popen(
                words,
                cwd=self.folder,
                stdin=subprocess.DEVNULL if start is None else start,
                stdout=out,
                stderr=said,
                preexec_fn=limit,
                env=os.environ | (environment or {}),
            )
            watch = threading.Timer(10 * seconds, child.kill)
            watch.start()
            _, status, used = os.wait4(child.pid, 0)
            watch.cancel()
            child.returncode = status
            for file in (out, said):
                file.seek(0)
            texts = [Path(file.name).read_text(errors="replace") for file in (out, said)]
        line = line if isinstance(line, str) else " ".join(line)
        time = used.ru_utime + used.ru_stime
        return Ended(line, os.waitstatus_to_exitcode(status), *texts, time, used.ru_maxrss / 1024)


def record(words, study, name, rows, short):
    """Writes the rows of a study where a second word names the file."""
    if len(words) > 1:
        study += ", short form" * short
        result = {"study": study, "command": f"benches/quality/run.sh {name}", "rows": rows}
        Path(words[1]).write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n")


CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\u202e]")


def complaint(ended, statuses=(0, 1, 3, 4)):
    """What is wrong with an end, whatever was asked: a panic, a hang, memory, a silent or a mute error."""
    if "panicked" in ended.said or ended.status in (101, 134, -6, -11):
        return "panic"
    if ended.status not in statuses:
        return f"status {ended.status}"
    if ended.seconds > SECONDS:
        return f"{ended.seconds:.1f} s"
    if ended.megabytes > MEGABYTES:
        return f"{ended.megabytes:.0f} MB"
    if CONTROL.search(ended.said):
        return "control character"
    if ended.status >= 2 and not ("error: " in ended.said):
        return "no error in words"
    if ended.status == 3 and "hint: " not in ended.said:
        return "no way out"
    return None
