"""Identification of robot dynamics from logged joint positions and torques.

Every stage is a function of a :class:`Robot` and logs, with the numbers of the command line ``cft-ident``::

    import cft_ident as ci

    robot = ci.Robot.load("configs/emps.toml")
    fit = ci.lsq(robot, "emps_id.csv")
    fit.parameters            # a pandas frame
    fit.model.torque(q, v, a) # arrays of N rows and a column per joint, in N or N m
    fit.model.save("emps.toml")
    ci.validate(fit.model, "emps_pulses_val.csv").to_dict()["overall"]

A log is the path of a file (CSV, MCAP, rosbag2; a part of it as ``"log.csv@0..70%"``), reduced logs
(``"part.cfi"``, :class:`Part`), or a :class:`Log` of arrays or of a frame, so that .mat, .npz, Parquet and HDF5 come in
by whatever reads them. Units are SI and radians. Errors are :class:`CftIdentError` with the file, the line
or channel, and what to do. Ctrl-C ends a stage; the interpreter's lock is free while it works.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import (
    CftIdentError,
    InputError,
    Model as _Model,
    UndeterminedError,
    UsageError,
    __version__,
)
from .results import Diagnosis, Excitation, Fit, Identification, NewRobot, Payload, Result, Simulation, Track

__all__ = [
    "CftIdentError", "Diagnosis", "Excitation", "Fit", "Identification", "InputError", "Log", "Model", "NewRobot", "Part",
    "Payload", "Result", "Robot", "Simulation", "Track", "UndeterminedError", "UsageError", "__version__", "compare",
    "convert", "diagnose", "example", "excite", "export", "friction", "identify", "inspect", "lsq", "merge", "new",
    "payload", "reduce", "show", "simulate", "torque", "track", "validate", "watch",
]

PathLike = Union[str, "os.PathLike[str]"]
Array = NDArray[np.float64]


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

    def __init__(self, native: _native.Log, path: str | None = None, arrays: tuple[Array, Array, Array] | None = None):
        self._native = native
        self._path = path
        self._arrays = arrays

    @classmethod
    def load(cls, path: PathLike) -> Log:
        """A file, its columns mapped as the robot file says; ``log.csv@0..70%`` is a part of it."""
        return cls(_native.Log.load(os.fspath(path)), os.fspath(path))

    @classmethod
    def arrays(cls, t: ArrayLike, q: ArrayLike, tau: ArrayLike, *, reference: ArrayLike | None = None,
               temperature: ArrayLike | None = None, name: str = "arrays") -> Log:
        """Times ``t`` [s], positions ``q`` and torques ``tau``, one row per sample, one column per joint, SI units.

        ``reference`` are the positions that the controller was asked for, for ``estimator="iv"``; ``temperature``
        those of the drives [degC], a column of NaN for a joint without one.
        """
        flat = np.ascontiguousarray(t, dtype=np.float64)

        def matrix(values: ArrayLike) -> Array:
            found: Array = np.ascontiguousarray(values, dtype=np.float64)
            return found.reshape(len(flat), -1) if found.ndim == 1 and len(flat) else found

        other = None if reference is None else matrix(reference)
        warm = None if temperature is None else matrix(temperature)
        positions, torques = matrix(q), matrix(tau)
        native = _native.Log.arrays(name, flat, positions, torques, other, warm)
        # a command that works on files gets these three; what else there is it cannot be told
        kept = None if other is not None or warm is not None else (flat, positions, torques)
        return cls(native, arrays=kept)

    @classmethod
    def frame(cls, frame: Any, joints: Sequence[str], *, t: str = "t", q: str = "q_{}", tau: str = "tau_{}",
              name: str = "frame") -> Log:
        """A pandas or polars frame; ``q`` and ``tau`` are patterns of its columns with ``{}`` for the joint."""
        def columns(pattern: str) -> Array:
            return np.column_stack([np.asarray(frame[pattern.format(joint)], dtype=np.float64) for joint in joints])

        return cls.arrays(np.asarray(frame[t], dtype=np.float64), columns(q), columns(tau), name=name)

    @property
    def name(self) -> str:
        """Name of the log in results."""
        return self._native.name

    def __repr__(self) -> str:
        return f"Log({self.name!r})"


LogLike = Union[PathLike, Log, "Part"]


def _several(logs: LogLike | Iterable[LogLike]) -> list[LogLike]:
    return [logs] if isinstance(logs, (str, os.PathLike, Log, Part)) else list(logs)


def _own_columns(text: str) -> str:
    """A robot or model file whose logs have the columns ``t``, ``q_NAME`` and ``tau_NAME`` in SI units."""
    kept, inside, held = [], False, ""
    for line in text.splitlines():
        if line.startswith("["):
            inside = line.startswith(("[log]", "[log."))
        if inside:
            held = line if line.startswith("torque_held") else held
        else:
            kept.append(line)
    return "\n".join([*kept, "", "[log]", 'torque_is = "joint"', held, ""])


class _Files:
    """Logs, robots and models as files, for as long as a command works on them."""

    def __init__(self, *logs: LogLike | Iterable[LogLike]):
        self._folder = tempfile.TemporaryDirectory()
        self.of_arrays = any(isinstance(log, Log) and log._path is None for of in logs for log in _several(of))

    def __enter__(self) -> _Files:
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def new(self, name: str) -> str:
        """A place for a file."""
        return os.path.join(self._folder.name, name)

    def logs(self, logs: LogLike | Iterable[LogLike], joints: Sequence[str] | None = None) -> list[str]:
        """Paths of logs; those of arrays and reduced ones are written."""
        return [self._log(log, joints) for log in _several(logs)]

    def _log(self, log: LogLike, joints: Sequence[str] | None) -> str:
        if isinstance(log, Part):
            path = self.new(f"part-{len(os.listdir(self._folder.name))}.cfi")
            log.save(path)
            return path
        if not isinstance(log, Log):
            return os.fspath(log)
        if log._path is not None:
            return log._path
        if log._arrays is None:
            raise UsageError(f"{log.name}: this function takes arrays without references and temperatures")
        t, q, tau = log._arrays
        names = list(joints) if joints is not None else [f"q{k + 1}" for k in range(q.shape[1])]
        if not len(names) == q.shape[1] == tau.shape[1]:
            raise UsageError(f"{log.name}: {q.shape[1]} columns of positions and {tau.shape[1]} of torques, and the "
                             f"robot has the joints {', '.join(names)}")
        columns: dict[str, Any] = {f"q_{name}": q[:, k] for k, name in enumerate(names)}
        columns |= {f"tau_{name}": tau[:, k] for k, name in enumerate(names)}
        path = self.new(f"{log.name}.npz")
        np.savez(path, **columns, t=t)
        return path

    def model(self, model: Model | PathLike) -> str:
        """The path of a model that reads these logs."""
        if not isinstance(model, Model):
            if not self.of_arrays:
                return os.fspath(model)
            model = Model.load(model)
        path = self.new(f"model-{len(os.listdir(self._folder.name))}.toml")
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(_own_columns(model.text) if self.of_arrays else model.text)
        return path

    def robot(self, robot: Robot | PathLike) -> str:
        """The path of a robot file that reads these logs."""
        path = robot.path if isinstance(robot, Robot) else os.fspath(robot)
        if not self.of_arrays or not os.path.exists(path):
            return path
        with open(path, encoding="utf-8") as file:
            text = _own_columns(file.read())
        # beside the given one, so that its URDF is found
        folder = os.path.dirname(os.path.abspath(path))
        text = re.sub(r'^urdf = "(?!/)', lambda _: f'urdf = "{folder}/', text, flags=re.MULTILINE)
        own = self.new("robot.toml")
        with open(own, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
        return own

    def page(self, line: list[str]) -> str:
        """The page of a command line."""
        path = self.new("report.html")
        _native.run([*line, "--report", path])
        with open(path, encoding="utf-8") as file:
            return file.read()


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

    @property
    def parameters(self) -> Any:
        """A pandas frame: parameter, joint, value and std of the fit, the value in use, unit.

        Torques are computed with ``in_use``: the nearest number of links, drives and friction that can exist.
        """
        import pandas

        columns = ["parameter", "joint", "value", "std", "in_use", "unit"]
        frame = pandas.DataFrame(self._native.parameters, columns=columns)
        # a link's parameter has no joint: None, which a frame of strings would turn into NaN
        frame["joint"] = pandas.Series([row[1] for row in self._native.parameters], dtype=object)
        return frame

    @property
    def covariance(self) -> Any:
        """A pandas frame of the covariance of the fitted parameters, named as ``NAME`` or ``NAME:JOINT``.

        ``None`` where the model file holds none.
        """
        found = _native.covariance(self._native)
        if found is None:
            return None
        import pandas

        names, matrix = found
        return pandas.DataFrame(matrix, index=names, columns=names)

    def torque(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, dt: float | None = None) -> Array:
        """Torques along a motion, with friction, offsets and effects.

        ``q``, ``v``, ``a``: arrays of shape (N, n) or (n,), in m or rad and per s. Returns the same shape, in N or
        N m. ``dt`` [s] is the time between rows, where effects of the model remember the motion.
        """
        (q, v, a), one = _motion(q, v, a)
        tau = _native.torque(self._native, q, v, a, dt)
        return tau[0] if one else tau

    def gravity(self, q: ArrayLike) -> Array:
        """Torques that carry the links at rest, without friction: (N, n) or (n,), in N or N m."""
        (q,), one = _motion(q)
        still = np.zeros_like(q)
        rows = _native.regressor(self._native, q, still, still)
        weight: Array = rows @ self._theta()
        return weight[0] if one else weight

    def friction(self, v: ArrayLike) -> Array:
        """Friction of each joint at the velocities ``v``: (N, n) or (n,), in N or N m.

        The declared law with the effects that depend on a joint's speed alone, as exported code has it: none where it
        would drive the joint.
        """
        (v,), one = _motion(v)
        found = _native.joint_friction(self._native, v)
        return found[0] if one else found

    def friction_compensation(self, v: ArrayLike, v_desired: ArrayLike) -> Array:
        """Friction for a controller to add, silent at rest: (N, n) or (n,), in N or N m.

        ``v`` and ``v_desired``: measured and desired velocities, of one shape. A joint that is told to move gets the
        friction of its desired speed; one that is told to rest that of its measured speed, and nothing below a hundredth
        of its speed limit (0.01 rad/s or 1 mm/s where the robot file gives none). Continuous in both.
        """
        (v, wanted), one = _motion(v, v_desired)
        rest = np.array(_native.rest_speeds(self._native))
        share = np.minimum(np.abs(wanted) / rest, 1.0)
        felt = np.clip(np.abs(v) / rest - 1.0, 0.0, 1.0)
        tau: Array = share * self.friction(wanted) + (1.0 - share) * felt * self.friction(v)
        return tau[0] if one else tau

    def regressor(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """The matrix Y of the inertial parameters: (N, n, p), or (n, p) for one row."""
        (q, v, a), one = _motion(q, v, a)
        rows = _native.regressor(self._native, q, v, a)
        return rows[0] if one else rows

    def regressor_blocks(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, rows: int = 10_000) -> Iterator[Array]:
        """The matrices Y of so many rows after one another, (rows, n, p) each: all together may not fit into memory.

        Contiguous arrays of floats are not copied.
        """
        (q, v, a), _ = _motion(q, v, a)
        for first in range(0, len(q), rows):
            block = slice(first, first + rows)
            yield _native.regressor(self._native, q[block], v[block], a[block])

    def mass_matrix(self, q: ArrayLike) -> Array:
        """The mass matrix: (N, n, n), or (n, n) for one row, in kg, kg m or kg m^2."""
        (q,), one = _motion(q)
        mass = _native.mass_matrix(self._native, q)
        return mass[0] if one else mass

    def _theta(self) -> Array:
        """Inertial parameters in use, in the order of the regressor's columns."""
        rows = self._native.parameters
        return np.array([in_use for _, joint, _, _, in_use, _ in rows if joint is None])

    def to_urdf(self, path: PathLike, source: PathLike | None = None) -> Result:
        """Write the model as URDF, with a model file of the rest beside it; ``source`` is one whose meshes are kept."""
        return export(self, urdf=path, urdf_source=source)

    def to_c(self, path: PathLike) -> Result:
        """Write the model as a C99 header."""
        return export(self, c=path)

    def to_rust(self, path: PathLike) -> Result:
        """Write the model as a Rust module."""
        return export(self, rust=path)

    def to_ros2_control(self, path: PathLike) -> Result:
        """Write gains of ros2_control's joint_trajectory_controller for joints that take efforts."""
        return export(self, ros2_control=path)

    def to_mjcf(self, path: PathLike, source: PathLike | None = None) -> Result:
        """Write the model for MuJoCo; ``source`` is an MJCF whose geoms and meshes are kept."""
        return export(self, mjcf=path, mjcf_source=source)

    def to_sdf(self, path: PathLike) -> Result:
        """Write the model for Gazebo."""
        return export(self, sdf=path)

    def to_usd(self, path: PathLike) -> Result:
        """Write the model for Isaac Sim."""
        return export(self, usd=path)

    def __repr__(self) -> str:
        return f"Model({self._native.name!r}, {len(self._native.parameters)} parameters)"


