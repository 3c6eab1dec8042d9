"""Keep the pictures of the documentation small: ``python docs/shrink_images.py``.

PNG pictures of more than 150 KB get a palette of 256 colors. If they are still too large, their
width and height are halved.
Screenshots of pages are WebP files with all colors, because they have smooth shades and small text.
"""

from pathlib import Path

from PIL import Image

IMAGES = Path(__file__).resolve().parent / "images"
MAX_BYTES = 150_000
N_COLORS = 256


def main() -> None:
    for path in sorted(IMAGES.rglob("*.png")):
        if path.stat().st_size > MAX_BYTES:
            save_small(read(path), path)
            if path.stat().st_size > MAX_BYTES:
                picture = read(path)
                save_small(picture.reduce(2), path)
            print(f"{path.relative_to(IMAGES)}: {path.stat().st_size:,} bytes")


def read(path: Path, size: tuple[int, int] | None = None) -> Image.Image:
    """Return a picture, scaled down to a size if one is given."""
    with Image.open(path) as opened:
        picture = opened.convert("RGB")
    return picture if size is None else picture.resize(size, Image.Resampling.LANCZOS)


def save_small(picture: Image.Image, path: Path) -> None:
    """Write a picture with few colors, dithered."""
    palette = picture.quantize(N_COLORS)
    few = picture.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
    few.save(path, optimize=True)


def save_page(picture: Image.Image, path: Path) -> None:
    """Write the picture of a page as WebP: all colors, no dither."""
    picture.save(path.with_suffix(".webp"), quality=90, method=6)


if __name__ == "__main__":
    main()
