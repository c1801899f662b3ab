"""PPO in one file, in the style of CleanRL, on all agents of many worlds.

Minutes on a CPU:    python examples/ppo.py
A GPU, with images:  python examples/ppo.py --device cuda --observation images --num-envs 2720 --total-timesteps 50000000

It prints the mean return of agents whose episodes ended in the last ten updates, and goals, waypoints and infractions
per 1,000 agent-steps. It writes progress.csv, config.toml and policy.pt into the folder --out. `pictura plot runs/ppo_1
runs/ppo_2` draws curves of such folders.

Observations, rewards and actions stay in the simulator's memory. The tensors in this file are views of this memory;
only the rollout's storage is a copy. Steps of halted agents are stored, because arrays are rectangular, but they are
masked out of every loss.
"""

import argparse
import collections
import csv
import json
import pathlib
import time

import pictura  # before torch: torch's waiting threads then spin less, which on a busy machine quadruples the rate

import gymnasium
import torch
from torch import nn

from pictura.torch import Policy

SETTINGS = {
    "modality": "vector", "embedding_width": 64, "point_features": True, "backbone_layers": 2, "backbone_width": 256,
    "patch_px": 4, "conv_channels": [64, 64, 128], "conv_kernels": [1, 3, 3], "conv_strides": [1, 2, 1],
    "num_queries": 4, "attention_heads": 4, "attention_mlp": 0,
}  # fmt: skip


