# SPDX-License-Identifier: GPL-2.0-or-later
"""Closed forms of TM-DEMPM's cases, corrected as in doc/theory.md."""
import numpy as np
from scipy.special import erfc


def danilovskaya(x, t):
    """Stress over E beta T1 and displacement over beta T1 of the heated bar with a free end; unit constants."""
    grow = np.exp(np.minimum(t - x, 50))
    minus = grow * erfc(x / (2 * np.sqrt(t)) - np.sqrt(t))
    plus = np.exp(t + x) * erfc(x / (2 * np.sqrt(t)) + np.sqrt(t))
    front = t > x
    stress = -0.5 * (minus + plus) + np.where(front, grow, 0)
    displacement = (0.5 * (minus - plus) - 2 * np.sqrt(t / np.pi) * np.exp(-x * x / (4 * t))
                    + x * erfc(x / (2 * np.sqrt(t))) - np.where(front, grow - 1, 0))
    return stress, displacement


def rod_temperature(x, t, kappa=0.1, hot=100.0):
    """Of a rod of length 1, initially 0, its ends at 0 and `hot`."""
    n = np.arange(1, 400)[:, None]
    series = np.sum((-1.0) ** n / n * np.exp(-((n * np.pi) ** 2) * kappa * t) * np.sin(n * np.pi * x[None, :]), axis=0)
    return hot * x + 2 * hot / np.pi * series
