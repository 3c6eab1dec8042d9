"""Files of formats that other libraries read and write, handed to them by name."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from .guards import Content

__all__ = ["file_of", "file_to_fill"]


@contextlib.contextmanager
def file_of(data: Content, ending: str) -> Iterator[str]:
    """Give the name of a file with this content, which lasts as long as the context."""
    with file_to_fill(ending) as path:
        path.write_bytes(data)
        yield str(path)


@contextlib.contextmanager
def file_to_fill(ending: str) -> Iterator[Path]:
    """Give the path of a file that is still to be made, in a folder that is removed then."""
    with TemporaryDirectory(prefix="superfacets-") as folder:
        yield Path(folder, f"mesh{ending}")
