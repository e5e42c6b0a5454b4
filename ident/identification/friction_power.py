"""Friction that would drive a motion: found by the power that it takes over the whole of it.

Viscous and dry friction of a slow joint are hardly told apart, so each alone may be below zero by chance, and
both may be above it by less than chance where the torque's sign is turned. What the data do say is their sum
along the motion, Σ τ_f q̇: it is what friction takes from the joint, and cannot be less than nothing.
"""

from __future__ import annotations

import numpy as np

from ident.listing import listed
from ident.preparation.observation import Rows
from ident.results import Estimate

_SAID, _IMPOSSIBLE = 3.0, 5.0
"""Deviations below zero from which on it is said, and from which on the model must not be trusted."""
_VISCOUS, _DRY = ("Fv", "Fvp", "Fvn"), ("Fc", "Fcp", "Fcn")


def driven_by_friction(estimate: Estimate, rows: Rows) -> tuple[tuple[str, ...], bool]:
    """A sentence on joints that friction would drive, none where there is none; and whether surely so.

    Args:
        estimate: of viscous and dry friction.
        rows: that it was fitted to.
    """
    places = {p.leading.name: k for k, p in enumerate(estimate.parameters)}
    found = []
    for joint in range(rows.joints):
        used = rows.used[:, joint]
        viscous = [places[name] for s in _VISCOUS if (name := f"{s}{joint + 1}") in places]
        if not viscous:
            continue
        all_of = viscous + [places[name] for s in _DRY if (name := f"{s}{joint + 1}") in places]
        speed = rows.regressor[:, joint, viscous][used].sum(axis=1)
        weight = rows.regressor[:, joint, all_of][used].T @ speed
        power = weight @ estimate.values[all_of]
        deviation = np.sqrt(weight @ estimate.covariance[np.ix_(all_of, all_of)] @ weight)
        size = -power / deviation
        values = estimate.values[all_of]
        if (values < 0.0).all():  # at no speed would it brake: then what each says alone counts too
            size = max(size, float((-values / np.sqrt(np.diag(estimate.covariance)[all_of])).max()))
        if size > _SAID:
            found.append((joint + 1, float(size)))
    if not found:
        return (), False
    named = listed([f"joint {joint} by {size:.3g} σ" for joint, size in found])
    words = f"friction comes out below zero ({named}), so it would drive the motion: the sign of the torque"
    return (f"{words} or of the position may be turned",), max(size for _, size in found) > _IMPOSSIBLE
