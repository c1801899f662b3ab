"""Writes docs/reference/commands/: one page per command with the output of `pictura COMMAND --help`, and an index.

    python3 tests/docs/commands.py PICTURA            writes the pages
    python3 tests/docs/commands.py PICTURA --check    prints differences from the pages, and exits with 1 if there are any
"""

import difflib
import re
import subprocess
import sys

from pages import ROOT

FOLDER = ROOT / "docs/reference/commands"
CLI11 = [2, 1]  # Debian 12's
HEAD = """# Commands
Each page below is what `pictura COMMAND --help` prints; a test compares them.

- **Help texts.** Defaults follow `=`, ranges follow `:`, and units are in the texts.
- **Output.** `--json` prints one object on stdout and nothing else. Logs go to stderr.
- **Exit status.** 0: success. 1: the work failed. 2: wrong usage. 130: interrupted by ^C. 143: ended by SIGTERM. 129: the terminal
  was closed. Interrupted commands save what is finished.
- **Typing errors.** An unknown command, option or key is refused with the nearest known one.
- **Completion.** `pictura completion bash`, `zsh` or `fish` prints a completion script.

| command | purpose |
|---|---|
"""
# Pages that explain a command's use.
SEE = {
    ("town",): "[Procedural towns](../../explanation/map.md#procedural-towns), [cities](../../explanation/cities.md)",
    ("map",): "[Use your own map](../../tutorials/map.md), [OpenDRIVE](../opendrive.md), [recorded scenes](../scenario.md)",
    ("render",): "[Scene files](../scene_file.md), [images](../../explanation/image.md)",
    ("simulate",): "[The simulator](../../explanation/simulator.md), [replays](../replay.md)",
    ("replay",): "[Look at an agent](../../tutorials/look.md), [replays](../replay.md)",
    ("train",): "[Train a policy](../../how-to/train.md), [configuration](../configuration.md), [the folder of a run](../run_folder.md)",
    ("evaluate",): "[Evaluate a policy](../../how-to/evaluate.md), [metrics and protocols](../../explanation/evaluation.md)",
    ("probe",): "[Probe an agent](../../how-to/probe.md), [what probes measure](../../explanation/probes.md)",
    ("export",): "[Export weights](../../how-to/train.md#export-weights)",
    ("plot",): "[Watch a run](../../how-to/train.md#watch-a-run), [columns](../run_folder.md#logged-scalars)",
    ("bench",): "[How benchmarks measure](../../developer/benchmarks.md)",
}


def help_of(pictura, command):
    result = subprocess.run([pictura, *command, "--help"], capture_output=True, text=True, timeout=60)
    if result.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} --help: {result.stderr}")
    return result.stdout.rstrip("\n")


def subcommands(text):
    section = re.search(r"^Subcommands:\n((?:  .*\n?)+)", text, re.MULTILINE)
    return re.findall(r"^  (\S+)", section.group(1), re.MULTILINE) if section else []


def tree(pictura, command=()):
    """Returns [(command, help)] of all commands, each before its subcommands."""
    text = help_of(pictura, command)
    found = [(command, text)]
    for name in subcommands(text):
        found += tree(pictura, (*command, name))
    return found


def of_whole_build(text):
    """Returns the help of a build with all backends, from the help of any build."""
    text = re.sub(r"(Backend of the simulator: )cpu.*?(; default)", r"\1cpu, cuda, auto\2", text)
    return re.sub(r"(Backend of the renderer: )cpu.*?(; default)", r"\1cpu, cuda, gl, gl:egl, gl:osmesa, null, auto\2", text)


def page_name(command):
    return "_".join(command or ("pictura",)) + ".md"


def pages_of(commands):
    """Returns {file name: text} of all pages."""
    made, rows = {}, []
    for command, text in commands:
        title = " ".join(("pictura", *command))
        purpose = text.split("\n", 1)[0].split(": ")[0]
        rows.append(f"| [`{title}`]({page_name(command)}) | {purpose} |\n")
        see = SEE.get(command) or SEE.get(command[:1])
        made[page_name(command)] = f"# {title}\n" + (f"See also: {see}.\n\n" if see else "") + f"```text\n{of_whole_build(text)}\n```\n"
    return {"index.md": HEAD + "".join(rows), **made}


def commands_of_pages():
    """Returns the commands that have a page."""
    titles = (path.read_text().split("\n", 1)[0] for path in FOLDER.glob("*.md") if path.name != "index.md")
    return {tuple(title.split()[2:]) for title in titles}


def differences(made):
    """Returns the lines of a unified diff from the existing pages to `made`."""
    there = {path.name: path.read_text() for path in FOLDER.glob("*.md")}
    lines = []
    for name in sorted(there.keys() | made.keys()):
        before, after = (pages.get(name, "").splitlines(True) for pages in (there, made))
        lines += difflib.unified_diff(before, after, f"docs/reference/commands/{name}", "pictura --help")
    return lines


def main():
    made = pages_of(tree(sys.argv[1]))
    if "--check" in sys.argv:
        found = differences(made)
        sys.stdout.writelines(found)
        return int(bool(found))
    FOLDER.mkdir(exist_ok=True)
    for path in FOLDER.glob("*.md"):
        if path.name not in made:
            path.unlink()
    for name, text in made.items():
        (FOLDER / name).write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
