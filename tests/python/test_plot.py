"""Charts: data read from files, and their lines, bands and colours in Matplotlib's figures."""

import json
import math
import os
import pathlib
import re
import subprocess
import sys

import pytest
from pictura import plot

matplotlib = pytest.importorskip("matplotlib")
NAN = math.nan


def run_folder(folder, seed=1, rows="", settings="a = 1"):
    """Writes a run with one update per row: agent-steps, goals per 1,000 steps, rollout seconds; 8 s of updates."""
    folder.mkdir(parents=True, exist_ok=True)
    head = "update,charts/agent_steps,driving/goals_per_1000_steps,time/rollout_s,time/update_s,a/kept,b/kept\n"
    lines = [f"{i},{row},8,0,0\n" for i, row in enumerate(rows.split(), 1)]
    (folder / "progress.csv").write_text(head + "".join(lines))
    (folder / "config.toml").write_text(f'[run]\nseed = {seed}\ndevice = "cpu"\n[train]\n{settings}\n')
    return str(folder)


def goals(*runs, **options):
    return plot.run_curves(runs, metrics=["goals_per_1000_steps"], **options)


def lines_of(chart, panel=0):
    """Returns the lines of a panel's figure: (x, y) by label."""
    axes = plot.figure(chart).axes[panel]
    return {line.get_label(): (list(line.get_xdata()), list(line.get_ydata())) for line in axes.lines if line.get_label()[0] != "_"}


def expect_refused(message, function, *arguments, **options):
    with pytest.raises(plot.PlotError) as caught:
        function(*arguments, **options)
    assert message in str(caught.value)


# ---- runs


def test_seeds_of_one_configuration_are_a_mean_with_a_band(tmp_path):
    town = run_folder(tmp_path / "town_s1", 1, "0,0,1 100,10,1 200,20,1"), run_folder(tmp_path / "town_s2", 2, "100,4,1 300,8,1")
    other = run_folder(tmp_path / "other", 1, "0,5,1 50,6,1", "a = 2")
    chart = goals(town[0], other, town[1])
    assert chart.facts["metrics"] == ["driving/goals_per_1000_steps"]
    grouped, alone = chart.facts["lines"]
    assert (grouped["name"], grouped["runs"], grouped["seeds"]) == ("town_s*, 2 seeds", list(town), [1, 2])
    assert (grouped["points"], grouped["x_first"], grouped["x_last"]) == (3, 100, 200)
    assert (alone["name"], alone["last"]) == ("other", {"driving/goals_per_1000_steps": 6})
    (panel,) = chart.panels
    assert (panel.title, panel.x_label, panel.y_label) == ("Goals", "agent-steps", "per 1,000 agent-steps")
    # The common stretch is 100 to 200 agent-steps: 10, 15, 20 and 4, 5, 6.
    assert lines_of(chart) == {"town_s*, 2 seeds": ([100, 150, 200], [7, 10, 13]), "other": ([0, 50], [5, 6])}
    (band,) = plot.figure(chart).axes[0].collections
    corners = {tuple(corner) for corner in band.get_paths()[0].vertices}
    assert corners == {(100, 4), (150, 5), (200, 6), (100, 10), (150, 15), (200, 20)}
    assert len(goals(*town, other, group="none").facts["lines"]) == 3
    os.remove(f"{other}/config.toml")
    assert goals(other, group="none").panels[0].series[0].name == "other"
    expect_refused("other/config.toml: expected in the folder of progress.csv", goals, other)


def test_a_mean_has_a_gap_at_missing_values(tmp_path):
    runs = run_folder(tmp_path / "s1", 1, "0,nan,1 10,1,1 20,1,1"), run_folder(tmp_path / "s2", 2, "0,3,1 10,3,1 20,3,1")
    ((_, y),) = lines_of(goals(*runs)).values()
    assert math.isnan(y[0]) and y[1:] == [2, 2]


