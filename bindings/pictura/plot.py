"""Charts of training runs, evaluations, probes and benchmarks, from the CSV and JSON files that these write.

    from pictura import plot
    plot.save(plot.run_curves(["runs/a", "runs/b"], x="hours"), "curves.png")
    plot.figure(plot.probe_means("probe_removal/summary.json"))  # a Matplotlib figure, for notebooks

A function whose name ends in _curves, _rates, _costs, _parts or _means reads files and returns a Chart, the data to
draw. figure() and save() draw a Chart, and need Matplotlib. The other functions need only Python 3.11. `pictura plot`,
`pictura probe` and `pictura bench --plot` contain a copy of this file, and run it as a program:

    python -m pictura.plot '{"chart": "run_curves", "runs": ["runs/a"], "out": "curves.png"}'

The program's argument is a JSON object with the name and arguments of a function, and the picture's file name as "out".
The exit status is 0, or 1 after an error. If Matplotlib is missing, the program writes the chart's data as JSON to
OUT.json, and the exit status is 3.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import itertools
import json
import math
import os
import pathlib
import re
import secrets
import shutil
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's colours, which colour-blind people can distinguish. Yellow is omitted, because it is faint on white.
SERIES_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#5A5A5A")
# Colours of a visibility from 0 to 1: hidden, half visible, fully visible.
SHARE_COLORS = ("#D73027", "#FEE090", "#4575B4")
_REVEALING = ("#E3E5E8", "#5A6068")  # line of sight opens rarely, often

METRICS = (
    "charts/episode_return",
    "driving/goals_per_1000_steps",
    "driving/mean_speed_mps",
    "driving/at_fault_collisions_per_1000_steps",
    "driving/off_road_per_1000_steps",
    "driving/red_light_per_1000_steps",
)
# Maximum number of points of a run's curve. In longer runs, each point is a mean of consecutive updates.
MAX_RUN_POINTS = 200
_NAN = math.nan


class PlotError(Exception):
    """Error in a file or an argument. The message names the file or argument."""


class MissingMatplotlib(PlotError):
    """Matplotlib is missing, so the chart cannot be drawn."""


@dataclass
class Series:
    """One line of a panel. A point leaves a gap if it is not finite, or if it is 0 or less on a logarithmic axis."""

    name: str
    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)
    low: list[float] = field(default_factory=list)  # lower edge of a band; empty: no band
    high: list[float] = field(default_factory=list)
    dashed: bool = False

    def add(self, x: float, y: float | None, low: float | None = None, high: float | None = None) -> None:
        """Adds a point; None becomes NaN. Either all points of a series have a band, or no point has one."""
        for values, value in ((self.x, x), (self.y, y), (self.low, low), (self.high, high)):
            values.append(_NAN if value is None else float(value))

    def add_estimate(self, x: float, value: float | None, half_width: float | None, least: float = -math.inf) -> None:
        """Adds a value with its confidence interval, whose lower end is at least `least`."""
        has_band = value is not None and half_width is not None
        self.add(x, value, *((max(least, value - half_width), value + half_width) if has_band else ()))


@dataclass
class Panel:
    title: str
    x_label: str
    y_label: str
    series: list[Series] = field(default_factory=list)
    x_scale: str = "linear"  # or "log", with ticks at the points
    y_scale: str = "linear"  # or "log"
    starts_at_zero: bool = False  # whether the y axis starts at 0
    marks: list[tuple[float, str]] = field(default_factory=list)  # dashed vertical lines and their labels
    strip: list[tuple[float, str]] = field(default_factory=list)  # colours under the x axis


@dataclass
class Chart:
    panels: list[Panel]
    columns: int = 3
    panel_size_in: tuple[float, float] = (3.5, 2.7)
    facts: dict[str, Any] = field(default_factory=dict)  # further facts that the program prints


def _finite_or_null(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _need(condition: Any, message: str) -> None:
    if not condition:
        raise PlotError(message)


def _read_json(path: str) -> Any:
    try:
        return json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except ValueError as error:  # from JSON or UTF-8
        raise PlotError(f"{path}: expected JSON: {error}") from None


# ---- runs


@dataclass
class _Run:
    folder: str
    path: str
    columns: dict[str, list[float]]
    settings: Any  # key by which runs are grouped: config.toml without run.seed; the folder if runs are not grouped
    seed: int = 0

    def column(self, name: str) -> list[float]:
        _need(name in self.columns, f"{self.path}: expected a column '{name}'; it has {', '.join(self.columns)}")
        return self.columns[name]


def _number(text: str) -> float | None:
    # float() also accepts spaces and underscores, which valid files do not contain.
    try:
        return None if "_" in text or text != text.strip() else float(text)
    except ValueError:
        return None


def _read_progress(folder: str) -> tuple[str, dict[str, list[float]]]:
    path = f"{folder}/progress.csv"
    _need(os.path.isdir(folder), f"{folder}: expected the folder of a training run")
    _need(os.path.exists(path), f"{folder}: expected the folder of a training run: it has no progress.csv")
    lines = pathlib.Path(path).read_text(encoding="utf-8").splitlines()
    names = lines[0].split(",") if lines else []
    for i, name in enumerate(names):
        _need(name not in names[:i], f"{path}:1: column '{name}' appears twice")
    columns: dict[str, list[float]] = {name: [] for name in names}
    for number, line in enumerate(lines[1:], 2):
        cells = line.split(",")
        for i, cell in enumerate(cells):
            value = _number(cell)
            _need(i < len(names) and value is not None, f"{path}:{number}: expected {len(names)} numbers, got '{cell}' as number {i + 1}")
            columns[names[i]].append(value)  # type: ignore[arg-type]
        _need(len(cells) == len(names), f"{path}:{number}: expected {len(names)} numbers, got {len(cells)}")
    _need(columns and len(columns[names[0]]) > 0, f"{path}: has no updates yet")
    return path, columns


def _read_run(folder: str, groups_seeds: bool) -> _Run:
    path, columns = _read_progress(folder)
    if not groups_seeds:
        return _Run(folder, path, columns, folder)
    import tomllib

    config_path = f"{folder}/config.toml"
    _need(
        os.path.exists(config_path),
        f"{config_path}: expected in the folder of progress.csv, to find runs that differ only in their seed; --group none does not need the file",
    )
    try:
        config = tomllib.loads(pathlib.Path(config_path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlotError(f"{config_path}: expected TOML: {error}") from None
    section = config.get("run")
    seed = section.pop("seed", None) if isinstance(section, dict) else None
    _need(isinstance(seed, int), f"{config_path}: expected a number run.seed")
    return _Run(folder, path, columns, config, seed)  # type: ignore[arg-type]


def _column_of(metric: str, run: _Run) -> str:
    """Returns the column of a metric. `metric` is the column's name, or the part after the slash."""
    if metric in run.columns:
        return metric
    found = [name for name in run.columns if name.endswith(f"/{metric}")]
    _need(len(found) < 2, f"{run.path}: '{metric}' may be {' or '.join(found)}")
    return found[0] if found else metric  # column() raises PlotError if no column matches


