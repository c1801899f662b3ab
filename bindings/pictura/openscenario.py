"""Export of recorded scenes as ASAM OpenSCENARIO XML 1.2, for simulators and viewers that read this format.

Every road user follows its recorded positions at the recorded times. Lights are not written, because OpenSCENARIO
refers to lights by the signals of a road network.
"""

from __future__ import annotations

import os
import pathlib
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from pictura import _pictura

_TYPES = {name: i for i, name in enumerate(_pictura.TRACK_TYPES)}
# Distance from the box's centre to the rear axle, and wheelbase, as shares of the box's length. The standard defines a
# vehicle's position as the middle of its rear axle on the ground.
_REAR_AXLE, _WHEELBASE = 0.3, 0.6
# Attributes of vehicles that the format requires, and that recordings do not contain.
_MAX_SPEED, _MAX_ACCELERATION, _MAX_STEERING, _WHEEL_DIAMETER, _MASS = "69.5", "10", "0.7", "0.6", "75"


def write(scene: _pictura.Scenario, path: str | os.PathLike, *, road_network: str = "") -> None:
    """Writes a scene to the file `path` (*.xosc). The file is written completely or not at all.

    Positions are in the coordinates of the scene's file. Time 0 is the scene's start_step. Each road user is present
    from its first to its last recorded state; in gaps of the recording it moves from one state to the next.
    road_network: path of the map's OpenDRIVE file, which programs that read the *.xosc file use; '': none. Raises
    pictura.UsageError for another file extension, or if no road users or fewer than two steps remain.
    """
    path = pathlib.Path(path)
    if path.suffix != ".xosc":
        raise _pictura.UsageError(f"{path}: expected a name that ends in .xosc")
    tree = ET.ElementTree(_document(scene, road_network))
    ET.indent(tree)
    beside = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        tree.write(beside, encoding="utf-8", xml_declaration=True)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def _document(scene: _pictura.Scenario, road_network: str) -> ET.Element:
    tracks = {name: values[:, scene.start_step :] if values.ndim > 1 and name != "size_m" else values for name, values in scene.tracks().items()}
    present = np.flatnonzero(tracks["valid"].any(1))
    if not len(present) or tracks["valid"].shape[1] < 2:
        raise _pictura.UsageError(f"scene {scene.id}: expected road users and two steps or more from step {scene.start_step} on")
    root = ET.Element("OpenSCENARIO")
    # The date is fixed, so that equal scenes give equal files.
    _add(root, "FileHeader", revMajor=1, revMinor=2, date="2000-01-01T00:00:00", description=f"Recorded scene {scene.id}", author="pictura")
    _add(root, "CatalogLocations")
    roads = _add(root, "RoadNetwork")
    if road_network:
        _add(roads, "LogicFile", filepath=road_network)
    entities, board = _add(root, "Entities"), _add(root, "Storyboard")
    init = _add(_add(board, "Init"), "Actions")
    story = _add(_add(board, "Story", name="recording"), "Act", name="recording")
    for track in present:
        _add_entity(entities, tracks, track)
        _add_motion(init, story, scene, tracks, track)
    _at_time(_add(story, "StartTrigger"), "start", 0)
    _at_time(_add(board, "StopTrigger"), "end", scene.dt_s * (tracks["valid"].shape[1] - 1))
    return root


def _add(parent: ET.Element, tag: str, **attributes: Any) -> ET.Element:
    return ET.SubElement(parent, tag, {name: f"{value:.9g}" if isinstance(value, float) else str(value) for name, value in attributes.items()})


def _name(tracks: dict[str, np.ndarray], track: int) -> str:
    return f"track {tracks['id'][track]}"


def _is_pedestrian(tracks: dict[str, np.ndarray], track: int) -> bool:
    return bool(tracks["type"][track] == _TYPES["pedestrian"])


