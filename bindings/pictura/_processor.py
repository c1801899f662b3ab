"""Chooses the build of the extensions for this processor. Those of the package are for x86-64-v3 unless it was built
for another processor. A wheel may hold extensions for any x86-64 processor in the folder x86_64 (scripts/wheels). Both give
the same bits of simulators and images."""

import os
import pathlib

from pictura._built import PROCESSOR

# Flags of x86-64-v3 in /proc/cpuinfo, beyond those of every x86-64 processor.
_V3_FLAGS = {"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "xsave"}


def is_v3(cpuinfo: str) -> bool:
    """Returns whether the processor of a text in the form of /proc/cpuinfo has x86-64-v3."""
    flags = next((line.partition(":")[2].split() for line in cpuinfo.splitlines() if line.startswith("flags")), [])
    return set(flags) >= _V3_FLAGS


def folder_of_extensions(package: pathlib.Path, cpuinfo: str, built_for: str = PROCESSOR) -> pathlib.Path:
    """Returns the folder of the extensions and the command for this processor.

    PICTURA_PROCESSOR chooses x86-64-v3 or x86-64. Raises ImportError if the package has no extensions for the processor.
    """
    wanted = os.environ.get("PICTURA_PROCESSOR", "")
    if wanted not in ("", "x86-64", "x86-64-v3"):
        raise ImportError(f"PICTURA_PROCESSOR: expected x86-64 or x86-64-v3, got '{wanted}'")
    if built_for != "x86-64-v3" or wanted == "x86-64-v3" or (not wanted and is_v3(cpuinfo)):
        return package
    if not (package / "x86_64").is_dir():
        raise ImportError(
            "pictura: this package was built for x86-64-v3 (AVX2 and FMA) alone: install a wheel that has both builds, or build one"
            " for this processor: pip install --config-settings=cmake.define.PICTURA_CPU_ARCH=x86-64 . from a checkout"
        )
    return package / "x86_64"
