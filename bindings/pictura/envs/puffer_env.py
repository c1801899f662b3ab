"""Environment with PufferLib 3's interface PufferEnv. It also works without PufferLib."""

from __future__ import annotations

from typing import Any

import numpy as np

import pictura
from pictura.envs.batch import Batch
from pictura.envs.gymnasium_spaces import action_space, observation_space

try:
    from pufferlib import PufferEnv as _Base
except ImportError:

    class _Base:  # type: ignore[no-redef]
        """Base class that allocates buffers as PufferEnv does, for use without PufferLib."""

        def __init__(self, buf: dict[str, Any] | None = None) -> None:
            space, n = self.single_observation_space, self.num_agents
            made = {
                "observations": np.zeros((n, *space.shape), space.dtype),
                "rewards": np.zeros(n, np.float32),
                "terminals": np.zeros(n, bool),
                "truncations": np.zeros(n, bool),
                "masks": np.ones(n, bool),
                "actions": np.zeros((n, *self.single_action_space.shape), np.int32),
            }
            for key, value in (buf or made).items():
                setattr(self, key, value)


class DrivePufferEnv(_Base):
    """Environment of all agents of one or many worlds, which writes its results into PufferLib's buffers.

    PufferLib needs observations in a single Box: the flat observation, or with observation="images" one image per
    camera. `masks` is false for inactive agents.

    Args:
        maps: One or several maps, as names or pictura.Map. World i uses maps[i % len(maps)].
        num_agents: Number of agents in each world.
        num_worlds: Number of worlds: independent copies of the simulation.
        buf: Dict of PufferLib's buffers; None: the environment allocates buffers.
        seed: Seed of all random numbers until a reset with another seed.
        options: Arguments of pictura.envs.Batch and of pictura.Simulator.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.

    Examples:
        >>> from pictura.envs.puffer_env import DrivePufferEnv
        >>> env = DrivePufferEnv("procedural:3", num_agents=8)
        >>> observations, _ = env.reset(seed=1)
        >>> _ = env.step(np.full(8, 7))
        >>> env.rewards.shape, env.masks.dtype
        ((8,), dtype('bool'))
    """

    def __init__(
        self, maps: Any = "procedural:3", num_agents: int = 16, num_worlds: int = 1, buf: Any = None, seed: int = 0, **options: Any
    ) -> None:
        options.setdefault("observation", "flat")
        self.batch = Batch(maps, num_agents, num_worlds, seed=seed, device="cpu", array="numpy", **options)
        space = observation_space(self.batch)
        self._key = None if self.batch.observation == "flat" else "rgb"
        if self._key and self._key not in space.spaces:
            raise pictura.UsageError("rig: PufferLib expects cameras of one image size")
        self.single_observation_space = space if self._key is None else space[self._key]
        self.single_action_space = action_space(self.batch)
        self.num_agents = self.batch.num_slots
        self.render_mode = None
        super().__init__(buf)
        self._before: dict[str, Any] = {}

    @property
    def done(self) -> bool:
        """False, because worlds reset themselves."""
        return False

    def reset(self, seed: int | None = None) -> tuple[np.ndarray, list[dict[str, float]]]:
        """Starts new episodes in all worlds. Returns (the buffer of observations, [])."""
        self.batch.reset(seed)
        self._before = self.batch.simulator.totals()
        self._observe()
        for buffer in (self.rewards, self.terminals, self.truncations):
            buffer[:] = 0
        return self.observations, []

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[dict[str, float]]]:
        """Advances every world by one step. Returns the buffers of observations, rewards, terminals and truncations,
        and a list of logs. The list is empty or has one dict of means over the agents' episodes that ended since the
        last dict."""
        results = self.batch.step(actions)
        self.actions[:] = actions
        self.rewards[:] = results["reward"]
        self.terminals[:] = results["terminated"]
        self.truncations[:] = results["truncated"]
        self._observe()
        infos = [self._log()] if bool(self.terminals.any() or self.truncations.any()) else []
        return self.observations, self.rewards, self.terminals, self.truncations, infos

    def render(self) -> np.ndarray:
        return self.batch.draw()

    def close(self) -> None:
        pass

    def _observe(self) -> None:
        seen = self.batch.observe(copy=False)
        self.observations[:] = seen if self._key is None else seen[self._key]
        self.masks[:] = self.batch.active

    def _log(self) -> dict[str, float]:
        """Returns means over the agents' episodes that ended since the last log, and their number `n`."""
        now, before = self.batch.simulator.totals(), self._before
        finished = now["finished_agent_episodes"] - before["finished_agent_episodes"]
        self._before = now
        names = ("finished_return", "goals_reached", "collisions", "off_road", "red_light", "distance_m")
        return {name: (now[name] - before[name]) / max(finished, 1) for name in names} | {"n": float(finished)}
