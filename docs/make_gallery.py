"""Run the commands of gallery.md and the Python of tutorial.md, and keep their pictures.

``python docs/make_gallery.py`` draws all; ``python docs/make_gallery.py ant room`` these two.
"""

import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from shrink_images import IMAGES, read, save_small

DOCS = Path(__file__).resolve().parent
PICTURES = IMAGES / "gallery"
SIZE = (720, 540)


def main() -> None:
    """Draw the pictures of the names given, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    wanted = sys.argv[1:]
    with TemporaryDirectory() as folder:
        run([DOCS / "gallery_meshes.py", "gallery"], folder)
        for name, commands in read_entries((DOCS / "gallery.md").read_text(encoding="utf-8")):
            if not wanted or name in wanted:
                print(name, flush=True)
                for command in commands:
                    run(["-m", *shlex.split(command)], folder)
                save_small(read(Path(folder, f"{name}.png"), SIZE), PICTURES / f"{name}.png")
        if not wanted or "tutorial" in wanted:
            run(["-c", read_python((DOCS / "tutorial.md").read_text(encoding="utf-8"))], folder)
            save_small(read(Path(folder, "part.png"), SIZE), IMAGES / "tutorial-part.png")


def read_entries(page: str) -> list[tuple[str, list[str]]]:
    """The name of each picture, with the commands under it."""
    pattern = r"\(images/gallery/(\w+)\.png\)\n+```sh\n(.*?)```"
    return [(name, block.splitlines()) for name, block in re.findall(pattern, page, re.DOTALL)]


def read_python(page: str) -> str:
    """All Python of a page."""
    return "\n".join(re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE))


def run(arguments: list[str | Path], folder: str) -> None:
    """Run Python in the folder."""
    subprocess.run([sys.executable, *arguments], cwd=folder, check=True)


if __name__ == "__main__":
    main()
