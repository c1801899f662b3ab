"""Draws pictures for documents: network.png (layers of the network), summation_order.png (sums of the same numbers in
different orders), training_update.png (parts of an update), realism_likelihood.png (likelihood of a recorded value),
evaluation.png (metrics of the released policies by density), camera_severity.png (one agent's randomized cameras).

    python3 scripts/drawings.py FOLDER    writes into FOLDER; scripts/figures passes docs/images. The package pictura
                                          must be importable.
"""

import pathlib
import sys

import matplotlib
import matplotlib.patches

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from released_policies import metrics_of

import pictura

BLUE, ORANGE, GREY = "#4361ee", "#fb8500", "#8d99ae"
UPDATE = [
    ("Rollout", "one policy drives all agents\nof all worlds, each from\nits own observations"),
    ("Advantages", "generalized advantage\nestimates; infractions end\nan episode"),
    ("Filter", "transitions with small\nadvantages are dropped"),
    ("Optimization", "equal minibatches, several\nepochs: PPO's clipped loss,\nvalue, entropy"),
]
COLORS = ["#4477aa", "#66ccee", "#228833", "#ccbb44"]
WIDTH, GAP, HEIGHT = 2.3, 0.5, 1.35
POLICIES = {"perspective": BLUE, "vector": ORANGE, "vector_auxiliary": "#2a9d8f"}
DENSITIES = {"light": 60, "medium": 120, "dense": 150}  # agents per world
METRICS = {
    "km_per_infraction": "km per infraction",
    "goals_per_vehicle": "goals per vehicle",
    "at_fault_collision_rate": "share of vehicles:\nat-fault collision",
    "off_road_rate": "share of vehicles:\noff-road",
    "red_light_rate": "share of vehicles:\nred light",
}


def save(figure, path):
    figure.savefig(path, dpi=110, facecolor="white")
    plt.close(figure)


def draw_network(path):
    """Draws the layers and their widths as boxes, for both modalities."""
    figure, axes = plt.subplots(figsize=(9.2, 3.6))
    axes.set(xlim=(0, 92), ylim=(0, 36))
    axes.axis("off")

    def box(x, y, width, text, color):
        axes.add_patch(plt.Rectangle((x, y), width, 6, facecolor=color + "22", edgecolor=color))
        axes.text(x + width / 2, y + 3, text, ha="center", va="center", fontsize=9)
        return x, x + width, y + 3

    def arrow(source, target):
        axes.annotate("", (target[0], target[2]), (source[1], source[2]), arrowprops={"arrowstyle": "->", "color": "#333333"})

    inputs = [
        box(0, 28, 20, "images\n(perspective)", BLUE),
        box(0, 19, 20, "sets of members\n(vector)", BLUE),
        box(0, 10, 20, "ego", ORANGE),
        box(0, 1, 20, "conditioning,\nwaypoints", ORANGE),
    ]
    encoders = [
        box(25, 28, 25, "convolutions, attention\n4 x 128, linear to 256", BLUE),
        box(25, 19, 25, "MLP and maximum\nper set: 4 x 64 = 256", BLUE),
        box(25, 10, 25, "MLP: 64", ORANGE),
        box(25, 1, 25, "MLP: 64", ORANGE),
    ]
    trunk = box(56, 14.5, 17, "trunk\n384, 4 x 512", GREY)
    heads = [box(79, 20, 13, "actor: 12", GREY), box(79, 9, 13, "critic: 1", GREY)]
    for source, encoder in zip(inputs, encoders, strict=True):
        arrow(source, encoder)
        arrow(encoder, trunk)
    for head in heads:
        arrow(trunk, head)
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.99)
    save(figure, path)


def draw_sums(path):
    """Draws the errors of single-precision and fixed-point sums of 64 weights, for 2,000 random orders."""
    random = np.random.default_rng(1)
    weights = random.random(64).astype(np.float32) / 64
    orders = [random.permutation(64) for _ in range(2000)]
    exact = weights.astype(np.float64).sum()
    single = np.array([np.add.accumulate(weights[order], dtype=np.float32)[-1] for order in orders], np.float64)
    fixed_weights = np.rint(weights.astype(np.float64) * 2**20).astype(np.int64)
    fixed = np.array([fixed_weights[order].sum() for order in orders]) / 2**20
    figure, axes = plt.subplots(1, 2, figsize=(9.2, 2.7), sharey=True)
    panels = [("single precision", single, ORANGE), ("fixed point, units of $2^{-20}$", fixed, BLUE)]
    for panel, (name, sums, color) in zip(axes, panels, strict=True):
        values, counts = np.unique(sums, return_counts=True)
        errors = (values - exact) * 1e7
        panel.bar(errors, counts, width=0.25, color=color)
        panel.set(title=f"{name}: {len(values)} result{'s' * (len(values) > 1)}", xlabel="difference from the exact sum, $10^{-7}$")
        panel.set_xlim(errors.mean() - 5, errors.mean() + 5)
    axes[0].set_ylabel("orders")
    figure.tight_layout()
    save(figure, path)


