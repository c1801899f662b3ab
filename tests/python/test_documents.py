"""Pages about Python: their code runs, the environment card is up to date, and docstring examples are correct."""

import doctest
import importlib
import importlib.util
import inspect
import pathlib
import pydoc
import re
import subprocess
import sys

import numpy as np
import pytest

import pictura

ROOT = pathlib.Path(__file__).parents[2]
DOCS = ROOT / "docs"
HAS_TRAINING = all(importlib.util.find_spec(name) is not None for name in ("torch", "pictura._built_torch"))
PACKAGES = {"envs.pettingzoo_env": "pettingzoo", "envs.torchrl_env": "torchrl", "envs.gymnasium": "gymnasium", "make_vec": "gymnasium",
            "torch.": "torch", "rerun.": "rerun"}  # fmt: skip
# Members of the extension that is built with torch.
OF_TRAINING = ("PolicySession", "evaluate", "evaluate_robust", "evaluate_scenes", "probe_corner", "probe_pedestrian", "probe_removal", "train", "make_vec_for")


def blocks_of(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(), re.S | re.M)


def run(blocks: list[str], page: str, names: dict[str, object] | None = None) -> dict[str, object]:
    names = {} if names is None else names
    for block in blocks:
        exec(compile(block, page, "exec"), names)  # noqa: S102
    return names


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """Empty folder with the files of a checkout that the pages name."""
    for name in ("models", "configs", "bench"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_tutorial_runs(checkout):
    pytest.importorskip("gymnasium")
    blocks = blocks_of("tutorials/python.md")
    assert len(blocks) == 5
    names = run(blocks, "docs/tutorials/python.md")
    assert names["envs"].num_envs == 16 and (checkout / "drive.html").exists()
    assert len((DOCS / "tutorials/python.md").read_text().split()) < 1500


def test_the_observation_query_example_runs(make):
    names = run(blocks_of("reference/python/simulator.md"), "simulator.md", {"np": np, "pictura": pictura, "simulator": make(8)})
    assert names["answers"]["partners"].shape == (3, 16, 8)


@pytest.mark.skipif(not HAS_TRAINING, reason="needs a package that was built beside torch")
def test_a_released_policy_is_loaded_driven_and_exported(checkout):
    for package in ("onnxscript", "onnxruntime"):
        pytest.importorskip(package)
    names = run(blocks_of("how-to/load_policy.md"), "load_policy.md")
    expected = names["policy"]({name: array.torch() for name, array in names["simulator"].observations.items()})[0]
    assert np.abs(names["logits"] - expected.detach().numpy()).max() < 1e-3
    assert (checkout / "drive.html").exists() and (checkout / "mine.safetensors").exists()


@pytest.mark.skipif(not HAS_TRAINING, reason="needs a package that was built beside torch")
def test_the_custom_network_example_learns_from_images(checkout):
    pytest.importorskip("gymnasium")
    names = run(blocks_of("how-to/own_network.md"), "own_network.md")
    assert names["report"]["agent_steps"] > 200 and (checkout / "network.pt").exists()


@pytest.mark.skipif(not HAS_TRAINING, reason="needs a package that was built beside torch")
@pytest.mark.parametrize("tracker, package", [("Weights & Biases", "wandb"), ("MLflow", "mlflow")])
def test_runs_are_tracked_offline(tracker, package, checkout):
    pytest.importorskip(package)
    section = (DOCS / "how-to/track_experiments.md").read_text().split(f"## {tracker}")[1].split("\n## ")[0]
    run(re.findall(r"^```python\n(.*?)^```", section, re.S | re.M), "track_experiments.md")
    if package == "wandb":
        assert len(list(checkout.glob("wandb/offline-run-*/*.wandb"))) == 2
    else:
        import mlflow

        runs = mlflow.search_runs(experiment_names=["pictura"])
        assert len(runs) == 2 and (runs["metrics.charts/agent_steps"] > 100).all()


@pytest.mark.skipif(not HAS_TRAINING, reason="needs a package that was built beside torch")
def test_tensorboard_reads_the_configuration(checkout):
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
    from tensorboard.plugins.hparams.metadata import SESSION_START_INFO_TAG, parse_session_start_info_plugin_data

    pictura.train("configs/smoke.toml", "run", overrides=["train.gamma=0.5"])
    events = EventAccumulator("run").Reload()
    told = parse_session_start_info_plugin_data(events.SummaryMetadata(SESSION_START_INFO_TAG).plugin_data.content).hparams
    assert told["train.gamma"].number_value == 0.5 and told["simulator.walls"].bool_value is False
    assert told["policy.modality"].string_value == "perspective" and "simulator.maps" not in told
    (text,) = events.Tensors("configuration/text_summary")
    assert "    gamma = 0.5\n" in text.tensor_proto.string_val[0].decode()
    assert len(events.Scalars("charts/episode_return")) == 4


@pytest.mark.parametrize("page", ["docker", "load_policy", "own_network", "own_reward", "track_experiments"])
def test_how_to_pages_are_short(page):
    assert len((DOCS / f"how-to/{page}.md").read_text().split()) < 900


def test_the_custom_metric_example_counts(checkout):
    names: dict[str, object] = {}
    needs = (None, None, None, None, "mcap")
    for block, module in zip(blocks_of("how-to/own_metric.md"), needs, strict=True):
        if module is None or importlib.util.find_spec(module) is not None:
            run([block], "docs/how-to/own_metric.md", names)
    assert names["hard_steps"].sum() > 0 and names["distance_m"].sum() > 1000
    assert (checkout / "drive.html").exists()
    assert names["report"]["cases"] > 100 and names["report"]["rows"][0]["abs_d_p_brake"] > 0


def test_the_custom_reward_example_trains(capsys):
    pytest.importorskip("gymnasium")
    names = run(blocks_of("how-to/own_reward.md"), "docs/how-to/own_reward.md")
    straight, weaving = (float(line.split()[1]) for line in capsys.readouterr().out.splitlines()[-2:])
    assert straight > weaving
    lanes = names["infos"]["reward_terms"][:, [5, 6]].sum(1)
    np.testing.assert_allclose(names["without_lanes"], names["rewards"] - lanes, atol=1e-6)
    assert np.abs(lanes).max() > 0 and names["weights"].shape == (64, 17)


def test_the_benchmarks_function_drives(monkeypatch):
    evaluate = pictura.evaluate

    def shorter(checkpoint, **options):
        rows = evaluate(checkpoint, ["procedural:1"], steps=5, agents_per_world=4, device="cpu", **options)["rows"]
        return {"rows": [{"part": "towns", "name": "grid towns", "not_driven": None, **row} for row in rows]}

    monkeypatch.setattr(pictura, "evaluate_robust", shorter)
    names = run(blocks_of("how-to/robust_benchmark.md"), "docs/how-to/robust_benchmark.md")
    assert names["report"]["rows"][0]["vehicle_episodes"] > 0


def test_the_environment_card_is_up_to_date():
    pytest.importorskip("gymnasium")
    out = subprocess.run([sys.executable, ROOT / "scripts/environment_card", "--check"], capture_output=True, text=True, timeout=120)
    assert (out.returncode, out.stdout, out.stderr) == (0, "", ""), "run scripts/environment_card"


def test_model_cards_are_up_to_date():
    out = subprocess.run([sys.executable, ROOT / "scripts/model_cards", "--check"], capture_output=True, text=True, timeout=120)
    assert (out.returncode, out.stdout, out.stderr) == (0, "", ""), "run scripts/model_cards"


def test_the_card_has_every_number_of_actions_and_arguments():
    text = (DOCS / "reference/environment.md").read_text()
    signature = pictura.Simulator.__init__.__doc__.split("->")[0]
    for name in re.findall(r"(\w+): ", signature)[3:]:
        assert f"\n| `{name}` | `" in text, name
    assert len(re.findall(r"^\| \d+( \(idle\))? \| \(\d, \d\) \|", text, re.M)) == pictura.NUM_ACTIONS


def test_actions_apply_the_jerks_of_the_card(town):
    from pictura.envs import batch

    fixed = {name: 1.0 for name in ("throttle", "steer", "acceleration")}
    simulator = pictura.Simulator([town], [(0, 12)], num_threads=1, pedestrian_fraction=0, cyclist_fraction=0, conditioning=fixed)
    slots = np.flatnonzero(simulator.state["status"].numpy() == 0).astype(np.int32)
    none = np.zeros(len(slots), np.float32)
    simulator.set_state(slots, {"accel_long_mps2": none, "accel_lat_mps2": none, "speed_mps": none + 8})
    simulator.step(np.arange(12, dtype=np.int32))
    longitudinal, lateral = (simulator.state[f"accel_{name}_mps2"].numpy() / simulator.dt_s for name in ("long", "lat"))
    assert len(slots) > 6
    for slot in slots:
        i, k = divmod(int(slot), batch.NUM_LATERAL)
        assert longitudinal[slot] == pytest.approx(batch.LONGITUDINAL_JERKS_MPS3[i], abs=1e-3)
        assert lateral[slot] == pytest.approx(batch.LATERAL_JERKS_MPS3[k], abs=1e-3)


# Names on the pages of the reference.
PUBLIC = [
    name for page in sorted((DOCS / "reference/python").glob("*.md")) for name in re.findall(r"^::: (pictura\S+)", page.read_text(), re.M)
]


def test_the_reference_has_every_public_name():
    named = set(PUBLIC)
    for file in ("_pictura.pyi", "_training.pyi", "torch.py", "plot.py", "datasets.py", "presets.py", "rerun.py"):
        module, source = "" if file[0] == "_" else file.removesuffix(".py"), ROOT / "bindings/pictura" / file
        for name in re.findall(r"^(?:class|def) ([a-zA-Z]\w+)", source.read_text(), re.M):
            whole = ".".join(filter(None, ["pictura", module, name]))
            internal = {"pictura.torch.point_features", "pictura.torch.segment_features", "pictura.plot.main"}
            assert whole in named or whole in internal, f"{whole}: expected ':::' on a page of docs/reference/python"


@pytest.mark.parametrize("name", PUBLIC)
def test_docstring_examples_are_correct(name, checkout, monkeypatch):
    short = name.removeprefix("pictura.")
    for part, package in PACKAGES.items():
        if short.startswith(part):
            pytest.importorskip(package)
    if short in OF_TRAINING and not HAS_TRAINING:
        pytest.skip("needs a package that was built beside torch")
    module, _, attribute = name.rpartition(".")
    found = getattr(importlib.import_module(module), attribute)
    text = inspect.getdoc(found)
    if inspect.isclass(found) and (issubclass(found, Exception) or module == "pictura.plot"):
        assert text
        return
    examples = doctest.DocTestParser().get_doctest(text, {"np": np, "pathlib": pathlib, "pictura": pictura}, name, None, 0)
    assert examples.examples, f"{name}: expected an example"
    if "drive.scenario" in text:
        simulator = pictura.Simulator([pictura.Map.load("procedural:3")], [(0, 8)])
        recorder = pictura.SceneRecorder(simulator)
        simulator.run(pictura.Controller("lane", simulator), 30)
        recorder.scenario(id="drive", self_agent=0).save("drive.scenario")
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(examples, out=said.append)
    assert not said, "".join(said)


def test_help_of_make_vec_matches_its_page():
    text = pydoc.plain(pydoc.render_doc(pictura.make_vec))
    for word in ("preset", "num_agents", "Raises", "UsageError", ">>> envs = ", "[slots, ...]"):
        assert word in text, word
