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
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import (
    CftIdentError,
    InputError,
    Model as _Model,
    State,
    UndeterminedError,
    UsageError,
    __version__,
)
from .results import (
    Diagnosis,
    Excitation,
    Fit,
    Identification,
    NewRobot,
    Payload,
    Result,
    Rows,
    Simulation,
    Track,
    Validation,
)

__all__ = [
    "CftIdentError", "Diagnosis", "Excitation", "Fit", "Identification", "InputError", "Log", "Model", "NewRobot", "Part",
    "Payload", "Result", "Robot", "Rows", "Simulation", "State", "Track", "UndeterminedError", "UsageError", "Validation",
    "__version__", "compare", "convert", "diagnose", "example", "excite", "export", "friction", "identify", "inspect",
    "lsq", "merge", "new", "payload", "reduce", "rows", "show", "simulate", "torque", "track", "validate", "watch",
]

PathLike = Union[str, "os.PathLike[str]"]
Array = NDArray[np.float64]


class Robot:
    """A robot as its file describes it: links, friction law, columns of logs, filters."""

    def __init__(self, native: _native.Robot, path: str | None = None, draft: _Draft | None = None):
        self._native = native
        self._path = path
        self._draft = draft

    @classmethod
    def load(cls, path: PathLike) -> Robot:
        """Read a robot file, or one that comes with the package such as ``configs/ur10.toml``."""
        return cls(_native.Robot.load(os.fspath(path)), os.fspath(path))

    @classmethod
    def parse(cls, text: str, name: str = "robot.toml") -> Robot:
        """The robot of TOML text; ``name`` stands for it in messages."""
        return cls(_native.Robot.parse(text, name))

    @classmethod
    def from_urdf(cls, path: PathLike, joints: Sequence[str] | None = None, *, log: LogLike | None = None,
                  tip: str | None = None, cutoff_hz: float | None = None) -> Robot:
        """The robot whose file :func:`new` would write for this URDF and this log.

        Columns are mapped by their names, and the cut-off of the filter follows the rate. Without ``log`` each stage
        takes them from the first log that it is given. ``joints`` states the order of the columns of arrays;
        ``cutoff_hz`` [Hz] stands for the suggested cut-off.
        """
        draft = _Draft(os.fspath(path), tip, cutoff_hz)
        robot = cls(draft.robot(log), draft=draft if log is None else None)
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
    def text(self) -> str:
        """The robot file as TOML, with the links and limits of its URDF in it."""
        return self._native.text

    def save(self, path: PathLike) -> None:
        """Write the robot file."""
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(self.text)

    def _for(self, logs: LogLike | Iterable[LogLike]) -> _native.Robot:
        """The robot by which these logs are read."""
        if self._draft is None:
            return self._native
        return self._draft.robot(next(iter(_several(logs)), None))

    def __reduce__(self) -> tuple[Any, ...]:
        return (_robot_again, (self.text, self.name, self._path, self._draft))

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, joints={self.joints})"


def _robot_again(text: str, name: str, path: str | None, draft: _Draft | None) -> Robot:
    return Robot(_native.Robot.parse(text, name), path, draft)


@dataclass(frozen=True)
class _Draft:
    """What a robot file is drafted from."""

    urdf: str
    tip: str | None
    cutoff_hz: float | None

    def robot(self, log: LogLike | None) -> _native.Robot:
        """The robot that ``new`` drafts of the URDF and a log; without one its columns are ``q_NAME`` and ``tau_NAME``."""
        with _Files() as files:
            file = files.new("robot.toml")
            line = ["new", file, "--urdf", self.urdf] + ([] if self.tip is None else ["--tip", self.tip])
            arrays = isinstance(log, Log) and log._path is None
            if isinstance(log, Log) and arrays:
                _native.run([*line, "-q"])
                joints = _native.Robot.load(file).joints
                os.remove(file)
                line += ["--log", files.arrays(log, joints)]
            elif log is not None and not isinstance(log, Part) and not str(log).endswith(".cfi"):
                line += ["--log", log._path or "" if isinstance(log, Log) else os.fspath(log)]
            _native.run([*line, "-q"])
            with open(file, encoding="utf-8") as draft:
                text = draft.read()
            if self.cutoff_hz is not None:
                text = re.sub(r"^(# )?cutoff_hz = \S+", f"cutoff_hz = {float(self.cutoff_hz)!r}", text, flags=re.MULTILINE)
            if arrays:
                text = _own_columns(text)
            return _native.Robot.parse(text, os.path.basename(self.urdf), os.path.dirname(file))