def test_hours_are_the_sum_of_collecting_and_improving(tmp_path):
    chart = goals(run_folder(tmp_path / "s1", 1, "0,1,1792 10,2,3592"), x="hours")
    assert chart.panels[0].x_label.endswith("(h)")
    assert chart.panels[0].series[0].x == pytest.approx([0.5, 1.5])


def test_many_updates_are_thinned(tmp_path):
    (series,) = goals(run_folder(tmp_path / "s1", 1, " ".join(f"{i},{i % 15},1" for i in range(3000)))).panels[0].series
    assert (len(series.x), series.x[0], series.x[-1]) == (plot.MAX_RUN_POINTS, 7, 2992)
    assert set(series.y) == {7}


def test_names_are_folder_names_or_whole_paths_if_equal(tmp_path):
    a, b = run_folder(tmp_path / "a/run", 1, "0,1,1"), run_folder(tmp_path / "b/run", 1, "0,1,1", "a = 2")
    names = lambda *runs: [series.name for series in goals(*runs).panels[0].series]
    assert names(a + "/") == ["run"]
    assert names(a, b) == [a, b]
    # The common begin and end of names do not overlap.
    assert names(run_folder(tmp_path / "aa", 1, "0,1,1"), run_folder(tmp_path / "aaa", 2, "0,1,1")) == ["aa*, 2 seeds"]


def test_errors_name_missing_data_of_a_run(tmp_path):
    a = run_folder(tmp_path / "a", 1, "0,1,1 10,1,1")
    progress = pathlib.Path(a) / "progress.csv"
    expect_refused("nowhere: expected the folder of a training run", goals, f"{tmp_path}/nowhere")
    (tmp_path / "empty").mkdir()
    expect_refused("/empty: expected the folder of a training run: it has no progress.csv", goals, f"{tmp_path}/empty")
    expect_refused("young/progress.csv: has no updates yet", goals, run_folder(tmp_path / "young"))
    expect_refused("is the same folder as", goals, a, a + "/.")
    expect_refused("a/progress.csv: expected a column 'speed'; it has update, ", plot.run_curves, [a], metrics=["speed"])
    expect_refused("'kept' may be a/kept or b/kept", plot.run_curves, [a], metrics=["kept"])
    assert plot.run_curves([a], metrics=["a/kept"]).facts["metrics"] == ["a/kept"]
    expect_refused("share no range", goals, a, run_folder(tmp_path / "b", 2, "50,1,1 60,1,1"))
    progress.write_text("update,charts/agent_steps,charts/agent_steps\n1,2,3\n")
    expect_refused("a/progress.csv:1: column 'charts/agent_steps' appears twice", goals, a)
    for text, message in {"2,x,3": "got 'x' as number 2", "2,3": "got 2", "2,3,4,5": "got '5' as number 4", "2,1_0,3": "got '1_0' as number 2"}.items():
        progress.write_text(f"update,charts/agent_steps,driving/goals_per_1000_steps\n1,2,3\n{text}\n")
        expect_refused(f"a/progress.csv:3: expected 3 numbers, {message}", goals, a)
    progress.write_text("update,charts/agent_steps,driving/goals_per_1000_steps\n1,2,3\n")
    expect_refused("expected a column 'time/rollout_s'", goals, a, x="hours")
    (tmp_path / "a/config.toml").write_text('[run]\ndevice = "cpu"\n')
    expect_refused("a/config.toml: expected a number run.seed", goals, a)


# ---- evaluations


def row(density, value, **distances):
    metrics = dict.fromkeys(["at_fault_collision_rate", "off_road_rate", "red_light_rate", "goals_per_vehicle"], value)
    return {"density": density, **metrics, **(distances or {"km_per_infraction": 1})}


def point(agent_steps, *rows):
    return {"agent_steps": agent_steps, "gpu_hours": agent_steps / 1000, "rows": rows}


