"""Opens the viewer of results in a headless browser and checks what it draws.

    python view.py PAGE.html [RESULT_DIR] [--pictures DIR] [--times]

The page must load without errors and without the network, draw a picture, and draw another one when it plays,
rotates, clips, or shows edges; with RESULT_DIR the probe must give the values of the last frame there, read by VTK.
Needs playwright (PyPI) and Chromium (RUMPLE_CHROMIUM, or chromium in the path); VTK for RESULT_DIR.
"""

import argparse
import json
import os
import shutil
import sys
import time
import zlib
from pathlib import Path

from playwright.sync_api import sync_playwright

SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

#: Sum, and share of pixels that are not white, of the first picture.
PIXELS = """() => {
  const canvas = document.querySelector('#grid canvas');
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  let [sum, coloured, mean, square] = [0, 0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const grey = data[i] + data[i + 1] + data[i + 2];
    sum = (sum * 31 + grey) % 2147483647;
    mean += grey; square += grey * grey;
    if (grey < 700) coloured += 1;
  }
  const n = data.length / 4;
  return { sum, coloured: coloured / n, variance: square / n - (mean / n) ** 2 };
}"""


def pixels(page):
    """The picture after the next redraw."""
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page.evaluate(PIXELS)


def must_change(page, what, act):
    """Fails unless `act` changes the picture within seconds: a busy machine delivers events late."""
    before = pixels(page)
    act()
    patience = time.monotonic() + 10
    after = pixels(page)
    while before["sum"] == after["sum"]:
        assert time.monotonic() < patience, f"{what} does not change the picture"
        after = pixels(page)
    print(f"{what}: the picture changes")
    return after


def drawing(page, folder):
    """The page draws, and follows its controls."""
    first = pixels(page)
    assert first["variance"] > 1000 and first["coloured"] > 0.02, first
    print(f"drawn: {100 * first['coloured']:.0f} % of the pixels, variance {first['variance']:.0f}")
    canvas = page.locator("#grid canvas").first
    canvas.focus()
    must_change(page, "an arrow key", lambda: page.keyboard.press("ArrowLeft"))
    box = canvas.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    def drag():
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 60, middle[1] + 20)
        page.mouse.up()

    must_change(page, "a drag", drag)
    must_change(page, "the wheel", lambda: page.mouse.wheel(0, -120))
    for field, value in [("#map", "coolwarm"), ("#clip", "x")]:
        must_change(page, field, lambda: page.select_option(field, value))
    page.screenshot(path=folder / "clip.png")
    page.select_option("#clip", "")
    for tick in ["#light", "#wires"]:
        must_change(page, tick, lambda: page.locator(tick).click())
    page.screenshot(path=folder / "edges.png")
    page.locator("#wires").click()
    page.locator("#light").click()
    must_change(page, "an amplified shape", lambda: page.fill("#factor", "3"))
    page.fill("#factor", "1")
    page.locator("[data-view=oblique]").click()
    page.select_option("#map", "viridis")


def playing(page):
    """Playing changes frames and ends."""
    if page.evaluate("() => document.getElementById('time').max") == "0":
        return print("one frame: not played")
    canvas = page.locator("#grid canvas").first
    canvas.focus()
    page.evaluate("() => { const t = document.getElementById('time'); t.value = 0; t.dispatchEvent(new Event('input')); }")
    first = pixels(page)
    clock = page.inner_text("#clock")
    page.keyboard.press("Space")
    page.wait_for_function("text => document.getElementById('clock').textContent !== text", arg=clock, timeout=10_000)
    page.wait_for_function("() => document.getElementById('play').textContent === 'Play'", timeout=30_000)
    assert pixels(page)["sum"] != first["sum"], "playing does not change the picture"
    print(f"played from {clock!r} to {page.inner_text('#clock')!r}")


