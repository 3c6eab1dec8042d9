"""Types of options that several commands have."""

from __future__ import annotations

from pathlib import Path

import click

__all__ = [
    "EXISTING_FOLDER",
    "FILE",
    "FOLDER",
    "INPUT_FORMATS",
    "NOT_NEGATIVE",
    "POSITIVE",
    "STANDARD_STREAM",
    "numbers",
]

FILE = click.Path(path_type=Path)
FOLDER = click.Path(path_type=Path, file_okay=False)
EXISTING_FOLDER = click.Path(path_type=Path, file_okay=False, exists=True)
POSITIVE = click.FloatRange(min=0, min_open=True)
NOT_NEGATIVE = click.FloatRange(min=0)

STANDARD_STREAM = "-"
"""Stands for standard input or standard output."""

INPUT_FORMATS = ("ply", "obj", "off", "stl", "glb", "gltf", "tri")


def numbers(
    ctx: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[int, ...] | None:
    """Whole numbers >= 1 of a list with commas, ascending; a callback of options."""
    if text is None:
        return None
    wanted = [number.strip() for number in text.split(",")]
    for number in wanted:
        if not number.isdecimal() or not 1 <= int(number[:12]) < 2**31:
            raise click.BadParameter(f"expected whole numbers >= 1, got {number!r}", ctx, parameter)
    return tuple(sorted({int(number) for number in wanted}))
