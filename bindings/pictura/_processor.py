"""Chooses the build of the extensions for this processor.

By default the package's extensions need x86-64-v3. A wheel may also hold extensions for all x86-64 processors, in the
folder x86_64 (scripts/wheels). Simulations and images of both builds are equal bit for bit.
"""

import os
import pathlib

from pictura._built import PROCESSOR

# Flags in /proc/cpuinfo that x86-64-v3 adds to plain x86-64.
_V3_FLAGS = {"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "xsave"}


def is_v3(cpuinfo: str) -> bool:
    """Returns whether the processor that `cpuinfo` describes, in the format of /proc/cpuinfo, supports x86-64-v3."""
    flags = next((line.partition(":")[2].split() for line in cpuinfo.splitlines() if line.startswith("flags")), [])
    return set(flags) >= _V3_FLAGS


def folder_of_extensions(package: pathlib.Path, cpuinfo: str, built_for: str = PROCESSOR) -> pathlib.Path:
    """Returns the folder of the extensions and the command for this processor.

    The environment variable PICTURA_PROCESSOR, x86-64-v3 or x86-64, overrides the choice. Raises ImportError if the
    package has no extensions for the processor.
    """
    wanted = os.environ.get("PICTURA_PROCESSOR", "")
    if wanted not in ("", "x86-64", "x86-64-v3"):
        raise ImportError(f"PICTURA_PROCESSOR: expected x86-64 or x86-64-v3, got '{wanted}'")
    if built_for != "x86-64-v3" or wanted == "x86-64-v3" or (not wanted and is_v3(cpuinfo)):
        return package
    if not (package / "x86_64").is_dir():
        raise ImportError(
            "pictura: this package was built for x86-64-v3 (AVX2 and FMA) only: install a wheel that has both builds, or build one"
            " for this processor: pip install --config-settings=cmake.define.PICTURA_CPU_ARCH=x86-64 . from a checkout"
        )
    return package / "x86_64"
