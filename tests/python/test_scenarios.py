"""Recorded scenes: their contents, and worlds whose agents are their tracks."""

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


def test_every_format_loads_and_errors_name_faults(folder, scene):
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


def test_masks_select_tracks(scene):
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


def test_recorded_lights_are_present_on_request(scene):
    lit = scene.with_recorded_lights()
    assert scene.geometry(walls=False).num_lights == 0 and lit.geometry(walls=False).num_lights == 3
    assert lit.starting_at(5).geometry(walls=False).num_lights == scene.facts["recorded_lights"] == 3
    assert (world_of(lit).draw(width_px=300, height_px=300) != world_of(scene).draw(width_px=300, height_px=300)).any()


def test_controllers_drive_among_recorded_tracks(scene):
    scene = scene.starting_at(10)
    simulator = world_of(scene)
    mask = scene.mask("self")
    drivers = [(pictura.Controller("log", simulator), None), (pictura.Controller("idle", simulator), mask)]
    shared = pictura.Controller.shared(drivers, simulator)
    assert shared.name == "log, idle"
    simulator.run(shared, 1)
    status = simulator.state["status"].numpy()
    assert status[scene.sdc_track] == ACTIVE and (status == ACTIVE).sum() == 1
    mask[:] = 0  # the mask is read at every step
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
                break  # the fixture's road users block it
            driven += 1
            place = feet_of(simulator)[scene.sdc_track, :2]
            recorded = scene.tracks()["position_m"][scene.sdc_track, step, :2]
            assert np.linalg.norm(place - recorded) < (0.5 if name == "inverse" else 20)
        assert driven > 5


