"""Type stubs match the extension."""

import pathlib
import subprocess
import sys

import pytest

import pictura
from pictura._load_training import usable_torch

STUBS = pathlib.Path(__file__).parents[2] / "bindings" / "pictura"


@pytest.mark.parametrize("name", ["_pictura", "_training"])
def test_stubs_are_current(tmp_path, name):
    pytest.importorskip("pybind11_stubgen")
    module = name
    if name == "_training":
        minor = usable_torch()
        if minor is None:
            pytest.skip("built without the torch that is installed")
        module = f"_training_{minor.replace('.', '_')}"
    out = subprocess.run(
        [sys.executable, "-m", "pybind11_stubgen", f"pictura.{module}", "-o", str(tmp_path), "--numpy-array-use-type-var"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert out.returncode == 0, out.stderr
    made = (tmp_path / "pictura" / f"{module}.pyi").read_text()
    assert (STUBS / f"{name}.pyi").read_text() == made, "run scripts/python_stubs"


def test_every_public_name_has_a_docstring():
    for name in dir(pictura._pictura):
        value = getattr(pictura._pictura, name)
        if not isinstance(value, type) or name.startswith("_"):
            continue
        assert value.__doc__, name
        for member, its in vars(value).items():
            if not member.startswith("_") and callable(its):
                assert (its.__doc__ or "").count("\n") >= 1, f"{name}.{member}"


def test_the_package_is_typed():
    assert (pathlib.Path(pictura.__file__).parent / "py.typed").exists()
