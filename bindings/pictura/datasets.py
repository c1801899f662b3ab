"""Converts scenes of other libraries to pictura.Scenario, through pictura.Scenario.from_arrays().

load_scenarionet() reads pickles of ScenarioNet and MetaDrive (sd_*.pkl: Waymo, nuScenes, nuPlan, Argoverse 2). It
executes no code of a pickle, which may contain only NumPy arrays and plain values. from_py123d() converts scene objects
of py123d, and does not import py123d.
"""

from __future__ import annotations

import io
import os
import pathlib
import pickle
import re
from typing import Any

import numpy as np

import pictura

_MAX_BYTES = 1 << 28
_MIN_VALUES = 1_000_000  # accepted from pickles of any size
_NUMPY = re.compile(r"numpy\.(_?core\.(multiarray|numeric)\.)?(\w+)")


def _plain_values(data: bytes) -> Any:
    """Returns the contents of a pickle of NumPy arrays and builtins; object arrays become lists.

    Stand-ins replace the callables that the pickle names. New stand-ins are created for every pickle, because a pickle
    can modify the objects that it names.
    """

    # A pickle can refer to a value again with a few bytes, so that nested references stand for any number of values.
    # Values that are written out are counted at most twice, and have at least one byte each.
    max_values, num_values = 2 * len(data) + _MIN_VALUES, 0

    def count(values: int) -> None:
        nonlocal num_values
        num_values += values
        if num_values > max_values:
            raise pickle.UnpicklingError(f"expected at most {max_values} values in {len(data)} bytes, got more")

    def encoded(text: str, _: Any) -> bytes:
        count(len(text))
        return text.encode("latin1")

    def set_of(values: Any = ()) -> set:
        count(len(values))
        return set(values)

    class Type:
        def __init__(self, name: str, *_: Any) -> None:
            if re.fullmatch(r"[biufSU]\d{1,4}|O8", name) is None:
                raise pickle.UnpicklingError(f"expected an array of numbers or texts, got one of {name!r}")
            self.name, self.order = name, "="

        def __setstate__(self, state: tuple) -> None:
            self.order = {"<": "<", ">": ">", "|": "|", "=": "="}[state[1]]

        def array(self, shape: tuple, data: Any, order: str) -> Any:
            if self.name == "O8":
                return list(data)
            if not isinstance(data, (bytes, bytearray)):
                raise pickle.UnpicklingError(f"expected an array's bytes, got {type(data).__name__}")
            return np.frombuffer(data, np.dtype(self.order + self.name)).reshape(shape, order=order)

    class Array:
        value: Any = None

        def __setstate__(self, state: tuple) -> None:
            _, shape, type_, is_fortran, data = state
            self.value = type_.array(shape, data, "F" if is_fortran else "C")

    def from_buffer(data: Any, type_: Type, shape: tuple, order: str) -> Array:
        array = Array()
        array.value = type_.array(shape, data, order)
        return array

    stand_ins = {
        "numpy ndarray": Array,
        "numpy dtype": Type,
        "numpy _reconstruct": lambda *_: Array(),
        "numpy _frombuffer": from_buffer,
        "numpy scalar": lambda type_, data: type_.array((), data, "C")[()],
        # Before protocol 3, pickles encode bytes with this function.
        "_codecs.encode": encoded,
        "builtins.bytes": lambda: b"",
        "collections.defaultdict": lambda *_: {},
        "collections.OrderedDict": lambda *_: {},
        "builtins.set": set_of,
        **{f"builtins.{kind.__name__}": kind for kind in (int, float)},
    }

    # Python's unpickler is half as fast as the C unpickler. But the C unpickler allocates memory for as many memoized
    # values as a pickle declares.
    class Unpickler(pickle._Unpickler):
        def find_class(self, module: str, name: str) -> Any:
            whole = f"{module.replace('__builtin__', 'builtins')}.{name}"
            from_numpy = _NUMPY.fullmatch(whole)
            found = stand_ins.get(f"numpy {from_numpy[3]}" if from_numpy else whole)
            if found is None:
                raise pickle.UnpicklingError(f"expected only NumPy arrays and builtins, got {whole}")
            return found

    def unwrapped(value: Any, depth: int = 0) -> Any:
        if depth > 20:
            raise pickle.UnpicklingError("expected values nested at most 20 deep, got deeper values")
        count(1)
        if isinstance(value, Array):
            return unwrapped(value.value, depth + 1)
        if isinstance(value, dict):
            return {key: unwrapped(each, depth + 1) for key, each in value.items()}
        if isinstance(value, (list, tuple)):
            return [unwrapped(each, depth + 1) for each in value]
        return value

    return unwrapped(Unpickler(io.BytesIO(data)).load())