def _motion(*arrays: ArrayLike) -> tuple[list[Array], bool]:
    """Arrays of one motion, row after row, and whether they are of one row."""
    found = [np.ascontiguousarray(x, dtype=np.float64) for x in arrays]
    one = all(x.ndim == 1 for x in found)
    return [np.atleast_2d(x) for x in found], one


def _model(model: Model | PathLike | None) -> _Model | None:
    return None if model is None else _given(model)


def _given(model: Model | PathLike) -> _Model:
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

    def __reduce__(self) -> tuple[Any, ...]:
        return (Part.from_bytes, (self.to_bytes(),))

    def __repr__(self) -> str:
        return f"Part({len(self._native.logs)} logs)"


def inspect(logs: LogLike | Iterable[LogLike], robot: Robot | PathLike | None = None) -> Result:
    """What logs hold and what is wrong with them."""
    with _Files(logs) as files:
        joints = None if robot is None else _robot(robot).joints
        line = ["inspect", *files.logs(logs, joints)]
        if robot is not None:
            line += ["-r", files.robot(robot)]
        return Result(*_command(line))


def friction(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, joint: str | None = None,
             model: Model | PathLike | None = None, as_declared: bool = False) -> Fit:
    """Friction of joints from logs of one joint each; ``model`` is renewed in the joints that the logs move."""
    told, found = _native.friction(_robot(robot), _logs(logs), joint, _model(model), as_declared)
    return Fit(*told, Model(found))


