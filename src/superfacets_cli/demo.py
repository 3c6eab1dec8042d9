"""The command ``superfacets demo``."""

from __future__ import annotations

from pathlib import Path

import click

from superfacets import segment, write_mesh
from superfacets.kit import output_folder

from .options import FOLDER, option
from .progress import RunBar
from .report import summary_of


@click.command("demo")
@option("-o --output DIR", FOLDER, "Folder for the results.", default=Path("superfacets-demo"))
def demo_command(output: Path) -> None:
    """Segment the sample mesh of the package.

    The labeled mesh and a picture of the mesh are written to DIR.
    """
    from superfacets import plot, sample_mesh
    from superfacets_show import check_rendering

    check_rendering()
    click.get_current_context().with_resource(output_folder(output))
    labeled, picture = output / "bear.superfacets.ply", output / "bear.superfacets.png"
    timings: dict[str, float] = {}
    with RunBar("bear") as bar:
        with bar.timed("mesh", timings):
            surface = sample_mesh()
        result = segment(surface, callback=bar.on_report)
        with bar.timed("export", timings):
            write_mesh(labeled, surface, result.labels)
    click.echo(f"wrote {labeled}\nbear: {summary_of(result, {**result.timings, **timings})}")
    plot(surface, result.labels, output=picture)
    click.echo(f"wrote {picture}")
