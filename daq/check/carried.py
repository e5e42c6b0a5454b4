"""A baseline whose model has other parameters than tonight's, such as one that a diagnosis has added to."""

from __future__ import annotations

from daq.catalogue.values import Model
from ident import Fitted
from ident.drift import Night, Relation, common_base, determined_by, in_base_of, in_terms_of


def carried_over(
    first: Night, tonight: Night, accepted: Model, fitted: Fitted
) -> tuple[Night, tuple[str, ...]]:
    """The baseline in the parameters of tonight's model, and those of its own that tonight's does not tell.

    Args:
        first: the baseline, in its own parameters.
        tonight: in those of tonight's model.
        accepted: the model of the baseline.
        fitted: tonight's identification.

    Raises:
        IdentificationError: they have nothing in common.
    """
    names = tuple(parameter.name for parameter in accepted.parameters)
    if names == fitted.base.names:
        return first, ()
    expressions = [parameter.expression or parameter.name for parameter in accepted.parameters]
    old = Relation.read(names, expressions)
    new = Relation.of(fitted.base).taking_up(fitted.taken_up.names, fitted.taken_up.factors)
    if (determined := determined_by(old, new)) is not None:
        return in_terms_of(first, determined), ()
    common = common_base(old, new)
    return in_base_of(tonight, first, common), common.lost


def lost_words(run: int, lost: tuple[str, ...]) -> list[str]:
    """A warning where a baseline was accepted with parameters that are not compared."""
    if not lost:
        return []
    shown = ", ".join(lost[:6]) + (f" and {len(lost) - 6} more" if len(lost) > 6 else "")
    return [f"the baseline (run {run}) has another model: {shown} are not compared"]
