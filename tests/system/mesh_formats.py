"""What `qjulia surface` and `sample` write, read by other means than the program's own.

usage: mesh_formats.py QJULIA FOLDER MAP 1|0 (built with OpenVDB)
"""

import json
import re
import struct
import subprocess
import sys
import xml.etree.ElementTree as xml
import zipfile
from pathlib import Path

import numpy as np

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
COLORS = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"


def check(holds, what):
    if not holds:
        sys.exit(f"mesh_formats: {what}")


def near(a, b, share=1e-3):
    return abs(a - b) <= share * abs(b)


class Bench:
    def __init__(self, program, folder, map_file, has_openvdb):
        self.program, self.folder, self.map = program, Path(folder), map_file
        self.has_openvdb = has_openvdb
        self.name = Path(map_file).name.split(".")[0]
        self.folder.mkdir(parents=True, exist_ok=True)

    def run(self, command, name, *options, code=0):
        words = [self.program, command, self.map, "-o", str(self.folder / name), "--resolution", "48",
                 "--device", "cpu", "--json", *options]
        done = subprocess.run(words, capture_output=True, text=True)
        check(done.returncode == code, f"{name}: exit code {done.returncode}: {done.stderr}")
        return json.loads(done.stdout) if code == 0 else done.stderr


def volume_of(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def check_closed(triangles, what):
    """Each edge has a partner that goes the other way."""
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    there, back = {tuple(e) for e in edges}, {tuple(e) for e in edges[:, ::-1]}
    check(len(there) == len(edges) and there == back, f"{what} is not closed")


def read_3mf(path):
    """Points in millimetres, triangles and colours of corners, of all objects."""
    with zipfile.ZipFile(path) as archive:
        check(archive.testzip() is None, "a checksum of the .3mf is wrong")
        model = xml.fromstring(archive.read("3D/3dmodel.model"))
        xml.fromstring(archive.read("[Content_Types].xml"))
        xml.fromstring(archive.read("_rels/.rels"))
    check(model.get("unit") == "millimeter", "the unit of the .3mf")
    points, triangles, corners, first = [], [], [], 0
    for part in model.iter(CORE + "object"):
        own = [[float(v.get(k)) for k in "xyz"] for v in part.iter(CORE + "vertex")]
        for t in part.iter(CORE + "triangle"):
            triangles.append([first + int(t.get(k)) for k in ("v1", "v2", "v3")])
            corners.append([int(t.get(k, -1)) for k in ("p1", "p2", "p3")])
        points += own
        first += len(own)
    palette = [c.get("color") for c in model.iter(COLORS + "color")]
    return np.array(points), np.array(triangles), np.array(corners), palette, model


def read_usda(path):
    """The lists and the values of a .usda, by name: a reader of what it has to hold."""
    text = path.read_text()
    check(text.startswith("#usda 1.0\n"), "the .usda does not say what it is")
    depth = 0
    for bracket in re.sub(r'"(\\.|[^"\\])*"', "", text):
        depth += (bracket in "([{") - (bracket in ")]}")
        check(depth >= 0, "brackets of the .usda do not match")
    check(depth == 0, "brackets of the .usda do not match")

    def numbers(name, width):
        found = re.search(re.escape(name) + r" = \[([^\]]*)\]", text)
        check(found, f"the .usda has no {name}")
        flat = np.array([float(x) for x in re.findall(r"[-+.\de]+", found[1])])
        return flat.reshape(-1, width)

    return text, numbers


def read_glb(path):
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + length]), data[28 + length:]


def check_3mf(bench):
    told = bench.run("surface", "print.3mf", "--millimetres", "80", "--material", "trap")
    points, triangles, corners, palette, model = read_3mf(bench.folder / "print.3mf")
    check(len(triangles) == told["triangles"], "triangles of the .3mf")
    check(len(points) == told["vertices"], "vertices of the .3mf")
    check_closed(triangles, "the .3mf")
    check(near(volume_of(points, triangles), told["figures"]["volume"]), "volume of the .3mf")
    check(len(list(model.iter(CORE + "object"))) == told["components"], "objects of the .3mf")
    check(corners.min() >= 0 and corners.max() < len(palette) and len(palette) > 20,
          "colours of the .3mf")
    note = [m.text for m in model.iter(CORE + "metadata") if m.get("name") == "Description"]
    check(json.loads(note[0])["job"]["options"]["material"] == "trap", "the note of the .3mf")


def check_usda(bench):
    told = bench.run("surface", "scene.usda", "--metres", "0.5", "--material", "trap")
    text, numbers = read_usda(bench.folder / "scene.usda")
    points, normals = numbers("point3f[] points", 3), numbers("normal3f[] normals", 3)
    triangles = numbers("int[] faceVertexIndices", 3).astype(int)
    colors = numbers("color3f[] primvars:displayColor", 3)
    check(len(points) == len(normals) == len(colors) == told["vertices"], "vertices of the .usda")
    check(len(triangles) == len(numbers("int[] faceVertexCounts", 1)) == told["triangles"],
          "triangles of the .usda")
    check((numbers("int[] faceVertexCounts", 1) == 3).all(), "corners of the .usda's triangles")
    check(near(volume_of(points, triangles), told["figures"]["volume"]), "volume of the .usda")
    check(near(np.ptp(points, axis=0).max(), 0.5, 0.05), "the size of the .usda")
    check(np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-4), "normals of the .usda")
    check(colors.min() >= 0 and colors.max() <= 1 and np.ptp(colors) > 0.1, "colours of the .usda")
    for line in ("metersPerUnit = 1\n", 'upAxis = "Y"', "def Camera", f'defaultPrim = "{bench.name}"'):
        check(line in text, f"the .usda does not say {line}")


