"""Runs agents with random actions in many worlds, and prints their totals."""

import sys
import time

import numpy as np

import pictura


def main(steps: int = 500) -> None:
    town = pictura.Map.load("procedural:3")
    simulator = pictura.Simulator([town], [(0, 32)] * 4, seed=1)
    random = np.random.default_rng(1)
    start = time.perf_counter()
    for _ in range(steps):
        simulator.step(random.integers(0, pictura.NUM_ACTIONS, simulator.num_slots, dtype=np.int32))
    seconds = time.perf_counter() - start
    totals = simulator.totals()
    print(f"{simulator.num_slots} agents, {steps} steps in {seconds:.1f} s, {totals['episodes']} worlds restarted")
    for name in ("collisions", "off_road", "red_light", "wall_contacts", "waypoints_reached"):
        print(f"{name:18} {totals[name]:6} ({1000 * totals[name] / totals['agent_steps']:.2f} in 1000 agent-steps)")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
