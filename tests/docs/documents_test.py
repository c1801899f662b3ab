"""Comparison of the documents with the program: the reference of commands, examples, keys, and completion.

Run by ctest: python3 documents_test.py PICTURA [unittest arguments].
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import commands
from pages import ROOT, documents

PICTURA = ""


def command_lines(text):
    """Returns pictura commands in a page's code blocks, without continuation lines."""
    blocks = re.findall(r"^```(?:sh|bash|console)?\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    blocks += re.findall(r"(?:^    .*\n)+", text, re.MULTILINE)
    for block in blocks:
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(r"&&|\||;|<\(", line):
                match = re.match(r"\s*(?:[A-Z_]+=\S+ )*(?:torchrun .*?--no-python )?(?:docker run .*? )?(?:\S*/)?pictura(?:-gpu|-train)? ((?!.*\.\.\.).*)", part)
                if match:
                    yield match.group(1).split(" # ")[0].split(" > ")[0].rstrip(" )")


class Documents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.helps = dict(commands.tree(PICTURA))
        cls.missing = commands.commands_of_pages() - cls.helps.keys()  # a build without torch, or without benches, lacks commands
        cls.is_whole = ("train",) not in cls.missing and ("bench", "render") not in cls.missing

    def options(self, command):
        return set(re.findall(r"(?<![\w-])(--?[a-z][\w-]*)", self.helps[command].split("Examples:")[0]))

    def check_command(self, line):
        words = shlex.split(line, comments=True)
        command = ()
        while words and (*command, words[0]) in self.helps:
            command = (*command, words.pop(0))
        if not self.is_whole and (*command, *words[:1]) in self.missing:
            return
        if not command and words and not words[0].startswith("-"):
            self.fail(f"pictura {line}: no such command")
        for word in words:
            if word.startswith("--"):
                self.assertIn(word.split("=")[0], self.options(command) | {"--help", "--version"}, f"pictura {line}")

    def test_the_command_reference_matches_help(self):
        if not self.is_whole:
            self.skipTest("this build lacks commands")
        # Later versions of CLI11 format options differently: `[0]` instead of `=0`.
        version = os.environ["CLI11_VERSION"]
        if [int(part) for part in version.split(".")[:2]] != commands.CLI11:
            self.skipTest(f"the pages are as CLI11 {commands.CLI11} lays help out, this build has {version}")
        found = commands.differences(commands.pages_of(self.helps.items()))
        self.assertEqual(found, [], "run scripts/docs --update\n" + "".join(found))

    def test_every_command_has_three_examples_of_existing_names(self):
        for command, text in self.helps.items():
            with self.subTest(" ".join(command)):
                examples = [line for line in text.splitlines() if re.match(r"  (.* )?(\w+=\S+ )?\S*pictura |  source <\(pictura ", line)]
                self.assertGreaterEqual(len(examples), 3)
                for example in examples:
                    for line in command_lines("    " + example.strip() + "\n"):
                        self.check_command(line)

    def test_commands_in_documents_exist(self):
        count = 0
        for path in documents():
            if path.name == "CHANGELOG.md" or path.parent.name == "changelog":
                continue
            for line in command_lines(path.read_text()):
                with self.subTest(f"{path.relative_to(ROOT)}: {line}"):
                    self.check_command(line)
                count += 1
        self.assertGreater(count, 40)

    def test_keys_in_documents_exist(self):
        known = set(re.findall(r"^\| `([\w.]+)`", (ROOT / "docs/reference/configuration.md").read_text(), re.MULTILINE))
        count = 0
        for path in documents():
            if path.name == "CHANGELOG.md" or path.parent.name == "changelog":
                continue
            for key in re.findall(r"--set '?([a-z_.]+)=", path.read_text()):
                with self.subTest(f"{path.relative_to(ROOT)}: {key}"):
                    self.assertIn(key, known)
                count += 1
        self.assertGreater(count, 10)


class Completion(unittest.TestCase):
    def script(self, shell):
        return subprocess.run([PICTURA, "completion", shell], capture_output=True, text=True, check=True, timeout=60).stdout

    def bash(self, *words):
        script = self.script("bash") + f'COMP_WORDS=({" ".join(map(shlex.quote, words))}); COMP_CWORD={len(words) - 1}; _pictura; printf "%s\\n" "${{COMPREPLY[@]}}"'
        return subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True, check=True, timeout=60).stdout.split()

    def test_bash_completes_commands_and_options(self):
        self.assertEqual(self.bash("pictura", "sim"), ["simulate"])
        self.assertEqual(self.bash("pictura", "simulate", "Town01", "--serve-"), ["--serve-host"])
        self.assertEqual(self.bash("pictura", "replay", "--gal"), ["--gallery"])
        self.assertEqual(self.bash("pictura", "completion", ""), [])  # files
        self.assertIn("town", self.bash("pictura", ""))

    def test_bash_completes_values(self):
        self.assertEqual(self.bash("pictura", "simulate", "Town0"), [f"Town0{i}" for i in range(1, 8)])
        self.assertEqual(self.bash("pictura", "simulate", "Town01", "--policy", "idm_"), ["idm_lanes"])
        self.assertEqual(self.bash("pictura", "bench", "render", "--format", "f"), ["f16", "f32"])
        if self.bash("pictura", "train"):  # with torch
            self.assertEqual(self.bash("pictura", "train", "--set", "train.gae"), ["train.gae_lambda="])
            self.assertEqual(self.bash("pictura", "evaluate", "--map", "city"), ["city:1"])

    def test_zsh_and_fish_accept_their_scripts(self):
        shells = [shell for shell in ("zsh", "fish") if shutil.which(shell)]
        if not shells:
            self.skipTest("needs zsh or fish")
        for shell in shells:
            with self.subTest(shell), tempfile.NamedTemporaryFile("w", suffix=f".{shell}") as file:
                file.write(self.script(shell))
                file.flush()
                result = subprocess.run([shell, "-n", file.name], capture_output=True, text=True, timeout=60)
                self.assertEqual((result.returncode, result.stderr), (0, ""))
        if "fish" in shells:
            home = {**os.environ, "HOME": tempfile.gettempdir()}
            script = self.script("fish") + "complete -C 'pictura simulate --serve-'\n"
            result = subprocess.run(["fish", "--no-config", "-c", script], capture_output=True, text=True, timeout=60, env=home)
            self.assertEqual(result.stdout.split("\t")[0], "--serve-host")

    def test_another_shell_is_refused(self):
        result = subprocess.run([PICTURA, "completion", "fisch"], capture_output=True, text=True, timeout=60)
        self.assertEqual((result.returncode, result.stderr), (2, "error: completion: expected bash, zsh or fish, got 'fisch'; did you mean 'fish'?\n"))


if __name__ == "__main__":
    PICTURA = sys.argv.pop(1)
    unittest.main()