def _add_entity(entities: ET.Element, tracks: dict[str, np.ndarray], track: int) -> None:
    name, (length, width, height) = _name(tracks, track), (float(value) for value in tracks["size_m"][track])
    entity = _add(entities, "ScenarioObject", name=name)

    def add_box(parent: ET.Element, ahead: float) -> None:
        box = _add(parent, "BoundingBox")
        _add(box, "Center", x=ahead, y=0.0, z=height / 2)
        _add(box, "Dimensions", width=width, length=length, height=height)

    if _is_pedestrian(tracks, track):
        pedestrian = _add(entity, "Pedestrian", name=name, mass=_MASS, pedestrianCategory="pedestrian")
        add_box(pedestrian, 0.0)
        _add(pedestrian, "Properties")
        return
    category = "bicycle" if tracks["type"][track] == _TYPES["cyclist"] else "car"
    vehicle = _add(entity, "Vehicle", name=name, vehicleCategory=category)
    add_box(vehicle, _REAR_AXLE * length)
    _add(vehicle, "Performance", maxSpeed=_MAX_SPEED, maxAcceleration=_MAX_ACCELERATION, maxDeceleration=_MAX_ACCELERATION)
    axles = _add(vehicle, "Axles")
    for tag, ahead, steering in (("FrontAxle", _WHEELBASE * length, _MAX_STEERING), ("RearAxle", 0.0, "0")):
        _add(axles, tag, maxSteering=steering, wheelDiameter=_WHEEL_DIAMETER, trackWidth=width, positionX=ahead, positionZ=0.3)
    _add(vehicle, "Properties")


def _add_motion(init: ET.Element, act: ET.Element, scene: _pictura.Scenario, tracks: dict[str, np.ndarray], track: int) -> None:
    name, steps = _name(tracks, track), np.flatnonzero(tracks["valid"][track])
    heading = tracks["heading_rad"][track].astype(float)
    back = 0.0 if _is_pedestrian(tracks, track) else _REAR_AXLE * float(tracks["size_m"][track][0])
    places = tracks["position_m"][track] + np.array(scene.origin_m)
    places[:, 0] -= back * np.cos(heading)
    places[:, 1] -= back * np.sin(heading)

    def add_place(parent: ET.Element, step: int) -> None:
        x, y, z = (float(value) for value in places[step])
        position = _add(parent, "Position")
        # Positions have four decimals (0.1 mm), because nine significant digits are too few for large coordinates.
        _add(position, "WorldPosition", x=f"{x:.4f}", y=f"{y:.4f}", z=f"{z:.4f}", h=f"{heading[step]:.6f}")

    def add_event(action: str, at_s: float) -> ET.Element:
        event = _add(maneuver, "Event", name=f"{name} {action}", priority="parallel")
        element = _add(event, "Action", name=f"{name} {action}")
        _at_time(_add(event, "StartTrigger"), f"{name} {action}", at_s)
        return element

    group = _add(act, "ManeuverGroup", maximumExecutionCount=1, name=name)
    _add(_add(group, "Actors", selectTriggeringEntities="false"), "EntityRef", entityRef=name)
    maneuver = _add(group, "Maneuver", name=name)
    first, last = int(steps[0]), int(steps[-1])
    if first == 0:
        private = _add(init, "Private", entityRef=name)
        add_place(_add(_add(private, "PrivateAction"), "TeleportAction"), 0)
        speed = _add(_add(_add(private, "PrivateAction"), "LongitudinalAction"), "SpeedAction")
        _add(speed, "SpeedActionDynamics", dynamicsShape="step", value=0, dynamicsDimension="time")
        _add(_add(speed, "SpeedActionTarget"), "AbsoluteTargetSpeed", value=float(np.linalg.norm(tracks["velocity_mps"][track, 0])))
    else:
        entity = _add(_add(add_event("appears", first * scene.dt_s), "GlobalAction"), "EntityAction", entityRef=name)
        add_place(_add(entity, "AddEntityAction"), first)
    if len(steps) > 1:
        action = _add(_add(_add(add_event("drives", first * scene.dt_s), "PrivateAction"), "RoutingAction"), "FollowTrajectoryAction")
        trajectory = _add(_add(action, "TrajectoryRef"), "Trajectory", name=name, closed="false")
        line = _add(_add(trajectory, "Shape"), "Polyline")
        for step in steps:
            add_place(_add(line, "Vertex", time=float(step * scene.dt_s)), int(step))
        _add(_add(action, "TimeReference"), "Timing", domainAbsoluteRelative="absolute", scale=1, offset=0)
        _add(action, "TrajectoryFollowingMode", followingMode="position")
    if last + 1 < tracks["valid"].shape[1]:
        entity = _add(_add(add_event("leaves", (last + 1) * scene.dt_s), "GlobalAction"), "EntityAction", entityRef=name)
        _add(entity, "DeleteEntityAction")


def _at_time(trigger: ET.Element, name: str, at_s: float) -> None:
    condition = _add(_add(trigger, "ConditionGroup"), "Condition", name=name, delay=0, conditionEdge="none")
    _add(_add(condition, "ByValueCondition"), "SimulationTimeCondition", value=float(at_s), rule="greaterOrEqual")
