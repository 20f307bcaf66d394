"""Files that nobody should give: robot files with any two keys wrong, spans at every edge, documents for models.

    files.py TOOL [RESULT.json] [--short]

Every key of the robot file is spoiled in each way that its value allows; any one and any two spoiled keys must be
refused with the line of one of them. Parts of a log at any time must have each of its rows once, the same rows in
every container. A JSON document of a command, given where a model or a robot stands, must be refused by its name.
"""

import itertools
import random
import re
import sys
import tempfile
from collections import Counter

import arm_logs
from tool import Tool, complaint, record

ROBOT = """\
[robot]
model = "serial"
gravity = [0.0, 0.0, -9.81]
drive_inertia = true
angles_as_written = false

[[robot.link]]
joint = "shoulder"
kind = "revolute"
alpha = 1.5707963267948966

[[robot.link]]
joint = "elbow"
a = 0.4

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
time = "t"
time_unit = "s"
torque_is = "joint"
torque_held = false
delimiter = "comma"
keep = ["spike"]

[log.joint.shoulder]
position = "q_shoulder"
position_unit = "rad"
position_sign = 1
position_offset = 0.0
torque = "tau_shoulder"
torque_unit = "Nm"
torque_scale = 1.0

[filter]
kind = "butterworth"
cutoff_hz = 10.0
order = 4
decimation = 5
position_cutoff_hz = 60.0
position_order = 4
trim_s = 0.1
gap_factor = 4.0

[noise.joint.elbow]
torque_std = 0.1

[limits.shoulder]
position = [-3.0, 3.0]
speed = 9.0
torque = 90.0
"""

# What no value of a kind may be.
BAD = {
    "number": ["nan", "1e40", '"text"', "[]", "true"],
    "text": ["7", '"no such thing"', "[]", "{}"],
    "switch": ['"maybe"', "3", "[true]"],
    "list": ["[]", "7", '["x", {}]', "[nan]"],
}
COLUMNS = ("position", "torque", "time")


def kind(value):
    if value in ("true", "false"):
        return "switch"
    return {"[": "list", '"': "text"}.get(value[0], "number")


def spoiled():
    """Every line of the robot file in each way that is wrong: number of the line, and what stands there instead."""
    out = []
    for at, line in enumerate(ROBOT.splitlines()):
        match = re.fullmatch(r"(\w+) = (.*)", line)
        if match:
            key, value = match.groups()
            out += [(at, f"{key} = {bad}") for bad in BAD[kind(value)] if f"{key} = {bad}" != line]
            out += [(at, f"{key[:-1]}zz = {value}")]
        elif line.startswith("["):
            out.append((at, line.replace("]", "x]", 1)))
    return out


def harmless(text):
    """An empty list asks for nothing, and a column may be named by its number."""
    return text == "keep = []" or (text.split(" = ")[0] in COLUMNS and text.endswith(" = 7"))


def robots(tool, short):
    lines, ways = ROBOT.splitlines(), [way for way in spoiled() if not harmless(way[1])]
    pairs = [pair for pair in itertools.combinations(ways, 2) if pair[0][0] != pair[1][0]]
    chance = random.Random(5)
    pairs = chance.sample(pairs, 150 if short else 4000)
    faults, counts = [], Counter()
    for changes in [*((way,) for way in ways), *pairs]:
        text = lines.copy()
        for at, line in changes:
            text[at] = line
        (tool.folder / "bad.toml").write_text("\n".join(text) + "\n")
        ended = tool.run("lsq short.csv -r bad.toml -o out.toml")
        why = complaint(ended, (3,))
        named = [int(n) for n in re.findall(r"bad\.toml:(\d+)", ended.said)]
        said = ended.said
        # a column that is not there is a matter of the log; a table that is not there lacks its keys
        column = any(line.split(" = ")[0] in COLUMNS for _, line in changes) and "short.csv" in said
        table = any(line.startswith("[") for _, line in changes) and "is missing" in said
        if why is None and not column and not table and not any(n - 1 == at for n in named for at, _ in changes):
            words = [line.split(" = ")[0] for _, line in changes]
            why = None if any(word in said for word in words) else "neither line nor key is named"
        counts["one key" if len(changes) == 1 else "two keys"] += 1
        if why:
            faults.append({"of": "one key" if len(changes) == 1 else "two keys", "robot": changes, "why": why, "said": said.splitlines()[:4]})
    (tool.folder / "out.toml").unlink(missing_ok=True)
    return faults, counts


SPANS = ("0..0%", "100..100%", "50..50%", "70..30%", "-1..50%", "0..101%", "nan..1s", "0..infs", "..", "0..", "1..2",
         "1e9..2e9s", "-5..-1s", "19.9999..20s", "0..0.001s", "0..1e-300s", "1e308..s", "%", "s", "0..50%..s", "0.. 5s")  # fmt: skip


def samples(tool, log):
    ended = tool.run(["inspect", log, "-r", "arm.toml", "--json", "-", "-q"])
    return ended.document()["inputs"][0]["samples"] if ended.status == 0 else 0, ended


