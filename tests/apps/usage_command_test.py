"""Usage of the `pictura` command: help, typed commands, and files that it reads and writes."""

import json
import os
import pathlib
import re
import resource
import socket
import subprocess
import unittest.mock

from command_case import CONFIGS, PICTURA, CommandCase, has_torch, needs_ffmpeg, run


class Usage(CommandCase):
    def test_help_has_examples(self):
        for command in ["town", "map", "render", "simulate", "replay", "plot", "bench", *(["train", "evaluate", "probe"] if has_torch() else [])]:
            result = run(command, "--help")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(f"pictura {command}", result.stdout)

    def test_old_names_of_choices_are_accepted_with_a_warning(self):
        if not has_torch():
            self.skipTest("this build has no torch")
        for kind in ("removal", "pedestrian"):
            for control, warning in (("nobody", "warning: --control: 'nobody' is deprecated: use 'unchanged'\n"), ("unchanged", "")):
                result = run("probe", kind, self.folder / "no.ckpt", "--control", control, "--out", self.folder / "out")
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn("no.ckpt: no such file", result.stderr)
                self.assertTrue(result.stderr.startswith(warning or "error"), result.stderr)
        self.assert_refused(2, "expected one of none, unchanged, untrained; got 'nothing'", "probe", "pedestrian", "no.ckpt", "--control", "nothing")

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
    """Command lines as people type them: numbers, misspelt words, contradicting options."""

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

    def test_all_options_read_numbers_alike(self):
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

    def test_all_commands_limit_threads_to_1024(self):
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
            self.assert_refused(2, "pictura train: this build has no torch: pip install 'pictura[train]'", "train", "--config", "a.toml")

    def test_values_without_effect_are_refused(self):
        town = self.town(blocks="1x1")
        self.assert_refused(2, "--png: expected a value, got an empty text", "map", town, "--png", "")
        self.assert_refused(2, "--at: has no effect without --png or --svg", "map", town, "--at", 0, 0)
        self.assert_refused(2, "expected a name that ends in .png, got 'x.jpg'", "map", town, "--png", "x.jpg")
        self.assert_refused(2, "parking: given twice", "map", "procedural:1:parking=0,parking=1")
        self.assert_refused(2, "--renderer: has no effect with the policy 'random'", "simulate", town, "--renderer", "null")
        self.assert_refused(2, "--film-width: has no effect without --video", "simulate", town, "--film-width", 9)
        self.assert_refused(2, "expected at most 1 together", "simulate", town, "--pedestrians", 1, "--cyclists", 1)
        evaluate = ["evaluate", "--policy", "idle"]
        self.assert_refused(2, "--density: has no effect with --agents", *evaluate, "--agents", 2, "--density", "light")
        self.assert_refused(2, "--density: 'light' is given twice", *evaluate, "--density", "light,light")
        self.assert_refused(2, "--others: 'lane' is given twice", *evaluate, "--others", "lane=.2,lane=.2")
        self.assert_refused(2, "got 'lan'; did you mean 'lane'?", *evaluate, "--others", "lan=0.2")
        replay = [*evaluate, "--replay", self.folder / "a.html", "--follow"]
        self.assert_refused(2, "--follow: expected 0 to 11, got 12", *replay, 12, "--agents", 12)
        self.assert_refused(2, "--follow: expected 0 to 59, got 60", *replay, 60)
        self.assert_refused(1, "are too many for more than", "simulate", town, "--steps", 10**9, "--replay", self.folder / "a.html")

    def test_names_of_devices_are_checked(self):
        for device in ("foo", "cpu:0", "cuda:x", "cuda:-1"):
            for command in (["simulate", "procedural:1", "--policy", "no.ckpt"], ["evaluate", "no.ckpt"], ["probe", "corner", "no.ckpt"]):
                self.assert_refused(2, f"--device: expected one of cpu, cuda, cuda:N, auto; got '{device}'", *command, "--device", device)

    def test_channels_are_whole_numbers(self):
        export = ["export", "no.ckpt", "--out", self.folder / "a.safetensors", "--channels"]
        self.assert_refused(2, "--channels: expected a whole number of 1 to 4096, got '-1'", *export, "-1")

    def test_a_given_share_reduces_default_shares(self):
        facts = self.json_of("simulate", self.town(), "--agents", 6, "--steps", 1, "--pedestrians", 1)
        self.assertEqual((facts["vehicles"], facts["cyclists"]), (0, 0))

    def test_messages_are_one_line_for_any_name(self):
        self.assert_refused(2, "map 'a\\nb\\x1b': expected", "map", "a\nb\x1b")
        if has_torch():
            self.assert_refused(1, "no.toml: no such file", "train", "--config", "no.toml", "--out", self.folder / "run")


