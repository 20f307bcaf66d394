"""Measured logs, and the command line to compare with."""

import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"


@pytest.fixture(scope="session")
def measured():
    """A measured log by its name; the test is skipped without it."""

    def path(name: str) -> str:
        file = DATA / name
        if not file.exists():
            pytest.skip(f"{file} is not there (docs/results/measured/data.md says where it is from)")
        return str(file)

    return path


@pytest.fixture
def tool(tmp_path):
    """Runs the command line and gives its document."""
    program = os.environ.get("CFT_IDENT", "cft-ident")

    def run(*words: str) -> dict:
        done = subprocess.run([program, *words, "-q", "--json", "-"], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.fixture
def slide():
    """A log of a slide as arrays: mass 12, viscous 30, Coulomb 8, offset 4."""
    import numpy as np

    def arrays(seed: int, seconds: float = 12.0, start: float = 0.0):
        chance = np.random.default_rng(seed)
        now = np.arange(0.0, seconds, 0.005)
        waves = [(0.11, 1.9), (0.05, 4.7), (0.02, 9.1)]
        q = sum(a * np.sin(w * now + seed) for a, w in waves)
        v = sum(a * w * np.cos(w * now + seed) for a, w in waves)
        acc = sum(-a * w * w * np.sin(w * now + seed) for a, w in waves)
        tau = 12.0 * acc + 30.0 * v + 8.0 * np.sign(v) + 4.0 + 0.3 * chance.standard_normal(len(now))
        return start + now, q, tau

    return arrays


SLIDE = """
robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
friction = { law = "viscous-coulomb", fitted_with_inertias = true, offset = true }
filter = { cutoff_hz = 20.0, position_cutoff_hz = 80.0 }
"""


@pytest.fixture
def slide_robot():
    import cft_ident as ci

    return ci.Robot.parse(SLIDE, "slide.toml")
