# SPDX-License-Identifier: GPL-2.0-or-later
"""Closed forms of TM-DEMPM's cases, corrected as in doc/theory.md."""
import numpy as np
from scipy.special import erf, erfc, erfcx


def _fronts(x, t):
    """exp(t - x) erfc(x / (2 sqrt t) - sqrt t) and exp(t + x) erfc(x / (2 sqrt t) + sqrt t), for t > 0, without
    overflow."""
    a, r = x / (2 * np.sqrt(t)), np.sqrt(t)
    decay = np.exp(-a * a)
    small = erfcx(np.abs(a - r)) * decay
    minus = np.where(a >= r, small, 2 * np.exp(np.minimum(t - x, 500)) - small)
    return minus, erfcx(a + r) * decay


def danilovskaya(x, t):
    """Stress over E beta T1 and displacement over beta T1 of the heated bar with a free end; unit constants."""
    minus, plus = _fronts(x, t)
    front = t > x
    grow = np.exp(np.minimum(t - x, 500))
    stress = -0.5 * (minus + plus) + np.where(front, grow, 0)
    displacement = (0.5 * (minus - plus) - 2 * np.sqrt(t / np.pi) * np.exp(-x * x / (4 * t))
                    + x * erfc(x / (2 * np.sqrt(t))) - np.where(front, grow - 1, 0))
    return stress, displacement


def danilovskaya_held(x, t):
    """As danilovskaya, but the heated surface does not move: stress only."""
    minus, plus = _fronts(x, t)
    late = np.maximum(np.minimum(t - x, 500), 0)
    return -0.5 * (minus + plus) + np.where(t > x, np.exp(late) - erfcx(np.sqrt(late)), 0)


def slab_warming(x, t, kappa):
    """(T1 - T) / (T1 - T0) of a slab of thickness 1 with x = 0 held at T1 and x = 1 insulated: images; kappa t <
    0.5."""
    return sum((-1) ** k * erf((x + 2 * k) / (2 * np.sqrt(kappa * t))) for k in range(-8, 9))


def rod_temperature(x, t, kappa=0.1, hot=100.0):
    """Of a rod of length 1, initially 0, its ends at 0 and `hot`."""
    n = np.arange(1, 400)[:, None]
    series = np.sum((-1.0) ** n / n * np.exp(-((n * np.pi) ** 2) * kappa * t) * np.sin(n * np.pi * x[None, :]), axis=0)
    return hot * x + 2 * hot / np.pi * series


def rod_mean_temperature(t, kappa=0.1, hot=100.0):
    """Its mean; minus E beta times it is the mean stress, at all times, quasi-static or not."""
    n = 2 * np.arange(2000) + 1
    return hot / 2 - 4 * hot / np.pi ** 2 * np.sum(np.exp(-((n * np.pi) ** 2) * kappa * t) / n ** 2)


def rod_displacement(x, t, kappa=0.1, hot=100.0):
    """Displacement over beta of the rod without inertia."""
    n, x = np.arange(1, 2000)[:, None], x[None, :]
    series = np.sum((-1.0) ** n / n ** 2 * np.exp(-((n * np.pi) ** 2) * kappa * t)
                    * (np.cos(n * np.pi * x) - 1 + x - x * np.cos(n * np.pi)), axis=0)
    return hot * x[0] * (x[0] - 1) / 2 - 2 * hot / np.pi ** 2 * series


def rod_ringing(x, t, speed, kappa=0.1, hot=100.0, modes=400):
    """What inertia adds without damping: stress over E beta, displacement over beta; residues of the Laplace image at
    i n pi speed. The bouncing front has integrable spikes: compare with as many modes as there are cells, or means."""
    n = np.arange(1, modes + 1)[:, None]
    w, X = n * np.pi * speed, x[None, :]
    rate = speed * speed / kappa
    q = np.sqrt(1j * w / kappa)
    large = q.real > 300
    bounded = np.where(large, 1, q)
    ends = np.where(large, 1, (np.cosh(bounded) - (-1.0) ** n) / np.sinh(bounded))
    residue = -hot / (rate - 1j * w) * np.sqrt(rate / (1j * w)) * ends * speed * (-1.0) ** n
    factor = 2 * (residue * np.exp(1j * w * t)).real
    return np.sum(factor * np.cos(n * np.pi * X), axis=0), np.sum(factor / (n * np.pi) * np.sin(n * np.pi * X), axis=0)


def square_temperature(x, y, t, kappa=0.1, hot=100.0):
    """Of a square of edge 1, initially 0, its edges at `hot` (product form: eq. 59 corrected)."""
    n = (2 * np.arange(60) + 1)[:, None]
    decay = 4 / (n * np.pi) * np.exp(-((n * np.pi) ** 2) * kappa * t)
    one = lambda z: np.sum(decay * np.sin(n * np.pi * z[None, :]), axis=0)
    return hot * (1 - one(x) * one(y))


def square_mean_temperature(t, kappa=0.1, hot=100.0):
    n = 2 * np.arange(4000) + 1
    one = np.sum(8 / (n * np.pi) ** 2 * np.exp(-((n * np.pi) ** 2) * kappa * t))
    return hot * (1 - one * one)


def square_centre_stress(t, bulk, shear, beta, kappa=0.1, hot=100.0):
    """Normal stresses at the centre without inertia, edges held along their normals; 2D moduli: lambda = bulk -
    shear."""
    centre = square_temperature(np.array([0.5]), np.array([0.5]), t, kappa, hot)[0]
    modulus = bulk + shear
    return -2 * bulk * beta * (shear / modulus * centre + bulk / modulus * square_mean_temperature(t, kappa, hot))
