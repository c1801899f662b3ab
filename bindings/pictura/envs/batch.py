"""Common base of all environments: a simulator, its renderer, and the observations, actions and results of slots."""

from __future__ import annotations

import difflib
import inspect
import re
import sys
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

import pictura

OBSERVATIONS = ("vector", "flat", "images", "both")
ACTIONS = ("discrete", "multi_discrete")
# Arrays of the vector observation, in the order of "flat".
VECTOR_KEYS = ("ego", "partners", "lanes", "boundaries", "controls", "walls", "conditioning", "waypoints")
# Action 3 i + k, or (i, k), has the longitudinal jerk LONGITUDINAL_JERKS_MPS3[i] and the lateral jerk
# LATERAL_JERKS_MPS3[k] in m/s^3; left is positive. A test checks these jerks against the simulator.
LONGITUDINAL_JERKS_MPS3, LATERAL_JERKS_MPS3 = (-15.0, -4.0, 0.0, 4.0), (-4.0, 0.0, 4.0)
NUM_LONGITUDINAL, NUM_LATERAL = len(LONGITUDINAL_JERKS_MPS3), len(LATERAL_JERKS_MPS3)
STATUS_ACTIVE = 0
# "human" opens a live page in the browser at the first reset.
RENDER_MODES = ["rgb_array", "human"]


def load_maps(maps: str | pictura.Map | Sequence[str | pictura.Map]) -> list[pictura.Map]:
    """Returns a list of maps from one or several names or pictura.Map. Raises pictura.UsageError for an empty list."""
    if isinstance(maps, (str, pictura.Map)):
        maps = [maps]
    if not isinstance(maps, Sequence) or not maps:
        raise pictura.UsageError(f"maps: expected a name, a pictura.Map or several, got {maps!r}")
    return [pictura.Map.load(each) if isinstance(each, str) else each for each in maps]


def refuse_unknown(options: Mapping[str, Any], *makers: Callable[..., Any]) -> None:
    """Raises pictura.UsageError for an option that neither these functions nor pictura.Simulator have."""
    signature = (pictura.Simulator.__init__.__doc__ or "").split("->")[0]
    known = set(re.findall(r"(\w+): ", signature)) - {"worlds"}
    known = known.union(*(inspect.signature(maker).parameters for maker in makers)) - {"self", "options"}
    for name in options:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            hint = f": did you mean {close[0]}?" if close else ""
            raise pictura.UsageError(f"{name}: no such option{hint}")


