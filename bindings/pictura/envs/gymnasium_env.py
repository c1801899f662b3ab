"""Gymnasium environment of one agent among others: gymnasium.make("pictura/Drive-v0")."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import pictura
from pictura.envs.batch import RENDER_MODES, Batch, OtherDrivers, checked_render_mode
from pictura.envs.gymnasium_spaces import action_space, observation_space


class DriveEnv(gymnasium.Env):
    """One vehicle of a world among others: gymnasium.make("pictura/Drive-v0").

    An episode ends when the agent's infraction halts it (terminated) or when its world's does (truncated). It runs on
    the CPU.

    Args:
        maps: A name or a pictura.Map.
        num_agents: Agents of the world, the vehicle included.
        others: What drives the others: "lane" keeps lanes, "idle" stands, "random" acts at random; or a policy, a
            function from the observations of all slots, [slots, ...] by name, to actions int32 [slots].
        render_mode: None; "rgb_array", the vehicle's surroundings from above, uint8 [height, width, 3]; or "human", a
            live page in the browser from the first reset on.
        num_threads: Threads of the host; 1, so that processes can be forked.
        options: Those of pictura.envs.Batch, and through it of pictura.Simulator.

    Raises:
        pictura.UsageError: Names the option that there is not, or the value that it cannot have.
        pictura.Error: step() with an action outside of the space; reset() where no vehicle finds a place.

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
        """One step in which the agent does `action` and the others what they do. Returns (observation, reward,
        terminated, truncated, info). Raises pictura.Error for an action outside of the space."""
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
        """Returns the slots that may be the agent of the new episode."""
        return np.flatnonzero(self.batch.active & (self.batch._state["agent_class"] == 0))

    def _observation(self) -> Any:
        seen = self.batch.observe(copy=False)
        if isinstance(seen, dict):
            return {key: value[self._slot].copy() for key, value in seen.items()}
        return seen[self._slot]

    def _info(self) -> dict[str, Any]:
        return {key: value[self._slot] for key, value in self.batch.info().items()}


class LogEnv(DriveEnv):
    """One road user of a recorded scene: gymnasium.make("pictura/Log-v0", scene=...).

    Its goal is where its record ends. Before the first action it is as recorded.

    Args:
        scene: A name as pictura.Scenario.load() takes it, or a pictura.Scenario.
        start_step: Step of the recording at which episodes begin.
        control: Words that pictura.Scenario.mask() takes; the first road user that they name is the agent.
        others: "log", as recorded; or vehicles by the intelligent driver model along their recorded paths, "idm", or
            along lanes, "idm_lanes".
        options: Those of DriveEnv.

    Raises:
        pictura.UsageError: Names the option that there is not, or the value that it cannot have.
        pictura.Error: Names file and field of a scene that cannot be read.

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
