"""Step problems in squeal with Siconos' nonsmooth Gauss-Seidel (fc3d_nsgs), beside the solver of railsqueal.

    cargo bench --bench transient -- --model squeal.h5 --export problems.h5
    OPENBLAS_NUM_THREADS=1 /usr/bin/python3 benches/peers/siconos_nsgs.py problems.h5

Written for Siconos 4.4 (Debian 12: python3-siconos, python3-h5py). Every problem is u = W R + b with the law of Coulomb
and Signorini at each node, W dense. Forces are in units of the largest reaction and displacements in units of W's mean
diagonal times that, so that the solver's tolerances mean something. The residual is that of
docs/explanation/transient.md: the largest component of R - Proj(R - rho u) over the normal force. For each local solver
the error asked of Siconos is lowered by steps of sqrt(10) until the residual is reached; only the run that reaches it
is timed (processor time, the best of ten, cold from R = 0, warm from the reactions of the step before). Our times are
those that the benchmark measured, the best of twenty.
"""

import sys
import time

import h5py
import numpy as np
import siconos.numerics as sn

LOCAL = {
    "default (NSN_GP hybrid)": None,
    "NSN_GP": sn.SICONOS_FRICTION_3D_ONECONTACT_NSN_GP,
    "projection on the cone, local iteration": sn.SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnConeWithLocalIteration,
}


def residual(w, b, mu, r, rho):
    """Largest component of the natural map, N; rows x, y, n of each node."""
    u = (w @ r.ravel()).reshape(-1, 3) + b.reshape(-1, 3)
    q = np.maximum(0.0, r[:, 2] - rho[:, 1] * u[:, 2])
    z = r[:, :2] - rho[:, :1] * u[:, :2]
    size = np.hypot(z[:, 0], z[:, 1])
    factor = np.where(size > mu * q, mu * q / np.where(size > 0, size, 1.0), 1.0)
    t = r[:, :2] - z * factor[:, None]
    return max(np.hypot(t[:, 0], t[:, 1]).max(), np.abs(r[:, 2] - q).max())


class Problem:
    """One step problem in the units and the order (n, x, y) of the solver."""

    def __init__(self, group):
        self.w = group["matrix"][:].reshape(len(group["free"]), -1)
        self.b = group["free"][:]
        self.mu = float(group["friction"][0])
        self.before, self.ours = group["before"][:].reshape(-1, 3), group["reaction"][:].reshape(-1, 3)
        self.seconds = group["seconds"][:].reshape(2, 3)
        self.nodes = len(self.ours)
        d = np.diag(self.w).reshape(-1, 3)
        self.rho = np.stack([1.0 / np.maximum(d[:, 0], d[:, 1]), 1.0 / d[:, 2]], axis=1)
        self.normal = self.ours[:, 2].sum()
        self.force = self.ours.max()
        self.order = np.arange(3 * self.nodes).reshape(-1, 3)[:, [2, 0, 1]].ravel()
        unit = d.mean()
        self.scaled = np.asfortranarray(self.w[np.ix_(self.order, self.order)] / unit)
        self.q = self.b[self.order] / (unit * self.force)

    def status(self):
        """Open, sticking and sliding nodes of our solution."""
        r = self.ours
        closed = r[:, 2] > 0
        slip = closed & (np.hypot(r[:, 0], r[:, 1]) > self.mu * r[:, 2] * (1 - 1e-7))
        return (~closed).sum(), (closed & ~slip).sum(), slip.sum()

    def solve(self, start, local, tolerance):
        """Reactions of one run, its time and its iterations."""
        problem = sn.FrictionContactProblem(3, self.nodes, self.scaled, self.q, np.full(self.nodes, self.mu))
        options = sn.SolverOptions(sn.SICONOS_FRICTION_3D_NSGS)
        options.dparam[sn.SICONOS_DPARAM_TOL] = tolerance
        options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = 100000
        if local is not None:
            sn.solver_options_update_internal(options, 0, local)
        r = np.zeros(3 * self.nodes) if start is None else (start.ravel()[self.order] / self.force)
        v = self.scaled @ r + self.q
        begun = time.process_time()
        sn.fc3d_nsgs(problem, r, v, options)
        seconds = time.process_time() - begun
        found = np.empty_like(r)
        found[self.order] = r * self.force
        return found.reshape(-1, 3), seconds, options.iparam[sn.SICONOS_IPARAM_ITER_DONE]

    def reach(self, start, local, wanted):
        """Time, iterations and reactions of the loosest run that reaches the residual; None where none does."""
        tolerance = 10 * wanted
        for _ in range(12):
            found, seconds, sweeps = self.solve(start, local, tolerance)
            if residual(self.w, self.b, self.mu, found, self.rho) <= wanted * self.normal:
                for _ in range(9):
                    seconds = min(seconds, self.solve(start, local, tolerance)[1])
                return seconds, sweeps, found
            tolerance /= np.sqrt(10.0)
        return None


def main():
    with h5py.File(sys.argv[1]) as file:
        problems = [Problem(file[name]) for name in sorted(file)]
    for p in problems:
        e = residual(p.w, p.b, p.mu, p.ours, p.rho) / p.normal
        print(
            f"{p.nodes} nodes: {p.status()[0]} open, {p.status()[1]} in stick, {p.status()[2]} in slip; our residual "
            f"{e:.1e}"
        )
    for row, limit in enumerate([1e-6, 1e-10]):
        seconds = np.median([p.seconds[row] for p in problems], axis=0)
        ours = {"cold": seconds[0], "warm": seconds[2]}
        print(
            f"residual {limit:.0e}, ours: cold {1e3 * seconds[0]:.3f} ms ({1e3 * seconds[1]:.3f} ms where W was "
            "known), "
            f"warm {1e3 * seconds[2]:.3f} ms"
        )
        for name, local in LOCAL.items():
            for kind in ("cold", "warm"):
                runs = [p.reach(None if kind == "cold" else p.before, local, limit) for p in problems]
                done = [(r, p) for r, p in zip(runs, problems) if r]
                if not done:
                    print(f"residual {limit:.0e}, {name}, {kind}: not reached")
                    continue
                seconds = np.median([r[0] for r, _ in done])
                sweeps = np.median([r[1] for r, _ in done])
                off = max(np.abs(r[2] - p.ours).max() / (p.mu * p.normal) for r, p in done)
                print(
                    f"residual {limit:.0e}, {name}, {kind}: {1e3 * seconds:.3f} ms, {sweeps:.0f} iterations, "
                    f"{seconds / ours[kind]:.1f} "
                    f"times ours; {len(done)} of {len(problems)}, reactions differ by up to {off:.1e} muN"
                )


main()
