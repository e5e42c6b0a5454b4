"""Are the regressors exogenous? The textbook Durbin-Wu-Hausman test and the revised one."""

from __future__ import annotations

from ident.exogeneity.revised import not_testable, revised_test
from ident.exogeneity.textbook import WhiteRows, textbook_test

__all__ = ["WhiteRows", "not_testable", "revised_test", "textbook_test"]
