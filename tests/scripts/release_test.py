"""Workflows and images: their schema, the scripts and packages that they name, and the lints that are installed.

Run by ctest: python3 release_test.py [unittest arguments].
"""

import importlib.util
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
DOCKERFILES = [*sorted((ROOT / "docker").glob("*.Dockerfile")), ROOT / ".devcontainer/Dockerfile"]


def run(*words):
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120, cwd=ROOT)
    return result.returncode, result.stdout + result.stderr


class Workflows(unittest.TestCase):
    def test_follow_the_published_schema(self):
        if importlib.util.find_spec("check_jsonschema") is None:
            self.skipTest("needs check-jsonschema, which scripts/setup installs")
        check = (sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.github-workflows")
        self.assertEqual(run(*check, *WORKFLOWS)[0], 0, run(*check, *WORKFLOWS)[1])
        with tempfile.TemporaryDirectory() as folder:
            broken = pathlib.Path(folder) / "broken.yml"
            broken.write_text(WORKFLOWS[0].read_text().replace("runs-on:", "run-on:"))
            self.assertEqual(run(*check, broken)[0], 1)

    def test_pass_actionlint(self):
        if shutil.which("actionlint") is None:
            self.skipTest("needs actionlint")
        self.assertEqual(run("actionlint", *WORKFLOWS), (0, ""))

    def test_run_existing_scripts(self):
        named = set()
        for path in WORKFLOWS:
            for command in re.findall(r"run: (.*)", path.read_text()):
                named |= set(re.findall(r"\bscripts/\w+", command))
        self.assertEqual(named, {"scripts/demo", "scripts/docs", "scripts/test"})
        for name in named:
            self.assertTrue((ROOT / name).is_file(), name)

    def test_run_on_pull_requests_and_tags(self):
        triggers = {path.stem: path.read_text().split("\njobs:")[0] for path in WORKFLOWS}
        self.assertEqual({name for name, text in triggers.items() if "pull_request:" in text}, {"build", "site"})
        self.assertIn("tags:", triggers["wheels"])


class Images(unittest.TestCase):
    def test_pass_hadolint(self):
        if shutil.which("hadolint") is None:
            self.skipTest("needs hadolint")
        self.assertEqual(run("hadolint", *DOCKERFILES), (0, ""))

    def test_install_the_packages_of_scripts_setup(self):
        listed = re.search(r"--no-install-recommends \\\n(.*?)>/dev/null", (ROOT / "docker/build_wheel").read_text(), re.DOTALL)[1]
        packages = set(listed.replace("\\", "").split())
        self.assertGreater(len(packages), 10)
        setup = re.search(r"^packages=\((.*?)^\)", (ROOT / "scripts/setup").read_text(), re.DOTALL | re.MULTILINE)[1]
        self.assertLessEqual(packages, set(setup.split()))

    def test_build_commands_match_their_page(self):
        builds = re.findall(r"docker build -f (\S+) (.*) \.$", (ROOT / "docs/how-to/docker.md").read_text(), re.MULTILINE)
        self.assertEqual({file for file, _ in builds}, {"docker/cpu.Dockerfile", "docker/gpu.Dockerfile"})
        for file, options in builds:
            arguments = re.findall(r"^ARG (\w+)", (ROOT / file).read_text(), re.MULTILINE)
            for name in re.findall(r"--build-arg (\w+)=", options):
                self.assertIn(name, arguments)

    def test_use_existing_scripts_and_paths(self):
        for path in DOCKERFILES:
            text = path.read_text()
            for script in re.findall(r"^RUN /src/(\S+)", text, re.MULTILINE):
                self.assertEqual(run(ROOT / script, "--help")[0], 0)
                self.assertEqual(run(ROOT / script, "--no-such-option")[0], 2)
            self.assertRegex(text, r"(?m)^FROM ")
        container = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text())
        self.assertTrue((ROOT / ".devcontainer" / container["build"]["dockerfile"]).is_file())
        self.assertTrue((ROOT / container["postCreateCommand"]).is_file())


if __name__ == "__main__":
    unittest.main()
