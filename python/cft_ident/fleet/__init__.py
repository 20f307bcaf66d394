"""Many logs on engines that exist: reduce each where a worker is free, merge in a tree, fit the result.

``reduce_dask`` and ``reduce_ray`` share what is here. A robot travels as one text, the links of its URDF in it. Work is
known by the SHA-256 of the log, that text, the friction model and the version: what lies in the store is not done again. A bad log is a row of the table of
failures, not the end. Parts are merged in the order of their hashes, in a tree that depends on nothing else, so
that the result has the same bytes however the work was shared.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .. import CftIdentError, InputError, Model, Part, PathLike, Robot, __version__, merge, reduce

__all__ = ["Fleet", "reduce_dask", "reduce_one", "reduce_ray", "tree"]

#: Parts that are merged at once.
BRANCHES = 8


@dataclass
class Fleet:
    """Reduced logs of one robot, and the logs that could not be reduced."""

    part: Part | None
    #: One row per bad log: url, error.
    failures: list[dict[str, str]] = field(default_factory=list)
    #: Logs whose part lay in the store.
    reused: int = 0


def reduce_one(url: str, robot: str, model: str | None, store: str | None, as_declared: bool = False) -> dict[str, Any]:
    """Reduce one log: ``{"url", "key", "part"}`` or ``{"url", "error"}``. ``robot`` and ``model`` are TOML texts.

    ``url`` is a path, or an fsspec URL (``s3://``, ``gs://``), whose file is copied to read it.
    """
    try:
        with tempfile.TemporaryDirectory() as folder:
            path, digest = _local(url, folder)
            settings = "\0".join([__version__, robot, model or "", str(as_declared)])
            key = hashlib.sha256(f"{digest}\0{settings}".encode()).hexdigest()
            kept = os.path.join(store, f"{key}.cfi") if store else None
            if kept and os.path.exists(kept):
                with open(kept, "rb") as file:
                    data = file.read()
                # a part that was cut off is made again
                try:
                    Part.from_bytes(data, kept)
                    return {"url": url, "key": key, "part": data, "reused": True}
                except CftIdentError:
                    pass
            friction = None if model is None else Model.parse(model)
            data = reduce(Robot.parse(robot), path, model=friction, as_declared=as_declared).to_bytes()
            if kept:
                _write(kept, data)
            return {"url": url, "key": key, "part": data, "reused": False}
    except (CftIdentError, OSError) as error:
        return {"url": url, "error": f"{type(error).__name__}: {error}"}


def tree(parts: Iterable[tuple[str, Any]], join: Callable[[list[Any]], Any]) -> Any:
    """Join parts with their keys in the order of the keys, :data:`BRANCHES` at a time."""
    level = [part for _, part in sorted(dict(parts).items())]
    while len(level) > 1:
        level = [join(level[k : k + BRANCHES]) for k in range(0, len(level), BRANCHES)]
    return level[0] if level else None


def merge_bytes(parts: list[bytes]) -> bytes:
    """Merge files of reduced logs."""
    return merge([Part.from_bytes(part) for part in parts]).to_bytes()


def texts(robot: Robot | PathLike, model: Model | PathLike | None, urls: Sequence[str] = ()) -> tuple[str, str | None]:
    """Robot and friction model as the texts that travel to the workers; what is wrong with either is raised here, once."""
    robot = robot if isinstance(robot, Robot) else Robot.load(robot)
    if model is not None and not isinstance(model, Model):
        model = Model.load(model)
    # a robot of a URDF takes columns and cut-off from the first log that is at hand
    here = [url for url in urls if "://" not in url]
    return robot._for(here).text, None if model is None else model.text


def _local(url: str, folder: str) -> tuple[str, str]:
    """A file to read, and the SHA-256 of its bytes."""
    path = url.removeprefix("file://")
    if "://" in path:
        import fsspec

        path = os.path.join(folder, os.path.basename(path))
        with fsspec.open(url, "rb") as source, open(path, "wb") as file:
            while chunk := source.read(1 << 20):
                file.write(chunk)
    digest = hashlib.sha256()
    name, _, span = path.partition("@")
    with open(name if not os.path.exists(path) else path, "rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    digest.update(span.encode())
    return path, digest.hexdigest()


def _write(path: str, data: bytes) -> None:
    """Write a file that appears whole or not at all."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    handle, unfinished = tempfile.mkstemp(dir=os.path.dirname(path), suffix=".part")
    with os.fdopen(handle, "wb") as file:
        file.write(data)
    os.replace(unfinished, path)


def _sorted_out(found: Iterable[dict[str, Any]]) -> tuple[dict[str, Any], list[dict[str, str]], int]:
    """Parts by their key, failures by their URL, and how many were reused; a log that is given twice counts once.

    Where no log can be reduced, that is an error, with the reason of the first.
    """
    parts, failures, reused = {}, [], 0
    for row in sorted(found, key=lambda row: row["url"]):
        if "error" in row:
            failures.append(row)
        elif row["key"] in parts:
            failures.append({"url": row["url"], "error": "the same log is given twice; it counts once"})
        else:
            parts[row["key"]] = row["part"]
            reused += bool(row["reused"])
    if failures and not parts:
        first = failures[0]
        raise InputError(f"none of {len(failures)} logs can be reduced; {first['url']}: {first['error']}")
    return parts, failures, reused


from .dask import reduce_dask  # noqa: E402
from .ray import reduce_ray  # noqa: E402
