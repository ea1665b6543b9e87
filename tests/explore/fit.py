#!/usr/bin/python3
"""`qjulia explore` of a mesh in headless Chromium: the fit as it runs, stopped by its button, and files made of its map."""
import json
import re
import shutil
import signal
import subprocess
import time

import browser
from checks import check, check_errors, folder, mesh, qjulia, run, run_test
from server import Server


def json_of(*words):
    """What a command says with --json."""
    return json.loads(run(*words, "--json", "--device", "cpu", "--quiet"))


def until(tab, script, seconds, what):
    """Whether a script's value becomes true in time."""
    begin = time.monotonic()
    while time.monotonic() < begin + seconds:
        if tab.run(script):
            check(True, f"{what}: {time.monotonic() - begin:.1f} s")
            return True
        tab.rest(0.1)
    check(False, f"{what}: not in {seconds} s; the page says: {tab.run('document.body.innerText')}")
    return False


# How many different bytes a canvas's pixels have: a picture has many, an empty one a single.
VARIETY = """new Set(document.getElementById('%s').getContext('2d').getImageData(0, 0, 320, 240).data.filter((_, i) => i %% 4 < 3)).size"""


def check_fit(tab, server):
    tab.open(server.address)
    until(tab, "document.documentElement?.dataset.renderer === 'fit'", 20, "the page of a fit is there")
    until(tab, "document.querySelectorAll('#stages figure').length >= 3", 120, "it shows the placement and two stages")
    for view in ("mesh", "potential", "set"):
        check(tab.run(VARIETY % view) > 60, f"a picture of the {view}")
    points = tab.run("document.querySelector('#iou polyline').points.length")
    lines = tab.run("[...document.querySelectorAll('#energy polyline')].map((line) => line.points.length)")
    check(points >= 3 and max(lines) > 10, f"curves of {points} IoUs, and energies of stages of {lines} evaluations")
    words = tab.run("document.getElementById('stages').innerText")
    check("wide band, IoU" in words, "stages have names and IoUs: " + words.replace("\n", " "))
    tab.screenshot(folder / "fit.png")
    check(server.status("/stop") == 405 and server.status("/stop", method="POST", token="0" * 32) == 403 and
          server.status("/stop", method="POST", Origin="http://evil.example") == 403, "no other site stops a fit")
    check(b"use POST" in server.get("/stop")[2], "nor does a link")
    before = tab.run("document.getElementById('mesh').toDataURL()")
    tab.drag(150, 250, 230, 260)
    until(tab, "document.getElementById('mesh').toDataURL() !== " + json.dumps(before), 60, "a drag turns the pictures")
    tab.rest(1)
    begin = time.monotonic()
    tab.run("document.getElementById('stop').click()")
    until(tab, "document.documentElement?.dataset.renderer === 'server'", 60, "stopped, the page becomes that of the map reached")
    tab.wait(100)
    print(f"        {time.monotonic() - begin:.1f} s from the button to the map's picture")
    made = json.loads((folder / "fitted.qjulia.json").read_text())
    seen = json.loads(tab.run("document.getElementById('qjulia-map').textContent"))
    check(made["factors"] == seen["factors"] and made["provenance"]["stopped"] == "interrupted", "the map is written, and the page's")
    tab.screenshot(folder / "fitted.png")


def making(product, numbers):
    """The script that has the page make a file."""
    script = f"{{ const s = document.querySelector('[name=product]'); s.value = '{product}'; s.dispatchEvent(new Event('change')); }}"
    for name, value in numbers.items():
        script += f"document.querySelector('input[type=number][name={name}]').value = {value};"
    return script + "[...document.querySelectorAll('button')].find((b) => b.textContent.startsWith('Make')).click()"


def made_file(tab, product, **numbers):
    """What the page makes and downloads."""
    begin = time.monotonic()
    file = tab.download(folder / "downloads", making(product, numbers))
    print(f"        {file.name}: {file.stat().st_size} bytes in {time.monotonic() - begin:.1f} s; "
          f"{tab.run('document.getElementById(`note`).textContent')}")
    return file