def _mean_of_finite(values: Iterable[float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else _NAN


def _curve_of(run: _Run, x: str, column: str) -> Series:
    """Returns a run's curve, with at most MAX_RUN_POINTS points."""
    if x == "hours":
        seconds = zip(run.column("time/rollout_s"), run.column("time/update_s"), strict=True)
        along = [total_s / 3600 for total_s in itertools.accumulate(map(sum, seconds))]
    else:
        along = run.column("charts/agent_steps")
    heights = run.column(column)
    stride = -(-len(along) // MAX_RUN_POINTS)
    begins = range(0, len(along), stride)
    return Series(
        column,
        [_mean_of_finite(along[begin : begin + stride]) for begin in begins],
        [_mean_of_finite(heights[begin : begin + stride]) for begin in begins],
    )


def _height_at(curve: Series, x: float) -> float:
    """Interpolates a curve between its points. The result is NaN next to a point that is not finite."""
    after = next((i for i, at in enumerate(curve.x) if at >= x), len(curve.x) - 1)
    if after == 0 or curve.x[after] == x:
        return curve.y[after]
    share = (x - curve.x[after - 1]) / (curve.x[after] - curve.x[after - 1])
    return curve.y[after - 1] + share * (curve.y[after] - curve.y[after - 1])


def _mean_of_curves(curves: list[Series], name: str) -> Series:
    """Returns the mean of curves over the range in which all are defined, with a band from their minimum to maximum."""
    low, high = max(curve.x[0] for curve in curves), min(curve.x[-1] for curve in curves)
    _need(low <= high, f"{name}: these runs share no range; --group none draws them separately")
    last = max(len(curve.x) for curve in curves) - 1
    mean = Series(name)
    for i in range(last + 1):
        x = high if i == last else low + i / last * (high - low)  # rounding must not move the last point beyond the end
        heights = [_height_at(curve, x) for curve in curves]
        mean.add(x, *((sum(heights) / len(heights), min(heights), max(heights)) if all(map(math.isfinite, heights)) else (None,)))
    return mean


def _name_of_group(names: list[str]) -> str:
    """Returns "town_*, 3 seeds" for town_a, town_b and town_c."""
    if len(names) == 1:
        return names[0]
    begin = os.path.commonprefix(names)
    # The common prefix and suffix must not overlap in the shortest name.
    end = os.path.commonprefix([name[len(begin) :][::-1] for name in names])[::-1]
    return f"{begin}*{end}, {len(names)} seeds"


_UNITS = {
    "_per_1000_steps": "per 1,000 agent-steps",
    "_per_km": "per km",
    "_mps": "m/s",
    "_per_step": "per agent-step",
    "_per_s": "per second",
    "_share": "share",
    "_fraction": "share",
    "_rate": "",
    "_s": "s",
}
_UNITS_OF_WHOLE_NAMES = {"episode_return": "sum of rewards", "entropy": "nats", "approx_kl": "nats"}


def _labels_of(column: str) -> tuple[str, str]:
    """Returns title and unit of a column: "driving/goals_per_1000_steps" has the title Goals per 1,000 agent-steps."""
    title = column.split("/")[-1]
    suffix = next((suffix for suffix in _UNITS if title.endswith(suffix)), "")
    unit = _UNITS.get(suffix, "")
    whole_unit = _UNITS_OF_WHOLE_NAMES.get(title, "")
    title = title.removesuffix(suffix if unit else "").replace("_", " ")
    title = title[:1].upper() + title[1:]
    return (f"Reward: {title}" if column.startswith("rewards/") else title), unit or whole_unit


def run_curves(runs: Sequence[str], metrics: Sequence[str] = METRICS, x: str = "agent_steps", group: str = "seeds") -> Chart:
    """Returns curves of training runs, with a panel for each metric and a line for each run.

    runs: folders that `pictura train` wrote. metrics: columns of progress.csv; the part after the slash is enough if it
    is unique. x: "agent_steps", or "hours" of rollouts and updates. group: "seeds" draws one line for all runs whose
    config.toml differ only in run.seed; "none" draws one line for each run. A line of several runs is their mean over
    the range of x that all of them cover, with a band from their minimum to their maximum. A line has at most
    MAX_RUN_POINTS points; each is the mean of the same number of consecutive updates. Raises PlotError, which names a
    missing folder, file or column, or runs without a common range of x.

    Examples:
        >>> chart = plot.run_curves(["runs/a", "runs/b"], x="hours") # doctest: +SKIP
        >>> plot.save(chart, "curves.png") # doctest: +SKIP
    """
    _need(runs and metrics, "run_curves: expected a run and a metric or more")
    read: list[_Run] = []
    for folder in map(str, runs):
        read.append(_read_run(folder, group == "seeds"))
        for other in read[:-1]:
            _need(not os.path.samefile(other.folder, folder), f"{folder}: is the same folder as {other.folder}")
    names = [os.path.basename(os.path.realpath(run.folder)) for run in read]
    if len(set(names)) < len(names):
        names = [run.folder for run in read]

    members: list[list[int]] = []  # for each line, the indices of its runs
    for i, run in enumerate(read):
        same = next((lines for lines in members if read[lines[0]].settings == run.settings), None)
        if same is None:
            members.append([i])
        else:
            same.append(i)
    line_names = [_name_of_group([names[i] for i in line]) for line in members]

    columns = [_column_of(metric, read[0]) for metric in metrics]
    panels = []
    for column in columns:
        title, unit = _labels_of(column)
        panel = Panel(title, "time of rollouts and updates (h)" if x == "hours" else "agent-steps", unit)
        for name, line in zip(line_names, members, strict=True):
            curves = [_curve_of(read[i], x, column) for i in line]
            panel.series.append(curves[0] if len(curves) == 1 else _mean_of_curves(curves, name))
            panel.series[-1].name = name
        panels.append(panel)

    lines = [
        {
            "name": name,
            "runs": [read[i].folder for i in line],
            "seeds": [read[i].seed for i in line] if group == "seeds" else [],
            **_extent_of(panels[0].series[index]),
            "last": {column: _finite_or_null(panel.series[index].y[-1]) for column, panel in zip(columns, panels, strict=True)},
        }
        for index, (name, line) in enumerate(zip(line_names, members, strict=True))
    ]
    facts = {"x": x, "metrics": columns, "band": "lowest to highest seed", "lines": lines}
    return Chart(panels, columns=_columns_for(len(panels)), facts=facts)


def _extent_of(series: Series) -> dict[str, float]:
    return {"points": len(series.x), "x_first": series.x[0], "x_last": series.x[-1]}


def _columns_for(num_panels: int) -> int:
    return 2 if num_panels in (2, 4) else 3


# ---- evaluations


# Key, title and label, in the order of the paper's tables.
_PROTOCOL = (
    ("at_fault_collision_rate", "At-fault collision", "share of vehicles"),
    ("off_road_rate", "Off-road", "share of vehicles"),
    ("red_light_rate", "Red light", "share of vehicles"),
    ("goals_per_vehicle", "Goals", "per vehicle"),
    ("km_per_infraction", "Distance per infraction", "distance (km)"),
    ("km_per_at_fault_infraction", "Distance per at-fault infraction", "distance (km)"),
)
# Optional metrics: they have no panel if no row has them.
_OPTIONAL = ("km_per_infraction", "km_per_at_fault_infraction")


def _evaluation_series(line: dict[str, Any], metric: str, x: str) -> Series:
    """Returns a metric at medium density, with a band from the minimum to the maximum over all densities."""
    series = Series(line["name"], dashed=bool(line.get("dashed", False)))
    for point in line["points"]:
        # A metric is None if its denominator is 0.
        given = {row["density"]: row.get(metric) if metric in _OPTIONAL else row[metric] for row in point["rows"]}
        known = [value for value in given.values() if value is not None] or [None]
        series.add(point["gpu_hours" if x == "hours" else "agent_steps"], given["medium"], min(known), max(known))
    return series


def evaluation_curves(path: str, x: str = "agent_steps") -> Chart:
    """Returns metrics of the evaluation protocol during trainings: medium traffic, with a band over all densities.

    path: output of `scripts/reproduce_table --curves`. x: "agent_steps", or "hours" of one GPU. Raises PlotError, which
    names the file, the line and the missing value.

    Examples:
        >>> from pictura import plot
        >>> chart = plot.evaluation_curves("bench/results/agent_curves.json")
        >>> chart.panels[0].title
        'At-fault collision'
    """
    x_label = "time on one GPU (h)" if x == "hours" else "agent-steps"
    panels = {metric: Panel(title, x_label, y_label, starts_at_zero=True) for metric, title, y_label in _PROTOCOL}
    content = _read_json(path)
    where = "its lines"
    try:
        lines = content["lines"]
        _need(isinstance(lines, list) and lines, f"{path}: expected a line or more")
        for number, line in enumerate(lines, 1):
            where = f"line {number}"
            where = f"line '{line['name']}'"
            points = line["points"]
            _need(isinstance(points, list) and points, f"{path}: {where}: expected a point or more")
            for point in points:
                has_medium = any(row["density"] == "medium" for row in point["rows"])
                _need(has_medium, f"{path}: {where}: expected a row of medium density in every point")
            for metric, panel in panels.items():
                series = _evaluation_series(line, metric, x)
                _need(series.x == sorted(series.x), f"{path}: {where}: expected points in ascending order")
                panel.series.append(series)
        rows = [row for line in lines for point in line["points"] for row in point["rows"]]
    except KeyError as error:
        raise PlotError(f"{path}: {where}: expected a key {error}") from None
    except (AttributeError, TypeError, ValueError) as error:
        raise PlotError(f"{path}: {where}: {error}") from None
    shown = [panel for metric, panel in panels.items() if metric not in _OPTIONAL or any(metric in row for row in rows)]
    lines = [{"name": series.name, **_extent_of(series)} for series in shown[0].series]
    return Chart(shown, columns=_columns_for(len(shown)), facts={"x": x, "band": "lowest to highest density", "lines": lines})


def severity_curves(results: Sequence[str]) -> Chart:
    """Returns metrics of the evaluation protocol by the severity of randomized cameras, with 95 % intervals.

    results: outputs of `pictura evaluate --camera-severity ... --json`. The chart has one line for each file and
    density. Raises PlotError, which names the file and the missing value.

    Examples:
        >>> chart = plot.severity_curves(["severities.json"]) # doctest: +SKIP
    """
    panels = {metric: Panel(title, "severity", y_label, starts_at_zero=True) for metric, title, y_label in _PROTOCOL}
    for path in results:
        content = _read_json(path)
        try:
            rows = [row for row in content["rows"] if row["driver"] is None]
            _need(rows, f"{path}: expected a row or more")
            for density in dict.fromkeys(row["density"] for row in rows):
                name = density if len(results) == 1 else f"{pathlib.Path(path).stem} {density}"
                for metric, panel in panels.items():
                    series = Series(name)
                    for row in sorted((row for row in rows if row["density"] == density), key=lambda row: row["camera_severity"]):
                        series.add_estimate(row["camera_severity"], row[metric], row[f"{metric}_half_width_95"], least=0)
                    panel.series.append(series)
        except KeyError as error:
            raise PlotError(f"{path}: expected a key {error}") from None
        except TypeError as error:
            raise PlotError(f"{path}: {error}") from None
    lines = [{"name": series.name, **_extent_of(series)} for series in next(iter(panels.values())).series]
    return Chart(list(panels.values()), facts={"band": "95 % interval", "lines": lines})


# ---- benchmarks

_RATE, _SIZE = "agent-steps/s", "width of a 16:9 image (px)"


def _read_results(paths: Sequence[str]) -> list[tuple[str, float]]:
    """Returns names and values of benchmark results, from outputs of `pictura bench --json` or files of
    scripts/gpu_check."""
    results: list[tuple[str, float]] = []
    for path in paths:
        content, before = _read_json(path), len(results)
        benchmarks = [content, *(content.get("bench", []) if isinstance(content, dict) else [])]
        for benchmark in benchmarks:
            rows = benchmark.get("results", []) if isinstance(benchmark, dict) else []
            results += [(row.get("name", ""), row.get("value", 0.0)) for row in rows]
        _need(len(results) > before, f"{path}: expected results of a benchmark")
    return results


def _sweep(title: str, x_label: str, y_label: str) -> Panel:
    return Panel(title, x_label, y_label, x_scale="log", y_scale="log")


def _add_point(panel: Panel, name: str, x: float, y: float) -> None:
    """Adds a point to the series `name`, whose points are sorted by x. A second point with the same x is ignored."""
    series = next((series for series in panel.series if series.name == name), None)
    if series is None:
        series = Series(name)
        panel.series.append(series)
    if x in series.x:
        return
    at = sum(other < x for other in series.x)
    series.x.insert(at, float(x))
    series.y.insert(at, float(y))


def render_rates(results: Sequence[str]) -> Chart:
    """Returns rendering rates by size and number of egos, from the sweeps of `pictura bench render`.

    Examples:
        >>> from pictura import plot
        >>> len(plot.render_rates(["bench/results/gpu_check_sweeps.json"]).panels)
        3
    """
    egos_fixed, size_fixed = 2048, "96x54"
    by_size = _sweep(f"{egos_fixed:,} egos", _SIZE, _RATE)
    by_egos = _sweep(f"{size_fixed.replace('x', '×')} px", "egos in one call", _RATE)
    by_square = _sweep(f"{egos_fixed:,} egos, walls off", "width of a square image (px)", _RATE)
    for name, value in _read_results(results):
        match = re.fullmatch(r"(.+) ((\d+)x(\d+)) (\d+) egos", name)
        if not match:
            continue
        renderer, size, width, height, egos = match.groups()
        if int(egos) == egos_fixed:
            _add_point(by_square if width == height else by_size, renderer, float(width), value)
        if size == size_fixed:
            _add_point(by_egos, renderer, float(egos), value)
    return Chart([by_size, by_egos, by_square])


def step_costs(results: Sequence[str]) -> Chart:
    """Returns the cost of an agent-step by agents and worlds, from the sweeps of `pictura bench simulate`.

    Examples:
        >>> from pictura import plot
        >>> len(plot.step_costs(["bench/results/cuda_simulate_agents.json"]).panels)
        2
    """
    worlds_fixed, agents_fixed, cost = 64, 60, "time for an agent-step (ns)"
    by_agents = _sweep(f"{worlds_fixed} worlds", "agents in each world", cost)
    by_worlds = _sweep(f"{agents_fixed} agents in each world", "worlds", cost)
    for name, value in _read_results(results):
        match = re.fullmatch(r"(\w+), (\d+) worlds of (\d+) agents", name)
        if not match:
            continue
        backend, worlds, agents = match[1], int(match[2]), int(match[3])
        if agents == agents_fixed:
            _add_point(by_worlds, backend, worlds, 1e9 / value)
        elif worlds == worlds_fixed:
            _add_point(by_agents, backend, agents, 1e9 / value)
    return Chart([by_agents, by_worlds], columns=2, panel_size_in=(4.2, 3))


def rank_rates(results: Sequence[str]) -> Chart:
    """Returns rates and efficiencies by number of GPUs, from files of scripts/gpu_ranks. Two panels have a fixed number
    of agents on each GPU, and two a fixed total number.

    Examples:
        >>> from pictura import plot
        >>> len(plot.rank_rates(["bench/results/gpu_ranks.json"]).panels)
        4
    """
    cases = {"each": "The same number of agents on each GPU", "in_all": "The same total number of agents"}
    rates = {case: _sweep(title, "GPUs", _RATE) for case, title in cases.items()}
    efficiencies = {
        case: Panel("Rate divided by (GPUs x rate of one GPU)", "GPUs", "efficiency", x_scale="log", starts_at_zero=True) for case in cases
    }
    for path in results:
        content = _read_json(path)
        _need(isinstance(content, dict) and "rate" in content, f"{path}: expected rates of scripts/gpu_ranks")
        key = "train.precision="
        precisions = [text.removeprefix(key) for text in content.get("arguments", []) if text.startswith(key)]
        for size, rows in content["rate"].items():
            name = f"{size} {precisions[-1] if precisions else 'bf16'}"
            for case in cases:
                rate, efficiency = Series(name), Series(name)
                for row in rows:
                    if row["case"] not in ("one", case):
                        continue
                    measured = row["agent_steps_per_s"]
                    rate.add(row["gpus"], measured["median"], measured["min"], measured["max"])
                    efficiency.add(row["gpus"], row["efficiency"])
                rates[case].series.append(rate)
                efficiencies[case].series.append(efficiency)
    return Chart([*rates.values(), *efficiencies.values()], columns=2, panel_size_in=(4.2, 3))


def breakdown_parts(results: Sequence[str], parts: Sequence[str], paper: dict[str, dict[str, float]]) -> Chart:
    """Returns the duration of an update by image size, from `pictura bench breakdown`, and the paper's durations.

    parts: columns of the table; the third panel shows them for the first case. paper: the paper's seconds for "total"
    and "rendering", by image size.

    Examples:
        >>> parts = ["simulation", "rendering"] # doctest: +SKIP
        >>> paper = {"96x54": {"total": 63.4, "rendering": 5.0}} # doctest: +SKIP
        >>> chart = plot.breakdown_parts(["breakdown.json"], parts, paper) # doctest: +SKIP
    """
    seconds = "time of an update (s)"
    shown = {"total": _sweep("Whole update", _SIZE, seconds), "rendering": _sweep("Rendering", _SIZE, seconds)}
    of_first = _sweep("", _SIZE, seconds)
    for name, value in _read_results(results):
        match = re.fullmatch(r"(.+) (\d+)x\d+ (\d+) agents a world, (\w+)", name)
        if not match:
            continue
        series, width, part = f"{match[1]}, {match[3]} agents a world", float(match[2]), match[4]
        if part in shown:
            _add_point(shown[part], series, width, value)
        of_first.title = of_first.title or series
        if of_first.title == series and part in parts:
            _add_point(of_first, part, width, value)
    for size, row in paper.items():
        for part, panel in shown.items():
            _add_point(panel, "the paper, H100 NVL", float(size.split("x")[0]), row[part])
    _need(of_first.title, "--plot: expected results of bench breakdown")
    return Chart([*shown.values(), of_first], panel_size_in=(3.8, 4))


# ---- probes

TAKEOVER_STEP_S = 0.1
_CASES = {"hidden": "hidden vehicle", "removed": "the same without the user", "empty": "empty corner"}
_CHANGES = {"d_value": ("Value", "dV"), "d_p_brake": ("Braking probability", "dP(brake)")}
_SEEN = "strip: visible share, none (red) to all (blue)"


def _share_color(share: float) -> str:
    """Interpolates linearly between SHARE_COLORS."""
    place = min(max(share, 0.0), 1.0) * (len(SHARE_COLORS) - 1)
    below = min(int(place), len(SHARE_COLORS) - 2)
    channels = [[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in SHARE_COLORS[below : below + 2]]
    return "#" + "".join(f"{round(a + (b - a) * (place - below)):02X}" for a, b in zip(*channels, strict=True))


def _names_of(summary: dict[str, Any]) -> dict[str, str]:
    """Returns names of policies for charts, by their names in rows. Policies with untrained weights are "untrained
    NAME"."""
    return {one["name"]: ("untrained " if one.get("untrained_hash") else "") + one["name"] for one in summary["policy"]}


def _removal_means(summary: dict[str, Any]) -> Chart:
    panels = []
    for by_distance in (False, True):
        for change, (title, label) in _CHANGES.items():
            lines = {name: Series(shown) for name, shown in _names_of(summary).items()}
            for row in summary["rows"]:
                is_of_band = row["distance_from_m"] is not None
                if by_distance and is_of_band and row["group"] == "hidden":
                    x = 0.5 * (row["distance_from_m"] + row["distance_to_m"])
                elif not by_distance and not is_of_band and row["in_frame"] and row["cases"] > 0:
                    x = 100 * row["occlusion_mean"]
                else:
                    continue
                # Means of magnitudes are never below 0.
                lines[row["policy"]].add_estimate(x, row[f"abs_{change}"], row[f"abs_{change}_half_width_95"], least=0.0)
            panels.append(
                Panel(
                    f"{title}, wholly hidden users" if by_distance else title,
                    "distance of the user (m)" if by_distance else "occlusion of the user (%)",
                    f"mean |{label}|",
                    list(lines.values()),
                )
            )
    return Chart(panels, columns=2, panel_size_in=(4.2, 3))


def _pedestrian_means(summary: dict[str, Any]) -> Chart:
    panels = []
    for change, (title, label) in _CHANGES.items():
        lines = {name: Series(shown) for name, shown in _names_of(summary).items()}
        panel = Panel(title, f"distance from where it is first seen (m)\n{_SEEN}", f"mean {label}", list(lines.values()))
        for row in summary["rows"]:
            # Points that fewer than half of the paths have are omitted.
            if row["from_first_sight_m"] is None or 2 * row["cases"] < summary["paths"]:
                continue
            lines[row["policy"]].add_estimate(row["from_first_sight_m"], row[change], row[f"{change}_half_width_95"])
            if row["policy"] == summary["policy"][0]["name"]:
                panel.strip.append((row["from_first_sight_m"], _share_color(row["visible_share_mean"])))
        panels.append(panel)
    return Chart(panels, columns=2, panel_size_in=(4.2, 3))


def _with_walls(title: str, walls: bool) -> str:
    return f"{title}, {'walls' if walls else 'no walls'}"


def _reveal_strip(rows: list[dict[str, Any]], num_steps: int) -> list[tuple[float, str]]:
    """Returns a strip of colours for the time when the line of sight opens. It is dark from the minimum of the
    policies' 10th percentiles to the maximum of their 90th percentiles."""
    quantiles_s = [(row["reveal_s_p10"], row["reveal_s_p90"]) for row in rows if row["reveal_s_p10"] is not None]
    if not quantiles_s:
        return []
    first, last = (round(pick(column) / TAKEOVER_STEP_S) for pick, column in zip((min, max), zip(*quantiles_s, strict=True), strict=True))
    return [(TAKEOVER_STEP_S * k, _REVEALING[first <= k <= last]) for k in range(num_steps + 1)]


def _corner_means(summary: dict[str, Any]) -> Chart:
    panels = []
    runs = [row for row in summary["rows"] if row["less_policy"] is None and row["less_case"] is None]
    names = _names_of(summary)
    for walls in (True, False):
        hidden = [row for row in runs if row["walls"] is walls and row["case"] == "hidden"]
        strip = _reveal_strip(hidden, summary["takeover_steps"])
        for case, title in _CASES.items():
            panel = Panel(_with_walls(title, walls), "time since the takeover (s)\nstrip: line of sight opens", "mean speed (m/s)", strip=strip)
            for row in runs:
                if row["walls"] is not walls or row["case"] != case:
                    continue
                series = Series(names[row["policy"]])
                curve = zip(row["speed_curve_mps"], row["speed_curve_mps_half_width_95"], row["driving"], strict=True)
                for k, (speed, half_width, driving) in enumerate(curve):
                    series.add_estimate(TAKEOVER_STEP_S * k, speed if driving > 0 else None, half_width)
                panel.series.append(series)
            panels.append(panel)
    return Chart(panels)


_PROBES = {"removal": _removal_means, "pedestrian": _pedestrian_means, "corner": _corner_means}


def probe_means(summary: str, names: dict[str, str] | None = None) -> Chart:
    """Returns the means of a probe with 95 % intervals, like the paper's figures, from summary.json of `pictura probe`.

    The chart of `removal` shows absolute changes by occlusion of the road user, and for fully hidden road users by
    distance. The chart of `pedestrian` shows changes by the distance to the point where the pedestrian is first
    visible, with its visibility as a strip. The chart of `corner` shows mean speeds after the takeover. names: names of
    policies in the legend; default: the names in the file.

    Examples:
        >>> plot.save(plot.probe_means("probe_removal/summary.json"), "means.png") # doctest: +SKIP
    """
    content = _read_json(summary)
    kind = content.get("kind") if isinstance(content, dict) else None
    _need(kind in _PROBES, f"{summary}: expected the summary of a probe of {', '.join(_PROBES)}")
    try:
        chart = _PROBES[kind](content)
    except KeyError as error:
        raise PlotError(f"{summary}: expected a key {error}") from None
    for series in (series for panel in chart.panels for series in panel.series):
        series.name = (names or {}).get(series.name, series.name)
    return chart


def _read_cases(file_name: str, /, **wanted: str) -> list[dict[str, str]]:
    """Returns the rows of cases.csv that have the wanted values."""
    with open(file_name, encoding="utf-8", newline="") as file:
        return [row for row in csv.DictReader(file) if all(row[name] == value for name, value in wanted.items())]


def path_curves(folder: str, path: int, marks: Sequence[tuple[float, str]] = ()) -> Chart:
    """Returns the changes of value and braking along one path of `pictura probe pedestrian`, and the pedestrian's
    visibility as a strip.

    marks: positions along the path in metres, and the letter that labels each.

    Examples:
        >>> plot.save(plot.path_curves("probe_pedestrian", path=3), "path.png") # doctest: +SKIP
    """
    names = _names_of(_read_json(f"{folder}/summary.json"))
    rows = _read_cases(f"{folder}/cases.csv", path=str(path))
    along_m = [float(row["along_m"]) for row in rows]
    strip = [(at_m, _share_color(float(row["visible_share"]))) for at_m, row in zip(along_m, rows, strict=True)]
    panels = []
    for change, (title, label) in _CHANGES.items():
        series = [Series(shown, along_m, [float(row[f"{name}/{change}"]) for row in rows]) for name, shown in names.items()]
        panels.append(Panel(title, f"distance along the path (m)\n{_SEEN}", label, series, marks=list(marks), strip=strip))
    return Chart(panels, columns=2, panel_size_in=(5.5, 3.2))


def takeover_curves(folder: str, pair: int) -> Chart:
    """Returns the policies' speeds towards the hidden vehicle in one pair of `pictura probe corner`, with and without
    walls.

    Examples:
        >>> plot.save(plot.takeover_curves("probe_corner", pair=2), "pair.png") # doctest: +SKIP
    """
    names = _names_of(_read_json(f"{folder}/summary.json"))
    panels = []
    for walls in ("on", "off"):
        panel = Panel(
            _with_walls("Speed towards the hidden vehicle", walls == "on"),
            "time since the takeover (s)\nx: the vehicle enters the input, o: line of sight opens",
            "speed (m/s)",
        )
        marks: dict[float, str] = {}
        for row in _read_cases(f"{folder}/cases.csv", pair=str(pair), case="hidden", walls=walls):
            speeds = {name: text for name, text in row.items() if re.fullmatch(r"speed_mps_[\d.]+", name)}
            times_s = [float(name.removeprefix("speed_mps_")) for name in speeds]
            panel.series.append(Series(names[row["policy"]], times_s, [float(text) if text else _NAN for text in speeds.values()]))
            for text, letter in ((row["input_s"], "x"), (row["sight_s"] if walls == "on" else "", "o")):
                if text and letter not in marks.get(float(text), ""):
                    marks[float(text)] = marks.get(float(text), "") + letter
        panel.marks = sorted(marks.items())
        panels.append(panel)
    return Chart(panels, columns=2, panel_size_in=(5.5, 3.2))


# ---- drawing

_DPI = 150
_PAGE_DPI = 100  # text size like in the probe's pictures
_STYLE = {
    "font.family": "DejaVu Sans",  # font that comes with Matplotlib
    "font.size": 9.5,
    "text.color": "#22262B",
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.labelcolor": "#3A3F46",
    "axes.edgecolor": "#3A3F46",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E3E5E8",
    "xtick.color": "#5A6068",
    "ytick.color": "#5A6068",
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "xtick.minor.bottom": False,
    "ytick.minor.left": False,
    "lines.linewidth": 1.8,
    "lines.markersize": 4,
    "lines.solid_capstyle": "round",
    "svg.hashsalt": "pictura",
}


def _matplotlib(what: str) -> Any:
    try:
        import matplotlib.figure
        import matplotlib.style
    except ImportError as error:
        raise MissingMatplotlib(
            f"{what}: not drawn, since {sys.executable} has no Matplotlib ({error}): pip install 'pictura[plot]' or matplotlib"
        ) from None
    return matplotlib


def _tick_text(value: float, _position: int = 0) -> str:
    """Returns a tick's text: "1.5G", "20k", "0.02"."""
    for unit, suffix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        # Powers of two such as 1024 and 8192 are clearer in full.
        if abs(value) >= unit * (10 if suffix == "k" else 1) * (1 - 1e-9) and (suffix != "k" or value % 1000 == 0):
            return f"{value / unit:g}{suffix}".replace("-", "\N{MINUS SIGN}")
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")


def _apart(values: Iterable[float]) -> list[float]:
    """Returns the values whose labels fit on a logarithmic axis, in ascending order."""
    ascending, kept = sorted(values), []
    for value in ascending:
        if not kept or math.log(value / kept[-1]) > math.log(ascending[-1] / ascending[0]) / 8:
            kept.append(value)
    return kept


def _set_scale(axes: Axes, panel: Panel) -> None:
    from matplotlib import ticker

    if panel.x_scale == "log":
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_locator(ticker.FixedLocator(_apart({x for series in panel.series for x in series.x})))
        axes.xaxis.set_minor_locator(ticker.NullLocator())
        axes.xaxis.set_major_formatter(ticker.FuncFormatter(_tick_text))
    else:
        axes.xaxis.set_major_locator(ticker.MaxNLocator(6, steps=[1, 2, 5, 10]))
    if panel.y_scale == "log":
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        axes.yaxis.set_major_locator(ticker.LogLocator(10, (1.0, 2.0, 5.0) if high < 1000 * low else (1.0,)))
        axes.yaxis.set_minor_locator(ticker.NullLocator())
        axes.yaxis.set_major_formatter(ticker.FuncFormatter(_tick_text))
    else:
        axes.yaxis.set_major_locator(ticker.MaxNLocator(6, steps=[1, 2, 5, 10]))
    for axis, is_log in ((axes.xaxis, panel.x_scale == "log"), (axes.yaxis, panel.y_scale == "log")):
        if not is_log and not 1e-3 <= max(map(abs, axis.get_view_interval())) < 1e4:
            axis.set_major_formatter(ticker.FuncFormatter(_tick_text))


def _lone_points(series: Series) -> list[int]:
    """Returns isolated points between gaps, which are not visible as a line."""
    shown = [False, *(math.isfinite(x) and math.isfinite(y) for x, y in zip(series.x, series.y, strict=True)), False]
    return [i for i in range(len(series.x)) if shown[i + 1] and not shown[i] and not shown[i + 2]]


def _draw_panel(axes: Axes, panel: Panel, colors: dict[str, str]) -> None:
    axes.set_title(panel.title)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    shows_points = max((len(series.x) for series in panel.series), default=0) <= 12
    for series in panel.series:
        if any(map(math.isfinite, series.low)):
            axes.fill_between(series.x, series.low, series.high, color=colors[series.name], alpha=0.18, linewidth=0)
    for series in panel.series:
        points = {} if shows_points else {"markevery": _lone_points(series)}
        is_marked = shows_points or points["markevery"]
        axes.plot(
            series.x, series.y, color=colors[series.name], label=series.name, linestyle="--" if series.dashed else "-",
            marker="o" if is_marked else "", **points,
        )
    axes.margins(x=0.02 if shows_points and not panel.strip else 0)
    _set_scale(axes, panel)
    if panel.starts_at_zero:
        axes.set_ylim(bottom=0)
    for x, label in panel.marks:
        axes.axvline(x, color="#5A6068", linestyle=(0, (3, 3)), linewidth=0.9, zorder=1)
        axes.annotate(label, (x, 1), xycoords=("data", "axes fraction"), xytext=(0, 2), textcoords="offset points", ha="center", fontsize=9)
    if panel.marks:
        axes.set_title(panel.title, pad=15)
    if panel.strip:
        from matplotlib.collections import PolyCollection

        places = [x for x, _ in panel.strip]
        edges = [places[0], *(0.5 * (a + b) for a, b in itertools.pairwise(places)), places[-1]]
        cells = [[(a, -0.035), (b, -0.035), (b, 0), (a, 0)] for a, b in itertools.pairwise(edges)]
        axes.add_collection(
            PolyCollection(cells, facecolors=[c for _, c in panel.strip], transform=axes.get_xaxis_transform(), clip_on=False, linewidth=0),
            autolim=False,
        )
        axes.tick_params(axis="x", pad=8, length=0)


def _colors_of(names: Iterable[str]) -> dict[str, str]:
    return dict(zip(dict.fromkeys(names), itertools.cycle(SERIES_COLORS)))


def figure(chart: Chart, width_in: float | None = None) -> Figure:
    """Draws a chart. Returns a Matplotlib figure, in which lines have the names of series as labels.

    width_in: width in inches; default: depends on the number of panels. Raises MissingMatplotlib.

    Examples:
        >>> from pictura import plot
        >>> chart = plot.Chart([plot.Panel("Return", "update", "", [plot.Series("mine", [0, 1], [0.1, 0.4])])])
        >>> len(plot.figure(chart).axes)
        1
    """
    matplotlib = _matplotlib("the chart")
    columns = min(chart.columns, len(chart.panels))
    rows = -(-len(chart.panels) // columns)
    width_in, height_in = width_in or columns * chart.panel_size_in[0], rows * chart.panel_size_in[1]
    if len(chart.panels) == 1:
        width_in, height_in = 1.6 * width_in, 1.3 * height_in
    with matplotlib.style.context(["default", _STYLE]):
        drawn = matplotlib.figure.Figure((width_in, height_in), dpi=_DPI, layout="constrained")
        shared = _colors_of(series.name for series in chart.panels[0].series)
        for i, panel in enumerate(chart.panels):
            axes = drawn.add_subplot(rows, columns, i + 1)
            names = [series.name for series in panel.series]
            is_shared = set(names) <= set(shared)
            _draw_panel(axes, panel, shared if is_shared else _colors_of(names))
            if not is_shared:
                axes.legend(loc="upper left", bbox_to_anchor=(1, 1), frameon=False, fontsize=9)
        if shared:
            fitting = int(width_in / (0.08 * max(map(len, shared)) + 0.6))
            drawn.legend(*drawn.axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=max(1, fitting), frameon=False, borderaxespad=0.2)
    return drawn


def _write(path: str, content: bytes) -> None:
    """Writes a temporary file and renames it, so that no reader sees a partial file. Other targets than regular files
    are written directly."""
    if path.startswith(("/dev/", "/proc/")) or (os.path.exists(path) and not os.path.isfile(path)):
        try:
            pathlib.Path(path).write_bytes(content)
        except OSError as error:  # errors of writing, unlike those of opening, lack the path
            raise OSError(error.errno, error.strerror, path) from None
        return
    target = os.path.realpath(path)
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, "is read-only", path)
    # The name is that of the command's temporary files. The next command removes the file if this process was killed.
    temporary = os.path.join(os.path.dirname(target), f".pictura-{secrets.token_hex(8)}.tmp")
    try:
        with open(temporary, "xb") as file:
            file.write(content)
        if os.path.exists(target):
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, path) from None
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary)


def save(chart: Chart, path: str) -> None:
    """Draws a chart into a file: vector graphics if the file's name ends in .svg, else a PNG.

    If Matplotlib is missing, it writes the chart's panels to the file `path` + ".json" and raises MissingMatplotlib.
    Raises OSError if the file cannot be written.

    Examples:
        >>> from pictura import plot
        >>> chart = plot.Chart([plot.Panel("Return", "update", "", [plot.Series("mine", [0, 1], [0.1, 0.4])])])
        >>> plot.save(chart, "curve.svg")
    """
    try:
        matplotlib = _matplotlib(path)
    except MissingMatplotlib as missing:
        # NaN is not valid JSON.
        panels = json.loads(json.dumps([asdict(panel) for panel in chart.panels]), parse_constant=lambda _: None)
        _write(f"{path}.json", (json.dumps({"panels": panels}, indent=1) + "\n").encode())
        raise MissingMatplotlib(f"{missing}; its data is in {path}.json") from None
    content = io.BytesIO()
    is_svg = path.endswith(".svg")
    with matplotlib.style.context(["default", _STYLE]):
        figure(chart).savefig(content, format="svg" if is_svg else "png", metadata={"Date": None} if is_svg else None)
    _write(path, content.getvalue())


def append_to(picture: str, chart: Chart) -> None:
    """Draws a chart below a PNG picture, with the picture's width. Raises MissingMatplotlib.

    Examples:
        >>> plot.append_to("case.png", plot.path_curves("probe_pedestrian", path=3)) # doctest: +SKIP
    """
    _matplotlib(picture)
    import numpy as np
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    with Image.open(picture) as opened:
        above = np.asarray(opened.convert("RGB"))
    drawn = figure(chart, above.shape[1] / _PAGE_DPI)
    drawn.set_dpi(_PAGE_DPI)
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    below = np.asarray(canvas.buffer_rgba())[..., :3]
    page = np.full((len(above) + len(below), max(above.shape[1], below.shape[1]), 3), 255, np.uint8)
    page[: len(above), : above.shape[1]] = above
    page[len(above) :, : below.shape[1]] = below
    content = io.BytesIO()
    Image.fromarray(page).save(content, format="png")
    _write(picture, content.getvalue())


def probe_charts(folder: str, pages: Sequence[dict[str, Any]] = ()) -> None:
    """Draws the charts for an output folder of `pictura probe`: means in KIND.png, and curves below the probe's
    pictures.

    pages: for each picture, the file name ("picture") and the arguments of path_curves() or takeover_curves().

    Examples:
        >>> plot.probe_charts("probe_removal") # doctest: +SKIP
    """
    summary = f"{folder}/summary.json"
    kind = _read_json(summary)["kind"]
    _matplotlib(f"{folder}/{kind}.png")
    save(probe_means(summary), f"{folder}/{kind}.png")
    for page in pages:
        picture, arguments = page["picture"], {key: value for key, value in page.items() if key != "picture"}
        append_to(f"{folder}/{picture}", (path_curves if kind == "pedestrian" else takeover_curves)(folder, **arguments))


CHARTS = {chart.__name__: chart for chart in (run_curves, evaluation_curves, severity_curves, render_rates, step_costs, rank_rates, breakdown_parts, probe_means)}


def _answer(request: dict[str, Any]) -> None:
    """Draws the chart of a request. The request's "report" selects the printed output: "json" or "text"; without
    "report" nothing is printed."""
    name, report = request.pop("chart", None), request.pop("report", None)
    if name == "probe_charts":
        return probe_charts(**request)
    _need(name in CHARTS, f"plot: expected a chart of {', '.join(CHARTS)}; got {name!r}")
    out = request.pop("out")
    chart = CHARTS[name](**request)
    save(chart, out)
    if report == "json":
        print(json.dumps({"out": out, **chart.facts}, indent=2))
    elif report == "text":
        runs = f"runs {len(request['runs'])}, " if "runs" in request else ""
        print(f"{out}: {runs}lines {len(chart.panels[0].series)}, panels {len(chart.panels)}")
    sys.stdout.flush()


def main(arguments: Sequence[str]) -> int:
    """Executes the request in the program's only argument. Returns the exit status."""
    if sys.version_info < (3, 11):
        print(f"error: charts: {sys.executable} is Python {sys.version.split()[0]}: expected 3.11 or later", file=sys.stderr)
        return 3
    if len(arguments) != 1 or not arguments[0].startswith("{"):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        _answer(json.loads(arguments[0]))
        return 0
    except MissingMatplotlib as error:
        print(f"error: {error}", file=sys.stderr)
        return 3
    except PlotError as error:
        print(f"error: {error}", file=sys.stderr)
    except OSError as error:
        print(f"error: {error.filename or 'stdout'}: {error.strerror}", file=sys.stderr)
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return 130
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
