"""Every snippet of the documents and every example runs as it stands."""

import pathlib
import subprocess
import sys

import cft_ident as ci
import pytest

ROOT = pathlib.Path(__file__).parents[2]


def snippets(page):
    return [part.split("```")[0] for part in (ROOT / page).read_text().split("```python\n")[1:]]


@pytest.mark.parametrize("page", ["docs/python.md", "python/README.md"])
def test_the_snippets_of_a_page_run_in_an_empty_folder(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = {}
    for snippet in snippets(page):
        exec(snippet, words)
    assert isinstance(words["fit"], ci.Fit)


def test_every_page_with_python_is_run_by_some_test():
    pages = {str(p.relative_to(ROOT)) for p in [*ROOT.glob("docs/**/*.md"), *ROOT.glob("python/*.md"), ROOT / "README.md"]}
    assert {page for page in pages if snippets(page)} == {
        "docs/python.md", "python/README.md", "docs/use.md", "docs/developers/fleet.md",
    }


def test_the_cluster_of_the_manual_reduces_logs_with_the_robot_file_of_new(tmp_path):
    pytest.importorskip("distributed")
    ci.example("ur10", tmp_path / "ur10")
    log = (tmp_path / "ur10/ur10.csv").read_text().splitlines(keepends=True)
    half = len(log) // 2
    (tmp_path / "monday.csv").write_text("".join(log[:half]))
    (tmp_path / "tuesday.csv").write_text("".join([log[0], *log[half:]]))
    ci.new(tmp_path / "arm", urdf=tmp_path / "ur10/ur10.urdf", log=tmp_path / "monday.csv")
    (program,) = snippets("docs/developers/fleet.md")
    (tmp_path / "cluster.py").write_text(program)
    done = subprocess.run([sys.executable, "cluster.py"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout == "[]\n", done.stdout + done.stderr
    assert len(ci.Part.load(tmp_path / "all.cfi").logs) == 2
