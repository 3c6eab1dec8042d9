"""``python -m superfacets`` is the command `superfacets`."""

from .cli import main

main()
