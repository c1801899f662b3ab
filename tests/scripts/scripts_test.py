"""The scripts: their help from any folder, rejected arguments, links of scripts/setup, files of scripts/format, files
that scripts/gpu_carry leaves after a failure, treatment of existing runs, exit statuses of measurements and of lists of
work, and results of scripts/gpu_check_record.py.

Run by ctest: python3 scripts_test.py [unittest arguments].
"""

import base64
import functools
import hashlib
import http.server
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
import unittest
import zipfile

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"


class Scratch(unittest.TestCase):
    """Copies of scripts in a separate folder, with substitutes for other programs."""

    COPIED = ()

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "scripts").mkdir()
        for name in self.COPIED:
            shutil.copy(SCRIPTS / name, self.root / "scripts" / name)

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def write_program(self, name, script):
        self.write(name, f"#!/bin/sh\n{script}\n").chmod(0o755)

    def run_script(self, name, *arguments, **variables):
        environment = {**self.environment(), "PICTURA_VENV": "venv", "PATH": f"{self.root}/bin:{os.environ['PATH']}", **variables}
        return subprocess.run([self.root / "scripts" / name, *arguments], env=environment, capture_output=True, text=True, timeout=60)

    def environment(self):
        """Returns the environment without variables that lead to programs, data or a checkout elsewhere."""
        return {name: value for name, value in os.environ.items() if not name.startswith(("GIT_", "PICTURA_"))}


class Help(Scratch):
    COPIED = [path.name for path in SCRIPTS.iterdir() if path.is_file()]
    EXECUTABLE = sorted(name for name in COPIED if os.access(SCRIPTS / name, os.X_OK))
    SHELL = [name for name in EXECUTABLE if (SCRIPTS / name).read_bytes().startswith(b"#!/usr/bin/env bash\n")]
    NEEDS_TORCH = ("export_backbone",)
    PASSES_OPTIONS_ON = ("gpu_ranks",)  # to `pictura train`

    def setUp(self):
        super().setUp()
        for name in ("apt-get", "cmake", "python3"):  # a script that does begin ends soon, and installs nothing
            self.write_program(f"bin/{name}", "echo nothing is done here >&2; exit 1")

    def assert_nothing_was_done(self):
        self.assertEqual(sorted(path.name for path in self.root.iterdir()), ["bin", "scripts"])

    def test_help_works_from_any_folder_and_has_no_side_effects(self):
        self.assertGreater(len(self.SHELL), 10)
        for name in self.EXECUTABLE:
            if name in self.NEEDS_TORCH:
                continue
            for option in ("--help", "-h"):
                with self.subTest(name, option=option):
                    programs = f"{self.root}/bin:" if name in self.SHELL else ""
                    result = subprocess.run([f"./{name}", option], cwd=self.root / "scripts", capture_output=True, text=True, timeout=60,
                                            env={**os.environ, "PATH": programs + os.environ["PATH"]})  # fmt: skip
                    self.assertEqual((result.returncode, result.stderr), (0, ""))
                    self.assertGreater(len(result.stdout.splitlines()), 1)
                    self.assert_nothing_was_done()

    def test_help_of_a_shell_script_is_its_head_comment(self):
        for name in self.SHELL:
            with self.subTest(name):
                comment = (SCRIPTS / name).read_text().partition("\nset ")[0].splitlines()[1:]
                help_lines = self.run_script(name, "--help").stdout.splitlines()
                self.assertEqual(help_lines, [line.removeprefix("#").removeprefix(" ") for line in comment])

    def test_shell_scripts_refuse_unknown_arguments_first(self):
        unknown = [(name, "--bogus") for name in self.SHELL if name not in self.PASSES_OPTIONS_ON]
        more = [("demo", "--seed", "3", "extra"), ("demo", "out", "extra"), ("demo", "--seeds", "2", "out", "extra"), ("figures", "a", "b"),
                ("film", "a", "b"), ("python_stubs", "a", "b"), ("setup", "--cpu", "a"), ("gpu_carry", "a"), ("format", "--check", "a")]  # fmt: skip
        for name, *arguments in unknown + more:
            with self.subTest(name, arguments=arguments):
                result = self.run_script(name, *arguments)
                self.assertEqual((result.returncode, result.stdout, len(result.stderr.splitlines())), (2, "", 1), result.stderr)
                self.assertRegex(result.stderr, f"^error: {name}: expected .*, got '")
                self.assert_nothing_was_done()


class Format(Scratch):
    """A separate checkout, with a clang-format that records its files."""

    COPIED = ("format",)

    def setUp(self):
        super().setUp()
        self.write("requirements.txt", "clang-format==1.2.3\n")
        self.write_program("venv/bin/clang-format", f"""
            case $1 in
              --version) echo 1.2.3 ;;
              *) for file; do case $file in -*) ;; *) cat "$file" >/dev/null || exit 1; echo "$file" >>{self.root}/formatted ;; esac; done ;;
            esac""")  # fmt: skip

    def git(self, *arguments):
        subprocess.run(["git", *arguments], cwd=self.root, env=self.environment(), check=True, capture_output=True, timeout=60)

    def formatted(self):
        (self.root / "formatted").write_text("")
        result = self.run_script("format", "--check")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return sorted((self.root / "formatted").read_text().splitlines())

    def test_all_file_names_are_supported_and_deleted_files_skipped(self):
        if shutil.which("git") is None:
            self.skipTest("needs git")
        self.git("init")
        self.assertEqual(self.formatted(), [])
        for name in ("a.cpp", "gone.cpp", "Stra\u00dfe.h", "two words.cu", "text.md"):
            self.write(name, "")
        self.git("add", ".")
        self.write("untracked.cuh", "")
        (self.root / "gone.cpp").unlink()
        self.assertEqual(self.formatted(), ["Stra\u00dfe.h", "a.cpp", "two words.cu", "untracked.cuh"])

    def test_formatting_is_skipped_without_a_checkout(self):
        result = self.run_script("format", "--check", GIT_DIR=str(self.root / "none"))
        self.assertEqual(result.returncode, 77)
        self.assertIn("not a git checkout", result.stderr)


