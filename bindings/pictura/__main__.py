"""The package's `pictura` command: `python -m pictura`."""

import os
import pathlib
import sys

from pictura._load_training import wrong_torch


def main() -> None:
    """Replaces this process by the command, with the same arguments."""
    if wrong := wrong_torch():
        sys.exit(f"error: the pictura command was {wrong}")
    program = pathlib.Path(__file__).parent / "bin" / "pictura"
    if not program.exists():
        sys.exit(f"error: this package was built without the command: expected {program}")
    os.environ.setdefault("PICTURA_PYTHON", sys.executable)  # draws charts
    os.execv(program, [str(program), *sys.argv[1:]])


if __name__ == "__main__":
    main()
