# SPDX-License-Identifier: GPL-2.0-or-later
"""Reference of the heated plate (TM-DEMPM 5.1.2): bilinear finite elements, central differences.

Edges x = 0 and y = 0 of a unit square are suddenly heated and held along their normals, the others are free and
insulated. The heated edges send off plane waves whose fronts have square-root cusps, which no mesh resolves. With
subtract=True these waves enter in closed form, and the elements carry the rest only: the heat that the waves' half
spaces do not have, and the tractions that free the edges x = 1 and y = 1. Unit density; stresses in E beta (T1 - T0).
Valid until a wave reaches the other side."""
import numpy as np
import scipy.sparse as sparse
from scipy.special import erfc

from exact import danilovskaya_held, slab_warming

CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def moduli(mode, nu):
    """lambda, mu, gamma over beta for E = 1."""
    mu = 1 / (2 * (1 + nu))
    if mode == "plane_strain":
        return nu / ((1 + nu) * (1 - 2 * nu)), mu, 1 / (1 - 2 * nu)
    return nu / (1 - nu * nu), mu, 1 / (1 - nu)


class Plate:
    def __init__(self, mode, cells, subtract=True, nu=0.25, kappa=0.1, end=0.5, courant=0.5):
        self.cells, self.subtract, self.kappa = cells, subtract, kappa
        self.lam, self.mu, self.gamma = moduli(mode, nu)
        self.modulus = self.lam + 2 * self.mu
        self.speed = np.sqrt(self.modulus)
        self.place = np.arange(cells + 1) / cells
        self.assemble()
        steps = int(np.ceil(end * cells * self.speed / courant))
        self.dt = end / steps
        self.march(steps)

    def assemble(self):
        """Stiffness, thermal load matrix, lumped mass, held components."""
        n, h = self.cells + 1, 1 / self.cells
        elastic = np.array([[self.modulus, self.lam, 0], [self.lam, self.modulus, 0], [0, 0, self.mu]])
        stiffness, load = np.zeros((8, 8)), np.zeros((8, 4))
        for a in np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / np.sqrt(3):
            shape = np.prod(1 + CORNERS * a, axis=1) / 4
            gradient = CORNERS * (1 + CORNERS * a)[:, ::-1] / (2 * h)
            strain = np.zeros((3, 8))
            strain[0, 0::2] = strain[2, 1::2] = gradient[:, 0]
            strain[1, 1::2] = strain[2, 0::2] = gradient[:, 1]
            stiffness += strain.T @ elastic @ strain * h * h / 4
            load += np.outer(strain.T @ [1, 1, 0], shape) * self.gamma * h * h / 4
        first = (np.arange(self.cells)[:, None] * n + np.arange(self.cells)).ravel()
        nodes = first[:, None] + [0, n, n + 1, 1]
        freedom = np.stack([2 * nodes, 2 * nodes + 1], axis=2).reshape(-1, 8)
        matrix = lambda block, columns, width: sparse.csr_matrix(
            (np.tile(block.ravel(), len(nodes)), (np.repeat(freedom, columns.shape[1], axis=1).ravel(),
                                                  np.tile(columns, (1, 8)).ravel())), shape=(2 * n * n, width))
        self.stiffness, self.load = matrix(stiffness, freedom, 2 * n * n), matrix(load, nodes, n * n)
        self.edge = np.full(n, h)
        self.edge[[0, -1]] /= 2
        self.mass = np.multiply.outer(self.edge, self.edge)[:, :, None]

    def wave(self, x, t):
        """Temperature, axial and lateral stress of the plane wave of a half space."""
        heat = erfc(x / (2 * np.sqrt(self.kappa * t)))
        rate = self.speed ** 2 / self.kappa
        axial = self.gamma * danilovskaya_held(x * self.speed / self.kappa, t * rate)
        return heat, axial, self.lam / self.modulus * (axial + self.gamma * heat) - self.gamma * heat

    def force(self, displacement, t):
        cold = slab_warming(self.place, t, self.kappa) if t > 0 else np.append(0.0, np.ones(self.cells))
        heat = 1 - np.outer(cold, cold)
        if self.subtract and t > 0:
            alone, axial, lateral = self.wave(self.place, t)
            heat -= alone[:, None] + alone[None, :]
        elif self.subtract:
            heat = -np.outer(1 - cold, 1 - cold)
        force = (self.load @ heat.ravel() - self.stiffness @ displacement.ravel()).reshape(displacement.shape)
        if self.subtract and t > 0:
            traction = -(axial[-1] + lateral) * self.edge
            force[-1, :, 0] += traction
            force[:, -1, 1] += traction
        return force

    def march(self, steps):
        n = self.cells + 1
        displacement, velocity = np.zeros((n, n, 2)), np.zeros((n, n, 2))
        self.strains = [self.strain(displacement)]
        for step in range(steps):
            velocity += self.dt * (0.5 if step == 0 else 1.0) * self.force(displacement, step * self.dt) / self.mass
            velocity[0, :, 0] = velocity[:, 0, 1] = 0
            displacement += self.dt * velocity
            self.strains.append(self.strain(displacement))

    def strain(self, u):
        """xx, yy, 2 xy in the cells' centres."""
        dx = self.cells * 0.5 * (u[1:, 1:] + u[1:, :-1] - u[:-1, 1:] - u[:-1, :-1])
        dy = self.cells * 0.5 * (u[1:, 1:] - u[1:, :-1] + u[:-1, 1:] - u[:-1, :-1])
        return np.stack([dx[:, :, 0], dy[:, :, 1], dx[:, :, 1] + dy[:, :, 0]])

    def at(self, x, y, t):
        """T / T1 and sxx, syy, sxy at one point and time."""
        i, a = divmod(x * self.cells - 0.5, 1)
        j, b = divmod(y * self.cells - 0.5, 1)
        step, late = divmod(t / self.dt + 1e-9, 1)
        i, j, step = int(i), int(j), min(int(step), len(self.strains) - 2)
        late = t / self.dt - step
        place = lambda e: ((1 - a) * ((1 - b) * e[:, i, j] + b * e[:, i, j + 1])
                           + a * ((1 - b) * e[:, i + 1, j] + b * e[:, i + 1, j + 1]))
        xx, yy, xy = (1 - late) * place(self.strains[step]) + late * place(self.strains[step + 1])
        heat = 1 - slab_warming(x, t, self.kappa) * slab_warming(y, t, self.kappa)
        if self.subtract:
            (hx, ax, _), (hy, ay, _) = self.wave(np.array(x), t), self.wave(np.array(y), t)
            xx, yy = xx + (ax + self.gamma * hx) / self.modulus, yy + (ay + self.gamma * hy) / self.modulus
        spherical = self.lam * (xx + yy) - self.gamma * heat
        return np.array([heat, spherical + 2 * self.mu * xx, spherical + 2 * self.mu * yy, self.mu * xy])