class Batch:
    """Simulator whose agents are trained, with a renderer if images are observed. Each agent has one slot.

    Args:
        maps: One or several maps, as names or pictura.Map. World i uses maps[i % len(maps)].
        num_agents: Number of agents in each world.
        num_worlds: Number of worlds: independent copies of the simulation.
        worlds: (index of the map, number of agents, global world) of each world, as pictura.draw_worlds() returns them.
            Replaces num_agents and num_worlds.
        observation: "vector", a dict of entity sets; "flat", the same numbers as one array float32 [slots, n];
            "images", a dict of uint8 rgb, ego, conditioning and waypoints; or "both", "vector" and "images" together.
        actions: "discrete", Discrete(12), or "multi_discrete", MultiDiscrete([longitudinal 4, lateral 3]).
        seed: Seed of all random numbers until a reset with another seed.
        device: "cpu", "cuda" or "cuda:INDEX".
        array: "numpy", or "torch" for tensors over the simulator's memory; None: "numpy" on the CPU, "torch" on CUDA.
        rig: Cameras of the images; None: the paper's four cameras, 96x54 px each.
        renderer: "auto", or one of pictura.renderer_names().
        num_threads: Number of CPU threads; 0: all.
        options: Other arguments of pictura.Simulator, such as episode_steps, parked_cars or conditioning.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.

    Examples:
        >>> from pictura.envs import Batch
        >>> batch = Batch("procedural:3", num_agents=8, num_worlds=2)
        >>> batch.reset(seed=1)
        >>> results = batch.step(np.full(16, pictura.IDLE_ACTION))
        >>> results["reward"].shape, batch.observe()["ego"].shape
        ((16,), (16, 9))
    """

    def __init__(
        self,
        maps: str | pictura.Map | Sequence[str | pictura.Map] = "procedural:3",
        num_agents: int = 16,
        num_worlds: int = 1,
        *,
        worlds: Sequence[tuple[int, int, int]] | None = None,
        observation: str = "vector",
        actions: str = "discrete",
        seed: int = 0,
        device: str = "cpu",
        array: str | None = None,
        rig: pictura.Rig | None = None,
        renderer: str = "auto",
        num_threads: int = 0,
        **options: Any,
    ) -> None:
        refuse_unknown(options, Batch.__init__)
        if observation not in OBSERVATIONS:
            raise pictura.UsageError(f"observation: expected one of {', '.join(OBSERVATIONS)}; got '{observation}'")
        if actions not in ACTIONS:
            raise pictura.UsageError(f"actions: expected one of {', '.join(ACTIONS)}; got '{actions}'")
        array = array or ("numpy" if device == "cpu" else "torch")
        if array not in ("numpy", "torch") or (array == "numpy" and device != "cpu"):
            raise pictura.UsageError(f"array: expected 'numpy' (only on the CPU) or 'torch', got '{array}' on {device}")
        if num_agents < 1 or num_worlds < 1:
            raise pictura.UsageError(f"expected at least 1 agent and 1 world, got {num_agents} and {num_worlds}")
        loaded = load_maps(maps)
        if observation == "images":
            options.setdefault("vector_observations", False)
        self.observation, self.actions, self.array = observation, actions, array
        if worlds is None:
            worlds = [(world % len(loaded), num_agents, world) for world in range(num_worlds)]
        self.simulator = pictura.Simulator(
            loaded,
            worlds,
            device=device,
            seed=seed,
            num_threads=num_threads,
            **options,
        )
        self.num_slots = self.simulator.num_slots
        self.num_worlds, self.num_agents = len(worlds), num_agents
        self.live: pictura.LiveView | None = None
        self.renderer, self._images = None, None
        if observation in ("images", "both"):
            self.renderer = pictura.Renderer(renderer, rig, device=device, num_threads=num_threads, stream=options.get("stream"))
            for handle, geometry in self.simulator.geometries.items():
                self.renderer.upload(handle, geometry)
            self._images = self.renderer.make_images(self.num_slots)
            blocks = self._images.blocks
            self._image_views = {"rgb" if len(blocks) == 1 else f"rgb_{i}": self.view(b) for i, b in enumerate(blocks)}
        self._own = {key: self.view(array_) for key, array_ in self.simulator.observations.items()}
        self._state = {key: self.view(array_) for key, array_ in self.simulator.state.items()}
        self._flat_keys = [key for key in VECTOR_KEYS if key in self._own]
        self._result_views: dict[str, Any] = {}
        if array == "torch":
            import torch

            self._torch = torch
            self._action_memory = torch.full(
                (self.num_slots,), pictura.IDLE_ACTION, dtype=torch.int32, device=self._own["ego"].device
            )
        else:
            self._action_memory = np.full(self.num_slots, pictura.IDLE_ACTION, np.int32)

    def view(self, lent: pictura.Array) -> Any:
        """Returns a NumPy array or torch tensor that shares memory with an array of the library."""
        if self.array == "numpy":
            return lent.numpy()
        return self._torch_of(lent)

    @staticmethod
    def _torch_of(lent: pictura.Array) -> Any:
        import torch

        return torch.from_dlpack(lent)

    # Observations

    def observe(self, copy: bool = True) -> Any:
        """Returns the current observation of every slot: an array or a dict of arrays [slots, ...].

        Without `copy` the arrays are views of the simulator's memory. "flat" is always a copy.
        """
        if self.observation == "flat":
            rows = [self._own[key].reshape(self.num_slots, -1) for key in self._flat_keys]
            return np.concatenate(rows, axis=1) if self.array == "numpy" else self._torch.cat(rows, dim=1)
        seen = {}
        if self.observation in ("vector", "both"):
            seen.update(self._own)
        else:
            seen.update({key: self._own[key] for key in ("ego", "conditioning", "waypoints")})
        if self.renderer is not None:
            self.renderer.render(self.simulator.scene, self.simulator.views, self._images)
            seen.update(self._image_views)
        return {key: self.copied(value) for key, value in seen.items()} if copy else seen

    def shapes(self) -> dict[str, tuple[tuple[int, ...], str]] | tuple[tuple[int, ...], str]:
        """Returns (shape, NumPy's name of the type) of each array of one slot's observation; a single pair for
        "flat"."""
        if self.observation == "flat":
            return (sum(int(np.prod(self._own[key].shape[1:])) for key in self._flat_keys),), "float32"
        keys = self._own if self.observation in ("vector", "both") else ("ego", "conditioning", "waypoints")
        shapes = {key: (tuple(self._own[key].shape[1:]), "int32" if key == "set_counts" else "float32") for key in keys}
        for key, value in getattr(self, "_image_views", {}).items():
            shapes[key] = (tuple(value.shape[1:]), "uint8")
        return shapes

    def copied(self, value: Any) -> Any:
        return value.copy() if self.array == "numpy" else value.clone()

    # Actions

    def action_indices(self, actions: Any) -> Any:
        """Converts a user's actions to int32 [slots] in [0, 12). Raises pictura.Error for other shapes and for numbers
        that are not integers."""
        library = self._torch if self.array == "torch" else np
        if self.array == "torch":
            if not isinstance(actions, library.Tensor):
                actions = library.as_tensor(np.asarray(actions), device=self._action_memory.device)
            is_integer = not (actions.dtype.is_floating_point or actions.dtype.is_complex or actions.dtype == library.bool)
        else:
            actions = np.asarray(actions)
            is_integer = actions.dtype.kind in "iu"
        if not is_integer:
            raise pictura.Error(f"actions: expected integers, got {actions.dtype}")
        shape = (self.num_slots,) if self.actions == "discrete" else (self.num_slots, 2)
        if tuple(actions.shape) != shape:
            raise pictura.Error(f"actions: expected {list(shape)}, got {list(actions.shape)}")
        if self.actions == "multi_discrete":
            longitudinal, lateral = actions[:, 0], actions[:, 1]
            fits = (longitudinal >= 0) & (longitudinal < NUM_LONGITUDINAL) & (lateral >= 0) & (lateral < NUM_LATERAL)
            if self.array == "numpy" and not fits.all():
                raise pictura.Error("actions: expected [longitudinal in [0, 4), lateral in [0, 3)]")
            # On CUDA -1 marks invalid actions. The simulator reports them later, so the host does not wait here.
            actions = library.where(fits, longitudinal * NUM_LATERAL + lateral, -1)
        elif actions.dtype.itemsize > 4:  # conversion to int32 must not wrap other values into the range
            whole = actions.long() if self.array == "torch" else actions.astype(np.int64, copy=False)
            actions = whole.clip(-(2**31), 2**31 - 1)
        self._action_memory[:] = actions
        return self._action_memory

    # Steps

    def reset(self, seed: int | None = None, world_mask: Any = None) -> None:
        """Starts new episodes in all worlds, or in the worlds of the mask. seed: None: the simulator's seed."""
        self.simulator.reset(world_mask, seed)

    def step(self, actions: Any) -> dict[str, Any]:
        """Advances the simulator by one step. Returns a dict of its results, as views that the next step overwrites."""
        result = self.simulator.step(self.action_indices(actions))
        return self.results(result)

    def results(self, result: pictura.StepResult) -> dict[str, Any]:
        if not self._result_views:
            names = ("reward", "terminated", "truncated", "valid", "refusal", "reward_terms", "distance_m")
            self._result_views = {name: self.view(getattr(result, name)) for name in names}
        return self._result_views

    @property
    def active(self) -> Any:
        """bool [slots]: whether the agent is driving. Actions of other agents (halted or absent) are ignored."""
        return self._state["status"] == STATUS_ACTIVE

    def info(self, copy: bool = True) -> dict[str, Any]:
        """Returns a dict of the infos of every slot after a step. docs/reference/environment.md lists them.

        Without `copy` the arrays except "active" are views of the simulator's memory.
        """
        results = self._result_views
        names = ("events", "halt_reason", "goals_reached", "waypoints_reached", "episode_return", "agent_class")
        info = {name: self._state[name] for name in names}
        info |= {name: results[name] for name in ("valid", "reward_terms", "distance_m") if name in results}
        if copy:
            info = {name: self.copied(value) for name, value in info.items()}
        return {"active": self.active} | info

    def draw(self, world: int = 0, agent: int = 0, width_px: int = 640, height_px: int = 480) -> np.ndarray:
        """Draws an agent's surroundings from above, uint8 [height, width, 3]. The simulator must be on the CPU."""
        return self.simulator.draw(world, agent, width_px=width_px, height_px=height_px)

    def show(self, agent: int = 0) -> None:
        """Opens a live page of the only world in the browser, and prints its address to stderr.

        While the page is open, steps run in real time. The simulator must be on the CPU.
        """
        if self.live is None:
            rig = self.renderer.rig if self.renderer is not None else None
            self.live = pictura.LiveView(self.simulator, follow=agent, rig=rig, wait_for_page=False)
            print(f"showing {self.live.address}", file=sys.stderr)
            webbrowser.open(self.live.address)

    def close(self) -> None:
        """Closes the page that show() opened."""
        if self.live is not None:
            self.live.close()
            self.live = None


