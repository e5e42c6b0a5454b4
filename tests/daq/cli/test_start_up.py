"""Help and refusals import nothing that takes long: what they cost is what they import.

Measured on one core of a shared machine: help 0.23 s, a refusal 0.25 s, one that asks the catalogue 0.6 s.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

REFUSED = (
    "--nosuch",
    "identify --nosuch",
    "identify none.mcap",
    "identify --model none.toml pyproject.toml",
    "diagnose",
    "diagnose none.mcap",
    "diagnose --live none",
    "check",
    "check none",
    "check tx40 --cell none.toml",
    "check tx40 --simulated --scenario none.toml",
    "check --all --fleet none.toml",
    "check tx40 --noise-seed 1",
    "plan tx40 --cell none.toml",
    "plan tx40 --check none.csv",
    "run tx40 none.json",
    "commission tx40 --trajectory none.json",
    "home none",
    "jog none 1 1",
    "doctor none",
    "sim tx40 --scenario none.toml",
    "import none.csv --robot tx40",
    "export none.mcap",
    "recover none.mcap",
    "gain none.mcap --robot tx40",
    "demo none",
)
ASK_THE_CATALOGUE = (
    "show 9",
    "note 9 x",
    "compare 8 9",
    "rerun 9",
    "runs --arm none",
    "baseline show none",
    "baseline accept 9 --reason x",
)

_PROGRAM = """
import json, sys
from daq.cli.entry import main
calls, heavy = json.loads(sys.argv[1])
for call in calls:
    sys.argv = ["armhil", *call.split()]
    try:
        main()
    except SystemExit as end:
        print("ended", call, end.code, *sorted(name for name in heavy if name in sys.modules), sep=";")
"""


def _imported(calls: tuple[str, ...], heavy: tuple[str, ...], folder: Path) -> list[str]:
    """``ended;call;exit code;what it imported of these`` for each call, all in one process."""
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, json.dumps((calls, heavy))],
        env=os.environ | {"ARMHIL_CATALOGUE": str(folder / "catalogue.db")},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return [line for line in done.stdout.splitlines() if line.startswith("ended;")]


def test_help_and_refusals_import_no_numerics(tmp_path: Path) -> None:
    heavy = ("can", "fastapi", "jinja2", "numba", "numpy", "pinocchio", "scipy", "sqlalchemy")
    ended = _imported(("--help", *REFUSED), heavy, tmp_path)
    assert ended == ["ended;--help;0", *(f"ended;{call};2" for call in REFUSED)]


def test_a_refusal_out_of_the_catalogue_imports_nothing_of_the_identification(tmp_path: Path) -> None:
    heavy = ("fastapi", "jinja2", "joblib", "numba", "pinocchio", "scipy")
    ended = _imported(ASK_THE_CATALOGUE, heavy, tmp_path)
    assert ended == [f"ended;{call};2" for call in ASK_THE_CATALOGUE]


def test_reading_and_identifying_a_log_load_no_compiler_and_no_scipy() -> None:
    """The names of all effects are asked for where a model has found ones; a log alone has none. SciPy's
    linear algebra would take as long to load as a log takes to be read and filtered.
    """
    program = (
        "import sys; from daq.importing.load import load_log; from ident import identify; print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120
    )
    loaded = done.stdout.split()
    assert "ident.identification.identify" in loaded
    assert not {"numba", "ident.effects.vocabulary", "scipy"} & set(loaded)


def test_a_log_and_its_urdf_are_identified_without_bus_database_compiler_and_plots(
    tmp_path: Path, repository: Path
) -> None:
    """Imported where a capture, a found effect or a report needs them: 140 MiB and 1.3 s less for a log."""
    time = 0.002 * np.arange(10_000)
    position = 0.1 * np.sin(2.0 * time) + 0.05 * np.sin(9.0 * time)
    speed = np.gradient(position, time)
    torque = 100.0 * np.gradient(speed, time) + 200.0 * speed + 20.0 * np.tanh(speed / 0.01)
    torque += np.random.default_rng(1).standard_normal(time.size)
    np.savez(tmp_path / "log.npz", t=time, q=position, tau=torque)
    heavy = ("can", "jinja2", "matplotlib", "mcap", "numba", "scipy.signal", "scipy.stats", "sqlalchemy")
    call = f"identify {tmp_path / 'log.npz'} --urdf {repository / 'robots' / 'emps' / 'emps.urdf'}"
    ended = _imported((call,), heavy, tmp_path)
    assert [line.split(";", 2)[2] for line in ended] in (["0"], ["1"])
