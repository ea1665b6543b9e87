"""Every option of every command is accepted, and something shows that it had an effect.

The commands with their options are the program's own list (`qjulia_manual options`), and so are the keys of a batch's
manifest and the names in a request to `explore`, which error messages list. Settings, which come from the library's
tables, carry their own examples; the tables below give the others a value. What they leave out fails the test by
its name, and so does what the program does not have.

usage: options.py QJULIA QJULIA_MANUAL FOLDER MESH [--slow]
"""

import http.client
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
import urllib.parse
import zipfile
from pathlib import Path
from xml.etree import ElementTree

# The options that many commands have, besides settings: the first run of a command gives those that it does not give
# itself. It also gives the settings that no run of the command gives, by their own examples.
SHARED = {
    "--device": "cpu",
    "--layout": "cpu",
    "--trust-device": None,
    "--trace": "trace.json",
    "--profile": "kernels.json",
    "--verbose": None,
    "--size": "16x12",
}


def check(holds, what):
    if not holds:
        sys.exit(f"options: {what}")


# --- how an option shows -----------------------------------------------------------------------------------------------


def leaves(value):
    """What nested lists hold, in order."""
    if not isinstance(value, list):
        return [value]
    return [leaf for part in value for leaf in leaves(part)]


def values_of(key, value):
    """All values of the key, at any depth."""
    if isinstance(value, dict):
        for name, part in value.items():
            if name == key:
                yield part
            yield from values_of(key, part)
    elif isinstance(value, list):
        for part in value:
            yield from values_of(key, part)


def is_same(given, kept):
    """Whether the recorded value equals the given one."""
    if given is None:
        return kept is True
    words, kept = re.split("[ ,]", given), leaves(kept)
    if len(words) != len(kept):
        return False
    for word, leaf in zip(words, kept):
        if isinstance(leaf, str):
            if word != leaf.removeprefix("#"):
                return False
        elif not re.fullmatch("-?[0-9.]+", word) or abs(float(word) - leaf) > 1e-6:
            return False
    return True


def note_of(picture):
    """The picture's record of how it was made."""
    data, at = picture.read_bytes(), 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        text = data[at + 8 : at + 8 + length]
        if kind == b"tEXt" and text.startswith(b"qjulia\0"):
            return json.loads(text[7:])
        at += 12 + length
    return {}


def without_jobs(value):
    """JSON without the jobs in it. They say what was given, whether or not it had an effect."""
    if isinstance(value, dict):
        return {name: without_jobs(part) for name, part in value.items() if name not in ("job", "jobs")}
    return [without_jobs(part) for part in value] if isinstance(value, list) else value


def picture_data(data):
    """The chunks of a .png that are not text."""
    kept, at = [], 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        if kind != b"tEXt":
            kept.append(data[at : at + 12 + length])
        at += 12 + length
    return kept


# Lines in which formats have a note.
NOTES = {
    ".ply": rb"(?m)^comment .*\n",
    ".obj": rb"(?m)^#.*\n",
    ".usda": rb"(?m)^ *doc = .*\n",
    ".vti": rb"(?m)^<!--.*\n",
}


def comparable(path):
    """The file's content without its job, and without the parts that differ from run to run."""
    data = path.read_bytes()
    if path.suffix == ".json":
        whole = json.loads(data)
        whole.pop("provenance", None)
        return without_jobs(whole)
    if path.suffix == ".png":
        return picture_data(data)
    if path.suffix == ".glb":
        length = struct.unpack("<I", data[12:16])[0]
        scene = json.loads(data[20 : 20 + length])
        scene["asset"].pop("extras", None)
        return scene, data[20 + length :]
    if path.suffix == ".3mf":
        model = zipfile.ZipFile(path).read("3D/3dmodel.model")
        return re.sub(rb"<metadata.*?</metadata>", b"", model)
    return re.sub(NOTES[path.suffix], b"", data) if path.suffix in NOTES else data


class Done:
    """A command that has ended."""

    def __init__(self, folder, run, words, finished, began):
        self.folder, self.run, self.words, self.began = folder, run, words, began
        self.code, self.out, self.err = finished.returncode, finished.stdout, finished.stderr
        self.json = {}

    def path(self, name):
        return self.folder / name

    def read(self, name):
        return json.loads(self.path(name).read_text())

    def files(self):
        """The names of what it wrote."""
        names = [word for word in self.words if self.path(word).is_file()]
        return [name for name in names if self.path(name).stat().st_mtime >= self.began]

    def keeps(self):
        """The options that it records, on standard output and in the files that it wrote."""
        kept = [self.json]
        for name in self.files():
            if name.endswith(".qjulia.json"):
                kept.append(self.read(name))
            if name.endswith(".png"):
                kept.append(note_of(self.path(name)))
        return without_jobs(kept)


# Other names under which values are recorded.
OTHER_NAMES = {"--ball": "balls", "--block": "blocks", "--up": "file_up"}

# How to observe options that are recorded nowhere and change no file.
SHOWS = {
    "--output": lambda done, value: done.path(value).exists(),
    "--json": lambda done, value: done.json,
    "--quiet": lambda done, value: "device: " not in done.err,
    "--trace": lambda done, value: done.read(value)["traceEvents"],
    "--profile": lambda done, value: done.read(value)["kernels"],
    "--verbose": lambda done, value: "kernel " in done.err,
}



