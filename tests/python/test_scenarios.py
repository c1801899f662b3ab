"""Recorded scenes: what was read of them, and worlds whose agents are their tracks."""

import os
import pathlib
import re
import subprocess

import numpy as np
import pytest

import pictura

FIXTURE = os.environ.get("PICTURA_SCENE_FIXTURE", "")  # writes a synthetic scene in every format
RECORDED_COMMAND, ACTIVE, ABSENT = 3, 0, 3


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


def world_of(scene: pictura.Scenario, **options) -> pictura.Simulator:
    return pictura.Simulator([scene], [(0, scene.num_tracks)], num_threads=1, **scene.world(**options))


def feet_of(simulator: pictura.Simulator) -> np.ndarray:
    return np.asarray(simulator.scene.boxes).view(pictura.BOX_DTYPE)[:, 0]["center_m"]


def test_a_scene_has_facts_tracks_and_a_map(scene):
    assert scene.format == "womd" and scene.num_steps == 91 and scene.current_step == 10
    assert isinstance(scene, pictura.Map) and len(scene.arrays()["lane_type"]) == scene.facts["lanes"] > 0
    assert scene.facts["vehicles"] == 8 and scene.facts["pedestrians"] == 3 and scene.facts["cyclists"] == 1
    tracks = scene.tracks()
    assert tracks["valid"].shape == (12, 91) == tracks["position_m"].shape[:2] and tracks["valid"].dtype == bool
    assert [pictura.TRACK_TYPES[i] for i in tracks["type"]].count("pedestrian") == 3
    assert not tracks["position_m"][~tracks["valid"]].any() and np.isfinite(tracks["position_m"]).all()
    moved = np.diff(tracks["position_m"][..., :2], axis=1) / scene.dt_s
    both = tracks["valid"][:, 1:] & tracks["valid"][:, :-1]
    np.testing.assert_allclose(moved[both], tracks["velocity_mps"][:, :-1][both], atol=2)
    assert (tracks["size_m"] > 0).all() and len(set(tracks["id"])) == 12
    assert all(len(note) == 3 for note in scene.notes)
    assert "12 tracks" in repr(scene)


def test_pictures_show_tracks(scene):
    bare, drawn, later = pictura.Map.draw(scene, 400, 300), scene.draw(400, 300), scene.starting_at(60).draw(400, 300)
    assert drawn.shape == (300, 400, 3) and drawn.dtype == np.uint8
    assert (bare != drawn).any() and (drawn != later).any()
    with pytest.raises(pictura.Error, match="16 to 8192"):
        scene.draw(8, 300)


def test_every_format_loads_and_what_is_wrong_is_named(folder, scene):
    for name in ("gpudrive.json", "pufferdrive_v1.bin", "pufferdrive_v3c.bin"):
        other = pictura.Scenario.load(str(folder / name))
        np.testing.assert_allclose(other.tracks()["position_m"].shape, scene.tracks()["position_m"].shape)
    assert pictura.Scenario.load(f"{folder / 'womd.tfrecord'}#0").id == scene.id
    with pytest.raises(pictura.UsageError, match="#7"):
        pictura.Scenario.load(f"{folder / 'womd.tfrecord'}#7")
    with pytest.raises(pictura.Error, match="nowhere.json"):
        pictura.Scenario.load("nowhere.json")
    with pytest.raises(pictura.UsageError, match=r"\[0, 91\), got 91"):
        scene.starting_at(91)


def test_masks_name_tracks(scene):
    assert scene.mask("all", absent=True).sum() == 12
    assert scene.mask("self").nonzero()[0].tolist() == [scene.sdc_track]
    assert (scene.mask("self,vehicles") <= scene.mask("all")).all()
    one = int(scene.tracks()["id"][scene.sdc_track])
    assert (scene.mask(str(one)) == scene.mask("self")).all()
    valid = scene.tracks()["valid"]
    for step in (0, 20, 60):
        mask = scene.starting_at(step).mask("all")
        assert (mask.astype(bool) == valid[:, step]).all()
    with pytest.raises(pictura.UsageError, match="cars"):
        scene.mask("cars")


