#!/usr/bin/python3
"""A page of `qjulia share` in headless Chromium, from disk and with no network: what it draws is what
`qjulia render` draws, what its shaders compute is what kernels compute, and its controls work.
share.py QJULIA MESH FOLDER [MAP WxH]: with MAP, its silhouettes alone, for settings of the knobs."""
import array
import base64
import json
import math
import os
import pathlib
import random
import shlex
import sys
import zlib

import browser
from checks import check, fit_ball, folder, mesh, run, run_test


def npy(file):
    """The numbers of a float32 .npy file of version 1."""
    data = (folder / file).read_bytes()
    numbers = array.array("f")
    numbers.frombytes(data[10 + int.from_bytes(data[8:10], "little"):])
    return numbers


def rendered(command):
    """Depths of the picture that a page's command makes."""
    words = shlex.split(command)
    words[words.index("-o") + 1] = "reference.png"
    run(*words[1:], "--samples", 1, "--aov", "reference", "--device", "cpu", "--quiet")
    return npy("reference.depth.npy")


def share(name):
    run("share", name, "-o", name + ".html", "--quiet")
    return (folder / (name + ".html")).as_uri()


def iou(page, reference):
    both = sum(p > 0 and math.isfinite(r) for p, r in zip(page, reference))
    either = sum(p > 0 or math.isfinite(r) for p, r in zip(page, reference))
    return both / either if either else 0