# Options that do not show in these runs, and why.
UNSEEN = {
    "--device": "the same in all runs, which are of CPUs",
    "--layout": "a CPU's own layout, in which all its kernels are built already",
    "--trust-device": "only GPUs are tested before their first use",
    "compare --detail": "on a grid this coarse its figures stay the same",
    "film make --keep-frames": "system.film has an encoder for it",
    "film make --jobs": "its pictures are the same",
    "surface --dense": "by its help the mesh stays the same",
    "surface --largest-component": "these sets have one component",
    "surface --min-component": "these sets have one component",
    "surface --keep-loose": "these sets have no loose pieces",
    "info --verbose": "text alone has more to say, and all runs are for --json",
    "devices --verbose": "text alone has more to say, and all runs are for --json",
    "film template --verbose": "a text has no more to say",
    "doctor --verbose": "it says all that it does",
    "profile measure --time-limit": "there is time for all",
    "profile measure --factors": "the map's are measured",
    "profile measure --seed": "times do not depend on it",
    "profile measure --export": "system.profile_formats reads what it prints",
    "profile grid --export": "system.profile_formats reads what it prints",
    "profile tune --export": "system.profile_formats reads what it prints",
    "profile grid --seed": "its report does not have it",
    "profile grid --factors": "its report does not have it",
    "profile tune --seed": "its report does not have it",
    "profile tune --factors": "its report does not have it",
    "profile tune --sample-points": "its report has half of them",
    "profile tune --repeats": "its report does not have it",
    "profile against --across-drivers": "both builds use one driver here",
    "profile against --across-devices": "both builds use one device here",
    "profile against --seed": "times do not depend on it",
    "profile against --lane-width": "its report does not have it",
    "profile against --iterations": "its kernels have one n",
    "profile against --factors": "its report does not have it",
    "profile against --sample-points": "its report does not have it",
    "profile against --repeats": "its report does not have it",
    "profile against --precision": "its report does not have it",
    "profile --verbose": "their tables say all of kernels",
    "batch run --rank-timeout": "a single process has no ranks to wait for",
    "batch --verbose": "a batch says more of entries that begin, and none does",
    "explore --verbose": "it has more to say as it ends",
}


class Run:
    """The words of one command line, and how to observe its options that are recorded nowhere."""

    def __init__(self, arguments, options, shows=None, codes=(0,), keep=None, slow=False, all_settings_but=None):
        self.arguments, self.options, self.shows = arguments.split(), options, shows or {}
        self.codes, self.keep, self.slow = codes, keep, slow
        # Words; None: it gives no more settings than its options have.
        self.all_settings_but = None if all_settings_but is None else all_settings_but.split()

    def words(self, options):
        words = list(self.arguments)
        for name, value in options.items():
            words.append(name)
            words.extend([] if value is None else value.split(" "))
        return words


def count_of(key, count):
    return lambda done, value: next(values_of(key, done.json)) == count


def makes(name):
    return lambda done, value: done.path(name).exists()


def holds(key):
    """The map that was written has it."""
    return lambda done, value: done.read(done.files()[0])[key]


SMALL_FIT = {"--max-evaluations": "2", "--schedule": "fast"}
# Both are reached by the detail, so that a run gives one of them.
TARGETS = ("--target-area", "--target-dimension", "--target-volume", "--target-resolution")


def by_area(ratio):
    return {"--target-area": ratio, "--target-volume": "1", "--target-resolution": "64"}


def by_dimension(number):
    return {"--target-dimension": number, "--target-resolution": "64"}


ROUGH_FIT = {"--factors": "32", "--max-evaluations": "120", "--output": "area.qjulia.json"}
KERNELS = {"--sample-points": "500", "--repeats": "2", "--kernels": "energy"}

