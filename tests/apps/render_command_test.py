"""`pictura render` from outside."""

import pathlib
import signal
import subprocess
import unittest

from command_case import PICTURA, CommandCase

SCENES = pathlib.Path(__file__).resolve().parents[1] / "golden"


class Images(CommandCase):
    def test_image_hashes_do_not_depend_on_the_number_of_threads(self):
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

    def test_drawing_ends_soon_after_an_earlier_interrupt(self):
        out = self.folder / "images"
        arguments = ["render", str(self.town()), "--agents", "30", "--steps", "0", "--views", "30", "--size", "384x216", "--out", str(out)]
        with subprocess.Popen([PICTURA, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            self.assertIn("backend", process.stderr.readline())  # before a world is created
            process.send_signal(signal.SIGINT)
            self.assertIn("error: ", process.communicate()[1])
        self.assertEqual((process.returncode, out.exists()), (130, False))

    def test_earlier_pictures_are_removed_from_the_folder(self):
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

    def test_errors_name_the_line_of_bad_scene_files(self):
        text = (SCENES / "vehicles.toml").read_text().replace('rig = "rigs/front.toml"', "size_px = [8, 8]")
        bad = self.folder / "bad.toml"
        render = ["render", bad, "--backend", "cpu", "--out", self.folder / "images"]
        bad.write_text(text.replace("length_m = 4.4", "length_m = -1.0"))
        self.assert_refused(1, "bad.toml:22: agent 0: length_m: expected a number in [0.001, 1000], got -1", *render)
        bad.write_text(text)
        self.assert_refused(2, "--agents: has no effect on a scene file", *render, "--agents", 4)
        self.assert_refused(2, "colour", *render, "--planes", "colour")

    def test_errors_name_bad_arguments(self):
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


if __name__ == "__main__":
    unittest.main()
