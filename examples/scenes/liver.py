#!/usr/bin/python3
"""Makes liver.npy: the shape of a human liver in voxels of 8 mm, for liver.toml. Needs Python alone.

    examples/scenes/liver.py [FILE]        FILE: liver.npy beside this script

x goes from the patient's right to the left, y up to the head, z to the front. Labels: 1 the tissue (parenchyma), 2 a
stiff tumour. The outline is ellipsoids melted into one another, with the fissure between the lobes and the hollow that the
gall bladder and the vessels fill taken away.
"""

import math
import os
import struct
import sys

SHAPE = (28, 19, 18)  # cells along x, y and z: array[i, j, k]

# centre and half axes in cells
LOBES = [((9.0, 9.5, 8.5), (8.6, 9.2, 8.3)), ((15.5, 11.0, 9.5), (7.5, 6.2, 6.4)), ((21.5, 12.2, 10.0), (6.2, 3.8, 4.4))]
HOLLOW = ((13.5, 2.0, 4.0), (6.5, 5.5, 5.0))
TUMOUR = ((7.0, 9.0, 10.0), (2.6, 2.4, 2.5))
FISSURE_X, FISSURE_DEPTH = 16.5, 8.5  # a cleft from below, one cell wide
MELT = 6.0  # how sharply ellipsoids stay apart


def depth(ellipsoid, point):
    """1 at the centre, 0 on the surface, negative outside."""
    centre, axes = ellipsoid
    return 1 - math.sqrt(sum(((p - c) / a) ** 2 for p, c, a in zip(point, centre, axes)))


def label(i, j, k):
    point = (i + 0.5, j + 0.5, k + 0.5)
    body = math.log(sum(math.exp(MELT * depth(lobe, point)) for lobe in LOBES)) / MELT
    cleft = abs(point[0] - FISSURE_X) < 0.6 and point[1] < FISSURE_DEPTH
    if body < 0 or depth(HOLLOW, point) > 0 or cleft:
        return 0
    return 2 if depth(TUMOUR, point) > 0 else 1


def npy(shape, values):
    """A .npy file of uint8 in C order: the last index is the fastest."""
    header = "{'descr': '|u1', 'fortran_order': False, 'shape': %r, }" % (shape,)
    header += " " * (-(10 + len(header) + 1) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode("ascii") + bytes(values)


def main():
    if len(sys.argv) > 2:
        sys.exit("usage: liver.py [FILE]")
    path = sys.argv[1] if len(sys.argv) == 2 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "liver.npy")
    nx, ny, nz = SHAPE
    with open(path, "wb") as file:
        file.write(npy(SHAPE, [label(i, j, k) for i in range(nx) for j in range(ny) for k in range(nz)]))


if __name__ == "__main__":
    main()
