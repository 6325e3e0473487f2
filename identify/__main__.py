"""The command `identify`, also as `python -m identify`."""

from __future__ import annotations

import sys

from identify.core.version import VERSION


def main() -> None:
    """Entry point.  The version is told without loading what parses a command line."""
    if sys.argv[1:] == ["--version"]:
        print(f"identify {VERSION}")
        return
    from identify import cli

    cli.main()


if __name__ == "__main__":
    main()
