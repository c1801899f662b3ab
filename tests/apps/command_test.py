"""The `pictura` command from outside: its JSON, its exit statuses, and what bad input gets.

Run by ctest, one entry per class: python3 command_test.py PICTURA [unittest arguments].
"""

import base64
import concurrent.futures
import csv
import fcntl
import itertools
import json
import math
import os
import pathlib
import pty
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest
import unittest.mock
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from replay_pages import header_of

PICTURA = ""
CONFIGS = pathlib.Path(__file__).resolve().parents[2] / "configs"
MAP_CASES = sorted((pathlib.Path(__file__).resolve().parents[1] / "map" / "cases").glob("*.xodr"))
SCENES = pathlib.Path(__file__).resolve().parents[1] / "golden"
# A policy and a world so small that an update takes well under a second. On the host, whose runs are exact.
TINY = [
    "--config", str(CONFIGS / "smoke.toml"),
    "--set", "simulator.num_slots=6", "--set", "simulator.min_agents=3", "--set", "simulator.max_agents=3",
    "--set", "train.num_steps=8", "--set", "train.minibatch_size=48", "--set", "train.schedule_agent_steps=1000000",
    "--set", "render.width_px=16", "--set", "render.height_px=9", "--set", "run.num_threads=2",
    "--set", "run.device=cpu",
]  # fmt: skip


TOWNS = sorted(path.stem for path in pathlib.Path(os.environ.get("PICTURA_DATA", "/nowhere")).glob("carla/*.xodr"))


def run(*arguments, timeout=300, cwd=None, **variables):
    """A call of the command. Skips the test where it would draw a chart and the machine has no Matplotlib."""
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}}
    result = subprocess.run([PICTURA, *map(str, arguments)], capture_output=True, text=True, timeout=timeout, env=environment, cwd=cwd)
    if "has no Matplotlib" in result.stderr and "PICTURA_PYTHON" not in variables:
        raise unittest.SkipTest("no Matplotlib on this machine")
    return result


def has_torch():
    """Whether this build can train: commands that need torch are missing from builds without it."""
    return re.search("^  train ", run("--help").stdout, re.MULTILINE) is not None


def has_cuda():
    """Whether this build knows the renderer `cuda`, with a device or without."""
    return "cpu, cuda" in run("bench", "render", "--backend", "none").stderr


