"""The joint fit of `bristle identify` in SciPy: the same residuals, weights and priors, the same start, the same algorithm.

Reads a folder that the bench wrote (task.json, and arrays as little-endian doubles) and prints a JSON object.

MINPACK's Levenberg-Marquardt (`method="lm"`) is the algorithm that the Rust crate carries over. NumPy does all that
does not depend on the moment before: Stribeck levels, displacements, balance, kernel. The deflection of the bristles does
depend on it, so that time is a loop in Python; each turn of it moves the records and all perturbed parameters of a
Jacobian on at once.
"""

import json
import resource
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

HALF_SINE = (-2.283185144364166, 1.2026721831131366, -0.2893574259628464, 0.03856046234606336)


class Task:
    def __init__(self, folder: Path):
        task = json.loads((folder / "task.json").read_text())
        self.free = task["free"]
        self.names = [free["name"] for free in self.free]
        self.spread = np.array([free["spread"] for free in self.free])
        self.center = np.array([free["center"] for free in self.free])
        self.start = np.array([free["start"] for free in self.free])
        self.tolerance = task["tolerance"]
        self.weights = np.fromfile(folder / "weights.f64")
        self.records = task["records"]
        for place, record in enumerate(self.records):
            for name in ("effort_nm", "position_rad", "smooth_rad", "velocity_rad_s"):
                record[name] = np.fromfile(folder / f"{place}-{name}.f64")
            smooth = record["smooth_rad"]
            record["v"] = np.diff(smooth) / record["step_s"]
            record["acceleration"] = np.diff(record["velocity_rad_s"]) / record["step_s"]
            q = record["position_rad"]
            record["second"] = q[2:] - 2.0 * q[1:-1] + q[:-2]
        # Records side by side, the shorter ones padded with rest.
        longest = max(len(record["v"]) for record in self.records)
        self.v = np.zeros((longest, 1, len(self.records)))
        self.step_s = np.array([record["step_s"] for record in self.records])
        for place, record in enumerate(self.records):
            self.v[: len(record["v"]), 0, place] = record["v"]
        self.speed = np.abs(self.v)
        # The friction of a step is that half-way through it.
        self.half_dq = 0.5 * self.v * self.step_s
        self.first_nm = np.array([record["effort_nm"][0] for record in self.records])

    def values(self, at):
        """Parameters by name, each a column with a row for every vector of `at`."""
        out = {}
        for i, free in enumerate(self.free):
            x = np.exp(at[:, i]) if free["logarithmic"] else at[:, i]
            out[free["name"]] = np.clip(x, *free["range"])[:, None]
        return out

    def friction(self, p):
        """Friction along the motion: time, vector, record."""
        coulomb = p["coulomb_nm"]
        stiction = coulomb * (1.0 + p["stiction_excess"])
        stiffness, damping = p["stiffness_nm_rad"], p["damping_nm_s_rad"]
        ratio = p["breakaway_ratio"]
        z_max = stiction / stiffness

        def z_ss_at(speed):
            x = speed / p["stribeck_velocity_rad_s"]
            return (coulomb + (stiction - coulomb) * np.exp(-(x * x))) / stiffness

        z_ss = z_ss_at(self.speed)
        z_break = ratio * z_ss
        per_range = 1.0 / (1.0 - ratio)
        dq = self.half_dq
        z = np.zeros(z_ss.shape[1:])
        # The load at the start is that of the effort, put on within a step.
        first = self.first_nm / stiffness
        first_z_ss = z_ss_at(np.abs(first / self.step_s))
        for _ in range(2):
            z, _ = deflect(z, 0.5 * first, first_z_ss, ratio * first_z_ss, z_max, per_range)
        deflections = np.empty_like(z_ss)
        plastics = np.empty_like(z_ss)
        for k in range(len(dq)):
            z, plastic = deflect(z, dq[k], z_ss[k], z_break[k], z_max, per_range)
            deflections[k] = z
            plastics[k] = plastic
            z, _ = deflect(z, dq[k], z_ss[k], z_break[k], z_max, per_range)
        return (
            stiffness * deflections
            + damping * (self.v - self.v * plastics)
            + p["viscous_nm_s_rad"] * self.v
        )

    def rest(self, at):
        """What is left over at each node, weighted, then the priors: a row for every vector of `at`."""
        p = self.values(at)
        friction = self.friction(p)
        columns = []
        for place, record in enumerate(self.records):
            n = len(record["v"])
            effort = later(record["effort_nm"], p["skew_s"] / record["step_s"], n)
            balance = effort + p["offset"] - friction[:n, :, place].T
            mean = 0.5 * (balance[:, :-1] + balance[:, 1:])
            nodes = mean - p["inertia_kg_m2"] / record["step_s"] ** 2 * record["second"]
            columns.append(kernel(nodes, record["kernel"]))
        priors = (at - self.center) / self.spread
        return np.hstack([np.hstack(columns) * self.weights, priors])

    def inside(self, at):
        """Coordinates brought back into their ranges."""
        at = np.array(at, dtype=float)
        for i, free in enumerate(self.free):
            ends = np.log(free["range"]) if free["logarithmic"] else free["range"]
            at[i] = np.clip(at[i], *ends)
        return at

    def residuals(self, at):
        return self.rest(self.inside(at)[None, :])[0]

    def jacobian(self, at):
        at = self.inside(at)
        steps = 1e-4 * self.spread
        for i in range(len(at)):
            moved = at.copy()
            moved[i] += steps[i]
            if self.inside(moved)[i] <= at[i] + 0.5 * steps[i]:
                steps[i] = -steps[i]
        rows = self.rest(np.vstack([at, at + np.diag(steps)]))
        return ((rows[1:] - rows[0]) / steps[:, None]).T


