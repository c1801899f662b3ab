"""Tests of the Python package: the package on PYTHONPATH, or the installed one."""

import pathlib
import sys

import numpy as np
import pytest

import pictura

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "support"))  # shared with other tests

IDLE = pictura.IDLE_ACTION


@pytest.fixture(scope="session")
def town() -> pictura.Map:
    return pictura.Map.load("procedural:3")


@pytest.fixture
def make(town):
    def made(agents: int = 12, worlds: int = 1, **options) -> pictura.Simulator:
        return pictura.Simulator([town], [(0, agents)] * worlds, num_threads=1, **options)

    return made


@pytest.fixture
def idle():
    return lambda simulator: np.full(simulator.num_slots, IDLE, np.int32)


def actions_of(step: int, slots: int) -> np.ndarray:
    """Actions that keep most agents driving."""
    random = np.random.default_rng(step)
    return np.where(random.random(slots) < 0.3, random.integers(0, 12, slots), 10).astype(np.int32)
