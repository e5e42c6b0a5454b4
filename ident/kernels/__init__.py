"""Compiled kernels: rigid bodies, friction, controller and the closed loop, as arrays in and out."""
