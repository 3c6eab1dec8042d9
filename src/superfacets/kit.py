"""Names for apps and formats that build on this package, beside the public names.

`kit.pyi` lists them by purpose. Each name is imported on first use. Names change only with an entry
in the changelog.
"""

from pathlib import Path
from typing import Any

from .base.lazy import homes_in, import_from

_HOMES = homes_in(Path(__file__).with_suffix(".pyi"))
__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    """Import the object `name` on first use, and store it in this module."""
    value = globals()[name] = import_from(_HOMES, name, "superfacets.kit", "superfacets")
    return value


def __dir__() -> list[str]:
    return __all__
