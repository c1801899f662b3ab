"""`pictura simulate` from outside."""

import os
import pathlib
import shutil
import signal
import subprocess
import unittest

from command_case import PICTURA, CommandCase, needs_ffmpeg, run

TOWNS = sorted(path.stem for path in pathlib.Path(os.environ.get("PICTURA_DATA", "/nowhere")).glob("carla/*.xodr"))


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

    def test_a_small_world_reports_refused_agents(self):
        result = self.json_of("simulate", self.town(blocks="1x1"), "--agents", 1024, "--steps", 5, "--policy", "idle")
        self.assertEqual(result["asked"], 1024)
        self.assertEqual(result["spawned"] + result["refused"], 1024)
        self.assertGreater(result["refused"], 0)

    @unittest.skipUnless(TOWNS, "no towns: set PICTURA_DATA")
    def test_every_town_spawns_1024_agents_or_reports_refusals(self):
        for town in TOWNS:
            with self.subTest(town):
                result = self.json_of("simulate", town, "--agents", 1024, "--steps", 2, "--policy", "idle")
                self.assertEqual(result["asked"], 1024)
                self.assertEqual(result["spawned"] + result["refused"], 1024)
                self.assertEqual(result["refused_no_place"] + result["refused_taken"], result["refused"])
                self.assertEqual(result["vehicles"] + result["cyclists"] + result["pedestrians"], result["spawned"])
                self.assertGreater(result["vehicles"], 2 * result["cyclists"])
                self.assertGreater(result["pedestrians"], 0)

    def test_the_population_has_the_requested_shares(self):
        town = self.town()
        result = self.json_of("simulate", town, "--agents", 40, "--steps", 1, "--pedestrians", 0, "--cyclists", 1, "--parked", 3)
        self.assertEqual((result["vehicles"], result["cyclists"], result["pedestrians"]), (0, result["spawned"], 0))
        self.assertEqual(result["parked_asked"], 3)
        self.assertLessEqual(result["parked_placed"], 3)
        self.assert_refused(2, "at most 1 together", "simulate", town, "--pedestrians", 0.7, "--cyclists", 0.7)
        self.assert_refused(2, "--parked", "simulate", town, "--parked", -1)

    @needs_ffmpeg
    def test_a_film_interrupted_before_its_first_frame_exits_with_the_signals_status(self):
        video = self.folder / "film.mp4"
        # Served worlds wait for a page.
        arguments = ["simulate", "procedural:1", "--agents", "4", "--serve", "--video", str(video)]
        with subprocess.Popen([PICTURA, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            self.assertIn("serving http", process.stderr.readline())
            process.send_signal(signal.SIGINT)
            self.assertIn("error: interrupted at step 0", process.stderr.read())
        self.assertEqual((process.returncode, video.exists()), (130, False))

    @needs_ffmpeg
    def test_a_video_is_written(self):
        video = self.folder / "drive.mp4"
        film = ["simulate", self.town(), "--agents", 5, "--steps", 12, "--policy", "random", "--video", video]
        self.json_of(*film)
        self.assertGreater(video.stat().st_size, 2000)
        self.json_of(*film, "--film-width", 0, "--film-agent", 4)
        self.assert_refused(2, "--film-agent", *film, "--film-agent", 5)
        self.assert_refused(2, "--film-width", *film, "--film-width", -1)

    def test_errors_name_bad_arguments(self):
        simulate = ["simulate", self.town()]
        self.assert_refused(2, "--agents", *simulate, "--agents", 0)
        self.assert_refused(2, "100000000", *simulate, "--agents", 100_000_000)
        self.assert_refused(2, "4097", *simulate, "--agents", 4097)
        self.assert_refused(1, "no/such.ckpt", *simulate, "--policy", "no/such.ckpt")
        self.assert_refused(2, "got 'lan'; did you mean 'lane'?", *simulate, "--policy", "lan")
        if shutil.which("ffmpeg"):
            self.assert_refused(1, "/proc/nowhere", *simulate, "--agents", 2, "--steps", 2, "--video", "/proc/nowhere/a.mp4")


if __name__ == "__main__":
    unittest.main()