# Each run but the first of a command is quiet. What a command reads is made by those before it.
RUNS = {
    "devices": [Run("", {}), Run("", {})],
    "doctor check": [
        Run("", {"--programs": "reduce.cl", "--junit": "doctor.xml"},
            {"--programs": lambda done, value: {check["program"] for check in done.json["programs"]} == {value},
             "--junit": lambda done, value: len(list(ElementTree.parse(done.path(value)).iter("testcase"))) == len(
                 done.json["programs"])}, keep="doctor.json"),
    ],
    "doctor matrix": [
        Run("", {"--programs": "reduce.cl", "--junit": "matrix.xml"},
            {"--programs": lambda done, value: len(done.json["settings"][0]["report"]["programs"]) == 2,
             "--junit": lambda done, value: len(list(ElementTree.parse(done.path(value)).iter("testsuite"))) > 5}),
    ],
    "doctor compare": [Run("doctor.json doctor.json", {})],
    "fit": [
        Run("MESH", {"--output": "f.qjulia.json", "--report": "report"}, {"--report": makes("report/report.html")},
            all_settings_but="--max-factors"),
        Run("MESH", {"--output": "f.qjulia.json", "--resume": None},
            {"--resume": lambda done, value: done.json["resumed"] is False}, all_settings_but="--max-factors"),
        Run("MESH", {"--factors": "auto", "--max-factors": "8", **SMALL_FIT, "--output": "auto.qjulia.json"},
            {"--max-factors": count_of("factors", 8)}),
        Run("MESH", {**SMALL_FIT, "--initial": "f.qjulia.json", "--output": "from.qjulia.json"},
            {"--initial": lambda done, value: "initial_fnv1a64" in done.json["options"]}),
        Run("MESH", {**ROUGH_FIT, **by_area("1.01")}),
        Run("MESH", {**ROUGH_FIT, **by_dimension("1.985")}),
    ],
    "shape": [
        Run("MESH", {"--output": "e.qjulia.json", "--versor": "random:8:2"},
            all_settings_but=""),
        Run("MESH", {"--output": "plain.qjulia.json", "--resolution": "32", **by_area("1.05")}),
        Run("MESH", {"--output": "plain.qjulia.json", "--resolution": "32", **by_dimension("2.02")}),
    ],
    "paint": [
        Run("f.qjulia.json", {"--output": "p.qjulia.json", "--ball": "1 0 0 0.3 0.5", "--block": "0 0 0 1 1 1 0.2",
                              "--ramp": "x=0:1", "--thickness": "0.15", "--elsewhere": "0.5"}),
        Run("f.qjulia.json", {"--output": "q.qjulia.json", "--mesh": "shares.ply", "--property": "share"},
            {"--mesh": holds("paint"), "--property": holds("paint")}),
        Run("p.qjulia.json", {"--output": "r.qjulia.json", "--clear": None},
            {"--clear": lambda done, value: "paint" in done.read("p.qjulia.json") and
             "paint" not in done.read("r.qjulia.json")}),
    ],
    "portals": [
        Run("f.qjulia.json", {"--output": "o.qjulia.json"}),
        Run("f.qjulia.json", {"--output": "o.qjulia.json", "--count": "1"},
            {"--count": lambda done, value: len(done.read("o.qjulia.json")["portals"]) == int(value)}),
    ],
    "surface": [
        Run("f.qjulia.json", {"--output": "k.ply", "--resolution": "16", "--refine": "4", "--exact": None,
                              "--keep-loose": None, "--material": "trap", "--palette": "102030,405060",
                              "--range": "0,0.2,0.5,1", "--cut": "z=90%"},
            {"--material": lambda done, value: b"property uchar red" in done.path("k.ply").read_bytes()}),
        Run("f.qjulia.json", {"--output": "m.glb", "--resolution": "16", "--metres": "0.2", "--no-map": None,
                              "--dense": None, "--largest-component": None, "--texture": "300"},
            {"--texture": lambda done, value: struct.pack(">II", int(value), int(value)) in done.path("m.glb").read_bytes()}),
        Run("f.qjulia.json", {"--output": "dust.glb", "--resolution": "32", "--drift": "0.9", "--scatter": "wind",
                              "--scatter-seconds": "0.5", "--scatter-distance": "2", "--scatter-seed": "3"},
            {"--scatter": lambda done, value: b'"children"' in done.path("dust.glb").read_bytes()}),
        Run("f.qjulia.json", {"--output": "h.3mf", "--resolution": "16", "--height": "40", "--flat-foot": "1",
                              "--shell": "4", "--drain": "2"},
            # Without the height there is no room for the shell, and without a shell none for a drain.
            {"--height": lambda done, value: done.json["print"], "--shell": lambda done, value: done.json["print"]}),
        Run("f.qjulia.json", {"--output": "l.stl", "--resolution": "16", "--longest": "40", "--min-wall": "1"}),
        Run("f.qjulia.json", {"--output": "s.off", "--resolution": "16", "--millimetres": "40", "--max-error": "1",
                              "--max-triangles": "400", "--min-component": "0.5"}),
    ],
    "render": [
        Run("f.qjulia.json", {"--output": "k.png", "--samples": "1", "--cut": "z=90%", "--material": "groove",
                              "--palette": "102030,405060", "--lamp": "10,20,1.5,3200K,5", "--range": "0,0.2,0.5,1",
                              "--background": "ff8000", "--environment": "evening", "--environment-turn": "90", "--bounce": "1", "--bits": "16",
                              "--no-ground": None, "--keep-loose": None,
                              "--aov": "layers", "--no-map": None, "--exact": None, "--preview": None},
            {"--range": lambda done, value: done.json["made_with"]["picture"]["range"] == [0, 0.2, 0.5, 1],
             "--no-ground": lambda done, value: next(values_of("ground", done.json)) is False,
             "--size": lambda done, value: done.json["made_with"]["picture"]["size"] == "16x12",
             "--aov": lambda done, value: len(done.json["layers"]) == 5,
             "--preview": lambda done, value: "preview: k.preview.png" in done.err}),
        Run("f.qjulia.json", {"--output": "dust.png", "--size": "16x12", "--drift": "0.9", "--scatter": "wind",
                              "--scatter-time": "1", "--scatter-seconds": "2", "--scatter-distance": "2",
                              "--scatter-seed": "3", "--scatter-resolution": "32"}),
        Run("f.qjulia.json", {"--output": "s.png", "--size": "16x12", "--sweep": "zoom=1,2"},
            {"--sweep": makes("s_002.png")}),
        Run("f.qjulia.json", {"--output": "t.png", "--size": "16x12", "--turntable": "2"},
            {"--turntable": makes("t_002.png")}),
    ],
    "film make": [
        Run("film.toml", {"--output": "film", "--seconds": "1", "--frames": "1:1", "--keep-frames": None, "--jobs": "2"},
            {"--seconds": lambda done, value: done.json["pictures"] == 1,
             "--frames": lambda done, value: not done.path("film/frame_0002.png").exists()}),
    ],
    "film sheet": [
        Run("film.toml", {"--output": "sheet.png", "--pictures": "2", "--seconds": "1"},
            {"--pictures": lambda done, value: done.json["pictures"] == 2,
             "--seconds": lambda done, value: done.json["film_pictures"] == 2}),
    ],
    "film scene": [
        Run("film.toml", {"--output": "scene.usda", "--seconds": "1"},
            {"--seconds": lambda done, value: done.json["pictures"] == 2}),
        Run("film.toml", {"--output": "scene.glb"}, {"--output": makes("scene.glb")}),
    ],
    "film template": [
        Run("dive", {"--output": "dive.toml"}, {"--output": makes("dive.toml")}),
        Run("breathe", {"--output": "breathe.toml"}, {"--output": makes("breathe.toml")}),
    ],
    "sample": [
        Run("f.qjulia.json", {"--output": "k.npy", "--resolution": "8"},
            {"--resolution": lambda done, value: max(done.json["cells"]) == 8}),
        Run("f.qjulia.json", {"--output": "s.vti", "--resolution": "8"}),
    ],
    "compare": [
        Run("f.qjulia.json MESH", {"--resolution": "16", "--picture": "c.png"},
            {"--size": lambda done, value: note_of(done.path("c.png"))["picture"]["size"] == "16x12"}),
        Run("f.qjulia.json MESH", {"--resolution": "16", "--limbs": None},
            {"--limbs": lambda done, value: done.json["metrics"][0]["limbs"] >= 0}),
        Run("f.qjulia.json MESH", {"--resolution": "32", "--measure-roughness": None},
            {"--measure-roughness": lambda done, value: done.json["roughness"]["scales"]
             and done.json["area_at_scales"]["scales"]}),
    ],
    "convert": [
        Run("f.qjulia.json c.qjulia.json", {}),
        Run("area.qjulia.json r.qjulia.json", by_area("1.02")),
        Run("area.qjulia.json r.qjulia.json", by_dimension("1.985")),
        Run("f.qjulia.json d.qjulia.json", {"--portals": "portals.txt"}, {"--portals": holds("portals")}),
        Run("f.qjulia.json n.qjulia.json", {"--versor-from": "area.qjulia.json"},
            {"--versor-from": lambda done, value: "distance" in done.read("n.qjulia.json")}),
        # The map has nine.
        Run("f.qjulia.json g.qjulia.json", {"--factors-at-most": "9"}, {"--factors-at-most": count_of("factors", 9)}),
        Run("f.qjulia.json h.qjulia.json", {"--factors-at-most": "8"}, {"--factors-at-most": count_of("factors", 8)},
            slow=True),
    ],
    "morph": [
        Run("area.qjulia.json f.qjulia.json", {"--output": "morph", "--steps": "4", "--flicker-cells": "8"},
            {"--output": makes("morph/step_0004.qjulia.json"), "--steps": count_of("steps", 4),
             "--flicker-cells": lambda done, value: done.json["flicker"]["mean"] >= 0}),
        Run("area.qjulia.json f.qjulia.json", {"--output": "morph", "--steps": "2", "--flicker-cells": "0"},
            {"--output": makes("morph/step_0002.qjulia.json"), "--steps": count_of("steps", 2),
             "--flicker-cells": lambda done, value: done.json["flicker"] is None}),
    ],
    "share": [Run("f.qjulia.json", {"--output": "s.html"}), Run("f.qjulia.json", {"--output": "s.html"})],
    "run": [
        Run("o.qjulia.json size=0.2", {"--output": "v.qjulia.json"}),
        Run("o.qjulia.json", {"--print": None}, {"--print": lambda done, value: done.json["command"] == "portals"}),
        Run("shape.json", {"--output": "w.qjulia.json", "--inputs": "MESHES", "--changed": None},
            {"--inputs": makes("w.qjulia.json"), "--changed": makes("w.qjulia.json")}),
    ],
    "info": [
        Run("f.qjulia.json", {"--check-precision": None},
            {"--check-precision": lambda done, value: done.json["precision"]["points"] > 0}),
        Run("l.stl", {"--printable": None, "--nozzle": "0.6"}, {"--printable": lambda done, value: done.json["printable"]}),
        Run("l.stl", {"--printable": None, "--min-wall": "0.5"}),
        Run("l.stl", {"--measure-roughness": None}, {"--measure-roughness": lambda done, value: done.json["porosity"]["share"] >= 0
            and done.json["area_at_scales"]["scales"]}),
    ],
    "explore": [
        Run("u.qjulia.json", {"--port": "PORT", "--host": "localhost", "--open": None, "--keep-loose": None}),
        Run("MESH", {"--output": "x.qjulia.json", "--factors": "9", "--time-limit": "2"}),
    ],
    # An entry of the manifest fails.
    "batch run": [
        Run("m.toml", {"--output": "batch", "--jobs": "2"},
            {"--jobs": lambda done, value: done.err.count("device: ") == 2}, codes=(1,)),
        Run("m.toml", {"--output": "batch", "--shard": "1/1", "--events": "b.jsonl", "--prometheus": "b.prom",
                       "--resume": None, "--retry-failed": None},
            {"--resume": lambda done, value: is_older(done, "batch/all.status.json"),
             "--retry-failed": lambda done, value: not is_older(done, "batch/broken.status.json"),
             "--events": lambda done, value: '"batch_ended"' in (done.folder / value).read_text(),
             "--prometheus": lambda done, value: "qjulia_batch_entries" in (done.folder / value).read_text()},
            codes=(1,)),
        Run("m.toml", {"--output": "parts", "--shard": "1/2"},
            {"--shard": lambda done, value: (done.folder / "parts/shard-1-of-2/batch.json").exists()}, codes=(0, 1)),
        Run("m.toml", {"--output": "parts", "--shard": "2/2", "--rank-timeout": "5"}, codes=(0, 1)),
    ],
    "batch merge": [
        Run("parts", {}, codes=(1,)),
        Run("parts", {}, {"--json": lambda done, value: len(done.json["entries"]) == 3}, codes=(1,)),
    ],
    "batch status": [Run("batch", {}, {"--json": lambda done, value: [entry["state"] for entry in done.json[
        "entries"]] == ["done", "done", "failed"]}, codes=(1,))],
    "batch check": [Run("m.toml", {}, {"--json": count_of("fits", 3)})],
    "profile measure": [
        Run("f.qjulia.json MESH", {**KERNELS, "--lane-width": "8", "--iterations": "2", "--precision": "double",
                                   "--time-limit": "60", "--counters": None,
                                   "--host-name": None, "--csv": "p.csv", "--plot": "p.png"},
            {"--repeats": lambda done, value: len(next(values_of("runs", done.json))["seconds"]) >= 2,
             "--kernels": lambda done, value: {row["kernel"] for row in done.json["kernels"]} == {"energy"},
             "--counters": lambda done, value: (next(values_of("page_faults", done.json)) is not None
                                                or "not counted: " in done.err),
             "--host-name": lambda done, value: done.json["made"]["host"],
             "--csv": makes("p.csv"), "--plot": makes("p.png")}, keep="p.json"),
        # One kernel is a billion times slower than the baseline's; the other is as fast, but for other programs' load.
        Run("f.qjulia.json MESH", {**KERNELS, "--precision": "double", "--lane-width": "8", "--iterations": "2",
                                   "--baseline": "fast.json", "--tolerance": "1e4"},
            {"--baseline": lambda done, value: "slower: energy, n = 1" in done.err,
             "--tolerance": lambda done, value: "slower: energy, n = 2" not in done.err}, codes=(1,)),
        Run("f.qjulia.json MESH", {**KERNELS, "--export": "lines"}),
        Run("f.qjulia.json MESH", {"--jobs": "matrix_d*", "--sample-points": "500", "--repeats": "1"},
            {"--jobs": lambda done, value: done.json["kernels"][0]["kernel"] == "matrix_diagonal"}),
    ],
    "profile compare": [
        *(Run("p.json newer_driver.json", {"--confidence": "0.6", across: None},
              {across: lambda done, value: done.json["between"] == "drivers"}, codes=(0, 4))
          for across in ("--across-drivers", "--across-devices")),
    ],
    "profile report": [
        Run("p.json", {"--output": "pr1.html"}, {"--output": lambda done, value: (done.folder / value).exists()}),
        Run("p.json p.json", {"--output": "pr.html"},
            {"--output": lambda done, value: "Trends" in (done.folder / value).read_text()}),
    ],
    "profile against": [
        # Which build is the faster may be undecided, or wrong on a busy machine.
        *(Run("QJULIA f.qjulia.json MESH", {**KERNELS, "--time-limit": "1", "--confidence": "0.6", across: None},
              {"--kernels": lambda done, value: {row["kernel"] for row in done.json["kernels"]} == {"energy"},
               "--time-limit": lambda done, value: done.json["rounds"] > 0},
              codes=(0, 1, 4))
          for across in ("--across-drivers", "--across-devices")),
    ],
    "profile scaling": [
        Run("", {"--csv": "s.csv", "--precision": "single"}, {"--csv": makes("s.csv")}, slow=True)],
    "profile tune": [
        Run("f.qjulia.json MESH", {"--repeats": "1", "--host-name": None},
            {"--repeats": lambda done, value: done.json["trials"],
             "--host-name": lambda done, value: done.json["made"]["host"]}, slow=True),
        Run("f.qjulia.json MESH", {"--repeats": "1", "--export": "t4"}, slow=True),
    ],
    "profile grid": [
        Run("panel_block=32", {"--sample-points": "500", "--map": "f.qjulia.json", "--mesh": "MESH", "--csv": "g.csv",
                               "--precision": "single", "--host-name": None},
            {"--csv": makes("g.csv"),
             "--host-name": lambda done, value: done.json["made"]["host"],
             "--map": lambda done, value: done.json["times"][0]["tuning"]["panel_block"] == 32,
             "--mesh": lambda done, value: done.json["times"],
             "--sample-points": lambda done, value: done.json["times"][0]["samples"] == 500}),
        Run("panel_block=32", {"--sample-points": "500", "--export": "t1"}),
    ],
    "profile export": [Run("settings.json", {}, {"--json": makes("settings.json")})],
    "profile import": [Run("settings.json", {}, {"--json": lambda done, value: done.json["file"]})],
}

