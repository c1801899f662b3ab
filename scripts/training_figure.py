#!/usr/bin/env python3
"""Draws the parts of one update of training: docs/images/training_update.png. scripts/figures runs it.

    training_figure.py OUT.png
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyBboxPatch

BOXES = [
    ("Rollout", "one policy drives all agents\nof all worlds, each from\nits own observations"),
    ("Advantages", "generalized advantage\nestimates; infractions end\nan episode"),
    ("Filter", "transitions with small\nadvantages are dropped"),
    ("Optimization", "equal minibatches, several\nepochs: PPO's clipped loss,\nvalue, entropy"),
]
COLORS = ["#4477aa", "#66ccee", "#228833", "#ccbb44"]
WIDTH, GAP, HEIGHT = 2.3, 0.5, 1.35


def main():
    figure, axes = plt.subplots(figsize=(11, 2.6), dpi=100)
    for i, ((title, text), color) in enumerate(zip(BOXES, COLORS)):
        x = i * (WIDTH + GAP)
        axes.add_patch(FancyBboxPatch((x, 0), WIDTH, HEIGHT, boxstyle="round,pad=0.05", facecolor=color, alpha=0.25, edgecolor=color))
        axes.text(x + WIDTH / 2, HEIGHT - 0.2, title, ha="center", va="center", fontsize=12, weight="bold")
        axes.text(x + WIDTH / 2, 0.5, text, ha="center", va="center", fontsize=9)
        if i + 1 < len(BOXES):
            arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.4}
            axes.annotate("", (x + WIDTH + GAP - 0.07, HEIGHT / 2), (x + WIDTH + 0.07, HEIGHT / 2), arrowprops=arrow)
    last = len(BOXES) * (WIDTH + GAP) - GAP
    axes.plot([last - WIDTH / 2, last - WIDTH / 2, WIDTH / 2], [-0.07, -0.4, -0.4], color="black", linewidth=1.4)
    axes.annotate("", (WIDTH / 2, -0.05), (WIDTH / 2, -0.42), arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.4})
    axes.text(last / 2, -0.54, "new weights; worlds continue where they are", ha="center", va="center", fontsize=9)
    axes.set(xlim=(-0.1, last + 0.1), ylim=(-0.7, HEIGHT + 0.1))
    axes.axis("off")
    figure.savefig(sys.argv[1], bbox_inches="tight")


if __name__ == "__main__":
    main()