def compare(tab, address, name, settings, size, least=0.99):
    """The page's silhouette and depths against those of the command that it gives."""
    tab.open(f"{address}?size={size}&samples=0#{settings}")
    seconds = tab.wait(400)
    page, command = tab.run("[...qjulia.depths().depths]"), tab.run("qjulia.renderCommand()")
    reference = rendered(command)
    scale = json.loads((folder / name).read_text())["shape_to_map"]["scale"]
    pixel = tab.run("qjulia.depths().pixel")
    off = sorted(abs(p - scale * r) / pixel for p, r in zip(page, reference) if p > 0 and math.isfinite(r))
    share_of_both, median = iou(page, reference), off[len(off) // 2]
    check(len(page) == len(reference) and share_of_both >= least and median < 0.12,
          f"{name} [{settings}]: IoU {share_of_both:.4f} of {len(off)} pixels, depths off by {median:.3f} pixels; "
          f"page {seconds:.1f} s")


def compare_shared(tab, name, settings, size):
    compare(tab, share(name), name, settings, size)


def hamilton(p, q):
    a, b, c, d = p
    e, f, g, h = q
    return (a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e)


def versor_of(m, q):
    """U in double precision, from the formulas: of factors or quadratic."""
    u = m.get("phase", [1, 0, 0, 0])
    if m["kind"] == "quadratic":
        g = [x + c for x, c in zip(hamilton(q, q), m["c"])]
        size = math.hypot(*g)
        return [x / size for x in hamilton(u, g)]
    for factor in m["factors"]:
        d = [x - c for x, c in zip(q, factor["center"])]
        size = math.hypot(*d[1:])
        angle = factor["exponent"] * math.atan2(size, d[0])
        u = hamilton(u, (math.cos(angle), *(x * math.sin(angle) / size for x in d[1:])))
    return u


def compare_field(tab, name, with_versor, rounding=1):
    """F_n at the 10,648 points of `qjulia sample`, and U there. `rounding`: times that of a map of some twenty factors."""
    m = json.loads((folder / name).read_text())
    side, low, high = 22, -1.3, 1.3
    scale, move = m["shape_to_map"]["scale"], m["shape_to_map"]["translation"]
    middle = [low + (i + 0.5) * (high - low) / side for i in range(side)]
    points = [[scale * x + move[0], scale * y + move[1], scale * z + move[2], m["slice"]]
              for x in middle for y in middle for z in middle]
    tab.open(f"{share(name)}?size=16x16&samples=0")
    tab.wait(200)
    tab.run(f"globalThis.points = {json.dumps(points)}; 0")
    for n in (1, 3):
        found = tab.run(f"qjulia.at(points, {n}).filter((_, i) => i % 4 == 0)")
        run("sample", name, "-o", "field.npy", "--resolution", side, "--box", low, low, low, high, high, high,
            "--iterations", n, "--escape", 20, "--device", "cpu", "--quiet")
        expected = npy("field.npy")
        if n == 1:
            shell = [i for i, f in enumerate(expected) if abs(f - m["surface_level"]) < 1]
        # Iterates stretch rounding where F is steep: most points agree far better than the worst.
        off = sorted(abs(a - b) / max(1, abs(b)) for a, b in zip(found, expected))
        steep = sorted(abs(found[i] - expected[i]) for i in shell)
        most = rounding * {1: 2e-5, 3: 2e-3}[n]
        check(len(found) == len(expected) and off[len(off) * 98 // 100] < most and steep[len(steep) * 3 // 4] < 10 * most,
              f"{name}: F_{n} at {len(found)} points, 98 % off by {off[len(off) * 98 // 100]:.1e}; of {len(steep)} in the "
              f"shell 3/4 by {steep[len(steep) * 3 // 4]:.1e}")
    if with_versor:
        found = tab.run("qjulia.at(points, 0)")
        off = sorted(math.dist(found[4 * i:4 * i + 4], versor_of(m, q)) for i, q in enumerate(points))
        check(off[-11] < 3e-5, f"{name}: versor at {len(points)} points, all but ten within {off[-11]:.1e}")


def check_controls(tab, address):
    """What a viewer does: drag, turn the wheel, press keys, undo, follow a link, save."""
    tab.open(f"{address}?size=48x36&samples=0#azimuth=40")
    tab.wait(200)
    check(tab.run("qjulia.state.azimuth") == 40, "the address says where the camera is")
    tab.drag(20, 20, 45, 30)
    check(tab.run("qjulia.state.azimuth") == 30 and tab.run("qjulia.state.elevation") == 19, "a drag turns the set")
    check("azimuth" not in tab.run("location.hash") and "elevation=19" in tab.run("location.hash"),
          "the address follows: " + tab.run("location.hash"))
    tab.wait(200)
    tab.run("dispatchEvent(new KeyboardEvent('keydown', { key: 'z', ctrlKey: true })); 0")
    check(tab.run("qjulia.state.azimuth") == 40 and tab.run("qjulia.state.elevation") == 15, "Ctrl+Z takes it back")
    tab.call("Input.dispatchMouseEvent", type="mouseWheel", x=20, y=20, deltaX=0, deltaY=-300)
    check(1.2 < tab.run("qjulia.state.zoom") < 1.5, "the wheel zooms in")
    tab.wait(200)
    names = tab.run("[...document.querySelectorAll('#knobs input[type=range]')].map((i) => i.name)")
    for name in names:
        tab.run(f"""{{ const i = document.querySelector('input[type=range][name={name}]'); i.value = Number(i.min) + 0.4 * (i.max - i.min);
                      i.dispatchEvent(new Event('input')); i.dispatchEvent(new Event('change')); }} 0""")
        tab.wait(200)
    check(len(names) >= 15 and "rotate" not in names and "order" not in names, f"{len(names)} sliders were turned")
    said = tab.run("document.getElementById('knobs').textContent")
    check("order seed" in said and "qjulia explore ball.qjulia.json --open" in said, "and the page says what needs a server")
    for _ in range(len(names) + 1):
        tab.run("document.querySelector('#actions button').click()")
    tab.wait(200)
    check(tab.run("location.hash") in ("", "#", "#azimuth=40"), "undo takes all of it back: " + tab.run("location.hash"))
    tab.run("location.hash = '#material=trap&phase1=70'")
    tab.wait(200)
    check("--material trap" in tab.run("qjulia.renderCommand()"), "a link is followed while the page is open")
    check(tab.run("document.title") == "ball.qjulia.json", "the title is the map's name")
    command = tab.run("qjulia.surfaceCommand()")
    check(command == "qjulia surface ball.qjulia.json -o surface.ply --phase 0.3420201 0.9396926 0 0", command)
    tab.run("location.hash = '#toString=1&__proto__=1&azimuth=70'")
    tab.wait(200)
    check(tab.run("qjulia.state.azimuth") == 70, "a link with names that are no knobs is followed")
    tab.run("document.documentElement.dataset.map = '-x.json'; 0")
    check(tab.run("qjulia.surfaceCommand()").startswith("qjulia surface ./-x.json "), "a map's name is no option")
    tab.run("document.documentElement.dataset.map = 'ball.qjulia.json'; 0")


def check_phone(address):
    """Fingers on a phone turn, move and zoom the set, and reach the controls."""
    with browser.Browser(360, 640) as tab:
        tab.be_phone(360, 640)
        tab.open(address + "?samples=0")
        tab.wait(100)
        size = tab.run("[document.getElementById('canvas').width, document.getElementById('canvas').height, innerWidth, innerHeight]")
        check(size == [720, 1280, 360, 640], f"on a phone the picture fills the screen: {size}")
        tab.touch(((180, 320), (205, 310)))
        tab.wait(100)
        check(abs(tab.run("qjulia.state.azimuth") - 20) < 0.5 and abs(tab.run("qjulia.state.elevation") - 11) < 0.5,
              f"a finger turns the set: {tab.run('location.hash')}")
        tab.touch(((150, 320), (120, 320)), ((210, 320), (240, 320)))
        tab.wait(100)
        check(abs(tab.run("qjulia.state.zoom") - 2) < 0.02, f"two fingers that part zoom in: {tab.run('qjulia.state.zoom')}")
        tab.touch(((150, 320), (150, 280)), ((210, 320), (210, 280)))
        tab.wait(100)
        check(tab.run("qjulia.state.look[1]") < -0.05 and abs(tab.run("qjulia.state.zoom") - 2) < 0.02,
              f"two fingers that go up move the set up: {tab.run('qjulia.state.look')}")
        check(tab.run("visualViewport.scale") == 1 and tab.run("scrollY") == 0, "the page itself stays where it is")
        tab.tap("#fold")
        check(tab.run("document.documentElement.dataset.controls") == "open", "a tap opens the controls")
        boxes = tab.run("[...document.querySelectorAll('#actions button')].map((b) => b.getBoundingClientRect()).map((b) => [b.left, b.right])")
        check(all(left >= 0 and right <= 360 for left, right in boxes), "which fit the screen")
        under, panel = tab.run("['canvas', 'panel'].map((id) => document.getElementById(id).getBoundingClientRect()).map((b) => [b.top, b.bottom])")
        check(under[0] == 0 and under[1] <= panel[0] and panel[1] <= 640 and under[1] >= 320, f"beside the picture: {under}, {panel}")
        small = tab.run("""[...document.querySelectorAll('button, select, input')].filter((e) => e.offsetParent)
            .map((e) => [e.name || e.textContent, e.offsetWidth, e.offsetHeight]).filter(([, wide, high]) => Math.min(wide, high) < 44)""")
        check(small == [], f"and are large enough for fingers: {small}")
        tab.until("document.getElementById('canvas').height < 800")
        tab.wait(100)
        before = tab.run("qjulia.state.detail")
        left, top, wide = tab.run("(() => { const r = document.querySelector('input[type=range][name=detail]'); r.scrollIntoView(); "
                                  "const b = r.getBoundingClientRect(); return [b.x, b.y + b.height / 2, b.width]; })()")
        tab.touch(((left + wide / 2, top), (left + 0.9 * wide, top)))
        tab.wait(100)
        check(tab.run("qjulia.state.detail") > before and "detail" in tab.run("location.hash"), "and a finger moves a slider")
        tab.screenshot(folder / "phone.png")
        check(tab.errors == [], f"no errors on the phone: {sorted(set(tab.errors))}")


def check_saved_map(tab, address):
    """A saved map is the one that was shared, to the bit, and its command makes what 'convert' makes by the same knobs."""
    tab.open(f"{address}?size=16x16&samples=0#drift=0.5&scale=1.1&steepness=3&phase1=40&iterations=4")
    tab.wait(200)
    saved = tab.run("qjulia.mapFile()")
    held = (folder / "ball.qjulia.json.html").read_text().split('id="qjulia-map">')[1].split("</script>")[0]
    check(json.loads(saved["text"]) == json.loads(held) and saved["name"] == "ball.qjulia.json", f"a map is saved as it was shared: {saved['name']}")
    kept = folder / "kept"
    kept.mkdir(exist_ok=True)
    (kept / saved["name"]).write_text(saved["text"])
    words = shlex.split(saved["command"])
    words[2], words[3] = str(kept.resolve() / words[2]), str(kept.resolve() / words[3])
    run(*words[1:], "--device", "cpu", "--quiet")
    run("convert", "ball.qjulia.json", "turned.qjulia.json", "--drift", 0.5, "--scale", 1.1, "--steepness", 3,
        "--phase", math.cos(math.radians(40)), math.sin(math.radians(40)), 0, 0, "--device", "cpu", "--quiet")
    made, turned = (json.loads(file.read_text()) for file in (kept / "ball_turned.qjulia.json", folder / "turned.qjulia.json"))
    phase = max(abs(a - b) for a, b in zip(made.pop("phase"), turned.pop("phase")))
    del made["provenance"], turned["provenance"]
    check(made == turned and phase < 1e-6, f"and its command turns its knobs as 'convert' does: {saved['command']}")
    tab.open(f"{address}?size=16x16&samples=0#azimuth=70&iterations=3")
    tab.wait(200)
    check(tab.run("qjulia.mapFile().command") is None, "where no knob is turned, there is none")


def cell_of(nodes, value):
    return sum(node <= value for node in nodes[1:-1])


def check_looked_up(tab):
    """A page computes nothing of what the host has baked: where that is changed, shaders get what it is changed to."""
    page = (folder / (share("ball.qjulia.json").rsplit("/", 1)[1])).read_text()
    before, _, rest = page.partition('id="scene">')
    text, _, after = rest.partition("</script>")
    scene = json.loads(text)
    table = scene["table"]
    for k, lists in enumerate((table["levels"], table["inner"], *table["outer"], *table["slopes"], *scene["ranges"]["trap"])):
        lists[:] = [value * (1 + 1e-4 * (k + 1) / (i + 2)) for i, value in enumerate(lists)]
    for boxes in table["grids"]:
        for i, box in enumerate(boxes):
            box["grid_high"] = [high + 1e-3 * i for high in box["grid_high"]]
    (folder / "changed.html").write_text(f'{before}id="scene">{json.dumps(scene)}</script>{after}')
    entries = zlib.decompress(base64.b64decode(table["entries"]))
    some = random.Random(3)
    for _ in range(6):
        knobs = {knob["knob"]: some.uniform(knob["nodes"][0], knob["nodes"][-1]) for knob in table["knobs"]}
        knobs["slice"], iterations = some.uniform(-0.4, 0.4), some.choice((1, 2, 7))
        settings = "&".join(f"{name}={value}" for name, value in knobs.items())
        tab.open(f"{(folder / 'changed.html').as_uri()}?size=16x16&samples=0#{settings}&iterations={iterations}&material=trap")
        tab.wait(200)
        given = tab.run("qjulia.looked()")
        at = 0
        for knob in table["knobs"]:
            at = at * (len(knob["nodes"]) - 1) + cell_of(knob["nodes"], knobs[knob["knob"]])
        inner, outer, band, slope, single = entries[5 * at:5 * at + 5]
        cell, drifts = cell_of(table["slices"], knobs["slice"]), table["drifts"]
        i = next(i for i, drift in enumerate(drifts) if drift >= knobs["drift"])
        way = (knobs["drift"] - drifts[i - 1]) / (drifts[i] - drifts[i - 1])
        expected = {
            "map_log_inner": table["inner"][inner], "map_log_outer": table["outer"][outer][0], "map_log_escape": table["outer"][outer][1],
            "band_slope": table["slopes"][cell][single if iterations == 1 else slope],
            "map_surface_level": table["levels"][i - 1] + way * (table["levels"][i] - table["levels"][i - 1]),
            "knob_detail": knobs["detail"], "knob_drift": knobs["drift"], "knob_scale": knobs["scale"],
            "map_steepness": knobs["steepness"], "map_slice": knobs["slice"], **scene["uniforms"]}
        wrong = [name for name, value in expected.items()
                 if (abs(given["uniforms"][name] - value) > 1e-9 if isinstance(value, (int, float)) else given["uniforms"][name] != value)]
        grid = table["grids"][cell][band]
        ranges = tab.run("qjulia.renderCommand()").split("--range ")[1].split()[0]
        off = max(abs(float(a) - b) for a, b in zip(ranges.split(","), scene["ranges"]["trap"][iterations - 1]))
        check(wrong == [] and all(given["grid"][name] == grid[name] for name in grid) and off < 1e-6,
              f"shaders get what the host has baked: {settings}, wrong: {wrong}, {off:.1e}")


def check_escapes(tab):
    """Names and notes of a map are text, not code."""
    name = "a\"><img src=x onerror=alert(1)>'.qjulia.json"
    m = json.loads((folder / "ball.qjulia.json").read_text())
    m["provenance"] = {"note": "</script><script>document.title = 'run'</script><!--"}
    (folder / name).write_text(json.dumps(m))
    tab.open(share(name) + "?size=16x16&samples=0")
    tab.wait(200)
    check(tab.run("document.title") == name and tab.run("document.querySelectorAll('img:not(#over)').length") == 0, "names are escaped")
    command = tab.run("qjulia.renderCommand()")
    check(shlex.split(command)[2] == name, "and quoted in commands")
    (folder / "again.html").write_text((folder / (name + ".html")).read_text())
    told = json.loads(run("info", "again.html", "--json", "--device", "cpu"))
    check(told["factors"] == len(m["factors"]) and told["provenance"]["note"] == m["provenance"]["note"], "info reads the map back")
    check(tab.run("try { eval('1') } catch { 'refused' }", True) == "refused", "the policy refuses eval")
    tab.errors[:] = [e for e in tab.errors if "unsafe-eval" not in e]  # that the console tells of


def check_kinds(tab):
    """A map of each kind."""
    data = pathlib.Path(__file__).parent.parent.parent
    (folder / "quadratic.qjulia.json").write_text((data / "docs/maps/quadratic.qjulia.json").read_text())
    compare_field(tab, "quadratic.qjulia.json", True)
    compare_shared(tab, "quadratic.qjulia.json", "slice=0.1&azimuth=70", "120x90")
    run("shape", mesh, "-o", "distance.qjulia.json", "--resolution", 48, "--versor", "random:6:1", "--detail", 0.02,
        "--device", "cpu", "--quiet")
    compare_field(tab, "distance.qjulia.json", True)
    compare_shared(tab, "distance.qjulia.json", "phase1=50&drift=0.3", "120x90")
    # Orbits of these come to rest between e^L and the largest ball that the map takes into itself.
    for settings in ("detail=0.07&scale=2", "detail=0.07&scale=3&iterations=3"):
        compare_shared(tab, "distance.qjulia.json", settings, "120x90")
    noise = json.loads((folder / "ball.qjulia.json").read_text())
    noise.update(version=2, kind="factors/noise",
                 noise={"octaves": 2, "scale": 3, "seed": 7, "values": "vectors", "origin": [0, 0, 0]})
    (folder / "noise.qjulia.json").write_text(json.dumps(noise))
    compare_field(tab, "noise.qjulia.json", False)
    compare_shared(tab, "noise.qjulia.json", "steepness=4", "120x90")
    for name in ("ball", "distance"):
        painted = f"painted_{name}.qjulia.json"
        run("paint", f"{name}.qjulia.json", "-o", painted, "--ramp", "x=0.1:1", "--ball", 0, 0.5, 0, 0.4, 0, "--device", "cpu",
            "--quiet")
        compare_field(tab, painted, False)
        compare_shared(tab, painted, "detail=0.03&azimuth=60", "120x90")
        compare_shared(tab, painted, "drift=0.3&steepness=3", "120x90")
    run("portals", "ball.qjulia.json", "-o", "portals.qjulia.json", "--count", 2, "--device", "cpu", "--quiet")
    compare_field(tab, "portals.qjulia.json", False)
    compare_shared(tab, "portals.qjulia.json", "iterations=8", "120x90")
    compare_shared(tab, "portals.qjulia.json", "iterations=8&drift=0.2", "120x90")


def check_many_factors(tab):
    """Beyond 816 factors they lie in a texture. (q - c)^a is n times (q - c)^(a / n), and so the map stays what it was."""
    for parts, place in ((42, "texture"), (34, "block")):
        m, name = json.loads((folder / "ball.qjulia.json").read_text()), f"{place}.qjulia.json"
        m["factors"] = [{**f, "exponent": f["exponent"] / parts} for f in m["factors"] for _ in range(parts)]
        (folder / name).write_text(json.dumps(m))
        compare_shared(tab, name, "phase1=40&zoom=1.2", "80x60")
        check(tab.run("qjulia.factorsAreIn") == place, f"{len(m['factors'])} factors lie in a {place}")
        if place == "texture":
            compare_field(tab, name, False, 10)


def check_saved_picture(tab, address):
    """The file that 'Save picture' gives, of the size that was asked for."""
    tab.open(f"{address}?size=64x48&samples=0")
    tab.wait(200)
    opens = "[...document.querySelectorAll('button')].find((b) => b.textContent === 'Save picture').click();"
    sets = "for (const [name, value] of Object.entries(%s)) document.querySelector(`#picture [name=${name}]`).value = value;"
    tab.run(opens + "0")
    check(tab.run("['file', 'width', 'height', 'format'].map((name) => document.querySelector(`#picture [name=${name}]`).value)")
          == ["ball", "64", "48", "png"], "a picture has the map's name and the page's size unless it is given another")
    before = tab.run("location.hash")
    tab.key("s", "KeyS", 83)
    check(tab.run("document.activeElement.closest('dialog') !== null && location.hash") == before, "the dialog has the keyboard")
    tab.run(sets % "{ file: 'mine', width: 90, height: 99999 }")
    tab.key("Enter", "Enter", 13, "\r")
    check(tab.run("document.querySelector('#picture [name=height]').validity.rangeOverflow && document.querySelector('#picture').open"),
          "none is saved that is too large for the graphics")
    tab.run(sets % "{ height: 70 }")
    file = tab.download(folder / "downloads", "0", meanwhile=lambda: tab.key("Enter", "Enter", 13, "\r"))
    data = file.read_bytes()
    size = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    check(file.name == "mine.png" and size == (90, 70), f"Enter saves it: {file.name}, {size}")
    tab.wait(200)
    tab.run(opens + "0")
    tab.key("Escape", "Escape", 27)
    tab.until("document.querySelector('#picture') === null")
    check(tab.state() == "done" and tab.run("document.getElementById('canvas').width") == 64, "Escape saves nothing")
    file = tab.download(folder / "downloads", opens + sets % "{ format: 'jpg' }" + "document.querySelector('#picture [value=save]').click()")
    check(file.name == "ball.jpg" and file.read_bytes()[:3] == b"\xff\xd8\xff", f"and a smaller file is one of another format: {file.name}")
    tab.wait(200)
    file = tab.download(folder / "downloads",
                        "[...document.querySelectorAll('button')].find((b) => b.textContent === 'Save map').click()")
    check(json.loads(file.read_text())["format"] == "qjulia-map", f"and a map: {file.name}")


# What is seen when the graphics are asked for, before shaders are compiled and grids are made.
AT_FIRST = """const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (...kind) {
  const word = document.getElementById('drawing');
  globalThis.atFirst ??= word && [word.innerText.trim(), getComputedStyle(word).display, getComputedStyle(this).visibility,
                                  document.querySelector('#drawing progress').getBoundingClientRect().width];
  return get.apply(this, kind);
};"""


def check_begin(tab, address):
    """A page says at once that it draws, and shows no empty canvas."""
    script = tab.call("Page.addScriptToEvaluateOnNewDocument", source=AT_FIRST)["identifier"]
    tab.open(f"{address}?samples=0")
    tab.wait(200)
    word, display, visibility, wide = tab.run("atFirst") or ("nothing", "", "", 0)
    check(word == "Drawing the set" and display == "flex" and visibility == "hidden" and wide > 50,
          f"a page says at once that it draws: {word}, {display}, the canvas is {visibility}, a bar of {wide} pixels")
    check(tab.run("getComputedStyle(document.getElementById('drawing')).display") == "none" and
          tab.run("[getComputedStyle(canvas).visibility, getComputedStyle(canvas).filter].join()") == "visible,none", "until it is done")
    tab.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


CORNER = """(async () => {
  const blob = await new Promise((resolve) => document.getElementById("canvas").toBlob(resolve));
  const copy = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  copy.drawImage(await createImageBitmap(blob), 0, 0);
  return copy.getImageData(0, 0, 1, 1).data[1];
})()"""


def check_backdrop(tab, address):
    """Dark where the theme is, unless a light one is chosen."""
    for theme, backdrop, is_dark in (("light", "", False), ("dark", "", True), ("dark", "#backdrop=light", False), ("light", "#backdrop=dark", True)):
        tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
        tab.open(f"{address}{'&' if '?' in address else '?'}size=48x36&samples=0{backdrop}")
        tab.wait(200)
        corner, command = tab.run(CORNER), tab.run("qjulia.renderCommand()")
        check((corner < 80) == is_dark and ("--background" in command) == is_dark,
              f"in the {theme} theme {backdrop} the backdrop is {'dark' if is_dark else 'light'}: {corner}; {command}")
    tab.call("Emulation.setEmulatedMedia", features=[])


def check_palette(tab, address):
    seen = set()
    for palette in ("earth", "ice"):
        tab.open(f"{address}?size=48x36&samples=0#material=trap&palette={palette}")
        tab.wait(200)
        seen.add(tab.run("document.getElementById('canvas').toDataURL()"))
        command = tab.run("qjulia.renderCommand()")
        check(("--palette ice" in command) == (palette == "ice") and command.count("--range ") == 1, command)
    check(len(seen) == 2, "palettes have colours of their own")


ROD = (0.35, 2.83)  # half of its height and width, and half of its length


def write_rod(file):
    """A rod that lies along a diagonal of its box, and so reaches far out of the box's upright cylinder."""
    thin, far = ROD[0], ROD[1] / math.sqrt(2)
    ends = [[(s * far - a * thin, s * far + a * thin, b * thin) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))] for s in (-1, 1)]
    corners = [corner for end in ends for corner in end]
    faces = [(1, 2, 3, 4), (8, 7, 6, 5)] + [(i, i + 4, (i % 4) + 5, i % 4 + 1) for i in range(1, 5)]
    file.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join("f " + " ".join(map(str, f)) + "\n" for f in faces))


