"""Load objects of other packages, named ``package.module:name``, when they are needed."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any

from .errors import MissingExtraError


def load(target: str) -> Any:
    """Return the object ``package.module:name``; raise an ImportError if the package is broken."""
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

    Apps use it for objects that other packages add. Indexing raises the same errors as `load`.
    """

    def __getitem__(self, key: str) -> Any:
        found = super().__getitem__(key)
        return load(found) if isinstance(found, str) else found

    @classmethod
    @cache
    def added(cls, group: str) -> Table:
        """Return objects that packages in folders of `sys.path` add by entry points of a group."""
        files = (at for place in sys.path for at in Path(place).glob("*-info/entry_points.txt"))
        texts = (at.read_bytes() for at in files if at.is_file() and os.access(at, os.R_OK))
        if not any(group.encode() in text for text in texts):
            return cls()
        from importlib.metadata import entry_points  # slow to import

        return cls({point.name: point.value for point in entry_points(group=group)})


def lazy_names(
    module: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` for a module that imports names on first use.

    Packages of apps call it in `__init__.py`, so that importing them stays cheap. The names, which
    are objects or modules, are listed in the stub beside `file`, in lines such as
    ``from .module import name as name``. `module` is the name of the calling module.
    """
    stub = Path(file).with_suffix(".pyi")
    lines = re.findall(r"^from (\S+) import (\w+)", stub.read_text(encoding="utf-8"), re.MULTILINE)
    homes = {name: home for home, name in lines}
    package = module if stub.stem == "__init__" else module.rpartition(".")[0]

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        home = import_module(homes[name], package)
        is_object = home.__name__ != module and hasattr(home, name)
        value = getattr(home, name) if is_object else import_module(f"{home.__name__}.{name}")
        setattr(sys.modules[module], name, value)  # so that later uses do not call this function
        return value

    return get, lambda: list(homes), list(homes)
