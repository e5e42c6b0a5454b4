"""How quickly the published TX40 log becomes results: armhil beside FIGAROH.

Both read the same files, filter, differentiate, build the regressor, decimate and solve weighted least
squares, each in a process of its own, on one thread, in turns: armhil with the settings that it ships for
such logs (50 Hz filter, 100 Hz rows), FIGAROH with its own (100 Hz filter, 500 Hz rows), and armhil with
those of FIGAROH. armhil besides judges the signals, finds the lag and fits the error model of its σ.
Times are from files to results, without and with imports; processor time beside the wall's, which a busy
machine stretches. Medians over the repetitions, with the smallest and the largest; a repetition before them
is not counted: Python keeps its compiled files of a clone then, as pip has made those of a package.

FIGAROH wants an environment of its own:

    python -m venv figaroh && figaroh/bin/pip install figaroh==1.0.2
    python benchmarks/speed_on_log.py DATA/tx40 --figaroh figaroh/bin/python
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

BEGIN = time.perf_counter()
HERE = Path(__file__).resolve().parent
KEYS = {
    "seconds": "wall, s",
    "processor_seconds": "processor, s",
    "seconds_with_imports": "wall with imports, s",
    "processor_seconds_with_imports": "processor with imports, s",
    "peak_mib": "peak memory, MiB",
    "relative_error_percent": "relative torque error, %",
}


def identify_log(folder: Path, like_figaroh: bool) -> dict[str, float]:
    """One identification of the log in this process, shipped settings or FIGAROH's."""
    import robots
    from daq.importing.load import load_recording
    from ident import identify

    imported, worked = time.perf_counter(), time.process_time()
    robot = robots.load("tx40")
    loaded = load_recording(folder, robot)
    settings = loaded.settings
    if like_figaroh:
        settings = settings.model_copy(update={"cutoff_hz": 100.0, "decimation": 10})
    robot = robot.model_copy(update={"identification": settings})
    result = identify(robot, loaded.recordings).result
    done, worked = time.perf_counter(), time.process_time() - worked
    return {
        "seconds": done - imported,
        "processor_seconds": worked,
        "seconds_with_imports": done - BEGIN,
        "processor_seconds_with_imports": time.process_time(),
        "parameters": len(result.least_squares.parameters),
        "relative_error_percent": result.least_squares.relative_error_percent,
        "peak_mib": peak_memory(),
    }


def peak_memory() -> float:
    """VmHWM of this process, MiB."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def run(command: list[str]) -> dict[str, float]:
    """What another process prints as JSON."""
    environment = os.environ | {"PYTHONPATH": str(HERE.parent), "PYTHONWARNINGS": "ignore"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    for library in ("OMP", "OPENBLAS", "MKL"):
        environment[f"{library}_NUM_THREADS"] = "1"
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Parse the command line; run both in turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path, help="of the published log")
    parser.add_argument("--figaroh", type=Path, help="Python of an environment with FIGAROH 1.0.2")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--once", choices=("shipped", "like"), help="identify in this process, print JSON")
    options = parser.parse_args()
    if options.once:
        print(json.dumps(identify_log(options.folder, options.once == "like")))
        return
    once = [sys.executable, str(Path(__file__).resolve()), str(options.folder), "--once"]
    commands = {"armhil": [*once, "shipped"], "armhil, FIGAROH's rows": [*once, "like"]}
    if options.figaroh is not None:
        commands["FIGAROH"] = [str(options.figaroh), str(HERE / "figaroh_log.py"), str(options.folder)]
    found: dict[str, list[dict[str, float]]] = {name: [] for name in commands}
    for repetition in range(options.repetitions + 1):
        for name, command in commands.items():
            result = run(command)
            if repetition:
                found[name].append(result)
    print(f"{options.repetitions} repetitions: median [smallest, largest]; × is FIGAROH's median over it")
    for key, label in KEYS.items():
        print(label)
        for name, entries in found.items():
            values = [entry[key] for entry in entries]
            ratio = ""
            if "FIGAROH" in found and name != "FIGAROH":
                ratio = f"   × {median([entry[key] for entry in found['FIGAROH']]) / median(values):.1f}"
            print(f"  {name:24s}{median(values):9.2f} [{min(values):.2f}, {max(values):.2f}]{ratio}")


if __name__ == "__main__":
    main()
