"""The commands of README, the tutorials and the how-to pages, run as a reader would, in one folder and one after the other;
with fewer updates, steps and agents.

Run by ctest: python3 tutorials_test.py PICTURA.
"""

import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

from documents_test import command_lines
from pages import ROOT

PICTURA = ""
PAGES = [ROOT / "README.md"] + [ROOT / f"docs/tutorials/{name}.md" for name in ("first_run", "gpu", "reward", "rig", "map", "look", "probe", "scenes")]
PAGES += [ROOT / f"docs/how-to/{name}.md" for name in ("train", "evaluate", "probe", "own_map", "own_reward", "own_rig", "record_and_replay")]
# Maximum values of options that take long.
AT_MOST = {"--steps": 20, "--agents": 8, "--scenarios": 2, "--episodes": 1, "--follow": 3, "--egos": 8, "--slots": 32, "--removals": 20, "--paths": 1}
# Live pages wait for a browser; tests/replay/live_test.py tests them.
WAITS = "--serve"


def shorter(line):
    words = shlex.split(line, comments=True)
    has_trunk = "--init-trunk-from" in words  # policies in models/ have other widths than smoke.toml
    for i, word in enumerate(words[:-1]):
        takes_over = words[:2] == ["probe", "corner"] and word == "--steps"  # for 80 steps
        if word in AT_MOST and words[i + 1].isdigit() and not takes_over:  # --scenarios 0:4 is not a number
            words[i + 1] = str(min(int(words[i + 1]), AT_MOST[word]))
        if word == "--config" and not has_trunk:
            words[i + 1] = "configs/smoke.toml"
        if word == "--backend":
            words[i + 1] = "cpu"
    # The format fixes the length of rollouts.
    if words[0] in ("evaluate", "replay") and not {"--steps", "--rollouts", "--merge"} & set(words):
        words += ["--steps", str(AT_MOST["--steps"])]
    if words[0] == "train":
        words += ["--set", "train.updates=1", "--set", "simulator.num_slots=8"]
        words += [] if "--resume" in words else ["--overwrite"]
        words += ["--set", 'simulator.maps=["procedural"]', "--set", "train.num_steps=6"] if has_trunk else []
    if words[0] == "bench":
        words += ["--repeats", "1", "--repeat-seconds", "0.1"] if words[1] in ("render", "simulate") else []
    if words[0] == "probe":  # whose first states are those of step --every
        words += ["--every", "5"]
    return words


class Tutorials(unittest.TestCase):
    def test_every_tutorial_command_runs(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        for name in ("configs", "models"):
            (folder / name).symlink_to(ROOT / name)
        subprocess.run([PICTURA, "town", "--seed", "7", "--blocks", "2x2", "--out", folder / "mytown.xodr"], check=True, capture_output=True)
        # Places recorded scenes where the pages expect them.
        for name in ("validation", "womd", "gpudrive", "pufferdrive"):
            (folder / name).mkdir()
            drive = [PICTURA, "simulate", folder / "mytown.xodr", "--agents", "6", "--parked", "2", "--steps", "30", "--policy", "lane"]
            subprocess.run([*drive, "--scene", folder / name / "drive.scenario"], check=True, capture_output=True)
        count, written = 0, set()
        for page in PAGES:
            text = page.read_text()
            for block in re.findall(r"`(\w+\.toml)`.*?^```toml\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
                (folder / block[0]).write_text(block[1])
            for line in command_lines(text):
                words = shorter(line)
                if WAITS in words or ("--video" in words and shutil.which("ffmpeg") is None):
                    continue
                with self.subTest(f"{page.relative_to(ROOT)}: pictura {line}"):
                    result = subprocess.run([PICTURA, *words], cwd=folder, capture_output=True, text=True, timeout=300)
                    self.assertEqual(result.returncode, 0, f"pictura {shlex.join(words)}\n{result.stderr}")
                    outputs = [words[i + 1] for i, word in enumerate(words[:-1]) if word in ("--out", "--png", "--svg", "--gallery", "--replay", "--csv")]
                    for output in outputs:
                        self.assertTrue((folder / output).exists(), f"pictura {shlex.join(words)} wrote no {output}")
                        written.add(output)
                    count += 1
        self.assertGreater(count, 20)
        self.assertGreater(len(written), 10)


if __name__ == "__main__":
    PICTURA = sys.argv.pop(1)
    unittest.main()