def lsq(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, model: Model | PathLike | None = None,
        estimator: str = "wls", unconstrained: bool = False, hold_friction: bool = False,
        as_declared: bool = False) -> Fit:
    """Inertial parameters by least squares; ``model`` holds the friction where it is not fitted with them.

    ``estimator`` is ``wls``, ``ols``, ``irls``, ``iv`` or ``oe``; reduced logs serve the first two. The model holds the
    plain fit and beside it the nearest parameters of links, drives and friction that can exist, which torques are computed
    with; ``unconstrained`` leaves those out.
    """
    def page() -> str:
        with _Files(logs) as files:
            line = ["lsq", *files.logs(logs, _robot(robot).joints), "-r", files.robot(robot), "--estimator", estimator]
            line += [] if model is None else ["-m", files.model(model)]
            line += _options({"unconstrained": unconstrained, "hold_friction": hold_friction, "as_declared": as_declared})
            return files.page([*line, "-o", files.new("fitted.toml")])

    told, found = _native.lsq(_robot(robot), _logs(logs), _model(model), estimator, unconstrained, hold_friction,
                              as_declared)
    return Fit(*told, Model(found), page if isinstance(robot, (str, os.PathLike)) or robot._path else None)


def validate(model: Model | PathLike, logs: LogLike | Iterable[LogLike]) -> Result:
    """How far the torques of logs are off that were not used."""
    def page() -> str:
        with _Files(logs) as files:
            joints = _given(model).joints
            return files.page(["validate", *files.logs(logs, joints), "-m", files.model(model)])

    document, short, text = _native.validate(_given(model), _logs(logs))
    return Result(document, short, text, page)