class Carry(Scratch):
    """Runs with substitutes for apt-get and pip that download nothing."""

    COPIED = ("gpu_carry",)

    def setUp(self):
        super().setUp()
        self.fetch("first")

    def fetch(self, content, pip="true", **variables):
        self.write_program("bin/apt-get", f"echo {content} >{content}.deb")
        self.write_program("venv/bin/python", f"""
            while [ "$1" != --dest ]; do shift; done
            echo {content} >"$2/{content}.whl"
            {pip}""")  # fmt: skip
        shutil.rmtree(self.root / "data", ignore_errors=True)
        self.write(f"data/carla/{content}.xodr", content)
        return self.run_script("gpu_carry", PICTURA_DATA="data", **variables)

    def names(self):
        return sorted(str(path.relative_to(self.root / "carry")) for path in (self.root / "carry").rglob("*") if path.is_file())

    def test_fetched_files_replace_existing_files(self):
        self.assertEqual(self.names(), ["debs/first.deb", "maps/carla/first.xodr.gz", "wheels/first.whl"])
        for name in ("root/unpacked", "bin/pictura", "maps/mine.xodr", "new/of_a_killed_call"):
            self.write(f"carry/{name}", "")
        result = self.fetch("second")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        fetched = ["debs/second.deb", "maps/carla/second.xodr.gz", "wheels/second.whl"]
        self.assertEqual(self.names(), sorted([*fetched, "bin/pictura", "maps/mine.xodr"]))

    def test_a_failed_call_keeps_existing_files(self):
        self.write("carry/root/unpacked", "")
        before = self.names()
        self.assertEqual(self.fetch("second", pip="exit 5").returncode, 5)
        self.assertEqual(self.names(), before)
        self.assertFalse((self.root / "carry/new").exists())


class OnADevice(Scratch):
    """Scripts for a machine with a GPU, with a `pictura` that was built elsewhere, and a package that stands for torch."""

    COPIED = ("gpu_check", "gpu_check_record.py", "gpu_env", "gpu_lanes")

    def setUp(self):
        super().setUp()
        self.write("CMakeLists.txt", "project(nothing)")
        self.write("python/torch/__init__.py", "")
        # Trains until its time is over, or fails, as its first argument selects; exports all but broken checkpoints.
        self.write_program("pictura", """
            case "$1 $2" in
              "train late") echo '{"out_of_time": true}' ;;
              "train done") echo '{"out_of_time": false}' ;;
              "train "*) echo "no such training" >&2; exit 3 ;;
              "export runs/broken/"*) echo "error: broken" >&2; exit 1 ;;
              "export "*) echo weights >"$4" ;;
              *) echo '{}' ;;
            esac""")  # fmt: skip

    def run_script(self, name, *arguments, **variables):
        elsewhere = {"PICTURA_PROGRAM": str(self.root / "pictura"), "PYTHONPATH": str(self.root / "python")}
        return super().run_script(name, *arguments, **elsewhere | variables)


class Lanes(OnADevice):
    def work(self, *lines, seconds=100, **variables):
        list_of_work = self.write("list", "".join(f"{line}\n" for line in lines))
        result = self.run_script("gpu_lanes", "--out", self.root / "out", str(seconds), list_of_work, **variables)
        return result.returncode, result.stdout, result.stderr

    def packed(self):
        whole = self.root / "whole.tar.gz"
        whole.write_bytes(b"".join(path.read_bytes() for path in sorted((self.root / "out").iterdir())))
        with tarfile.open(whole) as tar:
            return {member.name for member in tar if member.isfile()}

    def test_a_failing_lane_sets_the_status_and_ends_only_itself(self):
        status, said, _ = self.work("0 good 1 true", "1 bad 1 sh -c 'echo wrong >&2; exit 7'", "1 after 1 true", "0 last 1 true")
        self.assertEqual(status, 1)
        self.assertIn("GPU 1: bad has failed: wrong", said)
        self.assertEqual({name for name in self.packed() if name.endswith(".done")}, {"runs/lanes/good.done", "runs/lanes/last.done"})
        self.assertEqual(self.work("0 good 1 true", "1 bad 1 true")[0], 0)
        self.assertIn("runs/lanes/bad.done", self.packed())

    def test_a_failing_single_lane_sets_the_status(self):
        for command in ("false", "sh -c 'exit 124'", "no_such_command", "pictura train wrong", "pictura"):
            with self.subTest(command):
                status, said, _ = self.work(f"0 only 1 {command}")
                is_done = command == "pictura"
                self.assertEqual((status, "only has failed" in said), (0, False) if is_done else (1, True), said)

    def test_work_out_of_time_is_not_a_failure(self):
        status, said, _ = self.work("0 long 1000 true", "1 training 1 pictura train late", "2 trained 1 pictura train done")
        self.assertEqual(status, 0, said)
        for what in ("GPU 0: no time for long", "GPU 1: training is not done: out of time", "GPU 2: trained is done"):
            self.assertIn(what, said)
        self.write_program("bin/timeout", "exit 124")  # status of a command that took too long
        status, said, _ = self.work("0 slow -50 true", seconds=0)
        self.assertEqual(status, 0, said)
        self.assertIn("slow is not done: out of time", said)
        self.assertFalse({name for name in self.packed() if name.endswith(".done")} - {"runs/lanes/trained.done"})

    def test_training_ends_after_its_configured_minutes(self):
        for arguments, is_done in (("", False), (" --minutes 1", True), (" --minutes 1000", False)):
            with self.subTest(arguments):
                status, said, _ = self.work(f"0 run{len(arguments)} 1 pictura train late{arguments}")
                self.assertEqual((status, "is not done: out of time" in said), (0, not is_done), said)

    def test_the_last_line_may_lack_a_newline(self):
        list_of_work = self.write("list", "0 first 1 true\n0 last 1 true")
        result = self.run_script("gpu_lanes", "--out", self.root / "out", "100", list_of_work)
        self.assertIn("GPU 0: last is done", result.stdout)

    def test_a_run_is_packed_with_its_checkpoint(self):
        self.write("runs/kept/checkpoint.ckpt", "state")
        self.write("runs/kept/untrained.ckpt", "first weights")
        stale = self.write("out/kept.tar.gz.001", "part of a larger pack")
        list_of_work = self.write("list", "0 good 1 true\n")
        result = self.run_script("gpu_lanes", "--out", self.root / "out", "--pack", "kept", "100", list_of_work)
        self.assertEqual(result.returncode, 0, result.stderr)
        with tarfile.open(self.root / "out/kept.tar.gz.000") as tar:
            self.assertEqual([member.name for member in tar if member.isfile()], ["kept/checkpoint.ckpt"])
        self.assertFalse(stale.exists())
        result = self.run_script("gpu_lanes", "--out", self.root / "out", "--pack", "lost", "100", list_of_work)
        self.assertEqual(result.returncode, 1)
        self.assertIn("runs/lost is not packed: it has no checkpoint", result.stdout)

    def test_a_failed_export_does_not_affect_other_weights(self):
        for name in ("broken", "whole"):
            self.write(f"runs/{name}/checkpoint.ckpt", "")
        self.write("runs/whole/policy_average.safetensors", "")
        status, said, errors = self.work("0 good 1 true")
        self.assertEqual((status, errors), (1, "error: broken\n"))
        self.assertIn("the weights of runs/broken/checkpoint.ckpt are not exported", said)
        self.assertEqual({name for name in self.packed() if name.endswith(".safetensors")},
                         {"runs/lanes/whole.safetensors", "runs/lanes/whole_average.safetensors"})  # fmt: skip

    def test_a_program_without_torch_ends_at_once(self):
        self.write("python/torch/__init__.py", "raise ImportError('no torch')")
        status, said, errors = self.work("0 good 1 true")
        self.assertEqual((status, said), (1, ""))
        self.assertIn("no torch", errors)


