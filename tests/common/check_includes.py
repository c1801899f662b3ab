"""Checks who includes whom: data flows map -> simulator -> scene -> backend -> image -> policy, and so do includes.

Usage: check_includes.py REPOSITORY | --self-test. Prints each fault as FILE:LINE: and exits with 1 when there are any.
Rules are about folders: the longest one that a file lies in is the one that counts.
"""

import pathlib
import re
import sys
import tempfile

SIMULATION = {"common", "map", "simulator"}
# Folder -> folders of ours that its files may include, besides itself.
MAY_INCLUDE = {
    "common": set(),
    "map": {"common"},
    "simulator": {"common", "map"},
    "backend_cpu/renderer": {"common"},
    "backend_cpu/simulator": SIMULATION,
    "backend_cuda/renderer": {"common"},
    "backend_cuda/simulator": SIMULATION,
    "backend_gl": {"common"},
    "backends": SIMULATION,
    "training": SIMULATION | {"backends"},
    "drawing": SIMULATION | {"backends"},
    "cli": SIMULATION | {"backends", "training"},
    "bindings": SIMULATION | {"backends", "training"},
    "bench": SIMULATION | {"backends", "backend_cpu/renderer"},
    "bench/commands": SIMULATION | {"backends", "bench", "cli", "drawing", "training"},
    "apps": SIMULATION | {"backends", "bench/commands", "cli", "drawing", "training"},
    "tests": None,  # anything
}
# Libraries that stay in their folders: pattern of the include -> where it may stand.
STAYS_IN = [
    (re.compile(r"^(torch|ATen|c10)/"), re.compile(r"^(training|tests/training)/")),
    (re.compile(r"^(GL|EGL|GLES\d?)/"), re.compile(r"^(backend_gl|tests/backend_gl)/")),
    (re.compile(r"^(cuda|nvrtc|cub/|nccl)"), re.compile(r"^((tests/)?backend_cuda|common/cuda|backend_gl/cuda|bench)/")),
    (re.compile(r"^pybind11/"), re.compile(r"^bindings/")),
    (re.compile(r"^pugixml"), re.compile(r"^(tests/)?map/")),
    (re.compile(r"^cairo"), re.compile(r"^(tests/)?drawing/")),
    (re.compile(r"^CLI/"), re.compile(r"^(apps|cli|bench/commands)/")),
]
INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')
# Who asks which compiler reads a header, and where: what differs by compiler has one folder.
COMPILER_TEST = re.compile(r"__CUDACC__|__CUDA_ARCH__|__CUDACC_RTC__")
COMPILER_TESTS = re.compile(r"^(common/portable|tests|bench)/")
# Headers that the build writes.
WRITTEN = {"version.h", "commit.h", "map_fingerprint.h"}


def folder_of(name: str) -> str | None:
    """The folder whose rule counts for a file, or None where none does."""
    parts = name.split("/")[:-1]
    for length in range(len(parts), 0, -1):
        if "/".join(parts[:length]) in MAY_INCLUDE:
            return "/".join(parts[:length])
    return None


def faults_in(root: pathlib.Path) -> list[str]:
    faults = []
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        if path.suffix not in {".h", ".cpp", ".cu", ".cuh", ".inl"} or name.split("/")[0] in {"build", "carry"}:
            continue
        folder = folder_of(name)
        if folder is None:
            if not name.startswith("."):
                faults.append(f"{name}:1: no rule says what its folder may include")
            continue
        allowed = MAY_INCLUDE[folder]
        for number, line in enumerate(path.read_text().splitlines(), 1):
            where = f"{name}:{number}:"
            if COMPILER_TEST.search(line) and not COMPILER_TESTS.match(name):
                faults.append(f"{where} only common/portable/ asks which compiler reads it")
            match = INCLUDE.match(line)
            if not match:
                continue
            quote, target = match.groups()
            for library, home in STAYS_IN:
                if library.match(target) and not home.match(name):
                    faults.append(f"{where} {target} stays in {home.pattern}")
            if quote == '"':
                if not target.startswith("pictura/"):
                    faults.append(f"{where} expected pictura/FOLDER/FILE.h, got {target}")
                    continue
                target = target.removeprefix("pictura/")
                other = folder_of(target)
                if target in WRITTEN or allowed is None or other == folder or other in allowed:
                    continue
                faults.append(f"{where} {folder}/ may not include {other or target}/")
    return faults


def self_test() -> None:
    cases = {
        "common/a.h": '#include "pictura/map/road_map.h"\n',
        "backend_cpu/renderer/renderer.cpp": '#include "pictura/simulator/simulator.h"\n',
        "backend_cpu/simulator/simulator.cpp": '#include "pictura/simulator/simulator.h"\n',
        "backend_cpu/elsewhere.cpp": "",
        "simulator/b.cpp": "#include <torch/torch.h>\n",
        "simulator/h.cpp": '#include "pictura/backends/make_simulator.h"\n',
        "map/c.cpp": '#include "road_map.h"\n',
        "map/d.cpp": "#ifdef __CUDACC__\n#endif\n",
        "common/portable/hd.h": "#ifdef __CUDACC__\n#endif\n",
        "backend_gl/f.cpp": "#include <GL/glcorearb.h>\n#include <cuda_runtime_api.h>\n",
        "backend_gl/cuda/interop.cpp": "#include <cuda_gl_interop.h>\n",
        "common/g.h": "#include <EGL/egl.h>\n",
        "training/e.cpp": '#include <torch/torch.h>\n#include "pictura/simulator/simulator.h"\n',
        "apps/i.cpp": '#include "pictura/bench/render.h"\n',
        "apps/main.cpp": '#include "pictura/bench/commands/bench.h"\n',
        "bench/j.cpp": '#include "pictura/tests/support/a.h"\n',
        "tests/k.cpp": '#include "pictura/bench/render.h"\n',
    }
    expected = {"common/a.h", "backend_cpu/renderer/renderer.cpp", "backend_cpu/elsewhere.cpp", "simulator/b.cpp",
                "simulator/h.cpp", "map/c.cpp", "map/d.cpp", "backend_gl/f.cpp", "common/g.h", "apps/i.cpp", "bench/j.cpp"}
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in cases.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        found = {fault.split(":")[0] for fault in faults_in(root)}
    assert found == expected, f"expected faults in {sorted(expected)}, found {sorted(found)}"


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test()
    else:
        found = faults_in(pathlib.Path(sys.argv[1]))
        print("\n".join(found) or "includes follow the rules")
        sys.exit(1 if found else 0)
