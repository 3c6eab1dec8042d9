"""``python -m superfacets`` is the command `superfacets`."""

from .cli.main import main

main()
