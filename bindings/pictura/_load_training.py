"""Chooses the extension that computes policies: the one built with the minor version of the installed torch, or the one
without torch, which uses the CPU. The choice does not import torch, because the import takes a second."""

import functools
import importlib
import importlib.machinery
import importlib.util
import pathlib
import re

import pictura


def folder() -> pathlib.Path:
    """Returns the folder of the extensions and the command for this processor."""
    return pathlib.Path(pictura.__path__[0])


def built_torches() -> list[str]:
    """Returns the minor versions of torch that the package was built with, as '2.11', in ascending order."""
    names = [
        path.name[: -len(suffix)]
        for suffix in importlib.machinery.EXTENSION_SUFFIXES
        for path in folder().glob(f"_training_*{suffix}")
    ]
    found = {match[1] + "." + match[2] for name in names if (match := re.fullmatch(r"_training_(\d+)_(\d+)", name))}
    return sorted(found, key=lambda minor: [int(part) for part in minor.split(".")])


def torch_folder() -> pathlib.Path | None:
    """Returns the folder of the installed torch, or None."""
    spec = importlib.util.find_spec("torch")
    # A plain folder named torch has a spec without an origin.
    return pathlib.Path(spec.origin).parent if spec and spec.origin else None


def installed_torch() -> str | None:
    """Returns the version of the installed torch, as '2.11.0+cu130', or None."""
    its_folder = torch_folder()
    if its_folder is None:
        return None
    (version,) = re.findall(r"^__version__ = '(.*)'$", (its_folder / "version.py").read_text(), re.M)
    return version


def usable_torch() -> str | None:
    """Returns the minor version of the installed torch if the package was built with it, else None."""
    installed = installed_torch()
    minor = ".".join(installed.split(".")[:2]) if installed else None
    return minor if minor in built_torches() else None


def why_no_torch() -> str:
    """Returns the reason why usable_torch() is None, and the remedy."""
    built = built_torches()
    if not built:
        return (
            "this package was built without torch: install a wheel that has it, or build one from a checkout:"
            " pip install torch scikit-build-core pybind11 cmake, then"
            " pip install --no-build-isolation --config-settings=cmake.define.PICTURA_WITH_TORCH=ON ."
        )
    found = installed_torch()
    remedy = f"pip install 'torch=={built[-1]}.*'"
    if found is None:
        return f"it needs torch {' or '.join(built)}, and none is installed: pip install 'pictura[train]', or {remedy}"
    return f"it was built for torch {' and '.join(built)}, and torch {found} is installed: {remedy}"


@functools.cache
def _extension():
    """Returns the extension module. A process loads only one, because all of them register the same types."""
    if minor := usable_torch():
        import torch  # noqa: F401  (the import loads torch's libraries)

        return importlib.import_module(f"pictura._training_{minor.replace('.', '_')}")
    try:
        return importlib.import_module("pictura._driving")
    except ModuleNotFoundError:  # the package has only extensions with torch
        raise ImportError(why_no_torch()) from None


def load(name: str):
    """Returns the object `name` of the extension. Raises ImportError, which names the missing part and the remedy."""
    if name == "train" and usable_torch() is None:
        raise ImportError(f"pictura.{name}: {why_no_torch()}")
    try:
        extension = _extension()
    except ImportError as error:
        raise ImportError(f"pictura.{name}: {error}") from error
    return getattr(extension, name)
