"""Results: the document of a command, its tables and its page."""

from __future__ import annotations

import html
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import Model


class Result:
    """What a stage found: ``to_dict`` is the JSON document of the command, ``html`` its page, ``str`` its tables."""

    def __init__(self, document: str, page: str | None, text: str, full: Callable[[], str] | None = None):
        self.json = document
        self._page = page
        self._text = text
        self._full = full

    @property
    def html(self) -> str | None:
        """The page of the command, made when it is first asked for; ``None`` where the command has none."""
        if self._full is not None:
            self._page, self._full = self._full(), None
        return self._page

    @property
    def errors(self) -> dict[str, Any]:
        """Relative torque errors as arrays in the order of ``joint``; of a diagnosis ``before`` and ``after``."""
        import numpy as np

        document = self.to_dict()
        sides = [side for side in ("before", "after") if side in document]
        parts: dict[str, dict[str, Any]] = {side: document[side].get("holdout") or document[side]["train"] for side in sides}
        parts = parts or {"error": document}
        rows = {side: part["joints"] for side, part in parts.items()}
        first = next(iter(rows.values()))
        found: dict[str, Any] = {"joint": [row["joint"] for row in first]}
        for side, of in rows.items():
            found[side] = np.array([row["relative_error"] for row in of], dtype=float)
        return found

    def to_dict(self) -> dict[str, Any]:
        """The document; undetermined numbers are ``None``."""
        document: dict[str, Any] = json.loads(self.json)
        return document

    @property
    def warnings(self) -> list[str]:
        """What did not come as it should."""
        warnings: list[str] = self.to_dict()["warnings"]
        return warnings

    def save_html(self, path: Any) -> None:
        """Write the report as one page."""
        page = self.html
        if page is None:
            raise ValueError("this result has no page")
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def _repr_html_(self) -> str:
        page = self.html
        if page is None:
            return f"<pre>{html.escape(self._text)}</pre>"
        # a page of its own inside the notebook's
        return f'<iframe srcdoc="{html.escape(page, quote=True)}" width="100%" height="600" frameborder="0"></iframe>'

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.to_dict()['schema']}>"


class Fit(Result):
    """A fit with its model."""

    def __init__(self, document: str, page: str, text: str, model: Model, full: Callable[[], str] | None = None):
        super().__init__(document, page, text, full)
        self.model = model

    @property
    def parameters(self) -> Any:
        """A pandas frame of the model's parameters."""
        return self.model.parameters


class Identification(Result):
    """A robot identified from a URDF and logs: ``folder`` holds models, pages and the robot file."""

    def __init__(self, document: str, page: str | None, text: str, model: Model, folder: str):
        super().__init__(document, page, text)
        self.model = model
        self.folder = folder

    @property
    def parameters(self) -> Any:
        """A pandas frame of the model's parameters."""
        return self.model.parameters


class Diagnosis(Result):
    """A diagnosis; ``model`` is refined, or ``None`` where the data are at fault."""

    def __init__(self, document: str, page: str | None, text: str, model: Model | None,
                 full: Callable[[], str] | None = None):
        super().__init__(document, page, text, full)
        self.model = model


class Payload(Result):
    """What an arm carries; ``model`` is that of the loaded arm."""

    def __init__(self, document: str, page: None, text: str, model: Model):
        super().__init__(document, page, text)
        self.model = model


class Track(Result):
    """Parameters over logs."""

    def courses(self) -> Any:
        """A pandas frame: robot, parameter, joint, log, time, estimate, value, std."""
        import pandas

        rows = []
        for robot in self.to_dict()["robots"]:
            for p in robot["parameters"]:
                columns = zip(robot["logs"], p["times"], p["estimates"], p["values"], p["std"])
                rows += [(robot["name"], p["name"], p["joint"], *row) for row in columns]
        names = ["robot", "parameter", "joint", "log", "time", "estimate", "value", "std"]
        return pandas.DataFrame(rows, columns=names)

    def changes(self) -> Any:
        """A pandas frame of all changes."""
        import pandas

        rows = [{"robot": r["name"], **c} for r in self.to_dict()["robots"] for c in r["changes"]]
        return pandas.DataFrame(rows)


class Excitation(Result):
    """A motion that was designed; ``path`` is its trajectory file."""

    def __init__(self, document: str, page: None, text: str, path: str):
        super().__init__(document, page, text)
        self.path = path


class NewRobot(Result):
    """A robot file that was written; ``path`` is its file."""

    def __init__(self, document: str, page: None, text: str, path: str):
        super().__init__(document, page, text)
        self.path = path


class Simulation(Result):
    """A log that was simulated; ``path`` is its file."""

    def __init__(self, document: str, page: None, text: str, path: str):
        super().__init__(document, page, text)
        self.path = path
