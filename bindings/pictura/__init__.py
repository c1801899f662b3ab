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

from pictura._pictura import (  # noqa: E402, F401
    AGENT_FIELDS,
    BOX_DTYPE,
    COMMAND_DTYPE,
    CONDITIONING_NAMES,
    EVENT_TOTALS,
    EVENTS,
    HAS_CUDA,
    IDLE_ACTION,
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


def make_vec(maps="procedural:3", num_agents: int = 16, **options):
    """Returns Gymnasium's vector environment of all agents; see pictura.envs.gymnasium_vector.DriveVectorEnv."""
    from pictura.envs.gymnasium_vector import DriveVectorEnv

    return DriveVectorEnv(maps, num_agents, **options)


def make_vec_for(policy, maps="procedural:3", num_agents: int = 16, **options):
    """Returns make_vec()'s environment with the world, cameras and observation of a policy's training.

    policy: a file, or the result of pictura.torch.load_policy(). options: replace settings of the policy's training. A
    policy of decision_steps n expects its actions to be held for n steps.
    Raises pictura.UsageError for a policy without a file.
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
