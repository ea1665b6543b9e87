"""The idea of the method in five small pictures: idea.py MESH MAP PICTURE

A mesh; the map's roots and poles; the potential F₁ in a slice, whose thick curve is the shape; where one iterate takes
points of that slice; and the Julia set.
"""

import argparse
from typing import Any

import matplotlib
import numpy as np

import qjulia

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.patches import Circle  # noqa: E402

INSIDE, OUTSIDE = "#3a6ea5", "#c0504d"

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("mesh")
parser.add_argument("map")
parser.add_argument("picture")
parser.add_argument("--size", type=int, default=300, help="of a panel's picture, in pixels")
arguments = parser.parse_args()

map = qjulia.load(arguments.map)
level = map.surface_level
size = (arguments.size, arguments.size)
figure = pyplot.figure(figsize=(12.5, 2.9), dpi=100)


def panel(place: int, title: str, **keywords: Any) -> Any:
    axes = figure.add_subplot(1, 5, place, **keywords)
    axes.set_title(title, fontsize=10)
    axes.set_axis_off()
    return axes


panel(1, "a mesh").imshow(qjulia.render(arguments.mesh, size=size))

# The shape's y is up, and the camera looks from the front.
factors = map.factors
center = factors["center"]
axes = panel(2, "factors: roots and poles", projection="3d")
places = np.column_stack([center[:, 0], -center[:, 2], center[:, 1]])
axes.scatter(
    *places.T,
    s=6,
    c=np.where(factors["exponent"] > 0, INSIDE, OUTSIDE),
)
axes.view_init(15, -70)
axes.set_box_aspect((1, 1, 1), zoom=1.35)
# All but the farthest factors, in a cube.
low, high = np.quantile(places, [0.02, 0.98], axis=0)
half = 0.55 * np.max(high - low)
axes.set(**{name: (c - half, c + half) for name, c in zip(("xlim", "ylim", "zlim"), (low + high) / 2)})

x, y = np.meshgrid(np.linspace(-2, 2, 160), np.linspace(-2, 2, 160))
plane = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
values = map.field(plane, n=1, space="map")
axes = panel(3, "the potential F₁ in a slice")
field = (values - level).reshape(x.shape)
curves = np.quantile(field, np.linspace(0.02, 0.98, 16))
axes.contour(x, y, field, levels=curves, cmap="RdBu_r", linewidths=0.7)
axes.contour(x, y, field, levels=[0], colors="black", linewidths=2)
axes.set_aspect("equal")

some = np.random.default_rng(1).permutation(len(plane))[:4000]
images = map.orbits(plane[some], n=1, space="map")[:, 1]
radius = np.exp(level)
distance = np.linalg.norm(images, axis=1)
# By distance and one direction: the images lie in four dimensions.
angle = np.arctan2(images[:, 1], images[:, 0])
axes = panel(4, "one iterate")
shown = np.minimum(distance, 2.5 * radius)
axes.scatter(
    shown * np.cos(angle), shown * np.sin(angle), s=1.5, c=np.where(distance < radius, INSIDE, OUTSIDE)
)
axes.add_patch(Circle((0, 0), radius, fill=False, color="black", linewidth=2))
axes.set_aspect("equal")

panel(5, "the set").imshow(qjulia.render(map, size=size))
figure.subplots_adjust(0.005, 0.01, 0.995, 0.9, 0.03)
figure.savefig(arguments.picture)