def diagnose(model: Model | PathLike, logs: LogLike | Iterable[LogLike], *,
             holdout: LogLike | Iterable[LogLike] = (), keep: bool = False, accept: Sequence[str] = (),
             search: bool = False, candidates: PathLike | None = None) -> Diagnosis:
    """Effects that the model lacks; ``.model`` is the refined one, ``None`` where the data are at fault.

    ``accept`` names effects to write whatever the data say, ``"backlash:q4"``; ``search`` looks for a formula for what is
    left; ``candidates`` is a file of formulas of your own.
    """
    def line(files: _Files) -> list[str]:
        joints = _given(model).joints
        words = ["diagnose", *files.logs(logs, joints), "-m", files.model(model)]
        for log in files.logs(holdout, joints):
            words += ["--holdout", log]
        return words + _options({"keep": keep, "accept": list(accept), "search": search, "candidates": candidates})

    def page() -> str:
        with _Files(logs, holdout) as files:
            return files.page(line(files))

    if accept or search or candidates is not None:
        with _Files(logs, holdout) as files:
            refined = files.new("refined.toml")
            document, _, text = _command([*line(files), "-o", refined])
            return Diagnosis(document, None, text, Model.load(refined), page)
    (document, short, text), found = _native.diagnose(_given(model), _logs(logs), _logs(holdout), keep)
    return Diagnosis(document, short, text, None if found is None else Model(found), page)


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
        parts: list[_native.Part] = []
        models: list[_Model] = []
        for source in sources:
            if isinstance(source, (str, os.PathLike)):
                end = os.fspath(source).endswith(".cfi")
                source = Part.load(source) if end else Model.load(source)
            if isinstance(source, Part):
                parts.append(source._native)
            else:
                models.append(source._native)
        given.append((name, parts, models))
    return Track(*_native.track(given))


