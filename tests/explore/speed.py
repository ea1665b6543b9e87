#!/usr/bin/python3
"""How soon the pages of `qjulia explore` and `qjulia share` show what changes: figures for a person.
Usage: chrt -r 5 tests/explore/speed.py QJULIA MAP FOLDER"""
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import time

import browser
from server import Server

qjulia, map_file, folder = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
# What is changed in turn, k the number of the change.
CHANGES = ("azimuth: 30 + 7 * k", "phase1: 5 + k", "detail: 0.01 + 0.0003 * k", "elevation: k / 2", "drift: 0.1 + 0.005 * k",
           "zoom: 1 + 0.01 * k", "order: 1 + k", "scale: 1 + 0.002 * k", "slice: 0.002 * k", "iterations: 4 + k % 4")


def time_shared(page):
    """A page that draws by itself, on SwiftShader."""
    with browser.Browser(660, 500) as tab:
        tab.open(f"{page.as_uri()}?size=640x360&samples=0")
        tab.wait(200)
        factors, fields, versors = tab.run("(({ fields, versors }) => [JSON.parse(document.getElementById('qjulia-map').textContent)"
                                           ".factors.length, fields, versors])(qjulia.depths())")
        # A factor costs 15 operations in F, 95 in a versor. Coarser pictures before the whole add a third of its rays.
        flop = 4 * 4 / 3 * factors * (15 * fields + 95 * versors)
        print(f"a shared page at 1280x720: {4 * fields / 1e6:.1f} M evaluations of F and {4 * versors / 1e6:.1f} M versors, with the "
              f"coarser pictures {flop / 1e9:.0f} GFLOP; at 30 % of 1, 5, 20 TFLOP/s "
              + ", ".join(f"{flop / 0.3e12 / t:.3f}" for t in (1, 5, 20)) + " s")
        wholes, waits = [], []
        for k in range(5):
            tab.open(f"{page.as_uri()}?size=160x120&samples=0#azimuth={40 * k}")
            tab.wait(100)
            figures = tab.run("qjulia.figures")
            wholes.append(figures["fullMs"] - figures["sceneMs"])
            waits.append(figures["longestWaitMs"])
        print(f"a shared page: 160x120 complete {statistics.median(wholes):.0f} ms after its grid, which takes {figures['sceneMs']:.0f} ms")
        tab.open(f"{page.as_uri()}?size=480x360&samples=0")
        tab.wait(100)
        first = {}
        for k in range(12):
            knob = ("azimuth: 37 + 7 * k", "detail: 0.015 + 0.001 * k", "phase1: 5 + k")[k % 3]
            tab.run(f"{{ const k = {k}; qjulia.change({{ {knob} }}); }} 0")
            tab.wait(100)
            first.setdefault(knob.split(":")[0], []).append(round(tab.run("qjulia.figures.firstMs")))
            waits.append(tab.run("qjulia.figures.longestWaitMs"))
        print(f"  at 480x360, first pictures after a change: {json.dumps(first)} ms; longest wait for draws: {max(waits):.0f} ms")


def main():
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(map_file, folder / map_file.name)
    with Server(qjulia, folder, map_file.name) as server, browser.Browser(660, 500) as tab:
        tab.open(f"{server.address}&size=640x480&samples=0")
        tab.wait(100)
        first, whole, by_kind = [], [], {}
        for k in range(50):
            change = CHANGES[k % len(CHANGES)]
            tab.run(f"{{ const k = {k}; qjulia.change({{ {change} }}); }} 0")
            tab.wait(100)
            frames = tab.run("qjulia.figures.frames")
            first.append(frames[0]["ms"])
            whole.append(frames[-1]["ms"])
            by_kind.setdefault(change.split(":")[0], []).append(round(frames[0]["ms"]))
        print(f"first frame ({frames[0]['size']}) of 50 changes: median {statistics.median(first):.0f} ms, most {max(first):.0f}")
        print("  " + json.dumps(by_kind))
        print(f"640x480 complete: median {statistics.median(whole):.0f} ms, most {max(whole):.0f}")
        for knob, values in (("azimuth", "k"), ("phase1", "k % 180"), ("detail", "0.01 + 0.0001 * k")):
            tab.run("qjulia.change({ azimuth: 0 }); 0")
            tab.wait(100)
            before = tab.run("qjulia.figures.count")
            # As fast as a mouse tells of its moves.
            tab.run(f"""(async () => {{ for (let k = 0; k < 180; ++k) {{ qjulia.change({{ {knob}: {values} }}, false);
                        await new Promise((next) => setTimeout(next, 16)); }} }})()""")
            print(f"while {knob} is dragged for 3 s: {(tab.run('qjulia.figures.count') - before) / 3:.1f} frames/s")
            tab.run("qjulia.change({}); 0")
            tab.wait(100)
        tab.open(f"{server.address}&size=1280x960&samples=4")
        begin = time.monotonic()
        tab.wait(200)
        print(f"1280x960, anti-aliased, from the opening of the page: {time.monotonic() - begin:.1f} s")
    page = folder.resolve() / "page.html"
    subprocess.run([qjulia, "share", map_file.name, "-o", page, "--quiet"], cwd=folder, check=True)
    time_shared(page)
    begin = time.monotonic()
    subprocess.run([qjulia, "render", map_file.name, "-o", "render.png", "--size", "1280x960", "--device", "cpu", "--quiet"], cwd=folder,
                   check=True)
    print(f"'render' of that size: {time.monotonic() - begin:.1f} s")
    return 0


sys.exit(main())
