#!/usr/bin/env python3
"""Runs the commands of scripts/gpu_check and keeps their results in one JSON file, which is rewritten after each.

gpu_check_record.py FILE start [--keep]                begins FILE with the source hash, GPU and driver; --keep: if
these
                                                       are unchanged, keeps FILE's results and its mark as complete
gpu_check_record.py FILE run NAME [--limit S] -- COMMAND...    keeps the command's duration, and its summary or last
lines gpu_check_record.py FILE bench NAME [--limit S] -- COMMAND...  keeps the JSON object that the command prints
gpu_check_record.py FILE tests -- ctest...             keeps counts, and failed, skipped and slowest tests
gpu_check_record.py FILE finish                        marks FILE as complete

Exit status: 0 if the command succeeded, else 1.
"""
import argparse
import contextlib
import hashlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

SOURCES = ("common map simulator backend_cpu backend_cuda backend_gl backends configuration policy evaluation training drawing replay driving cli apps bindings "
           "examples bench tests cmake").split()
RESULTS = pathlib.Path("bench/results")
LAST_LINES = 40
# Line of a test's result, such as "  7/353 Test  #12: Suite.Name/4-byte object <00> ....***Failed    0.01 sec".
TEST = re.compile(r"\s*(\d+)/(\d+) Test\s+#\d+: (.+?) \.*\s*(Passed|\*\*\*.*?)\s+(\d+\.\d+) sec")
NEXT_TEST = re.compile(r"\s+Start\s+\d+: ")
# Summary lines of GoogleTest and compute-sanitizer.
SUMMARY = re.compile(r"\[  PASSED  \]|=========.* SUMMARY: ")