@pytest.fixture
def curves(tmp_path):
    def written(*lines):
        (tmp_path / "curves.json").write_text(json.dumps({"lines": lines}))
        return f"{tmp_path}/curves.json"

    return written


def test_lines_are_medium_traffic_in_a_band_of_all_densities(curves):
    agent = {"name": "agent", "points": [point(1000, row("light", 1), row("medium", 3), row("dense", 2)), point(3000, row("dense", 5), row("medium", 4, km_per_infraction=None))]}
    path = curves(agent, {"name": "baseline", "dashed": True, "points": [point(2000, row("medium", 7))]})
    chart = plot.evaluation_curves(path)
    assert len(chart.panels) == 5
    for panel in range(4):
        assert lines_of(chart, panel) == {"agent": ([1000, 3000], [3, 4]), "baseline": ([2000], [7])}
        series = chart.panels[panel].series[0]
        assert (series.low, series.high) == ([1, 4], [3, 5])
    solid, dashed = plot.figure(chart).axes[0].lines
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    # Without an infraction at medium density there is no distance per infraction.
    distance = chart.panels[4].series[0]
    assert math.isnan(distance.y[1]) and distance.low[1] == 1
    assert plot.evaluation_curves(path, x="hours").panels[0].series[0].x == [1, 3]
    assert [line["points"] for line in chart.facts["lines"]] == [2, 1]


def test_rows_with_distances_per_infraction_add_panels(curves):
    titles = lambda *rows: [panel.title for panel in plot.evaluation_curves(curves({"name": "a", "points": [point(1, *rows)]})).panels[4:]]
    old, both = row("medium", 1, km_per_at_fault_infraction=1), row("medium", 1, km_per_infraction=2, km_per_at_fault_infraction=3)
    assert titles(row("medium", 1)) == ["Distance per infraction"]
    assert titles(old) == ["Distance per at-fault infraction"]
    assert titles(both) == ["Distance per infraction", "Distance per at-fault infraction"]
    # A line of both kinds has a gap where a point lacks one.
    panels = plot.evaluation_curves(curves({"name": "a", "points": [point(1, old), point(2, both)]})).panels
    assert math.isnan(panels[4].series[0].y[0]) and panels[4].series[0].y[1] == 2
    assert panels[5].series[0].y == [1, 3]


def test_errors_name_missing_data_of_evaluations(curves, tmp_path):
    def expect_refused_lines(message, *lines):
        expect_refused(message, plot.evaluation_curves, curves(*lines))

    expect_refused_lines("curves.json: expected a line or more")
    expect_refused_lines("line 1: expected a key 'name'", {"points": []})
    expect_refused_lines("line 'a': expected a point or more", {"name": "a", "points": []})
    expect_refused_lines("line 'a': expected a row of medium density", {"name": "a", "points": [point(1, row("light", 1))]})
    expect_refused_lines("line 'a': expected points in ascending order", {"name": "a", "points": [point(2, row("medium", 1)), point(1, row("medium", 1))]})
    expect_refused_lines("line 'a': expected a key 'at_fault_collision_rate'", {"name": "a", "points": [point(1, {"density": "medium"})]})
    (tmp_path / "text.json").write_text("curves")
    expect_refused("text.json: expected JSON", plot.evaluation_curves, f"{tmp_path}/text.json")


def by_severity(density, severity, value, driver=None):
    names = ["at_fault_collision_rate", "off_road_rate", "red_light_rate", "goals_per_vehicle", "km_per_infraction", "km_per_at_fault_infraction"]
    numbers = {key: number for name in names for key, number in ((name, value), (f"{name}_half_width_95", 2))}
    return {"density": density, "driver": driver, "camera_severity": severity, **numbers}


