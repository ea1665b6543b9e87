"""Sends signals to long commands at random moments: each ends soon, with its outputs complete or
absent, and a fit goes on from where it was.
Usage: signals.py QJULIA FOLDER [--signals N] [--only NAME]"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

from trials import BALL, Command, Finished, Workshop, made_map

INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
STOP, CONT = signal.SIGSTOP, signal.SIGCONT
# Signals with the seconds that pass between one and the next.
SEQUENCES = {"INT": [INT], "TERM": [TERM], "HUP": [HUP], "STOP, CONT": [STOP, 0.2, CONT],
             "INT, INT": [INT, 0.002, INT], "INT, TERM": [INT, 0.0, TERM],
             "STOP, INT, CONT": [STOP, 0.1, INT, 0.1, CONT]}
MOST_SECONDS = 5


def long_commands(workshop):
    of_map = made_map(workshop)
    both = {**of_map, "ball.obj": BALL}
    manifest = b"""[defaults]
factors = 16
max_evaluations = 30
[[fit]]
mesh = "ball.obj"
name = "a"
surface = { resolution = 64 }
[[fit]]
mesh = "ball.obj"
name = "b"
"""
    commands = [
        Command("fit", ["fit", "ball.obj", "-o", "fitted.json", "--factors", "48",
                        "--max-evaluations", "150"], {"ball.obj": BALL}, repeat=["--resume"],
                partial="fitted.json"),
        Command("surface", ["surface", "map.json", "-o", "a.ply", "--resolution", "128"], of_map),
        Command("render", ["render", "map.json", "-o", "a.png", "--size", "96x72", "--preview"],
                of_map, leaves={"a.preview.png"}),
        Command("batch", ["batch", "run", "m.toml", "-o", "out"], {"ball.obj": BALL, "m.toml": manifest},
                repeat=["--resume"]),
        Command("sample", ["sample", "map.json", "-o", "a.npy", "--resolution", "128"], of_map),
        Command("compare", ["compare", "map.json", "ball.obj", "--resolution", "64", "--trace",
                            "a.trace.json"], both),
        Command("shape", ["shape", "ball.obj", "-o", "a.json", "--resolution", "384"],
                {"ball.obj": BALL}),
        Command("profile", ["profile", "measure", "--sample-points", "5000", "--factors", "16", "--repeats", "2",
                            "--plot", "a.png"], {}, varies={"a.png"}),
    ]
    for command in commands:
        begun = time.monotonic()
        workshop.prepare(command)
        begun = time.monotonic()
        workshop.prepare(command)
        command.seconds = time.monotonic() - begun
    return commands


def trial(workshop, command, moment, sequence):
    """@return the exit code, the seconds from the last signal to the end, and the problems."""
    folder = workshop.fresh_folder(command)
    process = workshop.start(command, folder)
    time.sleep(moment)
    for each in SEQUENCES[sequence]:
        if isinstance(each, float):
            time.sleep(each)
        elif process.poll() is None:
            process.send_signal(each)
    last = time.monotonic()
    asks_to_end = any(each in (INT, TERM, HUP) for each in SEQUENCES[sequence])
    try:
        _, error = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        _, error = process.communicate()
    seconds = time.monotonic() - last
    finished = Finished(process.returncode, error.decode(errors="replace"))
    untouched = sorted(p.name for p in folder.iterdir()) == sorted(command.inputs)
    problems = []
    if asks_to_end and seconds > MOST_SECONDS:
        problems.append(f"it took {seconds:.1f} s to end")
    if finished.exit_code in (-INT, -TERM, -HUP) and untouched and not finished.error:
        pass  # before it was asked what to do with signals: nothing has begun
    elif finished.exit_code not in ((0, 130) if asks_to_end else (0,)):
        problems.append("that is no exit code of a run that was stopped")
    else:
        if finished.exit_code == 130 and "interrupted" not in finished.error:
            problems.append("it does not say that it was interrupted")
        problems += workshop.problems(command, folder, finished)
    shutil.rmtree(folder)
    return finished.exit_code, seconds, [(p, finished.error) for p in problems]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("qjulia")
    parser.add_argument("folder")
    parser.add_argument("--signals", type=int, default=210)
    parser.add_argument("--only", help="the commands whose names hold this")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    # As a terminal leaves them: nohup and shells that start it in the background have them ignored.
    signal.signal(HUP, signal.SIG_DFL)
    signal.signal(INT, signal.default_int_handler)
    shutil.rmtree(arguments.folder, ignore_errors=True)
    workshop = Workshop(arguments.qjulia, arguments.folder)
    commands = [c for c in long_commands(workshop) if (arguments.only or "") in c.name]
    # Two at a time make each slower; a little past the end is meant too.
    picker = random.Random(arguments.seed)
    trials = []
    for i in range(arguments.signals):
        command = commands[i % len(commands)]
        sequence = list(SEQUENCES)[(i // len(commands)) % len(SEQUENCES)]
        trials.append((command, picker.uniform(0, 1.3 * command.seconds), sequence))
    codes, wrong, longest = Counter(), 0, 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = pool.map(lambda t: trial(workshop, *t), trials)
        for (command, moment, sequence), (code, seconds, problems) in zip(trials, results):
            codes[code] += 1
            wrong += bool(problems)
            if sequence != "STOP, CONT":
                longest = max(longest, seconds)
            for problem, error in problems:
                print(f"{command.name}, {sequence} after {moment:.3f} s, exit code {code}: "
                      f"{problem}")
                print("".join(f"    {line}\n" for line in error.splitlines()[-4:]), flush=True)
    print(f"{len(trials)} runs, exit codes {dict(sorted(codes.items()))}, the longest took "
          f"{longest:.1f} s to end; {wrong} with problems")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
