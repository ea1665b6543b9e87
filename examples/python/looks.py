"""Every look of a map on one sheet: looks.py MAP PICTURE"""

import argparse
import math

import numpy as np

import qjulia

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("map")
parser.add_argument("picture")
parser.add_argument("--size", type=int, nargs=2, default=(300, 255), help="of each picture, in pixels")
parser.add_argument("--columns", type=int, default=6)
arguments = parser.parse_args()

map = qjulia.load(arguments.map)
pictures = []
for name in qjulia.looks():
    print(name, flush=True)
    pictures.append(qjulia.render(map, look=name, size=(arguments.size[0], arguments.size[1])))
rows = math.ceil(len(pictures) / arguments.columns)
while len(pictures) < rows * arguments.columns:
    pictures.append(np.full_like(pictures[0], 255))
sheet = [
    np.concatenate(pictures[first : first + arguments.columns], axis=1)
    for first in range(0, len(pictures), arguments.columns)
]
qjulia.save_png(np.concatenate(sheet), arguments.picture)
