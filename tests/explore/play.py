#!/usr/bin/python3
"""What one plays with on both kinds of pages: nine surprises, snapshots, clicked points, keys of a film, and help on phones; and
on pages with a server looks, dropped meshes and grooves of other maps."""
import json
import math
import subprocess
import time

import browser
from checks import check, check_errors, fit_ball, folder, qjulia, run, run_test
from server import Server

LEAST_APART = 25  # of 255, two of the nine that differ widely


def press(tab, name):
    """A button by its text."""
    tab.run(f"[...document.querySelectorAll('button')].find((b) => b.textContent === '{name}' && b.offsetParent).click(); 0")


def open_controls(tab):
    tab.run("document.documentElement.dataset.controls === 'closed' && document.getElementById('fold').click(); 0")


def nine(tab, begin):
    """Presses a button and waits for nine pictures; returns how far the two that are most alike are apart."""
    tab.run("delete document.querySelector('.nine').dataset.least; 0")
    press(tab, begin)
    tab.until("document.querySelector('.nine').dataset.least", 400)
    return float(tab.run("document.querySelector('.nine').dataset.least"))


def apart(tab):
    """The mean difference of the two most alike of the pictures that are seen, in blocks of 8 x 8 pixels."""
    means = tab.run("""[...document.querySelectorAll('.nine canvas')].map((c) => {
      const all = c.getContext('2d').getImageData(0, 0, c.width, c.height).data, sums = [];
      for (let y = 0; y + 8 <= c.height; y += 8) for (let x = 0; x + 8 <= c.width; x += 8) for (let k = 0; k < 3; ++k) {
        let sum = 0;
        for (let j = 0; j < 8; ++j) for (let i = 0; i < 8; ++i) sum += all[4 * ((y + j) * c.width + x + i) + k];
        sums.push(sum / 64);
      }
      return sums;
    })""")
    return min(sum(abs(p - q) for p, q in zip(a, b)) / len(a) for i, a in enumerate(means) for b in means[:i])


def check_nine(tab):
    tab.run("{ let last = 3; Math.random = () => (last = (16807 * last) % 2147483647) / 2147483647; } 0")  # always the same
    least = nine(tab, "Surprise me")
    count = tab.run("document.querySelectorAll('.nine button:enabled').length")
    seen = apart(tab)
    check(count == 9 and abs(seen - least) < 0.1 and least >= LEAST_APART, f"{count} pictures, the two most alike {seen:.1f} of 255 apart, as is said")
    before = tab.run("location.hash")
    tab.run("document.querySelectorAll('.nine button')[4].click(); 0")
    tab.wait(200)
    taken = tab.run("({ ...qjulia.state })")
    check(tab.run("location.hash") != before and not tab.run("document.getElementById('surprise').open"), "one of them is taken")
    kin = nine(tab, "Surprise me")
    tab.run("document.querySelectorAll('.nine button')[4].click(); 0")
    tab.wait(200)
    now = tab.run("({ ...qjulia.state })")
    off = max(abs(now["elevation"] - taken["elevation"]) / 60, abs(now["lightup"] - taken["lightup"]) / 65)
    check(off <= 0.61 and now != taken, f"a second press breeds from it: genes off by {off:.2f} of their ranges at most, {kin:.1f} apart")
    nine(tab, "Surprise me")
    press(tab, "Close")
    tab.wait(200)
    check(tab.run("({ ...qjulia.state })") == now, "none is taken where they are closed")
    press(tab, "Reset")
    tab.wait(200)


