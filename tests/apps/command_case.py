"""What tests of the `pictura` command share. A program of tests is run by ctest, one entry per class:

    python3 X_command_test.py PICTURA [unittest arguments]
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

# The command.
PICTURA = os.path.abspath(sys.argv.pop(1))
CONFIGS = pathlib.Path(__file__).resolve().parents[2] / "configs"
# A policy and a world so small that an update takes well under a second. On the host, whose runs are exact.
TINY = [
    "--config", str(CONFIGS / "smoke.toml"),
    "--set", "simulator.num_slots=6", "--set", "simulator.min_agents=3", "--set", "simulator.max_agents=3",
    "--set", "train.num_steps=8", "--set", "train.minibatch_size=48", "--set", "train.schedule_agent_steps=1000000",
    "--set", "render.width_px=16", "--set", "render.height_px=9", "--set", "run.num_threads=2",
    "--set", "run.device=cpu",
]  # fmt: skip


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
