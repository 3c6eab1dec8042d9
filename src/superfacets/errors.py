"""The errors that superfacets raises for wrong input and missing extras, and its warnings."""

import importlib
from typing import Any


class MeshError(ValueError):
    """The mesh or its file cannot be used; the message says where and why."""


class MissingExtraError(ImportError):
    """A feature needs an optional dependency; the message says how to install it."""

    def __init__(self, task: str, extra: str) -> None:
        """Name the task and its extra; ``"torch"`` is a package that no extra installs."""
        needs, package = "an extra", f"'superfacets[{extra}]'"
        if extra == "torch":
            needs, package = extra, extra
        super().__init__(f"{task} needs {needs}: pip install {package}")
        self.extra = extra


def import_extra(module: str, task: str, extra: str) -> Any:
    """Return an optional module; a MissingExtraError for the task if it is not installed."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise MissingExtraError(task, extra) from None


class RenderError(RuntimeError):
    """Pictures cannot be made on this machine; the message says what to install."""


class IslandWarning(UserWarning):
    """There are more or fewer regions than asked for; the message says why."""


class BalanceWarning(UserWarning):
    """Some regions are disconnected, because only then they have the requested number of cells."""


class MismatchWarning(UserWarning):
    """Labels are transferred between meshes that do not cover each other."""


class SliverWarning(UserWarning):
    """Regions become stripes because faces are long and thin; the message says what to do."""


class ViewWarning(UserWarning):
    """Some images give no votes: their masks are empty, or their cameras see nothing."""


def reason_of(error: BaseException) -> str:
    """Return the class of an error and its message, as one line for a record."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
