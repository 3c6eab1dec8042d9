"""Run the commands of gallery.md and keep their pictures: ``python docs/make_gallery.py [NAME...]``."""

import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

DOCS = Path(__file__).parent
PICTURES = DOCS / "images" / "gallery"
SIZE = (720, 540)
N_COLORS = 96


def main() -> None:
    """Draw the pictures of the names given, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    wanted = sys.argv[1:]
    with TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, DOCS / "gallery_meshes.py", "gallery"], cwd=folder, check=True
        )
        for name, commands in read_entries((DOCS / "gallery.md").read_text(encoding="utf-8")):
            if not wanted or name in wanted:
                print(name, flush=True)
                for command in commands:
                    run(command, folder)
                shrink(Path(folder, f"{name}.png"), PICTURES / f"{name}.png")


def read_entries(page: str) -> list[tuple[str, list[str]]]:
    """The name of each picture, with the commands under it."""
    pattern = r"\(images/gallery/(\w+)\.png\)\n+```sh\n(.*?)```"
    return [(name, block.splitlines()) for name, block in re.findall(pattern, page, re.DOTALL)]


def run(command: str, folder: str) -> None:
    """Run a command ``superfacets ...`` of the page."""
    _, *arguments = shlex.split(command)
    subprocess.run([sys.executable, "-m", "superfacets", *arguments], cwd=folder, check=True)


def shrink(source: Path, target: Path) -> None:
    """Copy a picture, smaller and with few colors."""
    from PIL import Image

    with Image.open(source) as picture:
        small = picture.convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
    small.quantize(N_COLORS, dither=Image.Dither.NONE).save(target, optimize=True)


if __name__ == "__main__":
    main()
