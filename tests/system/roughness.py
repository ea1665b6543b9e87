"""What --target-area, --target-volume and --target-dimension reach, measured by tools/measure-roughness, which shares
no code with the program: areas and volumes to 2 %, dimensions to 0.02. And what cannot be reached is refused.

    roughness.py QJULIA MEASURE FOLDER
"""

import itertools
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

program, measure, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
CELLS = "96"


def grid_faces(rows, columns, is_closed):
    """Triangles of a grid of points that is closed both ways, or along its columns alone."""
    for i, j in itertools.product(range(rows if is_closed else rows - 1), range(columns)):
        a, b = i * columns + j, i * columns + (j + 1) % columns
        c, d = (a + columns) % (rows * columns), (b + columns) % (rows * columns)
        yield from ((a, c, b), (b, c, d))


def torus():
    u, v = np.meshgrid(np.arange(48) * np.pi / 24, np.arange(24) * np.pi / 12, indexing="ij")
    ring = 1 + 0.35 * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), 0.35 * np.sin(v)], -1).reshape(-1, 3)
    return points, list(grid_faces(48, 24, True))


def pole(radius_at):
    """A body about the z axis; its ends are cones."""
    z = np.linspace(-1.5, 1.5, 61)[1:-1]
    v = np.arange(32) * np.pi / 16
    r = radius_at(z)
    ring = np.stack([np.outer(r, np.cos(v)), np.outer(r, np.sin(v)), np.outer(z, np.ones(32))], -1)
    points = np.concatenate([ring.reshape(-1, 3), [[0, 0, -1.5], [0, 0, 1.5]]])
    last = 58 * 32
    faces = [(a, c, b) for a, b, c in grid_faces(59, 32, False)]
    for j in range(32):
        faces.append((len(points) - 2, (j + 1) % 32, j))
        faces.append((len(points) - 1, last + j, last + (j + 1) % 32))
    return points, faces


SHAPES = {
    "torus": torus(),
    "spindle": pole(lambda z: 0.6 * np.cos(z * np.pi / 3.2)),
    "dumbbell": pole(lambda z: 0.3 + 0.35 * np.abs(z) * (1.5 - np.abs(z))),
    "pin": pole(lambda z: np.where(z < 0, 0.6, 0.3)),
}


def run(*words, code=0):
    done = subprocess.run([program, *words], capture_output=True, text=True, cwd=folder)
    assert done.returncode == code, f"qjulia {' '.join(words)} ended with {done.returncode}: {done.stderr}"
    return done


def measured(qjulia_map, against):
    run("surface", qjulia_map, "-o", "s.ply", "--resolution", CELLS, "--device", "cpu")
    words = [sys.executable, measure, "s.ply", "--against", against, "--json"]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True, cwd=folder).stdout)


def near(value, wanted, tolerance, what):
    assert abs(value - wanted) <= tolerance, f"{what}: {value} is not {wanted} to {tolerance}"


folder.mkdir(parents=True, exist_ok=True)
for name, (points, faces) in SHAPES.items():
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    shape = ("shape", f"{name}.obj", "-o", f"{name}.qjulia.json", "--resolution", "64", "--target-resolution", CELLS,
             "--device", "cpu")
    run(*shape, "--target-area", "1.3", "--target-volume", "1")
    by_area = measured(f"{name}.qjulia.json", f"{name}.obj")
    near(by_area["area_ratio"], 1.3, 0.026, f"the area of {name}")
    near(by_area["volume_ratio"], 1, 0.02, f"the volume of {name}")
    run(*shape, "--target-dimension", "2.1")
    by_dimension = measured(f"{name}.qjulia.json", f"{name}.obj")
    near(by_dimension["dimension"], 2.1, 0.02, f"the dimension of {name}")

# Of a map alone, areas are over its smooth set's.
run("convert", "torus.qjulia.json", "c.qjulia.json", "--target-area", "1.2", "--target-resolution", CELLS, "--device", "cpu")
run("surface", "torus.qjulia.json", "-o", "smooth.ply", "--resolution", CELLS, "--iterations", "1", "--device", "cpu")
near(measured("c.qjulia.json", "smooth.ply")["area_ratio"], 1.2, 0.024, "the area of a converted map")

refused = run("convert", "torus.qjulia.json", "no.qjulia.json", "--target-area", "50", "--target-resolution", "64", code=2)
assert "--target-area" in refused.stderr and "at most" in refused.stderr, refused.stderr
assert not (folder / "no.qjulia.json").exists()

# info says the same of the map as of its surface.
told = json.loads(run("info", "c.qjulia.json", "--measure-roughness", "--json").stdout)["roughness"]
assert [scale["resolution"] for scale in told["scales"]] == [32, 64, 128, 256]
assert told["area_slope"] > 0 and 0 < told["porosity"]["share"] < 1, told
print("four shapes have the roughness that was asked for")
