"""Samples and an optimiser of your own in place of the program's: own_optimiser.py MESH"""

import argparse

import numpy as np
from scipy.optimize import minimize

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("mesh")
parser.add_argument("--factors", type=int, default=64)
parser.add_argument("--samples", type=int, default=20000)
parser.add_argument("--iterations", type=int, default=200)
arguments = parser.parse_args()

mesh = qjulia.read_mesh(arguments.mesh)
size = np.ptp(mesh.vertices, axis=0).max()

# The program places the factors, and hardly moves them in one evaluation.
placed = qjulia.fit(mesh, factors=arguments.factors, max_evaluations=1).map

# Points about the surface, each on a side of it.
points, normals = qjulia.sample_surface(mesh, arguments.samples)
random = np.random.default_rng(1)
points += 0.1 * size * random.normal(size=(len(points), 1)) * normals
sides = np.where(qjulia.signed_distance(mesh, points) < 0, -1, 1)

energy = qjulia.Energy(placed, points, sides=sides, loss="tanh", alpha=10)
found = minimize(
    energy.value_and_gradient,
    energy.x0,
    jac=True,
    method="L-BFGS-B",
    options={"maxiter": arguments.iterations},
)
print(f"energy {energy.value(energy.x0):.4f} -> {found.fun:.4f} in {found.nfev} evaluations")

best = energy.map_at(found.x).calibrated()
best.save("own.qjulia.json")
print(f"IoU {qjulia.compare(best, mesh, n=1, resolution=64)[0]['iou']:.4f}")
