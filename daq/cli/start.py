"""Where the command begins: are our packages ours? Their names are plain words, and others have some of them.

Nothing of ours, and nothing but the standard library, is imported before that is known.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

PACKAGES = ("robots", "drivers", "trajectories", "ident")


def main() -> None:
    """Run the command line, or say in one line which package is in the way."""
    home = Path(__file__).resolve().parents[2]
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        origin = None if spec is None or spec.origin is None else Path(spec.origin).resolve()
        if origin is None or not origin.is_relative_to(home):
            sys.stderr.write(
                f"armhil: another package is in the way: {name} from {origin or 'nowhere'} is not armhil's"
                f" ({home / name}); leave that folder, take it off PYTHONPATH, or give armhil an environment"
                " of its own: python3 -m venv armhil-env && armhil-env/bin/python -m pip install armhil\n"
            )
            sys.exit(2)
    from daq.cli.entry import main as run

    run()
