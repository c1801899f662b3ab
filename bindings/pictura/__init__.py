"""Driving policies that learn by self-play from what a car's cameras see: maps, simulators and renderers for Python.

The package holds the library's objects. Environments are in pictura.envs, and torch modules of policies in
pictura.torch. The function train needs torch. The functions evaluate and probe_* and the class PolicySession use torch
if the package was built for the installed version of torch; else they compute policies on the CPU without torch. The
extension with these functions is loaded on its first use.
"""

import os
import pathlib
from typing import TYPE_CHECKING

from pictura._processor import folder_of_extensions

# GOMP_SPINCOUNT limits how long waiting OpenMP threads of torch spin; without it they spin for milliseconds (reason:
# apps/limit_spinning.cpp). OpenMP reads the variable once, when torch or pictura is first imported.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "2000")

# Python looks for submodules first in the folder of this processor's extensions.
__path__.insert(0, str(folder_of_extensions(pathlib.Path(__file__).parent, pathlib.Path("/proc/cpuinfo").read_text())))

try:
    from pictura import _pictura  # noqa: F401
except ImportError as error:
    # Drawing needs X's client libraries, which wheels must not include.
    if not str(error).startswith("libX"):
        raise
    raise ImportError(f"{error}: install X's client libraries, on Debian and Ubuntu by apt install libxext6 libxrender1") from None

from pictura._pictura import (  # noqa: E402, F401
    AGENT_FIELDS,
    BOX_DTYPE,
    COMMAND_DTYPE,
    CONDITIONING_NAMES,
    EVENT_TOTALS,
    EVENTS,
    HAS_CUDA,
    IDLE_ACTION,
    INFRACTIONS,
    INSERTED_DTYPE,
    LANE_TYPES,
    LIGHT_STATES,
    LINE_TYPES,
    NUM_ACTIONS,
    OBSERVATION_ARRAYS,
    QUERY_DTYPE,
    REWARD_TERMS,
    TRACK_TYPES,
    VIEW_DTYPE,
    Array,
    Camera,
    Controller,
    Error,
    Geometry,
    Images,
    LiveView,
    Map,
    Recorder,
    Renderer,
    Rig,
    Scenario,
    Scene,
    SceneFile,
    SceneRecorder,
    Simulator,
    Snapshot,
    StepResult,
    UsageError,
    __version__,
    draw_worlds,
    known_towns,
    make_views,
    map_folder,
    renderer_names,
    simulator_names,
    write_gallery,
)
from pictura.queries import make_queries  # noqa: F401

if TYPE_CHECKING:
    from pictura._training import (  # noqa: F401
        PolicySession,
        evaluate,
        evaluate_robust,
        evaluate_scenes,
        probe_corner,
        probe_pedestrian,
        probe_removal,
        train,
    )


def __getattr__(name: str):
    if name not in ("PolicySession", "evaluate", "evaluate_robust", "evaluate_scenes", "probe_corner", "probe_pedestrian", "probe_removal", "train"):
        raise AttributeError(f"module 'pictura' has no attribute '{name}'")
    from pictura._load_training import load

    globals()[name] = value = load(name)
    return value


def _vector_env():
    try:
        from pictura.envs.gymnasium_vector import DriveVectorEnv
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{error}: pip install 'pictura[gymnasium]'", name=error.name) from error
    return DriveVectorEnv


def make_vec(maps=None, num_agents: int | None = None, *, preset: str | None = None, **options):
    """Returns a Gymnasium vector environment of all agents of one or many worlds. Each agent has one slot.

    Observations are dicts of arrays [slots, ...], actions int [slots] in [0, 12), rewards float32 [slots].
    docs/reference/environment.md describes observations, actions, rewards and infos.

    Args:
        maps: One or several maps, as names or pictura.Map: "procedural:3", "city:1", "Town01", "mytown.xodr". World i
            uses maps[i % len(maps)]. None: the maps of the preset, else "procedural:3".
        num_agents: Number of agents in each world. None: the preset draws a number for each world; without a preset 16.
        preset: Configuration that gives the world, cameras, observation and reward. "demo": a task that a policy learns
            in minutes on a CPU; "town": the training world of the released policies; "paper": the paper's training
            world. "town" and "paper" need CARLA's towns, or other maps in `maps`.
        options: Arguments of pictura.envs.gymnasium_vector.DriveVectorEnv (num_worlds, num_envs, autoreset, copy, ...),
            of pictura.envs.Batch (observation, actions, device, rig, ...) and of pictura.Simulator (episode_steps,
            conditioning, ...). They override the preset.

    Returns:
        pictura.envs.gymnasium_vector.DriveVectorEnv: The environment. Call reset() before step().

    Raises:
        pictura.UsageError: An option or preset does not exist, or has an invalid value.
        pictura.Error: A map cannot be read (the message names file, line and element), or the device does not exist.

    Examples:
        >>> envs = pictura.make_vec("procedural:3", num_agents=16, num_worlds=4)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations, rewards, terminated, truncated, infos = envs.step(np.full(envs.num_envs, 7))
        >>> rewards.shape, observations["ego"].shape
        ((64,), (64, 9))

        Observations with images of small cameras, for the task of `scripts/demo`:

        >>> envs = pictura.make_vec(preset="demo", num_envs=8)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations["rgb"].shape
        (8, 4, 3, 18, 32)
    """
    DriveVectorEnv = _vector_env()
    if preset is None:
        return DriveVectorEnv("procedural:3" if maps is None else maps, 16 if num_agents is None else num_agents, **options)
    from pictura.presets import preset_options

    return DriveVectorEnv(**preset_options(preset, maps, num_agents, **options))


def make_vec_for(policy, maps="procedural:3", num_agents: int = 16, **options):
    """Returns an environment like make_vec(), with the world, cameras and observation of a policy's training.

    If the policy was trained with decision_steps = n, the caller must repeat each action for n steps.

    Args:
        policy: File name of a policy, or a policy loaded by pictura.torch.load_policy().
        maps: As in make_vec().
        num_agents: Number of agents in each world.
        options: As in make_vec(). They override the options of the policy's training.

    Returns:
        pictura.envs.gymnasium_vector.DriveVectorEnv: The environment. Call reset() before step().

    Raises:
        pictura.UsageError: The policy was not loaded from a file, or an option does not exist.
        pictura.Error: The file cannot be read.

    Examples:
        >>> envs = pictura.make_vec_for("models/perspective.safetensors", "procedural:3", num_agents=4)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations["rgb"].shape
        (4, 4, 3, 54, 96)
    """
    DriveVectorEnv = _vector_env()
    path = policy if isinstance(policy, (str, os.PathLike)) else getattr(policy, "metadata", {}).get("path")
    if path is None:
        raise UsageError("policy: expected a file name, or a policy loaded by pictura.torch.load_policy()")
    session = __getattr__("PolicySession")(os.fspath(path), device="cpu")
    world = session.training_world()
    for of_the_session in ("device", "num_threads", "seed", "stagger_episodes"):
        del world[of_the_session]
    if session.reads_images:
        world |= {"observation": "images", "rig": session.rig}
    return DriveVectorEnv(maps, num_agents, **(world | options))


def _register() -> None:
    import importlib.util

    if importlib.util.find_spec("gymnasium") is None:
        return
    from pictura.envs import register

    register()


_register()
