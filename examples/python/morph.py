"""One shape becomes another, factor by factor: morph.py FROM TO"""

import argparse

import numpy as np
from scipy.optimize import linear_sum_assignment

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("meshes", nargs=2)
parser.add_argument("--factors", type=int, default=100)
parser.add_argument("--schedule", default="tight")
parser.add_argument("--frames", type=int, default=5)
parser.add_argument("--width", type=int, default=240)
arguments = parser.parse_args()

first, last = (
    qjulia.fit(mesh, factors=arguments.factors, schedule=arguments.schedule).map
    for mesh in arguments.meshes
)

# Factors that are near each other and alike belong together.
a, b = first.factors, last.factors
distance = np.linalg.norm(a["center"][:, None] - b["center"], axis=2)
distance += np.abs(a["exponent"][:, None] - b["exponent"]) / np.abs(a["exponent"]).mean()
b = b[linear_sum_assignment(distance)[1]]

frames = []
for t in np.linspace(0, 1, arguments.frames):
    factors = a.copy()
    for name in ("center", "exponent"):
        factors[name] = (1 - t) * a[name] + t * b[name]
    map = first.with_factors(
        factors,
        log_scale=(1 - t) * first.log_scale + t * last.log_scale,
        surface_level=(1 - t) * first.surface_level + t * last.surface_level,
    )
    frames.append(qjulia.render(map, size=(arguments.width, arguments.width)))
qjulia.save_png(np.concatenate(frames, axis=1), "morph.png")
