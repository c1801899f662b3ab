"""Scenes of other libraries: pickles in ScenarioNet's format that are written here, hostile pickles, and objects like
py123d's.
"""

import codecs
import os
import pathlib
import pickle
import pickletools
import resource
import struct
import subprocess
from types import SimpleNamespace as NS

import numpy as np
import pytest

import pictura
from pictura.datasets import from_py123d, load_scenarionet

FIXTURE = os.environ.get("PICTURA_SCENE_FIXTURE", "")
STEPS = 11


def scene_of(coordinate: str = "waymo") -> dict:
    """Returns a road of two consecutive lanes, with a parallel lane, as ScenarioNet's converters write it."""
    x = np.arange(0, 41) * 0.5
    centre = np.stack([x, np.zeros(41), np.full(41, 3.0)], 1).astype(np.float32)
    state = {
        "position": np.stack([np.linspace(1, 6, STEPS), np.zeros(STEPS), np.full(STEPS, 3.75)], 1).astype(np.float32),
        "heading": np.zeros(STEPS, np.float32), "velocity": np.full((STEPS, 2), (5, 0), np.float32), "valid": np.ones(STEPS, bool),
        "length": np.full((STEPS, 1), 4.5), "width": np.full((STEPS, 1), 2.0), "height": np.full((STEPS, 1), 1.5),
    }  # fmt: skip
    walker = state | {"valid": np.arange(STEPS) < 4.0, "position": np.full((STEPS, 3), (3, 3.5, 3.875)), "height": np.full(STEPS, 1.75)}

    def track(kind: str, states: dict) -> dict:
        return {"type": kind, "state": states, "metadata": {"type": kind}}

    lane = {"type": "LANE_SURFACE_STREET", "speed_limit_kmh": 54.0, "width": np.full((41, 2), (1.75, 0), np.float32), "interpolating": False}
    return {
        "id": "scene-1", "version": "1.2", "length": STEPS,
        "metadata": {"ts": np.arange(STEPS) * 0.1, "coordinate": coordinate, "sdc_id": "7", "current_time_index": 5, "metadrive_processed": False},
        "tracks": {"9": track("PEDESTRIAN", walker), "c1": track("TRAFFIC_CONE", state), "7": track("VEHICLE", state)},
        "dynamic_map_states": {
            "21": {"type": "TRAFFIC_LIGHT", "lane": 21, "state": {"object_state": [None, *["LANE_STATE_STOP"] * 5, *["TRAFFIC_LIGHT_GREEN"] * 5]}},
            "5": {"type": "TRAFFIC_LIGHT", "lane": 5, "state": {"object_state": [None] * STEPS}},
        },
        "map_features": {
            "20": lane | {"polyline": centre, "entry_lanes": [], "exit_lanes": [21, 99], "left_neighbor": [
                {"feature_id": "22", "self_start_index": "0", "self_end_index": "40"}]},
            "21": lane | {"polyline": centre + np.float32((20, 0, 0)), "entry_lanes": ["20"], "interpolating": True},
            "22": {"type": "LANE_BIKE_LANE", "polyline": centre + np.float32((0, 3, 0)), "right_neighbor": ["20", "21"]},
            "1": {"type": "ROAD_LINE_SOLID_SINGLE_YELLOW", "polyline": centre.tolist()},
            "2": {"type": "ROAD_EDGE_BOUNDARY", "polyline": centre - np.float32((0, 2, 0))},
            "3": {"type": "CROSSWALK", "polygon": centre[[0, 10, 20]] + np.float32([(0, 0, 0), (0, 2, 0), (0, 0, 0)])},
            "4": {"type": "STOP_SIGN", "lane": [20], "position": centre[-1]}, "6": {"type": "DRIVEWAY", "polygon": centre},
        },
    }  # fmt: skip


def written(folder: pathlib.Path, data: object, protocol: int = 4) -> str:
    path = folder / "sd_scene.pkl"
    path.write_bytes(data if isinstance(data, bytes) else pickle.dumps(data, protocol))
    return str(path)