def check_files(tab):
    tab.run("qjulia.change({ drift: 0.3, phase1: 40 }); 0")
    tab.wait(100)
    file = made_file(tab, "ply", resolution=64)
    command = tab.run("qjulia.surfaceCommand()").split()
    command[command.index("-o") + 1] = "same.ply"
    same = json_of(*command[1:], "--resolution", 64)
    info = json_of("info", file.resolve())
    check(info["triangles"] == same["triangles"] and info["closed"],
          f"a mesh is that of the page's surface command: {info['triangles']} triangles")
    file = made_file(tab, "stl", resolution=48, millimetres=80)
    info = json_of("info", file.resolve())
    sides = [high - low for low, high in zip(*info["box"])]
    check(info["closed"] and 76 < max(sides) < 100, f"a printable file is closed, and as long as was asked for: {max(sides):.0f} mm")
    if shutil.which("admesh"):
        told = subprocess.run(["admesh", "-c", file], capture_output=True, text=True, check=True).stdout
        check(re.search(r"Degenerate facets\s*: *0", told) is not None, "admesh finds nothing to mend")
    tab.run("qjulia.change({ cuty: 55 }); 0")
    info = json_of("info", made_file(tab, "ply", resolution=48).resolve())
    low, high = info["box"]
    middle = tab.run("(() => { const [low, high] = JSON.parse(document.getElementById('qjulia-map').textContent).box; "
                     "return low[1] + 0.55 * (high[1] - low[1]); })()")
    check(abs(high[1] - middle) < 1e-5 and low[1] < 0 and not info["closed"], f"a set that is cut open makes a mesh that is: {info['box']}")
    tab.run(making("stl", {"resolution": 48, "millimetres": 80}))
    until(tab, "document.getElementById('note').textContent.includes('cannot be printed')", 20, "but no printable file")
    refused = [e for e in tab.errors if "status of 400" in e]  # the console tells of it
    check(len(refused) == 1, "one request was refused")
    tab.errors.remove(refused[0])
    tab.run("qjulia.change({ cuty: 100 }); 0")
    file = made_file(tab, "glb", resolution=32)
    check(file.read_bytes()[:4] == b"glTF", "a .glb file")
    file = made_file(tab, "turntable", frames=5, width=64, height=48)
    data = file.read_bytes()
    check(data[:8] == b"\x89PNG\r\n\x1a\n" and data.count(b"fcTL") == 5 and b"acTL" in data, "a turntable of 5 pictures")
    tab.run(making("ply", {"resolution": 1024}))
    until(tab, "document.querySelector('#panel progress').value > 0", 100, "while a mesh is made, the page says how far it is")
    for turn in range(20):  # pictures and slabs of the mesh do not share a queue
        tab.run(f"qjulia.change({{ azimuth: {5 * turn} }}); 0")
        tab.rest(0.15)
    begin = time.monotonic()
    tab.run("qjulia.change({ azimuth: 100 }); 0")
    tab.wait(100)
    print(f"        meanwhile a change is drawn in {time.monotonic() - begin:.1f} s")
    check(tab.run("!document.querySelector('#panel progress').hidden"), "and pictures come meanwhile")
    tab.screenshot(folder / "making.png")
    tab.run("[...document.querySelectorAll('button')].find((b) => b.textContent === 'Cancel').click()")
    until(tab, "document.getElementById('note').textContent === 'nothing was made'", 20, "cancelled")
    tab.run(making("turntable", {"frames": 120, "width": 640, "height": 480}))
    tab.rest(1)  # and the tab is closed meanwhile


def check_broken_mesh():
    """A fit that cannot be says why, where the command was given."""
    (folder / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = subprocess.run([qjulia, "explore", "flat.obj", "--device", "cpu", "--quiet"], cwd=folder, capture_output=True, text=True,
                          timeout=100, check=False)
    check(done.returncode == 2 and "no volume" in done.stderr, f"a mesh without an inside: {done.returncode}, {done.stderr.strip()}")


def check_interrupted():
    """Ctrl-C keeps what a fit has reached, where there is a file for it."""
    words = [qjulia, "explore", "ball.obj", "--factors", "60", "--device", "cpu"]
    for output in (["-o", "interrupted.qjulia.json"], []):
        (folder / "interrupted.qjulia.json").unlink(missing_ok=True)
        with subprocess.Popen([*words, *output], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            lines = []
            for line in process.stderr:
                lines.append(line)
                if line.startswith("fitting"):
                    process.send_signal(signal.SIGINT)
                    break
            lines += process.stderr.readlines()
        check(process.returncode == 130, f"Ctrl-C ends a fit: {process.returncode}, {''.join(lines)}")
        if output:
            made = json.loads((folder / output[1]).read_text())
            check(made["provenance"]["stopped"] == "interrupted" and "map: " in lines[-1], "and its map is written")
        else:
            check(lines[-1] == "interrupted; nothing was written\n", "and it is said where there is none")
    with subprocess.Popen([*words, "-o", "early.qjulia.json"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=100)[1]
    check(process.returncode == 130 and said.splitlines()[-1].startswith(("interrupted; nothing was written", "map: ")),
          f"so does one at once: {said}")


def main():
    (folder / "fitted.qjulia.json").unlink(missing_ok=True)
    shutil.copy(mesh, folder / "ball.obj")
    with Server(qjulia, folder, "ball.obj", "--factors", 60, "-o", "fitted.qjulia.json") as server:
        with browser.Browser(1000, 760) as tab:
            check_fit(tab, server)
            check_files(tab)
            check_errors(tab)
        check(server.is_well(), "a browser that is closed while a turntable is made does no harm")
    check_broken_mesh()
    check_interrupted()


run_test(main)
