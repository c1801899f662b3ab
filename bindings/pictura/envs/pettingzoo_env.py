"""PettingZoo ParallelEnv of the agents of one world."""

from __future__ import annotations

from typing import Any

import numpy as np
from pettingzoo import ParallelEnv

import pictura
from pictura.envs.batch import RENDER_MODES, Batch, checked_render_mode
from pictura.envs.gymnasium_spaces import action_space, observation_space


class DriveParallelEnv(ParallelEnv):
    """agent_0, agent_1, ...: those that found a place and still drive are `agents`. An infraction terminates an agent,
    the end of the world's episode truncates all that are left, and so does leaving a road that ends. An agent that
    enters such a road instead of agent_3 is agent_3_1, the next one agent_3_2; possible_agents has the first ones
    alone. infos have what pictura.envs.Batch.info() lists; "active" is whether the agent goes on. It runs on the CPU.

    Args:
        maps: A name or a pictura.Map.
        num_agents: Agents of the world.
        render_mode: None; "rgb_array", from above; or "human", a live page in the browser.
        num_threads: Threads of the host.
        options: Those of pictura.envs.Batch, and through it of pictura.Simulator.

    Raises:
        pictura.UsageError: Names the option that there is not, or the value that it cannot have.
        pictura.Error: step() without an action of a live agent.

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
        """Starts an episode. Returns (observations, infos) of the live agents by name."""
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
        """One step. actions: one of every live agent by name. Returns (observations, rewards, terminations,
        truncations, infos) of the agents that acted, and of those that entered. Raises pictura.Error where an agent has
        no action."""
        acting = self.agents
        missing = [agent for agent in acting if agent not in actions]
        if missing:
            raise pictura.Error(f"step: expected an action of every live agent, got no action of {', '.join(missing)}")
        width = 2 if self.batch.actions == "multi_discrete" else 1
        idle = divmod(pictura.IDLE_ACTION, 3) if width == 2 else pictura.IDLE_ACTION
        slots = {agent: self._slot(agent) for agent in acting}
        told = np.array([idle] * len(self.possible_agents))
        for agent, slot in slots.items():
            told[slot] = actions[agent]
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
