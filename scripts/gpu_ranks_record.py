"""Executes the steps of scripts/gpu_ranks after the command is built. `scripts/gpu_ranks --help` describes the steps.

Usage: gpu_ranks_record.py --pictura FILE --results FILE [OPTIONS] -- [ARGUMENTS of pictura train...]
"""

import argparse
import csv
import json
import math
import os
import pathlib
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time

SMALL = ["--set", "simulator.num_slots=2048", "--set", "train.num_steps=32", "--set", "train.minibatch_size=16384",
         "--set", "train.schedule=constant"]  # fmt: skip
STEPS = ["equal", "updates", "killed", "rate"]
MINIBATCH_OF_AN_AGENT = 0.8  # transitions per agent: minibatches of 16,384 with 20,480 agents
WARM_UP_UPDATES = 3  # the first updates compile kernels and select algorithms
CHUNK = 4096
GRADIENT_TOLERANCE = 1e-4  # share of each parameter's largest gradient
END_S = 60  # time limit for ranks to end after one was killed


class Ranks:
    """`size` processes of `pictura train`, each on its own GPU."""

    def __init__(self, pictura, size, out, *arguments):
        self.size, self.out = size, pathlib.Path(out)
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
        place = {"WORLD_SIZE": str(size), "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
        command = [pictura, "train", *arguments, "--out", str(out), "--json"]
        self.processes = [
            subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                env={**os.environ, **place, "RANK": str(rank), "LOCAL_RANK": str(rank)},
            )
            for rank in range(size)
        ]  # fmt: skip

    def progress(self):
        """Returns the complete rows of the run's progress.csv so far."""
        file = self.out / "progress.csv"
        if not file.exists():
            return []
        with file.open(newline="") as rows:
            return [row for row in csv.DictReader(rows) if None not in row.values()]

    def report(self):
        """Waits for all ranks and returns rank 0's report. If a rank failed, exits with its output."""
        results = [process.communicate() for process in self.processes]
        for rank, process in enumerate(self.processes):
            if process.returncode != 0:
                raise SystemExit(f"error: gpu_ranks: rank {rank} of {self.size}: {results[rank][1][-2000:]}")
        return json.loads(results[0][0])


def checkpoint_parts(path):
    """Returns a checkpoint's first moments by parameter, and the bytes of its simulator state."""
    content = pathlib.Path(path).read_bytes()
    header_size = struct.unpack_from("<Q", content, 16)[0]
    header, data = json.loads(content[24 : 24 + header_size]), content[24 + header_size :]
    moments = {
        entry["name"]: struct.unpack_from(f"<{math.prod(entry['shape'])}f", data, entry["offset"])
        for entry in header["first_moments"]
    }
    simulator = header["simulator"]
    return moments, data[simulator["offset"] : simulator["offset"] + simulator["bytes"]]


def largest_relative_difference(one, other):
    """Returns the largest difference between two checkpoints, relative to each parameter's largest value, and the name
    of that parameter."""
    differences = {
        name: max(abs(a - b) for a, b in zip(values, other[name])) / max(1e-30, *map(abs, values))
        for name, values in one.items()
    }
    name = max(differences, key=differences.get)
    return name, differences[name]


def told(report, *more):
    return {key: report[key] for key in ("updates", "agent_steps", "agent_steps_per_s", "policy_hash", *more)}


