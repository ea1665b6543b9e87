"""tools/measure-flicker finds pixels that change and change back, and no others.

    flicker.py PROGRAM FOLDER
"""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

program, folder = sys.argv[1], Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)


def measured(frames, *more, first=1):
    for file in folder.glob("frame_*.png"):
        file.unlink()
    for number, frame in enumerate(frames, first):
        Image.fromarray(frame).save(folder / f"frame_{number:04}.png")
    said = subprocess.run([sys.executable, program, folder, *more], capture_output=True, text=True)
    return said.returncode, [float(n) for n in re.findall(r"([\d.]+) %", said.stdout)]


def grey(level=100):
    return np.full((10, 20, 3), level, np.uint8)


def with_spot(level, pixels):
    frame = grey()
    frame.reshape(-1, 3)[:pixels] = level
    return frame


# One picture of six has two pixels of 200 that flash; one has them for two pictures.
assert measured([grey(), with_spot(140, 2), grey(), grey(), grey(), grey()]) == (0, [0.25, 1.0, 0.5])
assert measured([grey(), with_spot(140, 2), with_spot(140, 2), grey(), grey(), grey()])[1][1] == 1
# For three pictures, it is a change that stays.
assert measured([grey(), *[with_spot(140, 2)] * 3, grey(), grey(), grey()])[1][1] == 0
# Too little to see; all that grows brighter; and what comes to stay.
assert measured([grey(), with_spot(120, 2), grey(), grey()])[1] == [0, 0, 0]
assert measured([grey(10 + 30 * i) for i in range(6)])[1][:2] == [0, 0]
assert measured([grey(), grey(), with_spot(140, 2), with_spot(140, 2), with_spot(140, 2)])[1][:2] == [0, 0]
# A light that moves by two pixels a picture flickers, unless it is looked for nearby; one that jumps
# does either way.


def with_light(column):
    frame = grey()
    frame[5, column] = 200
    return frame


moving, jumping = [with_light(2 + 2 * i) for i in range(6)], [with_light((3 + 9 * i) % 20) for i in range(6)]
assert measured(moving)[1][0] > 0
assert measured(moving, "--reach", "2")[1][0] == 0
assert measured(jumping, "--reach", "2")[1][0] > 0
assert measured([grey(), grey()])[0] == 1
# Picture 10000 comes after 9999.
flash = [grey(), with_spot(140, 2), grey(), grey(), grey(), grey()]
assert measured(flash, first=9998) == measured(flash)
