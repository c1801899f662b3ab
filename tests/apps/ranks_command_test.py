"""`pictura train` in several processes."""

import concurrent.futures
import json
import math
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import time
import unittest

from command_case import CONFIGS, PICTURA, TINY, CommandCase, run


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def checkpoint_parts(path):
    """Returns the tensors of a checkpoint's policy by name, as tuples of floats, and the bytes of its simulator."""
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

    # Five worlds, two of the first rank and three of the second; the whole minibatch is one step along the gradient.
    SETTINGS = ["train", *TINY, "--set", "simulator.num_slots=15", "--set", "run.num_threads=1"]
    GRADIENTS = ["--set", "train.adam_eps=1", "--set", "train.schedule=constant", "--set", "train.learning_rate=0.1"]

    def start(self, size, *arguments, port=None, of_rank=lambda rank: []):
        """Starts one process per rank; of_rank returns further arguments for each."""
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
        """Returns status, stdout and stderr of each process."""
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
        """Compares checkpoints after one update from one state: the simulator's bytes exactly, the parameters up to
        rounding."""
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

    def test_two_ranks_train_as_one_does(self):
        self.assert_two_train_as_one()

    def test_two_ranks_with_held_actions_train_as_one_does(self):
        self.assert_two_train_as_one("--set", "policy.decision_steps=2")

    def test_two_ranks_with_opponents_train_as_one_does(self):
        opponent = CONFIGS.parent / "models/vector.safetensors"
        steps = ["--set", "train.num_steps=9"]  # a multiple of the opponent's decision steps
        self.assert_two_train_as_one(*steps, "--set", f'simulator.others.policies=["{opponent}=0.3"]')

    def assert_two_train_as_one(self, *settings):
        one = ["--set", "train.updates=1", *self.GRADIENTS, "--set", "train.adv_filter_threshold=0.2", *settings]
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

    def test_any_number_of_ranks_resumes_from_a_checkpoint(self):
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

    def test_ranks_resume_exactly_in_sets_of_recorded_scenes(self):
        scenes = self.folder / "scenes"
        scenes.mkdir()
        for number in (1, 2, 3):
            self.json_of("simulate", f"procedural:{number}", "--policy", "lane", "--agents", "6", "--steps", "91",
                         "--scene", scenes / f"{number}.scenario")  # fmt: skip
        # Two worlds, which show other scenes at every update.
        settings = [
            *self.SETTINGS, "--set", f'simulator.maps=["scenes:{scenes}"]', "--set", "simulator.num_slots=12",
            "--set", "simulator.max_agents=6", "--set", "simulator.scenes.updates_per_set=1", "--set", "policy.modality=vector",
        ]  # fmt: skip
        updates = lambda n: ["--set", f"train.updates={n}", "--set", "train.schedule=constant"]
        whole = self.train(2, *settings, *updates(4), "--out", self.folder / "whole")
        self.train(2, *settings, *updates(2), "--out", self.folder / "parts")
        parts = self.train(2, *settings, *updates(4), "--out", self.folder / "parts", "--resume")
        self.assertEqual((whole["updates"], parts["updates"], parts["ranks"]), (4, 4, 2))
        self.assertEqual(parts["policy_hash"], whole["policy_hash"])
        self.assertEqual(*(checkpoint_parts(self.folder / run / "checkpoint.ckpt") for run in ("parts", "whole")))
        one_set = self.train(2, *settings, "--set", "simulator.scenes.updates_per_set=4", *updates(4), "--out", self.folder / "set")
        self.assertNotEqual(one_set["policy_hash"], whole["policy_hash"])

    def long_run(self, out):
        """Starts two ranks that save a checkpoint and then run for long."""
        processes = self.start(
            2, *self.SETTINGS, "--set", "train.updates=1000000", "--set", "train.checkpoint_every=1", "--out", out
        )
        deadline = time.monotonic() + 120
        while not (out / "checkpoint.ckpt").exists():
            self.assertLess(time.monotonic(), deadline)
            self.assertEqual([process.poll() for process in processes], [None, None])
            time.sleep(0.05)
        return processes

    def test_a_killed_or_stopped_rank_is_named_and_ends_the_others(self):
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
            # The last checkpoint is complete, and one process resumes from it.
            updates = int((out / "progress.csv").read_text().splitlines()[-1].split(",")[0])
            report = self.json_of(*self.SETTINGS, "--set", f"train.updates={updates + 2}", "--out", out, "--resume")
            self.assertEqual(report["updates"], updates + 2)

        # Concurrently, since half a minute passes until a stopped rank is noticed.
        cases = [(victim, how) for victim in (0, 1) for how in (signal.SIGKILL, signal.SIGSTOP)]
        with concurrent.futures.ThreadPoolExecutor() as pool:
            for case in [pool.submit(end, *each) for each in cases]:
                case.result()

    def test_a_signal_to_one_rank_ends_both_after_the_same_update(self):
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

    def test_errors_name_keys_that_differ_between_ranks(self):
        other = lambda rank: ["--set", f"train.learning_rate={0.001 * (rank + 1)}"]
        for status, _, err in self.finish(self.start(2, *self.SETTINGS, "--out", self.folder / "run", of_rank=other)):
            self.assertEqual(status, 1)
            self.assertIn("ranks 0 and 1 have different settings: train.learning_rate: 0.001 and 0.002", err)
        self.assertFalse((self.folder / "run").exists())
        for status, _, err in self.finish(
            self.start(2, *self.SETTINGS, "--out", self.folder / "run", of_rank=lambda rank: ["--resume"][:rank])
        ):
            self.assertEqual(status, 1)
            self.assertIn("ranks 0 and 1 have different settings: old_run", err)

    def test_errors_name_bad_input(self):
        with socket.create_server(("0.0.0.0", 0)) as server:
            port = server.getsockname()[1]
            first = self.start(2, *self.SETTINGS, "--out", self.folder / "run", port=port)
            status, _, err = self.finish(first[:1])[0]
            first[1].kill()
            first[1].communicate()
            self.assertEqual(status, 1)
            self.assertRegex(err, f"rank 0: cannot listen at 127.0.0.1:{port} .*MASTER_PORT.*in use")
        # An error found by one rank is every rank's error.
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
        self.assertIn("RANK is set but WORLD_SIZE is not", result.stderr)


if __name__ == "__main__":
    unittest.main()
