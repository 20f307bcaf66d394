"""Results: the document of a command, its tables and its page."""

from __future__ import annotations

import html
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import Array, Model


class Result:
    """What a stage found: ``to_dict`` is the JSON document of the command, ``html`` its page, ``str`` its tables."""

    def __init__(self, document: str, page: str | None, text: str, full: Callable[[], str | None] | None = None):
        self.json = document
        self._page = page
        self._text = text
        self._full = full

    @property
    def html(self) -> str | None:
        """The page of the command, made when it is first asked for; ``None`` where the command has none."""
        if self._full is not None:
            self._page, self._full = self._full() or self._page, None
        return self._page

    @property
    def errors(self) -> dict[str, Any]:
        """Relative torque errors as they are printed, as arrays in the order of ``joint``.

        ``error`` is that of rows in motion, ``error_all_rows`` has the rows at rest with it; of a diagnosis they are
        ``before`` and ``after``, ``before_all_rows`` and ``after_all_rows``.
        """
        import numpy as np

        document = self.to_dict()
        # a campaign holds its validation and its fit, the errors are those of what was not fitted
        document = document.get("validate") or document.get("lsq") or document
        sides = [side for side in ("before", "after") if isinstance(document.get(side), dict)]
        parts: dict[str, dict[str, Any]] = {side: document[side].get("holdout") or document[side]["train"] for side in sides}
        parts = parts or {"error": document}
        found: dict[str, Any] = {}
        for side, part in parts.items():
            rows = part.get("joints") or []
            if not rows or "relative_error" not in rows[0]:
                raise AttributeError(f"{type(self).__name__} has no errors of torques")
            found["joint"] = [row["joint"] for row in rows]
            moving = [row.get("relative_error_moving") for row in rows]
            every = [row["relative_error"] for row in rows]
            found[side] = np.array([b if a is None else a for a, b in zip(moving, every)], dtype=float)
            found[f"{side}_all_rows"] = np.array(every, dtype=float)
        return found

    @property
    def error(self) -> float:
        """The relative torque error as it is printed: rms of the joints' errors in motion."""
        import numpy as np

        found = self.errors
        sizes = found["after"] if "after" in found else found["error"]
        return float(np.sqrt(np.mean(np.square(sizes))))

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

    def _size(self) -> list[str]:
        """What the representation says beside the error."""
        return []

    def __repr__(self) -> str:
        try:
            said = [f"error {f'{100.0 * self.error:#.3g}'.rstrip('.')} %", *self._size()]
        except (AttributeError, KeyError):
            said = self._size() or [self.to_dict()["schema"]]
        return f"{type(self).__name__}({', '.join(said)})"


@dataclass(frozen=True)
class Rows:
    """Rows of logs with their torques, (N, n) each and ``t`` (N,); a joint's rows in motion are ``moving[:, j]``."""

    #: Time [s].
    t: Array
    #: Positions [m or rad] and velocities [m/s or rad/s].
    q: Array
    v: Array
    #: Torque as logged and as the model gives it [N or N m].
    torque: Array
    reconstructed: Array
    #: Half the width of the 95 % band [N or N m]; 0 where the model holds none.
    half_width: Array
    #: Whether the joint moves.
    moving: Any

    @property
    def residual(self) -> Array:
        """Measured less reconstructed torque [N or N m]."""
        return self.torque - self.reconstructed

    def __repr__(self) -> str:
        return f"Rows({len(self.t)} of {self.q.shape[1]} joints)"


class ModelResult(Result):
    """A result of a model on logs."""

    def __init__(self, document: str, page: str | None, text: str, model: Model, full: Callable[[], str | None] | None,
                 logs: list[Any]):
        super().__init__(document, page, text, full)
        self.model = model
        self._logs = logs

    def rows(self) -> Rows:
        """Measured and reconstructed torque of every row of the logs, as arrays."""
        from . import rows

        return rows(self.model, self._logs)


class Validation(ModelResult):
    """Errors of a model on logs."""

    def _size(self) -> list[str]:
        return [f"{len(self.errors['joint'])} joints"]


class Fit(ModelResult):
    """A fit with its model."""

    def _size(self) -> list[str]:
        return [f"{len(self.model._native.parameters)} parameters"]

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

    def _size(self) -> list[str]:
        return [f"{len(self.model._native.parameters)} parameters"]

    @property
    def parameters(self) -> Any:
        """A pandas frame of the model's parameters."""
        return self.model.parameters


class Diagnosis(Result):
    """A diagnosis; ``model`` is refined, or ``None`` where the data are at fault."""

    def __init__(self, document: str, page: str | None, text: str, model: Model | None,
                 full: Callable[[], str | None] | None = None):
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
