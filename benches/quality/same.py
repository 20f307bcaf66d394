"""The same bytes of every document at 1, 2, 3 and 8 threads, and in a folder of another name.

    same.py TOOL [RESULT.json] [--short] [--other TOOL]

`--other` is a build for another processor: its numbers may differ by 1e-9 of themselves, its words not at all.
"""

import hashlib
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import arm_logs
from tool import record

LINES = (
    "inspect first.csv second.mcap -r arm.toml --json inspect.json",
    "lsq first.csv second.mcap -r arm.toml -o model.toml --json lsq.json --report lsq.html",
    "validate unseen.mcap -m model.toml --json validate.json -o residual.csv --report validate.html",
    "torque second.mcap -m model.toml -o torque.mcap --json torque.json",
    "friction first.csv -r arm.toml --joint elbow -o friction.toml --json friction.json",
    "reduce first.csv -r arm.toml -o first.cfi",
    "lsq first.cfi -r arm.toml -o reduced.toml --json reduced.json",
    "diagnose first.csv -m model.toml --holdout unseen.mcap -o refined.toml --json diagnose.json --report diagnose.html",
    "simulate -r arm.toml -m model.toml --seconds 4 --seed 5 -o simulated.csv --json simulate.json",
    "excite -r arm.toml -m model.toml --seconds 5 --seed 5 -o motion.toml --json excite.json",
    "identify arm.toml first.csv -o run --json identify.json",
)
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def made(tool, lines, folder, threads):
    """Runs every line in a new folder; the documents and files by their names."""
    folder.mkdir()
    (folder / "arm.toml").write_text(arm_logs.ROBOT + "\n[limits.shoulder]\nposition = [-2.0, 2.0]\nspeed = 4.0\n"
                                     "torque = 60.0\n\n[limits.elbow]\nposition = [-2.0, 2.0]\nspeed = 4.0\ntorque = 20.0\n")  # fmt: skip
    arm_logs.write_csv(folder / "first.csv", arm_logs.drive(3))
    arm_logs.write_mcap_cdr(folder / "second.mcap", arm_logs.drive(4, 10.0))
    arm_logs.write_mcap_cdr(folder / "unseen.mcap", arm_logs.drive(6, 10.0))
    given = set(folder.rglob("*"))
    for line in lines:
        ended = subprocess.run([tool, *line.split(), "-q", "--threads", str(threads)], cwd=folder, capture_output=True)
        assert ended.returncode == 0, f"{line}: {ended.stderr.decode()}"
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path not in given]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def near(a, b):
    """Whether two texts have the same words, and numbers that are as good as the same."""
    a, b = a.decode(errors="replace"), b.decode(errors="replace")
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False
    pairs = zip(map(float, NUMBER.findall(a)), map(float, NUMBER.findall(b)))
    return all(x == y or abs(x - y) <= 1e-9 * max(abs(x), abs(y), 1e-9) for x, y in pairs)


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    short = "--short" in sys.argv
    other = words.pop() if "--other" in sys.argv else None
    tool = str(Path(words[0]).resolve())
    lines = LINES[:8] if short else LINES
    rows, bad = [], 0
    with tempfile.TemporaryDirectory() as folder:
        base = made(tool, lines, Path(folder) / "a", 1)
        runs = [(f"{n} threads", tool, "b", n) for n in ((2, 3) if short else (2, 3, 8))]
        runs += [("a folder of another name", tool, "another name, longer", 1)]
        runs += [("another processor's build", other, "c", 2)] if other else []
        for what, program, name, threads in runs:
            files = made(program, lines, Path(folder) / f"{name} {threads}", threads)
            same = [path for path in base if files.get(path) == base[path]]
            alike = [path for path in base if path in files and path not in same and near(base[path], files[path])]
            differ = sorted((set(base) | set(files)) - set(same) - set(alike))
            bad += len(differ) + (0 if program == other else len(alike))
            rows.append({"run again with": what, "files": len(base), "same bytes": len(same),
                         "numbers within 1e-9": len(alike), "differ": len(differ)})  # fmt: skip
            print(rows[-1], differ, alike, flush=True)
    digest = hashlib.sha256(b"".join(base[path] for path in sorted(base))).hexdigest()
    print("all documents:", digest)
    record(words, "what changes between runs", "same", rows, short)
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
