"""`pictura bench` from outside."""

import json
import os
import pathlib
import unittest

from command_case import CONFIGS, TINY, CommandCase, run


def has_cuda():
    """Whether this build knows the renderer `cuda`, with a device or without."""
    return "cpu, cuda" in run("bench", "render", "--backend", "none").stderr


class Benchmarks(CommandCase):
    QUICK = ["--map", "procedural:1", "--agents", 6, "--repeats", 3, "--repeat-seconds", 0.01]

    def test_numbers_that_are_not_finite_or_out_of_range_are_refused(self):
        self.assert_bad_numbers_are_refused(
            ("bench", "soak", "--minutes"),
            ("bench", "quality", "--line-floor"),
            ("bench", "render", "--repeat-seconds"),
            ("bench", "render", "--egos"),
            ("bench", "simulate", "--repeat-seconds"),
            ("bench", "simulate", "--slots"),
            ("bench", "history", "--views"),
            ("bench", "history", "--repeat-seconds"),
        )

    def test_rendering_is_measured_for_each_backend_size_and_number_of_egos(self):
        facts = self.json_of("bench", "render", *self.QUICK, "--backend", "cpu,null", "--size", "8x8,9x5", "--egos", "3,5")
        self.assertLessEqual({"workload", "backend", "device", "commit", "results"}, facts.keys())
        self.assertIn("6 agents in each of 1 worlds", facts["workload"])
        patches = ["--size", "8x8", "--egos", 3, "--format", "bf16", "--patch", 12]
        self.assertIn("bf16 in patches of 12 px", self.json_of("bench", "render", *self.QUICK, *patches)["workload"])
        rows = {row["name"]: row for row in facts["results"]}
        cases = [f"{b} {s} {e} egos" for b in ["cpu", "null"] for s in ["8x8", "9x5"] for e in [3, 5]]
        self.assertEqual(rows.keys(), {f"{case}{of}" for case in cases for of in ["", ", one call", ", one image"]})
        for row in rows.values():
            self.assertEqual(row["repeats"], 3)
            self.assertLessEqual(row["min"], row["value"])
            self.assertLessEqual(row["value"], row["max"])
        for case in cases:
            egos = int(case.split()[-2])
            rate, call, image = (rows[case + of]["value"] for of in ["", ", one call", ", one image"])
            self.assertAlmostEqual(rate * call / 1e3 / egos, 1, places=6)
            self.assertAlmostEqual(image * 4 * egos / call, 1, places=6)

    def test_history_rendering_is_measured_relative_to_the_present_scene(self):
        small = [*self.QUICK, "--slots", 12, "--steps", 4, "--views", 10, "--size", "8x8"]
        facts = self.json_of("bench", "history", *small, "--check", 5)
        self.assertIn("images of 5 agents out of the history equal those drawn at the time", facts["workload"])
        self.assertIn("12 agents", facts["workload"])
        rows = {row["name"].removeprefix("cpu 8x8 10 views, "): row for row in facts["results"]}
        present, history, ratio, call = (
            rows[name] for name in ("present scene", "history of 4 steps", "history over present", "one call of the history")
        )
        for row in (present, history, ratio, call):
            self.assertEqual(row["repeats"], 3)
        self.assertAlmostEqual(history["value"] * call["value"] / 1e3 / 10, 1, places=6)
        # Images of both kinds take about as long.
        self.assertTrue(0.1 < ratio["value"] < 10, ratio)
        self.assertTrue(ratio["min"] <= history["max"] / present["min"])
        self.assertGreater(rows["memory of the history"]["value"], 0)
        self.assert_refused(2, "vulkan", "bench", "history", *small, "--backend", "vulkan")
        self.assert_refused(2, "--views", "bench", "history", "--views", 0)
        if os.environ.get("PICTURA_REQUIRE_GPU") == "1":
            self.assertIn("NVIDIA", self.json_of("bench", "history", *small, "--backend", "cuda")["device"])

    def test_rendering_on_a_device_names_it_and_its_driver(self):
        if os.environ.get("PICTURA_REQUIRE_GPU") != "1":
            self.skipTest("PICTURA_REQUIRE_GPU is not 1")
        facts = self.json_of("bench", "render", *self.QUICK, "--backend", "cuda", "--size", "8x8", "--egos", 3)
        self.assertRegex(facts["driver"], r"^\d+\.\d+.*, CUDA \d+\.\d+$")
        self.assertIn("NVIDIA", facts["device"])
        self.assertRegex(facts["workload"], "cuda: requested; kernels built (earlier )?for sm_")
        rows = {row["name"]: row["value"] for row in facts["results"]}
        self.assertGreater(rows["cuda 8x8 3 egos"], 0)
        self.assertEqual(rows["cuda 8x8 3 egos, values unlike the oracle's"], 0)
        patches = ["--size", "30x21", "--egos", 3, "--format", "bf16", "--patch", 12]
        facts = self.json_of("bench", "render", *self.QUICK, "--backend", "cuda", *patches)
        rows = {row["name"]: row["value"] for row in facts["results"]}
        self.assertEqual(rows["cuda 30x21 3 egos, values unlike the oracle's"], 0)

    def test_steps_are_measured_with_and_without_entity_sets(self):
        facts = self.json_of("bench", "simulate", *self.QUICK, "--worlds", 3)
        rows = {row["name"]: row for row in facts["results"]}
        cases = ["cpu, 3 worlds of 6 agents", "cpu, 3 worlds of 6 agents without entity sets"]
        self.assertEqual(rows.keys(), {f"{case}{of}" for case in cases for of in ["", ", slots", ", one step"]})
        for case in cases:
            live, slots, step = (rows[case + of]["value"] for of in ["", ", slots", ", one step"])
            self.assertAlmostEqual(slots * step / 1e3, 18, places=6)
            self.assertTrue(0 < live <= slots)
        packed = self.json_of("bench", "simulate", *self.QUICK, "--slots", 20)
        self.assertEqual(packed["results"][0]["name"], "cpu, 20 agents in worlds of 1 to 6")
        self.assert_refused(2, "--pedestrians and --cyclists", "bench", "simulate", *self.QUICK, "--pedestrians", 0.7, "--cyclists", 0.7)

    def test_a_measurement_is_compared_with_an_earlier_one(self):
        earlier = self.folder / "earlier.json"
        simulate = ["bench", "simulate", *self.QUICK]
        facts = self.json_of(*simulate)
        rate, slots, step = facts["results"][:3]
        # Results of a run that is a thousand times slower, a thousand times faster, and in between.
        for row, low, middle, high in ((rate, 1e-3, 1e-3, 1e-3), (slots, 1e3, 1e3, 1e3), (step, 1e-3, 1, 1e3)):
            row.update(min=row["min"] * low, value=row["value"] * middle, max=row["max"] * high)
        facts.update(device="Another", commit="0123abcd", results=[rate, slots, step, {**step, "name": "gone"}])
        earlier.write_text(json.dumps(facts))
        comparison = self.json_of(*simulate, "--compare", earlier)["comparison"]
        self.assertEqual((comparison["commit"], comparison["same_workload"], comparison["same_device"]), ("0123abcd", True, False))
        rows = comparison["results"]
        self.assertEqual([row["name"] for row in rows], [rate["name"], slots["name"], step["name"]])
        self.assertEqual([row["change"] for row in rows], ["better", "worse", "within the spread"])
        for row in rows:
            self.assertAlmostEqual(row["ratio"] * row["before"] / row["after"], 1)
            self.assertTrue(row["low"] <= row["ratio"] <= row["high"])
        # A step that takes longer is worse.
        step.update(min=step["min"] / 10, value=step["min"] / 10, max=step["min"] / 10)
        earlier.write_text(json.dumps(facts))
        printed = run(*simulate, "--compare", earlier).stdout
        self.assertIn("the device differs: Another", printed)
        self.assertTrue(printed.endswith("2 worse, 1 better, 0 within the spread\n"), printed)
        self.assert_refused(1, "none.json", *simulate, "--compare", self.folder / "none.json")
        for bad in ("{", "[]", '{"results": []}', '{"results": [{"name": "cpu", "value": 1}]}'):
            earlier.write_text(bad)
            self.assert_refused(1, "earlier.json: expected the output of a benchmark's --json", "bench", "render", *self.QUICK, "--compare", earlier)

    def test_quality_is_measured_on_each_map_and_size(self):
        maps = ["--map", "procedural:1,procedural:2", "--agents", 4, "--steps", 1, "--views", 1]
        facts = self.json_of("bench", "quality", *maps, "--size", "8x8,9x5")
        self.assertIn("maps procedural:1 procedural:2,", facts["workload"])
        ways = ["1 sample", "2x2 samples", "area coverage", "oracle", "oracle in bytes", "oracle, worst image"]
        self.assertEqual([row["name"] for row in facts["results"]], [f"{way} {size}" for size in ["8x8", "9x5"] for way in ways])
        self.assert_refused(2, "'8'", "bench", "quality", "--map", "no-town.xodr", "--size", "9x5,8")

    def test_distributions_over_episodes(self):
        result = self.json_of("bench", "worlds", "--map", self.town(), "--episodes", 3, "--agents", 30)
        values = {row["name"].split(": ", 1)[1]: row for row in result["results"]}
        self.assertEqual({row["repeats"] for row in result["results"]}, {3})
        classes = sum(values[name]["mean"] for name in ("vehicles", "cyclists", "pedestrians"))
        refused = sum(values[name]["mean"] for name in ("refused, places taken", "refused, no place"))
        self.assertAlmostEqual(classes + refused, 30)
        self.assertEqual(values["unreachable waypoints of the first chains"]["max"], 0)
        self.assertGreater(values["random policy: collisions"]["mean"] + values["random policy: off-road"]["mean"], 0)
        self.assertGreater(values["lane driver: goals"]["mean"], 0)
        self.assertEqual(values["lane driver: red lights"]["max"], 0)

    def test_a_soak_names_images_out_of_tolerance(self):
        soak = ["bench", "soak", "--map", "procedural:1", "--agents", 20, "--views", 2]
        oracle = self.json_of(*soak, "--backend", "cpu", "--scenes", 3)
        self.assertEqual((oracle["scenes"], oracle["images_out_of_tolerance"], oracle["worst"]), (3, 0, 0))
        self.assertEqual((oracle["differing_plane_pixels"], oracle["differing_answers"]), (0, 0))
        for key in ("images", "plane_pixels", "visibility_queries"):
            self.assertGreater(oracle[key], 6, key)
        # Black images are out of tolerance. A scene does not depend on the scenes before it.
        result = run(*soak, "--backend", "null", "--first", 2, "--scenes", 1, "--json")
        self.assertEqual(result.returncode, 1)
        black = json.loads(result.stdout)
        self.assertGreater(black["images_out_of_tolerance"], 0)
        self.assertGreater(black["differing_answers"], 0)
        self.assertEqual({fault["scene"] for fault in black["faults"] + black["visibility_faults"]}, {2})
        self.assertIn("--first 2 --scenes 1", result.stderr)
        again = json.loads(run(*soak, "--backend", "null", "--first", 1, "--scenes", 2, "--json").stdout)
        for key in ("faults", "visibility_faults"):
            self.assertEqual([fault for fault in again[key] if fault["scene"] == 2], black[key])

    def test_rendering_rates_are_drawn_from_several_result_files(self):
        names = ["cuda 32x18 2048 egos", "cuda 96x54 2048 egos", "cuda 96x54 64 egos", "cpu 64x64 2048 egos"]
        one = {"results": [{"name": name, "value": 1e5 + 1e5 * i} for i, name in enumerate(names)]}
        results, figure, again = (self.folder / name for name in ("results.json", "rates.png", "again.png"))
        results.write_text(json.dumps(one))
        run("bench", "render", "--plot", results, "--figure", figure)
        self.assertGreater(figure.stat().st_size, 5000)
        results.write_text(json.dumps({"bench": [{"results": [row]} for row in one["results"]]}))
        run("bench", "render", "--plot", results, "--figure", again)
        self.assertEqual(figure.read_bytes(), again.read_bytes())
        one["results"][0]["value"] = 1e4
        results.write_text(json.dumps(one))
        run("bench", "render", "--plot", results, "--figure", again)
        self.assertNotEqual(figure.read_bytes(), again.read_bytes())
        self.assert_refused(2, "--plot and --figure", "bench", "render", "--figure", figure)

    def test_rates_on_several_gpus_are_drawn_from_gpu_ranks_results(self):
        def row(case, gpus, rate):
            rates = {"median": rate, "min": 0.9 * rate, "max": 1.1 * rate}
            return {"case": case, "gpus": gpus, "agent_steps_per_s": rates, "efficiency": rate / gpus / 1e5}

        results, figure, again = (self.folder / name for name in ("gpu_ranks.json", "ranks.png", "again.png"))
        rows = [row("one", 1, 1e5), row("each", 2, 2e5), row("in_all", 2, 1.5e5)]
        results.write_text(json.dumps({"arguments": [], "rate": {"96x54": rows}}))
        run("bench", "train", "--plot", results, "--figure", figure)
        self.assertGreater(figure.stat().st_size, 5000)
        results.write_text(json.dumps({"arguments": ["--set", "train.precision=tf32"], "rate": {"96x54": rows}}))
        run("bench", "train", "--plot", results, "--figure", again)
        self.assertNotEqual(figure.read_bytes(), again.read_bytes(), "another precision, another name")
        results.write_text("{}")
        self.assert_refused(1, "expected rates of scripts/gpu_ranks", "bench", "train", "--plot", results, "--figure", figure)

    def test_the_cost_of_steps_is_drawn_from_results(self):
        names = ["cpu, 64 worlds of 1 agents", "cpu, 64 worlds of 4 agents", "cpu, 1 worlds of 60 agents"]
        results = self.folder / "results.json"
        results.write_text(json.dumps({"results": [{"name": name, "value": 1e6} for name in names]}))
        figure = self.folder / "cost.png"
        run("bench", "simulate", "--plot", results, "--figure", figure)
        self.assertGreater(figure.stat().st_size, 5000)
        refused = self.assert_refused
        refused(2, "--plot and --figure", "bench", "simulate", "--plot", results)
        refused(1, "none.json", "bench", "simulate", "--plot", self.folder / "none.json", "--figure", figure)
        results.write_text("[]")
        refused(1, "expected results", "bench", "simulate", "--plot", results, "--figure", figure)
        refused(2, "--worlds excludes --sweep", "bench", "simulate", "--sweep", "worlds", "--worlds", 3)
        refused(2, "vulkan", "bench", "simulate", *self.QUICK, "--backend", "cpu,vulkan", "--map", "no-town.xodr")

    def test_errors_name_bad_arguments(self):
        def refused(status, message, *arguments):
            self.assert_refused(status, message, "bench", "render", *self.QUICK, *arguments)

        refused(2, "--sweep egos", "--sweep", "egos", "--egos", 3)
        refused(2, "--sweep sizes", "--sweep", "sizes", "--size", "8x8")
        refused(2, "--memory: expected one", "--memory", "--egos", "3,4")
        refused(2, "--size", "--size", "8")
        # An error in the last case is reported before a map is read.
        no_town = ["--map", self.folder / "no-town.xodr"]
        refused(2, "'8'", "--size", "9x5,8", *no_town)
        refused(2, "vulkan", "--backend", "cpu,vulkan", *no_town)
        refused(1, "no-town", *no_town)
        if not pathlib.Path("/dev/nvidia0").exists():
            status, message = (1, "renderer cuda: no CUDA device") if has_cuda() else (2, "expected one of cpu")
            refused(status, message, "--backend", "cuda")
            refused(1, "CUDA", "--memory", "--egos", 3)


