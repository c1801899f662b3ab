"""Tests realism scores against a second implementation (realism_reference.py) on synthetic and real scenes, their files, and errors."""

import os
import pathlib
import subprocess

import numpy as np
import pytest
from realism_reference import FEATURES, Reference

import pictura
from pictura import realism

FIXTURE = os.environ.get("PICTURA_SCENE_FIXTURE", "")
DATA = pathlib.Path(os.environ.get("PICTURA_DATA", "/nowhere"))
REAL = ("womd/womd_scenario_input.tfrecord", "gpudrive/tfrecord-00000-of-01000_4.json", "gpudrive/tfrecord-00000-of-01000_325.json",
        "pufferdrive/map_000.bin")  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    if not os.path.isfile(FIXTURE):
        pytest.skip("PICTURA_SCENE_FIXTURE: expected the program scene_fixture")
    path = tmp_path_factory.mktemp("scenes")
    subprocess.run([FIXTURE, "write", str(path)], check=True)
    return path


@pytest.fixture(scope="module")
def scene(folder) -> pictura.Scenario:
    return pictura.Scenario.load(str(folder / "womd.tfrecord"))


def wandering(scene: pictura.Scenario, count: int, seed: int) -> realism.Rollouts:
    """Rollouts that turn and change speed at random, through each other and over edges and lines."""
    random = np.random.default_rng(seed)
    start = realism.constant_velocity_rollouts(scene, count)
    shape = start.heading_rad.shape
    first = start.center_m[:, :, 0]
    speed = np.linalg.norm(start.center_m[:, :, 1, :2] - start.center_m[:, :, 0, :2], axis=-1)[..., None]
    speed = np.maximum(speed + np.cumsum(random.normal(0.01, 0.02, shape), -1), 0) * random.choice([0, 1, 2], shape[:2])[..., None]
    heading = start.heading_rad + np.cumsum(random.normal(0, 0.04, shape), -1)
    step = np.stack([speed * np.cos(heading), speed * np.sin(heading), np.zeros(shape)], -1)
    heading = (heading + np.pi) % (2 * np.pi) - np.pi
    return realism.Rollouts(start.track_ids, first[:, :, None] + np.cumsum(step, 2) - step[:, :, :1], heading)


def compare(scene: pictura.Scenario, rollouts: realism.Rollouts) -> dict:
    """Checks that both implementations give equal features and metrics. Returns the score."""
    reference = Reference(scene)
    ids, recorded, simulated = realism.features(scene, rollouts)
    assert ids.tolist() == reference.ids[reference.scored].tolist()
    theirs = [reference.features(poses) for poses in reference.poses(rollouts)]
    logged = reference.features(reference.history)
    for name in FEATURES:
        # Edges are searched only within 50 m, which exceeds the distances that the score distinguishes.
        low, high = (-45, 45) if name == "distance_to_road_edge" else (-np.inf, np.inf)
        for ours, other in ((simulated[name], np.array([each[name] for each in theirs])), (recorded[name][0], logged[name])):
            np.testing.assert_allclose(np.clip(ours, low, high), np.clip(other, low, high), atol=2e-3, err_msg=name)
    score = realism.score(scene, rollouts)
    for version in realism.VERSIONS:
        ours, other = realism.score(scene, rollouts, version=version), reference.score(rollouts, version)
        for name in ("realism", "realism_by_object", "ade_m", "min_ade_m", "collision_rate", "off_road_rate"):
            assert ours[name] == pytest.approx(other[name], abs=2e-3), (version, name)
        for kind in ("likelihoods", "likelihoods_by_object"):
            for name in FEATURES:
                assert ours[kind][name] == pytest.approx(other[kind][name], abs=2e-3), (version, kind, name)
    return score


def test_both_implementations_agree_on_random_rollouts(scene):
    # Without tracks to predict, all tracks that are present at the start are scored.
    all_scored = pictura.Scenario.from_arrays(**scene.to_arrays())
    scores = [compare(scene, wandering(scene, 4, 0)), compare(all_scored, wandering(all_scored, 2, 1)), compare(all_scored, wandering(all_scored, 2, 2))]
    assert [score["road_users"] for score in scores] == [2, 12, 12]
    for score in scores:
        assert 0 < score["realism"] < 1 and score["ade_m"] >= score["min_ade_m"] > 0
    # Every kind of event occurs.
    for name in ("collision_rate", "off_road_rate", "red_light_rate", "short_time_to_collision_share"):
        assert max(score[name] for score in scores) > 0, name