def check_snapshots(tab):
    tab.run("qjulia.change({ azimuth: 70, material: 'trap' }); 0")
    tab.wait(200)
    kept = tab.run("document.getElementById('canvas').toDataURL()")
    press(tab, "Keep this")
    tab.run("qjulia.change({ azimuth: 0, material: 'clay' }); 0")
    tab.wait(200)
    x, y = tab.run("(() => { const a = document.querySelector('#snapshots a'); a.scrollIntoView(); const b = a.getBoundingClientRect();"
                   " return [b.x + 20, b.y + 30]; })()")
    tab.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
    tab.until("!document.getElementById('over').hidden", 20)
    over, under = tab.run("['over', 'canvas'].map((id) => document.getElementById(id).getBoundingClientRect()).map((b) => [b.x, b.y, b.width, b.height])")
    tab.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", clickCount=1)
    check(over == under and tab.run("document.getElementById('over').hidden") and tab.run("qjulia.state.azimuth") == 0,
          f"held, a snapshot lies over the picture: {over}")
    tab.run("document.querySelector('#snapshots a').click(); 0")
    tab.wait(200)
    check(tab.run("qjulia.state.azimuth") == 70 and tab.run("document.getElementById('canvas').toDataURL()") == kept, "clicked, it is gone back to")
    check("azimuth=70" in tab.run("document.querySelector('#snapshots a').hash"), "and is a link")
    tab.call("Page.reload")
    tab.rest(1)
    tab.wait(200)
    open_controls(tab)
    check(tab.run("document.querySelectorAll('#snapshots a').length") == 1, "it is there when the page is loaded again")
    tab.run("document.querySelector('#snapshots button').click(); 0")
    check(tab.run("document.querySelectorAll('#snapshots a').length") == 0, "until it is removed")
    press(tab, "Reset")
    tab.wait(200)


def click(tab, x, y, count=1):
    for n in range(1, count + 1):
        for kind in ("mousePressed", "mouseReleased"):
            tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(kind == "mousePressed"), clickCount=n)


def check_click(tab):
    """A click puts a point of the set into the middle; a double click goes back."""
    tab.run("qjulia.change({ zoom: 2 }); 0")
    tab.wait(200)
    wide, high = tab.run("(() => { const b = document.getElementById('canvas').getBoundingClientRect(); return [b.width, b.height]; })()")
    x, y = 0.6 * wide, 0.42 * high
    click(tab, x, y)
    tab.until("qjulia.state.look", 30)
    tab.wait(200)
    point = tab.run("qjulia.state.look")
    # Between the icosahedron's middles of faces and its corners, and a little beyond.
    check(1.4 < math.dist(point, (0, 0, 0)) < 2, f"a click looks at a point of the set: {point}")
    click(tab, 0.5 * wide, 0.5 * high)
    tab.rest(1.5)
    tab.wait(200)
    off = math.dist(point, tab.run("qjulia.state.look"))
    check(off < 0.1, f"which is then in the middle: off by {off:.3f}")
    click(tab, 0.6 * wide, 0.4 * high, count=2)
    tab.rest(1)
    tab.wait(200)
    check(tab.run("qjulia.state.look") is None and tab.run("qjulia.state.zoom") == 1, "a double click goes back, and looks at nothing")
    click(tab, 2, 2)
    tab.rest(1)
    check(tab.run("qjulia.state.look") is None, "a click beside the set does nothing")


