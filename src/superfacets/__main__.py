"""Entry point of the `superfacets` command and of ``python -m superfacets``."""

import sys
from collections.abc import Callable
from typing import NoReturn

from .base.lazy import load


def main() -> NoReturn:
    """Run the `superfacets` command, and exit with its exit code."""
    try:
        load("superfacets_cli.interrupts:end_at_signals")()
        run: Callable[[], NoReturn] = load("superfacets_cli.main:main")
    except ImportError as error:
        sys.exit(f"superfacets: error: {error}")
    run()


if __name__ == "__main__":
    main()