def test_severities_are_lines_by_file_and_density_in_their_intervals(tmp_path):
    rows = [by_severity("light", 1, 5), by_severity("light", 0, 1), by_severity("light", 0, 9, "lane"), by_severity("dense", 0, 3)]
    a, b = tmp_path / "a.json", tmp_path / "b.json"
    a.write_text(json.dumps({"rows": rows}))
    b.write_text(json.dumps({"rows": rows[3:]}))
    chart = plot.severity_curves([str(a)])
    assert len(chart.panels) == 6
    assert lines_of(chart, 3) == {"light": ([0, 1], [1, 5]), "dense": ([0], [3])}
    light = chart.panels[3].series[0]
    assert (light.low, light.high) == ([0, 3], [3, 7])
    assert [series.name for series in plot.severity_curves([str(a), str(b)]).panels[0].series] == ["a light", "a dense", "b dense"]
    b.write_text(json.dumps({"rows": [{"driver": None, "density": "light"}]}))
    expect_refused("b.json: expected a key 'camera_severity'", plot.severity_curves, [str(b)])


# ---- benchmarks


@pytest.fixture
def results(tmp_path):
    def written(content):
        (tmp_path / "results.json").write_text(json.dumps(content))
        return [f"{tmp_path}/results.json"]

    return written


def test_rendering_rates_are_read_from_several_result_files(results):
    names = ["cuda 96x54 2048 egos", "cuda 32x18 2048 egos", "cuda 96x54 64 egos", "cpu 64x64 2048 egos", "cuda 32x18 2048 egos", "other"]
    rows = [{"name": name, "value": 1e5 * (i + 1)} for i, name in enumerate(names)]
    chart = plot.render_rates(results({"results": rows}))
    assert lines_of(chart, 0) == {"cuda": ([32, 96], [2e5, 1e5])}  # ascending, and the first of two points
    assert lines_of(chart, 1) == {"cuda": ([64, 2048], [3e5, 1e5])}
    assert lines_of(chart, 2) == {"cpu": ([64], [4e5])}
    axes = plot.figure(chart).axes[0]
    assert (axes.get_xscale(), axes.get_yscale(), list(axes.get_xticks())) == ("log", "log", [32, 96])
    assert plot.render_rates(results({"bench": [{"results": [each]} for each in rows]})) == chart
    expect_refused("results.json: expected results of a benchmark", plot.render_rates, results([]))


def test_step_costs_are_reciprocal_rates(results):
    names = {"cpu, 64 worlds of 4 agents": 1e6, "cpu, 64 worlds of 1 agents": 1e5, "cpu, 1 worlds of 60 agents": 2e6, "cpu, 64 worlds of 60 agents": 4e6}
    chart = plot.step_costs(results({"results": [{"name": name, "value": value} for name, value in names.items()]}))
    assert lines_of(chart, 0) == {"cpu": ([1, 4], [pytest.approx(1e4), 1000])}
    assert lines_of(chart, 1) == {"cpu": ([1, 64], [500, 250])}


def test_rates_on_several_gpus_are_read_from_gpu_ranks_results(results):
    def row(case, gpus, rate):
        rates = {"median": rate, "min": 0.5 * rate, "max": 2 * rate}
        return {"case": case, "gpus": gpus, "agent_steps_per_s": rates, "efficiency": rate / gpus / 1e5}

    rows = [row("one", 1, 1e5), row("each", 2, 2e5), row("in_all", 2, 1.5e5)]
    chart = plot.rank_rates(results({"arguments": ["--set", "train.precision=tf32"], "rate": {"96x54": rows}}))
    assert [lines_of(chart, panel)["96x54 tf32"] for panel in range(4)] == [([1, 2], y) for y in ([1e5, 2e5], [1e5, 1.5e5], [1, 1], [1, 0.75])]
    assert (chart.panels[0].series[0].low, chart.panels[0].series[0].high) == ([5e4, 1e5], [2e5, 4e5])
    assert list(lines_of(plot.rank_rates(results({"rate": {"96x54": rows}})))) == ["96x54 bf16"]
    expect_refused("expected rates of scripts/gpu_ranks", plot.rank_rates, results({}))