@pytest.mark.parametrize("start_step", [0, 30])
def test_the_log_replays_the_recording(scene, start_step):
    scene = scene.starting_at(start_step)
    simulator = world_of(scene)
    assert simulator.maps[0].start_step == start_step
    tracks = scene.tracks()
    log = pictura.Controller("log", simulator)
    for step in range(start_step, scene.num_steps - 1):
        if step == start_step:
            commands = log.act(simulator)
            assert (commands["kind"] == RECORDED_COMMAND).all()
            simulator.step_commands(commands)
        else:
            simulator.run(log, 1)
        there = tracks["valid"][:, step + 1]
        status = simulator.state["status"].numpy()
        assert ((status != ABSENT) == there).all()
        np.testing.assert_allclose(feet_of(simulator)[there, :2], tracks["position_m"][there, step + 1, :2], atol=1e-3)
    assert simulator.totals()["agent_steps"] == 0


def test_recorded_lights_are_there_where_they_are_asked_for(scene):
    lit = scene.with_recorded_lights()
    assert scene.geometry(walls=False).num_lights == 0 and lit.geometry(walls=False).num_lights == 3
    assert lit.starting_at(5).geometry(walls=False).num_lights == scene.facts["recorded_lights"] == 3
    assert (world_of(lit).draw(width_px=300, height_px=300) != world_of(scene).draw(width_px=300, height_px=300)).any()


def test_some_drive_among_the_recorded(scene):
    scene = scene.starting_at(10)
    simulator = world_of(scene)
    mask = scene.mask("self")
    drivers = [(pictura.Controller("log", simulator), None), (pictura.Controller("idle", simulator), mask)]
    shared = pictura.Controller.shared(drivers, simulator)
    assert shared.name == "log, idle"
    simulator.run(shared, 1)
    status = simulator.state["status"].numpy()
    assert status[scene.sdc_track] == ACTIVE and (status == ACTIVE).sum() == 1
    mask[:] = 0  # is read at every step
    simulator.run(shared, 1)
    assert (simulator.state["status"].numpy() == ACTIVE).sum() == 0
    with pytest.raises(pictura.Error, match=r"mask of 'idle'.*\[12\]"):
        pictura.Controller.shared([(pictura.Controller("idle", simulator), np.ones(3, np.uint8))], simulator)
    with pytest.raises(pictura.UsageError):
        pictura.Controller.shared([], simulator)
    for no_simulator in ("x", 3, None, mask):
        with pytest.raises(TypeError):
            pictura.Controller.shared([], no_simulator)
        with pytest.raises(TypeError):
            pictura.Simulator._inside(no_simulator)
    other = world_of(scene)
    with pytest.raises(pictura.Error, match="of this simulator"):
        pictura.Controller.shared([(pictura.Controller("idle", other), None)], simulator)


def test_inverse_actions_follow_and_idm_drives(scene):
    found = scene.inverse_actions(num_threads=1)
    assert found["actions"].shape == found["is_followed"].shape == found["error_m"].shape == (12, 91)
    moving = found["error_m"][scene.sdc_track][found["is_followed"][scene.sdc_track]]
    assert len(moving) > 50 and moving.mean() < 0.2
    for name in ("inverse", "idm"):
        simulator = world_of(scene)
        drivers = [(pictura.Controller("log", simulator), None), (pictura.Controller(name, simulator), scene.mask("self"))]
        shared, driven = pictura.Controller.shared(drivers, simulator), 0
        for step in range(1, 41):
            simulator.run(shared, 1)
            if simulator.state["status"].numpy()[scene.sdc_track] != ACTIVE:
                break  # the fixture's road users stand in its way
            driven += 1
            place = feet_of(simulator)[scene.sdc_track, :2]
            recorded = scene.tracks()["position_m"][scene.sdc_track, step, :2]
            assert np.linalg.norm(place - recorded) < (0.5 if name == "inverse" else 20)
        assert driven > 5


def test_worlds_mix_scenes_and_options_are_kept(scene):
    options = scene.world(conditioning={"delta_goal_m": 3.0, "throttle": 0.5}, seed=4)
    assert options["conditioning"]["delta_goal_m"] == 3.0 and options["conditioning"]["throttle"] == 1
    assert options["seed"] == 4 and options["episode_steps"] == 90 and not options["walls"]
    late = scene.starting_at(30)
    simulator = pictura.Simulator([scene, late], [(0, 12), (1, 12)], num_threads=1, **options)
    simulator.run(pictura.Controller("log", simulator), 5)
    valid = scene.tracks()["valid"]
    status = simulator.state["status"].numpy()
    assert ((status != ABSENT) == np.concatenate([valid[:, 5], valid[:, 35]])).all()
    with pytest.raises(pictura.UsageError, match="12"):
        pictura.Simulator([scene], [(0, 3)], **options)


