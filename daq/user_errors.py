"""Which exceptions a user can cause; imported only once there is an exception to compare with."""

from __future__ import annotations


def interruptions() -> tuple[type[Exception], ...]:
    """A stop on request. Imported only once there is an exception to compare with."""
    from daq.session.session_error import RunInterrupted

    return (RunInterrupted,)


def user_errors() -> tuple[type[Exception], ...]:
    """What a user can cause; each says in one line what is wrong and what is allowed."""
    from daq.catalogue.values import CatalogueError
    from daq.check.fleet import FleetFileError
    from daq.check.request import CheckError
    from daq.diagnosis.live import MotionRefused
    from daq.files.cell_file import CellFileError
    from daq.files.model_file import ModelFileError
    from daq.files.payload_file import PayloadFileError
    from daq.files.run_folder import OutputError
    from daq.files.trajectory_file import TrajectoryFileError
    from daq.notify.settings import NotifyError
    from daq.recording.capture import CaptureError
    from daq.report.templates import ReportError
    from daq.schedule.units import ScheduleError
    from daq.service.settings import ServiceError
    from daq.session.session_error import NotMoved, RunFailed, SessionError
    from daq.testing import NoTests
    from drivers import BusError, DriveError
    from ident import IdentificationError
    from robots import RobotFileError
    from robots.payload import PayloadError
    from trajectories import PlanError, TrajectoryError

    return (
        BusError,
        CaptureError,
        CatalogueError,
        CellFileError,
        CheckError,
        DriveError,
        FleetFileError,
        IdentificationError,
        ModelFileError,
        MotionRefused,
        NoTests,
        NotifyError,
        NotMoved,
        OSError,
        OutputError,
        PayloadError,
        PayloadFileError,
        PlanError,
        ReportError,
        RobotFileError,
        RunFailed,
        ScheduleError,
        ServiceError,
        SessionError,
        TrajectoryError,
        TrajectoryFileError,
    )
