#!/usr/bin/env python3
"""Lays pictures side by side: montage.py OUT.png A.png B.png ... [--columns N] [--crop W,H] [--width W]."""

import argparse

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy


def read(path):
    reader = vtk.vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    width, height, _ = image.GetDimensions()
    pixels = vtk_to_numpy(image.GetPointData().GetScalars())
    return pixels.reshape(height, width, -1)[::-1, :, :3]


def shrink(pixels, width):
    """Averages whole pixels over the boxes that become one."""
    factor = max(1, pixels.shape[1] // width)
    height = pixels.shape[0] // factor * factor
    across = pixels.shape[1] // factor * factor
    boxes = pixels[:height, :across].reshape(height // factor, factor, across // factor, factor, 3)
    return boxes.mean(axis=(1, 3)).astype(np.uint8)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("pictures", nargs="+")
    parser.add_argument("--columns", type=int, default=4)
    parser.add_argument("--crop", help="width,height of the middle of each picture")
    parser.add_argument("--width", type=int, default=400, help="of each picture, at most twice this")
    options = parser.parse_args()
    tiles = []
    for path in options.pictures:
        pixels = read(path)
        if options.crop:
            width, height = map(int, options.crop.split(","))
            left, top = (pixels.shape[1] - width) // 2, 0
            pixels = pixels[top : top + height, left : left + width]
        tiles.append(shrink(pixels, options.width))
    blank = np.full_like(tiles[0], 255)
    while len(tiles) % options.columns:
        tiles.append(blank)
    rows = [np.hstack(tiles[k : k + options.columns]) for k in range(0, len(tiles), options.columns)]
    sheet = np.vstack(rows)[::-1]
    image = vtk.vtkImageData()
    image.SetDimensions(sheet.shape[1], sheet.shape[0], 1)
    array = numpy_to_vtk(np.ascontiguousarray(sheet).reshape(-1, 3), deep=True)
    image.GetPointData().SetScalars(array)
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(options.out)
    writer.SetInputData(image)
    writer.Write()


if __name__ == "__main__":
    main()
