"""Compiled code of the closed loop; only ``ident.closed_loop.compiled`` needs to know of it."""

from __future__ import annotations