def check_film(tab, name):
    for values in ("{ azimuth: 150, zoom: 1, detail: 0.02, phase1: 0, lightaz: 10, cutx: 80, cuty: 90, material: 'trap', palette: 'ice' }", "{ azimuth: -160, zoom: 2, detail: 0.04, phase1: 80, lightaz: 30, cutz: 60 }"):
        tab.run(f"qjulia.change({values}); 0")
        tab.wait(200)
        press(tab, "Key here")
    tab.run("(() => { const s = document.querySelectorAll('.key input')[1]; s.value = 2; s.dispatchEvent(new Event('change')); })()")
    half = tab.run("qjulia.filmAt(1)")
    # Half-way between two keys a spline is in the middle, by ratio for zooms.
    off = max(abs(half["azimuth"] - 175), abs(half["zoom"] - math.sqrt(2)), abs(half["phase1"] - 40), abs(half["cutz"] - 80))
    check(off < 1e-6, f"between keys the film goes the shorter way around: off by {off:.1e}")
    tab.run("qjulia.change({ azimuth: 0, zoom: 1 }); 0")
    tab.wait(200)
    press(tab, "Play")
    tab.until("qjulia.state.azimuth === -160 && qjulia.state.zoom === 2", 100)
    tab.wait(200)
    # The button says Stop while it plays.
    check(tab.run("[...document.querySelectorAll('button')].filter((b) => ['Play', 'Stop'].includes(b.textContent)).map((b) => b.textContent)") == ["Play"],
          "it is played to its end")
    script = tab.download(folder / "film", "[...document.querySelectorAll('button')].find((b) => b.textContent === 'Save script').click()")
    text = script.read_text()
    says = ("at = 2", "azimuth = 200", "lamp_turn = 220", 'cut = ["x=80%", "y=90%"]', "cut_z = 60", 'material = "trap"')
    check(all(line in text for line in says) and "scale" not in text, "and saved as a script")
    (folder / "film.toml").write_text(text)
    small = text.replace(text[text.index("size = "):].splitlines()[0], 'size = "48x36"')
    (folder / "film.toml").write_text(small)
    done = subprocess.run([qjulia, "film", "sheet", "film.toml", "-o", f"{name}.png", "--pictures", "3", "--device", "cpu", "--quiet"], cwd=folder,
                          capture_output=True, text=True, check=False)
    check(done.returncode == 0, f"which 'qjulia film' takes: {done.stderr}")
    press(tab, "Reset")
    tab.wait(200)


def check_page(tab, name):
    check_snapshots(tab)
    check_click(tab)
    check_film(tab, name)
    check_nine(tab)


def check_looks(tab):
    """The looks are a strip of small pictures, which differ, and stay when the page is loaded again."""
    open_controls(tab)
    tab.run("document.getElementById('looks').scrollIntoView(); 0")
    tab.until("document.querySelector('#looks img') && [...document.querySelectorAll('#looks img')].every((i) => i.naturalWidth === 96)", 200)
    names, pictures = tab.run("[[...document.querySelectorAll('#looks span')].map((s) => s.textContent), [...document.querySelectorAll('#looks img')].map((i) => i.src)]")
    check(len(names) >= 16 and len(set(pictures)) >= len(names) - 1, f"{len(names)} looks, {len(set(pictures))} pictures")  # "none" and one other may be alike
    tab.run(f"document.querySelectorAll('#looks button')[{names.index('gold')}].click(); 0")
    tab.wait(200)
    pressed = tab.run("[...document.querySelectorAll('#looks button[aria-pressed=true]')].map((b) => b.textContent)")
    check(tab.run("qjulia.state.wears") == "gold" and pressed == ["gold"], f"one is taken: {pressed}")
    tab.call("Page.reload")
    tab.rest(1)
    tab.wait(200)
    check(tab.run("[...document.querySelectorAll('#looks img')].map((i) => i.src)") == pictures, "they are kept while the tab is open")
    open_controls(tab)
    press(tab, "Reset")
    tab.wait(200)