class TrainingBenchmarks(CommandCase):
    def test_the_default_configuration_is_named_where_it_does_not_exist(self):
        for command in ("train", "breakdown"):
            result = run("bench", command, cwd=self.folder)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertRegex(result.stderr, r"--config: the default, configs/\w+\.toml, exists only in the root of the repository")

    def test_bench_train_prints_simulator_renderer_and_device(self):
        facts = self.json_of("bench", "train", "--updates", 2, "--config", CONFIGS / "smoke.toml", "--renderer", "null",
                             "--device", "cpu")  # fmt: skip
        self.assertEqual(facts["backend"], "simulator cpu, renderer null, learning on cpu")
        rows = {row["name"].removeprefix("train, "): row for row in facts["results"]}
        self.assertEqual({row["repeats"] for row in rows.values()}, {2})
        self.assertAlmostEqual(rows["slots"]["max"] * rows["one update"]["min"], 16 * 16, places=3)
        self.assertTrue(0 < rows["active agents"]["value"] <= rows["slots"]["value"])
        self.assertTrue(0 < rows["live share of slot-steps"]["value"] <= 100)
        self.assertTrue(0 < rows["kept share of transitions"]["value"] <= 100)
        parts = sum(row["mean"] for name, row in rows.items() if name.startswith("phase ") or name == "in no phase")
        self.assertAlmostEqual(parts, rows["one update"]["mean"], places=6)
        self.assertAlmostEqual(rows["collecting"]["mean"] + rows["improving"]["mean"], rows["one update"]["mean"], places=6)

    def test_bench_train_begins_with_the_weights_of_a_checkpoint(self):
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run")
        bench = ["bench", "train", "--updates", 1, *TINY]
        facts = self.json_of(*bench, "--init-from", self.folder / "run" / "checkpoint.ckpt")
        self.assertIn("weights of", facts["workload"])
        self.assert_refused(1, "no.ckpt", *bench, "--init-from", self.folder / "no.ckpt")

    def test_breakdown_of_an_update_is_measured_by_size_and_renderer(self):
        if run("bench", "breakdown", "--help").returncode != 0:
            self.skipTest("built without benchmarks")
        small = ["--config", CONFIGS / "smoke.toml", "--device", "cpu", "--updates", 2, "--check", 2,
                 "--set", "simulator.maps=[\"procedural:1\"]", "--set", "train.num_steps=8"]  # fmt: skip
        facts = self.json_of("bench", "breakdown", *small, "--backend", "cpu,null", "--size", "16x9,32x18", "--agents", 4,
                             "--host-steps")  # fmt: skip
        self.assertIn("8 steps, 1 epochs, one minibatch, every slot drawn", facts["workload"])
        self.assertEqual(facts["backend"], "simulator cpu, renderer cpu,null, learning on cpu")
        rows = {row["name"]: row for row in facts["results"]}
        for case in (f"{b} {s} 4 agents a world" for b in ("cpu", "null") for s in ("16x9", "32x18")):
            columns = ("env", "rendering", "forward", "optimisation", "diagnosis", "other")
            for column in (*columns, "total"):
                self.assertEqual(rows[f"{case}, {column}"]["repeats"], 2)
                self.assertGreater(rows[f"{case}, {column}"]["min"], 0)
            parts = sum(rows[f"{case}, {column}"]["mean"] for column in columns)
            self.assertAlmostEqual(parts, rows[f"{case}, total"]["mean"], places=6)
            self.assertEqual(rows[f"{case}, chunk"]["value"], 2048)
        # Black images are not the oracle's; the oracle is not compared with itself.
        self.assertNotIn("cpu 16x9 4 agents a world, values unlike the oracle's", rows)
        self.assertGreater(rows["simulator on the host, 4 agents a world, env"]["value"], 0)
        table = run("bench", "breakdown", *small, "--backend", "null", "--size", "32x18", "--agents", 4).stdout
        self.assertRegex(table, r"null 32x18 4 agents a world .* \|\s+0\.84\s+9\.17\n")
        results, figure = self.folder / "results.json", self.folder / "breakdown.png"
        results.write_text(json.dumps(facts))
        run("bench", "breakdown", "--plot", results, "--figure", figure)
        self.assertGreater(figure.stat().st_size, 5000)
        results.write_text(json.dumps({"results": [{"name": "cpu 8x8 3 egos", "value": 1}]}))
        self.assert_refused(1, "bench breakdown", "bench", "breakdown", "--plot", results, "--figure", figure)
        self.assert_refused(1, "vulkan", "bench", "breakdown", *small, "--backend", "vulkan")
        self.assert_refused(2, "'8'", "bench", "breakdown", *small, "--backend", "cpu", "--size", "9x5,8")


if __name__ == "__main__":
    unittest.main()
