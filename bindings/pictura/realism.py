"""Realism score and other metrics of rollouts (simulated continuations of recorded scenes).

docs/explanation/realism.md defines the metrics. Rollouts are three arrays:

- track_ids int64 [tracks]: all tracks that are present at step 10 of the scene
- center_m [rollouts, tracks, 80, 3]: centres of the boxes after each of the next 80 steps, in the coordinates of the
  scene's file
- heading_rad [rollouts, tracks, 80]

Numbers are rounded to float32, as in files of rollouts.
"""

from __future__ import annotations

import json
import os
from typing import Any, NamedTuple

import numpy as np

from pictura import _pictura

VERSIONS: tuple[str, ...] = _pictura.REALISM_VERSIONS
START, STEPS = 10, 80


class Rollouts(NamedTuple):
    """Rollouts of one scene."""

    track_ids: np.ndarray
    center_m: np.ndarray
    heading_rad: np.ndarray


def score(scene: _pictura.Scenario, rollouts: Rollouts, *, version: str = "2025") -> dict[str, Any]:
    """Returns a dict of one scene's scores, like one entry of "scenes" in the output of `pictura score --json`.

    Names are realism, likelihoods, ade_m, min_ade_m, collision_rate, comfortable_share, progress and more. A score is
    None if the scene does not define it. Raises pictura.Error, which names a missing or unknown track.
    """
    return json.loads(_pictura._realism_score(scene, *rollouts, version))


def features(scene: _pictura.Scenario, rollouts: Rollouts) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Returns the ids of the scored road users, a dict of their recorded features, and a dict of the features in each rollout.

    Recorded features are float64 [1, scored, 80], features of rollouts float64 [rollouts, scored, 80]. A step without a
    value is NaN.
    """
    return _pictura._realism_features(scene, *rollouts)


def read_rollouts(path: str | os.PathLike) -> dict[str, Rollouts]:
    """Reads rollouts from a file. Returns them by scenario id.

    The file is an output of `pictura evaluate --rollouts`, or a submission to the Waymo sim-agents challenge. Raises
    pictura.Error, which names file, scenario and field.
    """
    return {scenario_id: Rollouts(*arrays) for scenario_id, arrays in _pictura._read_rollouts(os.fspath(path)).items()}


def score_file(path: str | os.PathLike, scenes: str | list[str], *, version: str = "2025", num_threads: int = 0) -> dict[str, Any]:
    """Returns the output of `pictura score PATH --scenes SCENES --json` as a dict."""
    names = [scenes] if isinstance(scenes, str) else list(scenes)
    return json.loads(_pictura._score_rollouts(os.fspath(path), names, version, num_threads))


def recorded_rollouts(scene: _pictura.Scenario, count: int = 32) -> Rollouts:
    """Returns rollouts that repeat the recording, whose score is the upper bound of every simulator's score.

    In gaps of the recording, road users keep their last position. After their last state, they keep its velocity.
    """
    tracks = _present(scene)
    center, heading, valid = _centers(scene, tracks), tracks["heading_rad"], tracks["valid"]
    known = np.maximum.accumulate(np.where(valid, np.arange(valid.shape[1]), 0), 1)
    known = known[:, np.minimum(np.arange(START + 1, START + 1 + STEPS), known.shape[1] - 1)]
    last = valid.shape[1] - 1 - valid[:, ::-1].argmax(1)
    velocity = np.pad(tracks["velocity_mps"][np.arange(len(last)), last], ((0, 0), (0, 1)))
    since_s = 0.1 * np.maximum(np.arange(START + 1, START + 1 + STEPS) - last[:, None], 0)
    followed = np.take_along_axis(center, known[..., None], 1) + since_s[..., None] * velocity[:, None]
    return _repeated(tracks["id"], followed, np.take_along_axis(heading, known, 1), count)


def constant_velocity_rollouts(scene: _pictura.Scenario, count: int = 32) -> Rollouts:
    """Returns rollouts in which all road users keep the velocity and heading of step 10."""
    tracks = _present(scene)
    time_s = 0.1 * np.arange(1, STEPS + 1)
    velocity = np.pad(tracks["velocity_mps"][:, START], ((0, 0), (0, 1)))
    center = _centers(scene, tracks)[:, START, None] + time_s[:, None] * velocity[:, None]
    return _repeated(tracks["id"], center, np.repeat(tracks["heading_rad"][:, START, None], STEPS, 1), count)


def _present(scene: _pictura.Scenario) -> dict[str, np.ndarray]:
    tracks = scene.tracks()
    there = tracks["valid"][:, START]
    return {name: values[there] for name, values in tracks.items()}


def _centers(scene: _pictura.Scenario, tracks: dict[str, np.ndarray]) -> np.ndarray:
    """Returns the centres of boxes, [tracks, steps, 3], in the coordinates of the scene's file."""
    foot = tracks["position_m"].astype(np.float64) + scene.origin_m
    foot[..., 2] += tracks["size_m"][:, None, 2] / 2
    return foot


def _repeated(track_ids: np.ndarray, center_m: np.ndarray, heading_rad: np.ndarray, count: int) -> Rollouts:
    return Rollouts(track_ids, np.repeat(center_m[None], count, 0), np.repeat(heading_rad[None], count, 0))