def check_others(bench):
    bench.run("surface", "scene.glb", "--millimetres", "80")
    scene, _ = read_glb(bench.folder / "scene.glb")
    check(scene["nodes"][0]["name"] == scene["meshes"][0]["name"] == bench.name, "names of the .glb")
    check(scene["nodes"][0]["scale"] == [0.001] * 3, "the unit of the .glb")
    check("NORMAL" in scene["meshes"][0]["primitives"][0]["attributes"], "normals of the .glb")

    bench.run("surface", "painted.obj", "--material", "trap", "--up", "z")
    lines = (bench.folder / "painted.obj").read_text().splitlines()
    check(f"o {bench.name}" in lines and "mtllib painted.mtl" in lines, "names of the .obj")
    check("\nKd " in (bench.folder / "painted.mtl").read_text(), "the material of the .obj")
    bench.run("surface", "own.obj", "--material", "trap")
    turned, own = ([line.split()[1:4] for line in (bench.folder / name).read_text().splitlines()
                    if line.startswith("v ")] for name in ("painted.obj", "own.obj"))
    turned, own = np.array(turned, float), np.array(own, float)
    # The map's y is up: (x, y, z) becomes (x, -z, y).
    check(np.allclose(turned, np.stack([own[:, 0], -own[:, 2], own[:, 1]], 1)), "the .obj's up")
    # By way of files on the disk and by way of memory.
    for options in ((), ("--largest-component",)):
        told = bench.run("surface", "up.ply", "--up", "z", *options)
        check(told["made_with"]["job"]["options"]["up"] == "z", "the .ply does not say how it is turned")
        data = (bench.folder / "up.ply").read_bytes()
        records = np.frombuffer(data, "<f4", 6 * told["vertices"], data.index(b"end_header\n") + 11)
        points = records.reshape(-1, 6)
        check(np.allclose(points[:, :3], turned[:len(points)], atol=1e-6), "the .ply's up")
        check(np.einsum("ij,ij->i", points[:, :3], points[:, 3:]).mean() > 0, "the .ply's normals")


def check_volumes(bench):
    if not bench.has_openvdb:
        refused = bench.run("surface", "no.vdb", code=2)
        check("built without OpenVDB" in refused, "a program without OpenVDB does not say so")
        check(not (bench.folder / "no.vdb").exists(), "a .vdb was written without OpenVDB")
        return
    try:
        import pyopenvdb as vdb
    except ImportError:
        print("mesh_formats: python3-openvdb is missing, .vdb files are not read")
        return
    told = bench.run("surface", "ball.vdb")
    grids, about = vdb.readAll(str(bench.folder / "ball.vdb"))
    check([g.name for g in grids] == ["surface"], "grids of the level set")
    check(json.loads(about["made_with"])["job"]["options"]["resolution"] == 48, "the note of the .vdb")
    surface = grids[0]
    voxel = surface.transform.voxelSize()[0]
    check(surface.gridClass == vdb.GridClass.LEVEL_SET, "the class of the level set")
    check(near(surface.background, 3 * voxel), "the band of the level set")
    # The share of each voxel that lies inside, from its distance.
    low, high = surface.evalActiveVoxelBoundingBox()
    values = np.empty(np.subtract(high, low) + 1, np.float32)
    surface.copyToArray(values, low)
    inside = np.clip(0.5 - values / voxel, 0, 1).sum() * voxel**3
    check(near(inside, told["figures"]["volume"], 0.02), "the volume of the level set")

    told = bench.run("sample", "field.vdb")
    bench.run("sample", "field.npy")
    field = np.load(bench.folder / "field.npy")
    grids = {g.name: g for g in vdb.readAll(str(bench.folder / "field.vdb"))[0]}
    check(set(grids) == {"F", "density"}, "grids of the field")
    values = np.empty(field.shape, np.float32)
    grids["F"].copyToArray(values)
    check((values == field).all(), "F of the .vdb is not that of the .npy")
    level = told["surface_level"]
    grids["density"].copyToArray(values)
    check(np.allclose(values, np.clip(level - field, 0, 1), atol=1e-6), "density")
    box = np.array(told["box"])
    cell = (box[1] - box[0]) / field.shape
    place = grids["F"].transform.indexToWorld((1, 2, 3))
    check(np.allclose(place, box[0] + cell * [1.5, 2.5, 3.5]), "places of the field")


def main():
    program, folder, map_file, has_openvdb = sys.argv[1:]
    bench = Bench(program, folder, map_file, has_openvdb == "1")
    check_3mf(bench)
    check_usda(bench)
    check_others(bench)
    check_volumes(bench)


main()
