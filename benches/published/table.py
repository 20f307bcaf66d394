"""Joins the rows of docs/results/published/*.json into docs/results/published.json, the table of docs/results/published.md.

Usage: table.py [RESULTS]
"""

import json
import pathlib
import sys

results = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "docs/results")
order = ["emps", "tx40", "panda", "ur10", "ur10e", "dvrk", "xmate7p", "kr300", "pendulum", "cogging"]
rows = [row for name in order for row in json.load(open(results / "published" / f"{name}.json"))["rows"]]
rows = [{k: v if isinstance(v, str) else f"{v:.2f}" for k, v in row.items() if k != "joints"} for row in rows]
study = {"study": "published errors of models, and ours by the same protocol [%]", "rows": rows}
study["command"] = "benches/published/NAME/run, then benches/published/table.py"
json.dump(study, open(results / "published.json", "w"), indent=1)
