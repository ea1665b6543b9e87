#!/usr/bin/python3
"""Checks traces of whole commands by the rules by which Perfetto imports trace events in JSON: slices of a thread nest,
flows begin and end within slices, counters are numbers, rows have names. Each rule is then broken in a trace, which
must be noticed.
Usage: trace_rules.py QJULIA FOLDER MESH"""

import copy
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path


def nanoseconds(microseconds):
    return round(1000 * microseconds)


def place(event):
    return event["pid"], event["tid"]


def open_slice(stacks, event):
    """The innermost slice of the event's thread at its time, of those that stand before it in the file."""
    at = nanoseconds(event["ts"])
    return next((s for s in reversed(stacks.get(place(event), [])) if nanoseconds(s["ts"] + s["dur"]) >= at), None)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def problems_of_metadata(events):
    rows = {place(e) for e in events if e["ph"] in "Xsf"}
    named = {place(e) for e in events if e["ph"] == "M" and e["name"] == "thread_name" and e["args"]["name"]}
    sorted_rows = [place(e) for e in events if e["ph"] == "M" and e["name"] == "thread_sort_index"]
    processes = {e["pid"] for e in events if e["ph"] == "M" and e["name"] == "process_name" and e["args"]["name"]}
    if rows - named:
        yield f"rows without a name: {rows - named}"
    if rows - set(sorted_rows) or len(set(sorted_rows)) != len(sorted_rows):
        yield "rows without a place of their own"
    if {pid for pid, _ in rows} - processes:
        yield "a process without a name"


def problems_of_slices(events):
    stacks = {}
    for event in (e for e in events if e["ph"] == "X"):
        if not is_number(event.get("dur")) or event["dur"] < 0:
            yield f"no duration: {event}"
            continue
        begin, end = nanoseconds(event["ts"]), nanoseconds(event["ts"]) + nanoseconds(event["dur"])
        stack = stacks.setdefault(place(event), [])
        while stack and stack[-1] <= begin:
            stack.pop()
        if stack and end > stack[-1]:
            yield f"slices overlap without nesting: {event}"
        stack.append(end)


def problems_of_flows(events):
    stacks, begun, ended = {}, {}, {}
    for event in events:
        if event["ph"] == "X":
            stacks.setdefault(place(event), []).append(event)
        elif event["ph"] in "sf":
            if not is_number(event.get("id")) or not event.get("name") or not event.get("cat"):
                yield f"a flow without id, name or category: {event}"
                continue
            ends = begun if event["ph"] == "s" else ended
            if event["id"] in ends:
                yield f"flow {event['id']} begins or ends twice"
            slice_of_it = open_slice(stacks, event)
            if slice_of_it is None:
                yield f"flow {event['id']} is in no slice"
            ends[event["id"]] = event, slice_of_it
            if event["ph"] == "f" and event.get("bp") != "e":
                yield f"flow {event['id']} ends in the next slice, not in that around it"
            if event["ph"] == "f" and event["id"] not in begun:
                yield f"flow {event['id']} ends before it begins"
    if set(begun) != set(ended):
        yield "flows without both ends"
    for number in set(begun) & set(ended):
        (begin, call), (end, kernel) = begun[number], ended[number]
        if (begin["name"], begin["cat"]) != (end["name"], end["cat"]):
            yield f"the ends of flow {number} have different names"
        if call is None or kernel is None:
            continue
        if (call["cat"], kernel["cat"]) != ("call", "kernel") or call["name"] != kernel["name"]:
            yield f"flow {number} does not lead from a call to its kernel"
        elif nanoseconds(kernel["args"]["queued_us"]) != nanoseconds(kernel["ts"]) - nanoseconds(call["ts"]):
            yield f"flow {number} takes another time than its kernel says"
    kernels = sum(e["ph"] == "X" and e["cat"] == "kernel" for e in events)
    if kernels != len(ended):
        yield f"{kernels} kernels and {len(ended)} flows"


def problems_of_counters(events):
    last = {}
    for event in (e for e in events if e["ph"] == "C"):
        args = event.get("args")
        if not isinstance(args, dict) or not args or not all(is_number(v) and v >= 0 for v in args.values()):
            yield f"a counter without numbers: {event}"
        else:
            last[event["name"]] = args
    for name, args in last.items():
        if name.endswith("launches in the queue") and set(args.values()) != {0}:
            yield f"{name} does not end at 0"
    for name in ("launches in the queue", "memory of buffers"):
        if name not in last:
            yield f"there is no counter '{name}'"


def problems_of_kernels(events):
    for event in (e for e in events if e["ph"] == "X" and e["cat"] == "kernel"):
        args = event["args"]
        sizes = [args.get("global_size"), args.get("local_size")]
        if not all(isinstance(s, list) and len(s) == 3 and all(isinstance(n, int) and n > 0 for n in s) for s in sizes):
            yield f"a kernel without sizes: {event}"
        elif any(g % l for g, l in zip(*sizes)):
            yield f"groups do not divide the work: {event}"
        if not all(args[name] > 0 for name in ("slots", "bytes") if name in args):
            yield f"a kernel with no work: {event}"