def _options(settings: dict[str, Any]) -> list[str]:
    """Keyword settings as words of a command: ``joint="q4"`` is ``--joint q4``; lists repeat, ``True`` is a flag."""
    words: list[str] = []
    for name, value in settings.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
            continue
        for one in value if isinstance(value, (list, tuple)) else [value]:
            words += [option, repr(one) if isinstance(one, float) else os.fspath(one) if isinstance(one, os.PathLike) else str(one)]
    return words


def excite(robot: Robot | PathLike, output: PathLike, *, model: Model | PathLike | None = None,
           **settings: Any) -> Excitation:
    """Design a motion for a robot file and write it as a trajectory.

    Without ``model`` torques are foreseen with the mass properties of the robot file, or not at all, as the result says.
    ``for_="weak"`` with a model narrows what is weak in it, ``for_="stribeck:q2"`` separates an effect. Other
    ``settings`` are options of the command: ``joint="q4"``, ``criterion="d-optimal"``, ``periods=8``, ``seed=1``,
    ``with_=["monday.csv"]``, ``samples="motion.csv"``.
    """
    path = robot.path if isinstance(robot, Robot) else os.fspath(robot)
    words = _options({name.rstrip("_"): value for name, value in settings.items()})
    with _as_file(model) as file:
        given = ["-m", file] if file is not None else []
        told = _command(["excite", "-r", path, *given, *words, "-o", os.fspath(output)])
    return Excitation(*told, os.fspath(output))


def simulate(robot: Robot | PathLike, output: PathLike, *, model: Model | PathLike | None = None,
             effects: Sequence[str] = (), seed: int = 1, **settings: Any) -> Simulation:
    """Simulate a robot file and write its log.

    ``effects`` are as on the command line, ``"ripple:q5"``; ``settings`` are its options: ``move="q4"``,
    ``reference="motion.toml"``, ``seconds=20.0``.
    """
    path = robot.path if isinstance(robot, Robot) else os.fspath(robot)
    words = _options({**settings, "effect": list(effects), "seed": seed})
    with _as_file(model) as file:
        given = ["-m", file] if file is not None else []
        return Simulation(*_command(["simulate", "-r", path, *given, *words, "-o", os.fspath(output)]),
                          os.fspath(output))


def identify(urdf: PathLike, logs: LogLike | Iterable[LogLike], output: PathLike = "cft-ident-run") -> Identification:
    """Everything from a URDF (or a robot file) and logs: fit, held-out errors, effects that are missing.

    Models, pages and the robot file stand in the folder ``output``; ``.model`` is the one to use.
    """
    folder = os.fspath(output)
    with _Files(logs) as files:
        robot = os.fspath(urdf)
        joints = None
        if files.of_arrays:
            is_file = robot.endswith(".toml")
            joints = Robot.load(robot).joints if is_file else Robot.from_urdf(robot).joints
            robot = files.robot(robot) if is_file else robot
        document, _, text = _command(["identify", robot, *files.logs(logs, joints), "-o", folder])
    kept = [name for name in ("refined.toml", "model.toml") if os.path.exists(os.path.join(folder, name))]
    page = os.path.join(folder, "report.html")
    html = None
    if os.path.exists(page):
        with open(page, encoding="utf-8") as file:
            html = file.read()
    if not kept:
        raise InputError(f"{folder}: no model was written there")
    return Identification(document, html, text, Model.load(os.path.join(folder, kept[0])), folder)


