"""The command ``superfacets superpoints``."""

from __future__ import annotations

from pathlib import Path

import click

from .options import EXISTING_FOLDER


@click.command("superpoints")
@click.argument("rooms", type=EXISTING_FOLDER)
def superpoints_command(rooms: Path) -> None:
    """Compare superpoints with those of ScanNet's segmenter.

    ROOMS is a folder of .npz files. Each holds vertices, faces, instances (the true object of each
    vertex) and felzenszwalb (the segments of ScanNet's segmenter). A superpoint takes the object of
    most of its vertices; the table has the share of vertices that are then wrong, and the IoU of
    objects.
    """
    from ..study.superpoints import study

    click.echo(study(rooms.glob("*.npz")))