class Check(OnADevice):
    def measured(self, stage):
        return [entry["name"] for entry in json.loads((self.root / f"out/gpu_check_{stage}.json").read_text()).get("bench", [])]

    def check(self, *arguments):
        result = self.run_script("gpu_check", "--out", self.root / "out", *arguments)
        return result.returncode, result.stderr

    def test_only_chooses_measurements(self):
        self.assertEqual(self.check("--only", "^pl|qua", "benches", "squares"), (0, ""))
        self.assertEqual((self.measured("benches"), self.measured("squares")), (["planes"], ["squares"]))
        self.assertEqual(self.check("--only", "^history$", "benches", "squares"), (0, ""))
        self.assertEqual((self.measured("benches"), self.measured("squares")), (["planes", "history"], ["squares"]))
        self.assertEqual(self.check("squares"), (0, ""))
        self.assertEqual(self.measured("squares"), ["squares"])

    def test_only_without_a_match_is_an_error(self):
        error = "error: gpu_check: --only: expected an expression that matches one of 'draw', 'squares', got 'plains'\n"
        self.assertEqual(self.check("--only", "plains", "profile", "squares"), (1, error))

    def test_only_is_a_regular_expression(self):
        for bad in (["("], ["["], ["*("], []):
            error = f"error: gpu_check: --only: expected a regular expression, got '{''.join(bad)}' (see --help)\n"
            self.assertEqual(self.check("squares", "--only", *bad), (2, error))
            self.assertFalse((self.root / "out").exists())

    def test_a_failing_measurement_sets_the_status(self):
        self.write_program("pictura", 'test "$1" = --version')
        self.assertEqual(self.check("squares"), (1, ""))


class ReproduceTable(unittest.TestCase):
    """Runs with a substitute for pictura that reports its arguments."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.asked = self.root / "asked"
        program = self.root / "pictura"
        program.write_text(f"""#!{sys.executable}
import json, os, sys
if sys.argv[1] == "--version":
    print("pictura 1.2.3")
    sys.exit()
with open({str(self.asked)!r}, "a") as asked:
    print(" ".join(sys.argv[1:]), file=asked)
if "dense" in sys.argv and os.path.exists({str(self.root / "broken")!r}):
    sys.exit(3)
names = ["at_fault_collision_rate", "off_road_rate", "red_light_rate", "goals_per_vehicle", "km_per_infraction",
         "km_per_at_fault_infraction", "collision_rate", "wall_contact_rate", "km_per_vehicle"]
densities = sys.argv[sys.argv.index("--density") + 1].split(",") if "--density" in sys.argv else ["medium"]
rows = []
for density in densities:
    row = {{"density": density}}
    for name in names:
        row[name], row[name + "_half_width_95"] = 0.25, 0.125
    if "idle" in sys.argv:
        row["km_per_infraction"] = None
    rows.append(row)