#: Milliseconds per frame, over all frames.
PACE = """async () => {
  const slider = document.getElementById('time');
  const began = performance.now();
  for (let k = 0; k <= Number(slider.max); k += 1) {
    slider.value = k;
    slider.dispatchEvent(new Event('input'));
    await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
  }
  return (performance.now() - began) / (Number(slider.max) + 1);
}"""


def probing(page, result):
    """A click gives a vertex, and a vertex the values of the frame."""
    page.locator("[data-view=top]").click()
    pixels(page)
    canvas = page.locator("#grid canvas").first
    size = canvas.bounding_box()
    canvas.click(position={"x": size["width"] * 0.52, "y": size["height"] * 0.48})
    pixels(page)
    assert "vertex" in page.inner_text("#values"), page.inner_text("#values")
    vertex = int(page.input_value("#vertex"))
    print(f"a click probes vertex {vertex}")
    if result is None:
        return
    from vtk.numpy_interface import dataset_adapter
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(sorted((result / "frames").glob("*.vtu"))[-1]))
    reader.Update()
    grid = dataset_adapter.WrapDataObject(reader.GetOutput())
    # Names without units, for the quantities that are no arrays of the page.
    arrays = {k.split(" [")[0]: k for k in grid.PointData.keys()} | {k: k for k in grid.PointData.keys()}
    checked = 0
    for v in sorted({vertex, 0, len(grid.Points) - 1}):
        page.fill("#vertex", str(v))
        pixels(page)
        rows = page.locator("#values tr[data-quantity]")
        for i in range(rows.count()):
            name = rows.nth(i).get_attribute("data-quantity")
            shown = json.loads(rows.nth(i).get_attribute("data-values"))
            if name.endswith("(triangles)"):
                continue
            array = grid.Points if name == "position" else grid.PointData[arrays[name]]
            expected = [float(x) for x in (array[v] if len(array.shape) > 1 else [array[v]])]
            # Half a level of the range; displacements have that of two positions.
            width = float(grid.Points.max() - grid.Points.min()) if name in ("position", "displacement") \
                else float(array.max() - array.min())
            for a, b in zip(shown, expected, strict=True):
                assert abs(a - b) <= 1.01 * width / 65534 + 1e-12, (v, name, a, b)
                checked += 1
    print(f"the probe gives the values that VTK reads: {checked} numbers")


def reading(page):
    """What a reader without the manual finds: how to turn the sheet, curves of the sheet, those of the solvers apart."""
    assert page.locator("#hint").is_visible()
    titles = page.locator("#curves figcaption").all_inner_texts()
    assert any(title.startswith("total energy") for title in titles), titles
    assert "wall time [s]" not in titles and not page.locator("#work-curves").is_visible()
    page.locator("#work summary").click()
    work = page.locator("#work-curves figcaption").all_inner_texts()
    assert "wall time [s]" in work and not set(work) & set(titles), work
    page.locator("#work summary").click()
    warnings = page.locator("#warnings li").all_inner_texts()
    assert len(set(warnings)) == len(warnings), warnings
    print(f"curves of the sheet: {len(titles)}, of the solvers: {len(work)}")


def size_of(png):
    """Width, height and pixels a metre of a PNG file, whose chunk pHYs follows the header; its checksum is right."""
    assert png.startswith(b"\x89PNG") and png[37:41] == b"pHYs", png[:50]
    assert zlib.crc32(png[37:50]) == int.from_bytes(png[50:54], "big")
    return [int.from_bytes(png[at : at + 4], "big") for at in (16, 20, 41)]


def saving(page, folder):
    """The button saves a PNG, twice as large as on the page and without white at its sides, or as wide as asked."""
    sizes = []
    shown = page.evaluate("() => document.querySelector('#grid canvas').width")
    for title, width in [("", ""), ("A title", str(shown))]:
        page.fill("#picture-title", title)
        page.fill("#picture-width", width)
        with page.expect_download() as download:
            page.locator("#shot").click()
        download.value.save_as(folder / "saved.png")
        sizes.append(size_of((folder / "saved.png").read_bytes()))
    (wide, high, dense), (narrow, low, sparse) = sizes
    assert wide < 2 * shown, f"{wide} pixels wide, the page has {shown}: not cropped"
    assert abs(narrow - shown) <= 2, (narrow, shown)
    assert dense == round(2 * 96 / 0.0254) and abs(sparse / dense * wide / narrow - 1) < 0.01, sizes
    assert low / narrow > 1.02 * high / wide, "the title takes no room"
    print(f"a PNG is saved, {wide} × {high}, and {narrow} × {low} with a title")


