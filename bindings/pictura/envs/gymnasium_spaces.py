"""Gymnasium spaces of a Batch."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from pictura.envs.batch import NUM_LATERAL, NUM_LONGITUDINAL, Batch


def _box(shape: tuple[int, ...], dtype: str) -> spaces.Box:
    if dtype == "uint8":
        return spaces.Box(0, 255, shape, np.uint8)
    if dtype == "int32":
        return spaces.Box(0, 80, shape, np.int32)
    return spaces.Box(-np.inf, np.inf, shape, np.float32)


def observation_space(batch: Batch) -> spaces.Space:
    """Returns the observation space of one slot."""
    shapes = batch.shapes()
    if isinstance(shapes, dict):
        return spaces.Dict({key: _box(*shape) for key, shape in shapes.items()})
    return _box(*shapes)


def action_space(batch: Batch) -> spaces.Space:
    """Returns the action space of one slot: Discrete(12), or MultiDiscrete([4, 3])."""
    if batch.actions == "discrete":
        return spaces.Discrete(NUM_LONGITUDINAL * NUM_LATERAL)
    return spaces.MultiDiscrete([NUM_LONGITUDINAL, NUM_LATERAL])