print(json.dumps({{"rows": rows, "policy_hash": "abc", "device": "cpu", "precision": "fp32", "seed": 1}}))
""")
        program.chmod(0o755)
        (self.root / "a.safetensors").write_text("")

    def run_script(self, *arguments):
        return subprocess.run([SCRIPTS / "reproduce_table", "--pictura", self.root / "pictura", "--out", self.root / "out",
                               "--policies", self.root / "a.safetensors", *arguments], capture_output=True, text=True, timeout=60)  # fmt: skip

    def table(self, cycles, folder="out"):
        """Returns the facts and the cells of a table, without its head."""
        facts = json.loads((self.root / folder / f"table_{cycles}.json").read_text())
        lines = (self.root / folder / f"table_{cycles}.md").read_text().splitlines()
        return facts, [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[2:]]

    def test_policies_and_baselines_are_compared_with_the_papers(self):
        result = self.run_script("--density", "medium", "--scenarios", "2")
        self.assertEqual(result.returncode, 0, result.stderr)
        drivers = [("towns", "a"), ("towns", "lane keeper"), ("towns", "idle"),
                   ("procedural", "a"), ("procedural", "lane keeper"), ("procedural", "idle")]  # fmt: skip
        paper = [("towns", "paper: vectorized"), ("towns", "paper: vectorized without auxiliary"), ("towns", "paper: perspective")]
        for cycles in ("independent", "phases"):
            facts, rows = self.table(cycles)
            self.assertIn(f"Light cycles: {cycles}\n", result.stdout)
            self.assertEqual([(row[1], row[2]) for row in rows], drivers + paper)
            self.assertEqual(rows[0], ["medium", "towns", "a", "argmax", *["0.250 +- 0.125"] * 9])
            self.assertEqual(rows[2][8], "none")
            self.assertEqual(rows[-1][3:], ["argmax", ".060", ".018", ".058", "11.21", "11.61", "", "", "", ""])
            self.assertEqual((facts["light_cycles"], facts["complete"], facts["program"]), (cycles, True, "pictura 1.2.3"))
            self.assertEqual([(row["worlds"], row["policy"]) for row in facts["rows"]], drivers)
            self.assertEqual((facts["rows"][0]["policy_hash"], facts["rows"][0]["actions"]), ("abc", "argmax"))
        asked = self.asked.read_text().splitlines()
        self.assertEqual(len(asked), 12)
        self.assertIn("a.safetensors --density medium --light-cycles independent --scenarios 2 --out ", asked[0])
        self.assertIn("--policy lane --density medium --light-cycles independent --scenarios 2", asked[1])
        procedural = "--map " + ",".join(f"procedural:{seed}" for seed in range(1, 7))
        self.assertEqual(sum(procedural in line for line in asked), 6)

    def test_a_table_holds_chosen_rows_and_can_be_extended(self):
        small = ["--light-cycles", "as_trained", "--worlds", "procedural", "--procedural", "procedural:1"]
        result = self.run_script(*small, "--density", "dense", "--actions", "argmax", "sampled", "--results", self.root / "results",
                                 "--scenarios", "9", "--baseline-scenarios", "2")  # fmt: skip
        self.assertEqual(result.returncode, 0, result.stderr)
        facts, rows = self.table("as_trained", "results")
        self.assertEqual([row[:4] for row in rows[:4]], [["dense", "procedural", "a", "argmax"], ["dense", "procedural", "a", "sampled"],
                                                         ["dense", "procedural", "lane keeper", ""], ["dense", "procedural", "idle", ""]])  # fmt: skip
        asked = self.asked.read_text().splitlines()
        self.assertEqual([line.split(" --out")[0].removeprefix("evaluate ") for line in asked],
                         [f"{self.root}/a.safetensors --density dense --map procedural:1 --scenarios 9",
                          f"{self.root}/a.safetensors --density dense --map procedural:1 --sampled --scenarios 9",
                          "--policy lane --density dense --map procedural:1 --scenarios 2",
                          "--policy idle --density dense --map procedural:1 --scenarios 2"])  # fmt: skip
        self.run_script(*small, "--density", "light,dense", "--scenarios", "9", "--baseline-scenarios", "2")
        self.assertEqual(len(self.asked.read_text().splitlines()), 7)
        self.assertEqual([row[:3] for row in self.table("as_trained")[1] if row[1] == "procedural"],
                         [[density, "procedural", name] for density in ("light", "dense") for name in ("a", "lane keeper", "idle")])  # fmt: skip

    def test_devices_evaluate_concurrently_and_baselines_drive_on_the_host(self):
        policies = [self.root / f"{name}.safetensors" for name in "abcd"]
        for policy in policies:
            policy.write_text(policy.stem)
        result = self.run_script("--light-cycles", "phases", "--density", "medium", "--devices", "cuda:0", "cuda:1", "--policies", *policies)
        self.assertEqual(result.returncode, 0, result.stderr)
        asked = self.asked.read_text().splitlines()
        self.assertEqual(len(asked), 12)
        for line in asked:
            self.assertEqual("--device cuda:" in line, "--policy" not in line, line)
        first, _ = self.table("phases")
        self.assertEqual([row["policy"] for row in first["rows"][:6]], ["a", "b", "c", "d", "lane keeper", "idle"])
        # Another device does not cause a new evaluation.
        self.assertEqual(self.run_script("--light-cycles", "phases", "--density", "medium", "--policies", *policies).returncode, 0)
        self.assertEqual(len(self.asked.read_text().splitlines()), 12)
        self.assertEqual(self.run_script("--devices", "cuda:0", "--device", "cuda").returncode, 1)

    def test_a_failed_evaluation_is_named_and_finished_ones_are_kept(self):
        (self.root / "broken").write_text("")
        result = self.run_script("--light-cycles", "phases", "--density", "medium,dense")
        self.assertEqual(result.returncode, 1)
        self.assertIn("a_towns_phases_dense_argmax: pictura evaluate ends with status 3", result.stderr)
        facts, rows = self.table("phases")
        self.assertFalse(facts["complete"])
        self.assertEqual({row["density"] for row in facts["rows"]}, {"medium"})

    def test_evaluate_options_with_script_equivalents_are_refused(self):
        for argument, instead in {"--map": "--towns or --procedural", "--sampled": "--actions sampled"}.items():
            result = self.run_script(argument)
            self.assertEqual((result.returncode, result.stderr), (1, f"error: reproduce_table: {argument}: expected {instead}\n"))
        result = self.run_script("--density", "thick")
        self.assertEqual(result.returncode, 2)
        self.assertIn("got 'thick'", result.stderr)

    def test_the_real_program_fills_a_small_table(self):
        program = os.environ.get("PICTURA_PROGRAM_WITH_TORCH")
        if not program:
            self.skipTest("this build has no torch")
        small = ["--light-cycles", "as_trained", "--density", "light", "--towns", "procedural:1:blocks=2x2", "--worlds", "towns",
                 "--agents", "6", "--scenarios", "2", "--steps", "20", "--device", "cpu", "--threads", "1"]  # fmt: skip
        result = subprocess.run([SCRIPTS / "reproduce_table", "--pictura", program, "--out", self.root / "out", "--policies",
                                 SCRIPTS.parent / "models/vector.safetensors", *small], capture_output=True, text=True, timeout=200)  # fmt: skip
        self.assertEqual(result.returncode, 0, result.stderr)
        facts, rows = self.table("as_trained")
        self.assertEqual([row[:4] for row in rows], [["custom", "towns", "vector", "argmax"], ["custom", "towns", "lane keeper", ""],
                                                     ["custom", "towns", "idle", ""]])  # fmt: skip
        self.assertEqual({row["scenarios"] for row in facts["rows"]}, {2})
        self.assertGreater(facts["rows"][0]["vehicle_episodes"], 0)

    def test_curves_are_evaluations_along_trainings(self):
        trainings = self.root / "trainings.toml"
        policy = self.root / "a.safetensors"
        points = "".join(f'{{policy = "{policy}", agent_steps = {steps}, gpu_hours = 0.5}},' for steps in (1e6, 2e6))
        trainings.write_text(f'[[line]]\nname = "an agent"\ndashed = true\npoints = [{points}]\n')
        for _ in range(2):  # the second run evaluates nothing
            result = self.run_script("--curves", trainings, "--scenarios", "2")
            self.assertEqual((result.returncode, len(self.asked.read_text().splitlines())), (0, 2), result.stderr)
        curves = json.loads((self.root / "out/curves.json").read_text())
        (line,) = curves["lines"]
        self.assertEqual((line["name"], line["dashed"], curves["arguments"]), ("an agent", True, ["--scenarios", "2"]))
        self.assertEqual([(point["agent_steps"], point["policy"]) for point in line["points"]], [(1e6, "a"), (2e6, "a")])
        self.assertEqual([row["density"] for row in line["points"][0]["rows"]], ["medium"])
        trainings.write_text(trainings.read_text().replace("a.safetensors", "b.safetensors"))
        result = self.run_script("--curves", trainings)
        self.assertEqual(result.returncode, 1)
        self.assertIn("trainings.toml: line 'an agent'", result.stderr)
        self.assertIn("b.safetensors: no such file", result.stderr)
        for text in ("line = 1", "[[line]]\nname = 'a'", "[[line"):
            trainings.write_text(text)
            result = self.run_script("--curves", trainings)
            self.assertEqual((result.returncode, len(result.stderr.splitlines())), (1, 1), result.stderr)
            self.assertIn("trainings.toml: expected [[line]] with name", result.stderr)

    def test_finished_evaluations_are_reused_by_default(self):
        chosen = ["--density", "medium", "--light-cycles", "phases", "--worlds", "towns"]
        first = self.run_script(*chosen)
        self.assertEqual(self.run_script(*chosen).stdout, first.stdout)
        self.assertEqual(len(self.asked.read_text().splitlines()), 3)
        self.run_script(*chosen, "--steps", "600")
        self.assertEqual(len(self.asked.read_text().splitlines()), 6)
        (self.root / "a.safetensors").write_text("other weights")
        self.run_script(*chosen, "--steps", "600")
        self.assertEqual(len(self.asked.read_text().splitlines()), 7)

    def test_errors_name_a_missing_policy(self):
        result = self.run_script("--policies", self.root / "none.safetensors")
        self.assertEqual(result.returncode, 1)
        self.assertIn("none.safetensors: no such file", result.stderr)

    def test_policies_of_one_name_are_refused(self):
        (self.root / "b").mkdir()
        (self.root / "b/a.safetensors").write_text("")
        result = self.run_script("--policies", self.root / "a.safetensors", self.root / "b/a.safetensors")
        self.assertEqual(result.returncode, 1)
        self.assertIn("a.safetensors: expected distinct names, got 'a' twice", result.stderr)


class Setup(unittest.TestCase):
    """A copy of scripts/setup that finds everything installed."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "scripts").mkdir()
        names = ("requirements.txt", "scripts/setup", "scripts/install_torch")
        for name in names:
            shutil.copy(SCRIPTS.parent / name, self.root / name)
        installed = b"".join((self.root / name).read_bytes() for name in names)
        self.write_program("venv/bin/python", "echo 2.11.0")
        self.write_program("venv/bin/cmake", "echo cmake version 3.30")
        self.hash = hashlib.sha256(installed).hexdigest()[:16]
        self.write_program("bin/dpkg-query", "echo installed")

    def write_program(self, name, script):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)

    def link(self):
        """Returns the link left by set-up, after two runs."""
        environment = dict(os.environ, PICTURA_VENV="venv", PATH=f"{self.root}/bin:/usr/bin:/bin")
        which = subprocess.run([self.root / "scripts/install_torch", "--which"], env=environment, capture_output=True, text=True).stdout
        (self.root / "venv/pictura-setup").write_text(f"{self.hash} {which}")
        for _ in range(2):
            result = subprocess.run([self.root / "scripts/setup"], env=environment, capture_output=True, text=True, timeout=60)
            self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
        return os.readlink(self.root / "compile_commands.json")

    def test_compile_commands_are_linked_at_the_root(self):
        has_nvcc = shutil.which("nvcc", path="/usr/bin:/bin") or os.access("/usr/local/cuda/bin/nvcc", os.X_OK)
        self.assertEqual(self.link(), f"build/{'cuda' if has_nvcc else 'cpu'}/compile_commands.json")
        self.write_program("bin/nvcc", "true")
        self.assertEqual(self.link(), "build/cuda/compile_commands.json")

    def test_torch_can_be_left_to_the_next_call(self):
        self.write_program("bin/python3", '[ "$1" = -m ]')  # has no torch, and makes no environment
        self.write_program("venv/bin/pip", f"echo tools >>{self.root}/installed")
        self.write_program("venv/bin/python", f'echo 2.11.0; [ "$2" != pip ] || echo torch >>{self.root}/installed')
        environment = dict(os.environ, PICTURA_VENV="venv", PATH=f"{self.root}/bin:/usr/bin:/bin")
        for options, installed in ((["--without-torch"], "tools"), (["--without-torch"], "tools"), (["--gpu"], "tools torch"),
                                   (["--gpu"], "tools torch"), (["--gpu", "--without-torch"], "tools torch")):  # fmt: skip
            with self.subTest(options=options):
                result = subprocess.run([self.root / "scripts/setup", *options], env=environment, capture_output=True, text=True, timeout=60)
                self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
                self.assertEqual("torch 2.11.0" in result.stdout, "--without-torch" not in options)
                self.assertEqual((self.root / "installed").read_text().split(), installed.split())

    def test_presets_export_them_and_git_ignores_the_link(self):
        presets = json.loads((SCRIPTS.parent / "CMakePresets.json").read_text())["configurePresets"]
        base = next(preset for preset in presets if preset["name"] == "base")
        self.assertEqual(base["cacheVariables"]["CMAKE_EXPORT_COMPILE_COMMANDS"], "ON")
        parents = {preset["name"]: preset.get("inherits") for preset in presets}
        for name in parents:
            while name != "base":
                self.assertIn(name, parents, "a preset that does not lead to base")
                name = parents[name]
        self.assertIn("/compile_commands.json", (SCRIPTS.parent / ".gitignore").read_text().split())