class Steps:
    """Steps of the script. Each method executes a step, and returns its record and whether it succeeded."""

    def __init__(self, options, folder):
        self.options, self.folder, self.ranks = options, folder, max(options.ranks)

    def start(self, size, name, *more):
        if self.options.init_from and "--resume" not in more:
            more = ["--init-from", self.options.init_from, *more]
        arguments = ["--config", self.options.config, *more, *self.options.arguments]
        return Ranks(self.options.pictura, size, self.folder / name, *arguments)

    def equal(self):
        # After one optimizer step, first moments are a constant multiple of the clipped gradients.
        more = [*SMALL, "--set", "train.updates=1", "--set", "train.reproducible=true", "--set", "train.precision=fp32",
                "--set", "train.update_epochs=1", "--set", "train.minibatch_size=65536"]  # fmt: skip
        cases = {"one": (1, CHUNK), "many": (self.ranks, CHUNK), "half": (1, CHUNK // 2)}
        parts = {}
        for name, (size, chunk) in cases.items():
            report = self.start(size, f"equal_{name}", *more, "--set", f"train.forward_chunk={chunk}").report()
            parts[name] = checkpoint_parts(self.folder / f"equal_{name}/checkpoint.ckpt")
        (one, one_simulator), (many, many_simulator), (half, _) = parts.values()
        is_equal = one_simulator == many_simulator
        name, difference = largest_relative_difference(one, many)
        rounding = largest_relative_difference(one, half)[1]
        return {
            "device": report["device"],
            "simulator_bytes": len(one_simulator),
            "simulator_equal": is_equal,
            "gradient_parameters": len(one),
            "gradient_largest_difference": difference,
            "gradient_largest_difference_in": name,
            "gradient_largest_difference_of_half_the_chunk": rounding,
        }, is_equal and difference <= max(GRADIENT_TOLERANCE, 2 * rounding)

    def updates(self):
        more = [*SMALL, "--set", "train.updates=50"]
        reports = {size: self.start(size, f"updates{size}", *more).report() for size in (1, self.ranks)}
        return {size: told(report, "episode_return") for size, report in reports.items()}, True

    def killed(self):
        run = [*SMALL, "--set", "train.checkpoint_every=2"]
        ranks = self.start(self.ranks, "killed", *run, "--set", "train.updates=100000")
        while len(ranks.progress()) < 5:
            if any(process.poll() is not None for process in ranks.processes):
                ranks.report()
            time.sleep(0.1)
        victim = self.ranks - 1
        killed_at = time.monotonic()
        ranks.processes[victim].send_signal(signal.SIGKILL)
        others = []
        for rank, process in enumerate(ranks.processes):
            if rank == victim:
                continue
            try:
                said = process.communicate(timeout=2 * END_S)[1]
            except subprocess.TimeoutExpired:
                process.kill()
                said = process.communicate()[1]
            errors = [line for line in said.replace("\r", "\n").splitlines() if "error" in line]
            others.append({"rank": rank, "seconds": round(time.monotonic() - killed_at, 1), "status": process.returncode,
                           "error": errors[-1] if errors else ""})  # fmt: skip
        ranks.processes[victim].communicate()
        result = {"killed_rank": victim, "others": others, "updates_done": len(ranks.progress())}
        # The checkpoint lacks at most the last checkpoint_every updates.
        resumed = []
        for size in (1, *self.options.ranks):
            done = 2 + max([int(report["updates"]) for _, report in resumed], default=result["updates_done"])
            report = self.start(size, "killed", *run, "--set", f"train.updates={done}", "--resume").report()
            resumed.append((size, report))
        result["resumed"] = [{"ranks": size, **told(report)} for size, report in resumed]
        is_named = all(o["status"] not in (0, -9) and o["seconds"] <= END_S and f"rank {victim}" in o["error"] for o in others)
        return result, is_named

    def rate(self):
        agents = self.options.agents
        cases = [("one", 1, agents)]
        for ranks in self.options.ranks:
            cases += [("each", ranks, ranks * agents), ("in_all", ranks, agents)]
        result = {}
        for size in self.options.sizes.split(","):
            width, height = size.split("x")
            rows = []
            for name, processes, slots in cases:
                settings = {
                    "render.width_px": width, "render.height_px": height, "simulator.num_slots": slots,
                    "train.num_steps": 32, "train.minibatch_size": round(slots * MINIBATCH_OF_AN_AGENT),
                    "train.updates": self.options.updates, "train.schedule": "constant", "train.checkpoint_every": 100000, "train.checkpoint_minutes": 1000,
                }  # fmt: skip
                more = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
                run = self.start(processes, f"rate_{name}_{processes}_{size}", *more)
                run.report()
                row = {"case": name, "gpus": processes, "agents": slots, **self.rates(run.progress())}
                one = (rows or [row])[0]
                row["over_one"] = row["agent_steps_per_s"]["median"] / one["agent_steps_per_s"]["median"]
                row["efficiency"] = row["over_one"] / processes
                rows.append(row)
                print(f"{size}: {json.dumps(row)}", flush=True)
            result[size] = rows
        return result, True

    @staticmethod
    def rates(rows):
        """Returns statistics of whole updates after the warm-up: agent-steps/s, the share of transitions that the
        advantage filter keeps, and seconds by phase."""

        def summary(values):
            return {"median": statistics.median(values), "min": min(values), "max": max(values)}

        updates = rows[WARM_UP_UPDATES:]
        seconds = [float(row["time/rollout_s"]) + float(row["time/update_s"]) for row in updates]
        done = [float(row["charts/agent_steps"]) for row in rows]
        steps = [after - before for before, after in zip(done, done[1:])][WARM_UP_UPDATES - 1 :]
        phases = [key for key in updates[0] if key.startswith("time/") and key.endswith("_s")]
        return {
            "agent_steps_per_s": summary([n / s for n, s in zip(steps, seconds)]),
            "kept": statistics.median(float(row["losses/kept_fraction"]) for row in updates),
            **{key: statistics.median(float(row[key]) for row in updates) for key in phases},
        }


def main():
    parser = argparse.ArgumentParser(prog="gpu_ranks")
    parser.add_argument("--pictura", required=True)
    parser.add_argument("--results", required=True, type=pathlib.Path)
    parser.add_argument("--commit", default="")
    parser.add_argument("--config", default="configs/paper.toml")
    parser.add_argument("--init-from", default="")
    parser.add_argument("--ranks", type=lambda text: [int(number) for number in text.split(",")], default=[2])
    parser.add_argument("--steps", default=",".join(STEPS))
    parser.add_argument("--sizes", default="32x18,96x54")
    parser.add_argument("--agents", type=int, default=20480)
    parser.add_argument("--updates", type=int, default=9)
    parser.add_argument("arguments", nargs="*")
    options = parser.parse_args()
    for step in options.steps.split(","):
        if step not in STEPS:
            parser.error(f"--steps: expected {', '.join(STEPS)}, got '{step}'")
    if options.updates <= WARM_UP_UPDATES:
        parser.error(f"--updates: expected more than {WARM_UP_UPDATES}, got {options.updates}")

    keys = ("commit", "config", "init_from", "arguments", "ranks")
    results = {key: getattr(options, key) for key in keys}
    if options.results.exists():
        earlier = json.loads(options.results.read_text())
        if all(earlier.get(key) == value for key, value in results.items()):
            results = earlier
    is_good = True
    with tempfile.TemporaryDirectory(prefix="pictura-ranks-") as folder:
        steps = Steps(options, pathlib.Path(folder))
        for step in options.steps.split(","):
            results[step], was_good = getattr(steps, step)()
            is_good = is_good and was_good
            options.results.write_text(json.dumps(results, indent=2) + "\n")
            print(f"{step}: {json.dumps(results[step])}", flush=True)
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
