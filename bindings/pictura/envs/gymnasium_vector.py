"""Gymnasium vector environment of all agents: each slot of the simulator is one sub-environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

import pictura
from pictura.envs.batch import Batch, refuse_unknown
from pictura.envs.gymnasium_spaces import action_space, observation_space


class DriveVectorEnv(gymnasium.vector.VectorEnv):
    """Vector environment of all agents of all worlds. Each agent has one slot, and each slot is one sub-environment.

    All agents of a world begin their episodes together. When an agent halts, its slot reports `terminated` once. Then
    it reports reward 0 and info["active"] false until the world resets. When an agent leaves by a road that ends, its
    slot reports `truncated` with the agent's last observation. Then the slot is inactive until another agent enters.
    Learn from the transitions where info["valid"] is true. docs/reference/environment.md describes observations,
    actions, rewards, episode ends and infos.

    Args:
        maps: One or several maps, as names or pictura.Map. World i uses maps[i % len(maps)].
        num_agents: Number of agents in each world.
        num_worlds: Number of worlds: independent copies of the simulation.
        num_envs: Number of slots, a multiple of num_agents. Replaces num_worlds.
        autoreset: "next_step": the step after the end of a world's episode begins the next episode, with reward 0.
            "same_step": the step that ends an episode begins the next episode. Then info["final_obs"] and
            info["final_info"] contain the last observations and infos of the slots that ended in this step.
        render_mode: None, or "rgb_array", the first world from above.
        copy: Whether calls return copies. If false, they return views that the next step overwrites.
        options: Arguments of pictura.envs.Batch and of pictura.Simulator.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.
        gymnasium.error.ResetNeeded: step() before the first reset().

    Examples:
        >>> from pictura.envs.gymnasium_vector import DriveVectorEnv
        >>> envs = DriveVectorEnv("procedural:3", num_agents=8, num_worlds=2)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations, rewards, terminated, truncated, infos = envs.step(np.full(envs.num_envs, 7))
        >>> rewards.shape, observations["lanes"].shape, infos["valid"].dtype
        ((16,), (16, 80, 7), dtype('bool'))
    """

    def __init__(
        self,
        maps: Any = "procedural:3",
        num_agents: int = 16,
        num_worlds: int = 1,
        *,
        num_envs: int | None = None,
        autoreset: str = "next_step",
        render_mode: str | None = None,
        copy: bool = True,
        **options: Any,
    ) -> None:
        refuse_unknown(options, DriveVectorEnv.__init__, Batch.__init__)
        modes = {"next_step": AutoresetMode.NEXT_STEP, "same_step": AutoresetMode.SAME_STEP}
        if autoreset not in modes:
            raise pictura.UsageError(f"autoreset: expected one of {', '.join(modes)}; got '{autoreset}'")
        if render_mode not in (None, "rgb_array"):
            raise pictura.UsageError(f"render_mode: expected None or 'rgb_array', got '{render_mode}'")
        if num_envs is not None and options.get("worlds") is None and num_envs != num_agents * num_worlds:
            num_worlds, rest = divmod(num_envs, num_agents)
            if rest or num_worlds < 1:
                raise pictura.UsageError(f"num_envs: expected a multiple of num_agents {num_agents}, got {num_envs}")
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": 10, "autoreset_mode": modes[autoreset]}
        self.render_mode = render_mode
        self._same_step, self._copy = autoreset == "same_step", copy
        self.batch = Batch(maps, num_agents, num_worlds, **options)
        super().reset(seed=options.get("seed"))  # seeds np_random
        self.num_envs = self.batch.num_slots
        self.single_observation_space = observation_space(self.batch)
        self.single_action_space = action_space(self.batch)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._over = self.batch.view(self.batch.simulator.episode_over)
        self._all_slots = self.batch.active
        self._all_slots[:] = True
        self._has_begun = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Starts new episodes in all worlds with `seed`, or with the next seed that this environment draws. Returns
        (observations, infos)."""
        super().reset(seed=seed)
        self._has_begun = True
        self.batch.reset(self._next_seed())
        return self.batch.observe(self._copy), self._info(self._copy)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advances every world by one step. actions: int [slots] in [0, 12), or [slots, 2] with "multi_discrete".
        Actions of inactive slots are ignored. Returns (observations, rewards float32 [slots], terminated bool
        [slots], truncated bool [slots], infos). Raises pictura.Error for other shapes and numbers."""
        if not self._has_begun:
            raise gymnasium.error.ResetNeeded("step: expected reset() before the first step")
        batch = self.batch
        results = batch.step(actions)
        # Copied, since the reset in the same step overwrites the results.
        copy = self._copy or self._same_step
        returned = (results[key] for key in ("reward", "terminated", "truncated"))
        reward, terminated, truncated = map(batch.copied, returned) if copy else returned
        info = self._info(copy)
        ended = terminated | truncated
        if self._same_step and bool(ended.any()):
            final_info = info.copy()
            info["final_obs"], info["_final_obs"] = batch.observe(copy=True), ended
            info["final_info"], info["_final_info"] = final_info, batch.copied(ended)
        if self._same_step and bool(self._over.any()):
            batch.reset(self._next_seed(), batch.copied(self._over))
            info["active"] = batch.active
        return batch.observe(self._copy), reward, terminated, truncated, info

    def render(self) -> np.ndarray | None:
        """Draws the first world from above."""
        return None if self.render_mode is None else self.batch.draw(0, 0)

    def _next_seed(self) -> int:
        return int(self.np_random.integers(2**63))

    def _info(self, copy: bool) -> dict[str, Any]:
        info = self.batch.info(copy)
        all_slots = self.batch.copied(self._all_slots) if copy else self._all_slots
        return info | {f"_{key}": all_slots for key in info}


class AgentStatistics(gymnasium.vector.VectorWrapper):
    """Wrapper that counts agents' events, like pictura.Simulator.totals(), in the dict `statistics`.

    Counting begins at construction. Steps of halted agents are not counted. Counts equal the simulator's totals, and
    sums equal them up to rounding.

    Args:
        env: Environment whose steps are counted.

    Examples:
        >>> from pictura.envs.gymnasium_vector import AgentStatistics
        >>> envs = AgentStatistics(pictura.make_vec("procedural:3", num_agents=8))
        >>> _ = envs.reset(seed=1)
        >>> _ = envs.step(np.full(8, 7))
        >>> envs.statistics["agent_steps"]
        8
    """

    def __init__(self, env: DriveVectorEnv) -> None:
        super().__init__(env)
        names = ("agent_steps", "finished_agent_episodes", *pictura.EVENT_TOTALS)
        self.statistics: dict[str, float] = dict.fromkeys(names, 0) | {"reward": 0.0, "distance_m": 0.0, "finished_return": 0.0}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(actions)
        valid, count = info["valid"], self.statistics
        events = info["events"] * valid
        ended = terminated | truncated
        count["agent_steps"] += int(valid.sum())
        count["finished_agent_episodes"] += int(ended.sum())
        for name, mask in pictura.EVENT_TOTALS.items():
            count[name] += int(((events & mask) != 0).sum())
        count["reward"] += float(reward.sum())
        count["distance_m"] += float(info["distance_m"].sum())
        count["finished_return"] += float(info["episode_return"][ended].sum())
        return observation, reward, terminated, truncated, info
