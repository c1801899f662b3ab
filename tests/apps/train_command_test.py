"""`pictura train` from outside."""

import csv
import fcntl
import json
import os
import pathlib
import pty
import signal
import struct
import subprocess
import termios
import time
import unittest

from command_case import PICTURA, TINY, CommandCase, run


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
        self.assertRegex(lines[-1], r"ETA .* agent-steps .*/s .* m/s .* goals/km .* km/infraction")
        self.assertNotIn("\r", "".join(lines))
        child, terminal = pty.fork()
        if child == 0:
            # The terminal has 50 columns.
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
        self.assertRegex(last, r"^update 4/4  .* km/infraction\r\n.* agent-steps in 4 updates.*\r\ntime of the last update: simulate \d+ %, ")

    def test_resume_is_exact(self):
        whole = self.json_of("train", *TINY, "--set", "train.updates=4", "--out", self.folder / "whole")
        self.json_of("train", *TINY, "--set", "train.updates=2", "--out", self.folder / "parts")
        parts = self.json_of("train", *TINY, "--set", "train.updates=4", "--out", self.folder / "parts", "--resume")
        for key in ("policy_hash", "updates", "agent_steps"):
            self.assertEqual(whole[key], parts[key], key)
        for name in ("checkpoint.ckpt", "untrained.ckpt", "policy.safetensors", "progress.csv"):
            self.assertTrue((self.folder / "whole" / name).exists(), name)
        # A finished run has no further updates, so resuming it adds no file.
        files = sorted((self.folder / "whole").iterdir())
        self.json_of("train", *TINY, "--set", "train.updates=4", "--out", self.folder / "whole", "--resume")
        self.assertEqual(sorted((self.folder / "whole").iterdir()), files)

    def test_an_existing_run_requires_resume_or_overwrite(self):
        one = ["train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run"]
        first = self.json_of(*one)
        self.assert_refused(1, f"{self.folder}/run: already holds a run (checkpoint.ckpt, ", *one)
        self.assert_refused(1, "(--resume, --overwrite)", *one)
        self.assert_refused(2, "excludes", *one, "--overwrite", "--resume")
        self.assertEqual(self.json_of(*one, "--overwrite")["policy_hash"], first["policy_hash"])

    def test_errors_name_bad_input(self):
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
        self.assert_refused(2, "--device: expected one of cpu, cuda, cuda:N, auto; got 'gpu'", *one, *out, "--device", "gpu")
        on_host = 'render.backend: "null" uses host memory, but run.device is "cuda"'
        self.assert_refused(1, on_host, *one, *out, "--renderer", "null", "--device", "cuda")
        if not pathlib.Path("/dev/nvidia0").exists():
            self.assert_refused(1, "run.device: cuda: ", *one, *out, "--device", "cuda")
        self.assert_refused(1, "only gl supports samples", *one, *out, "--renderer", "cpu", "--samples", "4x4")
        self.assert_refused(1, "render.backend: expected one of cpu, ", *one, *out, "--set", "render.backend=vulkan")
        evaluate = ["evaluate", self.folder / "black" / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 2,
                    "--scenarios", 1, "--steps", 2]  # fmt: skip
        self.json_of(*evaluate, "--renderer", "cpu", "--simulator", "cpu", "--device", "cpu")
        self.assert_refused(1, on_host, *evaluate, "--device", "cuda")

    def test_training_prints_its_device(self):
        if os.environ.get("PICTURA_REQUIRE_GPU") != "1":
            self.skipTest("PICTURA_REQUIRE_GPU is not 1")
        out = self.folder / "run"
        report = self.json_of("train", *TINY, "--set", "train.updates=1", "--device", "cuda", "--out", out)
        self.assertEqual((report["simulator"], report["renderer"], report["device"]), ("cuda", "cuda", "cuda:0"))
        rows = self.json_of("evaluate", out / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 8, "--scenarios", 2,
                            "--steps", 40, "--device", "cuda")["rows"]  # fmt: skip
        self.assertGreater(rows[0]["km_driven"], 0)

    def test_a_run_ended_by_its_time_limit_can_be_resumed(self):
        train = ["train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run"]
        self.assert_refused(2, "--minutes", *train, "--minutes", 0)
        stopped = self.json_of(*train, "--minutes", 1e-9)
        self.assertEqual((stopped["out_of_time"], stopped["updates"], stopped["episode_return"]), (True, 0, None))
        resumed = self.json_of(*train, "--resume", "--minutes", 60)
        self.assertEqual((resumed["out_of_time"], resumed["updates"]), (False, 1))


class Signals(CommandCase):
    """Signals that end training and other commands."""

    def test_an_interrupted_run_can_be_resumed(self):
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
        """Starts a command and waits until it has written a file."""
        command = [PICTURA, *map(str, arguments)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
        self.addCleanup(process.kill)
        self.wait_for(until.exists)
        return process

    def wait_for(self, is_there):
        deadline = time.monotonic() + 120
        while not is_there() and time.monotonic() < deadline:
            time.sleep(0.02)

    def test_each_signal_saves_the_run_and_exits_with_its_status(self):
        for name, status in [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)]:
            with self.subTest(name):
                out = self.folder / name
                process = self.start(*self.LONG, "--out", out, until=out / "untrained.ckpt")
                process.send_signal(getattr(signal, name))
                _, errors = process.communicate(timeout=120)
                self.assertEqual(process.returncode, status, errors)
                self.assertEqual(errors.splitlines()[-1], f"error: interrupted; continue with --resume --out {out}")
                for file in ("checkpoint.ckpt", "policy.safetensors"):
                    self.assertTrue((out / file).exists(), file)
                result = run(*self.LONG, "--out", out, "--resume", "--minutes", 0.0001, "--json")
                self.assertEqual(json.loads(result.stdout)["updates"], 0, result.stderr)

    def test_other_commands_exit_with_the_statuses_of_signals(self):
        for name, status in [("SIGTERM", 143), ("SIGHUP", 129)]:
            process = subprocess.Popen([PICTURA, "simulate", "procedural:1", "--agents", "8", "--steps", "10000000"],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
            self.addCleanup(process.kill)
            time.sleep(2)
            process.send_signal(getattr(signal, name))
            _, errors = process.communicate(timeout=120)
            self.assertEqual((process.returncode, "error: interrupted at step" in errors), (status, True), errors)

    def test_a_second_signal_ends_a_run_at_once_except_a_duplicate(self):
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

    def test_a_run_is_complete_without_a_writable_stderr(self):
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

    def test_a_run_is_saved_when_its_terminal_hangs_up(self):
        out = self.folder / "run"
        child, terminal = pty.fork()
        if child == 0:
            os.execv(PICTURA, [PICTURA, *self.LONG, "--out", str(out)])
        self.wait_for((out / "untrained.ckpt").exists)
        os.close(terminal)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 129)
        self.assertTrue((out / "policy.safetensors").exists())

    def test_nohup_ignores_a_hang_up(self):
        out = self.folder / "run"
        process = self.start(*self.LONG, "--out", out, until=out / "untrained.ckpt",
                             preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))  # fmt: skip
        process.send_signal(signal.SIGHUP)
        time.sleep(0.5)
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=120)
        self.assertEqual(process.returncode, 143)


if __name__ == "__main__":
    unittest.main()
