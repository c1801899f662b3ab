"""What scripts/gpu_ranks does once the command is built.

Usage: gpu_ranks_record.py PICTURA RESULTS RANKS MINUTES COMMIT [ARGUMENTS of pictura train...]
"""

import json
import math
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile

SMALL = ["--set", "simulator.num_slots=2048", "--set", "train.num_steps=32", "--set", "train.minibatch_size=16384",
         "--set", "train.schedule=constant"]  # fmt: skip


def train(pictura, size, out, *arguments):
    """Trains on `size` GPUs of this machine; the report of rank 0. Throws where a rank fails, with what it said."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    place = {"WORLD_SIZE": str(size), "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
    command = [pictura, "train", "--config", "configs/paper.toml", *arguments, "--out", str(out), "--json"]
    processes = [
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, **place, "RANK": str(rank), "LOCAL_RANK": str(rank)},
        )
        for rank in range(size)
    ]  # fmt: skip
    results = [process.communicate() for process in processes]
    for rank, process in enumerate(processes):
        if process.returncode != 0:
            raise SystemExit(f"error: gpu_ranks: rank {rank} of {size}: {results[rank][1][-2000:]}")
    return json.loads(results[0][0])


def checkpoint_parts(path):
    """The parameters of a checkpoint, one after the other, and the bytes of its simulator."""
    content = pathlib.Path(path).read_bytes()
    header_size = struct.unpack_from("<Q", content, 16)[0]
    header, data = json.loads(content[24 : 24 + header_size]), content[24 + header_size :]
    parameters = []
    for entry in header["parameters"]:
        parameters += struct.unpack_from(f"<{math.prod(entry['shape'])}f", data, entry["offset"])
    simulator = header["simulator"]
    return parameters, data[simulator["offset"] : simulator["offset"] + simulator["bytes"]]


def main():
    pictura, results_path, ranks, minutes, commit, *arguments = sys.argv[1:]
    sizes = [1, int(ranks)]
    results = {"complete": False, "commit": commit, "arguments": arguments, "ranks": sizes[1]}

    def record(name, value):
        results[name] = value
        pathlib.Path(results_path).write_text(json.dumps(results, indent=2) + "\n")
        print(f"{name}: {json.dumps(value)}", flush=True)

    with tempfile.TemporaryDirectory(prefix="pictura-ranks-") as folder:
        folder = pathlib.Path(folder)

        def runs(name, *more):
            return {size: train(pictura, size, folder / f"{name}{size}", *arguments, *more) for size in sizes}

        equal = runs("equal", *SMALL, "--set", "train.updates=1", "--set", "train.reproducible=true")
        record("device", equal[1]["device"])
        (one, one_simulator), (many, many_simulator) = (
            checkpoint_parts(folder / f"equal{size}/checkpoint.ckpt") for size in sizes
        )
        is_equal = one_simulator == many_simulator
        record("equal", {
            "simulator_bytes": len(one_simulator),
            "simulator_equal": is_equal,
            "largest_parameter": max(map(abs, one)),
            "largest_difference_of_parameters": max(abs(a - b) for a, b in zip(one, many)),
        })  # fmt: skip
        keys = ("updates", "agent_steps", "agent_steps_per_s", "episode_return", "policy_hash")
        updates = runs("updates", *SMALL, "--set", "train.updates=50")
        record("updates", {size: {key: report[key] for key in keys} for size, report in updates.items()})
        rate = runs("rate", "--minutes", minutes)
        record("rate", {size: {key: report[key] for key in keys} for size, report in rate.items()})
        record("speedup", rate[sizes[1]]["agent_steps_per_s"] / rate[1]["agent_steps_per_s"])
    record("complete", True)
    return 0 if is_equal else 1


if __name__ == "__main__":
    sys.exit(main())
