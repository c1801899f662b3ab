"""Loads pictura._training with the torch that it was built with, or reports what is missing."""

import importlib.util
import pathlib
import re

_HOW = (
    "with torch 2.9 or later installed, pip install --no-build-isolation -Ccmake.define.PICTURA_WITH_TORCH=ON . from a checkout"
    " (docs/reference/python.md)"
)


def built_torch() -> str | None:
    """Returns the version of torch that the package was built with, or None."""
    try:
        from pictura._built_torch import VERSION
    except ImportError:
        return None
    return VERSION


def wrong_torch() -> str | None:
    """Returns why a package that was built with torch cannot use the installed torch, or None. Does not import torch,
    which takes a second."""
    built = built_torch()
    if built is None:
        return None
    spec = importlib.util.find_spec("torch")
    if spec is None or spec.origin is None:  # a folder of that name is not torch
        return f"built with torch {built}, and no torch is installed: pip install torch=={built.split('+')[0]}"
    (found,) = re.findall(r"^__version__ = '(.*)'$", (pathlib.Path(spec.origin).parent / "version.py").read_text(), re.M)
    return None if found == built else f"built with torch {built}, and torch {found} is installed: build it again: {_HOW}"


def load(name: str):
    """Returns `name` of pictura._training. Raises ImportError naming what is missing, or the expected torch."""
    if built_torch() is None:
        raise ImportError(f"pictura.{name}: this package was built without pictura._training, which needs torch: {_HOW}")
    if wrong := wrong_torch():
        raise ImportError(f"pictura.{name}: pictura._training was {wrong}")
    import torch  # noqa: F401  (with what its own __init__ loads)

    from pictura import _training

    return getattr(_training, name)
