"""What commands write with --json, against docs/reference/schemas.

usage: schemas.py QJULIA SCHEMAS FOLDER MAP MANIFEST_MESH [--slow]
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import jsonschema

# explore ends when its page is closed.
NOT_RUN = {"explore"}
# These take minutes on a busy machine.
SLOW = {"doctor": ("doctor",), "profile-scaling": ("profile", "scaling")}


def check(holds, what):
    if not holds:
        sys.exit(f"schemas: {what}")


class Bench:
    def __init__(self, program, schemas, folder):
        self.program, self.folder = program, Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.schemas = {}
        for path in Path(schemas).glob("*.json"):
            schema = json.loads(path.read_text())
            jsonschema.Draft202012Validator.check_schema(schema)
            check(schema["$schema"].endswith("2020-12/schema"), f"{path} is of another draft")
            self.schemas[path.stem] = schema
        self.seen = set()
        # Tuned settings are not to reach the user's.
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}

    def run(self, *words):
        done = subprocess.run(
            [self.program, *words],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env=self.environment,
        )
        # A comparison is undecided, code 4, where the machine is busy.
        codes = (0, 4) if "compare" in words[1:2] else (0,)
        check(done.returncode in codes, f"{words} ended with {done.returncode}: {done.stderr}")
        return done.stdout

    def validate(self, schema, output):
        self.seen.add(schema)
        for error in jsonschema.Draft202012Validator(self.schemas[schema]).iter_errors(output):
            sys.exit(f"schemas: {schema} does not hold: {error.json_path}: {error.message}")

    def holds(self, schema, *words):
        self.validate(schema, json.loads(self.run(*words, "--json", "--quiet")))

    def commands(self):
        """The programs' commands with --json, those of a group by its name."""
        names = re.findall(r"^  ([a-z]+) ", self.run("--help").partition("ubcommands:")[2], re.M)
        check(len(names) >= 16, f"--help names only {names}")
        groups = ("batch", "doctor", "profile")
        return [name for name in names if name in groups or "--json" in self.run(name, "--help")]


def main():
    program, schemas, folder, a_map, mesh = sys.argv[1:6]
    bench = Bench(program, schemas, folder)
    if sys.argv[6:] == ["--slow"]:
        for schema, words in SLOW.items():
            bench.holds(schema, *words, "--device", "cpu")
        return
    for command in bench.commands():
        check(command in bench.schemas, f"'{command} --json' has no schema in {schemas}")
    bench.holds("devices", "devices")
    reduce = ("--programs", "reduce.cl", "--device", "cpu")
    for schema, words in (("doctor", ()), ("doctor-matrix", ("matrix",))):
        report = json.loads(bench.run("doctor", *words, *reduce, "--json", "--quiet"))
        bench.validate(schema, report)
        (bench.folder / f"{schema}.json").write_text(json.dumps(report))
        bench.holds("doctor-compare", "doctor", "compare", f"{schema}.json", f"{schema}.json")
    bench.holds("info", "info", a_map)
    bench.holds("info", "info", mesh, "--measure-roughness")
    bench.holds("convert", "convert", a_map, "c.qjulia.json", "--slice", "0.1")
    bench.holds("share", "share", a_map, "-o", "s.html")
    device = ("--device", "cpu")
    small = ("--factors", "12", "--max-evaluations", "20", "--seed", "1")
    bench.holds("fit", "fit", mesh, "-o", "f.qjulia.json", *small, *device, "--profile", "fit.json")
    bench.holds("shape", "shape", mesh, "-o", "e.qjulia.json", *device, "--target-area", "1.1", "--target-resolution", "64")
    f = "f.qjulia.json"
    bench.holds("surface", "surface", f, "-o", "f.ply", "--resolution", "16", *device)
    for command, name in (("surface", "g.ply"), ("render", "g.png")):
        size = ("--resolution", "16") if command == "surface" else ("--size", "32x24")
        bench.run(command, f, "-o", name, *size, *device, "--profile", f"{command}.json", "--quiet")
        for kernel in json.loads((bench.folder / f"{command}.json").read_text())["kernels"]:
            check(kernel["limit"], f"no work is counted of {kernel['kernel']}")
    same = (bench.folder / "g.ply").read_bytes() == (bench.folder / "f.ply").read_bytes()
    check(same, "--profile changes the surface")
    bench.holds("sample", "sample", f, "-o", "f.npy", "--resolution", "8", *device)
    bench.holds("compare", "compare", f, mesh, "--resolution", "16", *device)
    tiny = ("--size", "32x24", *device)
    bench.holds("render", "render", f, "-o", "f.png", *tiny)
    bench.holds("render", "render", f, "-o", "t.png", "--turntable", "2", *tiny)
    (bench.folder / "m.toml").write_text(f'[[fit]]\nmesh = "{mesh}"\n')
    bench.holds("batch", "batch", "check", "m.toml")
    whole = json.loads((bench.folder / "fit.json").read_text())
    bench.validate("command-profile", whole)
    for kernel in whole["kernels"]:
        check(kernel["limit"], f"no work is counted of {kernel['kernel']}")
    check(whole["device_seconds"] <= whole["seconds"], "kernels ran longer than the command")
    few = ("--sample-points", "500", "--repeats", "3", *device)
    energy = ("--kernels", "energy*", "--counters", "--csv", "p.csv")
    profile = json.loads(bench.run("profile", "measure", f, mesh, *few, *energy, "--json"))
    bench.validate("profile", profile)
    (bench.folder / "p.json").write_text(json.dumps(profile))
    bench.holds("profile-compare", "profile", "compare", "p.json", "p.json", "--confidence", "0.6")
    bench.holds("profile-report", "profile", "report", "p.json", "p.json", "-o", "p.html")
    bench.holds("profile-grid", "profile", "grid", "panel_block=32,64", *few, "--factors", "16")
    bench.holds("profile-settings", "profile", "export", "settings.json", *device)
    bench.holds("profile-settings", "profile", "import", "settings.json", *device)
    once = ("--sample-points", "500", "--repeats", "1", "--factors", "16", *device)
    bench.holds("profile-tune", "profile", "tune", *once)
    bench.holds("paint", "paint", f, "-o", "paint.qjulia.json", "--ramp", "x=0:1", *device)
    bench.holds("morph", "morph", f, f, "-o", "morph", "--steps", "4", "--flicker-cells", "8", *device)
    bench.holds("portals", "portals", f, "-o", "portals.qjulia.json", "--count", "1", *device)
    bench.holds("run", "run", "portals.qjulia.json", "--print")
    left = set(bench.schemas) - bench.seen - NOT_RUN - set(SLOW)
    check(not left, f"nothing checks {sorted(left)}")


main()
