"""Constitutive laws of the hidden effects, deliberately different from those of the diagnosis."""

from __future__ import annotations

import itertools

import numpy as np

from .elements import Array

YIELDS = np.geomspace(0.25, 3.0, 7)
"""Slip lengths of the parallel elements, relative to each other."""
PRONY_TIMES = np.array([1 / 3, 1.0, 3.0])
PRONY_WEIGHTS = np.array([0.25, 0.5, 0.25])


def slip(way: Array, starts: Array, length: float) -> Array:
    """Parallel elastic elements that slip (Maxwell-slip, Iwan): share of the full friction, -1 to 1.

    way: the angle along which friction acts, rad; length: mean slip length, rad; starts: first samples of the runs, at
    which all elements are unloaded.
    """
    limits = YIELDS * (length / YIELDS.mean())
    step = np.diff(way, prepend=way[0])
    step[starts[:-1]] = 0.0
    out, state = np.empty(len(way)), np.zeros(len(limits))
    fresh = np.zeros(len(way), bool)
    fresh[starts[:-1]] = True
    for k, change in enumerate(step):
        state = np.zeros(len(limits)) if fresh[k] else np.maximum(np.minimum(state + change, limits), -limits)
        out[k] = (state / limits).mean()
    return out


def prony(torque: Array, time: Array, starts: Array, delay: float) -> Array:
    """Three retarded elements in series: the weighted torque that they follow, N.m, exact for a torque that is linear
    between samples. delay: s, of the middle element.
    """
    followed = [retarded(torque, time, starts, delay * t, from_rest=True) for t in PRONY_TIMES]
    return PRONY_WEIGHTS @ np.array(followed)


def retarded(signal: Array, time: Array, starts: Array, delay: float, from_rest: bool = False) -> Array:
    """First-order lag of `signal` along the last axis. from_rest: it starts at 0, not at the first value."""
    step = np.diff(time, prepend=time[0])
    decay = np.exp(-np.maximum(step, 0) / delay)
    # Exact for a linear signal: y1 = E y0 + a u0 + b u1.
    ratio = np.where(step > 0, delay / np.maximum(step, 1e-12) * (1 - decay), 1.0)
    old, new = ratio - decay, 1 - ratio
    drive = np.empty_like(signal)
    drive[..., 1:] = old[1:] * signal[..., :-1] + new[1:] * signal[..., 1:]
    out = np.empty_like(signal)
    for first, last in itertools.pairwise(starts.tolist()):
        state = 0.0 * signal[..., first] if from_rest else signal[..., first]
        out[..., first] = state
        for k in range(first + 1, last):
            state = decay[k] * state + drive[..., k]
            out[..., k] = state
    return out


def rate(signal: Array, time: Array, starts: Array) -> Array:
    """Time derivative within every run."""
    out = np.empty(len(signal))
    for first, last in itertools.pairwise(starts.tolist()):
        out[first:last] = np.gradient(signal[first:last], time[first:last])
    return out


def bearing_spring(torque: Array, full_torque: float) -> Array:
    """Twist of bearings and shafts in series per unit compliance, N.m: one quarter of it grows with the power 9/10, as
    in roller contacts; equal to the torque at full torque.
    """
    return 0.75 * torque + 0.25 * np.sign(torque) * np.abs(torque) ** 0.9 * full_torque**0.1


def hardening_spring(torque: Array, full_torque: float) -> Array:
    """Twist of a series spring that soon reaches a stop, per unit compliance, N.m; at most 0.25 full_torque. No effect
    describes it.
    """
    return 0.25 * full_torque * np.tanh(4 * torque / full_torque)


def stribeck(speed: Array, turnover: float) -> Array:
    """Friction at a speed over that at standstill: 1/(1 + (speed/turnover)^2)."""
    return 1 / (1 + (speed / turnover) ** 2)


def ar1(rng: np.random.Generator, starts: Array, correlation: float) -> Array:
    """Stationary first-order autoregressive noise of unit variance, independent in every run."""
    white = rng.standard_normal(int(starts[-1]))
    scale = np.sqrt(1 - correlation**2)
    drive = scale * white
    drive[starts[:-1]] = white[starts[:-1]]
    out, state = np.empty(len(white)), 0.0
    fresh = np.zeros(len(white), bool)
    fresh[starts[:-1]] = True
    for k, value in enumerate(drive.tolist()):
        state = value if fresh[k] else correlation * state + value
        out[k] = state
    return out
