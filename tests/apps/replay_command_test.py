"""`pictura replay` from outside."""

import base64
import csv
import itertools
import json
import pathlib
import re
import sys
import unittest
import zlib

from command_case import TINY, CommandCase, has_torch, run

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from replay_pages import header_of


class Replays(CommandCase):
    """Contents of pages are tested in tests/replay/, their behaviour in browsers in tests/replay/page_test.py."""

    WORLD = ["procedural:1:blocks=2x2", "--agents", 12, "--seed", 4]

    def test_recorded_metrics_and_state_equal_the_simulations(self):
        path = self.folder / "a.html"
        simulate = ["simulate", *self.WORLD, "--steps", 60, "--policy", "random"]
        facts = self.json_of(*simulate, "--replay", path, "--follow", 3, started=True)
        self.assertEqual(facts["state_hash"], self.json_of(*simulate)["state_hash"])
        header = header_of(path)
        for name in ("collisions", "at_fault_collisions", "off_road", "red_light", "wall_contacts", "agent_steps", "goals_reached"):
            self.assertEqual(header["metrics"][name], facts[name], name)
        self.assertGreater(facts["off_road"], 0)
        self.assertEqual((header["frames"], header["agents"], header["followed"], header["seed"]), (61, 12, 3, "4"))
        self.assertTrue(header["command"].startswith("pictura simulate procedural:1:blocks=2x2 --agents 12"), header["command"])
        self.assertRegex(header["map_hash"], "^[0-9a-f]{16}$")

    def test_the_same_command_writes_the_same_bytes(self):
        pages = []
        for _ in range(2):
            self.json_of("replay", *self.WORLD, "--steps", 30, "--cameras", "--out", self.folder / "a.html")
            pages.append((self.folder / "a.html").read_bytes())
        self.assertEqual(*pages)

    def test_a_hundred_and_twenty_agents_for_three_thousand_steps_fit_in_five_megabytes(self):
        path = self.folder / "large.html"
        # Random actions are the hardest to compress; a tenth of the steps take a tenth, and the map.
        facts = self.json_of("replay", "procedural:1", "--agents", 120, "--steps", 300, "--policy", "random", "--out", path)
        self.assertEqual((facts["agents"], facts["steps"]), (120, 300))
        self.assertLess(path.stat().st_size, 0.5e6 + 0.1e6)

    def test_options_without_effect_or_out_of_range_are_refused(self):
        replay = ["replay", *self.WORLD]
        out = ["--out", self.folder / "a.html"]
        self.assert_refused(2, "expected --out, --mcap or --gallery", *replay)
        self.assert_refused(2, "--episodes: has no effect without --gallery", *replay, *out, "--episodes", 2)
        self.assert_refused(2, "--follow: expected 0 to 11, got 12", *replay, *out, "--follow", 12)
        self.assert_refused(2, "ends in .html", *replay, "--out", self.folder / "a.mp4")
        self.assert_refused(2, "--device: has no effect", *replay, *out, "--device", "cpu")
        self.assert_refused(2, "--cameras: has no effect without --replay", "simulate", *self.WORLD, "--cameras")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_gallery_replaces_an_earlier_one(self):
        folder = self.folder / "gallery"
        replay = ["replay", "procedural:1:blocks=2x2", "--agents", 4, "--steps", 10]
        self.json_of(*replay, "--gallery", folder, "--episodes", 3)
        self.json_of(*replay, "--out", folder / "mine.html")
        self.json_of(*replay, "--gallery", folder, "--episodes", 2, "--seed", 7)
        self.assertEqual(sorted(path.name for path in folder.glob("[!.]*")), ["index.html", "mine.html", "seed_7.html", "seed_8.html"])

    def test_worst_scenarios_of_an_evaluation_are_recorded(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        evaluate = ["evaluate", "--policy", "random", "--map", "procedural:1:blocks=2x2,procedural:2:blocks=2x2", "--agents", 10,
                    "--scenarios", 4, "--steps", 80]  # fmt: skip
        out, folder = self.folder / "results.json", self.folder / "gallery"
        result = run(*evaluate, "--out", out, "--replays", 2, "--gallery", folder, "--replay", self.folder / "worst.html")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("notice", result.stderr)  # counts equal the evaluation's
        scenarios = json.loads(out.read_text())["densities"][0]["scenarios"]
        rates = [s["at_fault_infraction"] / s["vehicles"] for s in scenarios]
        worst = sorted(range(4), key=lambda i: -rates[i])[:2]
        self.assertEqual(sorted(p.name for p in folder.glob("[!.]*")), sorted(["index.html", *(f"custom_{i}.html" for i in worst)]))
        header = header_of(self.folder / "worst.html")
        self.assertEqual(header["map"], f"procedural:{1 + worst[0] % 2}:blocks=2x2")
        infractions = self.folder / "infractions.csv"
        self.assertEqual(run(*evaluate, "--infractions", infractions).returncode, 0)
        with infractions.open() as file:
            rows = [row for row in csv.DictReader(file) if int(row["scenario"]) == worst[0] and int(row["agent"]) == header["followed"]]
        self.assertTrue(rows)  # opens with an agent with an infraction
        self.assert_refused(2, "--gallery", *evaluate, "--replays", 2)
        self.assert_refused(2, "--follow: has no effect without --replay", *evaluate, "--follow", 1)

    def test_a_probe_case_is_recorded_with_its_road_user(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        policies = []
        # The second policy drives in the first policy's world, which has pedestrians and walls.
        for name, more in {"images": ["simulator.pedestrian_fraction=0.2", "simulator.walls=true"], "vectors": ["policy.modality=vector", "policy.auxiliary=true"]}.items():
            settings = [word for one in more for word in ("--set", one)]
            self.json_of("train", *TINY, *settings, "--set", "train.updates=1", "--out", self.folder / name)
            policies.append(self.folder / name / "checkpoint.ckpt")
        world = [*policies, "--map", "procedural:1:blocks=2x2", "--agents", 30, "--scenes", 4, "--steps", 40, "--every", 2, "--device", "cpu"]
        for kind, more in {"removal": ["--removals", 80], "pedestrian": ["--paths", 4, "--min-speed", -100, "--range", 60]}.items():
            probe = ["probe", kind, *world, *more, "--out", self.folder / kind]
            path = self.folder / f"{kind}.html"
            result = run(*probe, "--replay", path)
            self.assertEqual(result.returncode, 0, result.stderr)
            with open(self.folder / kind / "cases.csv") as file:
                cases = list(csv.DictReader(file))
            changes = [abs(float(case["images/d_value"])) for case in cases]
            last = max(i for i, case in enumerate(cases) if case["driver"] == "vectors")
            for number in (changes.index(max(changes)), last):
                if number == last:
                    result = run(*probe, "--replay", path, "--case", number, "--cameras")
                    self.assertEqual(result.returncode, 0, result.stderr)
                self.assertNotIn("notice", result.stderr)  # drives as in the evaluation
                header, case = header_of(path), cases[number]
                shown = header["case"]
                self.assertIn(f"case {number}: ", shown["what"])
                self.assertIn(shown["what"], result.stderr)
                self.assertEqual((shown["frame"], shown["ego"], header["followed"]), (int(case["step"]), int(case["ego"]), int(case["ego"])))
                self.assertEqual(shown["removed"], int(case["hidden"]) if kind == "removal" else None)
                self.assertIn(case["driver"], header["policy"])
                # Response to the state as driven: with the removed road user, without the inserted one.
                state = "value" if kind == "removal" else "value_without"
                expected = next(answer[state] for answer in shown["answers"] if answer["policy"] == case["driver"])
                self.assertAlmostEqual(1e-4 * self.decisions_of(path)[12][shown["frame"]], expected, delta=2e-4)
                for answer in shown["answers"]:
                    change = answer["value"] - answer["value_without"]
                    self.assertAlmostEqual(change, float(case[answer["policy"] + "/d_value"]), 5)
                if kind == "pedestrian":
                    self.assertAlmostEqual(shown["inserted"]["x_cm"] / 100, float(case["x_m"]), delta=0.006)
                    self.assertIn([shown["inserted"]["x_cm"], shown["inserted"]["y_cm"]], shown["inserted"]["path_cm"])
            self.assertEqual([c["width_px"] for c in header["cameras"]], [96] * 4)  # the vectors' driver has the paper's
            charts = {"removal": {"removal.png"}, "pedestrian": {"pedestrian.png", *(f"path_{i:03}.png" for i in range(4))}}[kind]
            self.assertEqual({file.name for file in (self.folder / kind).glob("*.png")}, charts)
        removal = self.folder / "removal"
        result = run("probe", "removal", *world, "--removals", 80, "--out", removal, "--json", PICTURA_PYTHON=self.python_without_matplotlib())
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(f"notice: {removal}/removal.png: not drawn", result.stderr)
        self.assertEqual({file.name for file in removal.glob("[!.]*")}, {"cases.csv", "summary.json"})
        self.assertEqual(json.loads(result.stdout), json.loads((removal / "summary.json").read_text()))
        result = run(*probe, "--replay", path, "--case", len(cases))  # the number of cases is known at the end
        self.assertEqual((result.returncode, f"--case: expected 0 to {len(cases) - 1}, got {len(cases)}" in result.stderr), (2, True), result.stderr)
        self.assert_refused(2, "--replay", *probe, "--case", 1)
        corner = ["probe", "corner", policies[0], "--map", "procedural:1", "--agents", 90, "--scenes", 2, "--steps", 300, "--pairs", 1, "--driver", "lane"]
        out = ["--seed", 3, "--device", "cpu", "--out", self.folder / "corner", "--replay", path]
        result = run(*corner, *out)
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(self.folder / "corner" / "cases.csv") as file:
            case = next(csv.DictReader(file))
        self.assertTrue({"corner.png", "example.png"} <= {file.name for file in (self.folder / "corner").iterdir()})
        header = header_of(path)
        shown = header["case"]
        self.assertEqual((shown["frame"], shown["ego"], shown["removed"]), (0, int(case["ego"]), int(case["user"])))
        self.assertIn(f"case 0: agent {case['user']} approaches hidden", shown["what"])
        self.assertIn(f"from here on images drives agent {case['ego']}", shown["what"])
        self.assertNotIn("notice", result.stderr)  # takes over as in the probe
        self.assertEqual((case["policy"], case["walls"], case["case"]), ("images", "on", "hidden"))
        self.assertEqual(header["frames"], round(10 * float(case["lasted_s"])) + 1)
        self.assert_refused(2, "--case: expected 0 to 0, got 1", *corner, *out, "--case", 1)
        self.assert_refused(2, "--case: expected 0 to 79, got 80", "probe", "removal", *world, "--removals", 80, "--replay", path, "--case", 80)

    def test_recorded_decisions_match_the_driven_actions(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run")
        path = self.folder / "policy.html"
        checkpoint = self.folder / "run" / "checkpoint.ckpt"
        self.json_of("replay", *self.WORLD, "--policy", checkpoint, "--steps", 20, "--follow", 2, "--cameras", "--out", path)
        header = header_of(path)
        self.assertEqual([(c["width_px"], c["height_px"]) for c in header["cameras"]], [(16, 9)] * 4)
        self.assertRegex(header["policy_hash"], "^[0-9a-f]{16}$")
        actions = self.numbers_of(path, "action")[2 * 21 : 3 * 21]  # actions of agent 2, order 0
        decisions = self.decisions_of(path)
        asked = 0
        for frame in range(20):
            probabilities = [column[frame] for column in decisions[:12]]
            if not any(probabilities) or actions[frame + 1] == 0:
                continue
            asked += 1
            self.assertAlmostEqual(sum(probabilities), 10000, delta=6)
            self.assertGreaterEqual(probabilities[actions[frame + 1] - 1], max(probabilities) - 2)
        self.assertGreater(asked, 5)

    def decisions_of(self, path):
        """Columns of the followed agent's probabilities and value, in units of 1e-4."""
        numbers, frames = self.numbers_of(path, "decisions"), header_of(path)["frames"]
        return [list(itertools.accumulate(numbers[column * frames : (column + 1) * frames])) for column in range(13)]

    @staticmethod
    def numbers_of(path, name):
        data = zlib.decompress(base64.b64decode(re.search('id="replay-data">(.*?)</script>', path.read_text()).group(1)))
        at, found, bits, shift = 0, [], 0, 0
        for section in header_of(path)["sections"]:
            if section["name"] == name:
                break
            at += section["bytes"]
        for byte in data[at : at + section["bytes"]]:
            bits |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                found.append((bits >> 1) ^ -(bits & 1))
                bits = shift = 0
        return found


if __name__ == "__main__":
    unittest.main()