def filled(seen, columns):
    """The share of the columns and of the rows that a silhouette takes, and whether it touches the sides."""
    rows = [seen[i:i + columns] for i in range(0, len(seen), columns)]
    taken = [[i for i, line in enumerate(lines) if any(line)] for lines in (list(zip(*rows)), rows)]
    sides = [(t[-1] - t[0] + 1) / n for t, n in zip(taken, (columns, len(rows)))]
    return sides, any(t[0] == 0 or t[-1] == n - 1 for t, n in zip(taken, (columns, len(rows))))


def check_framing(tab):
    """From every azimuth the whole set is in sight, on a phone and on a screen, and large at the widest."""
    write_rod(folder / "rod.obj")
    run("shape", "rod.obj", "-o", "rod.qjulia.json", "--resolution", 48, "--device", "cpu", "--quiet")
    address = share("rod.qjulia.json")
    for size, settings in (("78x168", "up=z"), ("128x96", "up=z"), ("78x168", "up=y&elevation=50"), ("78x168", "up=z&drift=0.5")):
        columns, fills, cut = int(size.split("x")[0]), [], []
        for azimuth in range(-180, 180, 45):
            tab.open(f"{address}?size={size}&samples=0#{settings}&azimuth={azimuth}")
            tab.wait(200)
            sides, is_cut = filled([d > 0 for d in tab.run("[...qjulia.depths().depths]")], columns)
            fills.append(max(sides))
            cut += [azimuth] if is_cut else []
        check(cut == [] and 0.8 < max(fills) < 0.97, f"{size} {settings}: the set fills up to {max(fills):.2f} of a side; cut at {cut}")