for each in RUNS.values():
    if len(each) == 1:
        each.append(each[0])  # once more, quiet


def is_older(done, name):
    return done.path(name).stat().st_mtime < done.began


# --- the manifest of a batch -------------------------------------------------------------------------------------------

# Keys and values of its first fit, besides settings; the second has "max_factors", which needs a number that the fit
# chooses.
MANIFEST = {
    "mesh": "MESH", "name": "all", "surface": {"type": "off", "resolution": 16},
    "picture": {"size": "16x12", "look": "gold"}, "report": True, "compare": [1, 3], "compare_resolution": 16}
SECOND_FIT = {"mesh": "MESH", "name": "auto", "factors": "auto", "max_factors": 8, "max_evaluations": 2,
              "schedule": "fast"}
FRAMES = {"sequence": "frame*.obj", "factors": 8, "max_evaluations": 20}


def typed(words):
    """The value that a manifest has for an option's words."""
    if words is None:
        return True
    try:
        return json.loads(words)
    except ValueError:
        return words


def toml_of(table, mesh):
    def text_of(value):
        if isinstance(value, dict):
            return "{ " + ", ".join(f"{key} = {text_of(each)}" for key, each in value.items()) + " }"
        return json.dumps(mesh if value == "MESH" else value)
    return "".join(f"{key} = {text_of(value)}\n" for key, value in table.items())