def spans(tool, log, short):
    """Edges of spans, and parts that must make the whole."""
    faults, counts = [], Counter()
    chance = random.Random(6)
    cuts = [f"{chance.randrange(1, 5000) / 250}" for _ in range(2 if short else 12)]
    cuts += [f"{chance.uniform(0.01, 19.9):.5f}" for _ in range(1 if short else 6)]
    rows = {}
    for container, write in arm_logs.CONTAINERS.items():
        name = f"log.{container}"
        write(tool.folder / name, log)
        for span in SPANS:
            for line in ("lsq {} -r arm.toml -o out.toml", "inspect {} -r arm.toml", "convert {} out.csv"):
                ended = tool.run(line.replace("{}", f"{name}@{span}").split(" ") if " " not in span else
                                 [word.replace("{}", f"{name}@{span}") for word in line.split()])  # fmt: skip
                counts["spans"] += 1
                why = complaint(ended, (0, 2, 3, 4))
                if why is None and ended.status != 0 and name not in ended.said:
                    why = "the log is not named"
                if why:
                    faults.append({"of": "spans", "span": f"{name}@{span}", "line": line, "why": why, "said": ended.said.splitlines()[:4]})
                for file in tool.folder.glob("out*"):
                    file.unlink()
        whole, _ = samples(tool, name)
        parts = {}
        for cut in cuts:
            two = [samples(tool, f"{name}@..{cut}s")[0], samples(tool, f"{name}@{cut}..s")[0]]
            counts["parts"] += 1
            parts[cut] = two
            if sum(two) != whole or whole != len(log["t"]):
                faults.append({"of": "parts", "span": f"{name} at {cut}", "why": f"{two} of {whole} rows, {len(log['t'])} written"})
        rows[container] = parts
    for cut in cuts:
        kinds = {tuple(parts[cut]) for parts in rows.values()}
        if len(kinds) > 1:
            faults.append({"of": "parts", "span": f"cut at {cut} s", "why": f"rows differ: { {c: p[cut] for c, p in rows.items()} }"})
    return faults, counts


DOCUMENTS = {
    "inspect": "inspect short.csv -r arm.toml",
    "lsq": "lsq short.csv -r arm.toml -o m1.toml",
    "validate": "validate short.csv -m model.toml",
    "diagnose": "diagnose short.csv -m model.toml -o m2.toml",
    "torque": "torque short.csv -m model.toml -o t.csv",
    "compare": "compare model.toml model.toml",
}
TAKERS = (
    "validate short.csv -m {}",
    "diagnose short.csv -m {} -o out.toml",
    "torque short.csv -m {} -o out.csv",
    "export -m {} --c out.h",
    "show {}",
    "watch short.csv -m {}",
    "payload short.csv -m {}",
    "compare {} model.toml",
    "simulate -r arm.toml -m {} --seconds 1 -o out.csv",
    "excite -m {} --for weak -o out.toml",
    "lsq short.csv -r {} -o out.toml",
    "lsq short.csv -r arm.toml -m {} -o out.toml",
    "reduce short.csv -r {} -o out.cfi",
    "track {}",
    "identify {}",
    "identify {} short.csv",
    "inspect short.csv -r {}",
)


def documents(tool):
    faults, counts = [], Counter()
    for kind_of, line in DOCUMENTS.items():
        assert tool.run(f"{line} --json doc.json -q").status == 0, line
        for taker in TAKERS:
            ended = tool.run(taker.replace("{}", "doc.json"))
            counts["documents"] += 1
            why = complaint(ended, (2, 3))
            if why is None and "doc.json" not in ended.said:
                why = "the document is not named"
            if why is None and not re.search(r"JSON|document", ended.said):
                why = "it does not say that this is a JSON document"
            if why:
                faults.append({"of": "documents", "document": kind_of, "line": taker, "why": why, "said": ended.said.splitlines()[:4]})
    return faults, counts


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    short = "--short" in sys.argv
    faults, counts = [], Counter()
    with tempfile.TemporaryDirectory() as folder:
        tool = Tool(words[0], folder)
        (tool.folder / "arm.toml").write_text(arm_logs.ROBOT)
        arm_logs.write_csv(tool.folder / "short.csv", arm_logs.drive(4, 10.0))
        (tool.folder / "bad.toml").write_text(ROBOT)
        assert tool.run("lsq short.csv -r bad.toml -o model.toml").status == 0
        tool.run("lsq short.csv -r arm.toml -o model.toml")
        for found, many in (documents(tool), spans(tool, arm_logs.drive(3), short), robots(tool, short)):
            faults += found
            counts += many
            print(many, len(found), flush=True)
    rows = [{"cases": kind, "number": many, "not as they must be": sum(fault["of"] == kind for fault in faults)}
            for kind, many in counts.items()]  # fmt: skip
    record(words, "files that nobody should give", "files", rows, short)
    for fault in faults[:40]:
        print(fault)
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
