"""The part of ``armhil doctor`` that looks at this machine: packages, permissions, real time, clock."""

from __future__ import annotations

import ctypes
import errno
import importlib.util
import os
import platform
import resource
import shutil
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from daq.catalogue.location import catalogue_url
from daq.catalogue.values import CatalogueError
from daq.doctor.check import Check
from drivers.cyclic.realtime import MASTER_PRIORITY

PACKAGES = ("robots", "drivers", "trajectories", "ident", "daq")
LIBRARIES = ("numpy", "scipy", "pin", "ruckig", "python-can", "canopen", "mcap", "numba")
TIMER_TRIES = 100
TIMER_SECONDS = 0.002
LITTLE_ROOM = 1e9
"""Bytes that should be free where recordings go: an hour of six joints at 250 Hz takes about as much."""
ANY_CYCLE = 0.004
"""s; that of a usual arm, where none is named."""

_CPUS = Path("/sys/devices/system/cpu")
_KERNEL = Path("/proc/sys/kernel")
_TIME_ERROR = 5
"""What adjtimex(2) answers where nothing keeps the clock right."""


def machine_checks(cycle_time: float = ANY_CYCLE, folder: Path | None = None) -> list[Check]:
    """Everything about this machine.

    Args:
        cycle_time: SYNC period of the arm, s.
        folder: where recordings go; the current one where None.
    """
    return [
        *environment_checks(),
        *shadowing_checks(),
        catalogue_check(),
        folder_check(folder or Path.cwd()),
        priority_check(),
        memory_check(),
        throttling_check(),
        governor_check(),
        kernel_check(),
        clock_check(),
        wall_clock_check(),
        timer_check(cycle_time),
    ]


def environment_checks() -> list[Check]:
    """Python and the libraries."""
    python = ".".join(str(part) for part in sys.version_info[:3])
    fit = sys.version_info >= (3, 11)
    checks = [
        Check("python", "ok" if fit else "failed", python, "" if fit else "install Python 3.11 or newer")
    ]
    found, lacking = [], []
    for name in LIBRARIES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            lacking.append(name)
    if lacking:
        remedy = "install armhil anew with its dependencies"
        return [*checks, Check("libraries", "failed", f"missing: {', '.join(lacking)}", remedy)]
    return [*checks, Check("libraries", "ok", ", ".join(found))]


def shadowing_checks(path: list[str] | None = None) -> list[Check]:
    """Do our packages, whose names are plain words, come from one place, and from ours?"""
    home = Path(__file__).resolve().parents[2]
    strangers = []
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        origin = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if origin is None or not origin.is_relative_to(home):
            strangers.append(f"{name} from {origin}")
    others = [
        str(Path(entry or ".") / name)
        for entry in (sys.path if path is None else path)
        for name in PACKAGES
        if _is_package(Path(entry or ".") / name) and (Path(entry or ".")).resolve() != home
    ]
    if strangers:
        remedy = "leave the folder that holds the other package, or take it off PYTHONPATH"
        return [Check("packages", "failed", f"another package is in the way: {strangers[0]}", remedy)]
    if others:
        remedy = "take it off PYTHONPATH, or uninstall it, before something imports the wrong one"
        return [Check("packages", "warning", f"a second package of the same name: {others[0]}", remedy)]
    return [Check("packages", "ok", f"{', '.join(PACKAGES)} come from one place")]


def _is_package(path: Path) -> bool:
    return (path / "__init__.py").is_file() or path.with_suffix(".py").is_file()


# Permissions ---------------------------------------------------------------------------------


def catalogue_check() -> Check:
    """May the catalogue be written?"""
    try:
        url = catalogue_url()
    except CatalogueError as error:
        return Check("catalogue", "failed", str(error), "correct $ARMHIL_CATALOGUE")
    if url.drivername != "sqlite":
        return Check("catalogue", "ok", url.render_as_string())
    path = Path(str(url.database))
    place = next(entry for entry in (path, *path.parents) if entry.exists())
    if os.access(place, os.W_OK):
        return Check("catalogue", "ok", str(path))
    remedy = f"name another file in $ARMHIL_CATALOGUE, or: chown {os.getuid()} {place}"
    return Check("catalogue", "failed", f"{place} may not be written", remedy)


def folder_check(folder: Path) -> Check:
    """May recordings be written here, and is there room?"""
    if not os.access(folder, os.W_OK):
        return Check("folder", "warning", f"{folder} may not be written", "give --out, or go elsewhere")
    free = shutil.disk_usage(folder).free
    text = f"{folder}, {free / 1e9:.1f} GB free"
    if free < LITTLE_ROOM:
        return Check("folder", "warning", text, "make room: armhil prune --dry-run")
    return Check("folder", "ok", text)


# Real time -----------------------------------------------------------------------------------