# --- requests to explore -----------------------------------------------------------------------------------------------

# What a picture's request may say, besides settings, which have the values of options. Palettes have names here.
VIEW = {"size": "16x12", "samples": "2", "draft": "0", "shows": "map", "palette": "ice", "steady": "1",
        "keep-loose": "1", "exact": "1", "ground": "0", "apart": "1", "at": "0.5,0.5"}
# Names that change pictures only where others are given, too: `glow` takes its place on a palette.
VIEW_NEEDS = {"environment-turn": {"environment": "evening"}, "focus": {"aperture": "0.5"}, "glow": {"material": "trap"}, "glow-from": {"material": "trap", "glow": "2"},
              "glow-full": {"material": "trap", "glow": "2"},
              "range": {"material": "trap"}}
# Names that change no picture here, and why.
VIEW_UNSEEN = {"draft": "pictures as small as these are as rough as drafts", "shows": "it is asked of a mesh, below",
               "keep-loose": "this set has no loose pieces, and the server keeps them",
               "apart": "it says that no later picture is like it", "at": "it is asked of a point, not of a picture",
               "exact": "maps of few factors have no tables", "escape": "the set lies within it",
               "precision": "pixels this large do not show it"}
MAKE = {"make": "off", "resolution": "16", "millimetres": "40", "frames": "2"}
BRUSH = {"places": "0.5,0.5", "radius": "0.3", "share": "0.2", "copy": "0.2"}


