"""Identification of robot dynamics from logged joint positions and torques.

Every stage is a function of a :class:`Robot` and logs, with the numbers of the command line ``cft-ident``::

    import cft_ident as ci

    robot = ci.Robot.load("configs/emps.toml")
    fit = ci.lsq(robot, "emps_id.csv")
    fit.parameters()          # a pandas frame
    fit.model.save("emps.toml")
    ci.validate(fit.model, "emps_pulses_val.csv").to_dict()["overall"]

A log is the path of a file (CSV, MCAP, rosbag2; a part of it as ``"log.csv@0..70%"``), reduced logs
(``"part.cfi"``, :class:`Part`), or a :class:`Log` of arrays or of a frame, so that .mat, .npz, Parquet and HDF5 come in
by whatever reads them. Units are SI and radians. Errors are :class:`CftIdentError` with the file, the line
or channel, and what to do. Ctrl-C ends a stage; the interpreter's lock is free while it works.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Sequence
from typing import Any, Union

import numpy as np

from . import _native
from ._native import (
    CftIdentError,
    InputError,
    Model as _Model,
    UndeterminedError,
    UsageError,
    __version__,
)
from .results import Diagnosis, Excitation, Fit, NewRobot, Result, Simulation, Track

__all__ = [
    "CftIdentError", "Diagnosis", "Excitation", "Fit", "InputError", "Log", "Model", "NewRobot", "Part",
    "Result", "Robot", "Simulation", "Track", "UndeterminedError", "UsageError", "__version__", "diagnose",
    "example", "excite", "export", "friction", "inspect", "lsq", "merge", "new", "reduce", "simulate",
    "track", "validate",
]

PathLike = Union[str, "os.PathLike[str]"]


class Robot:
    """A robot as its file describes it: links, friction law, columns of logs, filters."""

    def __init__(self, native: _native.Robot, path: str | None = None):
        self._native = native
        self._path = path

    @classmethod
    def load(cls, path: PathLike) -> Robot:
        """Read a robot file, or one that comes with the package such as ``configs/ur10.toml``."""
        return cls(_native.Robot.load(os.fspath(path)), os.fspath(path))

    @classmethod
    def parse(cls, text: str, name: str = "robot.toml") -> Robot:
        """The robot of TOML text; ``name`` stands for it in messages."""
        return cls(_native.Robot.parse(text, name))

    @classmethod
    def from_urdf(cls, path: PathLike, joints: Sequence[str] | None = None) -> Robot:
        """An arm from its URDF, friction fitted with the inertias; logs have columns ``q_NAME`` and ``tau_NAME``."""
        lines = ["[robot]", 'model = "serial"', f"urdf = {json.dumps(os.path.abspath(path))}"]
        lines += ["[friction]", 'law = "viscous-coulomb"', "fitted_with_inertias = true", "offset = true"]
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "robot.toml")
            with open(file, "w", encoding="utf-8") as out:
                out.write("\n".join(lines) + "\n")
            robot = cls(_native.Robot.load(file))
        if joints is not None and list(joints) != robot.joints:
            raise UsageError(f"the URDF has the joints {', '.join(robot.joints)}; give columns in this order")
        return robot

    @property
    def name(self) -> str:
        """Name of the file."""
        return self._native.name

    @property
    def joints(self) -> list[str]:
        """Names of the joints, in the order of the columns of arrays."""
        return self._native.joints

    @property
    def path(self) -> str:
        """The file, for what works on files alone."""
        if self._path is None:
            raise UsageError(f"{self.name}: this robot is no file; write it into one and use Robot.load")
        return self._path

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, joints={self.joints})"


class Log:
    """A log: a file or a part of it, or arrays in memory."""

    def __init__(self, native: _native.Log):
        self._native = native

    @classmethod
    def load(cls, path: PathLike) -> Log:
        """A file, its columns mapped as the robot file says; ``log.csv@0..70%`` is a part of it."""
        return cls(_native.Log.load(os.fspath(path)))

    @classmethod
    def arrays(cls, t: Any, q: Any, tau: Any, *, reference: Any = None, temperature: Any = None,
               name: str = "arrays") -> Log:
        """Times ``t`` [s], positions ``q`` and torques ``tau``, one row per sample, one column per joint, SI units.

        ``reference`` are the positions that the controller was asked for, for ``estimator="iv"``; ``temperature``
        those of the drives [degC], a column of NaN for a joint without one.
        """
        flat = np.ascontiguousarray(t, dtype=np.float64)

        def matrix(values: Any) -> np.ndarray:
            values = np.ascontiguousarray(values, dtype=np.float64)
            return values.reshape(len(flat), -1) if values.ndim == 1 and len(flat) else values

        other = None if reference is None else matrix(reference)
        warm = None if temperature is None else matrix(temperature)
        return cls(_native.Log.arrays(name, flat, matrix(q), matrix(tau), other, warm))

    @classmethod
    def frame(cls, frame: Any, joints: Sequence[str], *, t: str = "t", q: str = "q_{}", tau: str = "tau_{}",
              name: str = "frame") -> Log:
        """A pandas or polars frame; ``q`` and ``tau`` are patterns of its columns with ``{}`` for the joint."""
        def columns(pattern: str) -> np.ndarray:
            return np.column_stack([np.asarray(frame[pattern.format(joint)], dtype=np.float64) for joint in joints])

        return cls.arrays(np.asarray(frame[t], dtype=np.float64), columns(q), columns(tau), name=name)

    @property
    def name(self) -> str:
        """Name of the log in results."""
        return self._native.name

    def __repr__(self) -> str:
        return f"Log({self.name!r})"


LogLike = Union[PathLike, Log, "Part"]


def _logs(logs: LogLike | Iterable[LogLike]) -> list[_native.Log]:
    if isinstance(logs, (str, os.PathLike, Log, Part)):
        logs = [logs]
    return [_log(log) for log in logs]


def _log(log: LogLike) -> _native.Log:
    if isinstance(log, Log):
        return log._native
    if isinstance(log, Part):
        return log._native.as_log()
    return _native.Log.load(os.fspath(log))


def _robot(robot: Robot | PathLike) -> _native.Robot:
    return (robot if isinstance(robot, Robot) else Robot.load(robot))._native


class Model:
    """An identified model: parameters with their covariance, and the robot that they belong to."""

    def __init__(self, native: _Model):
        self._native = native

    @classmethod
    def load(cls, path: PathLike) -> Model:
        """Read a model file."""
        return cls(_native.Model.load(os.fspath(path)))

    @classmethod
    def parse(cls, text: str, name: str = "model.toml") -> Model:
        """The model of TOML text."""
        return cls(_native.Model.parse(text, name))

    @property
    def text(self) -> str:
        """The model file as TOML."""
        return self._native.text

    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
        return self._native.joints

    def save(self, path: PathLike) -> None:
        """Write the model file."""
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(self.text)

    def parameters(self) -> Any:
        """A pandas frame: parameter, joint, value, std, unit."""
        import pandas

        return pandas.DataFrame(self._native.parameters, columns=["parameter", "joint", "value", "std", "unit"])

    def __repr__(self) -> str:
        return f"Model({self._native.name!r}, {len(self._native.parameters)} parameters)"


def _model(model: Model | PathLike | None) -> _Model | None:
    if model is None:
        return None
    return (model if isinstance(model, Model) else Model.load(model))._native


class Part:
    """Reduced logs: what a linear fit needs of each, in a few kilobytes."""

    def __init__(self, native: _native.Part):
        self._native = native

    @classmethod
    def load(cls, path: PathLike) -> Part:
        """Read a file of reduced logs."""
        return cls(_native.Part.load(os.fspath(path)))

    @classmethod
    def from_bytes(cls, data: bytes, name: str = "part") -> Part:
        """The same from its bytes."""
        return cls(_native.Part.from_bytes(data, name))

    def to_bytes(self) -> bytes:
        """The bytes of the file; the same logs give the same bytes in whatever order they were merged."""
        return self._native.to_bytes()

    def save(self, path: PathLike) -> None:
        """Write the file (``.cfi``)."""
        with open(path, "wb") as file:
            file.write(self.to_bytes())

    @property
    def logs(self) -> list[dict[str, Any]]:
        """Each log: name, sha256, samples, duration_s, bounds_s, blocks."""
        keys = ["name", "sha256", "samples", "duration_s", "bounds_s", "blocks"]
        return [dict(zip(keys, log)) for log in self._native.logs]

    def __reduce__(self):
        return (Part.from_bytes, (self.to_bytes(),))

    def __repr__(self) -> str:
        return f"Part({len(self._native.logs)} logs)"


def inspect(logs: PathLike | Iterable[PathLike], robot: Robot | PathLike | None = None) -> Result:
    """What log files hold and what is wrong with them."""
    files = [logs] if isinstance(logs, (str, os.PathLike)) else list(logs)
    line = ["inspect", *map(os.fspath, files)]
    if robot is not None:
        line += ["-r", robot.path if isinstance(robot, Robot) else os.fspath(robot)]
    return Result(*_command(line))


def friction(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, joint: str | None = None,
             model: Model | PathLike | None = None, as_declared: bool = False) -> Fit:
    """Friction of joints from logs of one joint each; ``model`` is renewed in the joints that the logs move."""
    told, found = _native.friction(_robot(robot), _logs(logs), joint, _model(model), as_declared)
    return Fit(*told, Model(found))


def lsq(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, model: Model | PathLike | None = None,
        estimator: str = "wls", feasible: bool = False, hold_friction: bool = False,
        as_declared: bool = False) -> Fit:
    """Inertial parameters by least squares; ``model`` holds the friction where it is not fitted with them.

    ``estimator`` is ``wls``, ``ols``, ``irls``, ``iv`` or ``oe``; reduced logs serve the first two, and ``feasible``.
    """
    told, found = _native.lsq(_robot(robot), _logs(logs), _model(model), estimator, feasible, hold_friction,
                              as_declared)
    return Fit(*told, Model(found))


def validate(model: Model | PathLike, logs: LogLike | Iterable[LogLike]) -> Result:
    """How far the torques of logs are off that were not used."""
    return Result(*_native.validate(_model(model), _logs(logs)))


def diagnose(model: Model | PathLike, logs: LogLike | Iterable[LogLike], *,
             veto: LogLike | Iterable[LogLike] = (), holdout: LogLike | Iterable[LogLike] = (),
             keep: bool = False) -> Diagnosis:
    """Effects that the model lacks; ``.model`` is the refined one, ``None`` where the data are at fault."""
    told, found = _native.diagnose(_model(model), _logs(logs), _logs(veto), _logs(holdout), keep)
    return Diagnosis(*told, None if found is None else Model(found))


def reduce(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, model: Model | PathLike | None = None,
           as_declared: bool = False) -> Part:
    """What a linear fit needs of logs; it stands where ``lsq`` and ``validate`` take a log."""
    return Part(_native.reduce(_robot(robot), _logs(logs), _model(model), as_declared))


def merge(parts: Iterable[Part]) -> Part:
    """Several sets of reduced logs as one, the same in any order and grouping."""
    return Part(_native.merge([part._native for part in parts]))


def track(robots: dict[str, Sequence[Part | Model | PathLike]] | Sequence[Part | Model | PathLike]) -> Track:
    """Parameters over logs: of one robot (a list in order of time), or of several by name."""
    if not isinstance(robots, dict):
        robots = {"robot": robots}
    given = []
    for name, sources in robots.items():
        parts, models = [], []
        for source in sources:
            if isinstance(source, (str, os.PathLike)):
                end = os.fspath(source).endswith(".cfi")
                source = Part.load(source) if end else Model.load(source)
            (parts if isinstance(source, Part) else models).append(source._native)
        given.append((name, parts, models))
    return Track(*_native.track(given))


def excite(robot: Robot | PathLike, output: PathLike, *options: str) -> Excitation:
    """Design a motion for a robot file and write it as a trajectory; ``options`` are those of the command."""
    path = robot.path if isinstance(robot, Robot) else os.fspath(robot)
    told = _command(["excite", "-r", path, *options, "-o", os.fspath(output)])
    return Excitation(*told, os.fspath(output))


def simulate(robot: Robot | PathLike, output: PathLike, *options: str, seconds: float | None = None,
             seed: int = 1) -> Simulation:
    """Simulate a robot file and write its log; ``options`` are those of the command, such as ``"--move", "q4"``."""
    path = robot.path if isinstance(robot, Robot) else os.fspath(robot)
    line = ["simulate", "-r", path, *options, "--seed", str(seed), "-o", os.fspath(output)]
    if seconds is not None:
        line += ["--seconds", repr(float(seconds))]
    return Simulation(*_command(line), os.fspath(output))


def example(name: str, folder: PathLike) -> Result:
    """Write a measured log with its robot file into a folder: ``ur10``, ``tx40``, ``bldc``, or the simulated ``cft``."""
    return Result(*_command(["example", name, "-o", os.fspath(folder)]))


def new(name: PathLike, *, urdf: PathLike | None = None, log: PathLike | None = None,
        rate_hz: float | None = None) -> NewRobot:
    """Write the robot file ``name.toml`` from a URDF and a log; what was guessed is marked in it with CHECK IT."""
    line = ["new", os.fspath(name)]
    for option, value in [("--urdf", urdf), ("--log", log)]:
        line += [option, os.fspath(value)] if value is not None else []
    if rate_hz is not None:
        line += ["--rate", repr(float(rate_hz))]
    return NewRobot(*_command(line), os.fspath(name).removesuffix(".toml") + ".toml")


def export(model: Model | PathLike, *, urdf: PathLike | None = None, c: PathLike | None = None,
           rust: PathLike | None = None, mjcf: PathLike | None = None, sdf: PathLike | None = None,
           usd: PathLike | None = None, logs: PathLike | Iterable[PathLike] = ()) -> Result:
    """Write a model as URDF, C header, Rust module, or file of MuJoCo, Gazebo or Isaac Sim.

    ``logs`` are log files along which the size of what such a file cannot say is taken.
    """
    outputs = [("--urdf", urdf), ("--c", c), ("--rust", rust), ("--mjcf", mjcf), ("--sdf", sdf), ("--usd", usd)]
    files = [logs] if isinstance(logs, (str, os.PathLike)) else list(logs)
    with tempfile.TemporaryDirectory() as folder:
        path = os.fspath(model) if not isinstance(model, Model) else os.path.join(folder, "model.toml")
        if isinstance(model, Model):
            model.save(path)
        line = ["export", "-m", path, *map(os.fspath, files)]
        for option, output in outputs:
            line += [option, os.fspath(output)] if output is not None else []
        return Result(*_command(line))


def _command(line: list[str]) -> tuple[str, None, str]:
    document, text = _native.run(line)
    return document, None, text