def check_files(tab):
    """Meshes and maps that are dropped or chosen; what is wrong with others is said, and the page lives on."""
    run("surface", "ball.qjulia.json", "-o", "bump.stl", "--resolution", 24, "--device", "cpu", "--quiet")
    (folder / "bad.obj").write_text("v 0 0\nf 1 2 3\n")
    (folder / "cat.jpg").write_bytes(b"x" * 1000)
    with open(folder / "huge.obj", "wb") as huge:
        huge.truncate(2 ** 26 + 1)  # without taking room
    for name, says in (("bad.obj", "line 1"), ("cat.jpg", "is no mesh"), ("huge.obj", "larger than 64 MiB")):
        tab.drop(folder / name, 300, 300)
        tab.until(f"document.getElementById('note').textContent.includes('{says}')", 30)
        print("       ", tab.run("document.getElementById('note').textContent"))
    tab.run("qjulia.change({ azimuth: 60 }); 0")
    tab.wait(200)
    check(not tab.run("!!document.querySelector('dialog[open]')") and tab.run("document.getElementById('drop').hidden"), "bad drops are told, and the page lives on")
    begin = time.monotonic()
    tab.drop(folder / "bump.stl", 300, 300)
    tab.until("document.title === 'bump.qjulia.json'", 60)
    seconds = time.monotonic() - begin
    tab.wait(200)
    check(tab.run("location.hash") in ("", "#") and tab.run("document.querySelectorAll('#knobs input').length") > 10, f"a mesh that is dropped becomes the page of its set: {seconds:.1f} s")
    open_controls(tab)
    press(tab, "Fit to its mesh")
    tab.until("!!document.querySelector('#stop:enabled')", 200)
    tab.run("document.getElementById('stop').click(); 0")
    tab.until("!!globalThis.qjulia && document.title === 'bump.qjulia.json'", 200)
    tab.wait(200)
    kind = json.loads(tab.run("document.getElementById('qjulia-map').textContent"))["kind"]
    check(kind == "rational", f"on request a map of factors is fitted to it: {kind}")
    tab.drop(folder / "bump.stl", 300, 300)
    tab.rest(1)
    tab.until("!!globalThis.qjulia && !document.querySelector('dialog[open]')", 60)
    tab.run("qjulia.change({ azimuth: 60 }); 0")
    tab.wait(200)
    before = tab.run("document.getElementById('canvas').toDataURL()")
    tab.choose("input[type=file][accept*=json]", folder / "ball.qjulia.json")
    tab.until("document.title === 'bump_grooved.qjulia.json'", 60)
    tab.wait(200)
    check(tab.run("qjulia.state.azimuth") == 60 and tab.run("document.getElementById('canvas').toDataURL()") != before, "a map that is chosen gives its grooves, and the view stays")
    open_controls(tab)
    press(tab, "Fit to its mesh")
    tab.until("document.getElementById('note').textContent.includes('drop one')", 30)
    press(tab, "Back to the first")
    tab.until("document.title === 'ball.qjulia.json'", 60)
    tab.wait(200)


CHOOSE = "(() => { const s = document.querySelector('select[name=brush]'); s.value = '%s'; s.dispatchEvent(new Event('change')); })()"


def places_of(tab):
    """What makes a place of the window of shares of the picture's sides."""
    left, top, wide, high = tab.run("(() => { const b = document.getElementById('canvas').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()")
    return lambda x, y: (left + x * wide, top + y * high)


def check_brush(tab):
    """A stroke over the picture paints the set, a click plants a copy, and both are taken back."""
    open_controls(tab)
    tab.run("qjulia.change({ look: null, zoom: 1 }); 0")
    tab.wait(200)
    before = tab.run("document.getElementById('canvas').toDataURL()")
    at = places_of(tab)
    tab.run(CHOOSE % "paint")
    azimuth = tab.run("qjulia.state.azimuth")
    for kind, (x, y), buttons in (("mousePressed", at(0.45, 0.45), 1), ("mouseMoved", at(0.55, 0.5), 1)):
        tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)
    seen = tab.run("document.querySelectorAll('.trail').length")
    x, y = at(0.55, 0.5)
    tab.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", clickCount=1)
    check(seen == 1, "a stroke is seen where it goes")
    tab.until("document.title === 'ball_painted.qjulia.json'", 60)
    tab.wait(200)
    painted = tab.run("document.getElementById('canvas').toDataURL()")
    check(painted != before and tab.run("qjulia.state.azimuth") == azimuth and tab.run("document.querySelectorAll('.trail').length") == 0, "it paints the set, and turns nothing")
    check("ball_painted.qjulia.json" in tab.run("qjulia.renderCommand()"), "and commands name what is seen")
    tab.screenshot(folder / "painted.png")
    tab.run(CHOOSE % "plant")
    tab.drag(*at(0.5, 0.4), *at(0.5, 0.4))
    tab.until("document.title === 'ball_painted_portals.qjulia.json'", 60)
    tab.wait(200)
    check(tab.run("document.getElementById('canvas').toDataURL()") != painted, "a click plants a copy")
    tab.screenshot(folder / "planted.png")
    for title in ("ball_painted.qjulia.json", "ball.qjulia.json"):
        press(tab, "Take back")
        tab.until(f"document.title === '{title}'", 60)
        tab.wait(200)
    check(tab.run("document.getElementById('canvas').toDataURL()") == before, "and all is taken back")
    tab.run(CHOOSE % "look")
    press(tab, "Take back")
    tab.until("document.getElementById('note').textContent.includes('left to take back')", 30)
    tab.run("qjulia.change({ azimuth: 30 }); 0")
    tab.wait(200)