def test_a_breakdown_is_compared_with_the_papers(results):
    case, paper = "cuda 32x18 128 agents a world", {"64x36": {"total": 9.0, "rendering": 0.5}}
    rows = [{"name": f"{case}, {part}", "value": value} for part, value in {"env": 1, "rendering": 2, "total": 4, "chunk": 8}.items()]
    chart = plot.breakdown_parts(results({"results": rows}), ["env", "rendering", "total"], paper)
    mine = "cuda, 128 agents a world"
    assert lines_of(chart, 0) == {mine: ([32], [4]), "the paper, H100 NVL": ([64], [9])}
    assert lines_of(chart, 1) == {mine: ([32], [2]), "the paper, H100 NVL": ([64], [0.5])}
    assert chart.panels[2].title == mine
    assert lines_of(chart, 2) == {"env": ([32], [1]), "rendering": ([32], [2]), "total": ([32], [4])}
    # A panel with other names has its own legend; the legend above belongs to the first two panels.
    drawn = plot.figure(chart)
    assert [axes.get_legend() is not None for axes in drawn.axes] == [False, False, True]
    assert [text.get_text() for text in drawn.legends[0].get_texts()] == list(lines_of(chart, 0))
    expect_refused("expected results of bench breakdown", plot.breakdown_parts, results({"results": [{"name": "cpu 8x8 3 egos", "value": 1}]}), ["env"], paper)


# ---- probes


def estimates(value, half_width=0.1):
    names = ["abs_d_value", "abs_d_p_brake", "d_value", "d_p_brake"]
    return {**dict.fromkeys(names, value), **{f"{name}_half_width_95": half_width for name in names}}


def write_summary(folder, kind, rows, **more):
    policy = [{"name": "a", "untrained_hash": None}, {"name": "b", "untrained_hash": "0123"}]
    (folder / "summary.json").write_text(json.dumps({"kind": kind, "policy": policy, "rows": rows, **more}))
    return f"{folder}/summary.json"


def test_removal_shows_occlusion_and_distances_of_hidden_users(tmp_path):
    def row(group, value, distance=None, policy="a", cases=3, **more):
        bounds = {"distance_from_m": distance, "distance_to_m": distance + 10 if distance is not None else None}
        return {"policy": policy, "group": group, "in_frame": group != "no camera", "cases": cases, **bounds, **estimates(value), **more}

    rows = [
        row("0-10 %", 0.5, occlusion_mean=0.04),
        row("10-20 %", 0.4, occlusion_mean=None, cases=0),
        row("hidden", 0.05, occlusion_mean=1.0),
        row("no camera", 9, occlusion_mean=0.0),
        row("hidden", 0.2, distance=10, occlusion_mean=1.0),
        row("0-10 %", 7, distance=10, occlusion_mean=0.0),
    ]
    chart = plot.probe_means(write_summary(tmp_path, "removal", rows))
    assert lines_of(chart, 0) == {"a": ([4, 100], [0.5, 0.05]), "untrained b": ([], [])}
    assert lines_of(chart, 3)["a"] == ([15], [0.2])
    assert chart.panels[0].series[0].low == [0.4, 0]  # no mean of magnitudes is below 0
    assert chart.panels[0].series[0].high == pytest.approx([0.6, 0.15])
    named = plot.probe_means(f"{tmp_path}/summary.json", names={"a": "an earlier a"})
    assert set(lines_of(named, 0)) == {"an earlier a", "untrained b"}