def checked_render_mode(mode: str | None) -> str | None:
    """Raises pictura.UsageError for a render mode that single-world environments do not support."""
    if mode not in (None, *RENDER_MODES):
        raise pictura.UsageError(f"render_mode: expected None, {' or '.join(map(repr, RENDER_MODES))}, got {mode!r}")
    return mode


class OtherDrivers:
    """Driver of the agents that the user does not control: a controller, its name, or a function.

    The function takes the dict of the observations of all slots, and returns actions int32 [slots].
    """

    def __init__(self, who: str | pictura.Controller | Callable[[Mapping[str, Any]], Any], batch: Batch, seed: int) -> None:
        self._batch = batch
        self._policy = who if callable(who) else None
        self._controller = pictura.Controller(who, batch.simulator, seed) if isinstance(who, str) else who

    def step(self, slot: int, action: int) -> dict[str, Any]:
        """Advances the simulator by one step. The agent of `slot` executes `action`; the driver controls the others."""
        batch = self._batch
        if self._policy is not None:
            told = np.asarray(self._policy(batch.observe(copy=False)))
            if told.dtype.kind not in "iu":
                raise pictura.Error(f"others: expected integers from the function, got {told.dtype}")
            actions = told.astype(np.int32)
            actions[slot] = action
            return batch.results(batch.simulator.step(actions))
        commands = self._controller.act(batch.simulator)
        commands["kind"][slot] = 0
        commands["action"][slot] = action
        return batch.results(batch.simulator.step_commands(commands))