class InstallTorch(Scratch):
    """Wheels named like those of torch, without its contents, in folders, and in an index that this process serves."""

    COPIED = ("install_torch",)

    def setUp(self):
        super().setUp()
        if not self.has_pip():
            self.skipTest("needs a Python with venv and pip")
        for folder, version in (("default", "2.11.0"), ("cpu/torch", "2.11.0+cpu")):
            wheel = self.root / folder / f"torch-{version}-py3-none-any.whl"
            wheel.parent.mkdir(parents=True)
            with zipfile.ZipFile(wheel, "w") as archive:
                info = f"torch-{version}.dist-info"
                archive.writestr("torch/__init__.py", f"__version__ = '{version}'\n")
                archive.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: torch\nVersion: {version}\n")
                archive.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
                archive.writestr(f"{info}/RECORD", "")
        subprocess.run([sys.executable, "-m", "venv", self.root / "venv"], check=True, timeout=120)

    @staticmethod
    def has_pip():
        return subprocess.run([sys.executable, "-c", "import ensurepip, venv"], capture_output=True).returncode == 0

    def install(self, *options, index=None):
        """Returns the installed version of torch and the output."""
        default = {"PIP_NO_INDEX": "1"} if index is None or not index.startswith("http") else {"PIP_INDEX_URL": f"file://{self.root}/none"}
        result = self.run_script("install_torch", self.root / "venv/bin/python", *options, PIP_FIND_LINKS=str(self.root / "default"),
                                 PIP_CACHE_DIR=str(self.root / "cache"), PICTURA_TORCH_INDEX=index or "", **default)  # fmt: skip
        self.assertEqual(result.returncode, 0, result.stderr + result.stdout)
        version = subprocess.run([self.root / "venv/bin/python", "-c", "import torch; print(torch.__version__)"], capture_output=True, text=True)
        return version.stdout.strip(), result.stdout

    def test_the_build_for_cpus_comes_from_a_folder(self):
        self.assertEqual(self.install("--cpu", index=str(self.root / "cpu/torch"))[0], "2.11.0+cpu")

    def test_the_build_for_cpus_comes_from_an_index(self):
        handler = functools.partial(QuietHandler, directory=self.root / "cpu")
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            self.assertEqual(self.install("--cpu", index=f"http://127.0.0.1:{server.server_port}/")[0], "2.11.0+cpu")
            server.shutdown()

    def test_the_default_build_is_the_fallback(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            unreachable = f"http://127.0.0.1:{free.getsockname()[1]}/"
        for index in (None, str(self.root / "default"), unreachable):
            with self.subTest(index):
                version, said = self.install("--cpu", index=index)
                self.assertEqual(version, "2.11.0")
                self.assertIn("instead the default build", said)
                self.assertIn("PICTURA_TORCH_INDEX", said)

    def test_a_gpu_selects_the_default_build(self):
        version, said = self.install("--gpu", index=str(self.root / "cpu/torch"))
        self.assertEqual(version, "2.11.0")
        self.assertNotIn("+cpu", said)

    def test_a_cuda_compiler_selects_the_default_build(self):
        which = lambda *options: self.run_script("install_torch", "--which", *options).stdout.strip()  # noqa: E731
        has_gpu = list(pathlib.Path("/dev").glob("nvidia[0-9]*")) or os.access("/usr/local/cuda/bin/nvcc", os.X_OK) or shutil.which("nvcc")
        self.assertEqual(which(), "gpu" if has_gpu else "cpu")
        self.write_program("bin/nvcc", "true")
        self.assertEqual((which(), which("--cpu"), which("--gpu")), ("gpu", "cpu", "gpu"))


class JoinWheels(Scratch):
    """Wheels with real names whose files contain the names of their builds."""

    COPIED = ("join_wheels",)
    NAME = "pictura-1-cp311-cp311-linux_x86_64.whl"
    SUFFIX = "cpython-311-x86_64-linux-gnu.so"

    def wheel(self, build, *names):
        path = self.root / build / self.NAME
        path.parent.mkdir()
        with zipfile.ZipFile(path, "w") as archive:
            for name in ("pictura/__init__.py", f"pictura/_pictura.{self.SUFFIX}", *names, "pictura-1.dist-info/RECORD"):
                archive.writestr(name, "" if name.endswith("RECORD") else f"{build} {name}")
            command = zipfile.ZipInfo("pictura/bin/" + ("torch_2_11/" if build == "torch" else "") + "pictura")
            command.external_attr = 0o755 << 16
            archive.writestr(command, build)
        return path

    def join(self, *arguments):
        (self.root / "out").mkdir(exist_ok=True)
        return self.run_script("join_wheels", self.root / "out", *arguments)

    def setUp(self):
        super().setUp()
        self.v3 = self.wheel("v3", f"pictura/_driving.{self.SUFFIX}")
        self.old = self.wheel("old", f"pictura/_driving.{self.SUFFIX}")
        self.torch = self.wheel("torch", f"pictura/_training_2_11.{self.SUFFIX}")

    def test_builds_have_separate_folders_and_the_record_lists_all_files(self):
        result = self.join(self.v3, "--x86-64", self.old, "--torch", self.torch)
        self.assertEqual(result.returncode, 0, result.stderr)
        with zipfile.ZipFile(self.root / "out" / self.NAME) as archive:
            builds = {info.filename: archive.read(info).decode().split(" ")[0] for info in archive.infolist()}
            record = archive.read("pictura-1.dist-info/RECORD").decode()
            mode = archive.getinfo("pictura/x86_64/bin/pictura").external_attr >> 16
            for line in record.splitlines()[:-1]:
                name, digest, size = line.split(",")
                if not name.endswith("RECORD"):
                    data = archive.read(name)
                    self.assertEqual(int(size), len(data))
                    expected = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
                    self.assertEqual(digest, f"sha256={expected}")
        self.assertEqual(mode, 0o755)
        self.assertEqual(sorted(line.split(",")[0] for line in record.splitlines()), sorted(builds))
        del builds["pictura-1.dist-info/RECORD"]
        self.assertEqual(builds, {
            "pictura/__init__.py": "v3", f"pictura/_pictura.{self.SUFFIX}": "v3", f"pictura/_driving.{self.SUFFIX}": "v3",
            "pictura/bin/pictura": "v3", f"pictura/x86_64/_pictura.{self.SUFFIX}": "old", f"pictura/x86_64/_driving.{self.SUFFIX}": "old",
            "pictura/x86_64/bin/pictura": "old", f"pictura/_training_2_11.{self.SUFFIX}": "torch", "pictura/bin/torch_2_11/pictura": "torch",
        })  # fmt: skip

    def test_incompatible_wheels_are_refused(self):
        for arguments, message in (((self.torch,), "expected a build without torch"),
                                   ((self.v3, "--torch", self.torch, self.torch), "another wheel has it too"),
                                   ((self.v3, "--x86-64", self.root / "none.whl"), "expected a wheel named"),
                                   ((self.root / "none.whl",), "none.whl")):  # fmt: skip
            with self.subTest(message):
                result = self.join(*arguments)
                self.assertEqual(result.returncode, 1)
                self.assertIn(message, result.stderr)
        self.assertEqual(list((self.root / "out").iterdir()), [])


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class Runs(unittest.TestCase):
    """Copies of the scripts that train, with a `pictura` that records its arguments and fails."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for name in ("demo", "gpu_env", "gpu_train"):
            (self.root / "scripts").mkdir(exist_ok=True)
            shutil.copy(SCRIPTS / name, self.root / "scripts" / name)
        for name in ("scripts/setup", "venv/bin/cmake"):
            self.write_program(name, "true")
        for build in ("cpu", "cuda"):
            self.write_program(f"build/{build}/apps/pictura", f'echo "$*" >{self.root}/asked; exit 3')

    def write_program(self, name, script):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)

    def asked(self, name, *arguments):
        environment = {**os.environ, "PICTURA_VENV": "venv", "PATH": f"{self.root}/venv/bin:/usr/bin:/bin"}
        environment.pop("PICTURA_PROGRAM", None)  # else the scripts would use that program
        result = subprocess.run([self.root / "scripts" / name, *arguments], env=environment, capture_output=True, text=True,
                                timeout=60)  # fmt: skip
        self.assertEqual(result.returncode, 3, result.stderr)
        return (self.root / "asked").read_text().split()

    def test_the_demo_overwrites_an_earlier_run(self):
        self.assertIn("--overwrite", self.asked("demo"))

    def test_the_demo_prints_the_spread_of_seeds(self):
        def demo(*arguments):
            environment = {**os.environ, "PICTURA_VENV": "venv", "PATH": f"{self.root}/venv/bin:/usr/bin:/bin"}
            return subprocess.run([self.root / "scripts/demo", *arguments], env=environment, capture_output=True, text=True,
                                  timeout=60)  # fmt: skip

        # Each run's return is its seed, stored in its folder; every other metric is 2, but no run has an infraction.
        self.write_program("build/cpu/apps/pictura", """
            if [ "$1" = train ]; then
              mkdir -p "$7"; echo "${5#run.seed=}" >"$7/seed"
            else
              rate='"at_fault_collision_rate": 2, "off_road_rate": 2, "red_light_rate": 2, "never_moved_share": 2'
              counts='"km_per_infraction": null, "infractions": 2, "km_driven": 2, "goals_per_vehicle": 2'
              echo "{\\"rows\\": [{\\"return_per_vehicle\\": $(cat "$(dirname "$2")/seed"), $counts, $rate}]}"
            fi""")  # fmt: skip
        os.symlink(sys.executable, self.root / "venv/bin/python")
        result = demo("--seeds", "3", "out/spread")
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
        trained = next(line for line in result.stdout.splitlines() if line.startswith("trained, argmax"))
        self.assertEqual(trained.split()[2:3] + trained.split()[9:15], ["-", "2.00", "+-", "0.00", "2.00", "+-", "1.00"])
        for bad in ("1", "0", "x", "100"):
            result = demo("--seeds", bad)
            self.assertEqual((result.returncode, result.stderr), (2, f"error: demo: --seeds: expected 2 to 99, got '{bad}'\n"))

    def test_training_resumes_if_a_checkpoint_exists(self):
        train = ("gpu_train", "run", "--minutes", "8")
        self.assertEqual(self.asked(*train), ["train", "--out", "runs/run", "--minutes", "8", "--json"])
        self.assertNotIn("--resume", self.asked(*train))
        (self.root / "runs/run/checkpoint.ckpt").write_text("")
        self.assertIn("--resume", self.asked(*train))
        self.assertEqual(self.asked(*train, "--resume").count("--resume"), 1)
        self.assertNotIn("--resume", self.asked(*train, "--overwrite"))
        self.assertNotIn("--resume", self.asked("gpu_train", "other"))
        for ranks in ("0", "x"):
            result = subprocess.run([self.root / "scripts/gpu_train", "--ranks", ranks, "run"], capture_output=True, text=True, timeout=60)
            self.assertEqual((result.returncode, f"--ranks: expected a number of at least 1, got '{ranks}'" in result.stderr), (2, True), result.stderr)


class Profile(unittest.TestCase):
    COLUMNS = ["ID", "Kernel Name", "Metric Name", "Metric Unit", "Metric Value"]

    def profile(self, *arguments):
        command = [sys.executable, str(SCRIPTS / "gpu_profile.py"), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60)

    def test_metrics_of_ncu_become_rows(self):
        with tempfile.TemporaryDirectory(prefix="pictura-test-") as folder:
            table = pathlib.Path(folder) / "table.csv"
            lines = [self.COLUMNS, ["0", "pictura_draw", "Executed Instructions", "inst", "1,234,567"],
                     ["0", "pictura_draw", "Stack Size", "", "1,024"], ["1", "pictura_cull", "Duration", "us", "80.8"]]
            table.write_text("==PROF== Connected\n" + "".join(",".join(f'"{word}"' for word in line) + "\n" for line in lines))
            result = self.profile("--csv", table)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(json.loads(result.stdout)["results"], [
                {"name": "pictura_draw, Executed Instructions", "value": 1234567.0, "unit": "inst"},
                {"name": "pictura_cull, Duration", "value": 80.8, "unit": "us"}])
            table.write_text("==ERROR== No kernels were profiled\n")
            result = self.profile("--csv", table)
            self.assertEqual((result.returncode, result.stdout), (1, ""))
            self.assertIn("No kernels were profiled", result.stderr)

    def test_a_command_or_a_table_is_required(self):
        self.assertEqual(self.profile().returncode, 2)


class Record(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "CMakeLists.txt").write_text("project(nothing)")
        self.file = self.folder / "record.json"

    def recorder(self, *arguments):
        return [sys.executable, str(SCRIPTS / "gpu_check_record.py"), str(self.file), *arguments]

    def record(self, *arguments):
        result = subprocess.run(self.recorder(*arguments), cwd=self.folder, capture_output=True, text=True, timeout=60)
        return result.returncode, json.loads(self.file.read_text())

    def source_hash(self):
        return self.record("start")[1]["source_hash"]

    def bench(self, script):
        self.record("start")
        return self.record("bench", "soak", "--", "sh", "-c", script)

    def test_a_failed_bench_keeps_its_measurements(self):
        status, content = self.bench("""echo '{"faults": [3]}'""")
        self.assertEqual((status, content["bench"][0]["faults"]), (0, [3]))
        status, content = self.bench("""echo '{"faults": [3]}'; echo broken >&2; exit 1""")
        self.assertEqual((status, "bench" in content), (1, False))
        failed = content["failed"][0]
        self.assertEqual((failed["measured"], failed["outcome"]), ({"faults": [3]}, "exit status 1"))
        self.assertEqual(failed["last_lines"], ["broken"])

    def test_a_bench_without_a_json_object_fails(self):
        for script in ("echo '[1]'", "echo fast", "true", "exit 1"):
            with self.subTest(script):
                status, content = self.bench(script)
                self.assertEqual((status, "measured" in content["failed"][0]), (1, False))

    def test_kept_results_have_the_same_sources(self):
        self.bench("echo '{}'")
        self.assertEqual(len(self.record("start", "--keep")[1]["bench"]), 1)
        self.assertFalse(self.record("start", "--keep")[1]["complete"])
        self.record("finish")
        self.assertTrue(self.record("start", "--keep")[1]["complete"])
        self.assertNotIn("bench", self.record("start")[1])
        self.bench("echo '{}'")
        (self.folder / "CMakeLists.txt").write_text("project(something)")
        self.assertNotIn("bench", self.record("start", "--keep")[1])

    def test_the_source_hash_covers_paths_and_excludes_generated_files(self):
        for name in ("common/a.h", "bench/b.h"):
            (self.folder / name).parent.mkdir()
            (self.folder / name).write_text(name)
        before = self.source_hash()
        for name in ("tests/__pycache__/a.pyc", "bench/results/a.json"):
            (self.folder / name).parent.mkdir(parents=True)
            (self.folder / name).write_text("made")
        self.assertEqual(self.source_hash(), before)
        (self.folder / "common/a.h").rename(self.folder / "common/aa.h")
        moved = self.source_hash()
        self.assertNotEqual(moved, before)
        shutil.move(self.folder / "common/aa.h", self.folder / "common/a.h")
        self.assertEqual(self.source_hash(), before)

    def test_a_signal_kills_the_command_and_its_children(self):
        for verb in (["run", "build"], ["bench", "rate"], ["tests"]):
            with self.subTest(verb[0]):
                self.record("start")
                child = self.folder / f"{verb[0]}.pid"
                script = f"sleep 300 & echo $! > {child}.tmp; mv {child}.tmp {child}; wait"
                recorder = subprocess.Popen(self.recorder(*verb, "--", "sh", "-c", script), cwd=self.folder)
                while not child.exists():
                    time.sleep(0.02)
                recorder.send_signal(signal.SIGTERM)
                self.assertEqual(recorder.wait(timeout=60), 1)
                self.assertTrue(self.ends(int(child.read_text())))

    def ends(self, process, within_s=10):
        """Whether the process ends; a killed orphan may remain as a zombie."""
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            try:
                state = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                return True
            if state == "Z":
                return True
            time.sleep(0.02)
        os.kill(process, signal.SIGKILL)
        return False


if __name__ == "__main__":
    unittest.main()
