"""Import names of higher layers when they are needed."""

import importlib
from typing import Any


def load(place: str) -> Any:
    """Import and return the object at `place`, written as ``"package.module:name"``."""
    module, name = place.split(":")
    return getattr(importlib.import_module(module), name)
