#!/usr/bin/python3
"""How soon the page of `qjulia explore` shows what changes: figures for a person.
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

qjulia, map_file, folder = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
# What is changed in turn, k the number of the change.
CHANGES = ("azimuth: 30 + 7 * k", "phase1: 5 + k", "detail: 0.01 + 0.0003 * k", "elevation: k / 2", "drift: 0.1 + 0.005 * k",
           "zoom: 1 + 0.01 * k", "order: 1 + k", "scale: 1 + 0.002 * k", "slice: 0.002 * k", "iterations: 4 + k % 4")


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
    begin = time.monotonic()
    subprocess.run([qjulia, "render", map_file.name, "-o", "render.png", "--size", "1280x960", "--device", "cpu", "--quiet"], cwd=folder,
                   check=True)
    print(f"'render' of that size: {time.monotonic() - begin:.1f} s")
    return 0


sys.exit(main())