_TRACK_TYPES = {"VEHICLE": "vehicle", "PEDESTRIAN": "pedestrian", "CYCLIST": "cyclist", "OTHER": "other", "UNSET": "unset"}
_LANE_TYPES = {
    "LANE_SURFACE_STREET": "driving", "LANE_SURFACE_UNSTRUCTURE": "driving", "LANE_FREEWAY": "driving", "LANE_BUS_LANE": "driving",
    "LANE_BIKE_LANE": "biking", "LANE_UNKNOWN": "other",
}  # fmt: skip
_LIGHTS = {"TRAFFIC_LIGHT_GREEN": "go", "TRAFFIC_LIGHT_RED": "stop", "TRAFFIC_LIGHT_YELLOW": "caution"}
_OUTLINE = re.compile(r"boundary_\d+")  # outlines of drivable areas in nuScenes and nuPlan
_MAX_OUTLINE_WORK, _NEAR_M = 100_000_000, 50.0
_MIN_HALF_WIDTH_M, _MAX_HALF_WIDTH_M = 0.5, 5.0  # as for borders in docs/reference/scenario.md


class _Fault(Exception):
    """Error in a part of a scene. The message names the part and the reason."""


def _entry(mapping: Any, key: str, place: str) -> Any:
    if not isinstance(mapping, dict):
        raise _Fault(f"{place}: expected a dict, got {type(mapping).__name__}")
    if key not in mapping:
        raise _Fault(f"{place}: expected '{key}', got no value")
    return mapping[key]


