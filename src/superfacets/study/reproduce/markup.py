"""Pieces of a page that needs nothing but itself: text, tables, and images inside the file."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

__all__ = [
    "bullets", "details", "document", "image", "paragraph", "picture_cards", "picture_grid",
    "table",
]  # fmt: skip

_TYPES = {".png": "image/png", ".svg": "image/svg+xml"}

_STYLE = """
:root { --ink: #1d2430; --soft: #5d6675; --line: #dfe3e9; --tint: #f5f7fa; --accent: #1f5fa8; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: white;
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
header, main { max-width: 1240px; margin: 0 auto; padding: 0 28px; }
header { padding-top: 44px; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 .4em; letter-spacing: -.01em; }
h2 { font-size: 1.35rem; margin: 2.6em 0 .5em; padding-top: .7em;
  border-top: 1px solid var(--line); }
p { max-width: 78ch; margin: .6em 0; }
.lead { font-size: 1.12rem; color: var(--soft); }
nav { position: sticky; top: 0; z-index: 1; background: white;
  border-bottom: 1px solid var(--line); }
nav div { max-width: 1240px; margin: 0 auto; padding: 9px 28px; display: flex; flex-wrap: wrap;
  gap: 4px 18px; font-size: .9rem; }
nav a { color: var(--accent); text-decoration: none; }
nav a:hover { text-decoration: underline; }
section { scroll-margin-top: 50px; }
.caption, small { color: var(--soft); font-size: .9rem; }
.scroll { overflow-x: auto; margin: 1em 0; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { padding: 5px 9px; text-align: right; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
th { font-weight: 600; color: var(--soft); vertical-align: bottom; white-space: normal; }
thead th { border-bottom: 2px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
tbody tr:hover { background: var(--tint); }
tr.ours { background: #eaf2fb; }
img.plot { display: block; width: 100%; height: auto; margin: .6em 0; }
.grid { display: grid; gap: 6px; margin: 1em 0; align-items: center; }
.grid img { width: 100%; display: block; }
.grid b { font-weight: 600; font-size: .85rem; color: var(--soft); text-align: center;
  display: block; }
.grid b.row { text-align: left; }
.grid i { color: #9aa3b0; font-size: .85rem; text-align: center; }
details { margin: .8em 0; border: 1px solid var(--line); border-radius: 6px; padding: 0 14px; }
summary { cursor: pointer; padding: 9px 0; font-weight: 600; font-size: .95rem; }
li { margin: .15em 0; font-size: .92rem; overflow-wrap: anywhere; }
code { font-size: .9em; background: var(--tint); padding: .1em .3em; border-radius: 3px; }
footer { height: 60px; }
@media print { nav { display: none; } section { break-inside: avoid; } }
"""


def document(title: str, lead: str, sections: Sequence[tuple[str, str]]) -> str:
    """Return a page with a heading, and sections given by title and HTML."""
    links = "".join(
        f'<a href="#s{number}">{escape(name)}</a>' for number, (name, _) in enumerate(sections)
    )
    bodies = "\n".join(
        f'<section id="s{number}"><h2>{escape(name)}</h2>\n{body}</section>'
        for number, (name, body) in enumerate(sections)
    )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n<body>"
        f'<header><h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p></header>\n'
        f"<nav><div>{links}</div></nav>\n<main>\n{bodies}\n</main><footer></footer></body></html>\n"
    )


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph, of a class such as "caption"."""
    return f'<p class="{kind}">{escape(text)}</p>\n' if kind else f"<p>{escape(text)}</p>\n"


def bullets(lines: Iterable[str]) -> str:
    """Return a list of lines."""
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>\n"


def details(title: str, body: str) -> str:
    """Return HTML that is shown when its title is clicked."""
    return f"<details><summary>{escape(title)}</summary>\n{body}</details>\n"


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], marked: frozenset[str] = frozenset()
) -> str:
    """Return a table; rows whose first cell is among the marked ones stand out."""
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(
        ('<tr class="ours">' if row[0] in marked else "<tr>")
        + "".join(f"<td>{escape(cell)}</td>" for cell in row)
        + "</tr>\n"
        for row in rows
    )
    return (
        f'<div class="scroll"><table><thead><tr>{top}</tr></thead>\n<tbody>{body}</tbody></table>'
        "</div>\n"
    )


def image(path: Path, text: str, kind: str = "") -> str:
    """Return an image with its file inside."""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    of_kind = f' class="{kind}"' if kind else ""
    source = f"data:{_TYPES[path.suffix]};base64,{data}"
    return f'<img{of_kind} alt="{escape(text)}" src="{source}">'


def picture_grid(
    rows: Sequence[str], columns: Sequence[str], cells: dict[tuple[str, str], str]
) -> str:
    """Return images under the names of their columns, beside those of their rows."""
    parts = ["<b></b>", *(f"<b>{escape(column)}</b>" for column in columns)]
    for row in rows:
        parts.append(f'<b class="row">{escape(row)}</b>')
        parts += [cells.get((row, column), "<i>not run</i>") for column in columns]
    return _grid(f"8.5em repeat({len(columns)}, minmax(0, 320px))", parts)


def picture_cards(cells: dict[str, str]) -> str:
    """Return images with their names below, several in a row."""
    cards = [f"<div>{image}<b>{escape(name)}</b></div>" for name, image in cells.items()]
    return _grid("repeat(auto-fill, minmax(300px, 1fr))", cards)


def _grid(columns: str, parts: list[str]) -> str:
    inside = "\n".join(parts)
    return f'<div class="grid" style="grid-template-columns: {columns}">\n{inside}</div>\n'
