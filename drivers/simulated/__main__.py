"""``python -m drivers.simulated``: the process that :class:`drivers.simulated.SimulatedArm` starts."""

import sys

from drivers.simulated.process import main

if __name__ == "__main__":
    sys.exit(main())