def recording(page, folder):
    """The button saves a movie, of all frames at the speed of the player."""
    page.fill("#picture-width", "320")
    page.select_option("#speed", "30")
    with page.expect_download(timeout=60_000) as download:
        page.locator("#movie").click()
    name = download.value.suggested_filename
    download.value.save_as(folder / name)
    data = (folder / name).read_bytes()
    start = {"webm": data[:4] == b"\x1a\x45\xdf\xa3", "mp4": data[4:8] == b"ftyp"}
    assert start[name.rsplit(".", 1)[1]] and len(data) > 2000, (name, len(data), data[:12])
    # The page itself plays no media.
    player = page.context.browser.new_page()
    seconds = player.evaluate(DURATION, [list(data), f"video/{name.rsplit('.', 1)[1]}"])
    assert seconds > 0, seconds
    player.close()
    page.fill("#picture-width", "")
    page.fill("#picture-title", "")
    print(f"a movie is saved: {name}, {len(data)} bytes, {seconds:.2f} s")


#: Seconds to the last picture of a movie, which a recorder leaves out of its head.
DURATION = """async ([bytes, type]) => {
  const movie = document.createElement('video');
  movie.muted = true;
  movie.src = URL.createObjectURL(new Blob([new Uint8Array(bytes)], { type }));
  await new Promise((done, failed) => { movie.onloadeddata = done; movie.onerror = () => failed(movie.error.message); });
  movie.currentTime = 1e6;
  await new Promise(done => { movie.onseeked = done; });
  return movie.currentTime;
}"""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path)
    parser.add_argument("result", type=Path, nargs="?")
    parser.add_argument("--times", action="store_true", help="measure how long loading and frames take, nothing else")
    parser.add_argument("--pictures", type=Path, default=Path("."))
    args = parser.parse_args()
    args.pictures.mkdir(parents=True, exist_ok=True)
    browser_path = os.environ.get("RUMPLE_CHROMIUM") or shutil.which("chromium")
    problems = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=SOFTWARE)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("console", lambda m: problems.append(m.text) if m.type in ("error", "warning") else None)
        page.on("request", lambda r: problems.append(r.url) if not r.url.startswith(("file:", "data:", "blob:")) else None)
        began = time.perf_counter()
        page.goto(args.page.resolve().as_uri())
        pixels(page)
        size = args.page.stat().st_size / 1e6
        print(f"{size:.2f} MB drawn after {time.perf_counter() - began:.1f} s, a frame in {page.evaluate(PACE):.0f} ms")
        if args.times:
            return
        drawing(page, args.pictures)
        playing(page)
        probing(page, args.result)
        reading(page)
        saving(page, args.pictures)
        recording(page, args.pictures)
        page.locator("[data-view=oblique]").click()
        pixels(page)
        page.screenshot(path=args.pictures / "page.png", full_page=True)
        page.set_viewport_size({"width": 390, "height": 844})
        pixels(page)
        wide = page.evaluate("() => document.documentElement.scrollWidth")
        assert wide <= 390, f"the page is {wide} pixels wide on a telephone"
        page.screenshot(path=args.pictures / "telephone.png")
        page.pdf(path=args.pictures / "print.pdf")
        browser.close()
    # Reading pixels back is slow by design; nothing else may be reported.
    problems = [p for p in problems if "willReadFrequently" not in p and "GPU stall" not in p]
    assert not problems, problems
    print("no errors, no requests")


if __name__ == "__main__":
    sys.exit(main())