def priority_check() -> Check:
    """Would the system give the cyclic process SCHED_FIFO? Asked for in a process of its own."""
    if not hasattr(os, "sched_setscheduler"):
        return Check(
            "real-time priority", "warning", "this system has no SCHED_FIFO", "use Linux for real arms"
        )
    asking = "from drivers.cyclic.realtime import *; print(take_priority(MASTER_PRIORITY) or '')"
    home = str(Path(__file__).resolve().parents[2])
    answer = subprocess.run(
        [sys.executable, "-c", asking], cwd=home, capture_output=True, text=True, check=False
    )
    refused = answer.stdout.strip() or answer.stderr.strip().rpartition("\n")[2]
    if not refused:
        return Check("real-time priority", "ok", f"SCHED_FIFO {MASTER_PRIORITY} is permitted")
    remedy = "in /etc/security/limits.conf: <user> - rtprio 50, then log in anew"
    return Check("real-time priority", "warning", refused, remedy)


def memory_check() -> Check:
    """May memory be locked, so that no page of the cyclic process is ever waited for?"""
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    if limit == resource.RLIM_INFINITY or os.geteuid() == 0:
        return Check("locked memory", "ok", "unlimited")
    remedy = "in /etc/security/limits.conf: <user> - memlock unlimited, then log in anew"
    return Check("locked memory", "warning", f"limited to {limit} bytes", remedy)


def throttling_check(kernel: Path = _KERNEL) -> Check:
    """Does the system take the processor from real-time processes now and then?"""
    runtime, period = (_number(kernel / f"sched_rt_{name}_us") for name in ("runtime", "period"))
    if runtime is None or period is None:
        return Check("real-time share", "unknown", "this system does not tell")
    if runtime < 0 or runtime >= period:
        return Check("real-time share", "ok", "not limited")
    share = runtime / period
    text = f"{100 * share:.0f} % of each {period / 1e6:g} s"
    if share < 0.9:
        remedy = "as root: sysctl -w kernel.sched_rt_runtime_us=950000"
        return Check("real-time share", "warning", text, remedy)
    return Check("real-time share", "ok", text)


def governor_check(cpus: Path = _CPUS) -> Check:
    """Do the processors have to speed up first when a cycle is due?"""
    files = sorted(cpus.glob("cpu[0-9]*/cpufreq/scaling_governor"))
    found = sorted({file.read_text().strip() for file in files})
    if not found:
        return Check("processor speed", "ok", "not governed by this system")
    if found == ["performance"]:
        return Check("processor speed", "ok", "governor performance")
    remedy = "as root: cpupower frequency-set --governor performance"
    return Check("processor speed", "warning", f"governor {', '.join(found)}", remedy)


def kernel_check(release: str | None = None) -> Check:
    """Is the kernel built for real time? Not needed on a quiet machine with cycles of milliseconds."""
    text = f"{platform.release()} {platform.version()}" if release is None else release
    kind = "PREEMPT_RT" if "PREEMPT_RT" in text else "PREEMPT" if "PREEMPT" in text else "plain"
    return Check("kernel", "ok", f"{text.split()[0]}, {kind}")


# Clock ---------------------------------------------------------------------------------------


def clock_check() -> Check:
    """The clock that SYNC goes by."""
    info = time.get_clock_info("monotonic")
    source = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
    name = source.read_text().strip() if source.is_file() else info.implementation
    if info.resolution > 1e-6:
        return Check("clock", "failed", f"{name}, resolution {info.resolution:g} s", "use another system")
    if name in ("acpi_pm", "jiffies", "refined-jiffies"):
        return Check("clock", "warning", f"clock source {name} is slow", "boot with clocksource=tsc or hpet")
    return Check("clock", "ok", f"{name}, resolution {info.resolution:g} s")


def wall_clock_check() -> Check:
    """Is the time of day kept right? Runs and verdicts are dated by it."""
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "adjtimex"):
        return Check("time of day", "unknown", "this system does not tell")
    # struct timex of the C library; all zero only asks.
    answer = libc.adjtimex(ctypes.create_string_buffer(512))
    if answer < 0:
        reason = os.strerror(ctypes.get_errno() or errno.EPERM)
        return Check("time of day", "unknown", f"this system does not tell: {reason}")
    if answer == _TIME_ERROR:
        remedy = "run a time service: as root: timedatectl set-ntp true, or install chrony"
        return Check("time of day", "warning", "no time service keeps it right", remedy)
    return Check("time of day", "ok", "kept right by a time service")


def timer_check(cycle_time: float) -> Check:
    """How late this machine wakes an ordinary process now, beside the SYNC period."""
    late = []
    for _ in range(TIMER_TRIES):
        due = time.monotonic() + TIMER_SECONDS
        time.sleep(TIMER_SECONDS)
        late.append(time.monotonic() - due)
    worst_of_ten = float(np.quantile(late, 0.9))
    text = f"woken {1e3 * worst_of_ten:.2f} ms late (90 %), {1e3 * max(late):.2f} ms at worst"
    if worst_of_ten > 0.5 * cycle_time:
        remedy = "end other programs, or permit real-time priority"
        return Check("timer", "warning", f"{text}; a cycle is {1e3 * cycle_time:g} ms", remedy)
    return Check("timer", "ok", text)


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):
        return None
