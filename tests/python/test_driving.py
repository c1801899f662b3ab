"""Saved policies with and without torch: their implementations, their results, and errors for missing packages."""

import importlib.util
import pathlib
import subprocess
import sys
import textwrap

import numpy as np
import pytest

import pictura
from pictura import _load_training

MODELS = sorted((pathlib.Path(__file__).parents[2] / "models").glob("*.safetensors"))
HAS_DRIVING = importlib.util.find_spec("pictura._driving") is not None
pytestmark = pytest.mark.skipif(
    not HAS_DRIVING and not _load_training.usable_torch(), reason="built beside a torch that is not installed"
)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_released_policies_give_the_logits_of_their_torch_modules(path):
    torch = pytest.importorskip("torch")
    from pictura.torch import load_policy

    session = pictura.PolicySession(str(path), device="cpu", num_threads=2)
    module = load_policy(path)
    world = session.training_world() | {"device": "cpu", "seed": 3}
    simulator = pictura.Simulator([pictura.Map.load("procedural:3")], [(0, 6)] * 2, **world)
    renderer = session.make_renderer()
    if renderer is not None:
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
    others = pictura.Controller("lane", simulator)
    for _ in range(3):
        simulator.run(others, 10)
        observations = dict(simulator.observations)
        seen = {} if renderer is None else {"scene": simulator.scene, "views": simulator.views, "renderer": renderer}
        logits, values = (np.asarray(each) for each in session.evaluate(observations, **seen))
        arrays = {name: torch.from_numpy(np.array(array)) for name, array in observations.items()}
        if renderer is not None:
            arrays["rgb"] = torch.from_numpy(np.array(renderer.render(simulator.scene, simulator.views).rgb))
        with torch.no_grad():
            expected = [each.numpy().reshape(got.shape) for each, got in zip(module(arrays), (logits, values), strict=True)]
        for got, its in zip((logits, values), expected, strict=True):
            # Logits reach 400, of which fp32 has steps of 3e-5.
            assert np.abs(got - its).max() < 1e-4 * max(1, np.abs(its).max())


def test_policies_drive_and_are_evaluated():
    vector = str(next(path for path in MODELS if path.stem == "vector"))
    rows = pictura.evaluate(vector, ["procedural:1"], densities=["light"], scenarios=1, steps=60, device="cpu")["rows"]
    assert rows[0]["km_driven"] > 0.2
    session = pictura.PolicySession(vector, device="cpu")
    simulator = pictura.Simulator([pictura.Map.load("procedural:1")], [(0, 8)], **session.evaluation_world(100))
    simulator.run(session.make_controller(simulator), 60)
    assert simulator.state["distance_m"].numpy().max() > 5


@pytest.mark.skipif(not HAS_DRIVING, reason="built with torch alone")
def test_an_unusable_torch_is_not_loaded():
    vector = str(next(path for path in MODELS if path.stem == "vector"))
    code = f"""
        import sys
        sys.modules["torch"] = None
        import pictura
        from pictura import _load_training
        _load_training.installed_torch = lambda: None
        assert pictura.PolicySession({vector!r}).device == "cpu"
        try:
            pictura.PolicySession({vector!r}, device="cuda")
        except pictura.Error as error:
            assert "computes policies on the CPU" in str(error), error
        assert not any("_training_" in name for name in sys.modules)
        try:
            pictura.train
        except ImportError as error:
            print(error)
    """
    out = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    assert out.stdout.startswith("pictura.train: ") and "pip install" in out.stdout


def test_torch_minor_version_selects_the_build_or_gives_a_remedy(monkeypatch):
    monkeypatch.setattr(_load_training, "built_torches", lambda: ["2.11", "2.15"])
    for installed, usable in (("2.11.0+cu130", "2.11"), ("2.11.2", "2.11"), ("2.15.0+cpu", "2.15"), ("2.1.0", None), ("2.12.1", None), (None, None)):
        monkeypatch.setattr(_load_training, "installed_torch", lambda its=installed: its)
        assert _load_training.usable_torch() == usable, installed
    monkeypatch.setattr(_load_training, "installed_torch", lambda: "2.12.1+cpu")
    with pytest.raises(ImportError, match=r"pictura.train: it was built for torch 2.11 and 2.15, and torch 2.12.1\+cpu is installed: pip install 'torch==2.15.\*'"):
        _load_training.load("train")
    monkeypatch.setattr(_load_training, "installed_torch", lambda: None)
    with pytest.raises(ImportError, match=r"pictura.train: it needs torch 2.11 or 2.15, and none is installed: pip install 'pictura\[train\]'"):
        _load_training.load("train")
    monkeypatch.setattr(_load_training, "built_torches", lambda: [])
    with pytest.raises(ImportError, match="pictura.train: this package was built without torch: .*PICTURA_WITH_TORCH=ON"):
        _load_training.load("train")


def test_the_command_names_missing_packages(monkeypatch, tmp_path):
    from pictura import __main__ as command

    monkeypatch.setattr(_load_training, "folder", lambda: tmp_path)
    monkeypatch.setattr(command, "usable_torch", lambda: None)
    monkeypatch.setattr(sys, "argv", ["pictura", "train", "--config", "a.toml"])
    with pytest.raises(SystemExit, match="error: pictura train: .*pip install"):
        command.main()
    monkeypatch.setattr(sys, "argv", ["pictura", "evaluate"])
    with pytest.raises(SystemExit, match="error: the pictura command: expected .*/bin/pictura"):
        command.main()
    (tmp_path / "bin" / "torch_2_11").mkdir(parents=True)
    with pytest.raises(SystemExit, match="error: the pictura command: .*pip install"):
        command.main()


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'trane'"):
        pictura.trane  # noqa: B018
