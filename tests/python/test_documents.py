"""docs/reference/python.md names in its tables what there is; its code and that of docs/how-to/own_metric.md run."""

import importlib.util
import pathlib
import re

import numpy as np
import pytest

import pictura

ROOT = pathlib.Path(__file__).parents[2]
TEXT = (ROOT / "docs/reference/python.md").read_text()


def test_the_tables_name_every_observation_and_info():
    observations = TEXT.split("## Observations")[1].split("## Infos")[0]
    for name, *_ in pictura.OBSERVATION_ARRAYS:
        assert f"`{name}`" in observations, name
    infos = TEXT.split("## Infos")[1].split("## Environments")[0]
    from pictura.envs import Batch

    batch = Batch("procedural:3", 4, num_threads=1)
    batch.step(np.full(4, 7))
    for name in batch.info():
        assert f"`{name}`" in infos, name


def test_the_five_minutes_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", TEXT.split("## Five minutes")[1].split("## Recorded scenes")[0], re.S)
    assert len(blocks) == 4
    if importlib.util.find_spec("gymnasium") is None:
        blocks = [block for block in blocks if "make_vec" not in block and "gymnasium" not in block]
    for block in blocks:
        exec(compile(block, "docs/reference/python.md", "exec"), names)  # noqa: S102
    assert (tmp_path / "drive.html").exists()


def test_what_is_not_there_is_observed(make):
    (block,) = re.findall(r"```python\n(.*?)```", TEXT.split("### Of what is not there")[1].split("## Infos")[0], re.S)
    names: dict[str, object] = {"np": np, "pictura": pictura, "simulator": make(8)}
    exec(compile(block, "docs/reference/python.md", "exec"), names)  # noqa: S102
    assert names["answers"]["partners"].shape == (3, 16, 8)


def test_a_metric_of_ones_own_is_counted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(ROOT / "models")
    names: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs/how-to/own_metric.md").read_text(), re.S)
    needs = (None, None, "pictura._built_torch", "mcap")
    for block, module in zip(blocks, needs, strict=True):
        if module is None or importlib.util.find_spec(module) is not None:
            exec(compile(block, "docs/how-to/own_metric.md", "exec"), names)  # noqa: S102
    assert names["hard_steps"].sum() > 0 and names["distance_m"].sum() > 1000
    assert (tmp_path / "drive.html").exists()


def test_the_benchmarks_function_drives(monkeypatch):
    pytest.importorskip("pictura._training")
    evaluate = pictura.evaluate

    def shorter(checkpoint, **options):
        rows = evaluate(checkpoint, ["procedural:1"], steps=5, agents_per_world=4, device="cpu", **options)["rows"]
        return {"rows": [{"part": "towns", "name": "grid towns", "not_driven": None, **row} for row in rows]}

    monkeypatch.setattr(pictura, "evaluate_robust", shorter)
    page = "docs/how-to/robust_benchmark.md"
    (block,) = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
    names: dict[str, object] = {}
    exec(compile(block, page, "exec"), names)  # noqa: S102
    assert names["report"]["rows"][0]["vehicle_episodes"] > 0