@pytest.mark.parametrize("protocol", range(6))
def test_pickles_become_scenes(tmp_path, protocol):
    scene = load_scenarionet(written(tmp_path, scene_of(), protocol))
    assert (scene.id, scene.num_steps, scene.current_step, scene.sdc_track) == ("scene-1", STEPS, 5, 1) and abs(scene.dt_s - 0.1) < 1e-6
    arrays = scene.to_arrays()
    tracks, lanes = arrays["tracks"], arrays["lanes"]
    assert tracks["id"].tolist() == [9, 7] and [pictura.TRACK_TYPES[kind] for kind in tracks["type"]] == ["pedestrian", "vehicle"]
    assert tracks["size_m"].tolist() == [[4.5, 2, 1.75], [4.5, 2, 1.5]] and tracks["valid"][0].tolist() == [True] * 4 + [False] * 7
    assert (tracks["position_m"][1, :, 2] == 3).all() and (tracks["position_m"][0, :4] == (3, 3.5, 3)).all(), "the foot's"
    assert lanes["id"].tolist() == [20, 21, 22] and [pictura.LANE_TYPES[kind] for kind in lanes["type"]] == ["driving", "driving", "biking"]
    assert lanes["exits"].tolist() == [21] and lanes["left_neighbor"].tolist() == [-1] * 3, "a bike lane is no neighbour"
    np.testing.assert_allclose(lanes["width_m"][:3], 3.5)
    np.testing.assert_allclose(lanes["speed_limit_mps"][:2], 15)
    names = [pictura.LIGHT_STATES[state] for state in arrays["lights"]["states"][0]]
    assert names == ["none"] + ["stop"] * 5 + ["go"] * 5 and arrays["lights"]["lanes"].tolist() == [21]
    assert len(arrays["edges"]["points"]) and len(arrays["crosswalks"]["begin"]) == 2 and arrays["stop_signs"]["lanes"].tolist() == [20]


def test_arrays_of_every_kind_are_read(tmp_path):
    scene = scene_of()
    state = scene["tracks"]["7"]["state"]
    state["position"] = np.asfortranarray(state["position"])
    state["heading"] = state["heading"].astype(">f8")
    state["valid"] = list(state["valid"].astype(np.int64))  # list of scalars
    scene["dynamic_map_states"]["21"]["state"]["object_state"] = np.array(["LANE_STATE_GO"] * STEPS, object)
    scene["dynamic_map_states"]["5"]["lane"] = np.int64(20)
    scene["dynamic_map_states"]["5"]["state"]["object_state"] = np.array(["LANE_STATE_STOP"] * STEPS)
    for protocol in (0, 2, 5):
        arrays = load_scenarionet(written(tmp_path, scene, protocol)).to_arrays()
        np.testing.assert_allclose(arrays["tracks"]["position_m"][1, :, 0], np.linspace(1, 6, STEPS), atol=1e-6)
        assert arrays["lights"]["lanes"].tolist() == [21, 20]
        assert arrays["lights"]["states"].tolist() == [[pictura.LIGHT_STATES.index(name)] * STEPS for name in ("go", "stop")]


def test_flat_maps_have_outlines_as_edges(tmp_path):
    scene = scene_of("right-handed")
    del scene["map_features"]["2"]
    for key in ("20", "21", "22"):
        scene["map_features"][key]["polyline"][:, 2] = 1.5  # a heading
    outer = np.array([(-5, -5), (45, -5), (45, 8), (-5, 8), (-5, -5)], float)
    hole = np.array([(30, 4), (35, 4), (35, 6), (30, 6), (30, 4)], float)
    far = outer + (5000, 0)
    for k, ring in enumerate((outer[::-1], hole, far)):
        scene["map_features"][f"boundary_{k}"] = {"type": "ROAD_LINE_SOLID_SINGLE_WHITE", "polyline": ring}
    arrays = load_scenarionet(written(tmp_path, scene)).to_arrays()
    points, begin = arrays["edges"]["points"], arrays["edges"]["begin"]
    assert len(begin) == 3 and (points[:, 2] == 0).all() and (arrays["tracks"]["position_m"][..., 2] == 0).all()

    def area(ring: np.ndarray) -> float:
        return float((ring[:-1, 0] * ring[1:, 1] - ring[1:, 0] * ring[:-1, 1]).sum() / 2)

    np.testing.assert_allclose([area(points[begin[k] : begin[k + 1]]) for k in range(2)], [650, -10])
    assert len(arrays["lines"]["begin"]) == 2, "outlines are no paint"


