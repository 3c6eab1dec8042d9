"""Files of formats that other libraries read and write, handed to them by name."""

from __future__ import annotations

import contextlib
import importlib
import io
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

from ..errors import MissingExtraError
from .guards import Content

__all__ = ["file_of", "file_to_fill", "reason_of", "run_meshio", "vtk_modules"]


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


def reason_of(error: BaseException) -> str:
    """The kind and the message of another library's error, as a line of at most 200 characters."""
    return shortened(f"{type(error).__name__}: {error}")


def shortened(message: str) -> str:
    """The message as one line of at most 200 characters."""
    line = " ".join(message.split())
    return line if len(line) <= 200 else f"{line[:197]}..."


def run_meshio(work: Callable[[Any], Any]) -> tuple[Any, str | None]:
    """Return what is made with meshio, and None; or None, and why it failed.

    meshio ends the process where a file is wrong, and prints what is strange: here it does neither.
    """
    try:
        meshio = importlib.import_module("meshio")
    except ModuleNotFoundError:
        raise MissingExtraError("tetrahedra in a file", "io") from None
    printed = io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(printed),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")
            return work(meshio), None
    except MemoryError:
        raise
    except SystemExit:
        return None, shortened(printed.getvalue()) or "it gave up"
    except Exception as error:  # of any kind: parsers of foreign files fail in many ways
        return None, reason_of(error)


@contextlib.contextmanager
def vtk_modules() -> Iterator[Any]:
    """Give the parts of VTK that read and write surfaces, which print no messages meanwhile."""
    members: dict[str, Any] = {}
    try:
        for name in ("vtkCommonCore", "vtkCommonDataModel", "vtkIOXML", "util.numpy_support"):
            members |= vars(importlib.import_module(f"vtkmodules.{name}"))
    except ModuleNotFoundError:
        raise MissingExtraError("a .vtp file", "io") from None
    vtk = SimpleNamespace(**members)
    shows_warnings = vtk.vtkObject.GetGlobalWarningDisplay()
    vtk.vtkObject.GlobalWarningDisplayOff()
    try:
        yield vtk
    finally:
        vtk.vtkObject.SetGlobalWarningDisplay(shows_warnings)