def source_hash():
    """Returns a hash of the paths, lengths and bytes of all files except documents."""
    files = {path for folder in SOURCES for path in pathlib.Path(folder).rglob("*") if path.is_file()}
    digest = hashlib.sha256()
    for path in sorted(files | {pathlib.Path("CMakeLists.txt")}):
        if RESULTS not in path.parents and "__pycache__" not in path.parts and path.suffix != ".md":
            content = path.read_bytes()
            digest.update(f"{path.as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()[:16]


def gpu_and_driver():
    query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    try:
        answer = subprocess.run(query, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        return f"none: {error}", ""
    name, _, driver = answer.strip().splitlines()[0].partition(", ")
    return name, driver


def write(file, content):
    """Writes a temporary file and renames it, so that readers, and an interrupted run, always see a complete file."""
    temporary = file.with_name(f"{file.name}.{os.getpid()}.tmp")
    temporary.write_text(json.dumps(content, indent=2) + "\n")
    temporary.replace(file)


def read(file):
    return json.loads(file.read_text())


def start(file, keeps):
    gpu, driver = gpu_and_driver()
    head = {"source_hash": source_hash(), "gpu": gpu, "driver": driver}
    earlier = read(file) if keeps and file.exists() else {}
    if not head.items() <= earlier.items():
        earlier = {}
    write(file, {"complete": False} | earlier | head)


def finish(file):
    write(file, read(file) | {"complete": True})


def add(file, key, entry):
    content = read(file)
    content.setdefault(key, []).append(entry)
    write(file, content)


def kill_group(process):
    """Kills a command and its children."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


@contextlib.contextmanager
def started(command, stderr):
    """Starts a command in its own process group, which is killed with its children if the block ends early."""
    process = subprocess.Popen(command, text=True, errors="replace", process_group=0, stdout=subprocess.PIPE, stderr=stderr)
    try:
        yield process
    except BaseException:
        kill_group(process)
        raise


class Run:
    """Finished command: its outcome (a text, empty for success), its duration in seconds, and its output."""

    def __init__(self, command, limit_s, keeps_stdout):
        begin = time.monotonic()
        self.seconds, self.stdout, self.stderr = 0.0, "", ""
        try:
            with started(command, subprocess.PIPE if keeps_stdout else subprocess.STDOUT) as process:
                try:
                    self.stdout, self.stderr = process.communicate(timeout=limit_s)
                    self.outcome = "" if process.returncode == 0 else f"exit status {process.returncode}"
                except subprocess.TimeoutExpired:
                    kill_group(process)
                    self.stdout, self.stderr = process.communicate()
                    self.outcome = f"took more than {limit_s:g} s"
        except OSError as error:
            self.outcome = str(error)
            return
        self.seconds = round(time.monotonic() - begin, 1)

    def entry(self, name):
        return {"name": name, "seconds": self.seconds}

    def failure(self, name):
        return self.entry(name) | {"outcome": self.outcome, "last_lines": last_lines(self.stderr or self.stdout)}


def last_lines(text):
    """Returns the lines that name an error or a failed build target, and the last lines."""
    lines = text.splitlines()
    errors = [line for line in lines[:-LAST_LINES] if "error: " in line or line.startswith("FAILED: ")]
    return errors[:LAST_LINES] + lines[-LAST_LINES:]


def say(name, run):
    print(f"{name}: {run.outcome or 'done'}, {run.seconds} s", flush=True)
    if run.outcome:
        print("\n".join(last_lines(run.stderr or run.stdout)), flush=True)


def run_command(file, name, command, limit_s):
    run = Run(command, limit_s, keeps_stdout=False)
    say(name, run)
    if run.outcome:
        add(file, "failed", run.failure(name))
    else:
        summary = [line for line in run.stdout.splitlines() if SUMMARY.match(line)]
        add(file, "runs", run.entry(name) | ({"summary": summary} if summary else {}))
    return run.outcome == ""


def json_object(text):
    """Returns the parsed text if it is a JSON object, else None."""
    try:
        value = json.loads(text)
    except json.JSONDecodeError:
        return None
    return value if isinstance(value, dict) else None


def run_bench(file, name, command, limit_s):
    run = Run(command, limit_s, keeps_stdout=True)
    measured = json_object(run.stdout)
    if measured is None and not run.outcome:
        run.outcome = f"expected a JSON object, got '{run.stdout[:80]}'"
    say(name, run)
    if run.outcome:
        # A bench can print results and fail because of them. An example is the soak.
        add(file, "failed", run.failure(name) | ({} if measured is None else {"measured": measured}))
    else:
        add(file, "bench", run.entry(name) | measured)
    return run.outcome == ""


class Tests:
    """Results in the lines of ctest that were parsed so far."""

    def __init__(self):
        self.passed = self.total = 0
        self.failed, self.skipped, self.times = [], [], []
        self.output_of = None  # the failed test whose output the next lines contain

    def take(self, line):
        """Parses a line. Returns whether it is the result of a test."""
        match = TEST.match(line)
        if not match:
            if NEXT_TEST.match(line):
                self.output_of = None
            elif self.output_of is not None and line.strip():
                output = self.output_of["last_lines"]
                output.append(line.rstrip("\n"))
                del output[:-LAST_LINES]
            return False
        _, total, name, outcome, seconds = match.groups()
        self.total, self.output_of = int(total), None
        self.times.append({"name": name, "seconds": float(seconds)})
        if outcome == "Passed":
            self.passed += 1
        elif outcome.startswith(("***Skipped", "***Not Run (Disabled)")):
            self.skipped.append(name)
        else:
            self.output_of = self.times[-1] | {"outcome": outcome.strip("* "), "last_lines": []}
            self.failed.append(self.output_of)
        return True

    def summary(self, seconds):
        slowest = sorted(self.times, key=lambda test: -test["seconds"])[:20]
        return {"summary": f"{self.passed} passed, {len(self.failed)} failed, {len(self.skipped)} skipped of "
                           f"{self.total} tests",
                "seconds": round(seconds, 1), "failed": self.failed, "skipped": self.skipped, "slowest": slowest}


def run_tests(file, command):
    begin = time.monotonic()
    header, tests, written = read(file), Tests(), 0.0
    with started(command, subprocess.STDOUT) as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            if tests.take(line) and time.monotonic() - written > 1:
                written = time.monotonic()
                write(file, header | tests.summary(written - begin))
        status = process.wait()
    content = header | tests.summary(time.monotonic() - begin)
    if not tests.times or (status != 0 and not tests.failed):
        content["error"] = f"ctest: exit status {status}, {len(tests.times)} results"
    write(file, content)
    return status == 0 and "error" not in content


def end_with_command(*_):
    """Signal handler, which exits. The exit also kills the command."""
    sys.exit(1)


def main():
    signal.signal(signal.SIGTERM, end_with_command)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("verb", choices=["start", "run", "bench", "tests", "finish"])
    parser.add_argument("name", nargs="?")
    parser.add_argument("--limit", type=float, metavar="S")
    parser.add_argument("--keep", action="store_true")
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    arguments, command = parser.parse_args(words[:at]), words[at + 1:]
    if arguments.verb == "start":
        return start(arguments.file, arguments.keep)
    if arguments.verb == "finish":
        return finish(arguments.file)
    if arguments.verb == "tests":
        return not run_tests(arguments.file, command)
    run = run_bench if arguments.verb == "bench" else run_command
    return not run(arguments.file, arguments.name, command, arguments.limit)


if __name__ == "__main__":
    sys.exit(main())
