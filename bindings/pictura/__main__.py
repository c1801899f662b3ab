"""The package's `pictura` command: `python -m pictura`."""

import os
import sys

from pictura import _load_training
from pictura._load_training import torch_folder, usable_torch, why_no_torch


def main() -> None:
    """Replaces this process by the `pictura` program for the installed torch, or by the program without torch.

    The program gets the arguments of this process.
    """
    folder = _load_training.folder() / "bin"
    program = folder / "pictura"
    if minor := usable_torch():
        program = folder / f"torch_{minor.replace('.', '_')}" / "pictura"
        libraries = str(torch_folder() / "lib")  # torch may be in another environment than this package
        os.environ["LD_LIBRARY_PATH"] = ":".join(filter(None, [libraries, os.environ.get("LD_LIBRARY_PATH")]))
    elif sys.argv[1:2] == ["train"]:
        sys.exit(f"error: pictura train: {why_no_torch()}")
    if not program.exists():
        sys.exit(f"error: the pictura command: {why_no_torch() if any(folder.glob('torch_*')) else f'expected {program}'}")
    os.environ.setdefault("PICTURA_PYTHON", sys.executable)  # the interpreter that draws charts
    os.execv(program, [str(program), *sys.argv[1:]])


if __name__ == "__main__":
    main()
