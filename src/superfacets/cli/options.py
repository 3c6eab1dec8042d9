"""Types of options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

__all__ = [
    "EXISTING_FOLDER",
    "FILE",
    "FOLDER",
    "INPUT_FORMATS",
    "NOT_NEGATIVE",
    "NUMBERS",
    "POSITIVE",
    "STANDARD_STREAM",
]

FILE = click.Path(path_type=Path)
FOLDER = click.Path(path_type=Path, file_okay=False)
EXISTING_FOLDER = click.Path(path_type=Path, file_okay=False, exists=True)
POSITIVE = click.FloatRange(min=0, min_open=True)
NOT_NEGATIVE = click.FloatRange(min=0)

STANDARD_STREAM = "-"
"""In the place of a file: standard input or standard output."""

INPUT_FORMATS = ("ply", "obj", "off", "stl", "glb", "gltf", "tri")


class _Numbers(click.ParamType):
    """Whole numbers >= 1 of a list with commas, ascending."""

    name = "list"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, ...]:
        if not isinstance(value, str):
            return tuple(value)
        wanted = [number.strip() for number in value.split(",")]
        for number in wanted:
            if not number.isdecimal() or not 1 <= int(number[:12]) < 2**31:
                self.fail(f"expected whole numbers >= 1, got {number!r}", param, ctx)
        return tuple(sorted({int(number) for number in wanted}))


NUMBERS = _Numbers()
