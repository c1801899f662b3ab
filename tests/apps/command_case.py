"""Common parts of tests of the `pictura` command. A program of tests is run by ctest, one entry per class:

    python3 X_command_test.py PICTURA [unittest arguments]
"""

import atexit
import functools
import json
import os
import pathlib
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

# Path of the command.
PICTURA = os.path.abspath(sys.argv.pop(1))
needs_ffmpeg = unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg on this machine")
CONFIGS = pathlib.Path(__file__).resolve().parents[2] / "configs"
# A policy and a world small enough for an update in well under a second. On the host, whose runs are exact.
TINY = [
    "--config", str(CONFIGS / "smoke.toml"),
    "--set", "simulator.num_slots=6", "--set", "simulator.min_agents=3", "--set", "simulator.max_agents=3",
    "--set", "train.num_steps=8", "--set", "train.minibatch_size=48", "--set", "train.schedule_agent_steps=1000000",
    "--set", "render.width_px=16", "--set", "render.height_px=9", "--set", "run.num_threads=2",
    "--set", "run.device=cpu",
]  # fmt: skip


class CommandServer:
    """Process whose children are calls of the command, since most of a start is the loading of libraries
    (command_server.cpp)."""

    def __init__(self, program):
        self.socket, stdin = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.process = subprocess.Popen([program], stdin=stdin)
        stdin.close()
        atexit.register(self.close)

    def close(self):
        self.socket.close()
        self.process.wait()

    def run(self, words, cwd, environment, timeout):
        """Runs the command like subprocess.run(), with its outputs captured as text."""
        variables = [f"{name}={value}" for name, value in environment.items()]
        texts = [os.path.abspath(cwd or "."), str(len(variables)), *variables, str(len(words)), *words]
        packet = b"".join(os.fsencode(text) + b"\0" for text in texts)
        answers, answer = os.pipe()
        with tempfile.TemporaryFile("w+") as stdout, tempfile.TemporaryFile("w+") as stderr, open(answers, "rb", buffering=0) as answers:
            try:
                socket.send_fds(self.socket, [packet], [0, stdout.fileno(), stderr.fileno(), answer])
            finally:
                os.close(answer)
            (child,) = struct.unpack("i", answers.read(4))
            if not select.select([answers], [], [], timeout)[0]:
                os.kill(child, signal.SIGKILL)
                raise subprocess.TimeoutExpired(words, timeout)
            (status,) = struct.unpack("i", answers.read(4))
            stdout.seek(0)
            stderr.seek(0)
            return subprocess.CompletedProcess(words, os.waitstatus_to_exitcode(status), stdout.read(), stderr.read())


@functools.cache
def server():
    """Returns the server; None if the build has none."""
    program = os.environ.get("PICTURA_COMMAND_SERVER")
    return CommandServer(program) if program else None


def run(*arguments, timeout=300, cwd=None, started=False, **variables):
    """Runs the command. started: as a separate program, with its own command line. Skips the test if it would draw a
    chart and the machine has no Matplotlib."""
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}}
    words = [PICTURA, *map(str, arguments)]
    if server() and not started:
        result = server().run(words, cwd, environment, timeout)
    else:
        result = subprocess.run(words, capture_output=True, text=True, timeout=timeout, env=environment, cwd=cwd)
    if "has no Matplotlib" in result.stderr and "PICTURA_PYTHON" not in variables:
        raise unittest.SkipTest("no Matplotlib on this machine")
    return result


def has_torch():
    """Whether this build can train: commands that need torch are missing from builds without it."""
    return re.search("^  train ", run("--help").stdout, re.MULTILINE) is not None


class CommandCase(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.folder = pathlib.Path(self._folder.name)

    def tearDown(self):
        self._folder.cleanup()

    def json_of(self, *arguments, **options):
        result = run(*arguments, "--json", **options)
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
        """Checks each command, whose last word is the option that takes the number."""
        for arguments in commands:
            for number in ("nan", "inf", "-1", "2000000000"):
                with self.subTest(" ".join(map(str, arguments)), number=number):
                    self.assert_refused(2, arguments[-1], *arguments, number)

    def python_as(self, command):
        """Creates a Python for charts that runs a shell command instead."""
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