def parse_args() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", choices=["demo", "town", "paper", "none"], default="demo")
    parser.add_argument("--maps", nargs="+", help="maps instead of the preset's maps")
    parser.add_argument("--num-envs", type=int, default=32, help="total number of agents; the preset draws sizes of worlds")
    parser.add_argument("--num-agents", type=int, help="agents in each world; then --num-worlds replaces --num-envs")
    parser.add_argument("--num-worlds", type=int, default=4)
    parser.add_argument("--observation", choices=["vector", "images"], default="vector")
    parser.add_argument("--image-size", type=int, nargs=2, default=[32, 18], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--total-timesteps", type=int, default=120_000, help="total number of steps of all slots")
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--num-steps", type=int, default=64)
    parser.add_argument("--gamma", type=float, default=0.98)
    parser.add_argument("--gae-lambda", type=float, default=0.95)
    parser.add_argument("--num-minibatches", type=int, default=4)
    parser.add_argument("--update-epochs", type=int, default=4)
    parser.add_argument("--clip-coef", type=float, default=0.2)
    parser.add_argument("--ent-coef", type=float, default=0.002)
    parser.add_argument("--vf-coef", type=float, default=0.5)
    parser.add_argument("--max-grad-norm", type=float, default=0.5)
    parser.add_argument("--out", default="runs/ppo", help="folder for the files that it writes; '' for none")
    parser.add_argument("--json", action="store_true", help="print only the last update, as JSON")
    return parser.parse_args()


def make_envs(args: argparse.Namespace) -> gymnasium.vector.VectorEnv:
    options = {"preset": args.preset} if args.preset != "none" else {}
    if args.num_agents or args.preset == "none":
        options |= {"num_agents": args.num_agents or 16, "num_worlds": args.num_worlds}
    else:
        options["num_envs"] = args.num_envs
    if args.observation == "images":
        options["rig"] = pictura.Rig.paper(*args.image_size)
    return pictura.make_vec(
        args.maps, observation=args.observation, device=args.device, array="torch", seed=args.seed, copy=False, **options
    )


def measured(before: dict, now: dict, recent: collections.deque) -> dict[str, float]:
    """Returns statistics of the steps between two totals of a simulator, with the names that `pictura train` uses."""
    since = {name: now[name] - before[name] for name in now if name != "reward_terms"}
    recent.append((since["finished_return"], since["finished_agent_episodes"]))
    returns, finished = map(sum, zip(*recent))
    steps = max(since["agent_steps"], 1)
    events = ("goals_reached", "waypoints_reached", "at_fault_collisions", "collisions", "off_road", "red_light")
    counts = {f"driving/{name.removesuffix('_reached')}_per_1000_steps": 1000 * since[name] / steps for name in events}
    speed = since["distance_m"] / (0.1 * steps)
    return {"charts/episode_return": returns / max(finished, 1), **counts, "driving/mean_speed_mps": speed}


def write_config(folder: pathlib.Path, args: argparse.Namespace) -> None:
    """Writes the arguments as TOML. `pictura plot` reads them to find runs that differ only in their seeds."""
    settings = {name: value for name, value in vars(args).items() if name not in ("seed", "out", "json") and value is not None}
    lines = [f"{name} = {json.dumps(value)}" for name, value in settings.items()]
    (folder / "config.toml").write_text("\n".join([f"[run]\nseed = {args.seed}\n\n[ppo]", *lines]) + "\n")


def main() -> None:
    args = parse_args()
    torch.manual_seed(args.seed)
    torch.set_float32_matmul_precision("high")  # TF32 on CUDA
    sees_images = args.observation == "images"
    envs = make_envs(args)
    simulator = envs.batch.simulator
    device, n = torch.device(args.device), envs.num_envs
    agent = Policy(SETTINGS | {"modality": "perspective" if sees_images else "vector"}, num_cameras=4 if sees_images else 0)
    agent = agent.to(device)
    nn.init.normal_(agent.actor.weight, std=0.01)
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5, fused=device.type == "cuda")

    seen, info = envs.reset(seed=args.seed)
    shape = (args.num_steps, n)
    obs = {key: torch.zeros(*shape, *value.shape[1:], dtype=value.dtype, device=device) for key, value in seen.items()}
    actions = torch.zeros(shape, dtype=torch.int32, device=device)
    logprobs, rewards, values = (torch.zeros(shape, device=device) for _ in range(3))
    terminations, dones, valids = (torch.zeros(shape, dtype=torch.bool, device=device) for _ in range(3))
    num_updates = max(1, args.total_timesteps // (args.num_steps * n))
    start, before, agent_steps, summary = time.time(), 0, 0, {}
    totals, recent = simulator.totals(), collections.deque(maxlen=10)
    folder = pathlib.Path(args.out) if args.out else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
        write_config(folder, args)
        progress = (folder / "progress.csv").open("w", newline="")
        rows_of_progress = csv.writer(progress)

    for update in range(1, num_updates + 1):
        begin = time.time()
        for step in range(args.num_steps):
            for key, value in seen.items():
                obs[key][step] = value
            with torch.no_grad():
                logits, values[step] = agent(seen)
            logprob = logits.log_softmax(1)
            # Samples from the softmax with the Gumbel-max trick. Unlike torch.distributions, this does not make the
            # host wait for the device.
            action = (logprob - torch.empty_like(logprob).exponential_().log()).argmax(1)
            actions[step], logprobs[step] = action, logprob.gather(1, action[:, None]).squeeze(1)
            seen, rewards[step], terminations[step], truncated, info = envs.step(action)
            # The step in which a world begins its next episode is not valid and is excluded from learning.
            dones[step], valids[step] = terminations[step] | truncated, info["valid"]
        collected = time.time()
        with torch.no_grad():
            next_value = agent(seen)[1]
            advantages, last = torch.zeros_like(rewards), torch.zeros(n, device=device)
            for t in reversed(range(args.num_steps)):
                # Also after a truncation, the next observation is the last of its episode, so its value bootstraps the
                # return.
                following = next_value if t == args.num_steps - 1 else values[t + 1]
                delta = rewards[t] + args.gamma * following * ~terminations[t] - values[t]
                advantages[t] = last = delta + args.gamma * args.gae_lambda * last * ~dones[t]
            returns = advantages + values

        rows = valids.flatten().nonzero().squeeze(1)
        # Minibatches have few distinct sizes, so that memory and kernels for a size are reused. The remaining rows of a
        # shuffled epoch are dropped.
        coarse = max(1, args.num_steps * n // (16 * args.num_minibatches))
        size = max(coarse, len(rows) // args.num_minibatches // coarse * coarse)
        agent_steps += len(rows)
        flat = {key: value.flatten(0, 1) for key, value in obs.items()}
        for _ in range(args.update_epochs):
            for batch in rows[torch.randperm(len(rows), device=device)].split(size)[: args.num_minibatches]:
                logits, value = agent({key: rows_[batch] for key, rows_ in flat.items()})
                logprob = logits.log_softmax(1)
                ratio = (logprob.gather(1, actions.flatten()[batch, None].long()).squeeze(1) - logprobs.flatten()[batch]).exp()
                advantage = advantages.flatten()[batch]
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                clipped = ratio.clamp(1 - args.clip_coef, 1 + args.clip_coef)
                policy_loss = -torch.min(ratio * advantage, clipped * advantage).mean()
                value_loss = 0.5 * (value - returns.flatten()[batch]).square().mean()
                entropy = -(logprob.exp() * logprob).sum(1).mean()
                loss = policy_loss - args.ent_coef * entropy + args.vf_coef * value_loss
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), args.max_grad_norm)
                optimizer.step()

        now = simulator.totals()
        driven, totals = measured(totals, now, recent), now
        infractions = sum(driven[f"driving/{name}_per_1000_steps"] for name in ("collisions", "off_road", "red_light"))
        summary = {
            "update": update,
            "agent_steps": agent_steps,
            "SPS": round((agent_steps - before) / (time.time() - start)),
            "return": driven["charts/episode_return"],
            "goals": driven["driving/goals_per_1000_steps"],
            "waypoints": driven["driving/waypoints_per_1000_steps"],
            "infractions": infractions,
            "km_per_infraction": 0.1 * driven["driving/mean_speed_mps"] / infractions if infractions else None,
            "value_loss": value_loss.item(),
            "entropy": entropy.item(),
        }
        if folder:
            times = {"time/rollout_s": collected - begin, "time/update_s": time.time() - collected}
            columns = {"update": update, "charts/agent_steps": agent_steps, **driven, "losses/entropy": entropy.item(), **times}
            if update == 1:
                rows_of_progress.writerow(columns)
            rows_of_progress.writerow(columns.values())
            progress.flush()
        if update == 1:  # the first update compiles kernels
            start, before = time.time(), agent_steps
        if not args.json and (update == 1 or update % 5 == 0 or update == num_updates):
            shown = {key: "-" if value is None else f"{value:.4g}" for key, value in summary.items()}
            print(" ".join(f"{key} {text}" for key, text in shown.items()), flush=True)
    if folder:
        saved = {"policy": agent.config, "num_cameras": agent.num_cameras, "weights": agent.state_dict()}
        torch.save(saved, folder / "policy.pt")  # policy = Policy(saved["policy"], saved["num_cameras"]); load_state_dict(...)
        if not args.json:
            print(f"wrote {folder}/progress.csv, config.toml and policy.pt")
    if args.json:
        print(json.dumps(summary))


if __name__ == "__main__":
    main()
