"""Reduce logs on a Dask cluster (``distributed``)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .. import Model, PathLike, Robot
    from . import Fleet


def reduce_dask(client: Any, urls: Iterable[str], robot: Robot | PathLike, *,
                model: Model | PathLike | None = None, store: str | None = None,
                as_declared: bool = False) -> Fleet:
    """Reduce logs where workers of ``client`` are free, and merge them in a tree.

    ``robot`` and ``model`` are what :func:`cft_ident.reduce` takes. With a ``store``, a folder that all workers see, logs
    that were reduced before are not reduced again. A worker that is lost has its logs reduced by another one.
    """
    from dask.distributed import as_completed

    from .. import Part
    from . import Fleet, _sorted_out, merge_bytes, reduce_one, texts, tree

    urls = list(urls)
    both = texts(robot, model, urls)
    # the scheduler gives a lost worker's tasks to the others
    jobs = [client.submit(reduce_one, url, *both, store, as_declared, pure=False, retries=3) for url in urls]
    found = [job.result() for job in as_completed(jobs)]
    parts, failures, reused = _sorted_out(found)
    joined = tree(parts.items(), lambda some: client.submit(merge_bytes, some, pure=False, retries=3))
    if joined is not None and not isinstance(joined, bytes):
        joined = joined.result()
    return Fleet(Part.from_bytes(joined) if joined else None, failures, reused)
