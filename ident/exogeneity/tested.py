"""What the tests are asked about: torques, regressors and instruments, samples × joints in order of time."""

from __future__ import annotations

from dataclasses import dataclass

from ident.exogeneity.textbook import WhiteRows
from ident.statistics.restricted import independent_whitening, regression_whitening
from ident.statistics.whitening import Whitening
from robots.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class TestedRows:
    """Rows of eq. 6 with the same rows of the simulated columns.

    Attributes:
        torque: samples × joints, N·m (or N).
        regressor: samples × joints × b.
        instruments: samples × joints × b.
        segment: (samples,) which recording a sample comes from.
        used: samples × joints, false where a row is left out.
        known_errors: their AR process where it was fitted before.
    """

    __test__ = False  # a value, whatever its name looks like to a collector of tests

    torque: FloatArray
    regressor: FloatArray
    instruments: FloatArray
    segment: IntArray
    used: BoolArray
    known_errors: Whitening | None = None

    def errors(self) -> Whitening:
        """The AR process of the errors per joint."""
        if self.known_errors is not None:
            return self.known_errors
        return regression_whitening(self.torque, self.regressor, self.segment, self.used)

    def omega(self) -> Whitening:
        """The paper's Ω, of the residuals of weighted least squares; errors independent in time."""
        return independent_whitening(self.torque, self.regressor, self.segment, self.used)

    def whitened(self, whitening: Whitening) -> WhiteRows:
        """y, X and Z through one filter, stacked joint by joint."""
        y = whitening.apply(self.torque[:, :, None], self.segment, self.used)[:, 0]
        x = whitening.apply(self.regressor, self.segment, self.used)
        return WhiteRows(y, x, whitening.apply(self.instruments, self.segment, self.used))
