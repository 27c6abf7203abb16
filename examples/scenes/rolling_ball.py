#!/usr/bin/env python3
"""Makes rolling_ball.npy, the voxels of rolling_ball.toml: a ball of 24 cells across."""

import pathlib

import numpy

CELLS = 24
middle = (numpy.arange(CELLS) + 0.5) - CELLS / 2
x, y, z = numpy.meshgrid(middle, middle, middle, indexing="ij")
ball = (x**2 + y**2 + z**2 <= (CELLS / 2) ** 2).astype(numpy.uint8)
numpy.save(pathlib.Path(__file__).with_suffix(".npy"), ball)
