"""Types of options that several commands have."""

from __future__ import annotations

from pathlib import Path

import click

__all__ = ["FILE", "INPUT_FORMATS", "NOT_NEGATIVE", "POSITIVE", "STANDARD_STREAM"]

FILE = click.Path(path_type=Path)
POSITIVE = click.FloatRange(min=0, min_open=True)
NOT_NEGATIVE = click.FloatRange(min=0)

STANDARD_STREAM = "-"
"""In the place of a file: standard input or standard output."""

INPUT_FORMATS = ("ply", "obj", "off", "stl", "glb", "gltf", "tri")