def draw_likelihood(path):
    """Draws a histogram of a feature over rollouts, and the recorded value, whose bin gives the likelihood."""
    speeds = np.random.default_rng(2).normal(11, 2.5, 32 * 80).clip(0, 25)
    counts, edges = np.histogram(speeds, bins=10, range=(0, 25))
    likelihood = (counts + 0.1) / (len(speeds) + 0.1 * 10)
    recorded = 13.2
    chosen = np.searchsorted(edges, recorded) - 1
    figure, axes = plt.subplots(figsize=(7, 2.6))
    axes.bar(edges[:-1], likelihood, width=2.5, align="edge", color=[ORANGE if i == chosen else BLUE + "88" for i in range(10)], edgecolor="white")
    axes.axvline(recorded, color="black", linewidth=1.4)
    axes.annotate(f"recorded: p = {likelihood[chosen]:.2f}", (recorded + 0.3, likelihood.max() * 0.95))
    axes.set(xlabel="linear speed of all rollouts and steps, m/s", ylabel="likelihood", xlim=(0, 25))
    figure.tight_layout()
    save(figure, path)


def draw_update(path):
    """Draws the parts of one training update in order, and the arrow back to the first part."""
    figure, axes = plt.subplots(figsize=(11, 2.6), dpi=100)
    for i, ((title, text), color) in enumerate(zip(UPDATE, COLORS, strict=True)):
        x = i * (WIDTH + GAP)
        axes.add_patch(matplotlib.patches.FancyBboxPatch((x, 0), WIDTH, HEIGHT, boxstyle="round,pad=0.05", facecolor=color, alpha=0.25, edgecolor=color))
        axes.text(x + WIDTH / 2, HEIGHT - 0.2, title, ha="center", va="center", fontsize=12, weight="bold")
        axes.text(x + WIDTH / 2, 0.5, text, ha="center", va="center", fontsize=9)
        if i + 1 < len(UPDATE):
            arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.4}
            axes.annotate("", (x + WIDTH + GAP - 0.07, HEIGHT / 2), (x + WIDTH + 0.07, HEIGHT / 2), arrowprops=arrow)
    last = len(UPDATE) * (WIDTH + GAP) - GAP
    axes.plot([last - WIDTH / 2, last - WIDTH / 2, WIDTH / 2], [-0.07, -0.4, -0.4], color="black", linewidth=1.4)
    axes.annotate("", (WIDTH / 2, -0.05), (WIDTH / 2, -0.42), arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.4})
    axes.text(last / 2, -0.54, "new weights; worlds continue where they are", ha="center", va="center", fontsize=9)
    axes.set(xlim=(-0.1, last + 0.1), ylim=(-0.7, HEIGHT + 0.1))
    axes.axis("off")
    save(figure, path)


def draw_evaluation(path):
    """Draws metrics of the released policies by density, with 95 % intervals."""
    figure, axes = plt.subplots(1, len(METRICS), figsize=(11, 2.9))
    for policy, color in POLICIES.items():
        rows = [metrics_of(policy, density) for density in DENSITIES]
        for panel, metric in zip(axes, METRICS, strict=True):
            values, half_widths = ([row[key] for row in rows] for key in (metric, f"{metric}_half_width_95"))
            panel.errorbar(list(DENSITIES.values()), values, half_widths, label=policy, color=color, marker="o", markersize=3, capsize=3)
    for panel, title in zip(axes, METRICS.values(), strict=True):
        panel.set_title(title, fontsize=10)
        panel.set(xlabel="agents per world", xticks=list(DENSITIES.values()), ylim=(0, None))
        panel.grid(alpha=0.3)
    figure.tight_layout(rect=(0, 0, 1, 0.9))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper center", ncols=len(POLICIES), frameon=False)
    save(figure, path)


def draw_camera_severity(path):
    """Draws one agent's images at four severities of randomized cameras, one row per severity. Columns: the cameras front
    left, front, front right, back."""
    agent, columns, gap_px = 6, [1, 0, 2, 3], 3  # an agent behind a car, two of whose cameras die
    simulator = pictura.Simulator([pictura.Map.load("procedural:1")], [(0, 40)])
    views = simulator.views.numpy().view(pictura.VIEW_DTYPE)[agent : agent + 1, 0].copy()
    rows = []
    for severity in (0, 0.25, 0.5, 1):
        renderer = pictura.Renderer("cpu", pictura.Rig.paper(128, 72), camera_severity=severity)
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
        images = renderer.render(simulator.scene, views).rgb.numpy()[0].transpose(0, 2, 3, 1)
        gaps = ((0, gap_px), (0, gap_px), (0, 0))
        rows.append(np.concatenate([np.pad(images[i], gaps, constant_values=255) for i in columns], axis=1))
    Image.fromarray(np.concatenate(rows)[:-gap_px, :-gap_px]).save(path)


def main():
    if len(sys.argv) != 2:
        sys.exit(f"error: drawings.py: expected a folder, got '{' '.join(sys.argv[1:])}'")
    folder = pathlib.Path(sys.argv[1])
    draw_network(folder / "network.png")
    draw_sums(folder / "summation_order.png")
    draw_update(folder / "training_update.png")
    draw_likelihood(folder / "realism_likelihood.png")
    draw_evaluation(folder / "evaluation.png")
    draw_camera_severity(folder / "camera_severity.png")


if __name__ == "__main__":
    main()
