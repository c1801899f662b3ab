"""docs/reference/commands.md: the help of every command, as `pictura --help` prints it.

    python3 tests/docs/commands.py PICTURA            writes it
    python3 tests/docs/commands.py PICTURA --check    says where it differs
"""

import difflib
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/reference/commands.md"
CLI11 = [2, 1]  # Debian 12's
HEAD = """# Commands
What `pictura COMMAND --help` prints, written by `scripts/docs --update` and compared by a test. Defaults stand after `=`, ranges
after `:`; units stand in the texts. `--json` prints one object on stdout and nothing else, and logs go to stderr. Exit status: 0 done, 1
the work failed, 2 wrong usage, 130 after ^C and 143 after SIGTERM (what was finished is saved). An unknown command, option or key is
answered with the nearest known one.

`pictura completion bash`, `zsh` or `fish` prints a script by which a shell completes commands and options.
"""


def help_of(pictura, command):
    result = subprocess.run([pictura, *command, "--help"], capture_output=True, text=True, timeout=60)
    if result.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} --help: {result.stderr}")
    return result.stdout.rstrip("\n")


def subcommands(text):
    section = re.search(r"^Subcommands:\n((?:  .*\n?)+)", text, re.MULTILINE)
    return re.findall(r"^  (\S+)", section.group(1), re.MULTILINE) if section else []


def tree(pictura, command=()):
    """[(command, help)] of all commands, each before those below it."""
    text = help_of(pictura, command)
    found = [(command, text)]
    for name in subcommands(text):
        found += tree(pictura, (*command, name))
    return found


def of_whole_build(text):
    """What a build lacks is named all the same: the page is of all that there is."""
    text = re.sub(r"(What simulates: )cpu.*?(; default)", r"\1cpu, cuda, auto\2", text)
    return re.sub(r"(What draws: )cpu.*?(; default)", r"\1cpu, cuda, gl, gl:egl, gl:osmesa, null, auto\2", text)


def page(commands):
    parts = [HEAD]
    for command, text in commands:
        title = " ".join(("pictura", *command))
        parts.append(f"\n## {title}\n```text\n{of_whole_build(text)}\n```\n")
    return "".join(parts)


def main():
    made = page(tree(sys.argv[1]))
    if "--check" not in sys.argv:
        PAGE.write_text(made)
        return 0
    before = PAGE.read_text()
    sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), made.splitlines(True), "docs/reference/commands.md", "pictura --help"))
    return int(before != made)


if __name__ == "__main__":
    sys.exit(main())
