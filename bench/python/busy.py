"""Measures how other busy processes slow down commands.

python bench/python/busy.py [--busy 0,1,2] [--rounds N] [--max-foreign SHARE] PICTURA... -- ARGUMENTS

In each round, every PICTURA (a command, or VARIABLE=VALUE,COMMAND) runs once with the ARGUMENTS. Prints the median times.
Discards times during which other processes used more than SHARE of the processors.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time

def processor_s() -> float:
    """Returns the busy time of all processors since the system started."""
    with open("/proc/stat") as file:
        user, nice, system, _, _, irq, softirq = map(int, file.readline().split()[1:8])
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def own_s() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def busy_s(processes) -> float:
    ticks = 0
    for process in processes:
        with open(f"/proc/{process.pid}/stat") as file:
            ticks += sum(map(int, file.read().rsplit(")", 1)[1].split()[11:13]))
    return ticks / os.sysconf("SC_CLK_TCK")


def run(command: str, arguments: list[str], folder: str, processes, max_foreign: float) -> float | None:
    """Returns the seconds, or None if other processes used more than max_foreign of the processors."""
    *variables, program = command.split(",")
    environment = os.environ | dict(variable.split("=", 1) for variable in variables)
    own, busy, all_, begin = own_s(), busy_s(processes), processor_s(), time.monotonic()
    subprocess.run([program, *(a.replace("{}", folder) for a in arguments)], env=environment, check=True, capture_output=True)
    seconds = time.monotonic() - begin
    foreign = processor_s() - all_ - (own_s() - own) - (busy_s(processes) - busy)
    return None if foreign > max_foreign * seconds * os.cpu_count() else seconds


def main() -> None:
    at = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    arguments = sys.argv[at + 1 :]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commands", nargs="+")
    parser.add_argument("--busy", default="0,1,2", help="numbers of busy processes, separated by commas")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--max-foreign", type=float, default=0.05, help="maximum share of the processors used by other processes in a round")
    args = parser.parse_args(sys.argv[1:at])
    for number in map(int, args.busy.split(",")):
        processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(number)]
        times = {command: [] for command in args.commands}
        left_out = 0
        try:
            for _ in range(args.rounds):
                for command in args.commands:
                    with tempfile.TemporaryDirectory() as folder:
                        seconds = run(command, arguments, folder, processes, args.max_foreign)
                    if seconds is None:
                        left_out += 1
                    else:
                        times[command].append(seconds)
        finally:
            for process in processes:
                process.kill()
                process.wait()
        for command, its in times.items():
            median = f"{statistics.median(its):.2f} s" if its else "-"
            print(f"{number} busy  {command}: {median} of {len(its)}" + (f" ({left_out} left out)" if left_out else ""), flush=True)


if __name__ == "__main__":
    main()
