"""Classes of errors and warnings that superfacets raises."""

import importlib.util
from typing import Any


class MeshError(ValueError):
    """A mesh or a file is not valid. The message describes the first fault that was found."""


class MissingExtraError(ImportError):
    """An optional dependency is missing. The message gives the install command."""

    def __init__(self, task: str, extra: str) -> None:
        """Set the message; `extra` is an extra of superfacets, or the name of the package torch."""
        needs, package = "an extra", f"'superfacets[{extra}]'"
        if extra == "torch":
            needs, package = extra, extra
        super().__init__(f"{task} needs {needs}: pip install {package}")
        self.extra = extra


def import_extra(module: str, task: str, extra: str) -> Any:
    """Return an optional module; if it is missing, raise a MissingExtraError that names `task`."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise MissingExtraError(task, extra) from None


class RenderError(RuntimeError):
    """Pictures cannot be rendered on this machine. The message says what to install."""


class IslandWarning(UserWarning):
    """There are more or fewer regions than requested, or most are components without a seed."""


class BalanceWarning(UserWarning):
    """Regions are not of equal size because of barriers, or disconnected because of their size."""


class MismatchWarning(UserWarning):
    """Labels were transferred, but a part of the target is far from the labeled mesh."""


class RadiusWarning(UserWarning):
    """Regions have few cells, or there is one region: the radius may be in another unit."""


class SliverWarning(UserWarning):
    """Regions may be stripes, because faces are long and thin. The message suggests a remedy."""

    MAX_SHARE = 0.1
    """Fraction of the area in long and thin faces above which `segment` warns. In 31 of 189 cases
    (models of the Princeton benchmark, CAD parts and other meshes with 50 to 500 regions),
    subdivision with a maximum edge of r / 4 lowers the compactness by a factor of 1.2 or more.
    `segment` warns in 26 of them, including all CAD parts, and in 7 of the other 158 cases."""

    @classmethod
    def text(cls, share: float, advice: str) -> str | None:
        """Return the message if `share`, see `MeshInfo`, is above `MAX_SHARE`; otherwise None."""
        if share <= cls.MAX_SHARE:
            return None
        return (
            f"{share:.0%} of the area is in faces that are long and thin compared with the regions,"
            f" so regions may be stripes: {advice}"
        )


class FeatureWarning(UserWarning):
    """A feature has no effect, because it is the same for all cells."""


def reason_of(error: BaseException) -> str:
    """Return the class and the message of an error as one line, for notes and records."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
