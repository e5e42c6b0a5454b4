"""Guards that are broken by hand, one at a time: for each, some test has to fail.

What ``benchmarks.mutants`` draws changes one sign or number. A guard is lost in other ways, too: it is not
called any more, its window is ten times as wide, it looks at the wrong axis. ``python -m benchmarks.mutants
--guards`` makes each of these changes in a copy of the clone and runs the tests that should see it.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Broken:
    """One guard, and how it is broken.

    Attributes:
        guard: in words.
        module: file of the clone.
        before: text that is there once.
        after: what it becomes.
        tests: arguments of pytest; of a rule of the search the nearest are asked.
    """

    guard: str
    module: str
    before: str
    after: str
    tests: tuple[str, ...] = ()


_CYCLIC = "tests/drivers/cyclic/"
_GUARDS, _LOOP, _STOPS = (f"{_CYCLIC}test_{name}.py" for name in ("guards", "loop", "stops"))
_ANSWERS, _SET_POINTS = f"{_CYCLIC}test_answers.py", f"{_CYCLIC}test_set_point_guard.py"
_CHECKS, _WATCH = "drivers/cyclic/motion_checks.py", "drivers/cyclic/watch.py"
_SESSION = "drivers/session/arm_session.py"

GUARDS = (
    Broken(
        "one session at a time has the arm",
        "drivers/bus/bus_lock.py",
        "                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)\n",
        "                pass\n",
        ("-k", "one_session", _GUARDS, "tests/drivers/bus/test_lockout.py"),
    ),
    Broken(
        "locks of other users' folders count",
        "drivers/bus/bus_lock.py",
        "                if folder.path != self._folder.path:\n",
        "                if False:\n",
        (
            "-k",
            "two_users",
            "tests/drivers/bus/test_lockout.py",
        ),
    ),
    Broken(
        "doubled TPDOs are forgiven twice at most",
        "drivers/cyclic/answers.py",
        "DOUBLES_FORGIVEN = 2\n",
        "DOUBLES_FORGIVEN = 1 << 30\n",
        (
            "-k",
            "again_and_again or rare",
            _ANSWERS,
        ),
    ),
    Broken(
        "doubled TPDOs: none is forgiven before torque",
        "drivers/cyclic/answers.py",
        "        self.forgiven = 0\n",
        "        self.forgiven = DOUBLES_FORGIVEN\n",
        (
            "-k",
            "before_torque",
            _ANSWERS,
        ),
    ),
    Broken(
        "a doubled answer makes its row incomplete",
        "drivers/cyclic/cycle.py",
        "            _doubt(held[-1], answers.doubled)\n",
        "",
        (
            "-k",
            "single_second or each_of_two or late_answer",
            _ANSWERS,
        ),
    ),
    Broken(
        "rows around a swapped answer are incomplete",
        "drivers/cyclic/cycle.py",
        "                _doubt(row, answers.swapped)\n",
        "                pass\n",
        (
            "-k",
            "true_frame or single_second",
            _ANSWERS,
        ),
    ),
    Broken(
        "rows wait for a heartbeat of their drives",
        "drivers/cyclic/cycle.py",
        "            if place >= end and held[0] is not None:\n",
        "            if False:\n",
        (
            "-k",
            "speaks_in_place",
            _ANSWERS,
        ),
    ),
    Broken(
        "what no heartbeat has confirmed is not believed at the end",
        "drivers/cyclic/cycle.py",
        "                _doubt(row, doubted)\n            self._hand_out",
        "                pass\n            self._hand_out",
        (
            "-k",
            "speaks_in_place or last_rows",
            _ANSWERS,
        ),
    ),
    Broken(
        "range of the set-points",
        "drivers/cyclic/set_point_guard.py",
        "        return [(-np.inf, np.inf)] * len(job.links)\n    lower",
        "        pass\n    return [(-np.inf, np.inf)] * len(job.links)\n    lower",
        (
            "-k",
            "range",
            _SET_POINTS,
        ),
    ),
    Broken(
        "step of the set-points",
        "drivers/cyclic/set_point_guard.py",
        "                abs(step) > steps[axis]\n",
        "                False\n",
        (
            "-k",
            "within or damaged or jump or gently",
            _SET_POINTS,
        ),
    ),
    Broken(
        "change of speed of the set-points",
        "drivers/cyclic/set_point_guard.py",
        "abs(step - last + earlier) > changes[axis]",
        "False",
        (
            "-k",
            "jump or within",
            _SET_POINTS,
        ),
    ),
    Broken(
        "set-points are judged at all",
        "drivers/cyclic/cycle.py",
        "            targets = self._guarded(targets)\n",
        "            pass\n",
        (
            "-k",
            "damaged or range",
            _SET_POINTS,
        ),
    ),
    Broken(
        "refuse what nobody has acknowledged",
        _SESSION,
        "        self._refuse_unacknowledged()\n\n    def _refuse_unacknowledged",
        "\n    def _refuse_unacknowledged",
        ("-k", "no_session_streams", "tests/drivers/bus/test_lockout.py"),
    ),
    Broken(
        "the reason is looked for",
        _SESSION,
        "        if (reason := self.unacknowledged) is not None:\n",
        "        if (reason := self._unacknowledged) is not None:\n",
        ("-k", "no_session_streams", "tests/drivers/bus/test_lockout.py"),
    ),
    Broken(
        "refuse a position that nobody has attested",
        _SESSION,
        "        refuse_unattested(self.robot, self._attested, self.position_doubt)\n",
        "",
        (
            "-k",
            "zero or forgot",
            "tests/drivers/setup/test_last_rest.py",
            "tests/drivers/motion/test_homing.py",
        ),
    ),
    Broken(
        "refuse a zero that has moved",
        _SESSION,
        "self._attested, self.position_doubt)",
        "self._attested)",
        ("tests/drivers/setup/test_last_rest.py",),
    ),
    Broken(
        "homing needs a look afterwards",
        _SESSION,
        "        self._attested = False\n        report =",
        "        report =",
        (
            "-k",
            "forgot",
            "tests/drivers/motion/test_homing.py",
        ),
    ),
    Broken(
        "refuse a reference that begins elsewhere",
        _SESSION,
        "        check_start(self.robot, self.actual_position(), targets[0], self._start_tolerance)\n",
        "",
        (
            "-k",
            "refusals",
            "tests/drivers/test_session.py",
        ),
    ),
    Broken(
        "refuse a reference that leaves the envelope",
        _SESSION,
        "        check_envelope(self.robot, targets, self.robot.bus.cycle_time)\n",
        "",
        (
            "-k",
            "refusals",
            "tests/drivers/test_session.py",
        ),
    ),
    Broken(
        "refuse a drive in fault",
        _SESSION,
        "        self._connection.refuse_faults()\n        self._connection.refuse_restarted()\n",
        "        self._connection.refuse_restarted()\n",
        (
            "-k",
            "emergency",
            "tests/drivers/test_session.py",
        ),
    ),
    Broken(
        "refuse a drive that has started anew",
        _SESSION,
        "        self._connection.refuse_restarted()\n        job",
        "        job",
        ("tests/drivers/setup/test_restarts.py",),
    ),
    Broken(
        "the arm stands where the cyclic process begins",
        "drivers/cyclic/following.py",
        "        if (far := np.abs(end - start) > job.start_tolerance).any():\n",
        "        if (far := np.abs(end - start) > np.inf).any():\n",
        (
            "-k",
            "elsewhere",
            _LOOP,
        ),
    ),
    Broken(
        "window of the following error",
        _CHECKS,
        "        if error > self._window[axis]:\n",
        "        if error > 10 * self._window[axis]:\n",
        ("-k", "both_sides", _LOOP, _GUARDS),
    ),
    Broken(
        "following error without its sign",
        _CHECKS,
        "        error = abs(set_point - position)\n",
        "        error = set_point - position\n",
        ("-k", "both_sides", _LOOP, _GUARDS),
    ),
    Broken(
        "a reading that stands still",
        _CHECKS,
        "            self.blind.add(axis)\n",
        "            return None\n",
        ("-k", "frozen or judge", "tests/drivers/test_fault_matrix.py"),
    ),
    Broken(
        "torque goes where a reading stands still",
        _WATCH,
        "                goals[axis] = Goal.SWITCH_ON_DISABLED\n        self._check_surroundings",
        "                pass\n        self._check_surroundings",
        ("-k", "reading_stands_still", _GUARDS),
    ),
    Broken(
        "halt is the drives' own quick stop",
        "drivers/cyclic/power.py",
        "    cycle.goals = [Goal.QUICK_STOP] * len(cycle.goals)\n",
        "    cycle.goals = [Goal.SWITCH_ON_DISABLED] * len(cycle.goals)\n",
        ("-k", "quick_stop", _GUARDS, _STOPS),
    ),
    Broken(
        "a quick stop is held until the arm stands",
        "drivers/cyclic/power.py",
        "    for _ in range(cycle.turns(2 * cycle.job.budgets.standstill_seconds)):\n",
        "    for _ in range(2):\n",
        ("-k", "before_the_arm_stands or quick_stop", _GUARDS, _STOPS),
    ),
    Broken(
        "torque stays during the stop ramp",
        "drivers/cyclic/following.py",
        "        for target in [*ramp, rest]:\n",
        "        cycle.goals = [type(g)(0) for g in cycle.goals]\n        for target in [*ramp, rest]:\n",
        (
            "-k",
            "before_the_arm_stands",
            _GUARDS,
        ),
    ),
    Broken(
        "there is a stop ramp",
        "drivers/cyclic/following.py",
        "        for target in [*ramp, rest]:\n",
        "        for target in []:\n",
        ("-k", "by_a_ramp or before_the_arm_stands", _LOOP, _GUARDS),
    ),
    Broken(
        "the arm comes to rest before torque goes",
        "drivers/cyclic/loop.py",
        "(self.cycle, recorded)\n        else:\n            self._follower.come_to_rest()\n",
        "(self.cycle, recorded)\n        else:\n            pass\n",
        (
            "-k",
            "before_the_arm_stands",
            _GUARDS,
        ),
    ),
    Broken(
        "torque of either sign",
        _CHECKS,
        "            if -allowed <= torque <= allowed:",
        "            if torque <= allowed:",
        (
            "-k",
            "torque_guard",
            _GUARDS,
        ),
    ),
    Broken(
        "tolerance of the torque",
        _CHECKS,
        "TORQUE_TOLERANCE = 0.05\n",
        "TORQUE_TOLERANCE = 0.5\n",
        (
            "-k",
            "torque_guard",
            _GUARDS,
        ),
    ),
    Broken(
        "SYNCs of too much torque",
        _CHECKS,
        "            if self._above[joint] > self._torque_cycles:\n",
        "            if self._above[joint] > 10 * self._torque_cycles:\n",
        (
            "-k",
            "torque_guard",
            _GUARDS,
        ),
    ),
    Broken(
        "SYNCs of too much torque are counted anew",
        _CHECKS,
        "                self._above[joint] = 0\n",
        "                pass\n",
        (
            "-k",
            "torque_guard",
            _GUARDS,
        ),
    ),
    Broken(
        "a heartbeat that stays away",
        _WATCH,
        '            self.abort(\n                f"no heartbeat from',
        '            (lambda words: None)(\n                f"no heartbeat from',
        (
            "-k",
            "stays_away",
            _GUARDS,
        ),
    ),
    Broken(
        "its age in the quick look",
        _WATCH,
        " and now <= self._alive_until\n",
        "\n",
        (
            "-k",
            "stays_away",
            _GUARDS,
        ),
    ),
    Broken(
        "NMT state in the quick look",
        _WATCH,
        "        if states or any(seen.emergencies)",
        "        if any(seen.emergencies)",
        ("-k", "left_operational", _GUARDS),
    ),
    Broken(
        "boot-up in the quick look",
        _WATCH,
        " or any(seen.booted):\n",
        ":\n",
        (
            "-k",
            "started_anew",
            _GUARDS,
        ),
    ),
    Broken(
        "emergency of an axis that looks healthy",
        _WATCH,
        "if states or any(seen.emergencies) or",
        "if states or",
        (
            "-k",
            "emergency",
            _GUARDS,
        ),
    ),
    Broken(
        "patience with an emergency",
        _WATCH,
        "            if self._warned[axis] > _PATIENCE:\n",
        "            if self._warned[axis] > 1000 * _PATIENCE:\n",
        (
            "-k",
            "emergency",
            _GUARDS,
        ),
    ),
    Broken(
        "the parent lives",
        _WATCH,
        "        if not self._parent_alive():\n",
        "        if False:\n",
        (
            "-k",
            "parent",
            _LOOP,
        ),
    ),
    Broken(
        "velocity of the approach",
        "drivers/cyclic/ramp.py",
        "    duration = float(max(by_velocity.max(), by_acceleration.max()))\n",
        "    duration = float(by_acceleration.max())\n",
        (
            "-k",
            "approach",
            _GUARDS,
        ),
    ),
    Broken(
        "acceleration of the approach",
        "drivers/cyclic/ramp.py",
        "    duration = float(max(by_velocity.max(), by_acceleration.max()))\n",
        "    duration = float(by_velocity.max())\n",
        (
            "-k",
            "approach",
            "tests/drivers/motion/test_ramp.py",
        ),
    ),
    Broken(
        "counts beyond 607A by one",
        "drivers/frames/units.py",
        "(rounded <= INT32.max)",
        "(rounded <= INT32.max + 1)",
        (
            "-k",
            "607a",
            _GUARDS,
        ),
    ),
    Broken(
        "counts below 607A by one",
        "drivers/frames/units.py",
        "(rounded >= INT32.min)",
        "(rounded >= INT32.min - 1)",
        (
            "-k",
            "607a",
            _GUARDS,
        ),
    ),
    Broken(
        "joints that work against each other",
        "drivers/frames/units.py",
        "np.abs(self.transmission) @ joint_span",
        "self.transmission @ joint_span",
        (
            "-k",
            "span",
            _GUARDS,
        ),
    ),
    Broken(
        "the note is there before the stream",
        "drivers/session/memory.py",
        "        self._lockout.begin()\n",
        "",
        ("tests/drivers/setup/test_last_rest.py", "tests/daq/session/test_acknowledge.py"),
    ),
    Broken(
        "the note stays where rest was not seen",
        "drivers/session/memory.py",
        "        elif result.torque_unconfirmed or result.rest_unconfirmed:\n",
        "        elif False:\n",
        ("tests/drivers/setup/test_last_rest.py", "tests/daq/session/test_acknowledge.py"),
    ),
    Broken(
        "the note stays where the program fails",
        "drivers/session/memory.py",
        '            self._lockout.keep(f"the program that drove it failed: {why}")\n',
        "            self._lockout.lift()\n",
        ("tests/drivers/setup/test_last_rest.py", "tests/daq/session/test_acknowledge.py"),
    ),
    Broken(
        "a link in place of a note is not followed",
        "drivers/bus/state_folder.py",
        "_FILE = os.O_NOFOLLOW | os.O_NONBLOCK",
        "_FILE = os.O_NONBLOCK",
        ("tests/drivers/bus/test_lockout.py",),
    ),
    Broken(
        "a second name of a note is refused",
        "drivers/bus/state_folder.py",
        " or found.st_nlink > 1:\n",
        ":\n",
        ("tests/drivers/bus/test_lockout.py",),
    ),
    Broken(
        "what was typed before a question is thrown away",
        "daq/session/questions.py",
        "        _forget_what_was_typed(keyboard)\n",
        "",
        ("-m", "", "-k", "typed", "tests/daq/session/test_questions.py"),
    ),
    Broken(
        "the moment of quiet before a prompt",
        "daq/session/questions.py",
        "        while select.select([keyboard], [], [], QUIET)[0]:\n",
        "        while False:\n",
        ("-m", "", "-k", "typed or typing or types", "tests/daq/session/test_questions.py"),
    ),
    Broken(
        "a program that writes objects of a drive is another master",
        "drivers/cyclic/foreign.py",
        "    if not data or data[0] >> 5 in _READING:\n",
        "    if True:\n",
        ("-k", "writes_objects", _LOOP),
    ),
    Broken(
        "requests of other SDO clients are listened to",
        "drivers/cyclic/exchange.py",
        "            sorters[sdo_request_cob_id(link.node)] = self._foreign_sdo(link.node)\n",
        "",
        ("-k", "writes_objects or only_reads", _LOOP),
    ),
    Broken(
        "an SDO answer to somebody else confirms nothing",
        "drivers/cyclic/foreign.py",
        " and data[1:4] == asked\n",
        "\n",
        ("-k", "confirm_nothing", _LOOP),
    ),
    Broken(
        "a gain that the drive's rated torque contradicts",
        "drivers/setup/rated_torque.py",
        "    if any(low <= ratio <= high for ratio in ratios.values()):\n",
        "    if ratios:\n",
        ("tests/drivers/setup/test_rated_torque.py",),
    ),
    Broken(
        "a contradicted gain ends the stage unless somebody has measured it",
        "daq/session/first_stage.py",
        '        if not looked(f"{where}\\nHas the described gain been measured on this arm?"):\n',
        "        if False:\n",
        ("-k", "contradicts", "tests/daq/session/test_first_move.py"),
    ),
    Broken(
        "a pass that was changed does not count",
        "daq/session/stages.py",
        " and is_whole(run, identity)",
        "",
        ("tests/daq/catalogue/test_seals.py",),
    ),
    Broken(
        "a full run that was changed admits nothing",
        "daq/session/admission.py",
        " and not is_whole(run, identity)",
        " and False",
        ("tests/daq/catalogue/test_seals.py",),
    ),
    Broken(
        "a pass is of the arm that made it",
        "daq/catalogue/seals.py",
        "    said = [arm.name, list(arm.serials), bool(arm.simulated), kind, stage, outcome, others]\n",
        "    said = [kind, stage, outcome, others]\n",
        ("tests/daq/catalogue/test_seals.py",),
    ),
)
