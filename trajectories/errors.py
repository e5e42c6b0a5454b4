"""What a request for a motion can break: one line that names the constraint, the joint and the time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from robots.errors import UserError


class TrajectoryError(UserError, ValueError):
    """A motion breaks a constraint, or a request for one cannot be met.

    The text is ``joint: what is broken at t = … s; allowed: …``.

    Attributes:
        constraint: what is broken, e.g. ``velocity`` or ``floor``.
        joint: name of the joint, or empty where it is not one joint's matter.
        time: where in the motion, s; None for a request that never became a motion.
    """

    def __init__(
        self, problem: str, *, constraint: str = "", joint: str = "", time: float | None = None
    ) -> None:
        self.constraint = constraint
        self.joint = joint
        self.time = time
        who = f"{joint}: " if joint else ""
        where = f" at t = {time:.3f} s" if time is not None else ""
        what, mark, rest = problem.partition("; allowed: ")
        super().__init__(f"{who}{what}{where}{mark}{rest}")


class PlanError(TrajectoryError):
    """No exciting trajectory meets the request."""

    @classmethod
    def of(cls, error: TrajectoryError) -> PlanError:
        """The same problem as the planner's."""
        plan_error = cls(str(error))
        plan_error.constraint, plan_error.joint, plan_error.time = error.constraint, error.joint, error.time
        return plan_error


@contextmanager
def as_plan_errors() -> Iterator[None]:
    """What breaks inside is the plan's problem."""
    try:
        yield
    except PlanError:
        raise
    except TrajectoryError as error:
        raise PlanError.of(error) from error
