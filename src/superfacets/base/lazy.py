"""Load what other packages provide, named by strings ``package.module:name``, when it is needed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any

from .errors import MissingExtraError


def load(target: str) -> Any:
    """Return the object that ``package.module:name`` refers to.

    Raises an ImportError with a message of one line if the package is missing or broken.
    """
    module, _, name = target.partition(":")
    try:
        return attrgetter(name)(import_module(module))
    except MissingExtraError:
        raise
    except Exception as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise ImportError(f"{target} cannot be loaded: {why}") from error


class Table(dict[str, Any]):
    """Dict whose values may be strings ``package.module:name``; indexing loads the object.

    Apps use it for objects that other packages add, such as commands. Indexing raises an
    ImportError with a message of one line if the package is missing or broken.
    """

    def __getitem__(self, key: str) -> Any:
        found = super().__getitem__(key)
        return load(found) if isinstance(found, str) else found

    @classmethod
    @cache
    def added(cls, group: str) -> Table:
        """Return the objects that installed packages add by entry points of a group."""
        from importlib.metadata import entry_points  # slow to import

        return cls({point.name: point.value for point in entry_points(group=group)})


def homes_in(stub: Path) -> dict[str, str]:
    """Return the module that each name in a stub comes from, as the stub writes it."""
    found = re.findall(r"^from (\S+) import (\w+)", stub.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: home for home, name in found}


def import_from(homes: Mapping[str, str], name: str, module: str, package: str) -> Any:
    """Import an object, or a module, that `module` lists in `homes`.

    Relative modules are relative to `package`. Raises an AttributeError for other names.
    """
    if name not in homes:
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    home = import_module(homes[name], package)
    if home.__name__ != module and hasattr(home, name):
        return getattr(home, name)
    return import_module(f"{home.__name__}.{name}")