class Runs:
    """Object whose pickle contains a call."""

    def __init__(self, function, *arguments) -> None:
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


class Claims:
    """Array that declares more elements than it has."""

    def __reduce__(self):
        reconstruct, arguments, _ = np.zeros(1).__reduce__()
        return reconstruct, arguments, (1, (10**12,), np.dtype("u1"), False, 10**12)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (Runs(os.system, "touch ran"), r"posix\.system"),
        (Runs(eval, "open('ran', 'w')"), r"builtins\.eval"),
        (Runs(getattr, "os", "system"), r"builtins\.getattr"),
        (Runs(bytes, 10**12), "not a pickle of a scene"),
        (Runs(pathlib.Path, "ran"), r"pathlib"),
        (Runs(np.load, "ran"), r"numpy.*load"),
        (Runs(np.fromfile, "ran"), r"numpy.*fromfile"),
        (Claims(), "expected an array's bytes, got int"),
        (Runs(np.ndarray, (10**12,)), "not a pickle of a scene"),
        (np.array([Runs(os.system, "touch ran")], object), r"posix\.system"),
        (np.zeros(3, [("a", "f4"), ("b", "O")]), "expected an array of numbers or texts"),
    ],
)  # fmt: skip
def test_hostile_pickles_execute_no_code(tmp_path, monkeypatch, call, named):
    monkeypatch.chdir(tmp_path)
    for protocol in (0, 2, 4, 5):
        scene = scene_of()
        scene["tracks"]["7"]["state"]["heading"] = call
        with pytest.raises(pictura.Error, match=rf"(?s)sd_scene.pkl: .*{named}"):
            load_scenarionet(written(tmp_path, scene, protocol))
        assert [path.name for path in tmp_path.iterdir()] == ["sd_scene.pkl"], "nothing ran"


def test_pickles_cannot_modify_named_objects(tmp_path):
    # numpy.ndarray with a state of (None, {"__setstate__": int}), which the protocol writes into the named object.
    change = b"\x80\x04cnumpy\nndarray\n(N}\x8c\x0c__setstate__cbuiltins\nint\nst\x94b."
    pickletools.dis(change, out=open(os.devnull, "w"))
    with pytest.raises(pictura.Error, match="sd_scene.pkl"):
        load_scenarionet(written(tmp_path, change))
    assert load_scenarionet(written(tmp_path, scene_of())).num_tracks == 2


def test_large_claimed_sizes_in_pickles_allocate_no_memory(tmp_path):
    many, huge = struct.pack("<I", 2**32 - 1), struct.pack("<Q", 2**62)
    for data in (b"Nr" + many + b"N.", b"\x8e" + huge + b"x.", b"\x96" + huge + b"x.", b"\x95" + huge + b"N.", b"\x8b\xff\xff\xff\x7fx."):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with pytest.raises(pictura.Error, match="sd_scene.pkl"):
            load_scenarionet(written(tmp_path, b"\x80\x05" + data))
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000, data


def test_repeated_references_in_pickles_allocate_no_memory(tmp_path):
    nested: list = []
    for _ in range(15):
        nested = [nested] * 20  # 20 to the power of 15 values in 700 bytes
    text, items = "x" * 1_000_000, list(range(1_000_000))
    calls = [Runs(codecs.encode, text, "latin1") for _ in range(1000)], [Runs(set, items) for _ in range(1000)]
    for value in (nested, *calls):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with pytest.raises(pictura.Error, match=r"expected at most \d+ values in \d+ bytes"):
            load_scenarionet(written(tmp_path, value))
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 400_000


