"""``python -m benchmarks``."""

from .cli import commands

commands(prog_name="python -m benchmarks")
