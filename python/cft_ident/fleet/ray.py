"""Reduce logs on a Ray cluster (``ray.data``)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .. import Model, PathLike, Robot
    from . import Fleet


def reduce_ray(urls: Iterable[str], robot: Robot | PathLike, *, model: Model | PathLike | None = None,
               store: str | None = None, as_declared: bool = False) -> Fleet:
    """Reduce logs where Ray has room, and merge them in a tree; arguments as of :func:`reduce_dask`.

    Ray runs a lost worker's tasks again by itself.
    """
    import ray

    from .. import Part
    from . import Fleet, _sorted_out, merge_bytes, reduce_one, texts, tree

    urls = list(urls)
    both = texts(robot, model, urls)
    rows = ray.data.from_items([{"url": url} for url in urls])
    found = rows.map(lambda row: _whole(reduce_one(row["url"], *both, store, as_declared))).take_all()
    found = [{key: value for key, value in row.items() if value is not None} for row in found]
    parts, failures, reused = _sorted_out(found)
    join = ray.remote(lambda *some: merge_bytes(list(some)))
    joined = tree(((key, ray.put(part)) for key, part in parts.items()), lambda some: join.remote(*some))
    return Fleet(Part.from_bytes(ray.get(joined)) if joined is not None else None, failures, reused)


def _whole(row: dict[str, Any]) -> dict[str, Any]:
    """A row with every column, as a table needs it."""
    return {"url": None, "key": None, "part": None, "reused": None, "error": None, **row}
