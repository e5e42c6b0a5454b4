"""Correlated errors: AR whitening, covariances of linear estimates, restricted fits."""