class Files(CommandCase):
    """Effects of output files on existing files, and errors for a full disk and a closed end."""

    def test_outputs_do_not_replace_devices_links_and_fifos(self):
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

    def test_output_to_descriptor_paths_continues_at_the_offset(self):
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
        reading, writing = socket.socketpair()  # a socket cannot be opened by name
        with reading, reading.makefile() as text:
            with writing:
                subprocess.run([*town, "/dev/stdout"], stdout=writing, check=True, timeout=60)
            self.assertTrue(text.read().startswith(expected))

    def test_an_incomplete_stdout_is_an_error(self):
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

    @needs_ffmpeg
    def test_output_files_do_not_reuse_closed_standard_descriptors(self):
        for closed in ([2], [0, 1, 2]):
            with self.subTest(closed=closed):
                video = self.folder / "film.mp4"
                arguments = ["simulate", "procedural:1", "--agents", 4, "--steps", 10, "--video", video, "--film-width", 60]
                result = subprocess.run([PICTURA, *map(str, arguments)], stdout=subprocess.DEVNULL,
                                        preexec_fn=lambda closed=closed: [os.close(descriptor) for descriptor in closed])  # fmt: skip
                self.assertEqual(result.returncode, 1 if 1 in closed else 0)
                self.assertEqual(video.read_bytes()[4:8], b"ftyp")

    def test_an_unwritable_stderr_does_not_affect_results(self):
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

    def test_a_closed_stdout_is_an_error_after_files_are_saved(self):
        reader, closed_pipe = os.pipe()
        os.close(reader)
        self.addCleanup(os.close, closed_pipe)
        for number, arguments in enumerate((["--seed", "3"], ["--seed", "3", "--json"])):
            town = self.folder / f"town{number}.xodr"
            result = subprocess.run([PICTURA, "town", "--blocks", "1x1", *arguments, "--out", str(town)],
                                    stdout=closed_pipe, stderr=subprocess.PIPE, text=True)  # fmt: skip
            self.assertEqual((result.returncode, town.exists()), (1, True), result.stderr)
            self.assertIn("error: stdout: cannot be written: Broken pipe", result.stderr)

    def test_two_options_cannot_write_one_file(self):
        town, page = self.town(blocks="1x1"), self.folder / "page"
        for first, second in [("--replay", "--mcap"), ("--policy", "--replay")]:
            with self.subTest(first=first, second=second):
                self.assert_refused(2, "expected a file different from that of --", "simulate", town, first, page, second, page)
        relative = [os.path.abspath(PICTURA), "simulate", town, "--replay", "page", "--mcap", "./page"]
        self.assertEqual(subprocess.run(relative, cwd=self.folder, stderr=subprocess.DEVNULL).returncode, 2)
        self.assertFalse(page.exists())
        self.json_of("simulate", town, "--agents", 2, "--steps", 2, "--replay", "/dev/null", "--mcap", "/dev/null")

    def test_outputs_do_not_replace_inputs(self):
        town, scene = self.town(blocks="1x1"), self.folder / "a.scenario"
        expected = "expected a file different from that of "
        simulate = ["simulate", town, "--agents", 2, "--steps", 2]
        self.json_of(*simulate, "--scene", scene)
        before = scene.read_bytes()
        self.assert_refused(2, f"--xodr: {expected}MAP", "map", town, "--xodr", town)
        self.assert_refused(2, f"--scene: {expected}MAP", "simulate", scene, "--scene", scene)
        self.assert_refused(2, f"--scene: {expected}MAP", "simulate", f"{scene}#0", "--scene", scene)
        womd = ["evaluate", "--policy", "idm", "--protocol", "womd", "--scenes", scene]
        self.assert_refused(2, f"--out: {expected}--scenes", *womd, "--out", scene)
        self.assert_refused(2, f"--rollouts: {expected}--scenes", *womd, "--rollouts", scene)
        self.assert_refused(2, f"--out: {expected}--merge", "evaluate", "--merge", "a.json", "b.json", "--out", "a.json")
        self.assert_refused(2, f"--out: {expected}--map", "evaluate", "--policy", "idle", "--map", f"procedural:1,{town}", "--out", town)
        self.assert_refused(2, f"--out: {expected}--others", "evaluate", "--policy", "idle", "--others", "a.ckpt=0.2", "--out", "a.ckpt")
        self.assertEqual(scene.read_bytes(), before)
        self.assertTrue(town.read_text().startswith("<?xml"))

    def test_outputs_are_checked_before_the_run(self):
        simulate = ["simulate", "procedural:1:blocks=1x1", "--agents", 2, "--steps", 2]
        evaluate = ["evaluate", "--policy", "idle", "--map", "procedural:1:blocks=1x1", "--agents", 2, "--steps", 2, "--scenarios", 1]
        for command, option, path in [
            (simulate, "--replay", "/nodir/x.html"),
            (simulate, "--mcap", "/nodir/x.mcap"),
            (evaluate, "--out", "/nodir/x.json"),
            (evaluate, "--out", self.folder),
            (evaluate, "--replay", "/nodir/x.html"),
        ]:
            with self.subTest(option=option, path=path):
                result = run(*command, option, path)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertRegex(result.stderr, f"^error: {path}: cannot be written: .*\n$")  # nothing before it
        self.assert_refused(2, "--scene: expected a name that ends in .scenario, got 'x'", *simulate, "--scene", "x")

    def test_a_report_is_printed_and_other_files_are_written_if_a_file_fails(self):
        for command, full, other in [
            (["simulate", "procedural:1:blocks=1x1", "--agents", 2, "--steps", 2], "--replay", "--mcap"),
            (["replay", "procedural:1:blocks=1x1", "--agents", 2, "--steps", 2], "--out", "--mcap"),
            (["evaluate", "--policy", "idle", "--map", "procedural:1:blocks=1x1", "--agents", 2, "--steps", 2, "--scenarios", 1], "--infractions", "--out"),
        ]:
            with self.subTest(command[0]):
                path = self.folder / f"{command[0]}.mcap"
                result = run(*command, "--json", full, "/dev/full", other, path)
                self.assertEqual((result.returncode, path.exists()), (1, True), result.stderr)
                self.assertIn("error: /dev/full: cannot be written: No space left on device", result.stderr)
                self.assertTrue(json.loads(result.stdout))

    @needs_ffmpeg
    def test_a_film_that_fails_does_not_end_the_simulation(self):
        # An ffmpeg that ends at once, as on a full disk.
        (self.folder / "ffmpeg").write_text("#!/bin/sh\necho full >&2; exit 1\n")
        (self.folder / "ffmpeg").chmod(0o755)
        result = run("simulate", "procedural:1:blocks=1x1", "--agents", 2, "--steps", 3, "--json", "--video", self.folder / "a.mp4",
                     PATH=f"{self.folder}:{os.environ['PATH']}")  # fmt: skip
        self.assertEqual((result.returncode, json.loads(result.stdout)["steps"]), (1, 3), result.stderr)
        self.assertIn("a.mp4: ffmpeg ended with status 1: full", result.stderr)

    def test_json_is_not_mixed_with_a_file_on_stdout(self):
        town = ["town", "--blocks", "1x1", "--out", "/dev/stdout"]
        self.assert_refused(2, "--out: expected a file other than stdout, where --json prints", *town, "--json")
        self.assertEqual(run(*town).returncode, 0)

    def test_failed_starts_leave_no_folders(self):
        for arguments in [
            ("render", "procedural:1", "--agents", 2, "--views", 3, "--out", self.folder / "new/images"),
            ("replay", "procedural:1", "--steps", 10**6, "--gallery", self.folder / "new/gallery"),
            ("evaluate", "no.ckpt", "--replays", 1, "--gallery", self.folder / "new/gallery"),
            ("probe", "corner", "no.ckpt", "--out", self.folder / "new/probe"),
            *([("train", "--config", CONFIGS / "smoke.toml", "--out", self.folder / "new/run", more, value) for more, value in
              (("--resume", "--json"), ("--init-from", "no.ckpt"))] if has_torch() else []),
        ]:  # fmt: skip
            with self.subTest(arguments[0]):
                self.assertIn(run(*arguments).returncode, (1, 2))
                self.assertFalse((self.folder / "new").exists())

    def test_the_contact_sheet_of_many_views_has_pages(self):
        out = self.folder / "images"
        facts = self.json_of("render", self.town(), "--agents", 80, "--steps", 0, "--views", 80, "--backend", "null",
                             "--size", "96x54", "--out", out)  # fmt: skip
        self.assertEqual([pathlib.Path(path).name for path in facts["contact_sheets"]],
                         ["contact_sheet.png", "contact_sheet_2.png", "contact_sheet_3.png"])  # fmt: skip
        # A row is as high as a page, and no higher for narrower images.
        facts = self.json_of("render", self.town(), "--agents", 2, "--steps", 0, "--views", 1, "--backend", "null",
                             "--size", "8x1000", "--out", out)  # fmt: skip
        self.assertEqual(len(facts["contact_sheets"]), 1)


if __name__ == "__main__":
    unittest.main()
