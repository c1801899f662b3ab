"""TorchRL environment: a batch of worlds, each with the same number of agents in the group "agents"."""

from __future__ import annotations

from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Bounded, Categorical, Composite, MultiCategorical, Unbounded
from torchrl.envs import EnvBase

from pictura.envs.batch import Batch


class DriveTorchRLEnv(EnvBase):
    """Batched environment with batch_size [worlds] and the agents of each world in the group "agents".

    ("agents", "observation", ...), ("agents", "action"), ("agents", "reward") and ("agents", "mask") have the shape
    [worlds, agents, ...]. The mask is false for halted and absent agents. done, terminated and truncated of worlds are
    [worlds, 1]. ("agents", "terminated") is true in the step in which an infraction halts the agent. ("agents",
    "truncated") is true in the step in which the world's episode ends or the agent leaves by a road that ends; the
    agent's observation is then its last one. reset() takes "_reset" [worlds]. On CUDA no data is copied to the host.

    Args:
        maps: One or several maps, as names or pictura.Map. World i uses maps[i % len(maps)].
        num_agents: Number of agents in each world.
        num_worlds: Number of worlds, the batch size.
        device: "cpu", "cuda" or "cuda:INDEX".
        options: Arguments of pictura.envs.Batch and of pictura.Simulator.

    Raises:
        pictura.UsageError: An option does not exist or has an invalid value.

    Examples:
        >>> from pictura.envs.torchrl_env import DriveTorchRLEnv       # doctest: +SKIP
        >>> env = DriveTorchRLEnv("procedural:3", num_agents=4, num_worlds=2)   # doctest: +SKIP
        >>> env.rollout(10)["next", "agents", "reward"].shape          # doctest: +SKIP
        torch.Size([2, 10, 4, 1])
    """

    def __init__(
        self, maps: Any = "procedural:3", num_agents: int = 8, num_worlds: int = 4, *, device: str = "cpu", **options: Any
    ) -> None:
        self.batch = Batch(maps, num_agents, num_worlds, device=device, array="torch", **options)
        super().__init__(device=torch.device(device), batch_size=torch.Size([num_worlds]))
        self._shape = (num_worlds, num_agents)
        self._over = self.batch.view(self.batch.simulator.episode_over)
        self._random = torch.Generator().manual_seed(options.get("seed", 0))
        self._make_specs()

    def _make_specs(self) -> None:
        types = {"float32": torch.float32, "int32": torch.int32}

        def spec(shape: tuple[int, ...], dtype: str) -> Any:
            whole = (*self._shape, *shape)
            if dtype == "uint8":
                return Bounded(0, 255, whole, dtype=torch.uint8, device=self.device)
            return Unbounded(whole, dtype=types[dtype], device=self.device)

        shapes = self.batch.shapes()
        if isinstance(shapes, dict):
            observation = Composite({key: spec(*shape) for key, shape in shapes.items()}, shape=self._shape)
        else:
            observation = spec(*shapes)
        flag = lambda shape: Categorical(2, shape=shape, dtype=torch.bool, device=self.device)  # noqa: E731
        agents = Composite(
            {"observation": observation, "mask": flag(self._shape)}
            | {end: flag((*self._shape, 1)) for end in self._agent_ends},
            shape=self._shape,
        )
        self.observation_spec = Composite({"agents": agents}, shape=self.batch_size)
        if self.batch.actions == "discrete":
            action = Categorical(12, shape=self._shape, dtype=torch.int64, device=self.device)
        else:
            action = MultiCategorical([4, 3], shape=(*self._shape, 2), dtype=torch.int64, device=self.device)
        self.action_spec = Composite({"agents": Composite({"action": action}, shape=self._shape)}, shape=self.batch_size)
        reward = Unbounded((*self._shape, 1), dtype=torch.float32, device=self.device)
        self.reward_spec = Composite({"agents": Composite({"reward": reward}, shape=self._shape)}, shape=self.batch_size)
        ends = (*self.batch_size, 1)
        self.done_spec = Composite(
            {"done": flag(ends), "terminated": flag(ends), "truncated": flag(ends)}, shape=self.batch_size
        )

    def _agents(self, results: dict[str, Any] | None = None) -> TensorDict:
        split = lambda value: value.reshape(*self._shape, *value.shape[1:])  # noqa: E731
        seen = self.batch.observe(copy=True)
        if isinstance(seen, dict):
            seen = TensorDict({key: split(value) for key, value in seen.items()}, self._shape, device=self.device)
        else:
            seen = split(seen)
        none_ended = torch.zeros(*self._shape, 1, dtype=torch.bool, device=self.device)
        ends = {end: split(results[end]).unsqueeze(-1).clone() if results else none_ended.clone() for end in self._agent_ends}
        return TensorDict({"observation": seen, "mask": split(self.batch.active)} | ends, self._shape, device=self.device)

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        mask = None if tensordict is None else tensordict.get("_reset", None)
        if mask is not None:
            mask = mask.reshape(self.batch_size).contiguous()
        seed = int(torch.randint(2**62, (), generator=self._random))
        self.batch.reset(seed, mask)
        ends = {key: torch.zeros(*self.batch_size, 1, dtype=torch.bool, device=self.device) for key in self._ends}
        return TensorDict({"agents": self._agents(), **ends}, self.batch_size, device=self.device)

    _ends = ("done", "terminated", "truncated")
    _agent_ends = ("terminated", "truncated")

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        actions = tensordict["agents", "action"].flatten(0, 1)
        results = self.batch.step(actions)
        agents = self._agents(results)
        agents["reward"] = results["reward"].reshape(*self._shape, 1).clone()
        over = self._over.reshape(*self.batch_size, 1).clone()
        # A world's episode ends after episode_steps steps, or because too many agents have halted. In both cases the
        # agents that still drive are truncated.
        ends = {"done": over, "terminated": torch.zeros_like(over), "truncated": over.clone()}
        return TensorDict({"agents": agents, **ends}, self.batch_size, device=self.device)

    def _set_seed(self, seed: int | None) -> None:
        self._random = torch.Generator().manual_seed(0 if seed is None else seed)
