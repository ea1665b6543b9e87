"""Small runs of the command that something goes wrong in, and what must hold after each: inputs are
as they were, outputs complete or absent, the exit code and the message right, and the same command
done again succeeds."""

import csv
import hashlib
import io
import json
import os
import re
import subprocess
import tempfile
import threading
from dataclasses import dataclass, field
from pathlib import Path

DATA = Path(__file__).resolve().parent.parent / "data"
BALL = (DATA / "icosahedron.obj").read_bytes()
EXIT_CODES = {0, 1, 2, 3, 130}
TEMPORARY = re.compile(r"\.qjulia-[0-9a-f]{16}\.tmp$")
# What C++ says about itself tells a user nothing.
RAW = re.compile(r"std::|bad_alloc|basic_\w|vector::|terminate|unspecified|json\.exception")
# What differs from one run to the next.
VOLATILE = {"seconds", "seconds_all", "earlier_seconds", "fit_seconds", "kernel_seconds",
            "fit_kernel_seconds", "memory_bytes", "joules", "started", "process", "progress", "since", "warnings",
            "key"}


@dataclass
class Command:
    """A run of the command in a folder of its own."""

    name: str
    arguments: list
    inputs: dict  # contents by file name
    repeat: list = field(default_factory=list)  # options for doing it again
    partial: str = ""  # the output that an interrupted run writes as far as it came
    leaves: set = field(default_factory=set)  # what may stay when it does not come to its end
    varies: set = field(default_factory=set)  # outputs that differ from run to run
    seconds: float = 0
    outputs: dict = field(default_factory=dict)  # what stays the same, of a run without a fault


@dataclass
class Finished:
    exit_code: int  # negative: ended by that signal
    error: str
    seconds: float = 0


def without_volatile(value):
    if isinstance(value, dict):
        return {k: without_volatile(v) for k, v in value.items() if k not in VOLATILE}
    if isinstance(value, list):
        return [without_volatile(v) for v in value]
    return value


def constant_part(name, data):
    """What a complete output always holds. Raises ValueError where it is cut short."""
    if name.endswith(".trace.json"):
        return sorted(json.loads(data))
    if name.endswith(".json"):
        return without_volatile(json.loads(data))
    if name.endswith(".csv"):
        rows = csv.DictReader(io.StringIO(data.decode()))
        return [without_volatile(row) for row in rows]
    if name.endswith(".html"):
        if not data.rstrip().endswith(b"</html>"):
            raise ValueError("no end")
        return "a page"
    return hashlib.sha256(data).hexdigest()


def says_how_it_went(name):
    """Files of a batch that tell what failed, and so hold something else then."""
    return name.endswith((".status.json", "batch.json", "summary.json", "summary.csv"))


def is_scratch(name):
    """Kept on purpose for the next run."""
    return name.endswith((".checkpoint", ".lock"))


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


class Workshop:
    """Where the command is run."""

    def __init__(self, qjulia, folder):
        self.qjulia = str(Path(qjulia).resolve())
        self.folder = Path(folder).resolve()
        self.folder.mkdir(parents=True, exist_ok=True)
        self.environment = {"POCL_CACHE_DIR": str(self.folder / "pocl_cache"), **os.environ,
                            "XDG_CACHE_HOME": str(self.folder / "cache"), "QJULIA_DEVICE": "cpu"}
        self.repeated = {}
        self.lock = threading.Lock()

    def fresh_folder(self, command, old=()):
        folder = Path(tempfile.mkdtemp(prefix=f"{command.name}-", dir=self.folder))
        for name, data in command.inputs.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        for name in old:
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"of an earlier run\n")
        return folder

    def start(self, command, folder, environment=None, more=()):
        return subprocess.Popen(
            [self.qjulia, *command.arguments, *more], cwd=folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
            env={**self.environment, **(environment or {})})

    def run(self, command, folder, environment=None, more=()):
        process = self.start(command, folder, environment, more)
        try:
            _, error = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            process.kill()
            _, error = process.communicate()
            error += b"\n(had to be killed after 120 s)"
        return Finished(process.returncode, error.decode(errors="replace"))

    def prepare(self, command):
        """Runs it, which fills the cache of kernels too, and keeps what it makes."""
        folder = self.fresh_folder(command)
        finished = self.run(command, folder)
        if finished.exit_code != 0:
            raise SystemExit(f"{command.name} fails without a fault:\n{finished.error}")
        command.outputs = {n: constant_part(n, d) for n, d in contents(folder).items()
                           if n not in command.inputs and not is_scratch(n)}
        return folder

    def problems_of_files(self, command, folder, is_done, may_leave_temporaries=False):
        found = contents(folder)
        for name, data in command.inputs.items():
            if found.pop(name, None) != data:
                yield f"the input {name} is not what it was"
        for name, data in found.items():
            if is_scratch(name):
                continue
            if TEMPORARY.search(name):
                if not may_leave_temporaries:
                    yield f"{name} was left"
            elif name in command.leaves and not is_done:
                continue
            elif name not in command.outputs:
                yield f"{name} is nobody's"
            elif name == command.partial and not is_done:
                yield from self.problems_of_map(folder / name)
            elif data != b"of an earlier run\n" or is_done:
                try:
                    constant = constant_part(name, data)
                except ValueError:
                    yield f"{name} is not complete"
                    continue
                if name not in command.varies and constant != command.outputs[name] and (is_done or not says_how_it_went(name)):
                    yield f"{name} is another"
        if is_done:
            yield from (f"{name} is missing" for name in command.outputs if name not in found)

    def problems_of_map(self, path):
        if path.read_bytes() == b"of an earlier run\n":
            return
        told = subprocess.run([self.qjulia, "info", path], capture_output=True,
                              env=self.environment, check=False)
        if told.returncode != 0:
            yield f"{path.name} is no map: {told.stderr.decode()}"

    def problems(self, command, folder, finished, failed=""):
        """What is wrong after a run in which the call `failed`, and after doing it again."""
        is_mute = failed in ("fwrite", "fputc", "fflush")
        cannot_remove = failed in ("unlink", "unlinkat")
        code, error = finished.exit_code, finished.error
        if code not in EXIT_CODES:
            yield f"it ended with {code}"
        if code not in (0, 130) and not is_mute:
            lines = [line for line in error.splitlines() if re.search("qjulia: |failed|warning: ", line)]
            if not lines:
                yield "it does not say what is wrong"
            elif RAW.search(error):
                yield f"it says what no user understands: {lines[-1]}"
        yield from self.problems_of_files(command, folder, code == 0, cannot_remove)
        yield from (f"done again: {p}" for p in self.problems_when_repeated(command, folder))

    def problems_when_repeated(self, command, folder):
        """Runs that leave the same files behind go on in the same way: one of them is tried."""
        state = hashlib.sha256(repr((command.name, sorted(
            (re.sub(TEMPORARY, ".tmp", n), str(constant_part(n, d)) if not is_scratch(n) and n in
             command.outputs and d != b"of an earlier run\n" else d)
            for n, d in contents(folder).items()))).encode()).hexdigest()
        with self.lock:
            if state in self.repeated:
                return []
            self.repeated[state] = True
        again = self.run(command, folder, more=command.repeat)
        found = list(self.problems_of_files(command, folder, True))
        if again.exit_code != 0:
            found.append(f"it ended with {again.exit_code}: {again.error[-300:]}")
        return found


