"""Many shapes, fitted on all devices at once: all_devices.py MESH..."""

import argparse
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("meshes", nargs="+", type=Path)
parser.add_argument("--factors", type=int, default=100)
parser.add_argument("--schedule", default="tight")
arguments = parser.parse_args()

# Each thread takes a device that is free. Fits run without Python's lock.
free: "Queue[qjulia.Device]" = Queue()
for info in qjulia.devices():
    free.put(qjulia.Device(info["id"]))


def fit(mesh: Path) -> str:
    device = free.get()
    try:
        result = qjulia.fit(
            mesh, factors=arguments.factors, schedule=arguments.schedule, device=device
        )
    finally:
        free.put(device)
    result.map.save(mesh.with_suffix(".qjulia.json").name)
    return f"{mesh.name}: {result.seconds:.1f} s on {device.name}, IoU {result.stages[-1].iou:.3f}"


with ThreadPoolExecutor(free.qsize()) as threads:
    for line in threads.map(fit, arguments.meshes):
        print(line)
