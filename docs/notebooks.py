"""Run the notebooks of the tutorial and of five examples, after sphinx has written them."""

import json
import re
from pathlib import Path
from tempfile import TemporaryDirectory

DOCS = Path(__file__).resolve().parent
EXAMPLES = ("first_segmentation", "cad_part", "point_cloud", "region_graph", "evaluate")
SITE = "https://superfacets.readthedocs.io/en/latest/"


def main() -> None:
    """Run each notebook in an empty folder; the first error ends the run."""
    import nbformat
    from nbclient import NotebookClient

    paths = [DOCS / "gallery" / f"{name}.ipynb" for name in EXAMPLES]
    for path in [DOCS / "notebooks" / "tutorial.ipynb", *paths]:
        with TemporaryDirectory() as folder:
            place = {"metadata": {"path": folder}}
            notebook = nbformat.read(path, 4)
            arguments = ["--log-level=ERROR"]  # hides warnings about local sockets
            client = NotebookClient(notebook, resources=place, timeout=120)
            client.extra_arguments = arguments
            client.execute()
        print(path.name, "runs as a notebook")


def write_notebook(page: Path) -> None:
    """Write the text and the Python of a page, without outputs, to ``notebooks/NAME.ipynb``."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"^(!\[.*|```text\n.*?^```)$", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"\]\(([\w/-]+)\.(md|rst)", rf"]({SITE}\1.html", text)
    pieces = re.split(r"^```python\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    cells = [cell(piece.strip(), i % 2 == 1) for i, piece in enumerate(pieces) if piece.strip()]
    notebook = {"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 4}
    path = DOCS / "notebooks" / f"{page.stem}.ipynb"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(notebook, indent=1), encoding="utf-8")


def cell(source: str, is_code: bool) -> dict[str, object]:
    """Return a cell of a notebook."""
    outputs = {"outputs": [], "execution_count": None} if is_code else {}
    kind = "code" if is_code else "markdown"
    return {"cell_type": kind, "metadata": {}, "source": source, **outputs}


if __name__ == "__main__":
    main()
