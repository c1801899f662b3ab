"""docs/python.md: its tables name what there is, and its code runs."""

import pathlib
import re

import numpy as np

import pictura

TEXT = (pathlib.Path(__file__).parents[2] / "docs" / "python.md").read_text()


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


def test_the_five_minutes_run():
    names: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", TEXT.split("## Five minutes")[1].split("## Arrays")[0], re.S)
    assert len(blocks) == 3
    for block in blocks[: 2 if __import__("importlib.util").util.find_spec("gymnasium") else 1]:
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102