def made_map(workshop):
    """A map for other commands: in a dictionary, by its file's name."""
    fit = Command("map", ["fit", "ball.obj", "-o", "map.json", "--factors", "8",
                          "--max-evaluations", "2"], {"ball.obj": BALL})
    return {"map.json": (workshop.prepare(fit) / "map.json").read_bytes()}


def made_shards(workshop, manifest):
    """The two shards of a batch, as their runs leave them."""
    files = {"ball.obj": BALL, "m.toml": manifest}
    for number in (1, 2):
        shard = Command(f"shard-{number}", ["batch", "run", "m.toml", "-o", "out", "--shard", f"{number}/2"], files)
        made = contents(workshop.prepare(shard))
        files = {**files, **{name: data for name, data in made.items() if not is_scratch(name)}}
    return files


def made_profiles(workshop):
    """Two profiles, for their page."""
    words = ["profile", "measure", "--sample-points", "500", "--factors", "16", "--repeats", "1", "--kernels", "energy",
             "--json"]
    return {name: subprocess.run([workshop.qjulia, *words, "--seed", seed], capture_output=True, check=True,
                                 env=workshop.environment).stdout
            for name, seed in (("a.json", "1"), ("b.json", "2"))}


def tiny_commands(workshop):
    """Runs of some tenths of a second, which together read and write every kind of file."""
    of_map = made_map(workshop)
    manifest = b"""[defaults]
factors = 8
max_evaluations = 2
surface = { resolution = 8 }
[[fit]]
mesh = "ball.obj"
name = "a"
[[fit]]
mesh = "ball.obj"
name = "b"
factors = 9
"""
    commands = [
        Command("fit", ["fit", "ball.obj", "-o", "map.json", "--factors", "8", "--max-evaluations",
                        "2", "--trace", "fit.trace.json"], {"ball.obj": BALL}),
        Command("surface-ply", ["surface", "map.json", "-o", "a.ply", "--resolution", "8"], of_map),
        Command("surface-glb", ["surface", "map.json", "-o", "a.glb", "--resolution", "8",
                                "--trace", "a.trace.json"], of_map),
        Command("render-mesh", ["render", "ball.obj", "-o", "a.png", "--size", "16x16",
                                "--samples", "1", "--aov", "a", "--preview"], {"ball.obj": BALL},
                leaves={"a.preview.png"}),
        Command("render-map", ["render", "map.json", "-o", "a.png", "--size", "16x16",
                               "--samples", "1"], of_map),
        Command("batch", ["batch", "run", "m.toml", "-o", "out"], {"ball.obj": BALL, "m.toml": manifest},
                repeat=["--resume", "--retry-failed"]),
        Command("two-batch", ["batch", "run", "m.toml", "-o", "out", "--jobs", "2"],
                {"ball.obj": BALL, "m.toml": manifest}, repeat=["--resume", "--retry-failed"]),
        Command("shape", ["shape", "ball.obj", "-o", "map.json", "--resolution", "32"],
                {"ball.obj": BALL}),
        Command("morph", ["morph", "map.json", "b.json", "-o", "out", "--steps", "2", "--flicker-cells", "0"],
                {**of_map, "b.json": of_map["map.json"]}, leaves={"out/step_0001.qjulia.json"}),
        Command("share", ["share", "map.json", "-o", "a.html"], of_map),
        Command("batch-merge", ["batch", "merge", "out"], made_shards(workshop, manifest)),
        Command("profile-report", ["profile", "report", "a.json", "b.json", "-o", "report.html"],
                made_profiles(workshop)),
    ]
    for command in commands:
        workshop.prepare(command)
    return commands
