"""Noise, quantisation and a cut-off from positions of which all three are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

import robots
from daq.importing.load import load_recording
from ident.preparation.cutoff import propose_cutoff
from ident.preparation.noise import noise_estimate, smallest_step
from ident.preparation.spectrum import position_spectrum
from ident.recording import Recording
from ident.signals import motion

RATE = 1000.0


def recording(
    band: float, noise: float, seed: int = 0, quantum: float = 0.0, seconds: float = 20.0
) -> Recording:
    """One joint in random motion of a given bandwidth (Hz), with white noise and rounding (m)."""
    generator = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    sections = butter(8, band, fs=RATE, output="sos")
    acceleration = sosfiltfilt(sections, generator.standard_normal(time.size))
    velocity = np.cumsum(acceleration - acceleration.mean()) / RATE
    position = np.cumsum(velocity - velocity.mean()) / RATE
    position = 0.1 * position / np.abs(position).max() + noise * generator.standard_normal(time.size)
    if quantum:
        position = np.rint(position / quantum) * quantum
    return Recording("random", time, None, position[:, np.newaxis], generator.standard_normal((time.size, 1)))


@pytest.mark.parametrize("noise", [1e-7, 1e-6, 1e-5])
def test_white_noise_is_found_within_a_tenth(noise: float) -> None:
    found = position_spectrum((recording(10.0, noise),)).deviation
    assert found == pytest.approx([noise], rel=0.1)


def test_rounding_is_noise_of_its_quantum_over_the_root_of_twelve() -> None:
    quantum = 2e-6
    found = position_spectrum((recording(10.0, 0.0, quantum=quantum),)).deviation
    assert found == pytest.approx([quantum / np.sqrt(12)], rel=0.1)


def test_motion_under_white_torque_noise_is_no_encoder_noise() -> None:
    # The plant integrates twice: 1/f⁴ in the tail, which the fit takes out.
    generator = np.random.default_rng(1)
    clean = recording(10.0, 0.0)
    fine = 8
    white = 1.5 * generator.standard_normal(fine * clean.time.size)
    shaken = (np.cumsum(np.cumsum(white)) / (fine * RATE) ** 2)[::fine]
    shaken -= np.polyval(np.polyfit(clean.time, shaken, 3), clean.time)
    noisy = clean.position[:, 0] + shaken + 1e-7 * generator.standard_normal(clean.time.size)
    spectrum = position_spectrum((replace(clean, position=noisy[:, np.newaxis]),))
    tail = spectrum.frequency > 0.5 * RATE / 2
    everything = np.sqrt(spectrum.power[tail].mean() * RATE / 2)
    assert spectrum.deviation == pytest.approx([1e-7], rel=0.5)
    assert everything > 1.5e-7


def test_the_speeds_noise_is_that_of_filtered_noise() -> None:
    emps = robots.load("emps")
    settings = emps.identification.model_copy(update={"cutoff_hz": 60.0, "trim_samples": (50, 50)})
    noisy = recording(5.0, 1e-6)
    estimate = noise_estimate(emps, (noisy,), position_spectrum((noisy,)), settings)
    alone = 1e-6 * np.random.default_rng(3).standard_normal(noisy.position.shape)
    assert estimate.velocity == pytest.approx(
        motion(noisy.time, alone, settings).velocity.std(axis=0), rel=0.15
    )
    assert estimate.friction_width == pytest.approx(3 * estimate.velocity.max())


@given(st.integers(0, 10**6), st.floats(1e-8, 1e-3))
def test_the_quantum_is_found_from_increments(seed: int, quantum: float) -> None:
    steps = np.random.default_rng(seed).integers(-30, 31, 500)
    assert smallest_step(steps * quantum) == pytest.approx(quantum, rel=1e-6)


def test_what_is_not_rounded_has_no_quantum() -> None:
    generator = np.random.default_rng(0)
    assert np.isnan(smallest_step(generator.standard_normal(5000)))
    assert np.isnan(smallest_step(np.zeros(5000)))


def test_the_cutoff_is_five_times_the_bandwidth_where_noise_allows() -> None:
    quiet = propose_cutoff(position_spectrum((recording(10.0, 1e-9),)))
    assert quiet.motion == pytest.approx([10.0], rel=0.15)
    noisy = propose_cutoff(position_spectrum((recording(10.0, 3e-5),)))
    assert noisy.hz == pytest.approx(float(noisy.noise[0]), rel=0.06)
    assert noisy.hz < 0.6 * quiet.hz


def test_more_noise_never_raises_the_proposal() -> None:
    proposals = [
        propose_cutoff(position_spectrum((recording(20.0, n),))).hz for n in (1e-8, 1e-6, 1e-5, 1e-4)
    ]
    assert proposals == sorted(proposals, reverse=True)


def test_a_noise_that_is_not_white_is_not_the_motion() -> None:
    """Positions that are stamped late have a noise that ends below half the sampling rate."""
    time = np.arange(20_000) / RATE
    swings = sum(np.sin(2 * np.pi * tone * time + tone) / tone for tone in (0.2, 0.5, 0.9))
    noise = np.random.default_rng(3).standard_normal(time.size)
    late = 1e-3 * sosfiltfilt(butter(4, 100.0, fs=RATE, output="sos"), noise)
    position = (0.1 * swings + late + 1e-6 * noise)[:, np.newaxis]
    made = Recording("late", time, None, position, np.zeros_like(position))
    assert propose_cutoff(position_spectrum((made,))).hz < 15.0


def test_far_is_a_factor_of_two() -> None:
    proposal = propose_cutoff(position_spectrum((recording(10.0, 1e-9),)))
    assert not proposal.is_far_from(0.6 * proposal.hz)
    assert not proposal.is_far_from(1.9 * proposal.hz)
    assert proposal.is_far_from(0.45 * proposal.hz)
    assert proposal.is_far_from(2.1 * proposal.hz)


@pytest.mark.parametrize(
    ("robot", "log", "published"), [("emps", "emps/DATA_EMPS.mat", 100.0), ("tx40", "tx40", 50.0)]
)
def test_the_proposal_is_near_what_served_published_logs_best(
    shared_data: Path, robot: str, log: str, published: float
) -> None:
    recordings = load_recording(shared_data / log, robots.load(robot)).recordings
    assert propose_cutoff(position_spectrum(recordings)).hz == pytest.approx(published, rel=0.25)
