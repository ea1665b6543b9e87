"""Every look on one sheet, each beside its name: looks.py MAP... PICTURE"""

import argparse
import math

from matplotlib.figure import Figure

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("maps", nargs="+", help="maps that each look is shown on")
parser.add_argument("picture", help="the sheet, .png")
parser.add_argument("--size", type=int, nargs=2, default=(180, 150), help="of each picture, in pixels")
parser.add_argument("--azimuth", type=float, nargs="+", default=[30], help="of each map's camera")
parser.add_argument("--columns", type=int, default=3, help="looks beside each other")
arguments = parser.parse_args()

DPI, LABEL, GAP = 100, 22, 10  # pixels an inch; pixels
width, height = arguments.size
maps = [qjulia.load(name) for name in arguments.maps]
looks = [look for look in qjulia.looks() if look != "clay"]  # which is how maps look without any
rows = math.ceil(len(looks) / arguments.columns)
wide = arguments.columns * (len(maps) * width + GAP) - GAP
high = rows * (LABEL + height)

sheet = Figure(figsize=((wide + 0.5) / DPI, (high + 0.5) / DPI), dpi=DPI)
for number, look in enumerate(looks):
    print(look, flush=True)
    row, column = divmod(number, arguments.columns)
    left = column * (len(maps) * width + GAP)
    bottom = high - (row + 1) * (LABEL + height)
    for place, map in enumerate(maps):
        azimuth = arguments.azimuth[place % len(arguments.azimuth)]
        picture = qjulia.render(map, look=look, size=(2 * width, 2 * height), azimuth=azimuth)
        half = picture.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)) / 255
        sheet.figimage(half, left + place * width, bottom, origin="upper")
    sheet.text((left + 2) / wide, (bottom + height + 7) / high, look, fontsize=0.13 * DPI)
sheet.savefig(arguments.picture, dpi=DPI)
