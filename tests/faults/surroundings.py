"""Runs the command where little is as usual: no home, limits on files and memory, a language with
decimal commas, a folder that cannot be written, pipes that nobody writes or reads.
Usage: surroundings.py QJULIA FOLDER"""

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

from trials import BALL, Workshop, made_map

FIT = ["fit", "ball.obj", "-o", "map.json", "--factors", "8", "--max-evaluations", "2"]


class Bench:
    def __init__(self, workshop):
        self.workshop = workshop
        self.failures = 0
        self.map = made_map(workshop)["map.json"]

    def check(self, what, condition, told=""):
        print(f"{'ok     ' if condition else 'FAILED '} {what}", flush=True)
        if not condition:
            self.failures += 1
            print(told)

    def folder(self, name):
        folder = self.workshop.folder / name
        folder.mkdir()
        (folder / "ball.obj").write_bytes(BALL)
        (folder / "map.json").write_bytes(self.map)
        return folder

    def run(self, folder, arguments, limits=(), **more):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)  # as shells leave it
            for which, most in limits:
                resource.setrlimit(which, (most, most))

        return subprocess.run([self.workshop.qjulia, *arguments], cwd=folder, check=False,
                              capture_output=True, text=True, timeout=120, preexec_fn=limit,
                              **{"env": self.workshop.environment, **more})


def few_files(bench):
    folder = bench.folder("few_files")
    for most in (4, 5, 6, 8):
        told = bench.run(folder, ["surface", "map.json", "-o", "a.ply", "--resolution", "8"],
                         [(resource.RLIMIT_NOFILE, most)])
        bench.check(f"{most} files at a time: exit code 3, and it says which limit",
                    told.returncode == 3 and "ulimit -n" in told.stderr, told)


def small_files(bench):
    folder = bench.folder("small_files")
    # Compiled kernels are files too, of less than this.
    told = bench.run(folder, ["sample", "map.json", "-o", "a.npy", "--resolution", "96"],
                     [(resource.RLIMIT_FSIZE, 1 << 20)])
    bench.check("files of 1 MiB at most: exit code 1, a message, no field",
                told.returncode == 1 and "cannot write 'a.npy'" in told.stderr
                and not (folder / "a.npy").exists(), told)


def little_memory(bench):
    folder = bench.folder("little_memory")
    told = bench.run(folder, FIT, [(resource.RLIMIT_AS, 200 << 20)])
    bench.check("200 MiB of addresses: a message",
                told.returncode in (1, 3) and "qjulia: " in told.stderr, told)


def no_home(bench):
    folder = bench.folder("no_home")
    kept = {"POCL_CACHE_DIR": bench.workshop.environment["POCL_CACHE_DIR"]}
    told = bench.run(folder, FIT, env=kept)
    bench.check("an empty environment: the map", told.returncode == 0, told)


def fixed_folder(bench):
    folder = bench.folder("fixed_folder")
    paths = [str(folder / w) if w in ("ball.obj", "map.json") else w for w in FIT]
    told = bench.run("/proc", paths)
    bench.check("a current folder that cannot be written: the map", told.returncode == 0, told)
    told = bench.run("/proc", [str(folder / w) if w == "ball.obj" else w for w in FIT])
    bench.check("an output there: exit code 1 before any work",
                told.returncode == 1 and "cannot write 'map.json'" in told.stderr
                and "device:" not in told.stderr, told)


def decimal_comma(bench):
    installed = subprocess.run(["locale", "-a"], capture_output=True, text=True, check=False).stdout
    name = next((n for n in installed.split() if re.match(r"(de|fr|es|it|nl)_.*utf8", n)), None)
    if name is None:
        print("skipped a language with decimal commas: no such locale is installed")
        return
    surroundings = {**bench.workshop.environment, "LC_ALL": name}
    folder = bench.folder("decimal_comma")
    made = {}
    for each, env in (("usual", bench.workshop.environment), ("comma", surroundings)):
        told = bench.run(folder, ["surface", "map.json", "-o", "a.obj", "--resolution", "8"],
                         env=env)
        bench.check(f"a surface, {each}", told.returncode == 0, told)
        made[each] = (folder / "a.obj").read_bytes()
    bench.check(f"the same bytes with {name}", made["usual"] == made["comma"])


def interrupted(bench, folder, arguments, ready):
    """SIGINT once `ready` says so. @return exit code, seconds from then, standard error."""
    process = subprocess.Popen([bench.workshop.qjulia, *arguments], cwd=folder,
                               stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True, env=bench.workshop.environment)
    while process.poll() is None and not ready(process):
        time.sleep(0.02)
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    try:
        _, error = process.communicate(timeout=20)
    except subprocess.TimeoutExpired:
        process.kill()
        _, error = process.communicate()
    return process.returncode, time.monotonic() - begun, error


def waits(process):
    """Whether the command has been up for a while and sleeps: it waits for its pipe."""
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    seconds = float(open("/proc/uptime", encoding="ascii").read().split()[0])
    age = seconds - int(fields[19]) / os.sysconf("SC_CLK_TCK")
    return fields[0] == "S" and age > 1


def pipes(bench):
    folder = bench.folder("pipes")
    os.mkfifo(folder / "pipe.json")
    os.mkfifo(folder / "pipe.toml")
    os.mkfifo(folder / "pipe.obj")
    for what, arguments in (
            ("a map that nobody writes", ["info", "pipe.json"]),
            ("a manifest that nobody writes", ["batch", "run", "pipe.toml", "-o", "out"]),
            ("a mesh that nobody writes", ["info", "pipe.obj"]),
            ("a map that nobody reads", [*FIT[:3], "pipe.json", *FIT[4:]]),
            ("a surface that nobody reads", ["surface", "map.json", "-o", "pipe.obj"])):
        code, seconds, error = interrupted(bench, folder, arguments, waits)
        bench.check(f"{what}, Ctrl-C: exit code 130 within 2 s", code == 130 and seconds < 2,
                    f"{code} after {seconds:.1f} s: {error}")
    with subprocess.Popen(["cat", "pipe.obj"], cwd=folder, stdout=subprocess.PIPE) as reader:
        told = bench.run(folder, ["surface", "map.json", "-o", "pipe.obj", "--resolution", "8"])
        received, _ = reader.communicate()
    bench.check("a surface through a pipe",
                told.returncode == 0 and received.count(b"\nf ") > 100, told)


def preview(bench):
    folder = bench.folder("preview")
    code, _, error = interrupted(
        bench, folder, ["render", "map.json", "-o", "a.png", "--size", "1600x1200", "--preview"],
        lambda process: (folder / "a.preview.png").exists())
    bench.check("a picture stopped after its preview: which stays, and it says so",
                code == 130 and "only the preview was written" in error
                and (folder / "a.preview.png").exists() and not (folder / "a.png").exists(),
                f"{code}: {error}")


def main():
    qjulia, folder = sys.argv[1:]
    shutil.rmtree(folder, ignore_errors=True)
    bench = Bench(Workshop(qjulia, folder))
    for case in (few_files, small_files, little_memory, no_home, fixed_folder, decimal_comma, pipes,
                 preview):
        case(bench)
    return 1 if bench.failures else 0


if __name__ == "__main__":
    sys.exit(main())
