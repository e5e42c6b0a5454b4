"""What is said where the revised test cannot be made; apart from it, since most logs have no instruments."""

from __future__ import annotations

from ident.verdicts import Gate, RevisedTest

INSTRUMENTS_NULL = "Π = I: the simulation gives the regressors, X = Z + V"
RANK_NULL = "[X V̂] adds nothing to X above the noise floor"
EXOGENEITY_NULL = "γ = 0: the regressors are uncorrelated with the errors"


def not_testable(reason: str, covariance: str) -> RevisedTest:
    """The verdict where there are no instruments to test with."""
    gates = (
        not_reached("instruments", INSTRUMENTS_NULL),
        not_reached("rank", RANK_NULL),
        not_reached("exogeneity", EXOGENEITY_NULL),
    )
    return RevisedTest("not_testable", f"Least squares was used untested: {reason}.", covariance, gates)


def no_such_arm(reason: str, covariance: str) -> RevisedTest:
    """The verdict where the estimated arm cannot be simulated: gate 1 closes before there are instruments.

    Args:
        reason: which joint ran away when, or where the mass matrix is none of an arm.
        covariance: of the errors, in words.
    """
    closed = Gate("instruments", INSTRUMENTS_NULL, False, None, "", None, None, reason)
    gates = (closed, not_reached("rank", RANK_NULL), not_reached("exogeneity", EXOGENEITY_NULL))
    advice = (
        f"Do not trust this model yet: the arm as it was estimated cannot be simulated: {reason}. Instruments"
        " are invalid; search for the missing effect, and check the controller's figures."
    )
    return RevisedTest("instruments_invalid", advice, covariance, gates)


def not_reached(name: str, null: str) -> Gate:
    return Gate(name, null, None, None, "", None, None, "not reached")  # type: ignore[arg-type]
