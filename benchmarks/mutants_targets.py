"""Which modules are broken, and the quick tests that should see it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """Modules, and the tests that should notice what breaks in them.

    Attributes:
        modules: files of the clone.
        tests: files or folders of tests, the quickest first.
        without: expression of pytest's ``-k`` for tests that are left out because they take long.
    """

    modules: tuple[str, ...]
    tests: tuple[str, ...]
    without: str = ""

    @property
    def arguments(self) -> tuple[str, ...]:
        """Of pytest."""
        chosen = ("-k", f"not ({self.without})") if self.without else ()
        return ("-m", "not slow", *chosen, *self.tests)


TARGETS = {
    "dwh": Target(
        (
            "ident/exogeneity/textbook.py",
            "ident/exogeneity/augmented.py",
            "ident/exogeneity/hypothesis.py",
            "ident/exogeneity/revised.py",
        ),
        ("tests/ident/test_exogeneity_parts.py", "tests/ident/test_exogeneity.py"),
        "size_is_nominal or power_grows",
    ),
    "gates": Target(
        (
            "ident/exogeneity/instruments.py",
            "ident/exogeneity/relevance.py",
        ),
        (
            "tests/ident/test_instrument_tests.py",
            "tests/ident/test_gate_one.py",
            "tests/ident/test_exogeneity_parts.py",
        ),
        "keep_their_size",
    ),
    "rank": Target(
        ("ident/exogeneity/rank.py",),
        ("tests/ident/test_exogeneity_parts.py", "tests/ident/test_exogeneity.py"),
        "size_is_nominal or power_grows",
    ),
    "iv": Target(
        (
            "ident/estimators/instrumental.py",
            "ident/estimators/two_stage.py",
            "ident/estimators/least_squares.py",
        ),
        ("tests/ident/test_estimators.py",),
    ),
    "robust": Target(
        ("ident/estimators/robust.py", "ident/estimators/biweight.py", "ident/estimators/huber.py"),
        ("tests/ident/test_robust.py",),
    ),
    "covariances": Target(
        (
            "ident/covariances/hac.py",
            "ident/covariances/cluster.py",
            "ident/covariances/independent.py",
            "ident/statistics/covariance.py",
            "ident/statistics/whitening.py",
        ),
        (
            "tests/ident/test_covariance_parts.py",
            "tests/ident/test_covariances.py",
            "tests/ident/test_whitening.py",
        ),
        "arms_settings or is_honest",
    ),
    "base": Target(("ident/parameters/base.py",), ("tests/ident/test_base.py",), "blas_threads"),
    "decimation": Target(
        ("ident/decimation.py", "ident/signals.py"),
        ("tests/ident/test_signal_parts.py", "tests/ident/test_signals.py"),
    ),
    "units": Target(("drivers/frames/units.py",), ("tests/drivers/test_units.py",)),
    "states": Target(("drivers/cia402/states.py",), ("tests/drivers/test_states.py",)),
    "ramps": Target(("drivers/cyclic/ramp.py",), ("tests/drivers/motion/test_ramp.py",)),
    "catalogue": Target(
        (
            "daq/catalogue/baselines.py",
            "daq/catalogue/leases.py",
            "daq/catalogue/models.py",
            "daq/catalogue/values.py",
        ),
        (
            "tests/daq/catalogue/test_leases.py",
            "tests/daq/catalogue/test_catalogue.py",
            "tests/daq/catalogue/test_database.py",
        ),
        "postgresql",
    ),
    "drift": Target(
        ("ident/drift/wald.py", "ident/drift/geometry.py", "ident/drift/run_to_run.py"),
        ("tests/ident/drift/test_parts.py", "tests/ident/drift/test_references.py"),
    ),
}