class Bench:
    def __init__(self, program, manual, folder, mesh, slow):
        self.program, self.folder, self.mesh, self.slow = program, Path(folder), mesh, slow
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        # A leak check would report memory that the command line keeps until it ends.
        listed = subprocess.run([manual, "options"], capture_output=True, text=True, check=True,
                                env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"})
        self.commands = json.loads(listed.stdout)
        # The user's tuned settings must stay as they are.
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache"),
                            "PATH": f"{self.folder}:{os.environ['PATH']}"}

    def names(self, command, positional=False):
        return [option["name"] for option in self.commands[command] if option["is_positional"] == positional]

    def command(self, name, run, options):
        """Runs the command with these options."""
        stands_for = {"MESH": self.mesh, "MESHES": str(Path(self.mesh).parent), "QJULIA": self.program}
        words = [stands_for.get(word, word) for word in run.words(options)]
        # Files that are there already are older. Those of the command have the time of the kernel's last tick, which
        # may be 10 ms ago.
        time.sleep(0.03)
        began = time.time() - 0.015
        is_exported = "--export" in run.options  # in place of JSON
        done = subprocess.run([self.program, *name.split(), *words, *([] if is_exported else ["--json"])],
                              capture_output=True, text=True, cwd=self.folder, env=self.environment)
        what = f"'{name} {' '.join(words)}' ended with {done.returncode}:\n{done.stderr}"
        check(done.returncode in run.codes, what)
        done = Done(self.folder, run, words, done, began)
        done.json = {} if is_exported else json.loads(done.out)
        return done

    def is_shown(self, command, option, value, done):
        """Whether something shows that the option had an effect."""
        shows = done.run.shows.get(option) or SHOWS.get(option)
        if shows:
            return shows(done, value)
        key = option[2:].replace("-", "_")
        for name in (key, OTHER_NAMES.get(option, key)):
            if any(is_same(value, kept) for kept in values_of(name, done.keeps())):
                return True
        # An option that is recorded nowhere must change what is written.
        files = {name: comparable(done.path(name)) for name in done.files()}
        without = {name: given for name, given in done.options.items()
                   if name not in (option, "--trace", "--profile")}
        again = self.command(command, done.run, without)
        return (again.json.get("metrics") != done.json.get("metrics")
                or any(comparable(again.path(name)) != before for name, before in files.items()))

    def run(self, command):
        shown = set()
        for number, run in enumerate(RUNS[command]):
            if run.slow and not self.slow:
                continue
            options = self.options(command, number)
            done = self.command(command, run, options)
            done.options = options
            if run.keep:
                (self.folder / run.keep).write_text(done.out)
                for row, factor in zip(done.json.get("kernels", []), (1e-9, 1)):
                    row["median_seconds"] *= factor
                (self.folder / "fast.json").write_text(json.dumps(done.json))
                done.json["device"]["driver"] += " and later"
                (self.folder / "newer_driver.json").write_text(json.dumps(done.json))
            for option, value in options.items():
                group = command.split()[0]
                if option in shown or {option, f"{command} {option}", f"{group} {option}"} & set(UNSEEN):
                    continue
                shown.add(option)
                check(self.is_shown(command, option, value, done),
                      f"nothing shows that '{command} {option} {value}' had an effect")

    def example(self, command, name):
        """The words of a setting's example, as `Run` has them; a flag has none."""
        (example,) = [option["example"] for option in self.commands[command] if option["name"] == name]
        return example or None

    def settings(self, command):
        return [option["name"] for option in self.commands[command] if "example" in option]

    def options(self, command, number):
        """All options that a run gives."""
        run = RUNS[command][number]
        options = dict(run.options)
        if run.all_settings_but is not None:
            wanted = [name for name in self.settings(command) if name not in run.all_settings_but and name not in TARGETS]
        else:
            given = {name for each in RUNS[command] for name in each.options}
            wanted = [name for name in self.settings(command) if name not in given] if number == 0 else []
        for name in wanted:
            options.setdefault(name, self.example(command, name))
        return {**self.shared(command, number), **options}

    def shared(self, command, number):
        """The shared options that a run gives."""
        if number > 0:
            return {"--quiet": None}
        own = RUNS[command][0].options
        return {option: value for option, value in SHARED.items()
                if option in self.names(command) and option not in own}

    # --- pages ---

    def explore(self, run, options, use):
        """Starts a server, lets `use` ask it, and ends it."""
        words = [self.mesh if word == "MESH" else word for word in run.words(options)]
        server = subprocess.Popen([self.program, "explore", *words, "--json"], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True, cwd=self.folder, env=self.environment)
        try:
            said = ""
            while not said.endswith("}\n"):
                line = server.stdout.readline()
                check(line, f"'explore {' '.join(words)}' prints no address: {server.stderr.read() if not line else ''}")
                said += line
            pages = Pages(json.loads(said)["address"])
            use(pages)
            server.send_signal(signal.SIGINT)
            _, err = server.communicate(timeout=60)
            check(server.returncode == 0, f"'explore {' '.join(words)}' ended with {server.returncode}: {err}")
        finally:
            server.kill()
            server.wait()

    def run_explore(self):
        opener = self.folder / "xdg-open"
        opener.write_text('#!/bin/sh\necho "$1" > opened\n')
        opener.chmod(0o755)
        of_map, of_mesh = RUNS["explore"]
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        # This server has a map that does not say which way is up.
        whole = json.loads((self.folder / "f.qjulia.json").read_text())
        del whole["up"]
        (self.folder / "u.qjulia.json").write_text(json.dumps(whole))
        options = {**self.options("explore", 0), "--port": str(port)}
        self.explore(of_map, options, lambda pages: self.ask_map(pages, port))
        self.explore(of_mesh, {**of_mesh.options, "--quiet": None}, self.ask_fit)
        fitted = json.loads((self.folder / of_mesh.options["--output"]).read_text())
        # A fit that its time limit ends may have dropped some factors.
        check(fitted["provenance"]["options"]["factors"] == 9, "'explore --factors' is not kept")
        limit = float(of_mesh.options["--time-limit"])
        check(fitted["provenance"]["options"]["time_limit"] == limit, "'explore --time-limit' is not kept")

    def ask_map(self, pages, port):
        check((pages.host, pages.port) == ("localhost", port), "'explore --host --port' serves elsewhere")
        wait_for(self.folder / "opened")
        views = pages.names("/frame")
        made = [name for name in pages.names("/make") if name not in views]
        expect_same("requests to make a file", made, MAKE)
        expect_same("requests to the brush", [name for name in pages.names("/brush", "POST") if name not in views], BRUSH)
        knobs = [name for name in views if f"--{name}" in self.knobs()]
        view = {name: (self.example("render", f"--{name}") or "").replace(" ", ",") for name in views
                if f"--{name}" in self.settings("render")}
        view.update(VIEW)
        expect_same("requests", views, view)
        # Knobs turn the map, and all else changes the picture.
        query = "&".join(f"{name}={view[name]}" for name in knobs)
        page = json.loads(pages.get(f"/map?{query}"))["provenance"]["turned"]["page"]
        for name in knobs:
            check(f"{name}={view[name]}&" in page, f"a request's '{name}' does not turn the map: {page}")
        for name in views:
            if name not in knobs and name not in VIEW_UNSEEN:
                usual = {"size": "20x15", "samples": "1", **VIEW_NEEDS.get(name, {})}
                check(pages.frame({**usual, name: view[name]}) != pages.frame(usual),
                      f"a request's '{name}' changes nothing")
        self.ask_files(pages)
        self.ask_brush(pages)

    def ask_brush(self, pages):
        """All that a page says of its brush changes what it does."""
        view = {"size": "40x30", "samples": "1", "draft": "1"}
        strokes = [{**view, "places": BRUSH["places"]}]
        strokes += [{**strokes[0], name: BRUSH[name]} for name in ("radius", "share", "copy")]
        made = []
        for stroke in [view, *strokes]:
            pages.get("/brush?" + urllib.parse.urlencode(stroke), "POST")
            painted = json.loads(pages.get("/map"))
            made.append(json.dumps([painted.get("paint"), painted.get("portals")]))
            pages.get("/takeback", "POST")
        check(len(set(made)) == len(made), f"of {len(made)} strokes only {len(set(made))} differ")

    def ask_files(self, pages):
        """A page makes the same files as the commands."""
        types = re.search("give one of (.+)\n", pages.refused("/make?make=x")).group(1).split(", ")
        check({"off", "stl", "glb", "turntable"} <= set(types), f"a page makes {types} alone")
        size = {"resolution": MAKE["resolution"], "millimetres": MAKE["millimetres"], "drift": "1.05"}
        for kind in types:
            file = self.folder / f"made.{kind}"
            if kind == "turntable":
                file.write_bytes(pages.make({"make": kind, "frames": MAKE["frames"], "size": "16x12", "samples": "1"}))
                count = struct.unpack(">I", file.read_bytes().partition(b"acTL")[2][:4])[0]
                check(count == int(MAKE["frames"]), f"a turntable has {count} pictures")
                continue
            file.write_bytes(pages.make({"make": kind, "size": "16x12", **size}))
            check(file.stat().st_size > 0, f"a page's .{kind} is empty")
            if kind == "png":
                job = note_of(file)["job"]
                check(job["options"]["drift"] == 1.05 and job["options"]["map"] == "u.qjulia.json",
                      f"a page's picture has the job {job}")
                continue
            if kind in ("off", "stl", "glb"):  # the others name the program that wrote them
                words = [word for name, value in size.items() for word in (f"--{name}", value)]
                self.command("surface", Run(f"u.qjulia.json -o same.{kind} --keep-loose {' '.join(words)}", {}), {})
                alike = scene_of if kind == "glb" else Path.read_bytes
                check(alike(file) == alike(self.folder / f"same.{kind}"), f"a page's .{kind} is not that of 'surface'")
        self.command("convert", Run("made.glb of_glb.qjulia.json", {}), {})

    def ask_fit(self, pages):
        usual = {"size": "16x12", "samples": "1", "shows": "mesh"}
        until = time.monotonic() + 300
        while json.loads(pages.get("/fit"))["state"] != "done":
            check(time.monotonic() < until, "the fit of 'explore MESH' does not end")
            time.sleep(0.1)
        check(pages.frame(usual) != pages.frame({**usual, "shows": "map"}), "a request's 'shows' changes nothing")

    def knobs(self):
        """The options of a map: what 'convert' takes but for its own."""
        own = ("--portals", "--factors-at-most", "--up", "--device", "--layout", "--trust-device", *TARGETS,
               "--versor-from")
        return [name for name in self.names("convert") if name not in own]

    # --- files that the runs read ---

    def write_inputs(self):
        (self.folder / "portals.txt").write_text("Portals radius: 0.2\nPortals scale: 4\nPortal location: 0.1 0.3 0.2\n")
        lines = Path(self.mesh).read_text().splitlines()
        vertices = [line[2:] for line in lines if line.startswith("v ")]
        faces = [[int(corner) - 1 for corner in line.split()[1:]] for line in lines if line.startswith("f ")]
        header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
        header += [f"property float {name}" for name in ("x", "y", "z", "share")]
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
        rows = [f"{vertex} {number / len(vertices)}" for number, vertex in enumerate(vertices)]
        rows += [f"3 {a} {b} {c}" for a, b, c in faces]
        job = {"command": "shape", "options": {"mesh": Path(self.mesh).name, "resolution": 32}}
        (self.folder / "shape.json").write_text(json.dumps({**job, "fnv1a64": {"mesh": "0" * 16}}))
        (self.folder / "film.toml").write_text(
            '[film]\nmap = "f.qjulia.json"\nseconds = 2\nrate = 2\n[options]\nsize = "16x12"\nsamples = 1\n'
            "[[key]]\nat = 0\nazimuth = 0\n[[key]]\nat = 2\nazimuth = 90\n")
        (self.folder / "shares.ply").write_text("\n".join(header + rows) + "\n")
        self.write_manifest()

    # --- batches ---

    def write_manifest(self):
        (self.folder / "broken.obj").write_text("v 0 0 0\n")
        third = {"mesh": "broken.obj"}
        for number in (1, 2):
            shutil.copy(self.mesh, self.folder / f"frame{number}.obj")
        tables = (self.first_fit(), SECOND_FIT, FRAMES, third)
        text = "".join(f"[[fit]]\n{toml_of(table, self.mesh)}" for table in tables)
        (self.folder / "m.toml").write_text(text)
        (self.folder / "x.toml").write_text('[[fit]]\nmesh = "broken.obj"\nzzz = 1\n')
        said = subprocess.run([self.program, "batch", "check", self.folder / "x.toml"], capture_output=True, text=True)
        names = re.search("the options of a fit are: (.+)", said.stderr).group(1).split(", ")
        expect_same("a manifest", names, {**self.first_fit(), **SECOND_FIT, **FRAMES})

    def first_fit(self):
        """A fit of a manifest with every key but max_factors."""
        settings = {name[2:].replace("-", "_"): typed(self.example("fit", name)) for name in self.settings("fit")
                    if name not in TARGETS}
        del settings["max_factors"]
        return {**MANIFEST, **settings}

    def check_batch(self):
        """Options show in the entries' settings, and what was to be made is there."""
        for name, table in (("all", self.first_fit()), ("auto", SECOND_FIT)):
            entry = json.loads((self.folder / f"batch/{name}.status.json").read_text())
            for key, value in table.items():
                if key in entry["settings"]:
                    check(entry["settings"][key] == value, f"a manifest's '{key}' is {entry['settings'][key]}")
        second = json.loads((self.folder / "batch/frame2.status.json").read_text())
        check(second["settings"]["schedule"] == "follow", "a sequence's second frame does not follow the first")
        for end in ("off", "png", "report.html"):
            check((self.folder / f"batch/all.{end}").exists(), f"a batch has not written all.{end}")
        picture = self.folder / "batch/all.png"
        check(png_size(picture) == (16, 12), "a batch's picture has another size")
        job = note_of(picture)["job"]
        check(job["options"] == {"map": "all.qjulia.json", **MANIFEST["picture"]}, f"a batch's picture has the job {job}")


