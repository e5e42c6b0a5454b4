"""Up and down the state machine: all axes together, with a reason for every refusal."""

from __future__ import annotations

from drivers.cia402 import objects
from drivers.cia402.states import LEVEL, Goal, State, has_torque, refusal, state_of
from drivers.cyclic.answers import DOUBLES_FORGIVEN
from drivers.cyclic.cycle import Cycle

DISABLE_SECONDS = 1.0
BLIND_CYCLES = 5
"""How often the last "disable voltage" goes to drives that do not confirm."""
RETIRE_SECONDS = 0.5
"""For the drives to confirm that they watch the master no longer."""
RETIRE_TRIES = 5
_PRE_OPERATIONAL = 0x80

_NAMES = {
    Goal.READY: "shutdown",
    Goal.SWITCHED_ON: "switch on",
    Goal.OPERATION_ENABLED: "enable operation",
}


_HINTS = {
    0x200: "; its statusword says that it does not listen to the bus (bit 9, remote): a maker's tool, or a "
    "setting of the drive, has the command",
    0x10: "; its power stage has no voltage (statusword bit 4)",
}
"""By the statusword bit without which a drive may not go up."""


def first_answers(cycle: Cycle) -> bool:
    """SYNCs alone, until each drive has answered one and shown its heartbeat.

    Nothing is sent to the drives before their positions are known, except the master's heartbeats.
    """
    job, seen, watch = cycle.job, cycle.exchange, cycle.watch
    answered = [False] * len(job.links)
    beats = [link.heartbeat == 0 for link in job.links]
    for _ in range(cycle.turns(job.budgets.answer_seconds)):
        cycle.turn()
        answered = [a or c for a, c in zip(answered, seen.complete, strict=True)]
        beats = [b or s is not None for b, s in zip(beats, seen.nmt_state, strict=True)]
        if (all(answered) and all(beats)) or not watch.fine:
            break
    for axis, drive in enumerate(job.drives):
        seconds = f"{job.budgets.answer_seconds:g} s"
        if not answered[axis]:
            watch.abort(f"{drive} sends no TPDO after {seconds} of SYNC")
        elif (reason := refusal(seen.statusword[axis])) is not None:
            watch.fault(axis, f"{drive} cannot be enabled: {reason}")
        elif not beats[axis]:
            watch.abort(f"{drive} has sent no heartbeat in {seconds}")
        elif seen.emergencies[axis]:
            watch.fault(axis, f"{drive} sent an emergency before it was enabled")
    return watch.fine


def enable(cycle: Cycle) -> bool:
    """All axes up, step by step; targets are the actual positions. Then the brakes have time to open."""
    job = cycle.job
    for goal in (Goal.READY, Goal.SWITCHED_ON, Goal.OPERATION_ENABLED):
        cycle.goals = [goal] * len(job.links)
        for _ in range(cycle.turns(job.budgets.enable_seconds)):
            cycle.command(cycle.hold())
            cycle.turn()
            if not cycle.watch.fine:
                return False
            if all(LEVEL.get(state_of(word)) == goal for word in cycle.exchange.statusword):
                break
        else:
            _refuse_enable(cycle, goal)
            return False
        cycle.watch.enabled = goal is Goal.OPERATION_ENABLED
    cycle.exchange.answers.forgiven = DOUBLES_FORGIVEN
    if job.brake_release > 0:
        hold_for(cycle, job.brake_release)
    return cycle.watch.fine


def _refuse_enable(cycle: Cycle, goal: Goal) -> None:
    seconds = cycle.job.budgets.enable_seconds
    for drive, word in zip(cycle.job.drives, cycle.exchange.statusword, strict=True):
        if LEVEL.get(state_of(word)) != goal:
            cycle.watch.abort(
                f"{drive} stayed in state {state_of(word).value!r} for {seconds:g} s after {_NAMES[goal]!r}"
                + "".join(hint for bit, hint in _HINTS.items() if not word & bit)
            )
            return


def hold_for(cycle: Cycle, seconds: float) -> None:
    """Keep the last targets for a time, or until there is a reason to end."""
    for _ in range(cycle.turns(seconds)):
        if not cycle.watch.fine:
            return
        cycle.command(cycle.hold())
        cycle.turn()


