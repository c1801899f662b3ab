"""Selection of an extension build by processor, and bitwise identical results of both builds."""

import hashlib
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import pictura
from pictura import _processor

V3 = "processor: 0\nflags\t\t: fpu sse sse2 ssse3 sse4_1 sse4_2 popcnt xsave avx f16c fma abm movbe bmi1 avx2 bmi2\n"
OLD = "processor: 0\nflags\t\t: fpu sse sse2 ssse3 sse4_1 sse4_2 popcnt xsave avx f16c\n"


def test_a_processor_without_avx2_runs_the_other_build(tmp_path, monkeypatch):
    monkeypatch.delenv("PICTURA_PROCESSOR", raising=False)
    chosen = lambda cpuinfo, built_for="x86-64-v3": _processor.folder_of_extensions(tmp_path, cpuinfo, built_for)  # noqa: E731
    assert chosen(V3) == tmp_path
    assert chosen(OLD, "x86-64") == tmp_path
    with pytest.raises(ImportError, match="built for x86-64-v3 .*PICTURA_CPU_ARCH=x86-64"):
        chosen(OLD)
    (tmp_path / "x86_64").mkdir()
    assert chosen(OLD) == tmp_path / "x86_64"
    monkeypatch.setenv("PICTURA_PROCESSOR", "x86-64")
    assert chosen(V3) == tmp_path / "x86_64"
    monkeypatch.setenv("PICTURA_PROCESSOR", "x86-64-v3")
    assert chosen(OLD) == tmp_path
    monkeypatch.setenv("PICTURA_PROCESSOR", "sparc")
    with pytest.raises(ImportError, match="expected x86-64 or x86-64-v3, got 'sparc'"):
        chosen(V3)


def hashes() -> list[str]:
    """Hashes of states, observations and images of worlds after 200 steps."""
    found = []
    for name in ("procedural:3", "city:2"):
        town = pictura.Map.load(name)
        simulator = pictura.Simulator([town], [(0, 40)] * 2, seed=5, num_threads=2)
        simulator.run(pictura.Controller("lane", simulator), 200)
        renderer = pictura.Renderer("cpu", pictura.Rig.paper(96, 54))
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
        images = renderer.render(simulator.scene, simulator.views)
        digest = hashlib.sha256(np.ascontiguousarray(images.rgb).tobytes())
        for arrays in (simulator.state, simulator.observations):
            for key in sorted(arrays):
                digest.update(np.ascontiguousarray(arrays[key]).tobytes())
        found += [f"{simulator.state_hash():016x}", digest.hexdigest()]
    return found


def test_both_builds_give_the_same_bits():
    if not (pathlib.Path(pictura.__file__).parent / "x86_64").is_dir():
        pytest.skip("this package has one build")
    code = "import test_processor; print(*test_processor.hashes())"
    found = set()
    for processor in ("x86-64", "x86-64-v3"):
        environment = {**os.environ, "PICTURA_PROCESSOR": processor, "PICTURA_CACHE": "off"}
        out = subprocess.run([sys.executable, "-c", code], cwd=pathlib.Path(__file__).parent, env=environment, capture_output=True, text=True)
        assert out.returncode == 0, out.stderr
        found.add(out.stdout)
    assert len(found) == 1


@pytest.mark.parametrize(
    ("module", "error", "statement", "remedy"),
    [
        ("pictura._pictura", "ImportError('libXrender.so.1: cannot open shared object file')", "", "apt install libxext6 libxrender1"),
        ("gymnasium", "ModuleNotFoundError(name='gymnasium')", "pictura.make_vec()", "pip install 'pictura[gymnasium]'"),
        ("torch", "ModuleNotFoundError(name='torch')", "import pictura.torch", "pip install 'pictura[train]'"),
    ],
)
def test_errors_name_missing_builds_and_their_remedy(module, error, statement, remedy):
    code = f"""
import sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "{module}":
            raise {error}
sys.meta_path.insert(0, Finder())
import importlib.util
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name == "{module}" else find_spec(name, package)
import pictura
{statement}
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert out.returncode == 1 and remedy in out.stderr