def test_pedestrian_shows_places_in_at_least_half_of_the_paths(tmp_path):
    def row(at_m, cases, share, value, half_width=0.1):
        return {"policy": "a", "from_first_sight_m": at_m, "cases": cases, "visible_share_mean": share, **estimates(value, half_width)}

    rows = [row(None, 9, 1, 9), row(-0.5, 2, 0, 0, None), row(0, 4, 0.5, -0.2), row(0.5, 4, 1, -0.3), row(1, 1, 1, 9)]
    chart = plot.probe_means(write_summary(tmp_path, "pedestrian", rows, paths=4))
    assert lines_of(chart, 0)["a"] == ([-0.5, 0, 0.5], [0, -0.2, -0.3])
    assert math.isnan(chart.panels[0].series[0].low[0]) and chart.panels[0].series[0].low[1] == pytest.approx(-0.3)
    assert chart.panels[0].strip == list(zip([-0.5, 0, 0.5], plot.SHARE_COLORS, strict=True))
    # Cells reach half way to their neighbours.
    strip = plot.figure(chart).axes[0].collections[-1]
    assert [tuple(path.vertices[[0, 1], 0]) for path in strip.get_paths()] == [(-0.5, -0.25), (-0.25, 0.25), (0.25, 0.5)]
    assert [matplotlib.colors.to_hex(color).upper() for color in strip.get_facecolors()] == list(plot.SHARE_COLORS)


def corner_row(walls, case, reveal_s=(0.1, 0.2), policy="a", **more):
    whole = {"walls": walls, "case": case, "policy": policy, "less_policy": None, "less_case": None}
    quantiles = {"reveal_s_p10": reveal_s[0], "reveal_s_p90": reveal_s[1]}
    curve = {"speed_curve_mps": [5, 4, None], "speed_curve_mps_half_width_95": [1, None, None], "driving": [2, 1, 0]}
    return {**whole, **quantiles, **curve, **more}


def test_corner_shows_speeds_with_and_without_walls(tmp_path):
    rows = [corner_row(walls, case) for walls in (True, False) for case in ("hidden", "removed", "empty")]
    rows += [corner_row(True, "hidden", (0.0, 0.1), policy="b"), corner_row(True, "hidden", less_policy="b")]
    chart = plot.probe_means(write_summary(tmp_path, "corner", rows, takeover_steps=3))
    assert [panel.title for panel in chart.panels[::3]] == ["hidden vehicle, walls", "hidden vehicle, no walls"]
    lines = lines_of(chart, 0)
    assert list(lines) == ["a", "untrained b"]
    x, y = lines["a"]
    assert x == pytest.approx([0, 0.1, 0.2]) and y[:2] == [5, 4] and math.isnan(y[2])
    assert chart.panels[0].series[0].low[0] == 4 and math.isnan(chart.panels[0].series[0].low[1])
    dark = lambda panel: [color != plot._REVEALING[0] for _, color in chart.panels[panel].strip]
    assert dark(0) == [True, True, True, False]  # both policies
    assert dark(3) == [False, True, True, False]


def test_pages_have_the_curves_of_their_path_or_pair(tmp_path):
    write_summary(tmp_path, "pedestrian", [])
    head = "path,along_m,visible_share,a/d_value,a/d_p_brake,b/d_value,b/d_p_brake\n"
    (tmp_path / "cases.csv").write_text(head + "0,0,0,9,9,9,9\n1,0,0,1,2,3,4\n1,0.5,1,5,6,7,8\n")
    chart = plot.path_curves(str(tmp_path), 1, [(0.5, "a")])
    assert lines_of(chart, 0) == {"a": ([0, 0.5], [1, 5]), "untrained b": ([0, 0.5], [3, 7])}
    assert lines_of(chart, 1) == {"a": ([0, 0.5], [2, 6]), "untrained b": ([0, 0.5], [4, 8])}
    assert [text.get_text() for text in plot.figure(chart).axes[0].texts] == ["a"]

    write_summary(tmp_path, "corner", [])
    head = "pair,walls,case,policy,input_s,sight_s,speed_mps_0.0,speed_mps_0.1\n"
    (tmp_path / "cases.csv").write_text(head + "3,on,hidden,a,0.1,0.1,5,4\n3,on,hidden,b,0.0,,5,\n3,on,empty,a,,,9,9\n3,off,hidden,a,0.0,0.0,2,1\n2,on,hidden,a,,,9,9\n")
    chart = plot.takeover_curves(str(tmp_path), 3)
    assert lines_of(chart, 0)["a"] == ([0, 0.1], [5, 4])
    assert math.isnan(lines_of(chart, 0)["untrained b"][1][1])
    assert chart.panels[0].marks == [(0.0, "x"), (0.1, "xo")]
    assert (lines_of(chart, 1), chart.panels[1].marks) == ({"a": ([0, 0.1], [2, 1])}, [(0.0, "x")])  # no walls hide the vehicle


