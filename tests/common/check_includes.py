"""Checks who includes whom: data flows map -> simulator -> scene -> backend -> image -> policy, and so do includes.

Usage: check_includes.py REPOSITORY | --self-test. Prints each fault as FILE:LINE: and exits with 1 when there are any.
"""

import pathlib
import re
import sys
import tempfile

# Folder -> folders of ours that its files may include, besides itself.
MAY_INCLUDE = {
    "common": set(),
    "map": {"common"},
    "simulator": {"common", "map"},
    "backend_cpu": {"common"},
    "backend_cuda": {"common"},
    "backend_gl": {"common"},
    "training": {"common", "map", "simulator"},
    "apps": {"common", "map", "simulator", "training"},
    "bindings": {"common", "map", "simulator", "training"},
    "bench": None,  # anything
    "tests": None,
}
# A backend's simulator executor is a target of its own and may know the simulator.
EXECUTOR = re.compile(r"^backend_(cpu|cuda)/simulator_(cpu|cuda)[^/]*$")
# Benchmarks of the command measure with bench/.
BENCHMARKS = {"apps/bench_quality.cpp", "apps/bench_render.cpp", "apps/bench_simulate.cpp", "apps/bench_soak.cpp", "apps/bench_worlds.cpp"}
# Libraries that stay in their folders: pattern of the include -> where it may stand.
STAYS_IN = [
    (re.compile(r"^(torch|ATen|c10)/"), re.compile(r"^(training|tests/training)/")),
    (re.compile(r"^(GL|EGL|GLES\d?)/"), re.compile(r"^(backend_gl|tests/backend_gl)/")),
    (re.compile(r"^(cuda|nvrtc|cub/|nccl)"), re.compile(r"^((tests/)?backend_cuda|common/cuda|bench)/|^backend_gl/cuda_interop\.cpp$")),
    (re.compile(r"^pybind11/"), re.compile(r"^bindings/")),
    (re.compile(r"^pugixml"), re.compile(r"^(tests/)?map/")),
    (re.compile(r"^cairo"), re.compile(r"^(tests/)?apps/")),
    (re.compile(r"^CLI/"), re.compile(r"^apps/")),
]
INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')
COMPILER_TEST = re.compile(r"__CUDACC__|__CUDA_ARCH__|__CUDACC_RTC__")


def faults_in(root: pathlib.Path) -> list[str]:
    faults = []
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        folder = name.split("/")[0]
        if folder not in MAY_INCLUDE or path.suffix not in {".h", ".cpp", ".cu", ".cuh", ".inl"}:
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            where = f"{name}:{number}:"
            if COMPILER_TEST.search(line) and name != "common/hd.h" and folder not in {"tests", "bench"}:
                faults.append(f"{where} only common/hd.h asks which compiler reads it")
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
                other = target.split("/")[1]
                allowed = MAY_INCLUDE[folder]
                if other in {"version.h", "commit.h", "map_fingerprint.h"} or allowed is None or other == folder or other in allowed:
                    continue
                if EXECUTOR.match(name) and other in {"simulator", "map"}:
                    continue
                if name in BENCHMARKS and other == "bench":
                    continue
                faults.append(f"{where} {folder}/ may not include {other}/")
    return faults


def self_test() -> None:
    cases = {
        "common/a.h": '#include "pictura/map/road_map.h"\n',
        "backend_cpu/renderer_cpu.cpp": '#include "pictura/simulator/simulator.h"\n',
        "backend_cpu/simulator_cpu.cpp": '#include "pictura/simulator/simulator.h"\n',
        "simulator/b.cpp": "#include <torch/torch.h>\n",
        "map/c.cpp": '#include "road_map.h"\n',
        "map/d.cpp": "#ifdef __CUDACC__\n#endif\n",
        "backend_gl/f.cpp": "#include <GL/glcorearb.h>\n#include <cuda_runtime_api.h>\n",
        "backend_gl/cuda_interop.cpp": "#include <cuda_gl_interop.h>\n",
        "common/g.h": "#include <EGL/egl.h>\n",
        "training/e.cpp": '#include <torch/torch.h>\n#include "pictura/simulator/simulator.h"\n',
    }
    expected = {"common/a.h", "backend_cpu/renderer_cpu.cpp", "simulator/b.cpp", "map/c.cpp", "map/d.cpp", "backend_gl/f.cpp", "common/g.h"}
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
