"""What is said before drives start that have to be compiled first."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SAYS = "from drivers.simulated import is_compiled; print(is_compiled())"


def test_an_empty_cache_is_seen(tmp_path: Path, repository: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    words = [sys.executable, "-c", SAYS]
    done = subprocess.run(
        words, cwd=repository, env=environment, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "False"


def test_code_that_is_kept_is_seen(tmp_path: Path, repository: Path) -> None:
    script = tmp_path / "half.py"
    script.write_text(
        "from drivers.simulated.physics.compile import entry, on_disk\n"
        "def half(x):\n    return x / 2\n"
        "kept = entry(half)\nprint(on_disk(kept))\nkept(1.0)\nprint(on_disk(kept))\n"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(repository)}
    done = subprocess.run(
        [sys.executable, str(script)], env=environment, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == ["False", "True"]