def check_help(tab):
    """On a phone, what a control does is said where it is touched."""
    tab.be_phone(360, 640)
    open_controls(tab)
    tab.wait(200)
    silent = tab.run("""[...document.querySelectorAll('#panel button, #panel select, #panel input')].filter((e) => e.offsetParent)
        .filter((e) => !(e.closest('[title]')?.title.length > 10)).map((e) => e.name || e.textContent)""")
    check(silent == [], f"every control has a sentence: {silent}")
    tab.run("document.querySelector('input[type=range][name=detail]').scrollIntoView(); 0")
    x, y = tab.run("(() => { const b = document.querySelector('input[type=range][name=detail]').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")
    tab.touch(((x, y), (x, y)), steps=0)
    said, place, panel = tab.run("(() => { const h = document.getElementById('hint'); return [h.textContent, h.getBoundingClientRect().bottom,"
                                 " document.querySelector('input[name=detail]').closest('[title]').title]; })()")
    check(said == panel and place <= tab.run("innerHeight"), f"and says it where it is touched: {said}")
    tab.wait(200)
    tab.screenshot(folder / "help.png")


def check_finger(tab):
    """On a phone, a finger paints."""
    tab.run(CHOOSE % "paint")
    tab.run("document.getElementById('panel').scrollTop = 0; 0")
    tab.wait(200)
    at, before, azimuth = places_of(tab), tab.run("document.getElementById('canvas').toDataURL()"), tab.run("qjulia.state.azimuth")
    tab.touch((at(0.45, 0.45), at(0.55, 0.55)), (at(0.6, 0.5), at(0.6, 0.5)), steps=2)
    tab.rest(1)
    tab.wait(200)
    check(tab.run("document.title") == "ball.qjulia.json" and tab.run("document.querySelectorAll('.trail').length") == 0, "two fingers paint nothing")
    tab.run(f"qjulia.change({{ look: null, zoom: 1, azimuth: {azimuth} }}); 0")
    tab.wait(200)
    tab.touch((at(0.45, 0.45), at(0.55, 0.55)), steps=4)
    tab.until("document.title === 'ball_painted.qjulia.json'", 60)
    tab.wait(200)
    check(tab.run("document.getElementById('canvas').toDataURL()") != before and tab.run("qjulia.state.azimuth") == azimuth, "a finger paints on a phone, and turns nothing")
    tab.screenshot(folder / "finger.png")
    press(tab, "Take back")
    tab.until("document.title === 'ball.qjulia.json'", 60)


def main():
    fit_ball()
    run("share", "ball.qjulia.json", "-o", "ball.html", "--quiet")
    with browser.Browser(900, 640) as tab:
        tab.offline()
        tab.open((folder / "ball.html").as_uri() + "?size=96x72&samples=0")
        tab.wait(200)
        open_controls(tab)
        check_page(tab, "shared")
        check_help(tab)
        check(tab.errors == [], f"no errors and no requests: {sorted(set(tab.errors))}")
    with Server(qjulia, folder, "ball.qjulia.json") as server, browser.Browser(900, 640) as tab:
        tab.open(server.address + "&size=96x72&samples=0")
        tab.wait(200)
        open_controls(tab)
        check_looks(tab)
        check_brush(tab)
        check_files(tab)
        open_controls(tab)
        check_page(tab, "served")
        check_help(tab)
        check_finger(tab)
        check_errors(tab)


run_test(main)
