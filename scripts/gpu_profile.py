#!/usr/bin/env python3
"""Prints metrics of Nsight Compute for the kernel launches of a command, as one JSON object.

gpu_profile.py [--skip N] [--launches N] -- COMMAND...   runs COMMAND under ncu
gpu_profile.py --csv FILE                                reads ncu's output: --csv --page details

Only kernels whose names begin with pictura_ count. After --skip launches, --launches launches are profiled. Profiled
kernels run one after the other at ncu's clock rate, so do not compare their durations with those of a bench.
Exit status: 0, or 1 with the reason if ncu is missing, fails or prints no metrics.
"""
import argparse
import csv
import io
import json
import pathlib
import subprocess
import sys
import tempfile

# Sections that contain the metrics.
SECTIONS = ("SpeedOfLight ComputeWorkloadAnalysis MemoryWorkloadAnalysis WarpStateStats InstructionStats LaunchStats "
            "Occupancy").split()
METRICS = ("Duration", "SM Frequency", "Executed Instructions", "Executed Ipc Active", "Issue Slots Busy",
           "Avg. Active Threads Per Warp", "Warp Cycles Per Issued Instruction", "Mem Busy", "L1/TEX Hit Rate",
           "L2 Hit Rate", "DRAM Throughput", "Registers Per Thread", "Achieved Occupancy")


def rows_of(table):
    """Returns rows in the format of the benches, one for each launch and metric."""
    lines = [line for line in table.splitlines() if line.startswith('"')]
    rows = []
    for line in csv.DictReader(io.StringIO("\n".join(lines))):
        if line["Metric Name"] in METRICS:
            rows.append({"name": f"{line['Kernel Name']}, {line['Metric Name']}",
                         "value": float(line["Metric Value"].replace(",", "")), "unit": line["Metric Unit"]})
    return rows


def profile(command, skip, launches):
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder) / "table.csv"
        ncu = ["ncu", "--csv", "--page", "details", "--log-file", str(table), "--kernel-name", "regex:^pictura_",
               "--launch-skip", str(skip), "--launch-count", str(launches)]
        for section in SECTIONS:
            ncu += ["--section", section]
        try:
            run = subprocess.run(ncu + command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        except OSError as error:
            sys.exit(f"error: gpu_profile: {error}")
        text = table.read_text() if table.exists() else ""
        if run.returncode != 0:
            sys.exit(f"error: gpu_profile: exit status {run.returncode}\n{run.stdout}{text}")
        return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--skip", type=int, default=0)
    parser.add_argument("--launches", type=int, default=1)
    parser.add_argument("--csv", type=pathlib.Path, metavar="FILE")
    parser.add_argument("command", nargs="*")
    arguments = parser.parse_args()
    if (arguments.csv is None) == (not arguments.command):
        parser.error("expected a command after --, or --csv FILE")
    text = arguments.csv.read_text() if arguments.csv else profile(arguments.command, arguments.skip, arguments.launches)
    rows = rows_of(text)
    if not rows:
        sys.exit(f"error: gpu_profile: expected metrics of kernels, got '{text[:200]}'")
    print(json.dumps({"workload": " ".join(arguments.command), "results": rows}))


if __name__ == "__main__":
    main()
