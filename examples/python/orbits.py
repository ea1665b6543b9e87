"""A picture of your own: where orbits of a plane go, in colors. orbits.py MAP

Black is inside. Outside, the hue is the direction in which a point's orbit has escaped, and the
brightness how soon. Contours show how near an orbit has come to the origin.
"""

import argparse

import numpy as np

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("map")
parser.add_argument("--width", type=int, default=480)
parser.add_argument("-n", type=int, default=8)
arguments = parser.parse_args()

map = qjulia.load(arguments.map)
x, y = np.meshgrid(np.linspace(-2, 2, arguments.width), np.linspace(2, -2, arguments.width))
points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

orbits = map.orbits(points, n=arguments.n, space="map")  # (points, n + 1, 4)
counts = map.escape_counts(points, n=arguments.n, space="map")
norms = np.linalg.norm(orbits, axis=2)
inside = norms[:, -1] < np.exp(map.surface_level)

hue = np.arctan2(orbits[:, -1, 1], orbits[:, -1, 0])
color = 0.5 + 0.5 * np.cos(hue[:, None] + np.array([0, 2, 4]) * np.pi / 3)
color *= (0.6 + 0.4 * counts / arguments.n)[:, None]
nearest = np.log(np.maximum(norms[:, 1:].min(axis=1), 1e-6))
color *= (0.85 + 0.15 * np.cos(4 * nearest))[:, None]
color[inside] *= 0.15

picture = (255 * color).astype(np.uint8).reshape(arguments.width, arguments.width, 3)
qjulia.save_png(picture, "orbits.png")