def quick_stop(cycle: Cycle, record: bool) -> None:
    """All drives stop by themselves (605Ah); returns when none has torque any more, or all stand."""
    cycle.watch.enabled = False
    cycle.goals = [Goal.QUICK_STOP] * len(cycle.goals)
    standing, before = 0, list(cycle.exchange.position)
    for _ in range(cycle.turns(2 * cycle.job.budgets.standstill_seconds)):
        cycle.command(list(cycle.exchange.position))
        if record:
            cycle.record()
        cycle.turn()
        words, position = cycle.exchange.statusword, list(cycle.exchange.position)
        if not any(has_torque(word) for word in words):
            return
        slow = all(
            abs(p - b) <= s // 200 for p, b, s in zip(position, before, cycle.job.largest_step, strict=True)
        )
        standing, before = standing + 1 if slow else 0, position
        # Options 5 to 8 keep the drive in quick stop active at standstill.
        if standing > cycle.turns(0.05) and all(state_of(w) is not State.OPERATION_ENABLED for w in words):
            return


def disable(cycle: Cycle) -> None:
    """All axes down together; nothing is sent to drives that were never commanded.

    From operation enabled the first step is "disable operation": brakes fall in while the drive still holds.
    """
    # Also where only some axes came up: the brakes of those are open.
    enabled = any(state_of(word) is State.OPERATION_ENABLED for word in cycle.exchange.statusword)
    cycle.watch.enabled = False
    if not cycle.commanded:
        return
    if enabled and cycle.job.brake_engage > 0:
        _down_to(cycle, Goal.SWITCHED_ON, cycle.turns(cycle.job.brake_engage))
    cycle.goals = [Goal.SWITCH_ON_DISABLED] * len(cycle.goals)
    for _ in range(cycle.turns(DISABLE_SECONDS)):
        cycle.command(cycle.hold())
        cycle.turn()
        if not any(is_up(word) for word in cycle.exchange.statusword):
            return
    for _ in range(BLIND_CYCLES):
        cycle.command(cycle.hold(), blindly=True)
        cycle.turn()
    pairs = zip(cycle.job.drives, cycle.exchange.statusword, strict=True)
    if up := [drive for drive, word in pairs if is_up(word)]:
        cycle.watch.abort(f"{', '.join(up)} did not confirm within {DISABLE_SECONDS:g} s that torque is off")


def _down_to(cycle: Cycle, goal: Goal, turns: int) -> None:
    cycle.goals = [
        goal if state_of(word) is State.OPERATION_ENABLED else Goal.SWITCH_ON_DISABLED
        for word in cycle.exchange.statusword
    ]
    for _ in range(turns):
        cycle.command(cycle.hold())
        cycle.turn()


def retire(cycle: Cycle) -> list[int]:
    """Take the drives off the watch for this master, then out of NMT operational.

    The process that sends the heartbeats is the one that ends the watch: no drive then misses a master
    that has simply finished.

    Returns:
        Axes that did not confirm: they will report a lost heartbeat.
    """
    seen = cycle.exchange
    watching = [axis for axis, link in enumerate(cycle.job.links) if link.watches]
    for axis in watching:
        seen.confirmed[axis] = False
    for attempt in range(cycle.turns(RETIRE_SECONDS)):
        waiting = [axis for axis in watching if not seen.confirmed[axis] and not cycle.watch.lost(axis)]
        if not waiting:
            break
        if attempt % max(1, cycle.turns(RETIRE_SECONDS) // RETIRE_TRIES) == 0:
            for axis in waiting:
                seen.write_object(axis, objects.HEARTBEAT_CONSUMER, 1, 0)
        cycle.turn()
    seen.command_nmt(_PRE_OPERATIONAL)
    return [axis for axis in watching if not seen.confirmed[axis]]


def is_up(statusword: int) -> bool:
    """Whether a drive has torque, or is on the way to it."""
    return has_torque(statusword) or LEVEL.get(state_of(statusword), Goal.SWITCH_ON_DISABLED) > 0