def test_worlds_mix_scenes_and_options_are_kept(scene):
    options = scene.world(conditioning={"delta_goal_m": 3.0, "throttle": 0.5}, seed=4)
    assert options["conditioning"]["delta_goal_m"] == 3.0 and options["conditioning"]["throttle"] == 1
    assert options["seed"] == 4 and options["episode_steps"] == 90 and not options["walls"]
    own = {"delta_goal_m": 3.0}
    scene.world(conditioning=own)
    assert own == {"delta_goal_m": 3.0}, "the caller's dict"
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
def test_an_environment_drives_one_recorded_road_user(folder, scene, others):
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
    text = (pathlib.Path(__file__).parents[2] / "docs/reference/python/scenes.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    names: dict[str, object] = {"pictura": pictura}
    for block in blocks:
        block = block.replace("validation.tfrecord-00000-of-00150#7", str(folder / "womd.tfrecord"))
        exec(compile(block, "docs/reference/python/scenes.md", "exec"), names)  # noqa: S102
    assert names["errors"].shape == (12, 81) and names["simulator"].totals()["agent_steps"] > 0
    assert pictura.Scenario.load("drive.scenario").id == "my drive"


def equal_arrays(a: dict, b: dict) -> bool:
    if a.keys() != b.keys():
        return False
    return all(equal_arrays(a[k], b[k]) if isinstance(a[k], dict) else np.array_equal(a[k], b[k]) for k in a)


def crossing_arrays() -> dict:
    """Returns two consecutive lanes and one beside the first, far from the origin, with two road users and a light."""
    x = 650_000 + np.arange(0, 41) * 0.5
    y = np.full_like(x, 4_800_000.25)
    z = np.full_like(x, 12.5)
    lane = np.stack([x, y, z], 1)
    points = np.concatenate([lane, lane + (20, 0, 0), lane + (0, 3.5, 0)])
    steps = 21
    position = np.zeros((2, steps, 3))
    position[0] = lane[:steps]
    position[1] = lane[3] + (0, 3.5, 0.125)
    valid = np.ones((2, steps), bool)
    valid[1, 5:8] = False
    position[1, 5:8] = np.nan
    return {
        "tracks": {
            "id": [71, 5], "type": [pictura.TRACK_TYPES.index(name) for name in ("vehicle", "pedestrian")],
            "size_m": [[4.5, 1.875, 1.5], [0.5, 0.625, 1.75]], "position_m": position,
            "heading_rad": np.array([[0.0] * steps, [np.pi] * steps]), "velocity_mps": np.full((2, steps, 2), (5.0, 0.0)), "valid": valid,
        },
        "lanes": {
            "id": [9, 4, 30], "type": [0, 0, pictura.LANE_TYPES.index("biking")], "points": points, "begin": [0, 41, 82, 123],
            "speed_limit_mps": [13.5, 0, 7], "width_m": np.repeat([3.5, 0, 1.75], 41), "entries": [9], "entries_begin": [0, 0, 1, 1],
            "left_neighbor": [-1, -1, -1],
        },
        "lines": {"points": lane[:5] + (0, 1.75, 0), "begin": [0, 5], "type": [pictura.LINE_TYPES.index("solid_single_yellow")]},
        "edges": {"points": lane[[0, 40]] - (0, 1.75, 0), "begin": [0, 2]},
        "crosswalks": {"points": lane[0] + [(5, -2, 0), (8, -2, 0), (8, 2, 0), (5, 2, 0)], "begin": [0, 4]},
        "stop_signs": {"position_m": [lane[40]], "lanes": [9], "lanes_begin": [0, 1]},
        "lights": {
            "lanes": [4], "lanes_begin": [0, 1], "states": [[pictura.LIGHT_STATES.index("stop")] * steps],
            "stop_lines": [[lane[40] + (0, 1.5, 0), lane[40] - (0, 1.5, 0)]],
        },
        "dt_s": 0.125, "current_step": 3, "sdc_track": 0, "id": "mine",
    }  # fmt: skip


def test_a_scene_has_the_content_of_its_arrays(tmp_path):
    given = crossing_arrays()
    scene = pictura.Scenario.from_arrays(**given)
    assert (scene.id, scene.format, scene.num_steps, scene.dt_s, scene.current_step, scene.sdc_track) == ("mine", "arrays", 21, 0.125, 3, 0)
    back = scene.to_arrays()
    valid = given["tracks"]["valid"]
    for name, values in given["tracks"].items():
        is_state = np.ndim(values) > 1 and name != "size_m"
        got, wanted = (array[valid] if is_state else array for array in (back["tracks"][name], np.asarray(values)))
        np.testing.assert_array_equal(got, wanted, err_msg=name)
    lanes = back["lanes"]
    assert lanes["id"].tolist() == [9, 4, 30] and [pictura.LANE_TYPES[i] for i in lanes["type"]] == ["driving", "driving", "biking"]
    assert lanes["exits"].tolist() == [4] and lanes["exits_begin"].tolist() == [0, 1, 1, 1] and lanes["entries"].tolist() == [9]
    assert lanes["speed_limit_mps"].tolist() == [13.5, 15.0, 7.0], "unknown: 15 m/s"
    assert lanes["width_m"][: lanes["begin"][1]].tolist() == [3.5] * 3, "20 m in pieces of 10 m"
    for name in ("states", "lanes", "lanes_begin", "stop_lines"):
        np.testing.assert_array_equal(back["lights"][name], given["lights"][name])
    np.testing.assert_array_equal(back["stop_signs"]["position_m"], given["stop_signs"]["position_m"])
    np.testing.assert_array_equal(back["edges"]["points"][[0, -1]], given["edges"]["points"])
    np.testing.assert_array_equal(back["crosswalks"]["points"], given["crosswalks"]["points"])
    again = pictura.Scenario.from_arrays(**back)
    assert equal_arrays(again.to_arrays(), back)
    paths = [str(tmp_path / name) for name in ("a.scenario", "b.scenario")]
    again.save(paths[0])
    pictura.Scenario.from_arrays(**again.to_arrays()).save(paths[1])
    assert pathlib.Path(paths[0]).read_bytes() == pathlib.Path(paths[1]).read_bytes()
    assert equal_arrays(pictura.Scenario.load(paths[0]).to_arrays(), back)
    every = pictura.Scenario.from_arrays(**{**given, "tolerance_m": 0}).to_arrays()["lanes"]
    np.testing.assert_array_equal(every["points"], given["lanes"]["points"])


@pytest.mark.parametrize(("right", "are_neighbors"), [("driving", True), ("ramp", True), ("sidewalk", False)])
def test_neighbors_of_arrays_have_the_same_type_or_are_routes(right, are_neighbors):
    line = np.array([(0, 0, 0), (50, 0, 0)], float)
    lanes = {"id": [7, 8], "type": [pictura.LANE_TYPES.index(kind) for kind in ("driving", right)], "points": np.concatenate([line, line - (0, 3.5, 0)]),
             "begin": [0, 2, 4], "left_neighbor": [-1, 7], "right_neighbor": [8, -1]}  # fmt: skip
    track = {"id": [1], "type": [1], "size_m": np.ones((1, 3)), "valid": np.ones((1, 2), bool), "position_m": np.zeros((1, 2, 3)),
             "heading_rad": np.zeros((1, 2)), "velocity_mps": np.zeros((1, 2, 2))}  # fmt: skip
    kept = pictura.Scenario.from_arrays(track, lanes).to_arrays()["lanes"]
    assert kept["left_neighbor"].tolist() == ([-1, 7] if are_neighbors else [-1, -1])
    assert kept["right_neighbor"].tolist() == ([8, -1] if are_neighbors else [-1, -1])


def test_recordings_read_back_equal_from_their_arrays(folder, scene):
    for name in ("womd.tfrecord", "gpudrive.json", "pufferdrive_v1.bin", "pufferdrive_v3c.bin"):
        recorded = pictura.Scenario.load(str(folder / name))
        back = pictura.Scenario.from_arrays(**recorded.to_arrays())
        assert back.notes == [] and equal_arrays(back.to_arrays(), pictura.Scenario.from_arrays(**back.to_arrays()).to_arrays())
        for quantity, values in recorded.tracks().items():
            np.testing.assert_array_equal(back.tracks()[quantity], values, err_msg=f"{name} {quantity}")
        was, now = recorded.to_arrays(), back.to_arrays()
        assert equal_arrays(was["lights"], now["lights"])
        for part in ("id", "type", "entries", "entries_begin", "exits", "left_neighbor", "speed_limit_mps"):
            np.testing.assert_array_equal(was["lanes"][part], now["lanes"][part])
        for part in ("lanes", "edges", "lines", "crosswalks"):
            np.testing.assert_allclose(was[part]["points"], now[part]["points"], atol=0.01)
    simulator = world_of(pictura.Scenario.from_arrays(**scene.to_arrays()))
    simulator.run(pictura.Controller("log", simulator), 90)
    assert simulator.totals()["agent_steps"] == 0


def changed(path: str, value) -> dict:
    arrays = crossing_arrays()
    part, _, key = path.partition(".")
    if not key:
        return arrays | {part: value}
    if value is None:
        del arrays[part][key]
    else:
        arrays[part][key] = value
    return arrays


def with_nan(path: str, index: tuple) -> np.ndarray:
    part, key = path.split(".")
    array = np.array(crossing_arrays()[part][key], float)
    array[index] = np.nan
    return array


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("tracks.valid", None, r"tracks\['valid'\]: expected an array of shape \[2, n\], got None"),
        ("tracks.heading_rad", np.zeros((2, 20)), r"tracks\['heading_rad'\]: expected shape \[2, 21\], got \[2, 20\]"),
        ("tracks.headings", [1], r"tracks: expected id, type, .*, valid, got 'headings'"),
        ("tracks.position_m", with_nan("tracks.position_m", (0, 3, 1)), r"tracks\['position_m'\]\[0, 3, 1\]: expected a finite number, got nan"),
        ("tracks.type", [1, 9], r"tracks\['type'\]\[1\]: expected an index in \[0, 5\) of pictura.TRACK_TYPES, got 9"),
        ("tracks.type", [1.0, 2.0], r"tracks\['type'\]: expected integers, got float64"),
        ("tracks.id", "x", r"tracks\['id'\]: expected shape \[n\], got \[\]"),
        ("tracks.size_m", [[4, 0, 1], [1, 1, 1]], r"tracks\[0\]: width: expected a number in \(0, 100\]"),
        ("lanes.begin", [0, 41, 40, 123], r"lanes\['begin'\]\[2\]: expected 41 to 123, got 40"),
        ("lanes.begin", [0, 41, 82, 120], r"lanes\['begin'\]\[3\]: expected 123, the number of elements, got 120"),
        ("lanes.id", [9, 4, 9], r"lanes\['id'\]\[2\]: expected a unique id, got 9 again"),
        ("lanes.id", [9, -4, 3], r"lanes\['id'\]\[1\]: expected an id of 0 or more, got -4"),
        ("lanes.entries", [10], r"lanes\['entries'\]\[0\]: expected the id of a lane, got 10"),
        ("lanes.left_neighbor", [-1, 7, -1], r"lanes\['left_neighbor'\]\[1\]: expected the id of a lane, got 7"),
        ("lanes.points", with_nan("lanes.points", (7, 2)), r"lanes\['points'\]\[7, 2\]: expected a finite number, got nan"),
        ("lanes.width_m", np.full(123, -1.0), r"lanes\['width_m'\]\[0\]: expected a number in \[0, 50\], got -1"),
        ("lines.type", [11], r"lines\['type'\]\[0\]: .*pictura.LINE_TYPES, got 11"),
        ("lights.states", [[4] * 20], r"lights\['states'\]: expected shape \[n, 21\], got \[1, 20\]"),
        ("lights.states", [[9] * 21], r"lights\['states'\]\[0, 0\]: .*pictura.LIGHT_STATES, got 9"),
        ("lights.lanes", [5], r"lights\['lanes'\]\[0\]: expected the id of a lane, got 5"),
        ("lights.stop_lines", [[0, 0, 0]], r"lights\['stop_lines'\]: expected shape \[1, 2, 3\], got \[1, 3\]"),
        ("stop_signs.lanes_begin", [0], r"stop_signs\['lanes_begin'\]: expected shape \[2\], got \[1\]"),
        ("sdc_track", 2, r"sdc_track: expected a track in \[0, 2\), got 2"),
        ("current_step", 21, r"current_step: expected a step in \[0, 21\), got 21"),
        ("dt_s", 0, r"dt_s: expected more than 0.001 s and less than 10 s, got 0"),
        ("tolerance_m", -1, r"tolerance_m: expected a number in \[0, 1\], got -1"),
        ("origin_m", [0, 0, 0], r"within 10000 m of the map's centre"),
    ],
)  # fmt: skip
def test_errors_name_faults_of_arrays(path, value, message):
    with pytest.raises(pictura.Error, match=message):
        pictura.Scenario.from_arrays(**changed(path, value))