@contextlib.contextmanager
def _as_file(model: Model | PathLike | None) -> Iterator[str | None]:
    """The path of a model's file, of one in memory for as long as it is wanted."""
    if not isinstance(model, Model):
        yield None if model is None else os.fspath(model)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "model.toml")
        model.save(path)
        yield path


def payload(model: Model | PathLike, logs: LogLike | Iterable[LogLike], output: PathLike | None = None) -> Payload:
    """Mass [kg], centre [m] and inertia [kg m^2] of what the arm carries in these logs, with 95 % intervals.

    ``model`` is that of the unloaded arm; ``.model`` is that of the loaded one, which ``output`` keeps as a file.
    """
    with _Files(logs) as files:
        loaded = os.fspath(output) if output is not None else files.new("loaded.toml")
        joints = _given(model).joints
        told = _command(["payload", *files.logs(logs, joints), "-m", files.model(model), "-o", loaded])
        return Payload(*told, Model.load(loaded))


def torque(model: Model | PathLike, motion: PathLike, output: PathLike) -> Result:
    """Write feed-forward torques with their 95 % band [N or N m] for a log or trajectory file, as CSV or MCAP.

    For arrays there is :meth:`Model.torque`.
    """
    with _as_file(model) as path:
        return Result(*_command(["torque", os.fspath(motion), "-m", str(path), "-o", os.fspath(output)]))


def compare(one: Model | PathLike, other: Model | PathLike, logs: LogLike | Iterable[LogLike] = ()) -> Result:
    """Where two models differ, parameter by parameter with 95 % intervals; with logs also by their errors."""
    with _Files(logs) as files:
        both = [files.model(one), files.model(other)]
        return Result(*_command(["compare", *both, *files.logs(logs, _given(one).joints)]))


def watch(model: Model | PathLike, log: PathLike, output: PathLike, **settings: Any) -> Result:
    """Write the torques [N or N m] that push a robot from outside along a log file, as CSV or MCAP; alarms are told.

    ``settings`` are the options of the command: ``false_alarms=0.1`` (an hour), ``unloaded="empty.csv"``.
    """
    with _as_file(model) as path:
        words = _options(settings)
        return Result(*_command(["watch", os.fspath(log), "-m", str(path), *words, "-o", os.fspath(output)]))


def show(model: Model | PathLike) -> Result:
    """A model as a person wants to know it: what its error means in use, parameters, friction, effects, range."""
    with _as_file(model) as path:
        return Result(*_command(["show", str(path)]))


def convert(logs: PathLike | Iterable[PathLike], output: PathLike, *, robot: Robot | PathLike | None = None,
            **settings: Any) -> Result:
    """Write log files as one of another format (CSV, MCAP, Parquet); with ``robot`` in joints, m or rad, N or N m."""
    words = _options(settings)
    if robot is not None:
        words += ["-r", robot.path if isinstance(robot, Robot) else os.fspath(robot)]
    return Result(*_command(["convert", *words, *_files(logs), os.fspath(output)]))


def _files(logs: PathLike | Iterable[PathLike]) -> list[str]:
    return [os.fspath(file) for file in ([logs] if isinstance(logs, (str, os.PathLike)) else logs)]


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
           usd: PathLike | None = None, ros2_control: PathLike | None = None, urdf_source: PathLike | None = None,
           mjcf_source: PathLike | None = None, mujoco_damping: bool = False,
           logs: PathLike | Iterable[PathLike] = ()) -> Result:
    """Write a model as URDF, C header, Rust module, file of MuJoCo, Gazebo or Isaac Sim, or gains for ros2_control.

    ``urdf_source`` and ``mjcf_source`` are files of the same robot whose meshes, names and frames are kept. ``logs`` are
    log files along which the size of what such a file cannot say is taken.
    """
    outputs = [("--urdf", urdf), ("--c", c), ("--rust", rust), ("--mjcf", mjcf), ("--sdf", sdf), ("--usd", usd),
               ("--ros2-control", ros2_control), ("--urdf-source", urdf_source), ("--mjcf-source", mjcf_source)]
    with _as_file(model) as path:
        line = ["export", "-m", str(path), *_files(logs)]
        for option, output in outputs:
            line += [option, os.fspath(output)] if output is not None else []
        line += ["--mujoco-damping"] if mujoco_damping else []
        return Result(*_command(line))


def _command(line: list[str]) -> tuple[str, None, str]:
    document, text = _native.run(line)
    return document, None, text