def problems(trace):
    """What is wrong with a trace by these rules; each a sentence."""
    events = trace["traceEvents"]
    for event in events:
        if event.get("ph") not in {"M", "X", "s", "f", "C"} or not isinstance(event.get("pid"), int):
            yield f"no such event: {event}"
            return
        if event["ph"] in "Xsf" and not isinstance(event.get("tid"), int):
            yield f"an event of no thread: {event}"
            return
    timed = [e["ts"] for e in events if e["ph"] != "M"]
    if not all(is_number(ts) and ts >= 0 for ts in timed):
        yield "a time is no number"
        return
    if timed != sorted(timed):
        yield "events are not in the order of their times"
    for rule in (problems_of_metadata, problems_of_slices, problems_of_flows, problems_of_counters,
                 problems_of_kernels):
        yield from rule(events)


def broken(trace):
    """Copies of a trace in each of which one rule is broken, and what that breaks."""

    def changed(what, change):
        copied = copy.deepcopy(trace)
        change(copied["traceEvents"])
        return what, copied

    def first(events, phase, **members):
        return next(e for e in events if e["ph"] == phase and all(e.get(k) == v for k, v in members.items()))

    def last(events, phase, **members):
        return first(list(reversed(events)), phase, **members)

    def swap(events):
        events[-1], events[-2000] = events[-2000], events[-1]

    def lengthen(events):
        """A kernel that reaches into the next one."""
        one, other = [e for e in events if e["ph"] == "X" and e.get("cat") == "kernel"][:2]
        one["dur"] = other["ts"] - one["ts"] + other["dur"] / 2

    yield changed("a row's name", lambda es: es.remove(first(es, "M", name="thread_name")))
    yield changed("a row's place", lambda es: es.remove(first(es, "M", name="thread_sort_index")))
    yield changed("the process's name", lambda es: es.remove(first(es, "M", name="process_name")))
    yield changed("the order", swap)
    yield changed("nesting", lengthen)
    yield changed("a flow's begin", lambda es: es.remove(last(es, "s")))
    yield changed("a flow's end", lambda es: es.remove(last(es, "f")))
    yield changed("a flow's id", lambda es: first(es, "s").update(id=0))
    yield changed("a flow's name", lambda es: first(es, "f").update(name="other"))
    yield changed("what a flow's end binds to", lambda es: first(es, "f").pop("bp"))
    yield changed("where a flow begins", lambda es: first(es, "s").update(tid=1))
    yield changed("when a flow ends", lambda es: last(es, "f").update(ts=last(es, "f")["ts"] + 1e9))
    yield changed("a call's slice", lambda es: es.remove(first(es, "X", cat="call")))
    yield changed("a counter's value", lambda es: first(es, "C").update(args={"launches": "many"}))
    yield changed("the last depth", lambda es: es.remove(last(es, "C", name="launches in the queue")))
    yield changed("a kernel's sizes", lambda es: first(es, "X", cat="kernel")["args"].update(local_size=[7, 1, 1]))
    yield changed("a kernel's time in the queue", lambda es: last(es, "X", cat="kernel")["args"].update(queued_us=-1))
    yield changed("a kernel's work", lambda es: first(es, "X", cat="kernel")["args"].update(slots=0))


def main():
    qjulia, folder, mesh = sys.argv[1], Path(sys.argv[2]), os.path.abspath(sys.argv[3])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    fitted = folder / "map.qjulia.json"
    runs = {
        "fit": [mesh, "-o", fitted, "--factors", "24", "--max-evaluations", "40"],
        "surface": [fitted, "-o", folder / "a.ply", "--resolution", "24"],
        "render": [fitted, "-o", folder / "a.png", "--size", "64x48"],
    }
    wrong = []
    for name, words in runs.items():
        file = folder / f"{name}.trace.json"
        subprocess.run([qjulia, name, *words, "--device", "cpu", "--trace", file, "--quiet"], check=True)
        trace = json.loads(file.read_text())
        wrong += [f"{name}: {problem}" for problem in list(problems(trace))[:5]]
        kernels = [e for e in trace["traceEvents"] if e["ph"] == "X" and e["cat"] == "kernel"]
        with_work = [e for e in kernels if "slots" in e["args"] and "bytes" in e["args"]]
        rows = {e["tid"] for e in kernels}
        print(f"{name}: {len(trace['traceEvents'])} events, {len(kernels)} kernels on {len(rows)} queues, "
              f"{len(with_work)} with slots and bytes")
        if len(kernels) < 20 or not with_work or (name == "surface") != (len(rows) > 1):
            wrong.append(f"{name}: its kernels are not what they were: see above")
        if name == "fit":
            wrong += [f"a trace with {what} changed passes" for what, bad in broken(trace) if not list(problems(bad))]
    for line in wrong:
        print("FAILED:", line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
