"""Gymnasium wrapper with a custom reward for progress and comfort, computed from reward terms of the simulator."""

import gymnasium
import numpy as np

import pictura


class ProgressReward(gymnasium.vector.VectorWrapper):
    """Rewards each metre driven and each goal, and penalizes infractions and harsh driving, with new weights."""

    def __init__(self, env, per_m: float = 0.01, infraction: float = 2.0, comfort: float = 0.5) -> None:
        super().__init__(env)
        self.per_m = per_m
        weights = dict.fromkeys(pictura.REWARD_TERMS, 0.0) | {"goal": 1.0, "comfort": comfort}
        weights |= dict.fromkeys(("collision", "off_road", "stop_line"), infraction)
        self.weights = np.array([weights[name] for name in pictura.REWARD_TERMS], np.float32)

    def step(self, actions):
        seen, _, terminated, truncated, info = self.env.step(actions)
        reward = info["reward_terms"] @ self.weights + self.per_m * info["distance_m"]
        return seen, reward, terminated, truncated, info


def main() -> None:
    envs = ProgressReward(pictura.make_vec("procedural:3", num_agents=16, num_worlds=2))
    envs.reset(seed=1)
    paid = {"accelerating": 0.0, "standing": 0.0}
    for name, action in (("accelerating", 10), ("standing", 7)):
        envs.reset(seed=1)
        for _ in range(50):
            paid[name] += float(envs.step(np.full(envs.num_envs, action))[1].sum())
    print(" ".join(f"{name}: {value:.2f}" for name, value in paid.items()))


if __name__ == "__main__":
    main()
