"""`pictura plot` from outside, and charts that other commands draw."""

import json
import os
import pathlib
import signal
import subprocess
import time
import unittest

from command_case import PICTURA, CommandCase, run


class Plots(CommandCase):
    def run_folder(self, name, seed, goals, settings="a = 1"):
        """Creates a folder as written by pictura train, with updates of these numbers of goals per 1,000 steps."""
        folder = self.folder / name
        folder.mkdir()
        (folder / "config.toml").write_text(f"[run]\nseed = {seed}\n[train]\n{settings}\n")
        head = "update,charts/agent_steps,driving/goals_per_1000_steps,time/rollout_s,time/update_s\n"
        rows = [f"{i + 1},{1000 * (i + 1)},{value},1800,1800\n" for i, value in enumerate(goals)]
        (folder / "progress.csv").write_text(head + "".join(rows))
        return folder

    def test_evaluations_along_trainings_are_lines_in_bands(self):
        metrics = ["at_fault_collision_rate", "off_road_rate", "red_light_rate", "goals_per_vehicle", "km_per_infraction"]
        rows = [{"density": density, **{name: value for name in metrics}} for density, value in (("light", 0.1), ("medium", 0.2))]
        points = [{"agent_steps": steps, "gpu_hours": steps / 1e6, "rows": rows} for steps in (1e6, 3e6)]
        curves, picture = self.folder / "curves.json", self.folder / "curves.png"
        curves.write_text(json.dumps({"lines": [{"name": "agent", "points": points}, {"name": "baseline", "dashed": True, "points": points}]}))
        facts = self.json_of("plot", "--evaluations", curves, "--x", "hours", "--out", picture)
        self.assertEqual([(line["name"], line["points"], line["x_last"]) for line in facts["lines"]], [("agent", 2, 3), ("baseline", 2, 3)])
        self.assertGreater(picture.stat().st_size, 5000)
        for arguments in ([], ["--evaluations", curves, self.folder], ["--evaluations", curves, "--metrics", "a"]):
            result = run("plot", *arguments, "--out", picture)
            self.assertEqual(result.returncode, 2, result.stderr)

    def test_evaluations_by_severity_are_lines(self):
        picture, result = self.folder / "cameras.png", self.folder / "cameras.json"
        metrics = ["at_fault_collision_rate", "off_road_rate", "red_light_rate", "goals_per_vehicle", "km_per_infraction", "km_per_at_fault_infraction"]
        numbers = {key: 0.5 for name in metrics for key in (name, f"{name}_half_width_95")}
        rows = [{"density": "medium", "driver": None, "camera_severity": severity, **numbers} for severity in (0, 1)]
        result.write_text(json.dumps({"rows": rows}))
        facts = self.json_of("plot", "--severities", result, "--out", picture)
        self.assertEqual([(line["name"], line["points"], line["x_last"]) for line in facts["lines"]], [("medium", 2, 1)])
        self.assertGreater(picture.stat().st_size, 5000)
        self.assert_refused(2, "--severities", "plot", "--severities", result, "--x", "hours", "--out", picture)

    def test_seeds_are_one_line_and_the_picture_is_drawn(self):
        a = self.run_folder("town_s1", 1, [1, 2, 3])
        b = self.run_folder("town_s2", 2, [3, 4, 7])
        c = self.run_folder("wide", 1, [0, 1], "a = 2")
        picture = self.folder / "curves.png"
        facts = self.json_of("plot", a, b, c, "--metrics", "goals_per_1000_steps", "--out", picture)
        self.assertGreater(picture.stat().st_size, 5000)
        self.assertEqual((facts["out"], facts["x"]), (str(picture), "agent_steps"))
        self.assertEqual(facts["metrics"], ["driving/goals_per_1000_steps"])
        self.assertEqual([line["name"] for line in facts["lines"]], ["town_s*, 2 seeds", "wide"])
        town, wide = facts["lines"]
        self.assertEqual((town["runs"], town["seeds"]), ([str(a), str(b)], [1, 2]))
        self.assertEqual((town["points"], town["x_first"], town["x_last"]), (3, 1000, 3000))
        self.assertEqual(town["last"], {"driving/goals_per_1000_steps": 5})
        self.assertEqual(wide["last"], {"driving/goals_per_1000_steps": 1})
        apart = self.json_of("plot", "--metrics", "goals_per_1000_steps,update", a, b, "--group", "none", "--x", "hours",
                             "--out", picture)  # fmt: skip
        self.assertEqual([(line["name"], line["x_last"]) for line in apart["lines"]], [("town_s1", 3), ("town_s2", 3)])
        self.assertIn("curves.png: runs 3, lines 2, panels 1",
                      run("plot", a, b, c, "--metrics", "goals_per_1000_steps", "--out", picture).stdout)  # fmt: skip

    def test_errors_name_missing_data(self):
        a = self.run_folder("a", 1, [1, 2])
        out = ["--out", self.folder / "curves.png"]
        self.assert_refused(1, "nowhere: expected the folder of a training run", "plot", self.folder / "nowhere", *out)
        self.assert_refused(1, "a/progress.csv: expected a column 'charts/episode_return'", "plot", a, *out)
        self.assert_refused(1, "/proc/nowhere", "plot", a, "--metrics", "update", "--out", "/proc/nowhere/curves.png")
        self.assert_refused(1, "/dev/full: No space left on device", "plot", a, "--metrics", "update", "--out", "/dev/full")
        self.assert_refused(2, "--x", "plot", a, "--x", "days", *out)
        self.assert_refused(2, "RUN", "plot", *out)
        self.assert_refused(2, "expected a name that ends in .png or .svg", "plot", a, "--out", self.folder / "curves.pdf")
        self.assertFalse((self.folder / "curves.png").exists())

    def test_the_file_extension_selects_vector_graphics(self):
        curves = self.folder / "curves.svg"
        result = run("plot", self.run_folder("a", 1, [1, 2]), "--metrics", "update", "--out", curves)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn("<svg", curves.read_text())

    def test_modules_in_the_working_folder_are_not_imported(self):
        (self.folder / "json.py").write_text("raise SystemExit(7)")
        result = run("plot", self.run_folder("a", 1, [1, 2]), "--metrics", "update", "--out", "curves.png", cwd=self.folder)
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_plots_without_matplotlib_or_python_print_what_to_install(self):
        curves = self.folder / "curves.png"
        arguments = ["plot", self.run_folder("a", 1, [1, 2]), "--metrics", "goals_per_1000_steps", "--out", curves]
        result = run(*arguments, PICTURA_PYTHON=self.python_without_matplotlib())
        self.assertEqual((result.returncode, result.stdout), (1, ""))
        self.assertIn("pip install 'pictura[plot]'", result.stderr)
        self.assertIn(f"its data is in {curves}.json", result.stderr)
        (panel,) = json.loads(pathlib.Path(f"{curves}.json").read_text())["panels"]
        self.assertEqual(panel["series"][0]["y"], [1, 2])
        result = run(*arguments, PICTURA_PYTHON=self.folder / "nowhere")
        self.assertEqual((result.returncode, "PICTURA_PYTHON gives its path" in result.stderr), (1, True), result.stderr)
        result = run(*arguments, PICTURA_PYTHON=self.python_as("echo broken >&2; exit 5"))
        self.assertEqual((result.returncode, result.stderr), (1, "error: broken\n"))
        result = run(*arguments, PICTURA_PYTHON=self.python_as("kill -9 $$"))
        self.assertEqual((result.returncode, "was ended by signal 9" in result.stderr), (1, True), result.stderr)
        self.assertFalse(curves.exists())

    def test_an_interrupt_ends_the_python_process(self):
        running = self.folder / "running"
        python = self.python_as(f"echo $$ > {running}; exec sleep 60")
        command = [PICTURA, "plot", self.run_folder("a", 1, [1]), "--out", self.folder / "curves.png"]
        process = subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True, env={**os.environ, "PICTURA_PYTHON": str(python)})
        deadline = time.monotonic() + 60
        while not (running.exists() and running.read_text()) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, message = process.communicate(timeout=30)
        self.assertEqual((process.returncode, message), (130, "error: interrupted while a chart was drawn\n"))
        with self.assertRaises(ProcessLookupError):
            os.kill(int(running.read_text()), 0)


if __name__ == "__main__":
    unittest.main()
