"""Draws a frame obliquely, coloured by one of its fields, as in the README; needs pyvista and matplotlib.

python docs/picture.py FRAME.vtu OUT.png --field c --range 0,0.7 --map viridis --title "species c"
"""

import argparse
import io

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv
from PIL import Image, ImageChops

WHITE = (255, 255, 255)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("frame")
    parser.add_argument("out")
    parser.add_argument("--field", required=True)
    parser.add_argument("--range", required=True, help="least,largest value of the colour scale")
    parser.add_argument("--map", default="viridis")
    parser.add_argument("--title", default="")
    parser.add_argument("--azimuth", type=float, default=-60.0)
    parser.add_argument("--elevation", type=float, default=38.0)
    parser.add_argument("--light", type=float, default=1.0)
    parser.add_argument("--width", type=int, default=760)
    return parser.parse_args()


def direction(azimuth, elevation):
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def sheet(given, limits):
    surface = pv.read(given.frame).extract_surface(algorithm="dataset_surface")
    names = [name for name in surface.point_data if name.split(" [")[0] == given.field]
    surface = surface.compute_normals(split_vertices=False)
    centre, size = np.array(surface.center), surface.length
    plotter = pv.Plotter(off_screen=True, window_size=[2200, 1400], lighting="none")
    plotter.set_background("white")
    plotter.add_mesh(surface, scalars=names[0], cmap=given.map, clim=limits, smooth_shading=True,
                     ambient=0.25 * given.light, diffuse=0.8, specular=0.2, specular_power=25,
                     show_scalar_bar=False)
    view = direction(given.azimuth, given.elevation)
    plotter.camera_position = [tuple(centre + 2 * size * view), tuple(centre), (0, 0, 1)]
    for azimuth, elevation, intensity in [(40, 25, 0.75), (-60, 10, 0.35), (180, 40, 0.25)]:
        towards = direction(given.azimuth + azimuth, given.elevation + elevation)
        plotter.add_light(pv.Light(position=tuple(centre + 5 * size * towards),
                                   focal_point=tuple(centre), intensity=intensity * given.light,
                                   positional=False))
    plotter.camera.zoom(1.7)
    picture = Image.fromarray(plotter.screenshot(None, return_img=True)).convert("RGB")
    return picture.crop(ImageChops.difference(picture, Image.new("RGB", picture.size, WHITE)).getbbox())


def scale(given, limits):
    figure = plt.figure(figsize=(given.width / 100, 0.75), dpi=100)
    axes = figure.add_axes([0.3, 0.72, 0.4, 0.18])
    colours = plt.cm.ScalarMappable(plt.Normalize(*limits), given.map)
    plt.colorbar(colours, cax=axes, orientation="horizontal", ticks=[limits[0], sum(limits) / 2, limits[1]])
    axes.set_xlabel(given.title or given.field, fontsize=11, labelpad=1)
    buffer = io.BytesIO()
    figure.savefig(buffer)
    return Image.open(buffer).convert("RGB")


def main():
    given = arguments()
    limits = [float(value) for value in given.range.split(",")]
    above, below = sheet(given, limits), scale(given, limits)
    above = above.resize((given.width - 20, above.height * (given.width - 20) // above.width), Image.LANCZOS)
    whole = Image.new("RGB", (given.width, above.height + below.height + 20), WHITE)
    whole.paste(above, (10, 5))
    whole.paste(below, (0, above.height + 18))
    whole.save(given.out, optimize=True)


main()
