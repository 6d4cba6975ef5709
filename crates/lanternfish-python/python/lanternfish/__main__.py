"""The program `lanternfish`, as `cargo install` makes it but for the window: also `python -m lanternfish`."""

import sys

from . import _driver, _lanternfish


def main() -> None:
    _driver.for_program()
    # Commands that start others, as `doctor` and `papers` do, start them like this.
    sys.exit(_lanternfish.command([sys.executable, "-m", "lanternfish"], sys.argv[1:]))


if __name__ == "__main__":
    main()
