"""Logs maps, agents and images to rerun's viewer (rerun.io). Needs the package rerun-sdk (`pip install rerun-sdk`).

    import rerun, pictura.rerun
    rerun.init("pictura", spawn=True)
    pictura.rerun.log_map(town)
    for step in range(100):
        simulator.step(actions)
        pictura.rerun.log_world(simulator, step * simulator.dt_s)
"""

from __future__ import annotations

from typing import Any

import numpy as np

import pictura

try:
    import rerun
except ImportError as error:
    raise ImportError("pictura.rerun needs rerun: pip install rerun-sdk") from error

_CLASSES = ("vehicle", "cyclist", "pedestrian")
_COLORS = np.array([[60, 140, 255], [255, 160, 40], [60, 200, 120]], np.uint8)
_HALTED = np.array([150, 150, 150], np.uint8)
_STATUS_HALTED = 1
_STATUSES_WITHOUT_BODY = (3, 5)  # absent, waiting


def log_map(road: pictura.Map, entity: str = "world/map", recording: Any = None) -> None:
    """Logs markings, edges, stop lines, crosswalks and building lines of a map as static data, which is valid at all
    times. recording: a rerun recording; default: rerun's current recording.

    Examples:
        >>> rerun.init("pictura", spawn=True) # doctest: +SKIP
        >>> pictura.rerun.log_map(pictura.Map.load("procedural:3")) # doctest: +SKIP
    """
    arrays = road.arrays()

    def log(name: str, strips: list[np.ndarray], color: tuple[int, int, int]) -> None:
        if strips:
            rerun.log(f"{entity}/{name}", rerun.LineStrips3D(strips, colors=color), static=True, recording=recording)

    def ranges(name: str) -> list[np.ndarray]:
        return [arrays[f"{name}_points"][begin:end, :3] for begin, end in arrays[f"{name}_point_range"]]

    log("markings", ranges("marking"), (240, 240, 240))
    log("crosswalks", ranges("crosswalk"), (200, 200, 120))
    for name, color in (("road_edges", (160, 120, 80)), ("stop_lines", (240, 80, 80)), ("building_lines", (110, 110, 110))):
        log(name, list(arrays[name].reshape(-1, 2, 3)), color)


def log_world(simulator: pictura.Simulator, time_s: float, world: int = 0, entity: str = "world", recording: Any = None) -> None:
    """Logs the current state of the agents of one world: a box and a velocity arrow for each agent.

    The simulator must be on the CPU. Halted agents are grey. time_s is the time in seconds on rerun's timeline
    "simulated". Raises pictura.UsageError for a simulator on a CUDA device or a world that does not exist.

    Examples:
        >>> pictura.rerun.log_world(simulator, time_s=step * simulator.dt_s) # doctest: +SKIP
    """
    if simulator.device != "cpu" or not 0 <= world < simulator.num_worlds:
        raise pictura.UsageError(
            f"log_world: expected a world of 0 to {simulator.num_worlds - 1} on cpu, got {world} on {simulator.device}"
        )
    state = {name: array.numpy() for name, array in simulator.state.items()}
    slots = np.flatnonzero((simulator.world_of_slot.numpy() == world) & ~np.isin(state["status"], _STATUSES_WITHOUT_BODY))
    heading = state["heading_rad"][slots]
    size = np.stack([state[f"{name}_m"][slots] for name in ("length", "width", "height")], axis=1)
    # Positions in the state are those of rear axles; boxes of the scene have the centres of bodies.
    boxes = np.asarray(simulator.scene.boxes).view(pictura.BOX_DTYPE)[:, 0]
    views = np.asarray(simulator.views).view(pictura.VIEW_DTYPE)[:, 0]
    center = boxes["center_m"][views["ego_agent"][slots]]
    center[:, 2] += size[:, 2] / 2
    turn = np.zeros((len(slots), 4), np.float32)  # x, y, z, w
    turn[:, 2], turn[:, 3] = np.sin(heading / 2), np.cos(heading / 2)
    colors = _COLORS[state["agent_class"][slots]]
    colors[state["status"][slots] == _STATUS_HALTED] = _HALTED
    labels = [
        f"{_CLASSES[kind]} {agent}"
        for kind, agent in zip(state["agent_class"][slots], simulator.agent_of_slot.numpy()[slots], strict=True)
    ]
    rerun.set_time("simulated", duration=time_s, recording=recording)
    boxes = rerun.Boxes3D(centers=center, half_sizes=size / 2, quaternions=turn, colors=colors, labels=labels, show_labels=False)
    rerun.log(f"{entity}/agents", boxes, recording=recording)
    velocity = state["speed_mps"][slots, None] * np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    rerun.log(f"{entity}/velocities", rerun.Arrows3D(origins=center, vectors=velocity, colors=colors), recording=recording)


def log_images(images: pictura.Images, view: int, rig: pictura.Rig, entity: str = "cameras", recording: Any = None) -> None:
    """Logs the images of one view, each under the name of its camera. images: uint8, or floats in [0, 1], on the CPU.
    All cameras of the rig must have the same image size.

    Examples:
        >>> pictura.rerun.log_images(renderer.render(simulator.scene, simulator.views), view=0, rig=renderer.rig) # doctest: +SKIP
    """
    for pixels, camera in zip(images.rgb.numpy()[view], rig.cameras, strict=True):
        rows = np.moveaxis(pixels, 0, -1)
        if rows.dtype != np.uint8:
            rows = (255 * rows.astype(np.float32)).round().astype(np.uint8)
        rerun.log(f"{entity}/{camera.name}", rerun.Image(rows), recording=recording)