def test_errors_name_damaged_pickles(tmp_path):
    whole = pickle.dumps(scene_of(), 4)
    draw = np.random.default_rng(1)
    refused = 0
    for k in range(400):
        data = bytearray(whole[: draw.integers(1, len(whole))] if k % 4 == 0 else whole)
        for place in draw.integers(0, len(data), 3):
            data[place] = draw.integers(0, 256)
        try:
            load_scenarionet(written(tmp_path, bytes(data)))
        except pictura.Error as error:
            assert "sd_scene.pkl" in str(error)
            refused += 1
    assert refused > 200
    deep = b"\x80\x04" + b"]" * 50 + b"a" * 49 + b"."
    with pytest.raises(pictura.Error, match="deeper"):
        load_scenarionet(written(tmp_path, deep))
    itself = []
    itself.append(itself)
    with pytest.raises(pictura.Error, match="deeper"):
        load_scenarionet(written(tmp_path, itself))


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("metadata", "ts"), None, r"metadata: expected 'ts', got no value"),
        (("metadata", "ts"), np.zeros(4), r"tracks\['9'\]\['state'\]\['valid'\]: expected shape \[4\], got \[11\]"),
        (("tracks",), [], r"tracks: expected a dict, got list"),
        (("tracks", "7", "state", "heading"), None, r"tracks\['7'\]\['state'\]: expected 'heading', got no value"),
        (("tracks", "7", "state", "heading"), np.zeros((STEPS, 2)), r"tracks\['7'\]\['state'\]\['heading'\]: expected shape \[11\], got \[11, 2\]"),
        (("tracks", "7", "state", "position"), np.full((STEPS, 3), np.nan), r"tracks\['position_m'\]\[1, 0, 0\]: expected a finite number"),
        (("map_features", "20", "polyline"), "x", r"map_features\['20'\]\['polyline'\]: expected numbers, got str"),
        (("map_features", "20", "polyline"), None, r"map_features\['20'\]: expected 'polyline', got no value"),
        (("map_features", "20", "type"), 3, r"map_features\['20'\]\['type'\]: expected a text, got int"),
        (("map_features", "20", "width"), np.zeros((3, 2)), r"map_features\['20'\]\['width'\]: expected shape \[41, 2\], got \[3, 2\]"),
        (("dynamic_map_states", "21", "state", "object_state"), ["GO"], r"dynamic_map_states\['21'\].*expected 11 states, got list of 1"),
        (("map_features",), {}, r"expected at least one lane, got none"),
    ],
)  # fmt: skip
def test_errors_name_faults_of_a_scene(tmp_path, path, value, message):
    scene = scene_of()
    part = scene
    for key in path[:-1]:
        part = part[key]
    if value is None:
        del part[path[-1]]
    else:
        part[path[-1]] = value
    with pytest.raises(pictura.Error, match=rf"sd_scene.pkl: .*{message}"):
        load_scenarionet(written(tmp_path, scene))


