"""Gymnasium environments that control one agent among others: pictura/Drive-v0 and pictura/Log-v0."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import pictura
from pictura.envs.batch import RENDER_MODES, Batch, OtherDrivers, checked_render_mode
from pictura.envs.gymnasium_spaces import action_space, observation_space


class DriveEnv(gymnasium.Env):
    """Environment that controls one vehicle among other agents: gymnasium.make("pictura/Drive-v0").

    The episode is terminated when an infraction halts the vehicle. It is truncated when the world's episode ends. The
    simulator runs on the CPU.

    Args:
        maps: One map, as name or pictura.Map.
        num_agents: Number of agents in the world, including the vehicle.
        others: Driver of the other agents: "lane" follows lanes, "idle" always takes the idle action, "random" takes
            random actions. Or a function that maps the observations of all slots, a dict of arrays [slots, ...], to
            actions int32 [slots].
        render_mode: None; "rgb_array", the vehicle's surroundings from above, uint8 [height, width, 3]; or "human", a
            live page in the browser, which the first reset opens.
        num_threads: Number of CPU threads. With the default 1, processes can be forked.
        options: Arguments of pictura.envs.Batch and of pictura.Simulator.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.
        pictura.Error: step() with an action outside the action space; reset() if no vehicle finds a place.

    Examples:
        >>> import gymnasium
        >>> env = gymnasium.make("pictura/Drive-v0", others="lane", observation="flat")
        >>> observation, info = env.reset(seed=1)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        >>> bool(info["active"]) != terminated
        True
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": 10}

    def __init__(
        self,
        maps: Any = "procedural:3",
        num_agents: int = 16,
        *,
        others: str | Callable[[Any], Any] = "lane",
        render_mode: str | None = None,
        num_threads: int = 1,
        **options: Any,
    ) -> None:
        self.render_mode = checked_render_mode(render_mode)
        self.batch = Batch(maps, num_agents, 1, num_threads=num_threads, device="cpu", array="numpy", **options)
        self.observation_space = observation_space(self.batch)
        self.action_space = action_space(self.batch)
        super().reset(seed=options.get("seed"))  # seeds np_random
        self._others = OtherDrivers(others, self.batch, options.get("seed", 0))
        self._slot = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Starts an episode. Returns (observation, info)."""
        super().reset(seed=seed)
        for _ in range(100):
            self.batch.reset(int(self.np_random.integers(2**63)))
            drivers = self._drivers()
            if len(drivers):
                self._slot = int(drivers[0])
                if self.render_mode == "human":
                    self.batch.show(self._slot)
                return self._observation(), self._info()
        raise pictura.Error("reset: no vehicle found a place in 100 episodes: expected a map or options with more room")

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advances the world by one step with `action` of the agent. Returns (observation, reward, terminated,
        truncated, info). Raises pictura.Error for an action outside the action space."""
        if not self.action_space.contains(action):
            raise pictura.Error(f"step: expected an action of {self.action_space}, got {action!r}")
        if self.batch.actions == "multi_discrete":
            action = 3 * int(action[0]) + int(action[1])
        results = self._others.step(self._slot, int(action))
        terminated, truncated = bool(results["terminated"][self._slot]), bool(results["truncated"][self._slot])
        return self._observation(), float(results["reward"][self._slot]), terminated, truncated, self._info()

    def render(self) -> np.ndarray | None:
        return self.batch.draw(0, self._slot) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        self.batch.close()

    def _drivers(self) -> np.ndarray:
        """Returns the slots from which the controlled agent of the new episode is chosen."""
        return np.flatnonzero(self.batch.active & (self.batch._state["agent_class"] == 0))

    def _observation(self) -> Any:
        seen = self.batch.observe(copy=False)
        if isinstance(seen, dict):
            return {key: value[self._slot].copy() for key, value in seen.items()}
        return seen[self._slot]

    def _info(self) -> dict[str, Any]:
        return {key: value[self._slot] for key, value in self.batch.info().items()}


class LogEnv(DriveEnv):
    """Environment that controls one road user of a recorded scene: gymnasium.make("pictura/Log-v0", scene=...).

    The road user's goal is the end of its recorded track. Until the first action, its state is the recorded state.

    Args:
        scene: A name for pictura.Scenario.load(), or a pictura.Scenario.
        start_step: Step of the recording at which episodes begin.
        control: Words for pictura.Scenario.mask(). The first road user that they select is controlled.
        others: "log": other road users follow their recorded tracks. "idm": other vehicles follow the intelligent
            driver model along their recorded paths; "idm_lanes": along lanes.
        options: Arguments of DriveEnv.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.
        pictura.Error: The scene cannot be read; the message names file and field.

    Examples:
        >>> import gymnasium
        >>> env = gymnasium.make("pictura/Log-v0", scene="drive.scenario", start_step=0, control="vehicles")
        >>> observation, info = env.reset(seed=1)
        >>> observation["ego"].shape
        (9,)
    """

    def __init__(
        self,
        scene: str | pictura.Scenario,
        *,
        start_step: int = 10,
        control: str = "self",
        others: str = "log",
        **options: Any,
    ) -> None:
        if others not in ("log", "idm", "idm_lanes"):
            raise pictura.UsageError(f"others: expected 'log', 'idm' or 'idm_lanes', got '{others}'")
        scene = pictura.Scenario.load(scene, start_step=start_step) if isinstance(scene, str) else scene.starting_at(start_step)
        self._tracks = np.flatnonzero(scene.mask(control))
        super().__init__(scene, scene.num_tracks, others="log", **scene.world(**options))
        if others != "log":
            simulator = self.batch.simulator
            log, idm = pictura.Controller("log", simulator), pictura.Controller(others, simulator)
            vehicles = (scene.tracks()["type"] == pictura.TRACK_TYPES.index("vehicle")) & scene.mask("all").astype(bool)
            self._others = OtherDrivers(pictura.Controller.shared([(log, None), (idm, vehicles)], simulator), self.batch, 0)

    def _drivers(self) -> np.ndarray:
        return self._tracks