def test_a_run_is_saved_loaded_and_replayed(town, tmp_path):
    simulator = pictura.Simulator([town], [(0, 12)], num_threads=1, parked_cars=2, seed=5)
    recorder = pictura.SceneRecorder(simulator)
    boxes = [np.asarray(simulator.scene.boxes).view(pictura.BOX_DTYPE)[:, 0].copy()]
    lane = pictura.Controller("lane", simulator)
    for _ in range(30):
        simulator.run(lane, 1)
        boxes.append(np.asarray(simulator.scene.boxes).view(pictura.BOX_DTYPE)[:, 0].copy())
    assert recorder.num_steps == 30
    driven = recorder.scenario(id="lanes", self_agent=3)
    path = str(tmp_path / "drive.scenario")
    driven.save(path)
    scene = pictura.Scenario.load(path)
    assert scene.id == "lanes" and scene.format == "pictura" and scene.num_steps == 31
    ids = scene.tracks()["id"]
    assert ids[scene.sdc_track] == 3
    for name, values in driven.tracks().items():
        assert (values == scene.tracks()[name]).all(), name
    replay = world_of(scene)
    log = pictura.Controller("log", replay)
    for step, was in enumerate(boxes):
        np.testing.assert_allclose(feet_of(replay)[:, :2], was["center_m"][ids, :2], atol=1e-4, err_msg=str(step))
        if step < 30:
            replay.run(log, 1)
    with pytest.raises(pictura.UsageError, match=".scenario"):
        driven.save(str(tmp_path / "drive.json"))
    with pytest.raises(pictura.UsageError, match="got 99"):
        recorder.scenario(self_agent=99)
    simulator.reset()
    assert recorder.num_steps == 30, "another episode"
    simulator.set_worlds([pictura.Map.load("procedural:1:blocks=1x1")], [(0, 3)])
    again = recorder.scenario(self_agent=3)
    assert again.num_tracks == driven.num_tracks and again.id == "procedural:3 seed 5 world 0 episode 0", "of the world that was recorded"


@pytest.mark.parametrize("others", ["log", "idm", "idm_lanes"])
def test_one_road_user_among_the_recorded_is_an_environment(folder, scene, others):
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("pictura/Log-v0", scene=str(folder / "womd.tfrecord"), start_step=20, others=others)
    check_env(env.unwrapped, skip_render_check=True)
    seen, info = env.reset(seed=1)
    assert seen["ego"].shape == (9,) and not info["active"], "as recorded until the first action"
    tracks, simulator = scene.tracks(), env.unwrapped.batch.simulator
    walkers = tracks["type"] == pictura.TRACK_TYPES.index("pedestrian")
    for step in range(21, 31):
        seen, reward, terminated, truncated, info = env.step(pictura.IDLE_ACTION)
        there = tracks["valid"][:, step] & (walkers if others != "log" else np.arange(12) != scene.sdc_track)
        np.testing.assert_allclose(feet_of(simulator)[there, :2], tracks["position_m"][there, step, :2], atol=1e-3)
        assert info["active"] != terminated
        if terminated:
            break
    with pytest.raises(pictura.UsageError, match="lane"):
        gymnasium.make("pictura/Log-v0", scene=scene, others="lane", disable_env_checker=True)


def test_the_documents_code_runs(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (pathlib.Path(__file__).parents[2] / "docs" / "python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text.split("## Recorded scenes")[1].split("## Arrays")[0], re.S)
    names: dict[str, object] = {"pictura": pictura}
    for block in blocks:
        block = block.replace("validation.tfrecord-00000-of-00150#7", str(folder / "womd.tfrecord"))
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102
    assert names["errors"].shape == (12, 81) and names["simulator"].totals()["agent_steps"] > 0
    assert pictura.Scenario.load("drive.scenario").id == "my drive"
