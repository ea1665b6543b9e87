"""What tests of pages share. Usage of each: TEST.py QJULIA MESH FOLDER; it exits with 77 where there is no Chromium."""
import pathlib
import shlex
import subprocess
import sys

import browser

qjulia, mesh, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
failures = []


def check(holds, what):
    print(("ok      " if holds else "FAILED  ") + what, flush=True)
    if not holds:
        failures.append(what)


def check_errors(tab):
    """Pages that a server draws ask this machine, and nobody else."""
    errors = [e for e in tab.errors if "asked for http://127.0.0.1" not in e]
    check(errors == [], f"no errors: {sorted(set(errors))}")


def run(*words):
    """What a command writes to standard output."""
    command = [qjulia, *map(str, words)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{shlex.join(command)}: {done.stderr}")
    return done.stdout


def fit_ball():
    run("fit", mesh, "-o", "ball.qjulia.json", "--factors", 24, "--max-evaluations", 60, "--device", "cpu", "--quiet")


def run_test(test, needs_browser=True):
    """Ends the program with what ctest expects."""
    if needs_browser and browser.find() is None:
        print("SKIPPED: no chromium here; 'tools/install-dependencies --all' adds it (about 300 MB)")
        sys.exit(77)
    folder.mkdir(parents=True, exist_ok=True)
    test()
    sys.exit(1 if failures else 0)
