"""Loads pictura._training beside the torch that it was built with, or says what is missing."""

_HOW = (
    "with torch 2.9 or later installed, pip install --no-build-isolation -Ccmake.define.PICTURA_WITH_TORCH=ON . from a checkout"
    " (docs/python.md)"
)


def load(name: str):
    """`name` of pictura._training. Raises ImportError naming what is missing, or which torch was expected."""
    try:
        from pictura._built_torch import VERSION
    except ImportError:
        raise ImportError(f"pictura.{name}: this package was built without pictura._training, which needs torch: {_HOW}") from None
    try:
        import torch
    except ImportError as error:
        raise ImportError(f"pictura.{name}: pictura._training was built with torch {VERSION}, and {error}") from error
    if torch.__version__ != VERSION:
        raise ImportError(
            f"pictura.{name}: pictura._training was built with torch {VERSION}, and torch {torch.__version__} is installed: build it"
            f" again: {_HOW}"
        )
    from pictura import _training

    return getattr(_training, name)
