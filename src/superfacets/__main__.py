"""Entry point of the `superfacets` command and of ``python -m superfacets``."""

from typing import NoReturn

from superfacets_cli.interrupts import while_importing


def main() -> NoReturn:
    """Run the `superfacets` command, and exit with its exit code."""
    with while_importing():
        from superfacets_cli.main import main as run
    run()


if __name__ == "__main__":
    main()
