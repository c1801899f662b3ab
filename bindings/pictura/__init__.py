"""Driving policies that learn by self-play from what a car's cameras see: maps, simulators and renderers for Python.

The package holds the library's objects; environments are in pictura.envs, policies as torch modules in pictura.torch.
train needs torch. evaluate, the probes and PolicySession use torch if the package was built for the installed version,
else they compute policies on the CPU without it. They are loaded on first use.
"""

import os
import pathlib
from typing import TYPE_CHECKING

from pictura._processor import folder_of_extensions

# Waiting threads of torch's loops spin for milliseconds unless this variable limits it; see apps/limit_spinning.cpp for
# the reason. The variable is read once, when the first of pictura and torch is imported.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "2000")

# Submodules are looked for there first.
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


def make_vec(maps=None, num_agents: int | None = None, *, preset: str | None = None, **options):
    """Returns Gymnasium's vector environment of all agents: one slot an agent, of one or many worlds.

    Observations are dicts of arrays [slots, ...], actions int [slots] in [0, 12), rewards float32 [slots].
    docs/reference/environment.md describes all of them, and the infos.

    Args:
        maps: Names or pictura.Map, one or several, taken in turn by the worlds: "procedural:3", "city:1", "Town01",
            "mytown.xodr". None: those of the preset, else "procedural:3".
        num_agents: Agents of each world. None: as the preset draws them, else 16.
        preset: World, cameras, observation and reward of a configuration: "demo", a task that a CPU learns in minutes;
            "town", the recipe of the released agents; "paper", the paper's training world. The last two need CARLA's
            towns, or other maps.
        options: Those of pictura.envs.gymnasium_vector.DriveVectorEnv (num_worlds, num_envs, autoreset, copy, ...), of
            pictura.envs.Batch (observation, actions, device, rig, ...) and of pictura.Simulator (episode_steps,
            conditioning, ...). They count instead of the preset's.

    Returns:
        pictura.envs.gymnasium_vector.DriveVectorEnv: It is at the start of no episode: call reset() first.

    Raises:
        pictura.UsageError: Names the option or the preset that there is not, and values that cannot be.
        pictura.Error: Names file, line and element of a map that cannot be read; or there is no such device.

    Examples:
        >>> envs = pictura.make_vec("procedural:3", num_agents=16, num_worlds=4)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations, rewards, terminated, truncated, infos = envs.step(np.full(envs.num_envs, 7))
        >>> rewards.shape, observations["ego"].shape
        ((64,), (64, 9))

        Images of small cameras on the task of `scripts/demo`:

        >>> envs = pictura.make_vec(preset="demo", num_envs=8)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations["rgb"].shape
        (8, 4, 3, 18, 32)
    """
    from pictura.envs.gymnasium_vector import DriveVectorEnv

    if preset is None:
        return DriveVectorEnv("procedural:3" if maps is None else maps, 16 if num_agents is None else num_agents, **options)
    from pictura.presets import preset_options

    return DriveVectorEnv(**preset_options(preset, maps, num_agents, **options))


def make_vec_for(policy, maps="procedural:3", num_agents: int = 16, **options):
    """Returns make_vec()'s environment with the world, cameras and observation that a policy was trained with.

    A policy of decision_steps n expects its actions to be held for n steps.

    Args:
        policy: The name of a file, or what pictura.torch.load_policy() read.
        maps: As in make_vec().
        num_agents: Agents of each world.
        options: As in make_vec(); they count instead of the policy's.

    Returns:
        pictura.envs.gymnasium_vector.DriveVectorEnv: At the start of no episode.

    Raises:
        pictura.UsageError: The policy is of no file, or there is no such option.
        pictura.Error: Names the file that cannot be read.

    Examples:
        >>> envs = pictura.make_vec_for("models/perspective.safetensors", "procedural:3", num_agents=4)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations["rgb"].shape
        (4, 4, 3, 18, 32)
    """
    from pictura.envs.gymnasium_vector import DriveVectorEnv

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