def _numbers(value: Any, place: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """Returns floats of a shape, in which None matches any length. An additional last axis of length 1 is dropped."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise _Fault(f"{place}: expected numbers, got {type(value).__name__}") from None
    if array.ndim == len(shape) + 1 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim != len(shape) or any(wanted not in (None, got) for wanted, got in zip(shape, array.shape)):
        expected = ", ".join("n" if each is None else str(each) for each in shape)
        raise _Fault(f"{place}: expected shape [{expected}], got {list(array.shape)}")
    return array


def _points(value: Any, place: str, is_flat: bool) -> np.ndarray:
    """Returns points [n, 3]. The height is 0 if points have no height, or if the map is flat."""
    points = _numbers(value, place, (None, None))
    if points.shape[1] not in (2, 3):
        raise _Fault(f"{place}: expected points of 2 or 3 numbers, got {points.shape[1]}")
    height = points[:, 2:] if points.shape[1] == 3 and not is_flat else np.zeros((len(points), 1))
    return np.concatenate([points[:, :2], height], 1)


def _numbered(keys: list[Any]) -> dict[str, int]:
    """Returns an integer for each id: the id itself if all ids are distinct integers, else its index."""
    texts = [str(key) for key in keys]
    own = all(re.fullmatch(r"\d{1,18}", text) for text in texts) and len({int(text) for text in texts}) == len(texts)
    return {text: int(text) if own else place for place, text in enumerate(texts)}


def _joined(lists: list[Any], kind: type = np.int64, tail: tuple[int, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Concatenates lists. Returns the result and the offset of each list."""
    whole = np.concatenate([np.zeros((0, *tail), kind), *(np.asarray(each, kind).reshape(-1, *tail) for each in lists)])
    return whole, np.cumsum([0, *(len(each) for each in lists)])


def _polylines(lines: list[np.ndarray]) -> dict[str, np.ndarray]:
    points, begin = _joined(lines, float, (3,))
    return {"points": points, "begin": begin}


def _width_m(lane: dict, points: int, place: str) -> np.ndarray:
    if lane.get("width") is None:
        return np.zeros(points)
    return _width_of_halves(_numbers(lane["width"], f"{place}['width']", (points, 2)))


def _width_of_halves(halves_m: np.ndarray) -> np.ndarray:
    """Returns widths [points] from half widths [points, 2] of both sides. Implausible values are ignored; if none is
    plausible, all widths are 0."""
    is_known = (halves_m >= _MIN_HALF_WIDTH_M) & (halves_m <= _MAX_HALF_WIDTH_M)
    sides = is_known.sum(1)
    if not sides.any():
        return np.zeros(len(halves_m))
    width_m = np.where(is_known, halves_m, 0).sum(1) * 2 / np.maximum(sides, 1)
    return np.interp(np.arange(len(halves_m)), np.flatnonzero(sides), width_m[sides > 0])


def _neighbor(neighbors: Any, lanes: dict[str, int], nearest: int) -> int:
    """Returns the integer id of the neighbouring lane; -1: none.

    Neighbours are dicts, of which the one with the longest common stretch counts, or ids from left to right, of which
    `nearest` is the index.
    """
    if not isinstance(neighbors, list) or not neighbors:
        return -1
    if not isinstance(neighbors[0], dict):
        return lanes.get(str(neighbors[nearest]), -1)
    known = [each for each in neighbors if isinstance(each, dict) and str(each.get("feature_id")) in lanes]
    longest = max(known, key=lambda each: int(each.get("self_end_index", 0)) - int(each.get("self_start_index", 0)), default=None)
    return -1 if longest is None else lanes[str(longest["feature_id"])]


def _lanes_of(features: dict, is_flat: bool) -> tuple[dict[str, Any], dict[str, int]]:
    kept = {str(key): each for key, each in features.items() if each["type"] in _LANE_TYPES}
    ids = _numbered(list(kept))

    def linked(lane: dict, key: str) -> list[int]:
        return [ids[str(other)] for other in lane.get(key) or [] if str(other) in ids]

    def limit_mps(lane: dict) -> float:
        return float(lane["speed_limit_kmh"] or 0) / 3.6 if "speed_limit_kmh" in lane else 0.0

    lines = [_points(_entry(lane, "polyline", f"map_features['{key}']"), f"map_features['{key}']['polyline']", is_flat) for key, lane in kept.items()]
    arrays: dict[str, Any] = _polylines(lines)
    arrays["id"] = list(ids.values())
    arrays["type"] = [pictura.LANE_TYPES.index(_LANE_TYPES[lane["type"]]) for lane in kept.values()]
    arrays["speed_limit_mps"] = [limit_mps(lane) for lane in kept.values()]
    widths = [_width_m(lane, len(line), f"map_features['{key}']") for (key, lane), line in zip(kept.items(), lines)]
    arrays["width_m"] = _joined(widths, float)[0]
    arrays["in_junction"] = [bool(lane.get("interpolating")) or lane["type"] == "LANE_SURFACE_UNSTRUCTURE" for lane in kept.values()]
    if any(lane.get("entry_lanes") or lane.get("exit_lanes") for lane in kept.values()):
        for key in ("entries", "exits"):
            name = {"entries": "entry_lanes", "exits": "exit_lanes"}[key]
            arrays[key], arrays[f"{key}_begin"] = _joined([linked(lane, name) for lane in kept.values()])
    arrays["left_neighbor"] = [_neighbor(lane.get("left_neighbor"), ids, -1) for lane in kept.values()]
    arrays["right_neighbor"] = [_neighbor(lane.get("right_neighbor"), ids, 0) for lane in kept.values()]
    return arrays, ids


def _is_inside(point: np.ndarray, ring: np.ndarray) -> bool:
    """Returns whether the point is inside the ring: a ray from it crosses the ring an odd number of times."""
    a, b = ring[:-1], ring[1:]
    spans = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[spans], b[spans]
    x = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool((x > point[0]).sum() % 2)


def _edges_of_outlines(rings: list[np.ndarray]) -> list[np.ndarray]:
    """Converts outlines of drivable areas to edges with the road on their left: outer rings run counter-clockwise,
    rings of holes clockwise."""
    if len(rings) * sum(map(len, rings)) > _MAX_OUTLINE_WORK:
        raise _Fault(f"map_features: expected fewer outlines, got {len(rings)} of {sum(map(len, rings))} points")
    edges = []
    for ring in rings:
        is_hole = sum(_is_inside(ring[0], other) for other in rings if other is not ring) % 2 == 1
        x, y = (ring - ring[0])[:, :2].T
        runs_left = (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() > 0
        edges.append(ring if runs_left != is_hole else ring[::-1])
    return edges


def _parts_near(lines: list[np.ndarray], places: np.ndarray) -> list[np.ndarray]:
    """Returns the parts of lines near a bounding box of the places, because outlines cover whole towns."""
    low, high = places[:, :2].min(0) - _NEAR_M, places[:, :2].max(0) + _NEAR_M
    parts = []
    for line in lines:
        is_near = ((line[:, :2] >= low) & (line[:, :2] <= high)).all(1)
        for part in np.split(np.arange(len(line)), np.flatnonzero(np.diff(is_near)) + 1):
            if is_near[part[0]] and len(part) > 1:
                parts.append(line[part])
    return parts


def _map_of(features: Any, is_flat: bool) -> tuple[dict[str, Any], dict[str, int]]:
    if not isinstance(features, dict):
        raise _Fault(f"map_features: expected a dict, got {type(features).__name__}")
    for key, each in features.items():
        if not isinstance(_entry(each, "type", f"map_features['{key}']"), str):
            raise _Fault(f"map_features['{key}']['type']: expected a text, got {type(each['type']).__name__}")

    def of(wanted: Any, points: str) -> list[tuple[dict, np.ndarray]]:
        return [
            (each, _points(each[points], f"map_features['{key}']['{points}']", is_flat))
            for key, each in features.items()
            if wanted(each["type"]) and points in each
        ]

    lanes, ids = _lanes_of(features, is_flat)
    edges = [points for _, points in of(lambda kind: kind in ("ROAD_EDGE_BOUNDARY", "ROAD_EDGE_MEDIAN"), "polyline")]
    lines = of(lambda kind: kind == "UNKNOWN_LINE" or kind.startswith("ROAD_LINE_"), "polyline")
    if not edges:
        outlines = {id(each) for key, each in features.items() if _OUTLINE.fullmatch(str(key))}
        rings = [points for each, points in lines if id(each) in outlines and len(points) > 3 and (points[0] == points[-1]).all()]
        lines = [(each, points) for each, points in lines if not any(points is ring for ring in rings)]
        edges = _parts_near(_edges_of_outlines(rings), lanes["points"]) if len(lanes["points"]) else []
    names = [each["type"].removeprefix("ROAD_LINE_").lower() for each, _ in lines]
    types = [pictura.LINE_TYPES.index(name if name in pictura.LINE_TYPES else "unknown") for name in names]
    signs = [(key, each) for key, each in features.items() if each["type"] == "STOP_SIGN"]
    places = [_points([_entry(each, "position", f"map_features['{key}']")], f"map_features['{key}']['position']", is_flat) for key, each in signs]
    held, begin = _joined([[ids[str(lane)] for lane in each.get("lane") or [] if str(lane) in ids] for _, each in signs])
    return {
        "lanes": lanes,
        "lines": {**_polylines([points for _, points in lines]), "type": np.asarray(types, int)},
        "edges": _polylines(edges),
        "crosswalks": _polylines([points for _, points in of(lambda kind: kind == "CROSSWALK", "polygon")]),
        "stop_signs": {"position_m": _joined(places, float, (3,))[0], "lanes": held, "lanes_begin": begin},
    }, ids


def _tracks_of(tracks: Any, steps: int, is_flat: bool) -> tuple[dict[str, Any], dict[str, int]]:
    if not isinstance(tracks, dict):
        raise _Fault(f"tracks: expected a dict, got {type(tracks).__name__}")
    kept = {str(key): each for key, each in tracks.items() if _entry(each, "type", f"tracks['{key}']") in _TRACK_TYPES}
    arrays: dict[str, list] = {"id": list(_numbered(list(kept)).values())}
    arrays["type"] = [pictura.TRACK_TYPES.index(_TRACK_TYPES[each["type"]]) for each in kept.values()]
    for name in ("size_m", "position_m", "heading_rad", "velocity_mps", "valid"):
        arrays[name] = []
    for key, each in kept.items():
        state, place = _entry(each, "state", f"tracks['{key}']"), f"tracks['{key}']['state']"

        def column(name: str, *shape: int | None) -> np.ndarray:
            return _numbers(_entry(state, name, place), f"{place}['{name}']", (steps, *shape))  # noqa: B023

        valid = column("valid") > 0.5
        sizes = np.stack([column(name) for name in ("length", "width", "height")], 1)
        position = _points(column("position", None), f"{place}['position']", is_flat)
        if not is_flat:
            position[:, 2] -= sizes[:, 2] / 2
        arrays["valid"].append(valid)
        arrays["size_m"].append(sizes[np.flatnonzero(valid)[-1]] if valid.any() else np.ones(3))
        arrays["position_m"].append(position)
        arrays["heading_rad"].append(column("heading"))
        arrays["velocity_mps"].append(column("velocity", None)[:, :2])
    return arrays, {key: index for index, key in enumerate(kept)}


def _lights_of(states: Any, lanes: dict[str, int], steps: int) -> dict[str, Any]:
    if not isinstance(states, dict):
        raise _Fault(f"dynamic_map_states: expected a dict, got {type(states).__name__}")

    def code(state: Any) -> int:
        name = _LIGHTS.get(str(state), str(state).removeprefix("LANE_STATE_").lower())
        return pictura.LIGHT_STATES.index(name if name in pictura.LIGHT_STATES else "none")

    held, shown = [], []
    for key, each in states.items():
        place = f"dynamic_map_states['{key}']"
        lane = str(each.get("lane", key)) if isinstance(each, dict) else str(key)
        listed = _entry(_entry(each, "state", place), "object_state", f"{place}['state']")
        if not isinstance(listed, (list, np.ndarray)) or len(listed) != steps:
            raise _Fault(f"{place}['state']['object_state']: expected {steps} states, got {type(listed).__name__} of {np.size(listed)}")
        if lane in lanes:
            held.append([lanes[lane]])
            shown.append([code(state) for state in listed])
    ids, begin = _joined(held)
    return {"lanes": ids, "lanes_begin": begin, "states": np.asarray(shown, int).reshape(-1, steps)}


def _scenarionet_arrays(scene: Any) -> dict[str, Any]:
    metadata = _entry(scene, "metadata", "scenario")
    time_s = _numbers(_entry(metadata, "ts", "metadata"), "metadata['ts']", (None,))
    steps = len(time_s)
    # Only maps in Waymo's frame have heights. In nuScenes' maps the third number of a lane's point is a heading, and
    # the other maps are flat.
    is_flat = metadata.get("coordinate") != "waymo"
    tracks, places = _tracks_of(_entry(scene, "tracks", "scenario"), steps, is_flat)
    arrays, lanes = _map_of(_entry(scene, "map_features", "scenario"), is_flat)
    arrays["lights"] = _lights_of(scene.get("dynamic_map_states", {}), lanes, steps)
    current = metadata.get("current_time_index")
    return arrays | {
        "tracks": tracks,
        "dt_s": round(float(np.median(np.diff(time_s))), 4) if steps > 1 else 0.1,
        "current_step": int(current) if isinstance(current, (int, np.integer)) else None,
        "sdc_track": places.get(str(metadata.get("sdc_id"))),
        "id": str(scene.get("id", "")),
    }


def load_scenarionet(path: str | os.PathLike[str]) -> pictura.Scenario:
    """Loads the scene of a ScenarioNet or MetaDrive pickle (sd_*.pkl).

    The scene keeps road users, lanes with links, neighbours, widths and limits, lines, edges, crosswalks, stop signs
    and lights. It drops cones, barriers, sidewalks, driveways and speed bumps. Ids that are not integers are replaced
    by indices. Maps are flat, except in Waymo's frame. Raises pictura.Error, which names the file and the part, also if
    a pickle contains other objects than NumPy arrays and builtins.

    Examples:
        >>> from pictura.datasets import load_scenarionet # doctest: +SKIP
        >>> scene = load_scenarionet("sd_nuscenes_v1.0-mini_scene-0061.pkl") # doctest: +SKIP
        >>> scene.save("scene-0061.scenario")            # pictura simulate scene-0061.scenario # doctest: +SKIP
    """
    path = os.fspath(path)
    if os.path.getsize(path) > _MAX_BYTES:
        raise pictura.Error(f"{path}: expected at most {_MAX_BYTES >> 20} MiB, got {os.path.getsize(path) >> 20}")
    try:
        scene = _plain_values(pathlib.Path(path).read_bytes())
    except Exception as error:  # broken bytes can cause any exception in the unpickler
        raise pictura.Error(f"{path}: not a pickle of a scene: {type(error).__name__}: {error}") from None
    try:
        return pictura.Scenario.from_arrays(**_scenarionet_arrays(scene))
    except (_Fault, pictura.Error) as fault:
        raise pictura.Error(f"{path}: {fault}") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise pictura.Error(f"{path}: not a scene of ScenarioNet: {error}") from error


_123D_LABELS = {
    "EGO": "vehicle", "VEHICLE": "vehicle", "TRAIN": "other", "TWO_WHEELER": "cyclist", "PERSON": "pedestrian", "ANIMAL": "other", "OTHER": "other",
}  # fmt: skip
_123D_LANES = {"UNDEFINED": "other", "BIKE_LANE": "biking"}  # all others are driving lanes
_123D_LINES = {
    "DASHED_WHITE": "broken_single_white", "DOUBLE_DASH_WHITE": "broken_single_white", "SOLID_WHITE": "solid_single_white",
    "DASH_SOLID_WHITE": "solid_single_white", "SOLID_DASH_WHITE": "solid_single_white", "DOUBLE_SOLID_WHITE": "solid_double_white",
    "DASHED_YELLOW": "broken_single_yellow", "DOUBLE_DASH_YELLOW": "broken_double_yellow", "SOLID_YELLOW": "solid_single_yellow",
    "DOUBLE_SOLID_YELLOW": "solid_double_yellow", "DASH_SOLID_YELLOW": "passing_double_yellow", "SOLID_DASH_YELLOW": "passing_double_yellow",
}  # fmt: skip
_123D_LIGHTS = {"GREEN": "go", "YELLOW": "caution", "RED": "stop"}
_EDGE_VOTES, _NEAR_LANE_M = 20, 10.0


def _distances_m(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Returns the horizontal distance from each point to a polyline."""
    a, way = line[:-1, :2], np.diff(line[:, :2], axis=0)
    from_a = points[:, None, :2] - a
    along = np.clip((from_a * way).sum(2) / np.maximum((way**2).sum(1), 1e-12), 0, 1)
    return np.linalg.norm(from_a - along[..., None] * way, axis=2).min(1)


def _with_road_on_left(edge: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Returns an edge with the road on its left: reversed if most of its pieces have the nearest lane on their
    right."""
    pieces = np.unique(np.linspace(0, len(edge) - 2, _EDGE_VOTES).astype(int))
    middle, way = (edge[pieces, :2] + edge[pieces + 1, :2]) / 2, edge[pieces + 1, :2] - edge[pieces, :2]
    to_lanes = centres[None, :, :2] - middle[:, None]
    distance_m = np.linalg.norm(to_lanes, axis=2)
    nearest = distance_m.argmin(1)
    to_lane = to_lanes[np.arange(len(pieces)), nearest]
    side = np.sign(way[:, 0] * to_lane[:, 1] - way[:, 1] * to_lane[:, 0]) * (distance_m.min(1) <= _NEAR_LANE_M)
    return edge if side.sum() >= 0 else edge[::-1]


def _123d_tracks(scene: Any, iterations: range, is_flat: bool, dt_s: float) -> dict[str, Any]:
    """Returns the tracks as arrays. "sdc" is the index of the self-driving car's track."""
    tokens: dict[str, int] = {}
    kinds: list[str] = []
    states: list[tuple[int, int, list[float]]] = []
    for step, iteration in enumerate(iterations):
        ego = scene.get_ego_state_se3_at_iteration(iteration)
        detections = scene.get_box_detections_se3_at_iteration(iteration)
        boxes = [] if ego is None else [("ego", ego.box_detection_se3)]
        boxes += [] if detections is None else [(box.attributes.track_token, box) for box in detections.box_detections]
        for token, box in boxes:
            label = box.attributes.default_label.name
            if label not in _123D_LABELS or (label == "EGO" and token != "ego"):
                continue
            if token not in tokens:
                tokens[token] = len(tokens)
                kinds.append(_123D_LABELS[label])
            extent, place, velocity = box.bounding_box_se3, box.bounding_box_se3.center_se3, box.velocity_2d
            foot_m = 0.0 if is_flat else place.z - extent.height / 2
            motion = (np.nan, np.nan) if velocity is None else (velocity.x, velocity.y)
            states.append((tokens[token], step, [place.x, place.y, foot_m, place.yaw, *motion, extent.length, extent.width, extent.height]))
    if not tokens:
        raise _Fault("tracks: expected at least one road user, got none")
    values = np.full((len(tokens), len(iterations), 9), np.nan)
    for track, step, numbers in states:
        values[track, step] = numbers
    valid = ~np.isnan(values[..., 0])
    # Missing velocities are estimated from consecutive positions. The last step uses the estimate of the previous step.
    moved = np.diff(values[..., :2], axis=1, append=np.nan) / dt_s
    for step in range(len(iterations)):
        known = values[:, step, 4:6]
        guessed = np.where(np.isnan(moved[:, step]), np.nan_to_num(moved[:, max(step - 1, 0)]), moved[:, step])
        values[:, step, 4:6] = np.where(np.isnan(known), guessed, known)
    last = valid.shape[1] - 1 - valid[:, ::-1].argmax(1)
    ids = _numbered([token for token in tokens if token != "ego"])
    return {
        "id": [ids.get(str(token), max(ids.values(), default=-1) + 1) for token in tokens],
        "type": [pictura.TRACK_TYPES.index(kind) for kind in kinds],
        "size_m": values[np.arange(len(tokens)), last, 6:9],
        "valid": valid,
        "position_m": values[..., :3],
        "heading_rad": values[..., 3],
        "velocity_mps": values[..., 4:6],
        "sdc": tokens.get("ego"),
    }


def _123d_map(objects: Any, is_flat: bool) -> tuple[dict[str, Any], dict[str, int]]:
    def points(line: Any, place: str) -> np.ndarray:
        return _points(line.array, place, is_flat)

    lanes = objects("lane")
    ids = _numbered([lane.object_id for lane in lanes])
    centres = [points(lane.centerline, f"lane {lane.object_id}") for lane in lanes]
    halves = [
        np.stack([_distances_m(centre, points(side, f"lane {lane.object_id}")) for side in (lane.left_boundary, lane.right_boundary)], 1)
        for lane, centre in zip(lanes, centres)
    ]

    def linked(others: Any) -> list[int]:
        return [ids[str(other)] for other in others or [] if str(other) in ids]

    def is_in_junction(lane: Any) -> bool:
        group = lane.lane_group
        return group is not None and group.intersection_id is not None

    entries, entries_begin = _joined([linked(lane.predecessor_ids) for lane in lanes])
    exits, exits_begin = _joined([linked(lane.successor_ids) for lane in lanes])
    arrays: dict[str, Any] = {
        **_polylines(centres),
        "id": list(ids.values()),
        "type": [pictura.LANE_TYPES.index(_123D_LANES.get(lane.lane_type.name, "driving")) for lane in lanes],
        "speed_limit_mps": [lane.speed_limit_mps or 0 for lane in lanes],
        "width_m": _joined([_width_of_halves(each) for each in halves], float)[0],
        "in_junction": [is_in_junction(lane) for lane in lanes],
        **{"entries": entries, "entries_begin": entries_begin, "exits": exits, "exits_begin": exits_begin},
        **{f"{side}_neighbor": [ids.get(str(getattr(lane, f"{side}_lane_id")), -1) for lane in lanes] for side in ("left", "right")},
    }
    lines = [line for line in objects("road_line") if line.road_line_type.name != "NONE"]
    names = [_123D_LINES.get(line.road_line_type.name, "unknown") for line in lines]
    signs = [zone for zone in objects("stop_zone") if zone.stop_zone_type.name == "STOP_SIGN"]
    held, begin = _joined([linked(zone.lane_ids) for zone in signs])
    edges = [points(edge.polyline, f"road edge {edge.object_id}") for edge in objects("road_edge")]
    return {
        "lanes": arrays,
        "lines": {**_polylines([points(line.polyline, f"road line {line.object_id}") for line in lines]),
                  "type": np.array([pictura.LINE_TYPES.index(name) for name in names], int)},
        "edges": _polylines([_with_road_on_left(edge, arrays["points"]) for edge in edges if len(edge) > 1]),
        "crosswalks": _polylines([points(each.outline, f"crosswalk {each.object_id}") for each in objects("crosswalk")]),
        "stop_signs": {"position_m": _joined([points(zone.outline, "stop zone").mean(0) for zone in signs], float, (3,))[0],
                       "lanes": held, "lanes_begin": begin},
    }, ids  # fmt: skip


def _123d_lights(scene: Any, iterations: range, lanes: dict[str, int]) -> dict[str, Any]:
    shown: dict[int, np.ndarray] = {}
    for step, iteration in enumerate(iterations):
        detections = scene.get_traffic_light_detections_at_iteration(iteration)
        for light in [] if detections is None else detections.detections:
            if str(light.lane_id) in lanes:
                states = shown.setdefault(lanes[str(light.lane_id)], np.zeros(len(iterations), int))
                states[step] = pictura.LIGHT_STATES.index(_123D_LIGHTS.get(light.status.name, "none"))
    held, begin = _joined([[lane] for lane in shown])
    return {"lanes": held, "lanes_begin": begin, "states": np.array(list(shown.values()), int).reshape(-1, len(iterations))}


def from_py123d(scene: Any, *, radius_m: float = 200.0) -> pictura.Scenario:
    """Converts a scene of py123d (py123d.api.SceneAPI), which reads nuPlan, Argoverse 2, nuScenes, Waymo and others.

    radius_m: maps of whole towns are cropped to this radius around the self-driving car's position at the scene's
    current step. The result has road users, lines, edges, crosswalks, stop signs, lights, and lanes with links,
    neighbours, speed limits, and widths from their boundaries. Raises pictura.UsageError for other objects, and
    pictura.Error, which names the scene and the part.

    Examples:
        >>> from pictura.datasets import from_py123d # doctest: +SKIP
        >>> scene = from_py123d(scene_of_py123d, radius_m=150) # doctest: +SKIP
    """
    if not hasattr(scene, "get_scene_metadata"):
        raise pictura.UsageError(f"from_py123d: expected a scene of py123d, got {type(scene).__name__}")
    metadata = scene.get_scene_metadata()
    place = f"{metadata.dataset}: {metadata.initial_uuid}"
    iterations = range(-metadata.num_history_iterations, metadata.num_future_iterations + 1)
    world, ego = scene.get_map_api(), scene.get_ego_state_se3_at_iteration(0)
    if world is None or ego is None:
        raise pictura.Error(f"{place}: expected a scene with {'a map' if world is None else 'a self-driving car'}, got none")
    layers = {layer.name.lower() for layer in world.get_available_map_layers()}

    def objects(layer: str) -> list[Any]:
        if layer not in layers:
            return []
        if world.map_is_per_log:
            return list(world.get_all_map_objects_in_layer(layer))
        return [each for found in world.get_map_objects_in_radius(ego.center_2d, radius_m, [layer]).values() for each in found]

    try:
        # The duration is rounded, because it is a mean of slightly varying intervals.
        is_flat, dt_s = not world.map_has_z, round(float(metadata.iteration_duration_s), 3)
        tracks = _123d_tracks(scene, iterations, is_flat, dt_s)
        sdc_track = tracks.pop("sdc")
        arrays, lanes = _123d_map(objects, is_flat)
        return pictura.Scenario.from_arrays(
            tracks, **arrays, lights=_123d_lights(scene, iterations, lanes), dt_s=dt_s,
            current_step=metadata.num_history_iterations, sdc_track=sdc_track, id=str(metadata.initial_uuid),
        )  # fmt: skip
    except (_Fault, pictura.Error) as fault:
        raise pictura.Error(f"{place}: {fault}") from None
