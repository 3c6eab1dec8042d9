"""A run of the segmentation, told line by line as it goes on."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator

from starlette.concurrency import run_in_threadpool

from .answers import counts_of
from .changes import Partition
from .document import Document
from .folder import Files
from .replies import Body, message_of
from .segmenting import Cancelled, Turn


async def told(
    files: Files, number: int, parameters: Body, *, is_preview: bool
) -> AsyncIterator[str]:
    """Segment a file; yield lines of progress, and the revision in the last line."""
    loop = asyncio.get_running_loop()
    queue: asyncio.Queue[Body | None] = asyncio.Queue()
    turn = Turn(lambda fact: loop.call_soon_threadsafe(queue.put_nowait, fact))
    work = asyncio.ensure_future(
        run_in_threadpool(_segmented, files, number, parameters, turn, is_preview)
    )
    work.add_done_callback(lambda _: queue.put_nowait(None))
    try:
        while (fact := await queue.get()) is not None:
            yield _line(fact)
        yield _line(await work)
    finally:  # also where the client has gone
        turn.cancel()


def _segmented(files: Files, number: int, parameters: Body, turn: Turn, is_preview: bool) -> Body:
    try:
        with files.document(number) as document:
            return _done(document, parameters, turn, is_preview)
    except Cancelled:
        return {"cancelled": True}
    except Exception as error:
        return {"error": message_of(error)}


def _done(document: Document, parameters: Body, turn: Turn, is_preview: bool) -> Body:
    start = time.perf_counter()
    base = document.segmenter.run(parameters, turn)
    turn.check()
    if is_preview:
        partition = Partition(parameters, base.digest)
        revision = document.revisions.add(partition, base.labels, base.n_regions)
    else:
        revision = document.set_base(parameters, base)
    seconds = round(time.perf_counter() - start, 3)
    found = {"revision": revision.number, "n_regions": revision.n_regions, "seconds": seconds}
    return {**found, "parameters": parameters, "notes": list(base.notes), **counts_of(document)}


def _line(fact: Body) -> str:
    return json.dumps(fact, separators=(",", ":")) + "\n"