def processor_s(pid):
    """Processor time that a process has taken; infinite where it has ended."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return math.inf if fields[0] == "Z" else (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def processor_s_of_children():
    """The same of all children that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class CommandCase(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.folder = pathlib.Path(self._folder.name)

    def tearDown(self):
        self._folder.cleanup()

    def json_of(self, *arguments):
        result = run(*arguments, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def assert_refused(self, status, message, *arguments):
        result = run(*arguments)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        self.assertEqual(result.stdout, "")
        lines = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
        self.assertEqual(len(lines), 1, result.stderr)
        self.assertIn(message, result.stderr)

    def assert_bad_numbers_are_refused(self, *commands):
        """By each command, whose last word is the option that takes the number."""
        for arguments in commands:
            for number in ("nan", "inf", "-1", "2000000000"):
                with self.subTest(" ".join(map(str, arguments)), number=number):
                    self.assert_refused(2, arguments[-1], *arguments, number)

    def python_as(self, command):
        """A Python for charts that is a shell's command instead."""
        path = self.folder / "python"
        path.write_text(f"#!/bin/sh\n{command}\n")
        path.chmod(0o755)
        return path

    def python_without_matplotlib(self):
        return self.python_as(f'unset PYTHONPATH; exec {sys.executable} -S "$@"')

    def town(self, seed=3, blocks="2x2"):
        path = self.folder / f"town{seed}.xodr"
        self.json_of("town", "--seed", seed, "--blocks", blocks, "--out", path)
        return path


class Usage(CommandCase):
    def test_help_teaches_by_example(self):
        for command in ["town", "map", "render", "simulate", "replay", "plot", "bench", *(["train", "evaluate", "probe"] if has_torch() else [])]:
            result = run(command, "--help")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(f"pictura {command}", result.stdout)

    def test_numbers_that_are_not_finite_or_out_of_range_are_refused(self):
        line_floor = ("render", "procedural:1", "--out", self.folder, "--line-floor")
        self.assert_bad_numbers_are_refused(
            line_floor,
            ("town", "--out", self.folder / "town.xodr", "--hills-m"),
            ("render", "procedural:1", "--out", self.folder, "--pedestrians"),
            ("simulate", "procedural:1", "--cyclists"),
            ("simulate", "procedural:1", "--film-width"),
        )
        self.assert_refused(2, "--line-floor: expected a number of 0 to 8, got '8.5'", *line_floor, "8.5")

    def test_wrong_usage_exits_with_2(self):
        self.assert_refused(2, "--out", "town", "--seed", 1)
        self.assert_refused(2, "--blocks", "town", "--blocks", "3", "--out", self.folder / "t.xodr")
        self.assert_refused(2, "--blocks", "town", "--blocks", "0x2", "--out", self.folder / "t.xodr")
        self.assertEqual(run("fly").returncode, 2)
        self.assertEqual(run().returncode, 2)


class Typing(CommandCase):
    """What people type: numbers, misspelt words, options that are wrong together."""

    COMMANDS = [
        ("town",), ("map",), ("render",), ("simulate",), ("replay",), ("train",), ("evaluate",), ("plot",), ("bench", "render"),
        ("bench", "simulate"), ("bench", "history"), ("bench", "quality"), ("bench", "soak"), ("bench", "worlds"),
        ("bench", "train"), ("bench", "breakdown"), ("probe", "removal"), ("probe", "pedestrian"), ("probe", "corner"),
    ]  # fmt: skip

    def test_numbers_are_decimal_in_any_notation(self):
        def town(seed):
            path = self.folder / "town.xodr"
            self.assertEqual(run("town", "--blocks", "1x1", "--seed", seed, "--out", path).returncode, 0, seed)
            return path.read_bytes()

        self.assertEqual(town("010"), town("10"))
        self.assertEqual(town("1e3"), town("1000"))
        for seed in ("-1", "0x10", "1.5", "18446744073709551616", "1e20"):
            self.assert_refused(2, f"--seed: expected a whole number of 0 to 18446744073709551615, got '{seed}'",
                                "town", "--out", self.folder / "town.xodr", "--seed", seed)  # fmt: skip

    def test_every_option_that_takes_a_number_reads_it_alike(self):
        for command in self.COMMANDS:
            page = run(*command, "--help")
            if page.returncode != 0:
                continue  # this build lacks it
            options = re.findall(r"^ +(--[a-z-]+)(?:,--[a-z-]+)* +(?:INT|UINT|FLOAT)", page.stdout, re.MULTILINE)
            for option in options:
                if option == "--at":
                    continue  # two of them
                with self.subTest(command=command, option=option):
                    count = 4 if option == "--box" else 1
                    self.assert_refused(2, "number", *command, option, *["0x1"] * count)

    def test_one_bound_on_threads(self):
        commands = [("render", "procedural:1", "--out", self.folder), ("simulate", "procedural:1")]
        if has_torch():
            commands.append(("evaluate", "no.ckpt"))
        for command in commands:
            for threads in ("33000", "100000", "-1"):
                self.assert_refused(2, f"--threads: expected a whole number of 0 to 1024, got '{threads}'", *command,
                                    "--threads", threads)  # fmt: skip

    def test_unknown_words_suggest_the_nearest(self):
        self.assert_refused(2, "unknown subcommand 'simulat'; did you mean 'simulate'?", "simulat")
        self.assert_refused(2, "unknown option '--sede'; did you mean '--seed'?", "town", "--sede", 3)
        self.assert_refused(2, "unexpected argument 'b'", "map", "a", "b")
        self.assert_refused(2, "did you mean 'null'?", "simulate", "procedural:1", "--renderer", "nul")
        self.assert_refused(2, "expected one of seeds, none; got 'seed'; did you mean 'seeds'?", "plot", "runs", "--group", "seed")
        (self.folder / "Town01.xodr").write_text("")
        with unittest.mock.patch.dict(os.environ, {"PICTURA_DATA": str(self.folder)}):
            self.assert_refused(2, "did you mean 'Town01'?", "map", "town01")
        if has_torch():
            self.assert_refused(2, "unknown subcommand 'trian'; did you mean 'train'?", "trian")
            self.assert_refused(2, "unknown option '--confg'; did you mean '--config'?", "train", "--confg", "a.toml")
            self.assert_refused(1, "got 'bf61'; did you mean 'bf16'?", "train", "--config", CONFIGS / "smoke.toml", "--set", "train.precision=bf61", "--out", "x")
        else:
            self.assert_refused(2, "pictura train: this build has no torch", "train", "--config", "a.toml")

    def test_values_that_would_be_ignored_are_refused(self):
        town = self.town(blocks="1x1")
        self.assert_refused(2, "--png: expected a value, got an empty text", "map", town, "--png", "")
        self.assert_refused(2, "--at: has no effect without --png or --svg", "map", town, "--at", 0, 0)
        self.assert_refused(2, "expected a name that ends in .png, got 'x.jpg'", "map", town, "--png", "x.jpg")
        self.assert_refused(2, "parking: given twice", "map", "procedural:1:parking=0,parking=1")
        self.assert_refused(2, "--renderer: has no effect with the policy 'random'", "simulate", town, "--renderer", "null")
        self.assert_refused(2, "--film-width: has no effect without --video", "simulate", town, "--film-width", 9)
        self.assert_refused(2, "expected at most 1 together", "simulate", town, "--pedestrians", 1, "--cyclists", 1)

    def test_a_share_that_was_not_given_gives_way(self):
        facts = self.json_of("simulate", self.town(), "--agents", 6, "--steps", 1, "--pedestrians", 1)
        self.assertEqual((facts["vehicles"], facts["cyclists"]), (0, 0))

    def test_messages_are_one_line_whatever_a_name_holds(self):
        self.assert_refused(2, "map 'a\\nb\\x1b': expected", "map", "a\nb\x1b")
        if has_torch():
            self.assert_refused(1, "no.toml: no such file", "train", "--config", "no.toml", "--out", self.folder / "run")


class Files(CommandCase):
    """What output files do to what is there, and what a full disk and a closed end get."""

    def test_devices_links_and_fifos_stay_what_they_are(self):
        town, link, fifo = self.town(blocks="1x1"), self.folder / "link", self.folder / "fifo"
        self.assert_refused(1, "/dev/full: cannot be written: No space left on device", "map", town, "--png", "/dev/full")
        self.assertTrue(pathlib.Path("/dev/full").is_char_device())
        link.symlink_to("picture.png")
        self.json_of("map", town, "--png", link, "--size", 64)
        self.assertTrue(link.is_symlink())
        self.assertEqual((self.folder / "picture.png").read_bytes()[:4], b"\x89PNG")
        os.mkfifo(fifo)
        reader = subprocess.Popen(["cat", str(fifo)], stdout=subprocess.PIPE)
        self.json_of("map", town, "--png", fifo, "--size", 64)
        self.assertEqual(reader.communicate(timeout=60)[0], (self.folder / "picture.png").read_bytes())
        self.assertTrue(fifo.is_fifo())
        self.assert_refused(1, "expected a file, got a folder", "map", town, "--png", self.folder)

    def test_names_of_descriptors_are_written_where_they_are(self):
        expected = self.town(blocks="1x1").read_text()
        town = [PICTURA, "town", "--seed", "3", "--blocks", "1x1", "--out"]
        for name in ("/dev/stdout", "/proc/self/fd/1", "/dev/fd/1"):
            for mode in ("w", "a"):
                path = self.folder / "redirected"
                path.write_text("of before\n")
                with open(path, mode) as out:
                    out.write("head\n")
                    out.flush()
                    subprocess.run([*town, name], stdout=out, check=True)
                    out.write("tail\n")
                before = "of before\n" if mode == "a" else ""
                got = path.read_text()
                self.assertTrue(got.startswith(before + "head\n" + expected) and got.endswith("tail\n"), (name, mode))
        reading, writing = socket.socketpair()  # which can be opened by no name
        with reading, reading.makefile() as text:
            with writing:
                subprocess.run([*town, "/dev/stdout"], stdout=writing, check=True, timeout=60)
            self.assertTrue(text.read().startswith(expected))

    def test_every_byte_of_stdout_counts(self):
        town = self.town()
        listing = [PICTURA, "map", str(town), "--full", "--json"]
        self.assertGreater(len(subprocess.run(listing, capture_output=True).stdout), 1 << 16)
        limit = (1 << 16, 1 << 16)
        with open(self.folder / "out.json", "wb") as out:
            result = subprocess.run(listing, stdout=out, stderr=subprocess.PIPE, text=True,
                                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))  # fmt: skip
        self.assertEqual((result.returncode, "error: stdout: cannot be written" in result.stderr), (1, True), result.stderr)
        for arguments in (["--help"], ["town", "--help"], ["map", str(town)], ["map", str(town), "--json"]):
            with self.subTest(arguments), open("/dev/full", "wb") as full:
                result = subprocess.run([PICTURA, *arguments], stdout=full, stderr=subprocess.PIPE, text=True)
                self.assertEqual((result.returncode, "No space left on device" in result.stderr), (1, True), result.stderr)

    def test_closed_descriptors_are_no_outputs(self):
        for closed in ([2], [0, 1, 2]):
            with self.subTest(closed=closed):
                video = self.folder / "film.mp4"
                arguments = ["simulate", "procedural:1", "--agents", 4, "--steps", 10, "--video", video, "--film-width", 60]
                result = subprocess.run([PICTURA, *map(str, arguments)], stdout=subprocess.DEVNULL,
                                        preexec_fn=lambda closed=closed: [os.close(descriptor) for descriptor in closed])  # fmt: skip
                self.assertEqual(result.returncode, 1 if 1 in closed else 0)
                self.assertEqual(video.read_bytes()[4:8], b"ftyp")

    def test_what_stderr_does_not_take_is_lost_and_nothing_else(self):
        reader, closed_pipe = os.pipe()
        os.close(reader)
        self.addCleanup(os.close, closed_pipe)
        with open("/dev/full", "wb") as full:
            for stderr in (full.fileno(), closed_pipe):
                page = self.folder / "page.html"
                result = subprocess.run([PICTURA, "replay", "procedural:1", "--agents", "4", "--steps", "20", "--out", str(page), "--json"],
                                        stdout=subprocess.PIPE, stderr=stderr)  # fmt: skip
                self.assertEqual((result.returncode, json.loads(result.stdout)["steps"]), (0, 20))
                self.assertTrue(page.exists())

    def test_a_closed_stdout_is_an_error_after_the_work_is_saved(self):
        reader, closed_pipe = os.pipe()
        os.close(reader)
        self.addCleanup(os.close, closed_pipe)
        for number, arguments in enumerate((["--seed", "3"], ["--seed", "3", "--json"])):
            town = self.folder / f"town{number}.xodr"
            result = subprocess.run([PICTURA, "town", "--blocks", "1x1", *arguments, "--out", str(town)],
                                    stdout=closed_pipe, stderr=subprocess.PIPE, text=True)  # fmt: skip
            self.assertEqual((result.returncode, town.exists()), (1, True), result.stderr)
            self.assertIn("error: stdout: cannot be written: Broken pipe", result.stderr)

    def test_no_two_options_write_one_file(self):
        town, page = self.town(blocks="1x1"), self.folder / "page"
        for first, second in [("--replay", "--mcap"), ("--mcap", "--scene"), ("--policy", "--replay")]:
            with self.subTest(first=first, second=second):
                self.assert_refused(2, "expected another file than that of --", "simulate", town, first, page, second, page)
        relative = [os.path.abspath(PICTURA), "simulate", town, "--replay", "page", "--mcap", "./page"]
        self.assertEqual(subprocess.run(relative, cwd=self.folder, stderr=subprocess.DEVNULL).returncode, 2)
        self.assertFalse(page.exists())
        self.json_of("simulate", town, "--agents", 2, "--steps", 2, "--replay", "/dev/null", "--mcap", "/dev/null")
        before = town.stat().st_ino
        self.json_of("map", town, "--xodr", town)  # a map may be replaced
        self.assertNotEqual(town.stat().st_ino, before)

    def test_the_contact_sheet_of_many_views_has_pages(self):
        out = self.folder / "images"
        facts = self.json_of("render", self.town(), "--agents", 80, "--steps", 0, "--views", 80, "--backend", "null",
                             "--size", "96x54", "--out", out)  # fmt: skip
        self.assertEqual([pathlib.Path(path).name for path in facts["contact_sheets"]],
                         ["contact_sheet.png", "contact_sheet_2.png", "contact_sheet_3.png"])  # fmt: skip
        # One row is as high as a page, not the more the narrower its images are.
        facts = self.json_of("render", self.town(), "--agents", 2, "--steps", 0, "--views", 1, "--backend", "null",
                             "--size", "8x1000", "--out", out)  # fmt: skip
        self.assertEqual(len(facts["contact_sheets"]), 1)


class Maps(CommandCase):
    def test_a_town_is_a_function_of_its_seed(self):
        first = self.town(seed=5).read_bytes()
        self.assertEqual(first, self.town(seed=5).read_bytes())
        self.assertNotEqual(first, self.town(seed=6).read_bytes())

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
            # Processor time, of which other processes take none.
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

    def test_mended_faults_are_counted_and_listed(self):
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
            self.assertEqual(len([line for line in lines if line.startswith("mended: ")]), len(mends))
            self.assertIn(f"mended: 3 x unknown lane types: counted as special lanes; first: {town}:", result.stderr)
            self.assertIn(f"{count} faults mended", lines[-1])
        self.assertIn(f"{count} faults mended", run("simulate", town, "--steps", "2").stderr)
        self.assert_refused(1, ": <lane>: attribute type: 'canal'", "map", town, "--strict")
        town.write_text(text.replace("<signal ", '<signal s="nan" ', 1))
        self.assert_refused(1, "<signal>", "map", town)
        town.write_text(text)
        self.assertEqual(self.json_of("map", town, "--strict")["mends"], [])
        self.assert_refused(2, "--lenient: is gone", "map", town, "--lenient")

    def test_bad_files_are_refused_by_name(self):
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


class Images(CommandCase):
    def test_images_are_written_and_hash_alike_for_any_number_of_threads(self):
        town = self.town()
        hashes = set()
        for threads in (1, 2, 3):
            out = self.folder / f"images{threads}"
            result = self.json_of("render", town, "--agents", 12, "--steps", 20, "--views", 3, "--size", "48x27",
                                  "--backend", "cpu", "--threads", threads, "--out", out)  # fmt: skip
            self.assertEqual((result["backend"], result["images"], result["cameras"]), ("cpu", 12, 4))
            self.assertGreater(result["agent_steps_per_s"], 0)
            self.assertEqual(len(list(out.glob("agent*.png"))), 12)
            self.assertTrue((out / "contact_sheet.png").exists())
            hashes.add(result["image_hash"])
        self.assertEqual(len(hashes), 1)
        self.assertRegex(hashes.pop(), "^[0-9a-f]{16}$")

    def test_drawing_ends_soon_after_an_interrupt_that_came_before_it(self):
        out = self.folder / "images"
        arguments = ["render", str(self.town()), "--agents", "30", "--steps", "0", "--views", "30", "--size", "384x216", "--out", str(out)]
        with subprocess.Popen([PICTURA, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            self.assertIn("backend", process.stderr.readline())  # before there is a world
            process.send_signal(signal.SIGINT)
            self.assertIn("error: ", process.communicate()[1])
        self.assertEqual((process.returncode, list(out.iterdir())), (130, []))

    def test_a_used_folder_keeps_no_pictures_of_before(self):
        out = self.folder / "images"
        render = ["render", "procedural:1", "--agents", 6, "--steps", 0, "--backend", "null", "--size", "16x9", "--out", out]
        self.json_of(*render, "--views", 4, "--figure")
        (out / "agent009_mine.png").write_text("mine")
        self.json_of("render", SCENES / "crossing.toml", "--backend", "null", "--out", out)
        self.json_of(*render, "--views", 2)
        pictures = {path.name for path in out.glob("[!.]*")}
        self.assertEqual({name.split("_")[0] for name in pictures}, {"agent000", "agent001", "agent009", "contact"}, pictures)

    def test_a_scene_file_is_drawn_with_its_planes_and_a_figure(self):
        out = self.folder / "scene"
        result = self.json_of("render", SCENES / "left_out.toml", "--backend", "cpu", "--planes", "depth,class,instance",
                              "--figure", "--out", out)  # fmt: skip
        self.assertEqual((result["backend"], result["images"], result["cameras"]), ("cpu", 3, 1))
        self.assertRegex(result["image_hash"], "^[0-9a-f]{16}$")
        views = ["nobody_hidden", "two_hidden", "from_the_other"]
        planes = ["", "_depth", "_class", "_instance"]
        names = [f"{view}_front{plane}.png" for view in views for plane in planes]
        names += [f"{view}.png" for view in views] + ["figure.png", "contact_sheet.png"]
        self.assertEqual(sorted(path.name for path in out.glob("[!.]*")), sorted(names))

    def test_bad_scene_files_are_refused_with_their_line(self):
        text = (SCENES / "vehicles.toml").read_text().replace('rig = "rigs/front.toml"', "size_px = [8, 8]")
        bad = self.folder / "bad.toml"
        render = ["render", bad, "--backend", "cpu", "--out", self.folder / "images"]
        bad.write_text(text.replace("length_m = 4.4", "length_m = -1.0"))
        self.assert_refused(1, "bad.toml:22: agent 0: length_m: expected a number in [0.001, 1000], got -1", *render)
        bad.write_text(text)
        self.assert_refused(2, "--agents: has no effect on a scene file", *render, "--agents", 4)
        self.assert_refused(2, "colour", *render, "--planes", "colour")

    def test_bad_arguments_are_refused_by_name(self):
        town = self.town()
        render = ["render", town, "--out", self.folder / "images"]
        self.assert_refused(2, "0x0", *render, "--size", "0x0")
        self.assert_refused(2, "vulkan", *render, "--backend", "vulkan")
        self.assert_refused(2, "'4x3'", *render, "--samples", "4x3")
        self.assert_refused(2, "'many'", *render, "--samples", "many")
        self.assert_refused(2, "renderer cpu: samples", *render, "--backend", "cpu", "--samples", "4x4")
        self.assert_refused(2, "--agents", *render, "--agents", 0)
        self.assert_refused(2, "100000000", *render, "--agents", 100_000_000)
        self.assert_refused(2, "--views", *render, "--agents", 2, "--views", 3)
        self.assert_refused(1, "/proc/nowhere", "render", town, "--out", "/proc/nowhere")
        rig = self.folder / "rig.toml"
        rig.write_text("[[camera]]\nname = 'flat'\nwidth_px = 0\nheight_px = 0\nfocal_px = 10\n")
        self.assert_refused(1, "flat", *render, "--rig", rig)


class Simulation(CommandCase):
    def test_the_state_is_a_function_of_the_seed_alone(self):
        town = self.town()
        hashes = {}
        for seed, threads in [(1, 1), (1, 2), (2, 1)]:
            result = self.json_of("simulate", town, "--agents", 30, "--steps", 120, "--seed", seed, "--policy", "random",
                                  "--threads", threads)  # fmt: skip
            keys = """backend map asked spawned refused steps agent_steps agent_steps_per_s goals_reached collisions
                      at_fault_collisions off_road red_light km_driven state_hash""".split()
            self.assertEqual([key for key in keys if key not in result], [])
            self.assertEqual(result["asked"], 30)
            self.assertEqual(result["spawned"] + result["refused"], 30)
            hashes.setdefault(seed, set()).add(result["state_hash"])
        self.assertEqual(len(hashes[1]), 1)
        self.assertNotEqual(hashes[1], hashes[2])
        self.assertRegex(run("simulate", town, "--agents", 5, "--steps", 40).stderr, r"step 40/40  ETA 0 s\n$")

    def test_a_world_that_is_too_small_says_what_it_refused(self):
        result = self.json_of("simulate", self.town(blocks="1x1"), "--agents", 1024, "--steps", 5, "--policy", "idle")
        self.assertEqual(result["asked"], 1024)
        self.assertEqual(result["spawned"] + result["refused"], 1024)
        self.assertGreater(result["refused"], 0)

    @unittest.skipUnless(TOWNS, "no towns: set PICTURA_DATA")
    def test_every_town_takes_a_thousand_agents_or_says_why_not(self):
        for town in TOWNS:
            with self.subTest(town):
                result = self.json_of("simulate", town, "--agents", 1024, "--steps", 2, "--policy", "idle")
                self.assertEqual(result["asked"], 1024)
                self.assertEqual(result["spawned"] + result["refused"], 1024)
                self.assertEqual(result["refused_no_place"] + result["refused_taken"], result["refused"])
                self.assertEqual(result["vehicles"] + result["cyclists"] + result["pedestrians"], result["spawned"])
                self.assertGreater(result["vehicles"], 2 * result["cyclists"])
                self.assertGreater(result["pedestrians"], 0)

    def test_the_population_is_what_is_asked_for(self):
        town = self.town()
        result = self.json_of("simulate", town, "--agents", 40, "--steps", 1, "--pedestrians", 0, "--cyclists", 1, "--parked", 3)
        self.assertEqual((result["vehicles"], result["cyclists"], result["pedestrians"]), (0, result["spawned"], 0))
        self.assertEqual(result["parked_asked"], 3)
        self.assertLessEqual(result["parked_placed"], 3)
        self.assert_refused(2, "at most 1 together", "simulate", town, "--pedestrians", 0.7, "--cyclists", 0.7)
        self.assert_refused(2, "--parked", "simulate", town, "--parked", -1)

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg on this machine")
    def test_a_film_that_is_interrupted_before_its_first_frame_has_the_status_of_the_signal(self):
        video = self.folder / "film.mp4"
        # Served worlds wait for a page.
        arguments = ["simulate", "procedural:1", "--agents", "4", "--serve", "--video", str(video)]
        with subprocess.Popen([PICTURA, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            self.assertIn("serving http", process.stderr.readline())
            process.send_signal(signal.SIGINT)
            self.assertIn("error: interrupted at step 0", process.stderr.read())
        self.assertEqual((process.returncode, video.exists()), (130, False))

    def test_a_video_is_written(self):
        video = self.folder / "drive.mp4"
        film = ["simulate", self.town(), "--agents", 5, "--steps", 12, "--policy", "random", "--video", video]
        self.json_of(*film)
        self.assertGreater(video.stat().st_size, 2000)
        self.json_of(*film, "--film-width", 0, "--film-agent", 4)
        self.assert_refused(2, "--film-agent", *film, "--film-agent", 5)
        self.assert_refused(2, "--film-width", *film, "--film-width", -1)

    def test_bad_arguments_are_refused_by_name(self):
        simulate = ["simulate", self.town()]
        self.assert_refused(2, "--agents", *simulate, "--agents", 0)
        self.assert_refused(2, "100000000", *simulate, "--agents", 100_000_000)
        self.assert_refused(2, "4097", *simulate, "--agents", 4097)
        self.assert_refused(1 if has_torch() else 2, "no/such.ckpt", *simulate, "--policy", "no/such.ckpt")
        self.assert_refused(2, "got 'lan'; did you mean 'lane'?", *simulate, "--policy", "lan")
        if shutil.which("ffmpeg"):
            self.assert_refused(1, "/proc/nowhere", *simulate, "--agents", 2, "--steps", 2, "--video", "/proc/nowhere/a.mp4")


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

    def test_a_history_is_drawn_as_it_was_seen_and_its_rate_measured_against_the_present(self):
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
        # Images of either take about as long.
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
        self.assertRegex(facts["workload"], "cuda: asked for; kernels built (earlier )?for sm_")
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

    def test_a_measurement_is_compared_with_an_earlier_one(self):
        earlier = self.folder / "earlier.json"
        simulate = ["bench", "simulate", *self.QUICK]
        facts = self.json_of(*simulate)
        rate, slots, step = facts["results"][:3]
        # As if it had been a thousand times slower, a thousand times faster, and anything in between.
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
            self.assert_refused(1, "earlier.json: expected what a benchmark printed", "bench", "render", *self.QUICK, "--compare", earlier)

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
        self.assertEqual(values["of these out of reach"]["max"], 0)
        self.assertGreater(values["random policy: collisions"]["mean"] + values["random policy: off-road"]["mean"], 0)
        self.assertGreater(values["lane driver: goals"]["mean"], 0)
        self.assertEqual(values["lane driver: red lights"]["max"], 0)

    def test_a_soak_names_the_images_that_are_out_of_tolerance(self):
        soak = ["bench", "soak", "--map", "procedural:1", "--agents", 20, "--views", 2]
        oracle = self.json_of(*soak, "--backend", "cpu", "--scenes", 3)
        self.assertEqual((oracle["scenes"], oracle["images_out_of_tolerance"], oracle["worst"]), (3, 0, 0))
        self.assertEqual((oracle["differing_plane_pixels"], oracle["differing_answers"]), (0, 0))
        for key in ("images", "plane_pixels", "visibility_queries"):
            self.assertGreater(oracle[key], 6, key)
        # Black images are out of tolerance. A scene is the same whichever came before it.
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

    def test_rates_of_rendering_are_drawn_from_results_of_one_benchmark_or_of_several(self):
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

    def test_rates_on_several_gpus_are_drawn_from_what_gpu_ranks_measured(self):
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

    def test_bad_arguments_are_refused_by_name(self):
        def refused(status, message, *arguments):
            self.assert_refused(status, message, "bench", "render", *self.QUICK, *arguments)

        refused(2, "--sweep egos", "--sweep", "egos", "--egos", 3)
        refused(2, "--sweep sizes", "--sweep", "sizes", "--size", "8x8")
        refused(2, "--memory: expected one", "--memory", "--egos", "3,4")
        refused(2, "--size", "--size", "8")
        # What is wrong in the last case is said before a map is read.
        no_town = ["--map", self.folder / "no-town.xodr"]
        refused(2, "'8'", "--size", "9x5,8", *no_town)
        refused(2, "vulkan", "--backend", "cpu,vulkan", *no_town)
        refused(1, "no-town", *no_town)
        if not pathlib.Path("/dev/nvidia0").exists():
            status, message = (1, "renderer cuda: no CUDA device") if has_cuda() else (2, "expected one of cpu")
            refused(status, message, "--backend", "cuda")
            refused(1, "CUDA", "--memory", "--egos", 3)


class Plots(CommandCase):
    def run_folder(self, name, seed, goals, settings="a = 1"):
        """A folder as pictura train leaves one, of updates with so many goals per 1,000 steps."""
        folder = self.folder / name
        folder.mkdir()
        (folder / "config.toml").write_text(f"[run]\nseed = {seed}\n[train]\n{settings}\n")
        head = "update,charts/agent_steps,driving/goals_per_1000_steps,time/rollout_s,time/update_s\n"
        rows = [f"{i + 1},{1000 * (i + 1)},{value},1800,1800\n" for i, value in enumerate(goals)]
        (folder / "progress.csv").write_text(head + "".join(rows))
        return folder

    def test_evaluations_along_trainings_are_lines_in_bands(self):
        metrics = ["at_fault_collision_rate", "off_road_rate", "red_light_rate", "goals_per_vehicle", "km_per_infraction"]
        rows = [{"density": density, **{name: value for name in metrics}} for density, value in (("light", 0.1), ("medium", 0.2))]
        points = [{"agent_steps": steps, "gpu_hours": steps / 1e6, "rows": rows} for steps in (1e6, 3e6)]
        curves, picture = self.folder / "curves.json", self.folder / "curves.png"
        curves.write_text(json.dumps({"lines": [{"name": "agent", "points": points}, {"name": "baseline", "dashed": True, "points": points}]}))
        facts = self.json_of("plot", "--evaluations", curves, "--x", "hours", "--out", picture)
        self.assertEqual([(line["name"], line["points"], line["x_last"]) for line in facts["lines"]], [("agent", 2, 3), ("baseline", 2, 3)])
        self.assertGreater(picture.stat().st_size, 5000)
        for arguments in ([], ["--evaluations", curves, self.folder], ["--evaluations", curves, "--metrics", "a"]):
            result = run("plot", *arguments, "--out", picture)
            self.assertEqual(result.returncode, 2, result.stderr)

    def test_seeds_are_one_line_and_the_picture_is_drawn(self):
        a = self.run_folder("town_s1", 1, [1, 2, 3])
        b = self.run_folder("town_s2", 2, [3, 4, 7])
        c = self.run_folder("wide", 1, [0, 1], "a = 2")
        picture = self.folder / "curves.png"
        facts = self.json_of("plot", a, b, c, "--metrics", "goals_per_1000_steps", "--out", picture)
        self.assertGreater(picture.stat().st_size, 5000)
        self.assertEqual((facts["out"], facts["x"]), (str(picture), "agent_steps"))
        self.assertEqual(facts["metrics"], ["driving/goals_per_1000_steps"])
        self.assertEqual([line["name"] for line in facts["lines"]], ["town_s*, 2 seeds", "wide"])
        town, wide = facts["lines"]
        self.assertEqual((town["runs"], town["seeds"]), ([str(a), str(b)], [1, 2]))
        self.assertEqual((town["points"], town["x_first"], town["x_last"]), (3, 1000, 3000))
        self.assertEqual(town["last"], {"driving/goals_per_1000_steps": 5})
        self.assertEqual(wide["last"], {"driving/goals_per_1000_steps": 1})
        apart = self.json_of("plot", "--metrics", "goals_per_1000_steps,update", a, b, "--group", "none", "--x", "hours",
                             "--out", picture)  # fmt: skip
        self.assertEqual([(line["name"], line["x_last"]) for line in apart["lines"]], [("town_s1", 3), ("town_s2", 3)])
        self.assertIn("curves.png: runs 3, lines 2, panels 1",
                      run("plot", a, b, c, "--metrics", "goals_per_1000_steps", "--out", picture).stdout)  # fmt: skip

    def test_what_is_missing_is_named(self):
        a = self.run_folder("a", 1, [1, 2])
        out = ["--out", self.folder / "curves.png"]
        self.assert_refused(1, "nowhere: expected the folder of a training run", "plot", self.folder / "nowhere", *out)
        self.assert_refused(1, "a/progress.csv: expected a column 'charts/episode_return'", "plot", a, *out)
        self.assert_refused(1, "/proc/nowhere", "plot", a, "--metrics", "update", "--out", "/proc/nowhere/curves.png")
        self.assert_refused(2, "--x", "plot", a, "--x", "days", *out)
        self.assert_refused(2, "RUN", "plot", *out)
        self.assert_refused(2, "expected a name that ends in .png or .svg", "plot", a, "--out", self.folder / "curves.pdf")
        self.assertFalse((self.folder / "curves.png").exists())

    def test_a_picture_is_vector_graphics_where_its_name_says_so(self):
        curves = self.folder / "curves.svg"
        result = run("plot", self.run_folder("a", 1, [1, 2]), "--metrics", "update", "--out", curves)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn("<svg", curves.read_text())

    def test_modules_in_the_working_folder_are_not_imported(self):
        (self.folder / "json.py").write_text("raise SystemExit(7)")
        result = run("plot", self.run_folder("a", 1, [1, 2]), "--metrics", "update", "--out", "curves.png", cwd=self.folder)
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_without_matplotlib_or_python_plots_say_what_to_install(self):
        curves = self.folder / "curves.png"
        arguments = ["plot", self.run_folder("a", 1, [1, 2]), "--metrics", "goals_per_1000_steps", "--out", curves]
        result = run(*arguments, PICTURA_PYTHON=self.python_without_matplotlib())
        self.assertEqual((result.returncode, result.stdout), (1, ""))
        self.assertIn("pip install 'pictura[plot]'", result.stderr)
        self.assertIn(f"its data is in {curves}.json", result.stderr)
        (panel,) = json.loads(pathlib.Path(f"{curves}.json").read_text())["panels"]
        self.assertEqual(panel["series"][0]["y"], [1, 2])
        result = run(*arguments, PICTURA_PYTHON=self.folder / "nowhere")
        self.assertEqual((result.returncode, "PICTURA_PYTHON names one" in result.stderr), (1, True), result.stderr)
        result = run(*arguments, PICTURA_PYTHON=self.python_as("echo broken >&2; exit 5"))
        self.assertEqual((result.returncode, result.stderr), (1, "error: broken\n"))
        result = run(*arguments, PICTURA_PYTHON=self.python_as("kill -9 $$"))
        self.assertEqual((result.returncode, "was ended by signal 9" in result.stderr), (1, True), result.stderr)
        self.assertFalse(curves.exists())

    def test_an_interrupt_ends_the_python_too(self):
        running = self.folder / "running"
        python = self.python_as(f"echo $$ > {running}; exec sleep 60")
        command = [PICTURA, "plot", self.run_folder("a", 1, [1]), "--out", self.folder / "curves.png"]
        process = subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True, env={**os.environ, "PICTURA_PYTHON": str(python)})
        deadline = time.monotonic() + 60
        while not (running.exists() and running.read_text()) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, message = process.communicate(timeout=30)
        self.assertEqual((process.returncode, message), (130, "error: interrupted while a chart was drawn\n"))
        with self.assertRaises(ProcessLookupError):
            os.kill(int(running.read_text()), 0)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def checkpoint_parts(path):
    """The tensors of a checkpoint's policy by name, as tuples of floats, and the bytes of its simulator."""
    content = pathlib.Path(path).read_bytes()
    header_size = struct.unpack_from("<Q", content, 16)[0]
    header, data = json.loads(content[24 : 24 + header_size]), content[24 + header_size :]
    tensors = {
        entry["name"]: struct.unpack_from(f"<{math.prod(entry['shape'])}f", data, entry["offset"])
        for entry in header["parameters"]
    }
    simulator = header["simulator"]
    return tensors, data[simulator["offset"] : simulator["offset"] + simulator["bytes"]]


class Ranks(CommandCase):
    """Processes that train together, on the host through Gloo."""

    # Five worlds, which are two for one rank and three for the other; the whole minibatch is one step along the gradient.
    SETTINGS = ["train", *TINY, "--set", "simulator.num_slots=15", "--set", "run.num_threads=1"]
    GRADIENTS = ["--set", "train.adam_eps=1", "--set", "train.schedule=constant", "--set", "train.learning_rate=0.1"]

    def start(self, size, *arguments, port=None, of_rank=lambda rank: []):
        """One process a rank; of_rank gives more arguments for each."""
        port = port or free_port()
        place = {"WORLD_SIZE": str(size), "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
        return [
            subprocess.Popen(
                [PICTURA, *map(str, [*arguments, *of_rank(rank)])], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                text=True, env={**os.environ, **place, "RANK": str(rank)},
            )
            for rank in range(size)
        ]  # fmt: skip

    def finish(self, processes, timeout=300):
        """Of each its status, stdout and stderr."""
        results = []
        for process in processes:
            out, err = process.communicate(timeout=timeout)
            results.append((process.returncode, out, err))
        return results

    def train(self, size, *arguments):
        results = self.finish(self.start(size, *arguments, "--json"))
        self.assertEqual([status for status, _, _ in results], [0] * size, results)
        for _, out, err in results[1:]:
            self.assertEqual((out, err), ("", ""))
        return json.loads(results[0][1])

    def assert_same_but_for_rounding(self, one, other, start=None):
        """Checkpoints after one update from one state: all of the simulator's bytes, and the parameters nearly."""
        (tensors, simulator), (others, other_simulator) = checkpoint_parts(one), checkpoint_parts(other)
        self.assertEqual(simulator, other_simulator)
        before = checkpoint_parts(start)[0]
        self.assertEqual(tensors.keys(), others.keys())
        moved = 0
        for name, values in tensors.items():
            steps = [a - b for a, b in zip(values, before[name])]
            largest = max(map(abs, steps))
            moved = max(moved, largest)
            # Rounding of parameters, of up to 16, is larger than that of gradients.
            for value, other_value in zip(values, others[name]):
                self.assertAlmostEqual(value, other_value, delta=1e-3 * largest + 2e-6, msg=name)
        self.assertGreater(moved, 1e-4)

    def test_two_train_as_one_does(self):
        one = ["--set", "train.updates=1", *self.GRADIENTS, "--set", "train.adv_filter_threshold=0.2"]
        alone = self.json_of(*self.SETTINGS, *one, "--out", self.folder / "alone")
        both = self.train(2, *self.SETTINGS, *one, "--out", self.folder / "both")
        self.assertEqual((alone["ranks"], both["ranks"]), (1, 2))
        self.assertEqual(both["agent_steps"], alone["agent_steps"])
        self.assertAlmostEqual(both["km_driven"], alone["km_driven"], places=9)
        self.assert_same_but_for_rounding(
            self.folder / "alone/checkpoint.ckpt", self.folder / "both/checkpoint.ckpt",
            self.folder / "alone/untrained.ckpt",
        )  # fmt: skip
        self.assertEqual(
            (self.folder / "alone/untrained.ckpt").read_bytes(), (self.folder / "both/untrained.ckpt").read_bytes()
        )
        rows = [(self.folder / run / "progress.csv").read_text().splitlines() for run in ("alone", "both")]
        self.assertEqual(rows[0][0], rows[1][0])
        for name, value, other in zip(*(line.split(",") for line in (rows[0][0], rows[0][1], rows[1][1]))):
            if name.startswith("time/") or name == "charts/agent_steps_per_s" or value == other:
                continue
            self.assertAlmostEqual(float(value), float(other), delta=1e-3 * abs(float(value)) + 1e-5, msg=name)

    def test_any_number_of_ranks_goes_on_from_a_checkpoint(self):
        updates = lambda n: ["--set", f"train.updates={n}", *self.GRADIENTS]
        for saved_by, run in ((2, "two"), (1, "one")):
            self.train(saved_by, *self.SETTINGS, *updates(2), "--out", self.folder / run)
            start = self.folder / f"{run}.ckpt"
            shutil.copy(self.folder / run / "checkpoint.ckpt", start)
            for size in (1, 2, 3):
                out = self.folder / f"{run}-{size}"
                shutil.copytree(self.folder / run, out)
                report = self.train(size, *self.SETTINGS, *updates(3), "--out", out, "--resume")
                self.assertEqual((report["updates"], report["ranks"]), (3, size))
            for size in (2, 3):
                self.assert_same_but_for_rounding(
                    self.folder / f"{run}-1/checkpoint.ckpt", self.folder / f"{run}-{size}/checkpoint.ckpt", start
                )

    def long_run(self, out):
        """Two ranks that have saved a checkpoint and go on for long."""
        processes = self.start(
            2, *self.SETTINGS, "--set", "train.updates=1000000", "--set", "train.checkpoint_every=1", "--out", out
        )
        deadline = time.monotonic() + 120
        while not (out / "checkpoint.ckpt").exists():
            self.assertLess(time.monotonic(), deadline)
            self.assertEqual([process.poll() for process in processes], [None, None])
            time.sleep(0.05)
        return processes

    def test_a_rank_that_is_killed_or_stopped_ends_the_others_by_name(self):
        def end(victim, how):
            out = self.folder / f"{victim}-{how}"
            processes = self.long_run(out)
            processes[victim].send_signal(how)
            began = time.monotonic()
            _, err = processes[1 - victim].communicate(timeout=120)
            self.assertLess(time.monotonic() - began, 60)
            self.assertEqual(processes[1 - victim].returncode, 1, err)
            self.assertRegex(err.splitlines()[-1], f"^error: rank {victim}: .* killed or stopped")
            processes[victim].kill()
            processes[victim].communicate()
            # The last checkpoint is whole, and one process goes on from it.
            updates = int((out / "progress.csv").read_text().splitlines()[-1].split(",")[0])
            report = self.json_of(*self.SETTINGS, "--set", f"train.updates={updates + 2}", "--out", out, "--resume")
            self.assertEqual(report["updates"], updates + 2)

        # At once, since half a minute passes until a stopped rank is missed.
        cases = [(victim, how) for victim in (0, 1) for how in (signal.SIGKILL, signal.SIGSTOP)]
        with concurrent.futures.ThreadPoolExecutor() as pool:
            for case in [pool.submit(end, *each) for each in cases]:
                case.result()

    def test_a_request_to_end_that_one_gets_ends_both_after_the_same_update(self):
        for asked in (0, 1):
            out = self.folder / f"run{asked}"
            processes = self.long_run(out)
            processes[asked].send_signal(signal.SIGTERM)
            results = self.finish(processes)
            self.assertEqual([status for status, _, _ in results], [143, 143], results)
            updates = int((out / "progress.csv").read_text().splitlines()[-1].split(",")[0])
            report = self.train(
                2, *self.SETTINGS, "--set", f"train.updates={updates + 1}", "--out", out, "--resume"
            )  # fmt: skip
            self.assertEqual(report["updates"], updates + 1)

    def test_ranks_that_disagree_are_refused_by_key(self):
        other = lambda rank: ["--set", f"train.learning_rate={0.001 * (rank + 1)}"]
        for status, _, err in self.finish(self.start(2, *self.SETTINGS, "--out", self.folder / "run", of_rank=other)):
            self.assertEqual(status, 1)
            self.assertIn("ranks 0 and 1 have other settings: train.learning_rate: 0.001 and 0.002", err)
        self.assertFalse((self.folder / "run").exists())
        for status, _, err in self.finish(
            self.start(2, *self.SETTINGS, "--out", self.folder / "run", of_rank=lambda rank: ["--resume"][:rank])
        ):
            self.assertEqual(status, 1)
            self.assertIn("ranks 0 and 1 have other settings: old_run", err)

    def test_bad_input_is_refused_by_name(self):
        with socket.create_server(("0.0.0.0", 0)) as server:
            port = server.getsockname()[1]
            first = self.start(2, *self.SETTINGS, "--out", self.folder / "run", port=port)
            status, _, err = self.finish(first[:1])[0]
            first[1].kill()
            first[1].communicate()
            self.assertEqual(status, 1)
            self.assertRegex(err, f"rank 0: cannot listen at 127.0.0.1:{port} .*MASTER_PORT.*in use")
        # What one rank finds is every rank's error.
        results = self.finish(self.start(2, *self.SETTINGS, "--set", "simulator.num_slots=3", "--out", self.folder / "run"))
        for status, _, err in results:
            self.assertIn(status, (1, 2))
            self.assertIn("1 worlds cannot be divided over 2 processes", err)
        environment = {**os.environ, "RANK": "1"}
        result = subprocess.run(
            [PICTURA, *map(str, self.SETTINGS), "--out", str(self.folder / "run")],
            capture_output=True, text=True, env=environment, timeout=60,
        )  # fmt: skip
        self.assertEqual(result.returncode, 1)
        self.assertIn("RANK is set and WORLD_SIZE is not", result.stderr)


class Replays(CommandCase):
    """What the pages hold is tested with replay/, what browsers make of them in tests/replay/page_test.py."""

    WORLD = ["procedural:1:blocks=2x2", "--agents", 12, "--seed", 4]

    def test_simulate_records_what_it_counts_and_drives_alike(self):
        path = self.folder / "a.html"
        simulate = ["simulate", *self.WORLD, "--steps", 60, "--policy", "random"]
        facts = self.json_of(*simulate, "--replay", path, "--follow", 3)
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

    def test_a_gallery_takes_the_place_of_an_earlier_one(self):
        folder = self.folder / "gallery"
        replay = ["replay", "procedural:1:blocks=2x2", "--agents", 4, "--steps", 10]
        self.json_of(*replay, "--gallery", folder, "--episodes", 3)
        self.json_of(*replay, "--out", folder / "mine.html")
        self.json_of(*replay, "--gallery", folder, "--episodes", 2, "--seed", 7)
        self.assertEqual(sorted(path.name for path in folder.glob("[!.]*")), ["index.html", "mine.html", "seed_7.html", "seed_8.html"])

    def test_the_worst_scenarios_of_an_evaluation_are_driven_again(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        evaluate = ["evaluate", "--policy", "random", "--map", "procedural:1:blocks=2x2,procedural:2:blocks=2x2", "--agents", 10,
                    "--scenarios", 4, "--steps", 80]  # fmt: skip
        out, folder = self.folder / "results.json", self.folder / "gallery"
        result = run(*evaluate, "--out", out, "--replays", 2, "--gallery", folder, "--replay", self.folder / "worst.html")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("notice", result.stderr)  # they count what the evaluation did
        scenarios = json.loads(out.read_text())["densities"][0]["scenarios"]
        rates = [s["at_fault_infraction"] / s["vehicles"] for s in scenarios]
        worst = sorted(range(4), key=lambda i: -rates[i])[:2]
        self.assertEqual(sorted(p.name for p in folder.glob("[!.]*")), sorted(["index.html", *(f"custom_{i}.html" for i in worst)]))
        self.assertEqual(header_of(self.folder / "worst.html")["map"], f"procedural:{1 + worst[0] % 2}:blocks=2x2")
        self.assert_refused(2, "--gallery", *evaluate, "--replays", 2)
        self.assert_refused(2, "--follow: has no effect without --replay", *evaluate, "--follow", 1)

    def test_a_probes_case_is_driven_again_with_its_road_user(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        policies = []
        # The second drives in the first's world, which has pedestrians and walls.
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
                self.assertNotIn("notice", result.stderr)  # it drives as it did
                header, case = header_of(path), cases[number]
                shown = header["case"]
                self.assertIn(f"case {number}: ", shown["what"])
                self.assertIn(shown["what"], result.stderr)
                self.assertEqual((shown["frame"], shown["ego"], header["followed"]), (int(case["step"]), int(case["ego"]), int(case["ego"])))
                self.assertEqual(shown["removed"], int(case["hidden"]) if kind == "removal" else None)
                self.assertIn(case["driver"], header["policy"])
                # Of the state as it is driven: with who is removed, without who is inserted.
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
        result = run(*probe, "--replay", path, "--case", len(cases))  # how many there are is known in the end
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
        self.assertIn(f"case 0: agent {case['user']} comes hidden", shown["what"])
        self.assertIn(f"from here on images drives agent {case['ego']}", shown["what"])
        self.assertNotIn("notice", result.stderr)  # it takes over as it did
        self.assertEqual((case["policy"], case["walls"], case["case"]), ("images", "on", "hidden"))
        self.assertEqual(header["frames"], round(10 * float(case["lasted_s"])) + 1)
        self.assert_refused(2, "--case: expected 0 to 0, got 1", *corner, *out, "--case", 1)
        self.assert_refused(2, "--case: expected 0 to 79, got 80", "probe", "removal", *world, "--removals", 80, "--replay", path, "--case", 80)

    def test_a_policys_decisions_are_those_that_it_drives_by(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run")
        path = self.folder / "policy.html"
        checkpoint = self.folder / "run" / "checkpoint.ckpt"
        self.json_of("replay", *self.WORLD, "--policy", checkpoint, "--steps", 20, "--follow", 2, "--cameras", "--out", path)
        header = header_of(path)
        self.assertEqual([(c["width_px"], c["height_px"]) for c in header["cameras"]], [(16, 9)] * 4)
        self.assertRegex(header["policy_hash"], "^[0-9a-f]{16}$")
        actions = self.numbers_of(path, "action")[2 * 21 : 3 * 21]  # of agent 2, order 0
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

    def test_policies_are_trained_and_evaluated_on_all_at_once(self):
        if not has_torch():
            self.skipTest("built without torch")
        names = ",".join(map(str, MAP_CASES))
        few = ["--map", names, "--agents", 4, "--steps", 30, "--density", "light", "--scenarios", len(MAP_CASES)]
        self.assertEqual(self.json_of("evaluate", "--policy", "lane", *few)["rows"][0]["scenarios"], len(MAP_CASES))
        maps = json.dumps([str(path) for path in MAP_CASES])
        self.json_of("train", *TINY, "--set", f"simulator.maps={maps}", "--set", f"simulator.num_slots={3 * len(MAP_CASES)}",
                     "--set", "train.updates=2", "--out", self.folder / "run")
        evaluated = self.json_of("evaluate", self.folder / "run" / "checkpoint.ckpt", *few)
        self.assertEqual(evaluated["rows"][0]["scenarios"], len(MAP_CASES))


class Training(CommandCase):
    def test_runs_are_plotted_by_seed(self):
        folders = [self.folder / f"seed{seed}" for seed in (1, 2)]
        for seed, out in enumerate(folders, 1):
            self.json_of("train", *TINY, "--set", "train.updates=3", "--set", f"run.seed={seed}", "--out", out)
        facts = self.json_of("plot", *folders, "--out", self.folder / "curves.png")
        self.assertEqual([(line["name"], line["seeds"]) for line in facts["lines"]], [("seed*, 2 seeds", [1, 2])])
        self.assertEqual(len(facts["metrics"]), 6)
        self.assertTrue((self.folder / "curves.png").exists())

    def test_progress_is_one_line_in_place_on_a_terminal_and_few_lines_elsewhere(self):
        train = ["train", *TINY, "--set", "train.updates=4"]
        lines = run(*train, "--out", self.folder / "plain").stderr.splitlines()
        self.assertEqual((lines[0][:12], lines[-1][:12]), ("update 1/4  ", "update 4/4  "))
        self.assertRegex(lines[-1], r"ETA .* agent-steps .*/s .* goals, .* at fault, .* m/s  simulate \d+ %, render")
        self.assertNotIn("\r", "".join(lines))
        child, terminal = pty.fork()
        if child == 0:
            # 50 columns.
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 50, 0, 0))
            os.execv(PICTURA, [PICTURA, *train, "--set", "train.num_steps=64", "--out", str(self.folder / "shown")])
        shown = b""
        try:
            while part := os.read(terminal, 4096):
                shown += part
        except OSError:  # the terminal's end
            pass
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0, shown)
        begin, *updates, last = shown.decode().split("\r\033[K")
        self.assertEqual(begin, "")
        self.assertEqual([len(line) for line in updates], [49] * len(updates))
        self.assertTrue(updates[0].startswith("update 1/4  ETA "), updates)
        self.assertRegex(last, r"^update 4/4  .* m/s  simulate \d+ %, .*\r\n.* agent-steps in 4 updates")

    def test_resume_is_exact(self):
        whole = self.json_of("train", *TINY, "--set", "train.updates=4", "--out", self.folder / "whole")
        self.json_of("train", *TINY, "--set", "train.updates=2", "--out", self.folder / "parts")
        parts = self.json_of("train", *TINY, "--set", "train.updates=4", "--out", self.folder / "parts", "--resume")
        for key in ("policy_hash", "updates", "agent_steps"):
            self.assertEqual(whole[key], parts[key], key)
        for name in ("checkpoint.ckpt", "untrained.ckpt", "policy.safetensors", "progress.csv"):
            self.assertTrue((self.folder / "whole" / name).exists(), name)

    def test_exported_weights_drive_as_the_checkpoint_does(self):
        run_folder, weights = self.folder / "run", self.folder / "weights.safetensors"
        trained = self.json_of("train", *TINY, "--set", "train.updates=1", "--out", run_folder)
        whole = self.json_of("export", run_folder / "checkpoint.ckpt", "--weights", "f32", "--out", weights)
        self.assertEqual(whole["policy_hash"], trained["policy_hash"])
        self.assertEqual((whole["updates"], whole["agent_steps"]), (1, trained["agent_steps"]))
        self.assertEqual(weights.stat().st_size, whole["bytes"])
        drive = ["simulate", "procedural:1", "--agents", 4, "--steps", 20, "--policy"]
        expected = self.json_of(*drive, run_folder / "checkpoint.ckpt")
        got = self.json_of(*drive, weights)
        self.assertEqual(got["state_hash"], expected["state_hash"])
        half = self.json_of("export", weights, "--out", self.folder / "half.safetensors")
        self.assertLess(half["bytes"], whole["bytes"] - 1.9 * half["parameters"])
        self.assert_refused(1, "weights.safetensors", "train", *TINY, "--init-from", weights,
                            "--set", "policy.backbone_width=8", "--out", self.folder / "other")
        self.assert_refused(1, "none.ckpt", "export", "none.ckpt", "--out", self.folder / "x.safetensors")
        self.assert_refused(2, ".safetensors", "export", weights, "--out", self.folder / "x.bin")

    def test_a_policy_is_exported_for_larger_images(self):
        checkpoint, larger = self.folder / "run" / "checkpoint.ckpt", self.folder / "larger.safetensors"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run")
        exported = self.json_of("export", checkpoint, "--size", "48x27", "--weights", "f32", "--out", larger)
        small = self.json_of("export", checkpoint, "--weights", "f32", "--out", self.folder / "small.safetensors")
        self.assertGreater(exported["parameters"], small["parameters"])
        self.json_of("simulate", "procedural:1", "--agents", 4, "--steps", 5, "--policy", larger)
        at_its_size = [*TINY, "--set", "render.width_px=48", "--set", "render.height_px=27", "--set", "train.updates=1"]
        begin = ["train", *at_its_size, "--init-from", larger]
        self.json_of(*begin, "--set", "policy.patch_px=3", "--out", self.folder / "next")
        self.assert_refused(1, "'conv.0.weight'", *begin, "--out", self.folder / "other")
        for size, expected in ("40x27", "whole number of times 16x9, got 40x27"), ("many", "--size"):
            self.assert_refused(2, expected, "export", checkpoint, "--size", size, "--out", self.folder / "x.safetensors")

    def test_a_folder_with_a_run_asks_what_to_do_with_it(self):
        one = ["train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run"]
        first = self.json_of(*one)
        self.assert_refused(1, f"{self.folder}/run: holds a run already (checkpoint.ckpt, ", *one)
        self.assert_refused(2, "excludes", *one, "--overwrite", "--resume")
        self.assertEqual(self.json_of(*one, "--overwrite")["policy_hash"], first["policy_hash"])

    def test_bad_input_is_refused_by_name(self):
        out = ["--out", self.folder / "run"]
        self.assert_refused(1, "train.speed", "train", *TINY, "--set", "train.speed=3", *out)
        self.assert_refused(1, "simulator.num_slots", "train", *TINY, "--set", "simulator.num_slots=0", *out)
        self.assert_refused(1, "simulator.num_slots", "train", *TINY, "--set", "simulator.num_slots=100000000000", *out)
        self.assert_refused(1, "render.width_px", "train", *TINY, "--set", "render.width_px=0", *out)
        self.assert_refused(1, "/proc/nowhere", "train", *TINY, "--out", "/proc/nowhere")
        self.assert_refused(1, "no/such.toml", "train", "--config", "no/such.toml", *out)
        self.assert_refused(2, "'8'", "evaluate", "no.ckpt", "--size", "8")
        self.assert_refused(2, "excludes", "evaluate", "no.ckpt", "--size", "8x8", "--rig", "rig.toml")

    def test_broken_and_foreign_checkpoints_are_refused(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", out)
        self.assert_refused(1, "policy.", "train", *TINY, "--set", "policy.backbone_width=48", "--set", "train.updates=2",
                            "--out", out, "--resume")  # fmt: skip
        checkpoint = out / "checkpoint.ckpt"
        data = checkpoint.read_bytes()
        evaluate = ["--map", "procedural:1", "--agents", 2, "--scenarios", 1, "--steps", 2]
        for name, content in [("truncated", data[: len(data) // 2]), ("foreign", b"PK\x03\x04" + data[4:]), ("empty", b"")]:
            with self.subTest(name):
                checkpoint.write_bytes(content)
                self.assert_refused(1, "checkpoint.ckpt", "evaluate", checkpoint, *evaluate)

    def test_backends_are_named_and_checked(self):
        one = ["train", *TINY, "--set", "train.updates=1"]
        black = self.json_of(*one, "--renderer", "null", "--out", self.folder / "black")
        self.assertEqual((black["simulator"], black["renderer"], black["device"]), ("cpu", "null", "cpu"))
        old = self.json_of(*one, "--set", "run.backend=null", "--out", self.folder / "old")
        self.assertEqual(old["policy_hash"], black["policy_hash"])
        out = ["--out", self.folder / "run"]
        self.assert_refused(2, "expected one of cpu, ", *one, *out, "--renderer", "vulkan")
        self.assert_refused(2, "expected one of cpu, ", *one, *out, "--simulator", "null")
        self.assert_refused(1, "run.device: expected one of cpu, cuda, cuda:N, auto", *one, *out, "--device", "gpu")
        on_host = 'render.backend: "null" works in host memory, but run.device is "cuda"'
        self.assert_refused(1, on_host, *one, *out, "--renderer", "null", "--device", "cuda")
        if not pathlib.Path("/dev/nvidia0").exists():
            self.assert_refused(1, "run.device: cuda: ", *one, *out, "--device", "cuda")
        self.assert_refused(1, "only gl takes samples", *one, *out, "--renderer", "cpu", "--samples", "4x4")
        self.assert_refused(1, "render.backend: expected one of cpu, ", *one, *out, "--set", "render.backend=vulkan")
        evaluate = ["evaluate", self.folder / "black" / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 2,
                    "--scenarios", 1, "--steps", 2]  # fmt: skip
        self.json_of(*evaluate, "--renderer", "cpu", "--simulator", "cpu", "--device", "cpu")
        self.assert_refused(1, on_host, *evaluate, "--device", "cuda")

    def test_an_evaluation_in_parts_is_merged_exactly(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", out)
        evaluate = ["evaluate", out / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 4, "--density", "light",
                    "--steps", 5, "--out"]  # fmt: skip
        paths = {name: self.folder / f"{name}.json" for name in ["whole", "a", "b", "merged"]}
        whole = self.json_of(*evaluate, paths["whole"], "--scenarios", 3)["rows"]
        self.json_of(*evaluate, paths["a"], "--scenarios", 1)
        self.json_of(*evaluate, paths["b"], "--scenarios", "1:3")
        merged = self.json_of("evaluate", "--merge", paths["b"], paths["a"], "--out", paths["merged"])["rows"]
        self.assertEqual(merged, whole)
        self.assertEqual(paths["merged"].read_bytes(), paths["whole"].read_bytes())
        self.assertIn("goals_per_vehicle_half_width_95", whole[0])
        self.assert_refused(1, "expected 3", "evaluate", "--merge", paths["whole"], paths["b"])
        for x_m, path, scenarios in ((1.5, paths["a"], "0:1"), (2, paths["b"], "1:2")):
            rig = self.folder / "rig.toml"
            rig.write_text("".join(f"[[camera]]\nname = 'c{i}'\nwidth_px = 16\nheight_px = 9\nfocal_px = 9\nx_m = {x_m}\nz_m = 1.5\n" for i in range(4)))
            self.json_of(*evaluate, path, "--scenarios", scenarios, "--rig", rig)
        self.assert_refused(1, "b.json: cameras_hash is", "evaluate", "--merge", paths["a"], paths["b"])
        self.assert_refused(2, "--scenarios", *evaluate, paths["a"], "--scenarios", "3:3")

    def test_controllers_are_evaluated_like_policies(self):
        evaluate = ["evaluate", "--map", "procedural:1", "--agents", 12, "--scenarios", 2, "--steps", 300]
        lane = self.json_of(*evaluate, "--policy", "lane")
        self.assertEqual((lane["checkpoint"], lane["controller"], lane["device"]), (None, "lane", "cpu"))
        self.assertGreater(lane["rows"][0]["goals_per_vehicle"], 0)
        self.assertEqual(lane["rows"][0]["red_light_rate"], 0)
        alone = self.json_of(*evaluate, "--policy", "lane", "--light-cycles", "independent")
        self.assertEqual((lane["light_cycles"], alone["light_cycles"]), ("phases", "independent"))
        self.assertNotEqual(lane["rows"], alone["rows"])
        idle = self.json_of(*evaluate, "--policy", "idle", "--device", "cpu")
        self.assertEqual(idle["rows"][0]["km_driven"], 0)
        # In parts, and in the world of a checkpoint, here without cyclists and pedestrians.
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--set", "simulator.pedestrian_fraction=0", "--set",
                     "simulator.cyclist_fraction=0", "--out", out)  # fmt: skip
        parts = [self.folder / "a.json", self.folder / "b.json"]
        for path, scenarios in zip(parts, ["0:1", "1:2"]):
            self.json_of("evaluate", out / "checkpoint.ckpt", *evaluate[1:-4], "--steps", 300, "--policy", "lane",
                         "--scenarios", scenarios, "--out", path)  # fmt: skip
        merged = self.json_of("evaluate", "--merge", *parts)
        self.assertEqual(merged["rows"][0]["vehicle_episodes"], 24)
        # In another world, and on a map that has changed.
        self.json_of(*evaluate[:-4], "--steps", 300, "--policy", "lane", "--scenarios", "1:2", "--out", parts[1])
        self.assert_refused(1, "b.json: config.simulator.cyclist_fraction is", "evaluate", "--merge", *parts)
        town = self.town()
        for seed, path, scenarios in zip((3, 4), parts, ("0:1", "1:2")):
            town.write_bytes(self.town(seed=seed).read_bytes())
            self.json_of("evaluate", "--map", town, "--agents", 4, "--steps", 5, "--policy", "idle", "--scenarios", scenarios, "--out", path)
        self.assert_refused(1, "b.json: maps_hash is", "evaluate", "--merge", *parts)
        self.assert_refused(2, "random, idle, lane, idm_lanes, log, inverse, idm; got 'pilot'", *evaluate, "--policy", "pilot")
        self.assert_refused(2, "random, idle, lane, idm_lanes; got 'log'", *evaluate, "--policy", "log")
        self.assert_refused(2, "excludes", *evaluate, "--policy", "lane", "--sampled")
        self.assert_refused(2, "lane sees no images", *evaluate, "--policy", "lane", "--renderer", "cpu")
        self.assert_refused(2, "expected a CHECKPOINT, --policy, or --merge", *evaluate)

    def test_training_on_a_device_says_so(self):
        if os.environ.get("PICTURA_REQUIRE_GPU") != "1":
            self.skipTest("PICTURA_REQUIRE_GPU is not 1")
        out = self.folder / "run"
        report = self.json_of("train", *TINY, "--set", "train.updates=1", "--device", "cuda", "--out", out)
        self.assertEqual((report["simulator"], report["renderer"], report["device"]), ("cuda", "cuda", "cuda:0"))
        rows = self.json_of("evaluate", out / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 8, "--scenarios", 2,
                            "--steps", 40, "--device", "cuda")["rows"]  # fmt: skip
        self.assertGreater(rows[0]["km_driven"], 0)

    def test_minutes_end_a_run_that_can_go_on(self):
        train = ["train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run"]
        self.assert_refused(2, "--minutes", *train, "--minutes", 0)
        stopped = self.json_of(*train, "--minutes", 1e-9)
        self.assertEqual((stopped["out_of_time"], stopped["updates"], stopped["episode_return"]), (True, 0, None))
        resumed = self.json_of(*train, "--resume", "--minutes", 60)
        self.assertEqual((resumed["out_of_time"], resumed["updates"]), (False, 1))

    def test_a_policy_is_driven_in_the_world_that_it_was_trained_in(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--set", "simulator.walls=true",
                     "--set", "simulator.wall_seed=9", "--set", "simulator.parked_cars=2",
                     "--set", "simulator.light_heads=visible", "--out", out)  # fmt: skip
        drive = ["simulate", "procedural:1", "--agents", 4, "--steps", 5, "--policy", out / "checkpoint.ckpt"]
        driven = self.json_of(*drive)
        self.assertEqual((driven["wall_seed"], driven["parked_asked"], driven["light_cycles"], driven["light_heads"]), (9, 2, "phases", "visible"))
        self.assertEqual(self.json_of(*drive, "--light-cycles", "independent")["light_cycles"], "independent")
        self.assertEqual(self.json_of(*drive, "--light-heads", "as_mapped")["light_heads"], "as_mapped")
        self.assertEqual(self.json_of(*drive, "--no-walls")["wall_seed"], None)
        self.assertEqual(self.json_of(*drive, "--renderer", "null")["renderer"], "null")
        if shutil.which("ffmpeg"):
            self.json_of(*drive, "--video", self.folder / "drive.mp4")
            self.assertGreater((self.folder / "drive.mp4").stat().st_size, 2000)

    def test_bench_train_says_what_simulated_drew_and_learnt(self):
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

    def test_where_the_time_of_an_update_goes_is_measured_by_size_and_renderer(self):
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

    def test_an_interrupt_leaves_a_checkpoint_to_go_on_from(self):
        out = self.folder / "run"
        arguments = [PICTURA, "train", *TINY, "--set", "train.updates=100000", "--set", "train.checkpoint_every=1"]
        process = subprocess.Popen([*arguments, "--out", str(out)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        deadline = time.monotonic() + 120
        while not (out / "checkpoint.ckpt").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 130, errors)
        self.assertIn(b"error: interrupted", errors)
        result = self.json_of("evaluate", out / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 2, "--scenarios", 1,
                              "--steps", 2, "--device", "cpu")  # fmt: skip
        self.assertEqual(result["rows"][0]["scenarios"], 1)

    # Rollouts that take long, and updates that take far longer.
    LONG = ["train", *TINY, "--set", "train.num_steps=4000"]
    LONG_UPDATES = ["train", *TINY, "--set", "train.update_epochs=1000", "--set", "train.minibatch_size=1"]

    def start(self, *arguments, until, **options):
        """The process of a command that has written a file."""
        command = [PICTURA, *map(str, arguments)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
        self.addCleanup(process.kill)
        self.wait_for(until.exists)
        return process

    def wait_for(self, is_there):
        deadline = time.monotonic() + 120
        while not is_there() and time.monotonic() < deadline:
            time.sleep(0.02)

    def test_each_signal_saves_what_there_is_and_has_its_status(self):
        for name, status in [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)]:
            with self.subTest(name):
                out = self.folder / name
                process = self.start(*self.LONG, "--out", out, until=out / "untrained.ckpt")
                process.send_signal(getattr(signal, name))
                _, errors = process.communicate(timeout=120)
                self.assertEqual(process.returncode, status, errors)
                self.assertEqual(errors.splitlines()[-1], f"error: interrupted; go on with --resume --out {out}")
                for file in ("checkpoint.ckpt", "policy.safetensors"):
                    self.assertTrue((out / file).exists(), file)
                result = run(*self.LONG, "--out", out, "--resume", "--minutes", 0.0001, "--json")
                self.assertEqual(json.loads(result.stdout)["updates"], 0, result.stderr)

    def test_other_commands_have_the_statuses_of_signals_too(self):
        for name, status in [("SIGTERM", 143), ("SIGHUP", 129)]:
            process = subprocess.Popen([PICTURA, "simulate", "procedural:1", "--agents", "8", "--steps", "10000000"],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
            self.addCleanup(process.kill)
            time.sleep(2)
            process.send_signal(getattr(signal, name))
            _, errors = process.communicate(timeout=120)
            self.assertEqual((process.returncode, "error: interrupted at step" in errors), (status, True), errors)

    def test_a_second_signal_ends_it_at_once_unless_it_is_the_first_sent_twice(self):
        out = self.folder / "impatient"
        process = self.start(*self.LONG_UPDATES, "--out", out, until=out / "untrained.ckpt")
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        time.sleep(0.5)
        self.assertIsNone(process.poll(), "an update is not interrupted")
        process.send_signal(signal.SIGHUP)
        time.sleep(0.5)
        self.assertIsNone(process.poll(), "a hang-up is no impatience")
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=10)
        self.assertEqual(process.returncode, 143)
        self.assertFalse((out / "checkpoint.ckpt").exists())
        out = self.folder / "twice"
        process = self.start(*self.LONG, "--out", out, until=out / "untrained.ckpt")
        process.send_signal(signal.SIGTERM)
        time.sleep(0.002)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=120)
        self.assertEqual((process.returncode, (out / "checkpoint.ckpt").exists()), (143, True))

    def test_a_run_loses_nothing_by_a_stderr_that_takes_nothing(self):
        train = [PICTURA, "train", *TINY, "--set", "train.updates=2", "--out"]
        reader, closed_pipe = os.pipe()
        os.close(reader)
        self.addCleanup(os.close, closed_pipe)
        with open("/dev/full", "wb") as full:
            for name, options in {"closed": {"preexec_fn": lambda: os.close(2)}, "full": {"stderr": full},
                                  "pipe": {"stderr": closed_pipe}}.items():  # fmt: skip
                with self.subTest(name):
                    out = self.folder / name
                    result = subprocess.run([*train, str(out)], stdout=subprocess.DEVNULL, **options)
                    self.assertEqual(result.returncode, 0)
                    self.assertTrue((out / "policy.safetensors").exists())
                    self.assertTrue((out / "lock").read_text().isdigit())
                    rows = list(csv.DictReader((out / "progress.csv").read_text().splitlines()))
                    self.assertEqual([row["update"] for row in rows], ["1", "2"])

    def test_a_terminal_that_hangs_up_takes_nothing_with_it(self):
        out = self.folder / "run"
        child, terminal = pty.fork()
        if child == 0:
            os.execv(PICTURA, [PICTURA, *self.LONG, "--out", str(out)])
        self.wait_for((out / "untrained.ckpt").exists)
        os.close(terminal)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 129)
        self.assertTrue((out / "policy.safetensors").exists())

    def test_under_nohup_a_hang_up_changes_nothing(self):
        out = self.folder / "run"
        process = self.start(*self.LONG, "--out", out, until=out / "untrained.ckpt",
                             preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))  # fmt: skip
        process.send_signal(signal.SIGHUP)
        time.sleep(0.5)
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=120)
        self.assertEqual(process.returncode, 143)

    def test_the_average_of_weights_is_evaluated_and_exported(self):
        out, exported = self.folder / "run", self.folder / "average.safetensors"
        trained = self.json_of("train", *TINY, "--set", "train.updates=2", "--set", "train.weight_average=2", "--out", out)
        report = self.json_of("export", out / "checkpoint.ckpt", "--average", "--weights", "f32", "--out", exported)
        small = ["--map", "procedural:1", "--agents", 4, "--scenarios", 1, "--steps", 5, "--device", "cpu"]
        hashes = {report["policy_hash"], *(self.json_of("evaluate", *policy, *small)["policy_hash"] for policy in (
            [out / "checkpoint.ckpt", "--average"], [out / "policy_average.safetensors"], [exported]))}  # fmt: skip
        self.assertEqual(len(hashes), 1, hashes)
        self.assertNotIn(trained["policy_hash"], hashes)
        self.assert_refused(1, "policy.safetensors: holds one set of weights", "evaluate", out / "policy.safetensors", "--average", *small)
        self.assert_refused(2, "--policy excludes --average", "evaluate", "--policy", "lane", "--average", *small)

    def test_evaluation_has_its_keys(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", out)
        result = self.json_of("evaluate", "--map", "procedural:1", out / "checkpoint.ckpt", "--density", "light", "--agents", 8,
                              "--scenarios", 2, "--steps", 40, "--device", "cpu")  # fmt: skip
        keys = """density scenarios steps at_fault_collision_rate off_road_rate red_light_rate goals_per_vehicle
                  collision_rate wall_contact_rate km_per_infraction km_per_at_fault_infraction km_driven""".split()
        self.assertEqual([key for key in keys if key not in result["rows"][0]], [])


if __name__ == "__main__":
    PICTURA = os.path.abspath(sys.argv.pop(1))
    unittest.main()
