"""The add-on for Blender, in Blender without windows; blender_addon_test.py starts it.

after "--": QJULIA ZIP MAP FOLDER, and "killed" where Blender is to die while the program runs
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy

PROGRAM, ARCHIVE, MAP, FOLDER = sys.argv[sys.argv.index("--") + 1:][:4]
folder = Path(FOLDER)
CELLS = 32


def check(holds, what):
    print(("ok      " if holds else "FAILED  ") + what, flush=True)
    if not holds:
        sys.exit(f"blender_addon: {what}")


def refusal(call, **options):
    """What an operator reports as an error; empty where it does its work."""
    try:
        call(**options)
        return ""
    except RuntimeError as error:
        return str(error)


def program(name, text):
    path = folder / name
    path.write_text("#!/usr/bin/python3\n" + text)
    path.chmod(0o755)
    return str(path)


def children():
    """Numbers of this process's descendants that are the program."""
    parents, found = {}, []
    for entry in Path("/proc").iterdir():
        try:
            parents[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            if os.path.realpath(PROGRAM) == os.path.realpath(entry / "exe"):
                found.append(int(entry.name))
        except (OSError, ValueError):
            continue

    def is_own(number):
        while number in parents and number != os.getpid():
            number = parents[number]
        return number == os.getpid()

    return [number for number in found if is_own(number)]


def vertices(obj):
    values = numpy.empty(3 * len(obj.data.vertices), numpy.float32)
    obj.data.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def colors(obj):
    layer = obj.data.color_attributes["Color"]
    values = numpy.empty(4 * len(layer.data), numpy.float32)
    layer.data.foreach_get("color_srgb", values)
    return values.reshape(-1, 4)[:, :3]


def differ(a, b):
    return a.shape != b.shape or bool(numpy.abs(a - b).max() > 1e-4)


def imported(name):
    """Vertices and colours as the program's command makes them, by its own reading of .ply files."""
    data = (folder / name).read_bytes()
    head, body = data.split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    kinds = {b"float": "<f4", b"uchar": "u1"}
    fields = [(words[2].decode(), kinds[words[1]]) for line in head.split(b"element face")[0].splitlines()
              if (words := line.split())[0] == b"property"]
    rows = numpy.frombuffer(body, numpy.dtype(fields), count)
    points = numpy.stack([rows["x"], rows["y"], rows["z"]], 1)
    painted = numpy.stack([rows[c] for c in ("red", "green", "blue")], 1) / 255 if "red" in rows.dtype.names else None
    return points, painted


def check_errors(preferences):
    """Programs that are missing, wrong or too old."""
    for given, told in ((str(folder / "nowhere"), "is not a program"),
                        (program("old", "import sys; sys.exit('explore: unknown command')"), "is too old"),
                        (program("silent", ""), "ended without a word"),
                        (program("pageless", "import http.server\n"
                                 "class Page(http.server.BaseHTTPRequestHandler):\n"
                                 "  def do_GET(self): self.send_response(200); self.end_headers()\n"
                                 "  def log_message(*_): pass\n"
                                 "server = http.server.HTTPServer(('127.0.0.1', 0), Page)\n"
                                 "print(f'http://127.0.0.1:{server.server_port}/?token=12', flush=True)\n"
                                 "server.serve_forever()"), "holds no table of knobs")):
        preferences.program = given
        said = refusal(bpy.ops.qjulia.add, filepath=MAP)
        check(told in said, f"a program is refused: {said.strip()}")
    preferences.program = PROGRAM
    said = refusal(bpy.ops.qjulia.add, filepath=str(folder / "nothing.qjulia.json"))
    check("does not exist" in said, f"a map that is missing is told: {said.strip()}")
    (folder / "broken.qjulia.json").write_text("{")
    said = refusal(bpy.ops.qjulia.add, filepath=str(folder / "broken.qjulia.json"))
    check("broken.qjulia.json" in said, f"a map that is none is told by the program: {said.strip()}")
    check(not [obj for obj in bpy.data.objects if obj.qjulia.map_file], "and nothing is added")


def added():
    check(refusal(bpy.ops.qjulia.add, filepath=MAP) == "", "the map is added")
    obj = bpy.context.object
    obj.qjulia.preview_cells, obj.qjulia.final_cells = CELLS, CELLS + 16
    obj["qjulia_detail"] = 0.03
    return obj


def check_knobs(obj, live):
    live.wait()
    settings = json.loads((folder / "settings.json").read_text())
    names = {control["name"] for setting in settings["map"] for control in setting["controls"]}
    missing = [name for name in names if f"qjulia_{name}" not in obj]
    check(len(names) > 5 and not missing, f"every knob of the map is a property: {len(names)}, without {missing}")
    limits = obj.id_properties_ui("qjulia_detail").as_dict()
    control = next(c for s in settings["map"] for c in s["controls"] if c["name"] == "detail")
    check(limits["soft_max"] == control["most"] and limits["description"] == control["help"], "with range and help")

    turned, _ = imported("detail.ply")
    check(not differ(vertices(obj), turned), f"the mesh is that of 'surface --detail', upright: {len(turned)} vertices")
    before = vertices(obj)
    obj["qjulia_phase1"] = 40.0
    obj["qjulia_rotate"], obj["qjulia_axis"] = 30.0, "y"
    live.wait()
    turned, _ = imported("phase.ply")
    check(differ(vertices(obj), before) and not differ(vertices(obj), turned), "as is one with phase and rotation turned")

    obj["qjulia_detail"] = 40.0
    live.wait()
    check("detail" in live.message(obj) and not differ(vertices(obj), turned),
          f"a value is refused, and the mesh stays: {live.message(obj)}")
    said = refusal(bpy.ops.qjulia.final)
    check("detail" in said and "out of range" in said, f"the report says so: {said.strip()}")
    bpy.ops.qjulia.reset()
    live.wait()
    check(live.message(obj) == "" and obj["qjulia_rotate"] == 0, "knobs are reset")


def check_drag(obj, live, server):
    """Many values in a row: few meshes, and the last value's in the end."""
    asked, mesh = [], server.Server.mesh
    server.Server.mesh = lambda *words: asked.append(words[1]) or mesh(*words)
    began = time.monotonic()
    longest = 0.0
    for step in range(100):
        obj["qjulia_drift"] = 0.003 * (step + 1)
        begin = time.monotonic()
        live.tick()
        longest = max(longest, time.monotonic() - begin)
        time.sleep(0.01)
    live.wait()
    server.Server.mesh = mesh
    check(2 <= len(asked) < 90 and asked[-1] == {"drift": "0.3"},
          f"100 values in {time.monotonic() - began:.1f} s: {len(asked)} previews, {asked[-1]} last, "
          f"none kept Blender longer than {longest:.2f} s")
    bpy.ops.qjulia.reset()
    live.wait()


def check_cut(obj, live):
    whole = numpy.ptp(vertices(obj), axis=0)
    obj["qjulia_cuty"] = 50.0
    live.wait()
    sides = numpy.ptp(vertices(obj), axis=0) / whole
    check(abs(sides[2] - 0.5) < 0.1 and min(sides[0], sides[1]) > 0.6, f"the upper half is cut away: {sides}")
    bpy.ops.qjulia.reset()
    live.wait()


def check_final(obj, live):
    before = len(obj.data.vertices)
    bpy.ops.qjulia.final()
    check(len(obj.data.vertices) > 1.5 * before and live.is_current(obj), "a final mesh is finer")
    live.wait()
    bpy.context.scene.frame_set(2)
    check(live.is_current(obj), "and stays while no knob is turned")


def check_colors(obj, live):
    check(len(numpy.unique(colors(obj).round(2), axis=0)) == 1, "clay has one colour")
    bpy.ops.qjulia.choose(control="material", word="trap")
    bpy.ops.qjulia.choose(control="palette", word="ember")
    live.wait()
    _, expected = imported("trap.ply")
    check(live.message(obj) == "" and numpy.abs(colors(obj) - expected).max() < 0.006,
          "colours are those of 'surface --material trap'")
    check(obj.data.materials[0].node_tree.nodes["Color Attribute"].layer_name == "Color", "and a material shows them")


def check_keys(obj, scene):
    scene.frame_start, scene.frame_end = 1, 3
    for frame, value in ((1, 0.01), (3, 0.05)):
        obj["qjulia_detail"] = value
        obj.keyframe_insert('["qjulia_detail"]', frame=frame)
    meshes = []
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        meshes.append(vertices(obj))
    check(all(differ(a, b) for a, b in ((meshes[0], meshes[1]), (meshes[1], meshes[2]), (meshes[0], meshes[2]))),
          f"key-framed knobs: a mesh for each frame, of {[len(m) for m in meshes]} vertices")
    scene.frame_set(1)
    check(not differ(vertices(obj), meshes[0]), "and the first again")


def pixels(path):
    image = bpy.data.images.load(str(path))
    values = numpy.array(image.pixels[:]).reshape(-1, 4)
    return values


def prepare_picture(scene):
    for obj in list(scene.objects):
        if not obj.qjulia.map_file and obj.type == "MESH":
            bpy.data.objects.remove(obj)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 4, False, "CPU"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 96, 100
    scene.render.film_transparent = True
    camera, light = scene.camera, next(o for o in scene.objects if o.type == "LIGHT")
    camera.location, camera.rotation_euler = (0, -4.2, 0.6), (1.43, 0, 0)
    light.data.type, light.data.energy, light.rotation_euler = "SUN", 3, (0.6, 0.5, 0)


def check_pictures(obj, scene, name):
    """Frames are rendered with their own meshes."""
    scene.render.filepath = str(folder / f"{name}_")
    bpy.ops.render.render(animation=True)
    first, _, last = (pixels(folder / f"{name}_{frame:04d}.png") for frame in (1, 2, 3))
    covered = (first[:, 3] > 0.5).mean()
    check(0.15 < covered < 0.8, f"a picture of the set, which covers {covered:.2f} of it")
    inside = first[first[:, 3] > 0.9][:, :3]
    check(inside.std(axis=0).max() > 0.05 and numpy.abs(inside[:, 0] - inside[:, 2]).mean() > 0.05, "in colours")
    check(numpy.abs(first - last).mean() > 0.01, "another in another frame")


def check_camera(obj, scene):
    """A film by the camera's keys shows what Blender has rendered."""
    camera = scene.camera
    said = refusal(bpy.ops.qjulia.camera, filepath=str(folder / "nowhere" / "camera.csv"))
    check("nowhere" in said, f"a table without a folder: {said.strip()}")
    old_place, old_turn = camera.location.copy(), camera.rotation_euler.copy()
    camera.rotation_euler = (1.43, 0.3, 0)
    said = refusal(bpy.ops.qjulia.camera, filepath=str(folder / "camera.csv"))
    check("tilted to one side" in said, f"a camera that rolls: {said.strip()}")
    camera.rotation_euler = (1.43, 0, 3)
    said = refusal(bpy.ops.qjulia.camera, filepath=str(folder / "camera.csv"))
    check("looks away" in said, f"a camera that looks elsewhere: {said.strip()}")
    for frame, x, turn in ((1, 0, 0), (3, 2, 0.45)):
        camera.location, camera.rotation_euler = (x, -4.2, 0.6), (1.43, 0, turn)
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_euler", frame=frame)
    check(refusal(bpy.ops.qjulia.camera, filepath=str(folder / "camera.csv")) == "", "a camera becomes a table of keys")
    rows = (folder / "camera.csv").read_text().splitlines()
    check(len(rows) == 4 and rows[0].startswith("at,azimuth,elevation"), f"of all frames: {rows}")
    (folder / "film.toml").write_text(
        f'[film]\nmap = "{MAP}"\nkeys = "camera.csv"\nseconds = {3 / scene.render.fps}\nrate = {scene.render.fps}\n'
        'step = "linear"\n[options]\nsize = "96x96"\nsamples = 1\nbackground = "transparent"\nno_ground = true\n')
    subprocess.run([PROGRAM, "film", "make", str(folder / "film.toml"), "-o", str(folder / "film"), "--device", "cpu",
                    "--quiet"], check=True)
    scene.render.filepath = str(folder / "keyed_")
    bpy.ops.render.render(animation=True)
    for frame in (1, 2, 3):
        ours = pixels(folder / f"film/frame_{frame:04d}.png")[:, 3] > 0.5
        theirs = pixels(folder / f"keyed_{frame:04d}.png")[:, 3] > 0.5
        alike = (ours & theirs).sum() / (ours | theirs).sum()
        check(alike > 0.9, f"in frame {frame} the film shows what Blender does: IoU {alike:.3f}")
    camera.animation_data_clear()
    camera.location, camera.rotation_euler = old_place, old_turn


def check_bake(obj, scene, live, preferences):
    obj.qjulia.bake_folder = ""
    said = refusal(bpy.ops.qjulia.bake)
    check("save the .blend file first" in said, f"without a folder: {said.strip()}")
    obj.qjulia.bake_folder = str(folder / "baked")
    check(refusal(bpy.ops.qjulia.bake) == "" and obj.qjulia.uses_bake, "frames are baked")
    names = sorted(path.name for path in (folder / "baked").iterdir())
    check(names == [f"frame_{frame:06d}.ply" for frame in (1, 2, 3)], f"to files: {names}")
    live.forget()
    preferences.program = "/nowhere"
    meshes = []
    for frame in (1, 2, 3, 9):
        scene.frame_set(frame)
        meshes.append(vertices(obj))
    check(differ(meshes[0], meshes[1]) and differ(meshes[1], meshes[2]), "and play without the program")
    check(not differ(meshes[2], meshes[3]) and live.message(obj) == "", "the last one holds afterwards")
    check_pictures(obj, scene, "baked")
    off = [float(numpy.abs(pixels(folder / f"baked_{frame:04d}.png") - pixels(folder / f"live_{frame:04d}.png")).max())
           for frame in (1, 2, 3)]
    check(max(off) < 0.01, f"pictures of baked meshes are those of live ones: {off}")
    preferences.program = PROGRAM
    obj.qjulia.uses_bake = False


def check_saved(obj, live):
    """A file that is opened again has the object, its knobs and its mesh."""
    live.wait()
    before, name = vertices(obj), obj.name
    path = str(folder / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    started = children()
    check(len(started) == 1, "one program runs for one map")
    bpy.ops.wm.open_mainfile(filepath=path)
    check(not Path(f"/proc/{started[0]}").exists(), "and ends when a file is opened")
    obj = bpy.data.objects[name]
    live.tick()
    check(not differ(vertices(obj), before) and not children(), "what was saved is not made again")
    obj["qjulia_scale"] = 1.2
    obj.animation_data_clear()
    live.wait()
    check(differ(vertices(obj), before) and len(children()) == 1, "a knob starts it again")


def check_crash(obj, live, server):
    """A program that has ended, or does not answer, is started again for the next preview."""
    before, started = vertices(obj), children()
    os.kill(started[0], signal.SIGKILL)
    while children():
        time.sleep(0.01)
    obj["qjulia_scale"] = 1.3
    live.wait()
    check(live.message(obj) == "" and differ(vertices(obj), before) and len(children()) == 1 and children() != started,
          f"a program that was killed is started again: {live.message(obj)}")

    before, started = vertices(obj), children()
    choice = live.Wanted(obj, {}, CELLS).choice
    lost = live.servers.of(choice)
    lost._port = 1  # where nobody listens
    try:
        lost.mesh({}, CELLS)
        check(False, "a program that does not answer is told")
    except server.ProgramError as error:
        check("does not answer" in str(error) and not lost.is_running(), f"a program does not answer: {error}")
    obj["qjulia_scale"] = 1.1
    live.wait()
    check(live.message(obj) == "" and differ(vertices(obj), before), "the next preview has a new one")
    check(len(children()) == 1 and children() != started, "and the old one has ended")

    # A program that is killed still accepts connections until its last thread has ended.
    before = vertices(obj)
    live.servers.of(choice)._port = 1
    obj["qjulia_scale"] = 1.15
    live.wait()
    check(live.message(obj) == "" and differ(vertices(obj), before),
          f"a program that is lost during a request is started again: {live.message(obj)}")


def check_renamed(obj, live):
    """Work for an object of another name ends, and begins again for the new one."""
    obj["qjulia_scale"] = 1.25
    live.tick()
    old = obj.name_full
    job = live._states[old].job
    obj.name = "renamed"
    before = vertices(obj)
    live.wait()
    check(job.request.is_cancelled and old not in live._states, "a renamed object's work ends")
    check(differ(vertices(obj), before) and live.message(obj) == "", "and begins again")


def check_files():
    """Meshes that are none are refused with a ValueError."""
    from qjulia_maps import ply
    head = ("ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n{}\n"
            "element face 0\nproperty list uchar uint vertex_indices\nend_header\n")
    check(len(ply.read(head.format("property float z").encode()).vertices) == 0, "an empty .ply file is read")
    for line in ("property half z", "property float", "element", "comment", "property float z\nelement vertex -1"):
        try:
            ply.read(head.format(line).encode())
            check(False, f"a .ply file with '{line}' is refused")
        except ValueError as error:
            check("this .ply file" in str(error), f"a .ply file is refused: {error}")


def main():
    bpy.ops.preferences.addon_install(filepath=ARCHIVE, overwrite=True)
    bpy.ops.preferences.addon_enable(module="qjulia_maps")
    from qjulia_maps import live, server

    preferences = bpy.context.preferences.addons["qjulia_maps"].preferences
    preferences.program, preferences.device = PROGRAM, "cpu"
    if sys.argv[-1] == "killed":
        added()
        print("PROGRAM", *children(), flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
    check_errors(preferences)
    obj, scene = added(), bpy.context.scene
    name = obj.name
    check_knobs(obj, live)
    check_drag(obj, live, server)
    check_cut(obj, live)
    check_final(obj, live)
    check_colors(obj, live)
    check_keys(obj, scene)
    prepare_picture(scene)
    check_pictures(obj, scene, "live")
    check_camera(obj, scene)
    check_bake(obj, scene, live, preferences)
    check_saved(obj, live)
    obj = bpy.data.objects[name]
    check_crash(obj, live, server)
    check_renamed(obj, live)
    check_files()
    started = children()
    bpy.ops.preferences.addon_disable(module="qjulia_maps")
    check(not any(Path(f"/proc/{number}").exists() for number in started) and not hasattr(bpy.types.Object, "qjulia"), "nothing is left of an add-on that is disabled")
    print("ALL CHECKED", flush=True)


main()
