"""Fits a map to a mesh, and draws it: fit_and_draw.py MESH"""

import argparse

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("mesh")
parser.add_argument("--factors", type=int, default=200)
parser.add_argument("--schedule", default="tight")
parser.add_argument("--width", type=int, default=640)
arguments = parser.parse_args()

result = qjulia.fit(
    arguments.mesh, factors=arguments.factors, schedule=arguments.schedule, on_stage=print
)
print(result)
result.map.save("shape.qjulia.json")

picture = qjulia.render(result.map, size=(arguments.width, arguments.width * 3 // 4), azimuth=40)
qjulia.save_png(picture, "shape.png")

surface = result.map.surface(resolution=arguments.width // 4)
surface.save("shape.ply")
print(f"shape.png, shape.ply with {len(surface.faces)} triangles, shape.qjulia.json")
