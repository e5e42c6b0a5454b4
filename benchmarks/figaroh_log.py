"""The published TX40 log through FIGAROH, in the interpreter of an environment that has it.

Runs FIGAROH's own pipeline (filter, differences, regressor, decimation by ten, base parameters by QR,
weighted least squares) with the settings that it ships for this arm; no plots, no files. Prints one JSON
object: times from log to results, relative torque error, peak memory. ``benchmarks/speed_on_log.py``
calls it.

    FIGAROH_PYTHON benchmarks/figaroh_log.py DATA/tx40
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import sys
import tempfile
import time
from pathlib import Path

BEGIN = time.perf_counter()

import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from figaroh.identification.base_identification import BaseIdentification  # noqa: E402
from figaroh.tools.robot import load_robot  # noqa: E402

RATE = 5000.0
RATIOS = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
EDGE = 20
"""Samples that FIGAROH's example drops at both ends: five per order of the filter."""

CONFIGURATION = """
robot:
  name: tx40
  properties:
    joints:
      active_joints: [joint_1, joint_2, joint_3, joint_4, joint_5, joint_6]
      joint_limits:
        position: [-3.1, 3.1, -2.2, 2.2, -2.4, 2.4, -4.7, 4.7, -2.1, 2.3, -4.7, 4.7]
        velocity: [5.0, 5.0, 7.5, 7.1, 5.5, 12.2]
        acceleration: [20, 20, 20, 20, 20, 20]
        torque: [131, 131, 103, 46, 43, 30]
    mechanics:
      reduction_ratios: [32.0, 32.0, 45.0, -48.0, 45.0, 32.0]
      ratio_essential: 30.0
      friction_coefficients:
        viscous: [8.05, 5.53, 1.97, 1.11, 1.86, 0.65]
        static: [7.14, 8.26, 6.34, 2.48, 3.03, 0.282]
      actuator_inertias: [0.362, 0.362, 0.0988, 0.0313, 0.0468, 0.0105]
      joint_offsets: [0.392, 1.37, 0.326, -0.102, -0.0288, 0.127]
    coupling: {has_coupled_wrist: true, Iam6: 0.00964, fvm6: 0.616, fsm6: 1.95}
tasks:
  identification:
    enabled: true
    problem:
      include_external_forces: false
      use_joint_torques: true
      model_components:
        friction: true
        joint_offset: true
        actuator_inertia: true
        static_regressor: true
        inertia_regressor: true
    signal_processing:
      sampling_frequency: 5000.0
      cutoff_frequency: 100.0
      filter_type: butterworth
      filter_order: 4
"""


class Log(BaseIdentification):
    """FIGAROH's identification of the log's arm."""

    def __init__(self, robot: object, configuration: str, folder: Path) -> None:
        super().__init__(robot, configuration)
        self.folder = folder
        model = self.robot.model
        joints = [model.joints[model.getJointId(f"joint_{k}")] for k in range(1, 7)]
        self.identif_config["active_joints"] = [f"joint_{k}" for k in range(1, 7)]
        self.identif_config["act_idxq"] = [joint.idx_q for joint in joints]
        self.identif_config["act_idxv"] = [joint.idx_v for joint in joints]
        self.filter_config = {
            "differentiation_method": "gradient",
            "filter_params": {"nbutter": 4, "f_butter": 100.0, "f_sample": RATE},
        }

    def load_trajectory_data(self, data_source: str | None = None) -> dict[str, object]:
        """Joint positions and torques of the log's motor quantities."""
        motor = pd.read_csv(self.folder / "pos_read_data.csv").to_numpy()
        torque = pd.read_csv(self.folder / "curr_data.csv").to_numpy()
        drives = np.diag(RATIOS)
        drives[5, 4] = RATIOS[5]
        position = np.linalg.solve(drives, motor.T).T + np.array([0, -np.pi / 2, np.pi / 2, 0, 0, 0])
        joint_torque = torque * RATIOS
        joint_torque[:, 4] += RATIOS[5] * torque[:, 5]
        samples = len(position)
        return {
            "timestamps": (np.arange(samples) / RATE)[:, np.newaxis],
            "positions": position,
            "velocities": None,
            "accelerations": None,
            "torques": joint_torque,
        }

    def process_torque_data(self, **_: object) -> np.ndarray:
        """The torques, and the motion with them, without the filter's edges."""
        for key in ("timestamps", "positions", "velocities", "accelerations"):
            self.processed_data[key] = self.processed_data[key][EDGE:-EDGE]
        return self.raw_data["torques"][EDGE:-EDGE]


def without_meshes(urdf: str) -> str:
    """The description without shapes, whose files are not with it."""
    return re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf, flags=re.DOTALL)


def peak_memory() -> float:
    """VmHWM of this process, MiB."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def main() -> None:
    """Identify and print."""
    folder = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as scratch, contextlib.redirect_stdout(io.StringIO()):
        configuration = Path(scratch) / "tx40.yaml"
        configuration.write_text(CONFIGURATION, encoding="utf-8")
        urdf = Path(scratch) / "tx40.urdf"
        urdf.write_text(
            without_meshes((folder / "tx40_mdh_modified.urdf").read_text(encoding="utf-8")), "utf-8"
        )
        robot = load_robot(str(urdf))
        imported, worked = time.perf_counter(), time.process_time()
        identification = Log(robot, str(configuration), folder)
        identification.initialize()
        identification.solve(decimate=True, plotting=False, save_results=False, wls=True)
        done, worked = time.perf_counter(), time.process_time() - worked
    residual = identification.tau_noised - identification.tau_identif
    print(
        json.dumps(
            {
                "seconds": done - imported,
                "processor_seconds": worked,
                "seconds_with_imports": done - BEGIN,
                "processor_seconds_with_imports": time.process_time(),
                "parameters": len(identification.phi_base),
                "relative_error_percent": float(
                    100 * np.linalg.norm(residual) / np.linalg.norm(identification.tau_noised)
                ),
                "peak_mib": peak_memory(),
            }
        )
    )


if __name__ == "__main__":
    main()