def test_charts_are_appended_below_pictures(tmp_path):
    from PIL import Image

    write_summary(tmp_path, "pedestrian", [], paths=1)
    (tmp_path / "cases.csv").write_text("path,along_m,visible_share,a/d_value,a/d_p_brake,b/d_value,b/d_p_brake\n0,0,0,1,2,3,4\n")
    Image.new("RGB", (640, 100), (1, 2, 3)).save(tmp_path / "path_000.png")
    plot.probe_charts(str(tmp_path), [{"picture": "path_000.png", "path": 0}])
    page = Image.open(tmp_path / "path_000.png")
    assert page.width == 640 and page.height > 300
    assert page.crop((0, 0, 640, 100)).getcolors() == [(64000, (1, 2, 3))]
    assert (tmp_path / "pedestrian.png").exists()


def test_files_other_than_summaries_are_refused(tmp_path):
    (tmp_path / "summary.json").write_text("[]")
    expect_refused("summary.json: expected the summary of a probe of removal, pedestrian, corner", plot.probe_means, f"{tmp_path}/summary.json")
    expect_refused("expected a key 'paths'", plot.probe_means, write_summary(tmp_path, "pedestrian", [{"from_first_sight_m": 0, "cases": 1}]))


# ---- drawing


def test_points_between_gaps_are_dots_and_marks_are_above(tmp_path):
    series = plot.Series("a", list(range(20)), [NAN, 1, NAN, 2, 2, *[3] * 14, NAN])
    panel = plot.Panel("a", "x (m)", "y (m)", [series], marks=[(5, "m")])
    axes = plot.figure(plot.Chart([panel])).axes[0]
    assert axes.lines[0].get_markevery() == [1]
    assert (axes.get_xlabel(), axes.get_ylabel(), [text.get_text() for text in axes.texts]) == ("x (m)", "y (m)", ["m"])


def test_numbers_of_ticks_are_short():
    texts = {1.5e9: "1.5G", 2e6: "2M", 5e5: "500k", 8192: "8192", 2e4: "20k", 20480: "20480", 0.25: "0.25", 0: "0", -2e6: "\N{MINUS SIGN}2M"}
    assert {value: plot._tick_text(value) for value in texts} == texts
    assert plot._apart([64, 128, 256, 512, 1024, 2048, 4096, 8192, 20480]) == [64, 256, 1024, 4096, 20480]
    assert plot._apart([7]) == [7]


def test_pictures_are_reproducible_png_or_svg_and_replace_older_files(tmp_path):
    chart = goals(run_folder(tmp_path / "a", 1, "0,1,1 10,2,1"))
    for name, head in (("a.png", b"\x89PNG"), ("a.svg", b"<?xml")):
        path = tmp_path / name
        plot.save(chart, str(path))
        first = path.read_bytes()
        assert first.startswith(head)
        path.write_bytes(b"old")
        path.chmod(0o640)
        link = tmp_path / f"link_{name}"
        link.symlink_to(path)
        plot.save(chart, str(link))
        assert link.is_symlink() and path.read_bytes() == first and path.stat().st_mode & 0o777 == 0o640
    assert not list(tmp_path.glob(".pictura*"))
    with pytest.raises(OSError) as caught:
        plot.save(chart, str(tmp_path / "nowhere/a.png"))
    assert caught.value.filename == str(tmp_path / "nowhere/a.png")


