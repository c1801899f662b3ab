"""PettingZoo ParallelEnv with all agents of one world."""

from __future__ import annotations

from typing import Any

import numpy as np
from pettingzoo import ParallelEnv

import pictura
from pictura.envs.batch import RENDER_MODES, Batch, checked_render_mode
from pictura.envs.gymnasium_spaces import action_space, observation_space


class DriveParallelEnv(ParallelEnv):
    """Parallel environment of the agents agent_0, agent_1, ... of one world.

    `agents` lists the agents that are present and driving. An infraction terminates an agent. The end of the world's
    episode truncates all remaining agents, and leaving by a road that ends truncates an agent. If agent_3 leaves, the
    next agent in its slot is agent_3_1, then agent_3_2. possible_agents lists only agent_0, agent_1, ... infos have the
    names of pictura.envs.Batch.info(); "active" is whether the agent continues to drive. The simulator runs on the CPU.

    Args:
        maps: One map, as name or pictura.Map.
        num_agents: Number of agents in the world.
        render_mode: None; "rgb_array", the world from above; or "human", a live page in the browser.
        num_threads: Number of CPU threads.
        options: Arguments of pictura.envs.Batch and of pictura.Simulator.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.
        pictura.Error: step() without an action for a live agent.

    Examples:
        >>> from pictura.envs.pettingzoo_env import DriveParallelEnv
        >>> env = DriveParallelEnv("procedural:3", num_agents=4)
        >>> observations, infos = env.reset(seed=1)
        >>> observations, rewards, terminations, truncations, infos = env.step({agent: 7 for agent in env.agents})
        >>> sorted(rewards)
        ['agent_0', 'agent_1', 'agent_2', 'agent_3']
    """

    metadata = {"name": "pictura_drive_v0", "render_modes": RENDER_MODES, "render_fps": 10, "is_parallelizable": True}

    def __init__(
        self,
        maps: Any = "procedural:3",
        num_agents: int = 8,
        *,
        render_mode: str | None = None,
        num_threads: int = 1,
        **options: Any,
    ) -> None:
        self.render_mode = checked_render_mode(render_mode)
        self.batch = Batch(maps, num_agents, 1, num_threads=num_threads, device="cpu", array="numpy", **options)
        self.possible_agents = [f"agent_{i}" for i in range(num_agents)]
        self.agents: list[str] = []
        # One space object for each agent, so that seeding one space does not seed the others.
        self.observation_spaces = {agent: observation_space(self.batch) for agent in self.possible_agents}
        self.action_spaces = {agent: action_space(self.batch) for agent in self.possible_agents}
        self._random = np.random.default_rng(options.get("seed", 0))

    def observation_space(self, agent: str) -> Any:
        return self.observation_spaces[self.possible_agents[self._slot(agent)]]

    def action_space(self, agent: str) -> Any:
        return self.action_spaces[self.possible_agents[self._slot(agent)]]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict, dict]:
        """Starts an episode. Returns (observations, infos), dicts with the live agents' names as keys."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        for _ in range(100):
            self.batch.reset(int(self._random.integers(2**63)))
            active = self.batch.active
            self.agents = [agent for i, agent in enumerate(self.possible_agents) if active[i]]
            if self.agents:
                if self.render_mode == "human":
                    self.batch.show()
                return self._observations(self.agents), self._infos(self.agents)
        raise pictura.Error("reset: no agent found a place in 100 episodes: expected a map or options with more room")

    def step(self, actions: dict[str, Any]) -> tuple[dict, dict, dict, dict, dict]:
        """Advances the world by one step. actions: dict from each live agent's name to its action.

        Returns (observations, rewards, terminations, truncations, infos) of the agents that acted or entered. Raises
        pictura.Error if the action of a live agent is missing or outside its action space.
        """
        acting = self.agents
        missing = [agent for agent in acting if agent not in actions]
        if missing:
            raise pictura.Error(f"step: expected an action of every live agent, got no action of {', '.join(missing)}")
        width = 2 if self.batch.actions == "multi_discrete" else 1
        idle = divmod(pictura.IDLE_ACTION, 3) if width == 2 else pictura.IDLE_ACTION
        slots = {agent: self._slot(agent) for agent in acting}
        told = np.array([idle] * len(self.possible_agents))
        for agent, slot in slots.items():
            action = np.asarray(actions[agent])
            if not self.action_space(agent).contains(action[()]):
                raise pictura.Error(f"step: {agent}: expected an action of {self.action_space(agent)}, got {actions[agent]!r}")
            told[slot] = action
        results = self.batch.step(told)
        rewards = {agent: float(results["reward"][slot]) for agent, slot in slots.items()}
        terminations = {agent: bool(results["terminated"][slot]) for agent, slot in slots.items()}
        truncations = {agent: bool(results["truncated"][slot]) for agent, slot in slots.items()}
        entered = self._entered()
        self.agents = [agent for agent in acting if not terminations[agent] and not truncations[agent]] + entered
        shown = acting + entered
        rewards |= dict.fromkeys(entered, 0.0)
        terminations |= dict.fromkeys(entered, False)
        truncations |= dict.fromkeys(entered, False)
        return self._observations(shown), rewards, terminations, truncations, self._infos(shown)

    def render(self) -> np.ndarray | None:
        return self.batch.draw(0, 0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        self.batch.close()

    def _slot(self, agent: str) -> int:
        return int(agent.split("_")[1])

    def _entered(self) -> list[str]:
        """Returns the agents that entered a road in the last step, in the order of their slots."""
        simulator, state = self.batch.simulator, self.batch._state
        step = int(self.batch.view(simulator.episode_step)[0])
        entered = np.flatnonzero(self.batch.active & (state["life"] > 0) & (state["life_step"] == step))
        return [f"agent_{slot}_{state['life'][slot]}" for slot in entered]

    def _observations(self, agents: list[str]) -> dict[str, Any]:
        seen = self.batch.observe(copy=True)
        if isinstance(seen, dict):
            return {agent: {key: value[self._slot(agent)] for key, value in seen.items()} for agent in agents}
        return {agent: seen[self._slot(agent)] for agent in agents}

    def _infos(self, agents: list[str]) -> dict[str, Any]:
        info = self.batch.info()
        return {agent: {key: value[self._slot(agent)] for key, value in info.items()} for agent in agents}