def main():
    with browser.Browser(640, 480) as tab:
        tab.offline()
        if len(sys.argv) > 4:
            name = pathlib.Path(sys.argv[4]).name
            (folder / name).write_text(pathlib.Path(sys.argv[4]).read_text())
            address = share(name)
            size = os.path.getsize(folder / (name + ".html"))
            check(size <= 200 * 1024, f"the page has {size} bytes")
            for settings in ("", "iterations=1&material=trap", "phase1=60&phase2=40&phase3=20&azimuth=120", "drift=0.6",
                             "slice=0.2&steepness=4&elevation=40&cutz=60", "scale=1.1&detail=0.01"):
                compare(tab, address, name, settings, sys.argv[5])
        else:
            fit_ball()
            address = share("ball.qjulia.json")
            compare_field(tab, "ball.qjulia.json", True)
            for settings in ("", "detail=0.03&iterations=8&up=-z", "phase1=60&phase2=40&phase3=20&azimuth=120",
                             "detail=0.0137&drift=0.73&scale=0.87&steepness=2.7&slice=-0.13&iterations=9", "detail=0.004&scale=1.7&iterations=1", "material=trap&iterations=3&palette=ice",
                             "drift=0.5&zoom=1.4&look=0.2,0.1,0", "slice=0.2&steepness=4&scale=1.1&elevation=40&cutz=60"):
                compare(tab, address, "ball.qjulia.json", settings, "120x90")
            check_kinds(tab)
            check_framing(tab)
            check_begin(tab, address)
            check_backdrop(tab, address)
            check_looked_up(tab)
            check_controls(tab, address)
            check_saved_map(tab, address)
            check_saved_picture(tab, address)
            check_palette(tab, address)
            check_many_factors(tab)
            check_escapes(tab)
            check_phone(address)
        check(tab.errors == [], f"no errors and no requests: {sorted(set(tab.errors))}")


run_test(main)
