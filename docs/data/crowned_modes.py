"""Writes crowned_modes.csv: modes of the two clamped cylinders of jobs/curve.json, for comparison with the meshes of
hexahedra.

The bodies are axisymmetric, so that the displacement is a Fourier series in the angle; over the section it is
interpolated by polynomials on Gauss-Lobatto points, with elements graded towards the edges of the bore, where the
stress is singular. Needs numpy and scipy:

    python3 docs/data/crowned_modes.py > docs/data/crowned_modes.csv
"""

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigsh

YOUNG, POISSON, DENSITY = 205e9, 0.3, 7800.0
INNER, OUTER, THICKNESS, CROWN = 0.1, 0.5, 0.1, 0.5
DEPTH_LINES = np.array([0, 0.0005, 0.003, 0.015, 0.06, 0.25, 0.6, 1])
WIDTH_LINES = np.array([0, 0.004, 0.02, 0.1, 0.35, 0.65, 0.9, 0.98, 0.996, 1])


def lobatto(degree):
    """Gauss-Lobatto points on [-1, 1], by Newton's method on (1 - x^2) P'."""
    x = -np.cos(np.pi * np.arange(degree + 1) / degree)
    for _ in range(50):
        legendre = np.zeros((degree + 1, degree + 1))
        legendre[:, 0], legendre[:, 1] = 1, x
        for k in range(1, degree):
            legendre[:, k + 1] = ((2 * k + 1) * x * legendre[:, k] - k * legendre[:, k - 1]) / (k + 1)
        x = x - (x * legendre[:, degree] - legendre[:, degree - 1]) / ((degree + 1) * legendre[:, degree])
    return x


def lagrange(nodes, x):
    """Values and slopes at x of the polynomials that are 1 at one node, each [len(x), len(nodes)]."""
    n = len(nodes)
    values, slopes = np.ones((len(x), n)), np.zeros((len(x), n))
    for i in range(n):
        others = [j for j in range(n) if j != i]
        for j in others:
            values[:, i] *= (x - nodes[j]) / (nodes[i] - nodes[j])
        for k in others:
            term = np.full(len(x), 1 / (nodes[i] - nodes[k]))
            for j in others:
                if j != k:
                    term *= (x - nodes[j]) / (nodes[i] - nodes[j])
            slopes[:, i] += term
    return values, slopes


def frequencies(offset, order, count, degree=8):
    """The lowest `count` frequencies (Hz) with `order` nodal diameters of the cylinder whose contact is `offset` (m)
    from the mid-plane. For order 0 without torsion."""
    nodes = lobatto(degree)
    points, weights = np.polynomial.legendre.leggauss(degree + 2)
    value, slope = lagrange(nodes, points)
    lame, shear = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON), YOUNG / 2 / (1 + POISSON)
    stiffness = np.zeros((6, 6))
    stiffness[:3, :3] = lame
    stiffness[range(3), range(3)] += 2 * shear
    stiffness[range(3, 6), range(3, 6)] = shear

    lines = (len(WIDTH_LINES) - 1) * degree + 1
    rows, columns, k_values, m_values = [], [], [], []
    for ds in range(len(DEPTH_LINES) - 1):
        for dy in range(len(WIDTH_LINES) - 1):
            half_s = np.diff(DEPTH_LINES)[ds] / 2
            half_y = np.diff(WIDTH_LINES)[dy] / 2
            s, y = np.meshgrid(
                DEPTH_LINES[ds] + half_s * (points + 1),
                -offset + THICKNESS * (WIDTH_LINES[dy] + half_y * (points + 1) - 0.5),
                indexing="ij",
            )
            # Radius from the bore (s = 0) to the crowned surface (s = 1), and its derivatives.
            height = OUTER - y * y / (CROWN + np.sqrt(CROWN**2 - y * y)) - INNER
            r, r_s, r_y = INNER + s * height, height, -s * y / np.sqrt(CROWN**2 - y * y)
            volume = (np.outer(weights, weights) * half_s * half_y * THICKNESS * r_s * r).ravel()
            shape = (len(points) ** 2, -1)
            n_ = np.einsum("ai,bj->abij", value, value).reshape(shape)
            n_s = np.einsum("ai,bj->abij", slope / half_s, value).reshape(shape)
            n_y = np.einsum("ai,bj->abij", value, slope / half_y / THICKNESS).reshape(shape)
            r, r_s, r_y = (a.reshape(-1, 1) for a in (r, r_s, r_y))
            n_y, n_r, n_over_r = n_y - n_s * r_y / r_s, n_s / r_s, n_ / r

            # u = (U cos, V sin, W cos) of order·angle in (radius, angle, width); strains rr, aa, yy, ry, ra, ay.
            strain = np.zeros((len(n_), 6, n_.shape[1], 3))
            strain[:, 0, :, 0] = n_r
            strain[:, 1, :, 0], strain[:, 1, :, 1] = n_over_r, order * n_over_r
            strain[:, 2, :, 2] = n_y
            strain[:, 3, :, 0], strain[:, 3, :, 2] = n_y, n_r
            strain[:, 4, :, 0], strain[:, 4, :, 1] = -order * n_over_r, n_r - n_over_r
            strain[:, 5, :, 1], strain[:, 5, :, 2] = n_y, -order * n_over_r
            strain = strain.reshape(len(n_), 6, -1)
            stress = np.einsum("ij,qjk->qik", stiffness, strain) * volume[:, None, None]
            k_values.append(np.tensordot(strain, stress, axes=([0, 1], [0, 1])).ravel())
            m_values.append(np.kron(DENSITY * (n_ * volume[:, None]).T @ n_, np.eye(3)).ravel())
            node = (ds * degree + np.arange(degree + 1))[:, None] * lines + dy * degree + np.arange(degree + 1)
            dof = (3 * node.ravel()[:, None] + np.arange(3)).ravel()
            rows.append(np.repeat(dof, len(dof)))
            columns.append(np.tile(dof, len(dof)))

    size = 3 * lines * ((len(DEPTH_LINES) - 1) * degree + 1)
    index = (np.concatenate(rows), np.concatenate(columns))
    k, m = (sparse.csc_matrix((np.concatenate(v), index), shape=(size, size)) for v in (k_values, m_values))
    free = np.arange(3 * lines, size)  # the bore is clamped
    if order == 0:
        free = free[free % 3 != 1]
    squares = eigsh(k[free][:, free], k=count, M=m[free][:, free], sigma=(2 * np.pi) ** 2, return_eigenvectors=False)
    return np.sqrt(np.sort(squares)) / (2 * np.pi)


if __name__ == "__main__":
    print(
        "# cylinders of jobs/curve.json: inner radius 0.1 m, outer 0.5 m, thickness 0.1 m, crown radius 0.5 m with its "
        "apex contact_offset from the mid-plane,"
    )
    print(
        "# clamped bore, E = 205 GPa, nu = 0.3, rho = 7800 kg/m3; torsion about the axis left out; made by "
        "crowned_modes.py, converged to 2e-6"
    )
    print("contact_offset_m,circumferential_order,frequency_Hz")
    for offset in (0.03, 0.02):
        for order in range(4):
            for f in frequencies(offset, order, 2):
                print(f"{offset},{order},{f:.5f}")
