"""Measures Python's overhead per step: the time of simulator.step() and of taking its arrays, minus the time of the same steps in C++.

python bench/python/overhead.py [--device cuda] [--agents N] [--images]

Alternates rounds of both, and prints the median of the differences and both times. With --images, also measures steps that
are drawn from Python, and prints the overhead as a share of such a step.
"""

import argparse
import json
import statistics
import time

import numpy as np

import pictura


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--map", default="procedural:3")
    parser.add_argument("--agents", type=int, default=1, help="total number of agents, at most 120 per world")
    parser.add_argument("--steps", type=int, default=200, help="steps per round")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--images", action="store_true")
    args = parser.parse_args()
    worlds = [(0, min(120, args.agents - first)) for first in range(0, args.agents, 120)]
    simulator = pictura.Simulator(
        [pictura.Map.load(args.map)], worlds, device=args.device, num_threads=1 if args.agents < 1000 else 0,
        vector_observations=not args.images, parked_cars=0 if args.agents == 1 else 32, reset_inactive_fraction=2.0,
    )  # fmt: skip
    if args.device == "cpu":
        actions = np.full(args.agents, pictura.IDLE_ACTION, np.int32)
        take = np.asarray
    else:
        import torch

        actions = torch.full((args.agents,), pictura.IDLE_ACTION, dtype=torch.int32, device=args.device)
        take = torch.from_dlpack
    renderer, images = None, None
    if args.images:
        renderer = pictura.Renderer("auto", device=args.device)
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
        images = renderer.make_images(args.agents)

    def from_python() -> float:
        begin = time.perf_counter()
        for _ in range(args.steps):
            result = simulator.step(actions)
            arrays = [take(array) for array in simulator.observations.values()]
            arrays += [take(result.reward), take(result.terminated), take(result.truncated)]
        simulator.check()
        return time.perf_counter() - begin

    def drawn() -> float:
        begin = time.perf_counter()
        for _ in range(args.steps):
            simulator.step(actions)
            renderer.render(simulator.scene, simulator.views, images)
        renderer.check()
        return time.perf_counter() - begin

    from_python(), simulator.time_steps(actions, args.steps)
    rounds = [(from_python(), simulator.time_steps(actions, args.steps)) for _ in range(args.rounds)]
    micros = lambda seconds: round(1e6 * statistics.median(seconds) / args.steps, 2)  # noqa: E731
    report = {
        "device": args.device,
        "agents": args.agents,
        "step_us": micros([a for a, _ in rounds]),
        "cpp_step_us": micros([b for _, b in rounds]),
        "overhead_us": micros([a - b for a, b in rounds]),
    }
    if args.images:
        report["step_with_images_us"] = micros([drawn() for _ in range(max(1, args.rounds // 3))])
        report["overhead_percent"] = round(100 * report["overhead_us"] / report["step_with_images_us"], 3)
    print(json.dumps(report))


if __name__ == "__main__":
    main()