class Connection(http.client.HTTPConnection):
    """A connection to this machine, also where nothing can look up localhost."""

    def connect(self):
        self.sock = socket.create_connection(("127.0.0.1", self.port), timeout=self.timeout)


class Pages:
    """Requests to a server."""

    def __init__(self, address):
        self.host, port, self.token = re.fullmatch(r"http://(.+):(\d+)/\?token=([0-9a-f]+)", address).groups()
        self.port = int(port)

    def ask(self, path, method="GET"):
        connection = Connection(self.host, self.port, timeout=120)
        connection.request(method, path, headers={"X-Qjulia-Token": self.token, "X-Qjulia-Client": "test"})
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer.status, data

    def get(self, path, method="GET"):
        status, data = self.ask(path, method)
        while data[:1] == b"~":  # how far it was
            data = data[data.index(b"\n") + 1 :]
        if path != "/fit":
            check(data[:1] == b"=", f"{path} is answered by {status} {data[:300]}")
            data = data[1:]
        return data

    def refused(self, path, method="GET"):
        status, data = self.ask(path, method)
        check(status == 400, f"{path} is answered by {status}")
        return data.decode()

    def names(self, path, method="GET"):
        """The names that the server's error message lists."""
        query = "make=off&zzz=1" if path == "/make" else "zzz=1"
        return re.search("it takes (.+)\n", self.refused(f"{path}?{query}", method)).group(1).split(", ")

    def frame(self, query):
        return self.get("/frame?" + urllib.parse.urlencode(query))

    def make(self, query):
        return self.get("/make?" + urllib.parse.urlencode(query))


