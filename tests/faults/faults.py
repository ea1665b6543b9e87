"""Makes calls to the system fail, one in each run: files, prints, allocations, threads.
Usage: faults.py QJULIA FAULTY_CALLS_LIBRARY FOLDER [--faults N] [--only NAME]"""

import argparse
import os
import random
import shutil
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

from trials import Workshop, tiny_commands


# Functions of libraries in which running out of memory ends the process: nlohmann's JSON allocates
# where it frees its values, in a destructor; Eigen 3.4.0 keeps a pointer to what it has freed when
# a matrix cannot grow (DenseStorage::resize), and LBFGSpp's bounded solver grows some.
SPARED = ("json_value::destroy(", "LBFGSpp::BFGSMat<", "LBFGSpp::BKLDLT<", "LBFGSpp::Cauchy<",
          "LBFGSpp::SubspaceMin<")


def spared(qjulia):
    """The code of SPARED in the program, as ranges of addresses."""
    symbols = subprocess.run(["nm", "-CS", qjulia], capture_output=True, text=True, check=True)
    ranges = set()
    for line in symbols.stdout.splitlines():
        words = line.split(maxsplit=3)
        if len(words) == 4 and any(name in words[3] for name in SPARED):
            begin, size = (int(word, 16) for word in words[:2])
            ranges.add(f"{begin:x}-{begin + size:x}")
    if not ranges:
        raise SystemExit(f"{qjulia} has no symbols")
    return ",".join(sorted(ranges))


def calls_of(workshop, library, command):
    """The calls of a run without a fault, as "KIND:N" by kind."""
    folder = workshop.fresh_folder(command)
    log = folder.with_suffix(".calls")
    workshop.run(command, folder, {"LD_PRELOAD": library, "QJULIA_TEST_CALLS": str(log)})
    calls = {}
    for line in log.read_text().splitlines():
        kind, number = line.split()
        calls.setdefault(kind, []).append(f"{kind}:{number}")
    return calls


def chosen(calls, share, seed):
    """All calls but allocations, and as many of those as there is room for."""
    few = [c for kind, each in calls.items() if kind != "memory" for c in each]
    many = calls["memory"]
    picker = random.Random(seed)
    if len(few) > share / 2:
        few = sorted(picker.sample(few, round(share / 2)))
    return few + sorted(picker.sample(many, min(len(many), max(0, share - len(few)))))


def trial(workshop, library, command, fault):
    """@return what failed (nothing: the run has no such call), the exit code and the problems."""
    # Every other run finds the outputs of an earlier one.
    has_old = hash_of(fault) % 2 == 1
    folder = workshop.fresh_folder(command, command.outputs if has_old else ())
    log = folder.with_suffix(".calls")
    finished = workshop.run(command, folder, {"LD_PRELOAD": library, "QJULIA_TEST_FAULT": fault,
                                              "QJULIA_TEST_CALLS": str(log)})
    failed = log.read_text().split("failed ")[1:] if log.exists() else []
    if not failed:
        shutil.rmtree(folder)
        return None, finished.exit_code, []
    call = failed[0].strip()
    problems = list(workshop.problems(command, folder, finished, call))
    shutil.rmtree(folder)
    log.unlink()
    return call, finished.exit_code, [(p, finished.error) for p in problems]


def hash_of(fault):
    return sum(fault.encode())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("qjulia")
    parser.add_argument("interposed")
    parser.add_argument("folder")
    parser.add_argument("--faults", type=int, default=1200)
    parser.add_argument("--only", help="the commands whose names hold this")
    arguments = parser.parse_args()
    shutil.rmtree(arguments.folder, ignore_errors=True)
    workshop = Workshop(arguments.qjulia, arguments.folder)
    library = os.path.abspath(arguments.interposed)
    workshop.environment["QJULIA_TEST_SPARED"] = spared(workshop.qjulia)
    commands = [c for c in tiny_commands(workshop) if (arguments.only or "") in c.name]
    trials = []
    for number, command in enumerate(commands):
        calls = calls_of(workshop, library, command)
        share = arguments.faults // len(commands)
        trials += [(command, fault) for fault in chosen(calls, share, number)]
    kinds, codes, missed, wrong = Counter(), Counter(), 0, 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = pool.map(lambda t: trial(workshop, library, *t), trials)
        for (command, fault), (failed, code, problems) in zip(trials, results):
            missed += failed is None
            if failed is None:
                print(f"{command.name}, {fault}: not reached")
                continue
            kinds[fault.split(":")[0]] += 1
            codes[code] += 1
            wrong += bool(problems)
            for problem, error in problems:
                print(f"{command.name}, {fault} ({failed}), exit code {code}: {problem}")
                print("".join(f"    {line}\n" for line in error.splitlines()[-4:]), flush=True)
    print(f"{sum(kinds.values())} faults ({', '.join(f'{n} {k}' for k, n in kinds.items())}), "
          f"{missed} calls not reached; exit codes {dict(sorted(codes.items()))}; "
          f"{wrong} with problems")
    # Threads and times change how many calls a run makes, so that its last ones may be missing.
    is_short = missed > max(2, len(trials) / 10)
    if is_short:
        print("too many calls were not reached")
    return 1 if wrong or is_short else 0


if __name__ == "__main__":
    sys.exit(main())