class Log:
    """A log: a file or a part of it, or arrays in memory."""

    def __init__(self, native: _native.Log, path: str | None = None, arrays: dict[str, Any] | None = None):
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

        Angles are in rad: ``numpy.radians(q)`` of degrees. ``reference`` are the positions that the controller was asked
        for, for ``estimator="iv"``; ``temperature`` those of the drives [degC], a column of NaN for a joint without one.
        """
        times = np.ascontiguousarray(t, dtype=np.float64)
        if times.ndim != 1:
            raise UsageError(f"t has shape {times.shape}: give one time per sample, (N,); the order is t, q, tau")
        backwards = np.flatnonzero(~(np.diff(times) >= 0))
        if backwards.size:
            raise UsageError(f"t runs backwards after row {backwards[0]}: give times [s] first; the order is t, q, tau")
        positions = _samples("q", q, len(times))
        torques = _samples("tau", tau, len(times), positions.shape)
        more = {
            "reference": None if reference is None else _samples("reference", reference, len(times), positions.shape),
            "temperature": None if temperature is None
            else _samples("temperature", temperature, len(times), positions.shape, holes=True),
        }
        given: dict[str, Any] = {"name": name, "t": times, "q": positions, "tau": torques, **more}
        return cls(_native.Log.arrays(**given), arrays=given)

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

    @property
    def _more(self) -> bool:
        """Whether it has more than a file of arrays holds."""
        return any((self._arrays or {}).get(name) is not None for name in ("reference", "temperature"))

    def __reduce__(self) -> tuple[Any, ...]:
        return (_log_again, (self._path, self._arrays))

    def __repr__(self) -> str:
        return f"Log({self.name!r})"


def _log_again(path: str | None, arrays: dict[str, Any] | None) -> Log:
    return Log.arrays(**arrays) if arrays is not None else Log.load(str(path))


def _samples(name: str, values: ArrayLike, count: int, shape: tuple[int, ...] | None = None, *, holes: bool = False) -> Array:
    """One row per sample and one column per joint, of finite numbers unless there may be holes."""
    found: Array = np.ascontiguousarray(values, dtype=np.float64)
    if found.ndim == 1 and len(found) == count:
        found = found.reshape(count, 1)
    wanted = shape or (count, found.shape[-1])
    if found.shape != wanted:
        raise UsageError(f"{name} has shape {found.shape}; give one row per time and one column per joint, "
                         f"({count}, {shape[1] if shape else 'joints'}); the order is t, q, tau")
    if not holes and not np.isfinite(found).all():
        row, column = np.argwhere(~np.isfinite(found))[0]
        raise UsageError(f"{name} is {found[row, column]} in row {row}, column {column}: leave such rows out, or give the "
                         "part before and the part after as two logs")
    return found


LogLike = Union[PathLike, Log, "Part"]


def _several(logs: LogLike | Iterable[LogLike]) -> list[LogLike]:
    if isinstance(logs, (Robot, Model)):
        raise UsageError(f"a log is asked for, and here is {logs!r}: give the robot or model first, then the logs")
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
        return log._path if log._path is not None else self.arrays(log, joints)

    def arrays(self, log: Log, joints: Sequence[str] | None) -> str:
        """The file of a log of arrays, with columns named after the joints."""
        given = log._arrays or {}
        if log._more:
            raise UsageError(f"{log.name}: this function takes arrays without references and temperatures")
        q, tau = given["q"], given["tau"]
        names = list(joints) if joints is not None else [f"q{k + 1}" for k in range(q.shape[1])]
        if len(names) != q.shape[1]:
            raise UsageError(f"{log.name}: q and tau have {q.shape[1]} columns, and the robot has the joints {', '.join(names)}")
        columns: dict[str, Any] = {f"q_{name}": q[:, k] for k, name in enumerate(names)}
        columns |= {f"tau_{name}": tau[:, k] for k, name in enumerate(names)}
        path = self.new(f"{log.name}.npz")
        np.savez(path, **columns, t=given["t"])
        return path

    def model(self, model: Model | PathLike) -> str:
        """The path of a model that reads these logs."""
        if not isinstance(model, Model):
            if not self.of_arrays:
                return os.fspath(model)
            model = Model.load(model)
        return self._written("model", model.text)

    def robot(self, robot: Robot | PathLike, logs: LogLike | Iterable[LogLike] = ()) -> str:
        """The path of a robot file that reads these logs."""
        if not isinstance(robot, Robot):
            if not self.of_arrays:
                return os.fspath(robot)
            robot = Robot.load(robot)
        if robot._path is not None and not self.of_arrays:
            return robot._path
        return self._written("robot", robot._for(logs).text)

    def _written(self, what: str, text: str) -> str:
        path = self.new(f"{what}-{len(os.listdir(self._folder.name))}.toml")
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(_own_columns(text) if self.of_arrays else text)
        return path


@dataclass
class _Page:
    """The page of a command, made when it is first asked for; none of arrays that no file can hold."""

    command: str
    logs: list[LogLike]
    robot: Robot | PathLike | None = None
    model: Model | PathLike | None = None
    holdout: list[LogLike] = field(default_factory=list)
    options: dict[str, Any] = field(default_factory=dict)

    def line(self, files: _Files) -> list[str]:
        """The command line on these files."""
        joints = _robot(self.robot, self.logs).joints if self.robot is not None else _given(self.model).joints
        words = [self.command, *files.logs(self.logs, joints)]
        words += [] if self.robot is None else ["-r", files.robot(self.robot, self.logs)]
        words += [] if self.model is None else ["-m", files.model(self.model)]
        for log in files.logs(self.holdout, joints):
            words += ["--holdout", log]
        return words + _options(self.options)

    def __call__(self) -> str | None:
        if any(isinstance(log, Log) and log._more for log in [*self.logs, *self.holdout]):
            return None
        with _Files(self.logs, self.holdout) as files:
            path = files.new("report.html")
            output = [] if self.command == "validate" else ["-o", files.new("written.toml")]
            _native.run([*self.line(files), *output, "--report", path])
            with open(path, encoding="utf-8") as file:
                return file.read()


def _logs(logs: LogLike | Iterable[LogLike]) -> list[_native.Log]:
    return [_log(log) for log in _several(logs)]


def _log(log: LogLike) -> _native.Log:
    if isinstance(log, Log):
        return log._native
    if isinstance(log, Part):
        return log._native.as_log()
    if not isinstance(log, (str, os.PathLike)):
        raise UsageError(f"a log is asked for, and here is {log!r}; arrays come in by Log.arrays(t, q, tau)")
    if os.fspath(log).endswith((".toml", ".urdf")):
        raise UsageError(f"a log is asked for, and {os.fspath(log)} is a robot or model: give that first, then the logs")
    return _native.Log.load(os.fspath(log))


def _robot(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike] = ()) -> _native.Robot:
    if isinstance(robot, Robot):
        return robot._for(logs)
    if not isinstance(robot, (str, os.PathLike)):
        raise UsageError(f"a robot or the path of its file is asked for first, and here is {robot!r}")
    return _native.Robot.load(os.fspath(robot))


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
        return _native.torque(self._native, _rows(q), _rows(v), _rows(a), dt)

    def start(self, q: ArrayLike) -> State:
        """The model at rest in the pose ``q``, for one step a sample: ``state.step(dt, q, v, a)``.

        What effects remember is kept from step to step, as ``_init`` and ``_step`` of exported C do.
        """
        return State(self._native, _rows(q))

    def load_torque(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Torques of links and drives, without friction, offsets and effects: (N, n) or (n,), in N or N m."""
        return _native.load(self._native, _rows(q), _rows(v), _rows(a))

    def gravity(self, q: ArrayLike) -> Array:
        """Torques that carry the links at rest, without friction: (N, n) or (n,), in N or N m."""
        return _native.gravity(self._native, _rows(q))

    def friction(self, v: ArrayLike) -> Array:
        """Friction of each joint at the velocities ``v``: (N, n) or (n,), in N or N m.

        The declared law with the effects that depend on a joint's speed alone, as exported code has it: none where it
        would drive the joint.
        """
        return _native.joint_friction(self._native, _rows(v))

    def friction_compensation(self, v: ArrayLike, v_desired: ArrayLike) -> Array:
        """Friction for a controller to add, silent at rest: (N, n) or (n,), in N or N m.

        ``v`` and ``v_desired``: measured and desired velocities, of one shape. A joint that is told to move gets the
        friction of its desired speed; one that is told to rest that of its measured speed, and nothing below a hundredth
        of its speed limit (0.01 rad/s or 1 mm/s where the robot file gives none). Continuous in both.
        """
        v, wanted = _rows(v), _rows(v_desired)
        rest = np.array(_native.rest_speeds(self._native))
        share = np.minimum(np.abs(wanted) / rest, 1.0)
        felt = np.clip(np.abs(v) / rest - 1.0, 0.0, 1.0)
        tau: Array = share * self.friction(wanted) + (1.0 - share) * felt * self.friction(v)
        return tau

    def regressor(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """The matrix Y of the inertial parameters: (N, n, p), or (n, p) for one row."""
        return _native.regressor(self._native, _rows(q), _rows(v), _rows(a))

    def regressor_blocks(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, rows: int = 10_000) -> Iterator[Array]:
        """The matrices Y of so many rows after one another, (rows, n, p) each: all together may not fit into memory.

        Contiguous arrays of floats are not copied.
        """
        motion = [np.atleast_2d(_rows(x)) for x in (q, v, a)]
        for first in range(0, len(motion[0]), rows):
            yield self.regressor(*(x[first : first + rows] for x in motion))

    def mass_matrix(self, q: ArrayLike) -> Array:
        """The mass matrix: (N, n, n), or (n, n) for one row, in kg, kg m or kg m^2."""
        return _native.mass_matrix(self._native, _rows(q))

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

    def __reduce__(self) -> tuple[Any, ...]:
        return (Model.parse, (self.text, self._native.name))

    def __repr__(self) -> str:
        return f"Model({self._native.name!r}, {len(self._native.parameters)} parameters)"


def _rows(values: ArrayLike) -> Array:
    """One sample or rows of samples, contiguous."""
    return np.ascontiguousarray(values, dtype=np.float64)


def _model(model: Model | PathLike | None) -> _Model | None:
    return None if model is None else _given(model)


def _given(model: Model | PathLike | None) -> _Model:
    if isinstance(model, Model):
        return model._native
    if not isinstance(model, (str, os.PathLike)):
        raise UsageError(f"a model or the path of its file is asked for first, and here is {model!r}")
    return _native.Model.load(os.fspath(model))


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
        joints = None if robot is None else _robot(robot, logs).joints
        line = ["inspect", *files.logs(logs, joints)]
        if robot is not None:
            line += ["-r", files.robot(robot, logs)]
        return Result(*_command(line))


def friction(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, joint: str | None = None,
             model: Model | PathLike | None = None, as_declared: bool = False) -> Fit:
    """Friction of joints from logs of one joint each; ``model`` is renewed in the joints that the logs move."""
    logs = _several(logs)
    told, found = _native.friction(_robot(robot, logs), _logs(logs), joint, _model(model), as_declared)
    options = {"joint": joint, "as_declared": as_declared}
    return Fit(*told, Model(found), _Page("friction", logs, robot, model, options=options), logs)


def lsq(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, model: Model | PathLike | None = None,
        estimator: str = "wls", unconstrained: bool = False, hold_friction: bool = False,
        as_declared: bool = False) -> Fit:
    """Inertial parameters by least squares; ``model`` holds the friction where it is not fitted with them.

    ``estimator`` is ``wls``, ``ols``, ``irls``, ``iv`` or ``oe``; reduced logs serve the first two. The model holds the
    plain fit and beside it the nearest parameters of links, drives and friction that can exist, which torques are computed
    with; ``unconstrained`` leaves those out.
    """
    logs = _several(logs)
    told, found = _native.lsq(_robot(robot, logs), _logs(logs), _model(model), estimator, unconstrained, hold_friction,
                              as_declared)
    options = {"estimator": estimator, "unconstrained": unconstrained, "hold_friction": hold_friction,
               "as_declared": as_declared}
    return Fit(*told, Model(found), _Page("lsq", logs, robot, model, options=options), logs)


def validate(model: Model | PathLike, logs: LogLike | Iterable[LogLike]) -> Validation:
    """How far the torques of logs are off that were not used."""
    logs = _several(logs)
    given = _given(model)
    return Validation(*_native.validate(given, _logs(logs)), Model(given), _Page("validate", logs, model=model), logs)


def rows(model: Model | PathLike, logs: LogLike | Iterable[LogLike]) -> Rows:
    """Measured and reconstructed torque of every row of logs, as arrays."""
    return Rows(*_native.rows(_given(model), _logs(logs)))


def diagnose(model: Model | PathLike, logs: LogLike | Iterable[LogLike], *,
             holdout: LogLike | Iterable[LogLike] = (), keep: bool = False, accept: Sequence[str] = (),
             search: bool = False, candidates: PathLike | None = None) -> Diagnosis:
    """Effects that the model lacks; ``.model`` is the refined one, ``None`` where the data are at fault.

    ``accept`` names effects to write whatever the data say, ``"backlash:q4"``; ``search`` looks for a formula for what is
    left; ``candidates`` is a file of formulas of your own.
    """
    logs, holdout = _several(logs), _several(holdout)
    options = {"keep": keep, "accept": list(accept), "search": search, "candidates": candidates}
    page = _Page("diagnose", logs, model=model, holdout=holdout, options=options)
    if accept or search or candidates is not None:
        with _Files(logs, holdout) as files:
            refined = files.new("refined.toml")
            document, _, text = _command([*page.line(files), "-o", refined])
            return Diagnosis(document, None, text, Model.load(refined), page)
    (document, short, text), found = _native.diagnose(_given(model), _logs(logs), _logs(holdout), keep)
    return Diagnosis(document, short, text, None if found is None else Model(found), page)


def reduce(robot: Robot | PathLike, logs: LogLike | Iterable[LogLike], *, model: Model | PathLike | None = None,
           as_declared: bool = False) -> Part:
    """What a linear fit needs of logs; it stands where ``lsq`` and ``validate`` take a log."""
    logs = _several(logs)
    return Part(_native.reduce(_robot(robot, logs), _logs(logs), _model(model), as_declared))


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
    words = _options({name.rstrip("_"): value for name, value in settings.items()})
    with _Files() as files:
        given = [] if model is None else ["-m", files.model(model)]
        told = _command(["excite", "-r", files.robot(robot), *given, *words, "-o", os.fspath(output)])
    return Excitation(*told, os.fspath(output))


def simulate(robot: Robot | PathLike, output: PathLike, *, model: Model | PathLike | None = None,
             effects: Sequence[str] = (), seed: int = 1, **settings: Any) -> Simulation:
    """Simulate a robot file and write its log.

    ``effects`` are as on the command line, ``"ripple:q5"``; ``settings`` are its options: ``move="q4"``,
    ``reference="motion.toml"``, ``seconds=20.0``.
    """
    words = _options({**settings, "effect": list(effects), "seed": seed})
    with _Files() as files:
        given = [] if model is None else ["-m", files.model(model)]
        told = _command(["simulate", "-r", files.robot(robot), *given, *words, "-o", os.fspath(output)])
    return Simulation(*told, os.fspath(output))


def identify(urdf: Robot | PathLike, logs: LogLike | Iterable[LogLike],
             output: PathLike = "cft-ident-run") -> Identification:
    """Everything from a URDF (or a robot file) and logs: fit, held-out errors, effects that are missing.

    Models, pages and the robot file stand in the folder ``output``; ``.model`` is the one to use.
    """
    folder = os.fspath(output)
    with _Files(logs) as files:
        drafted = files.of_arrays and not isinstance(urdf, Robot) and not os.fspath(urdf).endswith(".toml")
        robot = Robot.from_urdf(urdf) if drafted and not isinstance(urdf, Robot) else urdf
        joints = _robot(robot, logs).joints if files.of_arrays else None
        document, _, text = _command(["identify", files.robot(robot, logs), *files.logs(logs, joints), "-o", folder])
    kept = [name for name in ("refined.toml", "model.toml") if os.path.exists(os.path.join(folder, name))]
    if not kept:
        raise InputError(f"{folder}: no model was written there")
    with open(os.path.join(folder, "report.html"), encoding="utf-8") as file:
        page = file.read()
    return Identification(document, page, text, Model.load(os.path.join(folder, kept[0])), folder)


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


def watch(model: Model | PathLike, log: LogLike, output: PathLike, **settings: Any) -> Result:
    """Write the torques [N or N m] that push a robot from outside along a log, as CSV or MCAP; alarms are told.

    ``settings`` are the options of the command: ``false_alarms=0.1`` (an hour), ``unloaded="empty.csv"``.
    """
    with _Files(log) as files:
        words = files.logs(log, _given(model).joints)
        return Result(*_command(["watch", *words, "-m", files.model(model), *_options(settings), "-o", os.fspath(output)]))


def show(model: Model | PathLike) -> Result:
    """A model as a person wants to know it: what its error means in use, parameters, friction, effects, range."""
    with _as_file(model) as path:
        return Result(*_command(["show", str(path)]))


def convert(logs: PathLike | Iterable[PathLike], output: PathLike, *, robot: Robot | PathLike | None = None,
            **settings: Any) -> Result:
    """Write log files as one of another format (CSV, MCAP, Parquet); with ``robot`` in joints, m or rad, N or N m."""
    with _Files() as files:
        words = _options(settings) + ([] if robot is None else ["-r", files.robot(robot, logs)])
        return Result(*_command(["convert", *words, *files.logs(logs), os.fspath(output)]))


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
        line = ["export", "-m", str(path), *_paths(logs)]
        for option, output in outputs:
            line += [option, os.fspath(output)] if output is not None else []
        line += ["--mujoco-damping"] if mujoco_damping else []
        return Result(*_command(line))


def _paths(files: PathLike | Iterable[PathLike]) -> list[str]:
    return [os.fspath(file) for file in ([files] if isinstance(files, (str, os.PathLike)) else files)]


def _command(line: list[str]) -> tuple[str, None, str]:
    document, text = _native.run(line)
    return document, None, text
