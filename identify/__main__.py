"""`python -m identify` is the command `identify`."""

from identify.cli import main

if __name__ == "__main__":
    main()
