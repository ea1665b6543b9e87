"""What detail and drift do to a set's roughness, as a plot: knobs.py MESH"""

import argparse

import matplotlib.pyplot as plt
import numpy as np

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("mesh")
parser.add_argument("--steps", type=int, default=8)
parser.add_argument("--resolution", type=int, default=96)
arguments = parser.parse_args()

mesh = qjulia.read_mesh(arguments.mesh)
map = qjulia.shape(mesh)  # exact and at once; a fitted map has the same knobs

figure, axes = plt.subplots()
for drift in (0, 0.3, 0.6):
    details = np.geomspace(0.001, 0.03, arguments.steps)
    roughness = []
    for detail in details:
        turned = map.with_knobs(detail=detail, drift=drift)
        (row,) = qjulia.compare(turned, mesh, n=6, resolution=arguments.resolution)
        roughness.append(row["roughness"])
    axes.semilogx(details, roughness, marker="o", label=f"drift {drift}")
axes.set(xlabel="detail", ylabel="area of the set over the mesh's")
axes.legend()
figure.savefig("knobs.png")
