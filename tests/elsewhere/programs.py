"""Meshes and volumes in Blender and in PrusaSlicer, where they are installed.

usage: programs.py QJULIA MAP FOLDER 1|0 (built with OpenVDB)
The map is the bunny of docs/maps: y is up, and its sides are as 2 : 1.98 : 1.55.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

SKIPPED = 77


def check(holds, what):
    if not holds:
        sys.exit(f"programs: {what}")


def run(*words):
    # Blender's Python looks for its modules beside the first python3 in PATH, which may be another.
    path = os.path.dirname(shutil.which(words[0])) + os.pathsep + os.environ["PATH"]
    done = subprocess.run(words, capture_output=True, text=True, env=dict(os.environ, PATH=path))
    check(done.returncode == 0, f"{words}: {done.stderr}")
    return done.stdout


def surface(program, map_file, path, *options):
    return json.loads(run(program, "surface", map_file, "-o", str(path), "--resolution", "64", "--device",
                          "cpu", "--json", *options))


def in_slicer(program, map_file, folder):
    told = surface(program, map_file, folder / "print.3mf", "--millimetres", "80", "--material", "trap")
    text = run("prusa-slicer", "--info", str(folder / "print.3mf"))
    facts = dict(re.findall(r"^(\w+) = +(\S+)$", text, re.MULTILINE))
    check(int(facts["number_of_facets"]) == told["triangles"], "facets in PrusaSlicer")
    check(int(facts["number_of_parts"]) == told["components"], "parts in PrusaSlicer")
    check(facts["manifold"] == "yes", "PrusaSlicer calls the .3mf not manifold")
    check("open_edges" not in facts and "facets_removed" not in facts, "PrusaSlicer repairs the .3mf")
    volume = told["figures"]["volume"]
    check(abs(float(facts["volume"]) - volume) < 1e-3 * volume, "the volume in PrusaSlicer")
    sizes = [float(facts[f"size_{axis}"]) for axis in "xyz"]
    check(sizes[1] < 0.85 * min(sizes[0], sizes[2]) and 75 < sizes[0] < 86, f"sizes in PrusaSlicer: {sizes}")


def in_blender(program, map_file, folder, has_openvdb):
    colored = ("--material", "trap")
    told = surface(program, map_file, folder / "scene.glb", "--metres", "0.2", *colored)
    surface(program, map_file, folder / "millimetres.glb", "--millimetres", "200")
    surface(program, map_file, folder / "turned.ply", "--up", "z", "--metres", "0.2", *colored)
    surface(program, map_file, folder / "turned.obj", "--up", "y", "--metres", "0.2", *colored)
    surface(program, map_file, folder / "print.stl", "--metres", "0.2")
    names = ["scene.glb", "millimetres.glb", "turned.ply", "turned.obj", "print.stl"]
    if has_openvdb:
        surface(program, map_file, folder / "cloud.vdb", "--up", "z")
        names.append("cloud.vdb")
    text = run("blender", "-b", "--factory-startup", "--python",
               str(Path(__file__).with_name("blender_import.py")), "--", *(str(folder / n) for n in names))
    found = [json.loads(line.split(" ", 1)[1]) for line in text.splitlines() if line.startswith("IMPORTED ")]
    check(len(found) == len(names), f"Blender did not import all: {text}")
    found = dict(zip(names, found))
    heights = []
    for name in names[:5]:
        mesh = found[name]
        x, y, z = mesh["size"]
        check(0.19 < x < 0.215 and 0.19 < z < 0.215 and y < 0.85 * x, f"{name} is {mesh['size']} in Blender")
        check(mesh["triangles"] == told["triangles"], f"triangles of {name} in Blender")
        heights.append(mesh["median_height"])
    # None is on its head.
    check(max(heights) - min(heights) < 0.02, f"which way up: {heights}")
    glb = found["scene.glb"]
    check(glb["object"] == glb["data"] == Path(map_file).name.split(".")[0], f"names in Blender: {glb}")
    check(found["turned.obj"]["object"] == glb["object"], f"the name of the .obj: {found['turned.obj']}")
    for name in ("scene.glb", "turned.ply", "turned.obj"):
        check(found[name]["colors"] == 1, f"colours of {name} in Blender")
    check(glb["materials"] == found["turned.obj"]["materials"] == 1, "materials in Blender")
    check(glb["smooth"] and found["turned.obj"]["smooth"], "the .glb and the .obj are not smooth in Blender")
    check(glb["vertices"] == told["vertices"], "vertices of the .glb in Blender")
    if has_openvdb:
        check(found["cloud.vdb"]["grids"] == ["surface"], f"grids in Blender: {found['cloud.vdb']}")


def main():
    program, map_file, folder, has_openvdb = sys.argv[1:]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    missing = [name for name in ("prusa-slicer", "blender") if not shutil.which(name)]
    if "prusa-slicer" not in missing:
        in_slicer(program, map_file, folder)
    if "blender" not in missing:
        in_blender(program, map_file, folder, has_openvdb == "1")
    if missing:
        print("programs: not installed:", ", ".join(missing), "(tools/install-dependencies --all)")
        sys.exit(SKIPPED)


main()