def test_written_recordings_read_back_equal(tmp_path):
    if not os.path.isfile(FIXTURE):
        pytest.skip("PICTURA_SCENE_FIXTURE: expected the program scene_fixture")
    subprocess.run([FIXTURE, "write", str(tmp_path)], check=True)
    recorded = pictura.Scenario.load(str(tmp_path / "womd.tfrecord"))
    arrays = recorded.to_arrays()
    tracks, lanes = arrays["tracks"], arrays["lanes"]

    def lines(part: str) -> list[np.ndarray]:
        return [arrays[part]["points"][a:b] for a, b in zip(arrays[part]["begin"], arrays[part]["begin"][1:])]

    def lane(k: int, points: np.ndarray) -> dict:
        linked = [lanes[key][lanes[f"{key}_begin"][k] : lanes[f"{key}_begin"][k + 1]].tolist() for key in ("entries", "exits")]
        half = lanes["width_m"][lanes["begin"][k] : lanes["begin"][k + 1], None] / 2 * np.ones(2)
        kind = {"driving": "LANE_FREEWAY", "biking": "LANE_BIKE_LANE"}.get(pictura.LANE_TYPES[lanes["type"][k]], "LANE_UNKNOWN")
        return {"type": kind, "polyline": points, "entry_lanes": linked[0], "exit_lanes": linked[1], "width": half,
                "speed_limit_kmh": lanes["speed_limit_mps"][k] * 3.6}  # fmt: skip

    scene = scene_of() | {"dynamic_map_states": {}}
    scene["metadata"] |= {"ts": np.arange(recorded.num_steps) * 0.1, "sdc_id": str(tracks["id"][recorded.sdc_track])}
    scene["map_features"] = {str(lanes["id"][k]): lane(k, points) for k, points in enumerate(lines("lanes"))}
    scene["map_features"] |= {f"e{k}": {"type": "ROAD_EDGE_MEDIAN", "polyline": points} for k, points in enumerate(lines("edges"))}
    scene["tracks"] = {
        str(tracks["id"][k]): {
            "type": pictura.TRACK_TYPES[tracks["type"][k]].upper(),
            "state": {
                "position": tracks["position_m"][k] + (0, 0, size[2] / 2), "heading": tracks["heading_rad"][k], "velocity": tracks["velocity_mps"][k],
                "valid": tracks["valid"][k], **{name: np.full(recorded.num_steps, size[i]) for i, name in enumerate(("length", "width", "height"))},
            },
        }
        for k, size in enumerate(tracks["size_m"])
    }  # fmt: skip
    back = load_scenarionet(written(tmp_path, scene))
    assert back.sdc_track == recorded.sdc_track and back.facts["lanes"] == recorded.facts["lanes"]
    ours, theirs = back.to_arrays(), arrays
    for name in ("id", "type", "valid", "size_m"):
        np.testing.assert_array_equal(ours["tracks"][name], theirs["tracks"][name])
    np.testing.assert_allclose(ours["tracks"]["position_m"], theirs["tracks"]["position_m"], atol=1e-3)
    for name in ("entries", "exits", "exits_begin"):
        np.testing.assert_array_equal(ours["lanes"][name], theirs["lanes"][name])


def scene_123d(missing: tuple[str, ...] = ()) -> object:
    """Returns a scene with the attributes of py123d.api.SceneAPI that are read: the self-driving car, a walker and a
    cone on two lanes."""
    x = np.arange(0, 41) * 0.5

    def line(y: float, first: float = 0.0, z: float = 1.0) -> NS:
        return NS(array=np.stack([x + first, np.full(41, y), np.full(41, z)], 1))

    def lane(number: int, first: float, before: list, after: list) -> NS:
        return NS(
            object_id=number, lane_type=NS(name="SURFACE_STREET"), centerline=line(0, first), left_boundary=line(1.5, first), right_boundary=line(-2, first),
            predecessor_ids=before, successor_ids=after, left_lane_id=None, right_lane_id=77, speed_limit_mps=None if first else 11.0,
            lane_group=NS(intersection_id=4) if first else None,
        )  # fmt: skip

    layers = {
        "lane": [lane(3, 0, [], [8]), lane(8, 20, [3, 99], [])],
        "road_line": [NS(object_id=1, road_line_type=NS(name=name), polyline=line(1.5)) for name in ("DASH_SOLID_YELLOW", "NONE")],
        "road_edge": [NS(object_id=2, polyline=line(3)), NS(object_id=5, polyline=line(-3))],
        "crosswalk": [NS(object_id=6, outline=NS(array=np.array([(5, -2, 1), (8, -2, 1), (8, 2, 1), (5, 2, 1)], float)))],
        "stop_zone": [NS(stop_zone_type=NS(name=name), lane_ids=[3], outline=line(0)) for name in ("STOP_SIGN", "TRAFFIC_LIGHT")],
    }

    def box(token: str, label: str, place: tuple[float, float], velocity: NS | None) -> NS:
        return NS(
            attributes=NS(track_token=token, default_label=NS(name=label)), velocity_2d=velocity,
            bounding_box_se3=NS(center_se3=NS(x=place[0], y=place[1], z=1.75, yaw=0.25), length=4.0, width=2.0, height=1.5),
        )  # fmt: skip

    def walker(i: int) -> list[NS]:
        return [] if i == 2 else [box("21", "PERSON", (3 + i / 4, 3.0), None), box("5", "TRAFFIC_CONE", (0, 0), None)]

    world = NS(
        map_is_per_log=True, map_has_z=True, get_available_map_layers=lambda: [NS(name=name.upper()) for name in layers],
        get_all_map_objects_in_layer=lambda layer: iter(layers[layer]),
    )  # fmt: skip
    return NS(
        get_scene_metadata=lambda: NS(dataset="mine", initial_uuid="ab", num_history_iterations=1, num_future_iterations=2, iteration_duration_s=0.5002),
        get_map_api=lambda: None if "map" in missing else world,
        get_ego_state_se3_at_iteration=lambda i: None if "car" in missing else NS(center_2d=None, box_detection_se3=box("ego", "EGO", (i + 2.0, 0), NS(x=2.0, y=0.0))),
        get_box_detections_se3_at_iteration=lambda i: None if i == -1 else NS(box_detections=walker(i)),
        get_traffic_light_detections_at_iteration=lambda i: NS(detections=[NS(lane_id=8, status=NS(name="RED" if i < 1 else "OFF")), NS(lane_id=1, status=NS(name="RED"))]),
    )  # fmt: skip


