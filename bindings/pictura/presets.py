"""Converts training configurations of `pictura train` to arguments of environments."""

from __future__ import annotations

import pathlib
import tomllib
from typing import Any

import pictura

# File of each preset, in the folder configs beside this file.
PRESETS = {"demo": "demo.toml", "town": "agent.toml", "paper": "paper.toml"}
# Keys of [simulator] that are not arguments of pictura.Simulator: they describe the set of worlds.
_OF_THE_RUN = ("backend", "maps", "map_copies", "num_slots", "min_agents", "max_agents")


def preset_config(preset: str) -> dict[str, Any]:
    """Returns the configuration of a preset as a dict of tables. docs/reference/configuration.md describes the keys.

    Args:
        preset: "demo", "town" or "paper".

    Raises:
        pictura.UsageError: There is no such preset.

    Examples:
        >>> from pictura.presets import preset_config
        >>> preset_config("demo")["render"]
        {'width_px': 32, 'height_px': 18}
    """
    if preset not in PRESETS:
        raise pictura.UsageError(f"preset: expected one of {', '.join(PRESETS)}; got '{preset}'")
    with (pathlib.Path(__file__).parent / "configs" / PRESETS[preset]).open("rb") as file:
        return tomllib.load(file)


def preset_options(preset: str, maps: Any = None, num_agents: int | None = None, **given: Any) -> dict[str, Any]:
    """Returns the arguments of pictura.envs.gymnasium_vector.DriveVectorEnv that give a preset's world and observation.

    Args:
        preset: "demo", "town" or "paper".
        maps: Maps instead of the preset's maps.
        num_agents: Number of agents in each world; None: the preset draws a number for each world,
            or, with num_worlds, its maximum.
        given: Other arguments, which override the preset. `conditioning` overrides only the values that it names, and
            num_envs the number of slots.

    Raises:
        pictura.UsageError: There is no such preset.

    Examples:
        >>> from pictura.presets import preset_options
        >>> preset_options("demo", episode_steps=100)["episode_steps"]
        100
    """
    config = preset_config(preset)
    simulator, render = config["simulator"], config.get("render", {})
    options = {name: value for name, value in simulator.items() if name not in _OF_THE_RUN and not isinstance(value, dict)}
    options |= simulator.get("dynamics", {})
    options |= {name: value for name, value in simulator.get("others", {}).items() if name != "policies"}
    options["stagger_episodes"] = config.get("train", {}).get("stagger_episodes", False)
    conditioning = {name: tuple(ends) for name, ends in simulator.get("conditioning", {}).items()}
    options["conditioning"] = conditioning | given.pop("conditioning", {})
    options["maps"] = maps = maps or pictura._pictura._expand_map_names(simulator["maps"])
    if config.get("policy", {}).get("modality", "perspective") == "perspective":
        options["observation"] = "images"
        if given.get("observation", "images") in ("images", "both"):
            options["rig"] = pictura.Rig.paper(render["width_px"], render["height_px"])
    if num_agents is None and not {"num_worlds", "worlds"} & given.keys():
        maps = [maps] if isinstance(maps, (str, pictura.Map)) else list(maps)
        num_slots = given.pop("num_envs", None) or simulator["num_slots"]
        ends = simulator["min_agents"], simulator["max_agents"]
        options["worlds"] = pictura.draw_worlds(given.get("seed", 0), num_slots, *ends, len(maps))
        options["maps"] = maps[: len(options["worlds"])]  # worlds use maps in turn, so further maps have no world
    else:
        options["num_agents"] = num_agents or simulator["max_agents"]
    return options | given