def test_matplotlib_settings_of_users_are_ignored_and_kept(tmp_path):
    chart = goals(run_folder(tmp_path / "a", 1, "0,1,1 10,2,1"))
    plot.save(chart, str(tmp_path / "a.png"))
    with matplotlib.rc_context({"font.size": 30, "savefig.bbox": "tight"}):
        plot.save(chart, str(tmp_path / "b.png"))
        assert matplotlib.rcParams["font.size"] == 30
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_document_shows_charts(tmp_path, monkeypatch, curves):
    document = pathlib.Path(__file__).parents[2] / "docs/reference/python/plot.md"
    (block,) = re.findall(r"```python\n(.*?)```", document.read_text(), re.S)
    monkeypatch.chdir(tmp_path)
    metrics = ",".join(plot.METRICS)
    run = pathlib.Path(run_folder(tmp_path / "runs/a"))
    (run / "progress.csv").write_text(f"update,time/rollout_s,time/update_s,{metrics}\n1,1,1,1,1,1,1,1,1\n")
    (tmp_path / "probe_removal").mkdir()
    write_summary(tmp_path / "probe_removal", "removal", [])
    curves({"name": "a", "points": [point(1, row("medium", 1))]})
    exec(compile(block, "docs/reference/python/plot.md", "exec"), {})  # noqa: S102
    assert (tmp_path / "curves.png").exists()


def answer(request, python=(sys.executable,)):
    """Runs plot.py as a program outside the package: reading files needs neither NumPy nor an extension."""
    return subprocess.run([*python, plot.__file__, json.dumps(request)], capture_output=True, text=True, env={"PYTHONSAFEPATH": "1"})


def test_the_program_answers_a_request(tmp_path):
    runs, out = [run_folder(tmp_path / "a", 1, "0,1,1 10,2,1")], str(tmp_path / "a.png")
    request = {"chart": "run_curves", "runs": runs, "metrics": ["goals_per_1000_steps"], "out": out}
    assert (answer(request).returncode, answer(request).stdout) == (0, "")
    assert answer({**request, "report": "text"}).stdout == f"{out}: runs 1, lines 1, panels 1\n"
    facts = json.loads(answer({**request, "report": "json"}).stdout)
    assert (facts["out"], facts["x"], facts["lines"][0]["x_last"]) == (out, "agent_steps", 10)
    for changed, message in (
        ({"runs": ["nowhere"]}, "error: nowhere: expected the folder of a training run\n"),
        ({"out": "/proc/nowhere/a.png"}, "error: /proc/nowhere/a.png: "),
        ({"chart": "pie"}, "error: plot: expected a chart of run_curves, "),
    ):
        result = answer({**request, **changed})
        assert result.returncode == 1 and result.stderr.startswith(message)
    assert subprocess.run([sys.executable, plot.__file__], capture_output=True).returncode == 2


def test_without_matplotlib_the_data_is_written(tmp_path):
    runs, out = [run_folder(tmp_path / "a", 1, "0,1,1 10,nan,1")], str(tmp_path / "a.png")
    # -S: no installed packages.
    result = answer({"chart": "run_curves", "runs": runs, "metrics": ["goals_per_1000_steps"], "out": out}, (sys.executable, "-S"))
    assert result.returncode == 3
    assert f"{out}: not drawn" in result.stderr and "pip install 'pictura[plot]'" in result.stderr
    assert not (tmp_path / "a.png").exists()
    (panel,) = json.loads((tmp_path / "a.png.json").read_text())["panels"]
    assert (panel["title"], panel["series"][0]["x"], panel["series"][0]["y"]) == ("Goals", [0, 10], [1, None])
    write_summary(tmp_path, "pedestrian", [], paths=1)
    result = answer({"chart": "probe_charts", "folder": str(tmp_path)}, (sys.executable, "-S"))
    assert result.returncode == 3 and "pedestrian.png: not drawn" in result.stderr