def test_scenes_of_py123d_become_scenes():
    scene = from_py123d(scene_123d())
    assert (scene.id, scene.num_steps, scene.current_step, scene.sdc_track, scene.dt_s) == ("ab", 4, 1, 0, 0.5)
    arrays = scene.to_arrays()
    tracks, lanes = arrays["tracks"], arrays["lanes"]
    assert tracks["id"].tolist() == [22, 21] and [pictura.TRACK_TYPES[kind] for kind in tracks["type"]] == ["vehicle", "pedestrian"]
    assert tracks["valid"].tolist() == [[True] * 4, [False, True, True, False]]
    assert tracks["position_m"][0].tolist() == [[1, 0, 1], [2, 0, 1], [3, 0, 1], [4, 0, 1]] and (tracks["heading_rad"][0] == 0.25).all()
    assert tracks["velocity_mps"][0].tolist() == [[2, 0]] * 4
    assert tracks["velocity_mps"][1, 1:3].tolist() == [[0.5, 0]] * 2, "from one place to the next"
    assert lanes["id"].tolist() == [3, 8] and lanes["exits"].tolist() == [8] and lanes["in_junction"].tolist() == [False, True]
    np.testing.assert_allclose(lanes["width_m"], 3.5)
    assert lanes["speed_limit_mps"].tolist() == [11, 15] and len(lanes["begin"]) == 3
    assert [pictura.LIGHT_STATES[state] for state in arrays["lights"]["states"][0]] == ["stop", "stop", "none", "none"]
    assert arrays["lights"]["lanes"].tolist() == [8] and arrays["stop_signs"]["lanes"].tolist() == [3]
    first = arrays["edges"]["points"][arrays["edges"]["begin"][:-1]]
    assert first.tolist() == [[20, 3, 1], [0, -3, 1]], "the road is on the left of both"
    assert {pictura.LINE_TYPES[kind] for kind in arrays["lines"]["type"]} == {"solid_single_yellow", "dash_yellow"}
    for missing, message in (("map", "mine: ab: expected a scene with a map"), ("car", "mine: ab: expected a scene with a self-driving car")):
        with pytest.raises(pictura.Error, match=message):
            from_py123d(scene_123d((missing,)))
    with pytest.raises(pictura.UsageError, match="expected a scene of py123d, got str"):
        from_py123d("nuplan")


def test_scenes_of_py123d_have_the_attributes_that_are_read():
    api = pytest.importorskip("py123d.api")
    objects = pytest.importorskip("py123d.datatypes.map_objects")
    for name in ("get_scene_metadata", "get_map_api", "get_ego_state_se3_at_iteration", "get_box_detections_se3_at_iteration"):
        assert hasattr(api.SceneAPI, name)
    for name in ("get_available_map_layers", "get_all_map_objects_in_layer", "get_map_objects_in_radius", "map_is_per_log", "map_has_z"):
        assert hasattr(api.MapAPI, name)
    for name in ("centerline", "left_boundary", "right_boundary", "predecessor_ids", "successor_ids", "left_lane_id", "speed_limit_mps", "lane_group"):
        assert hasattr(objects.Lane, name)
