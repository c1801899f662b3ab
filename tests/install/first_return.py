"""Installs the Python package into a fresh environment and trains examples/ppo.py there until the return has risen.

    first_return.py WHEEL           by pip, with the extra `train`, as a new user would; pip finds the torch of this Python
    first_return.py --build FOLDER  from a build, without pip

--torch REQUIREMENT also installs torch by pip, in place of the torch of this Python. Prints the seconds of each part,
and exits with 1 if the return did not rise or all of it took longer than --limit-s.
"""

import argparse
import csv
import os
import pathlib
import shutil
import site
import subprocess
import sys
import tempfile
import time
import venv

ROOT = pathlib.Path(__file__).resolve().parents[2]
RISE = 0.5  # Minimum rise of the mean return; updates differ by 0.2.


def run(*words: object, **options: object) -> None:
    subprocess.run([str(word) for word in words], check=True, **options)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("wheel", nargs="?", type=pathlib.Path)
    what.add_argument("--build", type=pathlib.Path, help="build folder of CMake")
    parser.add_argument("--torch", metavar="REQUIREMENT", help="for example torch==2.11.0+cpu")
    parser.add_argument("--timesteps", type=int, default=22_000, help="of ppo.py's slots")
    parser.add_argument("--limit-s", type=float, default=300)
    arguments = parser.parse_args()

    start, parts = time.monotonic(), {}
    with tempfile.TemporaryDirectory(prefix="pictura-install-") as name:
        folder = pathlib.Path(name)
        python = folder / "env/bin/python"
        venv.create(folder / "env", with_pip=arguments.build is None)
        packages = next(folder.glob("env/lib/python*/site-packages"))
        if not arguments.torch:
            # Found after the environment's own packages.
            folders = [*filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep)), *site.getsitepackages()]
            (packages / "packages_of_this_python.pth").write_text("\n".join(folders) + "\n")
        parts["environment"] = time.monotonic() - start
        if arguments.build:
            shutil.copytree(ROOT / "bindings/pictura", packages / "pictura", ignore=shutil.ignore_patterns("__pycache__"))
            run("cmake", "--install", arguments.build, "--component", "python", "--prefix", packages, stdout=subprocess.DEVNULL)
        else:
            wheel = f"{arguments.wheel.resolve()}[train]"
            run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *filter(None, [arguments.torch]), wheel)
        parts["install"] = time.monotonic() - start - sum(parts.values())

        # No variable leads to another build of the package.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        where = subprocess.run(
            [python, "-c", "import pictura; print(pictura.__file__)"], cwd=folder, env=environment, capture_output=True, text=True, check=True
        ).stdout.strip()
        if not where.startswith(str(packages)):
            sys.exit(f"error: first_return: expected pictura in {packages}, got {where}")
        parts["first import"] = time.monotonic() - start - sum(parts.values())
        ppo = (ROOT / "examples/ppo.py", "--preset", "demo", "--total-timesteps", arguments.timesteps, "--out", folder / "ppo")
        run(python, *ppo, cwd=folder, env=environment)
        parts["training"] = time.monotonic() - start - sum(parts.values())
        with (folder / "ppo/progress.csv").open() as file:
            returns = [float(row["charts/episode_return"]) for row in csv.DictReader(file)]

    total = sum(parts.values())  # without the removal of the environment
    seconds = ", ".join(f"{part} {value:.0f}" for part, value in parts.items())
    print(f"return {returns[0]:.2f} in the first update, {returns[-1]:.2f} in the last, minimum {min(returns):.2f}")
    print(f"{total:.0f} s: {seconds}")
    if returns[-1] < min(returns) + RISE:
        sys.exit(f"error: first_return: expected a return of {min(returns) + RISE:.2f} or more, got {returns[-1]:.2f}")
    if total > arguments.limit_s:
        sys.exit(f"error: first_return: expected at most {arguments.limit_s:.0f} s, got {total:.0f} s")


if __name__ == "__main__":
    main()