def png_size(path):
    return struct.unpack(">II", path.read_bytes()[16:24])


def scene_of(path):
    """The description of the vertices in a .glb."""
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])["accessors"]


def wait_for(path):
    until = time.monotonic() + 60
    while not path.exists():
        check(time.monotonic() < until, f"{path} does not come")
        time.sleep(0.05)


def expect_same(what, names, table):
    """Checks that the table has a value for exactly these names."""
    missing, surplus = sorted(set(names) - set(table)), sorted(set(table) - set(names))
    check(not missing, f"this test has no value for {missing} of {what}")
    check(not surplus, f"this test has a value for {surplus}, which is not in {what}")


def expect_all_given(bench):
    expect_same("the program", bench.commands, RUNS)
    for command, runs in RUNS.items():
        given = {option for number in range(len(runs)) for option in bench.options(command, number)}
        expect_same(f"'{command}'", [name for name in bench.names(command) if not name.startswith("--help")],
                    {option: None for option in given if option != "--json"} | {"--json": None})
        counts = [len(run.arguments) for run in runs]
        arguments = bench.names(command, positional=True)
        # The last may be repeated.
        check(min(counts) <= len(arguments) <= max(counts), f"'{command}' takes {arguments}, and this test gives {max(counts)} of them")
    everywhere = {f"{command} {name}" for command in bench.commands for name in bench.names(command)}
    everywhere |= {f"{command.split()[0]} {name}" for command in bench.commands for name in bench.names(command)}
    stale = [name for name in UNSEEN if not any(option.endswith(name) for option in everywhere)]
    check(not stale, f"this test says of {stale} why they do not show, and no command has them")


def main():
    slow = sys.argv[5:] == ["--slow"]
    bench = Bench(*sys.argv[1:5], slow)
    expect_all_given(bench)
    bench.write_inputs()
    for command in bench.commands:
        for help_option in ("--help", "--help-all"):
            shown = subprocess.run([bench.program, *command.split(), help_option], capture_output=True, text=True)
            check(shown.returncode == 0 and "--json" in shown.stdout, f"'{command} {help_option}' shows no help")
        bench.run_explore() if command == "explore" else bench.run(command)
    bench.check_batch()


main()