@pytest.mark.parametrize("name", REAL)
def test_both_implementations_agree_on_real_scenes(name):
    if not (DATA / name).exists():
        pytest.skip(f"PICTURA_DATA: expected {name}")
    scene = pictura.Scenario.load(str(DATA / name))
    if scene.num_steps < 91:
        pytest.skip(f"{name} has {scene.num_steps} steps")
    compare(scene, wandering(scene, 1, 7))
    oracle = realism.score(scene, realism.recorded_rollouts(scene))
    straight_on = realism.score(scene, realism.constant_velocity_rollouts(scene))
    assert oracle["ade_m"] < 0.01 and straight_on["realism"] < oracle["realism"]


def test_the_recording_has_the_highest_score(scene):
    score = realism.score(scene, realism.recorded_rollouts(scene))
    assert score["ade_m"] < 1e-2 and score["rollouts"] == 32
    # Events: 32 of 32 alike, with 0.001 added to both bins.
    for name in ("collision", "off_road", "red_light"):
        assert score["likelihoods"][name] == pytest.approx(32.001 / 32.002, abs=1e-4)
    assert score["collision_rate"] == score["recorded_collision_rate"]
    assert score["realism"] >= realism.score(scene, realism.constant_velocity_rollouts(scene))["realism"]
    assert realism.score(scene, wandering(scene, 32, 1))["realism"] < score["realism"]
    assert score["progress"] > 0.95


def test_files_and_arrays_score_equally(folder, scene, tmp_path):
    command, path = os.environ.get("PICTURA_COMMAND", ""), tmp_path / "r.binproto"
    if not os.path.isfile(command):
        pytest.skip("PICTURA_COMMAND: expected the program pictura")
    words = ["evaluate", "--protocol", "simagents", "--scenes", folder / "womd.tfrecord", "--policy", "random", "--rollouts", path]
    made = subprocess.run([command, *map(str, words), "--threads", "1"], capture_output=True, text=True)
    if "evaluate" in made.stderr and made.returncode == 2:
        pytest.skip("built without torch")
    assert made.returncode == 0, made.stderr
    rollouts = realism.read_rollouts(path)[scene.id]
    assert rollouts.center_m.shape == (32, len(rollouts.track_ids), 80, 3)
    report = realism.score_file(path, str(folder / "womd.tfrecord"), num_threads=1)
    assert report["scored"] == 1 and report["faults"] == [] == report["unused"]
    alone = realism.score(scene, rollouts)
    assert report["scenes"][0] == alone and report["realism"] == alone["realism"]


def test_errors_name_invalid_input(scene, tmp_path):
    good = realism.recorded_rollouts(scene, 1)
    with pytest.raises(pictura.Error, match=f"track {good.track_ids[-1]} is missing"):
        realism.score(scene, realism.Rollouts(good.track_ids[:-1], good.center_m[:, :-1], good.heading_rad[:, :-1]))
    with pytest.raises(pictura.Error, match="track 99999 is absent"):
        realism.score(scene, good._replace(track_ids=np.append(good.track_ids[:-1], 99999)))
    with pytest.raises(pictura.Error, match="occurs twice"):
        realism.score(scene, good._replace(track_ids=np.append(good.track_ids[:-1], good.track_ids[0])))
    with pytest.raises(pictura.Error, match="expected rollouts of 80 steps, got 79"):
        realism.score(scene, good._replace(center_m=good.center_m[:, :, :79], heading_rad=good.heading_rad[:, :, :79]))
    center = good.center_m.copy()
    center[0, 0, 5, 1] = np.nan
    with pytest.raises(pictura.Error, match="expected finite numbers, .* got .*nan.* at step 5"):
        realism.score(scene, good._replace(center_m=center))
    with pytest.raises(pictura.UsageError, match="expected 2024 or 2025, got '2023'"):
        realism.score(scene, good, version="2023")
    with pytest.raises(pictura.UsageError, match="heading_rad: expected"):
        realism.score(scene, good._replace(heading_rad=good.heading_rad[:, :, :79]))
    broken = tmp_path / "broken.binproto"
    broken.write_bytes(b"\x0a\x05\x0a\x01")
    with pytest.raises(pictura.Error, match="broken.binproto: field 1: expected at most the 2 remaining bytes"):
        realism.read_rollouts(broken)
    with pytest.raises(pictura.Error, match="nowhere.binproto"):
        realism.read_rollouts("nowhere.binproto")