def deflect(z, dq, z_ss, z_break, z_max, per_range):
    """Deflection after a displacement, and the share of the displacement that was plastic."""
    half_way = z + 0.5 * dq
    along = np.where(dq < 0.0, -half_way, half_way)
    u = (along - z_break) / z_ss * per_range - 0.5
    s = u * u
    q = ((HALF_SINE[3] * s + HALF_SINE[2]) * s + HALF_SINE[1]) * s + HALF_SINE[0]
    alpha = 0.5 + u * (1.0 + (s - 0.25) * q)
    alpha = np.where(along >= z_ss, 1.0, np.where(along <= z_break, 0.0, alpha))
    share = (z + dq) / (z_ss + alpha * np.abs(dq))
    z = np.minimum(np.maximum(share * z_ss, -z_max), z_max)
    return z, alpha * np.abs(share)


def later(effort, samples, n):
    """Effort that acts later by a part of a sample, or several: a row for every value of `samples`."""
    k = np.arange(n)
    out = np.empty((len(samples), n))
    for row, by in enumerate(samples[:, 0]):
        whole = int(np.floor(by))
        part = by - whole
        at = np.clip(k - whole, 0, len(effort) - 1)
        before = np.clip(k - whole - 1, 0, len(effort) - 1)
        out[row] = (1.0 - part) * effort[at] + part * effort[before]
    return out


def kernel(values, length):
    """Three running means of `length`, then every `length`-th value."""
    if length > 1:
        for _ in range(3):
            sums = np.cumsum(np.pad(values, ((0, 0), (1, 0))), axis=1)
            values = (sums[:, length:] - sums[:, :-length]) / length
    return values[:, ::length]


def main():
    task = Task(Path(sys.argv[1]))
    at_start = float(np.sum(task.residuals(task.start) ** 2))
    begin = time.perf_counter()
    fit = least_squares(
        task.residuals,
        task.start,
        jac=task.jacobian,
        method="lm",
        ftol=task.tolerance,
        xtol=task.tolerance,
        gtol=1e-15,
    )
    seconds = time.perf_counter() - begin
    print(
        json.dumps(
            {
                "seconds": seconds,
                "cost_at_start": at_start,
                "cost": 2.0 * float(fit.cost),
                "evaluations": int(fit.nfev),
                "jacobians": int(fit.njev or 0),
                "most_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
                "values": dict(zip(task.names, [float(x[0, 0]) for x in task.values(task.inside(fit.x)[None, :]).values()])),
            }
        )
    )


if __name__ == "__main__":
    main()
