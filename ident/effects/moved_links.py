"""What links take more that move a little otherwise than was measured: behind a gear, or on a foot.

Links that lag behind their drive by x take τ(q − x) = τ(q) − A ẍ − C ẋ − K x, with the slopes of their torque
along that motion: of ways of some mrad that is all but 10⁻⁵ of it, and the slopes are those of every gear.
"""

from __future__ import annotations

from ident.effects.family import PresentModel
from ident.effects.state import State
from ident.effects.ways import Slopes
from robots.arrays import FloatArray


def slopes_of_links(present: PresentModel, state: State, drive: int, back: FloatArray) -> Slopes:
    """Of the links' joint torques along the motion (n,) of the joints by a drive; kept with the state."""

    def felt(way: float, rate: float, push: float) -> FloatArray:
        moved = state.moved(
            state.position + way * back, state.velocity + rate * back, state.acceleration + push * back
        )
        return present.link_torque(moved)

    return state.once(present, ("slopes", drive), lambda: Slopes.of(present.link_torque(state), felt))
