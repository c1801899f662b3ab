"""`pictura map` and `town` from outside."""

import json
import math
import os
import pathlib
import re
import resource
import signal
import subprocess
import time
import unittest.mock

from command_case import PICTURA, TINY, CommandCase, has_torch, run

MAP_CASES = sorted((pathlib.Path(__file__).resolve().parents[1] / "map" / "cases").glob("*.xodr"))


def processor_s(pid):
    """Processor time of a process; infinite if it has ended."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return math.inf if fields[0] == "Z" else (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def processor_s_of_children():
    """Processor time of all children that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Maps(CommandCase):
    def test_a_town_is_a_function_of_its_seed(self):
        first = self.town(seed=5).read_bytes()
        self.assertEqual(first, self.town(seed=5).read_bytes())
        self.assertNotEqual(first, self.town(seed=6).read_bytes())

    def test_a_family_sets_the_default_options(self):
        town, named = self.folder / "city.xodr", self.folder / "named.xodr"
        written = self.json_of("town", "--family", "city", "--seed", 5, "--hills-m", 0, "--out", town)
        self.assertEqual((written["blocks_x"], written["blocks_y"], written["motorway"], written["hills-m"]), (4, 3, 1, 0))
        facts = self.json_of("map", "city:5:hills-m=0", "--xodr", named)
        self.assertEqual(town.read_bytes(), named.read_bytes())
        self.assertEqual(facts["mends"], [])
        self.assertAlmostEqual(sum(facts["statistics"]["lanes_shares"]), 1, places=5)
        self.assert_refused(2, "--family", "town", "--family", "village", "--out", town)

    def test_facts_have_their_keys_and_the_picture_is_drawn(self):
        picture = self.folder / "map.png"
        facts = self.json_of("map", self.town(), "--png", picture)
        keys = """map roads junction_roads junctions signal_junctions lanes driving_lanes driving_lane_km traffic_lights
                  stop_lines crosswalks parking_spaces z_min_m z_max_m cached load_ms""".split()
        self.assertEqual([key for key in keys if key not in facts], [])
        self.assertGreater(facts["driving_lane_km"], 0.5)
        self.assertGreater(facts["traffic_lights"], 0)
        self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")

    def test_parts_are_drawn_as_pixels_and_as_lines(self):
        town, pixels, lines = self.town(), self.folder / "part.png", self.folder / "part.svg"
        facts = self.json_of("map", town, "--png", pixels, "--svg", lines, "--at", 10, 20, "--radius", 30, "--size", 400)
        self.assertEqual(pixels.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertIn("</svg>", lines.read_text())
        whole = self.folder / "whole.png"
        self.json_of("map", town, "--png", whole, "--size", 400)
        self.assertNotEqual(whole.read_bytes(), pixels.read_bytes())
        box = self.folder / "box.png"
        self.json_of("map", town, "--png", box, "--box", -20, -10, 40, 50, "--size", 400)
        self.assertEqual(box.read_bytes(), pixels.read_bytes())
        self.assert_refused(1, "shows nothing", "map", town, "--png", box, "--at", 9000, 0)
        self.assert_refused(2, "--at", "map", town, "--png", box, "--at", 0, 0, "--box", 0, 0, 1, 1)
        self.assertGreater(facts["lanes"], 0)

    def test_the_full_listing_has_every_element_and_its_source(self):
        town = self.town()
        text = town.read_text().splitlines()
        listing = self.json_of("map", town, "--full")
        elements = listing["elements"]
        for key, fact in [("lanes", "lanes"), ("lights", "traffic_lights"), ("crosswalks", "crosswalks"), ("signs", "signs"),
                          ("junctions", "junctions"), ("parking_spaces", "parking_spaces")]:  # fmt: skip
            self.assertEqual(len(elements[key]), listing[fact], key)
            self.assertEqual([element["index"] for element in elements[key]], list(range(listing[fact])))
        roads = set(re.findall(r'<road [^>]*\bid="([^"]*)"', town.read_text()))
        self.assertEqual({lane["source"]["road"] for lane in elements["lanes"]}, roads)
        elements_of = {"lanes": "<lane ", "lights": "<signal ", "crosswalks": "<object ", "junctions": "<junction "}
        for key, element_name in elements_of.items():
            for element in elements[key]:
                line = element.get("source", {}).get("line")
                if line:
                    self.assertIn(element_name, text[line - 1])
        first = elements["lanes"][0]
        self.assertIn(0, elements["lanes"][first["successors"][0]]["predecessors"])
        self.assert_refused(2, "--full", "map", town, "--full")

    def test_the_second_load_comes_from_the_cache(self):
        town = self.town()
        cache = {"XDG_CACHE_HOME": str(self.folder / "cache"), "PICTURA_CACHE": ""}
        with unittest.mock.patch.dict(os.environ, cache):
            first, second = self.json_of("map", town), self.json_of("map", town)
            self.assertEqual([first.pop("cached"), second.pop("cached")], [False, True])
            self.assertLess(second.pop("load_ms"), first.pop("load_ms"))
            self.assertEqual(first, second)
            self.assertEqual(len(list(self.folder.glob("cache/pictura/maps/*.map"))), 1)
            with unittest.mock.patch.dict(os.environ, {"PICTURA_CACHE": "off"}):
                self.assertFalse(self.json_of("map", town)["cached"])

    def test_imports_end_soon_after_an_interrupt(self):
        town = self.folder / "large.xodr"
        self.assertEqual(run("town", "--blocks", "12x12", "--out", town).returncode, 0)
        command = [PICTURA, "simulate", town, "--agents", "4", "--steps", "1", "--policy", "idle"]
        with unittest.mock.patch.dict(os.environ, {"PICTURA_CACHE": "off"}):
            # Processor time, which does not depend on other processes.
            begin_s = processor_s_of_children()
            self.assertEqual(subprocess.run(command, capture_output=True).returncode, 0)
            whole_s = processor_s_of_children() - begin_s
            for share in (0.3, 0.5, 0.7, 0.9):
                begin_s = processor_s_of_children()
                process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
                while processor_s(process.pid) < share * whole_s:
                    time.sleep(0.01)
                until_s = processor_s(process.pid)
                process.send_signal(signal.SIGINT)
                _, message = process.communicate(timeout=300)
                with self.subTest(share=share, message=message):
                    self.assertIn(process.returncode, (0, 130, -signal.SIGINT))
                    self.assertLess(processor_s_of_children() - begin_s - until_s, max(1, 0.35 * whole_s))

    def test_exports_are_the_same_map(self):
        first, second = self.folder / "first.xodr", self.folder / "second.xodr"
        facts = self.json_of("map", "procedural:4", "--xodr", first)
        again = self.json_of("map", first, "--xodr", second)
        self.assertEqual(first.read_bytes(), second.read_bytes())
        same = [key for key in facts if key not in ("map", "load_ms", "cached")]
        self.assertEqual([facts[key] for key in same], [again[key] for key in same])
        self.assert_refused(1, "/proc/nowhere", "map", first, "--xodr", "/proc/nowhere/out.xodr")

    def test_repaired_faults_are_counted_and_listed(self):
        town = self.town()
        text = town.read_text()
        town.write_text(text.replace('type="driving"', 'type="canal"', 3).replace('elementId="', 'elementId="no', 1))
        cache = {"XDG_CACHE_HOME": str(self.folder / "cache"), "PICTURA_CACHE": ""}
        for cached in (False, True):
            with unittest.mock.patch.dict(os.environ, cache):
                result = run("map", town, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            mends = json.loads(result.stdout)["mends"]
            self.assertEqual(json.loads(result.stdout)["cached"], cached)
            lanes = next(group for group in mends if group["fault"] == "unknown lane types")
            self.assertEqual((lanes["count"], len(lanes["faults"])), (3, 3))
            self.assertEqual(lanes["done"], "counted as special lanes")
            for message in lanes["faults"]:
                self.assertRegex(message, r"xodr:\d+: road \S+: <lane>: attribute type: 'canal'")
            count = sum(group["count"] for group in mends)
            lines = result.stderr.splitlines()
            self.assertEqual(len([line for line in lines if line.startswith("repaired: ")]), len(mends))
            self.assertIn(f"repaired: 3 x unknown lane types: counted as special lanes; first: {town}:", result.stderr)
            self.assertIn(f"{count} faults repaired", lines[-1])
        self.assertIn(f"{count} faults repaired", run("simulate", town, "--steps", "2").stderr)
        self.assert_refused(1, ": <lane>: attribute type: 'canal'", "map", town, "--strict")
        town.write_text(text.replace("<signal ", '<signal s="nan" ', 1))
        self.assert_refused(1, "<signal>", "map", town)
        town.write_text(text)
        self.assertEqual(self.json_of("map", town, "--strict")["mends"], [])
        self.assert_refused(2, "--lenient: was removed", "map", town, "--lenient")

    def test_errors_name_bad_files(self):
        text = self.town().read_text()
        bad = self.folder / "bad.xodr"
        cases = {
            "truncated": text[: len(text) // 2],
            "not OpenDRIVE": "<html><body/></html>",
            "not XML": "hello",
            "empty": "",
            "NaN": text.replace('length="', 'length="nan', 1) if 'length="nan' not in text else text,
            "NUL bytes": text[:5000] + "\0" * 50 + text[5000:],
        }
        for name, content in cases.items():
            with self.subTest(name):
                bad.write_text(content)
                self.assert_refused(1, "bad.xodr", "map", bad)
        self.assert_refused(2, "Atlantis", "map", "Atlantis")
        self.assert_refused(2, "procedural:x", "map", "procedural:x")
        self.assert_refused(1, "/proc/nowhere", "map", self.town(), "--png", "/proc/nowhere/map.png")


class MapCases(CommandCase):
    """Every command on every file of tests/map/cases."""

    def test_maps_are_shown_driven_drawn_and_replayed(self):
        for path in MAP_CASES:
            with self.subTest(path.stem):
                facts = self.json_of("map", path, "--png", self.folder / "map.png")
                self.assertGreater(facts["endless_lanes"] + facts["open_lanes"], 0)
                for policy in ("random", "idle", "idm_lanes", "lane"):
                    driven = self.json_of("simulate", path, "--agents", 8, "--steps", 100, "--parked", 2, "--policy", policy)
                    self.assertGreater(driven["agent_steps"], 0, policy)
                self.assertEqual(driven["off_road"], 0, "by the lane keeper")
                self.json_of("render", path, "--agents", 4, "--steps", 5, "--views", 1, "--out", self.folder / "images")
                self.json_of("replay", path, "--agents", 4, "--steps", 20, "--policy", "lane", "--out", self.folder / "drive.html")

    def test_policies_train_and_are_evaluated_on_all_maps(self):
        if not has_torch():
            self.skipTest("built without torch")
        names = ",".join(map(str, MAP_CASES))
        few = ["--map", names, "--agents", 4, "--steps", 30, "--scenarios", len(MAP_CASES)]
        self.assertEqual(self.json_of("evaluate", "--policy", "lane", *few)["rows"][0]["scenarios"], len(MAP_CASES))
        maps = json.dumps([str(path) for path in MAP_CASES])
        self.json_of("train", *TINY, "--set", f"simulator.maps={maps}", "--set", f"simulator.num_slots={3 * len(MAP_CASES)}",
                     "--set", "train.updates=2", "--out", self.folder / "run")
        evaluated = self.json_of("evaluate", self.folder / "run" / "checkpoint.ckpt", *few)
        self.assertEqual(evaluated["rows"][0]["scenarios"], len(MAP_CASES))


if __name__ == "__main__":
    unittest.main()
