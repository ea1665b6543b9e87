#!/usr/bin/python3
"""The server of `qjulia explore`: what it draws, and what it refuses and survives."""
import base64
import json
import math
import os
import pathlib
import random
import shlex
import signal
import socket
import subprocess
import threading
import time
import zlib

import browser
from checks import check, check_errors, fit_ball, folder, qjulia, run, run_test
from server import Server


def comes_to(call, seconds=60):
    """Whether a call returns true sooner or later."""
    until = time.monotonic() + seconds
    while not call():
        if time.monotonic() > until:
            return False
        time.sleep(0.1)
    return True


def check_refusals(server):
    page = f"/?token={server.token}"
    status, headers, body = server.get(page)
    check(status == 200 and b'data-renderer="server"' in body, "the page is served")
    check(headers["Cache-Control"] == "no-store" and headers["X-Frame-Options"] == "DENY", "with careful headers")
    check(server.status("/") == 403 and server.status("/?token=" + "0" * 32) == 403, "not without its token")
    check(server.status("/frame?size=8x8", token="0" * 32) == 403, "nor are pictures")
    check(server.status(page, Host=f"evil.example:{server.port}") == 403, "a name rebound to this address is refused")
    check(server.status(page, Host=f"LocalHost:{server.port}") == 200, "localhost is this machine")
    check(server.status(page, Host="127.0.0.1") == 403, "a port that is not the usual one is named")
    check(server.status("/frame?size=8x8", Origin="http://evil.example") == 403, "another site's requests are refused")
    check(server.status("/frame?size=8x8", Origin=f"http://127.0.0.1:{server.port}") == 200, "the page's own are not")
    status, _, body = server.get("/frame?size=8x8", method="POST", body="x")
    check(status == 405 and b"use GET" in body, "nothing is posted")
    check(server.status(page, Range="bytes=0-1,0-2") == 416, "no part is given out many times")
    for path in ("/etc/passwd", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/ball.qjulia.json"):
        check(server.status(path) in (403, 404), f"no file is given out: {path}")
    for query in ("detail=nan", "detail=-1", "detail=1", "size=99999x99999", "size=8", "size=8x8x8", "samples=9", "iterations=99",
                  "phase=1,2,3", "phase=0,0,0,0", "up=w", "cut=z", "size=8x8&size=9x9", "file=/etc/passwd", "zoom=1e999",
                  "order-seed=-1", "material=%00", "background=glass", "look-at=1,2,3,4", "steepness=1e9"):
        status, _, body = server.get(f"/frame?{query}")
        check(status == 400 or body.startswith(b"!"), f"a bad request is told so: {query}: {body[:60]}")
    for query in ("", "make=jpg", "make=/../x.ply", "make=ply&resolution=99999", "make=stl&millimetres=-1",
                  "make=turntable&frames=120&size=4000x4000", "make=ply&make=obj"):
        status, _, body = server.get(f"/make?{query}")
        check(status == 400, f"so is one to make a file: {query}: {body[:60]}")
    status, _, body = server.get("/refit", method="POST")
    check(status == 200 and json.loads(body)["problem"].startswith("there is no mesh") and server.status("/stop", method="POST") == 200,
          f"no fit begins without a mesh, and to stop none does no harm: {body}")
    check(server.status("/frame?size=8x8", client="") == 400, "a request must say which page it comes from")
    status, _, body = server.get("/frame?size=8x8&drift=40")
    check(status == 200 and body.startswith(b"!") and b"drift" in body, "what the map does not bear is told too")
    for query, told in (("size=0x0", b"size: '0x0' is not WIDTHxHEIGHT"), ("size=16385x1", b"size: give sides of 1 to 16384"), ("samples=0", b"samples: give 1 to 4"),
                        ("order-seed=-1", b"order-seed: '-1' cannot be used; give a whole number that is not negative"),
                        ("zoom=1e9", b"zoom: 1000000000 is out of range; give 0.01 to 1000")):
        _, _, body = server.get(f"/frame?{query}")
        check(body.startswith(told), f"with its name and what to give: {body}")
    _, _, body = server.get("/make?make=ply&resolution=x")
    check(body.startswith(b"resolution: 'x' cannot be used; give a whole number"), f"so is what to make: {body}")
    _, _, body = server.get("/frame?size=8x8&background=transparent")
    check(body[1:5] == b"\x89PNG" and body[26] == 6, f"a transparent background gives pixels with alpha: {body[:40]}")
    listening = [line.split()[1] for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]
                 if line.split()[3] == "0A" and line.split()[1].endswith(f":{server.port:04X}")]
    check(listening == [f"0100007F:{server.port:04X}"], f"it listens on the loopback address alone: {listening}")


def check_survival(server):
    some = random.Random(1)
    good = f"GET /frame?size=8x8 HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Qjulia-Token: {server.token}\r\n\r\n".encode()
    for number in range(1000):
        data = bytearray(good)
        for _ in range(some.randrange(1, 8)):
            at = some.randrange(len(data))
            data[at:at + some.randrange(3)] = bytes(some.randrange(256) for _ in range(some.randrange(4)))
        if number % 10 == 0:
            data = bytearray(some.randrange(256) for _ in range(some.randrange(1, 400)))
        if number % 25 == 0:
            data = bytearray(good[:some.randrange(len(good))])
        if number % 50 == 0:
            data = good.replace(b"\r\n\r\n", b"\r\nX: " + b"y" * 100000 + b"\r\n\r\n")
        server.raw(bytes(data))
    check(server.is_well(), "it survives 1,000 malformed requests")

    statuses = []
    many = [threading.Thread(target=lambda i=i: statuses.append(server.status("/frame?size=16x12", client=f"c{i}")))
            for i in range(100)]
    for thread in many:
        thread.start()
    for thread in many:
        thread.join()
    check(len(statuses) == 100 and set(statuses) <= {200, 503} and 200 in statuses, "and 100 connections at once")

    slow = []
    for _ in range(20):
        connection = socket.socket()
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        connection.connect(("127.0.0.1", server.port))
        connection.sendall(f"GET /?token={server.token} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode())
        slow.append(connection)
    connection = socket.create_connection(("127.0.0.1", server.port))
    connection.sendall(f"GET /make?make=ply&resolution=200 HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Qjulia-Client: slow\r\n"
                       f"X-Qjulia-Token: {server.token}\r\n\r\n".encode())
    slow.append(connection)
    check(server.is_well(), "and clients that stop reading, a page or a mesh")
    for connection in slow:
        connection.close()

    half = socket.create_connection(("127.0.0.1", server.port))
    half.sendall(b"GET /frame HTTP/1.1\r\nHost:")
    check(server.is_well(), "and one that stops writing")
    half.close()

    gone = socket.create_connection(("127.0.0.1", server.port))
    gone.sendall((f"GET /frame?size=3000x2000&samples=4&zoom=3 HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
                  f"X-Qjulia-Token: {server.token}\r\nX-Qjulia-Client: gone\r\n\r\n").encode())
    time.sleep(1)
    gone.close()
    begin = time.monotonic()
    check(server.is_well(), f"a picture that nobody waits for ends: {time.monotonic() - begin:.1f} s")

    answers = {}
    def ask(name, size):
        answers[name] = server.get(f"/frame?size={size}&samples=4", client="one")[2]
    first = threading.Thread(target=ask, args=("first", "2000x1500"))
    first.start()
    time.sleep(0.5)
    ask("second", "16x12")
    first.join()
    check(answers["first"] == b"-" and answers["second"][:2] == b"=\x89", "a page's new request ends its old one")

    first = threading.Thread(target=ask, args=("first", "600x450"))
    first.start()
    time.sleep(0.5)
    begin = time.monotonic()
    _, _, saved = server.get("/map", client="one")
    first.join()
    check(saved[:2] == b"={" and answers["first"][:2] == b"=\x89",
          f"a map that is saved ends no picture: waited {time.monotonic() - begin:.1f} s")


def unfiltered(data, wide, size):
    """The bytes of a PNG file's rows (PNG specification, 9.2): `wide` a row, `size` a pixel."""
    def paeth(a, b, c):
        p = a + b - c
        return min((a, b, c), key=lambda v: abs(p - v))

    rows, above = [], bytes(wide)
    for at in range(0, len(data), wide + 1):
        kind, row = data[at], bytearray(data[at + 1:at + 1 + wide])
        for i in range(wide):
            left, corner = (row[i - size], above[i - size]) if i >= size else (0, 0)
            row[i] = (row[i] + (0, left, above[i], (left + above[i]) // 2, paeth(left, above[i], corner))[kind]) % 256
        rows.append(bytes(row))
        above = row
    return b"".join(rows)


def pixels(data):
    """The bytes of a PNG file's pixels, 8-bit RGB."""
    at, packed = 8, b""
    while at < len(data):
        length = int.from_bytes(data[at:at + 4], "big")
        if data[at + 4:at + 8] == b"IDAT":
            packed += data[at + 8:at + 8 + length]
        at += 12 + length
    return unfiltered(zlib.decompress(packed), 3 * int.from_bytes(data[16:20], "big"), 3)


def check_pictures(server):
    outlines = [json.loads(server.get(f"/outline?rotate=0,0,1,{degrees}")[2]) for degrees in (0, 90)]
    m = json.loads((folder / "ball.qjulia.json").read_text())["shape_to_map"]
    x, y, _ = (-t / m["scale"] for t in m["translation"])  # the origin of iteration
    off = max(math.dist((x - (b - y), y + (a - x), c), turned) for (a, b, c), turned in zip(*outlines))
    check(len(outlines[0]) > 8 and off < 1e-5, f"the outline turns as the shape does: {len(outlines[0])} points off by {off:.1e}")
    status, _, body = server.get("/outline?rotate=0,0,0,90")
    check(status == 400 and body.startswith(b"rotate: give an axis"), f"about an axis: {body}")
    _, _, frame = server.get("/frame?size=160x120&samples=1&detail=0.03&phase=1,1,0,0&azimuth=70&cut=z%3D60%25")
    run("render", "ball.qjulia.json", "-o", "same.png", "--size", "160x120", "--samples", 1, "--detail", 0.03, "--phase", 1, 1,
        0, 0, "--azimuth", 70, "--cut", "z=60%", "--device", "cpu", "--quiet")
    same = (folder / "same.png").read_bytes()
    check(frame[:1] == b"=" and pixels(frame[1:]) == pixels(same), "a frame is the picture of 'render'")
    run("paint", "ball.qjulia.json", "-o", "painted.qjulia.json", "--ramp", "x=0.1:1", "--device", "cpu", "--quiet")
    with Server(qjulia, folder, "painted.qjulia.json") as painted:
        _, _, frame = painted.get("/frame?size=96x72&samples=1&detail=0.03&drift=0.3")
        run("render", "painted.qjulia.json", "-o", "same.png", "--size", "96x72", "--samples", 1, "--detail", 0.03, "--drift", 0.3,
            "--device", "cpu", "--quiet")
        same = (folder / "same.png").read_bytes()
        check(frame[:1] == b"=" and pixels(frame[1:]) == pixels(same), "a painted map is drawn as by 'render'")
        _, _, refused = painted.get("/frame?size=8x8&rotate=0,0,1,30")
        check(refused[:1] == b"!" and b"rotate" in refused, "what paint does not bear is told")
        check(b'"paint"' in painted.get("/map?drift=0.2")[2], "a saved map keeps its paint")
    _, _, mesh = server.get("/make?make=ply&resolution=24&material=trap&palette=ember")
    run("surface", "ball.qjulia.json", "-o", "same.ply", "--resolution", 24, "--material", "trap", "--palette", "ember", "--device",
        "cpu", "--quiet")
    after = mesh.index(b"end_header") if b"end_header" in mesh else 0
    same = (folder / "same.ply").read_bytes()
    check(b"property uchar red" in mesh[:after] and mesh[after:] == same[same.index(b"end_header"):],
          "a mesh has the colours of 'surface'")
    _, _, mesh = server.get("/make?make=stl&resolution=24&material=trap")
    check(mesh[:1] == b"=", "a file that holds no colours is made without")
    _, _, turned = server.get("/map?drift=0.4&order-seed=3")
    (folder / "turned.qjulia.json").write_bytes(turned[1:])
    run("convert", "ball.qjulia.json", "same.qjulia.json", "--drift", 0.4, "--order-seed", 3, "--device", "cpu", "--quiet")
    run("render", "turned.qjulia.json", "-o", "a.png", "--size", "64x48", "--quiet", "--device", "cpu")
    run("render", "same.qjulia.json", "-o", "b.png", "--size", "64x48", "--quiet", "--device", "cpu")
    a, b = (pixels((folder / name).read_bytes()) for name in ("a.png", "b.png"))
    check(a == b, "a map with its knobs turned is that of 'convert'")


def without_provenance(text):
    made = json.loads(text)
    del made["provenance"]
    return made


def check_files():
    """Meshes and maps that pages send: what is made of them is what 'shape' and 'convert' make; others are refused, and all goes on."""
    with Server(qjulia, folder, "ball.qjulia.json") as server:
        def send(path, name, body, **headers):
            return server.get(f"{path}?name={name}", method="POST", body=body, client="files", **headers)

        own = without_provenance(server.get("/map")[2][1:])
        run("surface", "ball.qjulia.json", "-o", "bump.obj", "--resolution", 24, "--device", "cpu", "--quiet")
        run("surface", "ball.qjulia.json", "-o", "bump.glb", "--resolution", 24, "--device", "cpu", "--quiet")
        for name in ("bump.obj", "bump.glb"):
            status, _, body = send("/shape", name, (folder / name).read_bytes())
            run("shape", name, "-o", "bump.qjulia.json", "--device", "cpu", "--quiet")
            made = without_provenance(server.get("/map")[2][1:])
            check(status == 200 and body == b"=bump.qjulia.json" and made == without_provenance((folder / "bump.qjulia.json").read_text()),
                  f"{name} becomes the map of 'shape': {body[:80]}")
        check(b'data-map="bump.qjulia.json"' in server.get(f"/?token={server.token}")[2], "whose page is then served")
        run("convert", "bump.qjulia.json", "grooved.qjulia.json", "--versor-from", "ball.qjulia.json", "--device", "cpu", "--quiet")
        status, _, body = send("/grooves", "ball.qjulia.json", (folder / "ball.qjulia.json").read_bytes())
        made = without_provenance(server.get("/map")[2][1:])
        check(body == b"=bump_grooved.qjulia.json" and made == without_provenance((folder / "grooved.qjulia.json").read_text()),
              f"and gets the grooves that 'convert --versor-from' gives: {body[:80]}")
        check(send("/first", "", None)[0] == 200 and without_provenance(server.get("/map")[2][1:]) == own, "until the first map is shown again")

        mesh = (folder / "bump.obj").read_bytes()
        for path, name, body, says in (("/shape", "x.obj", b"v 0 0\nf 1 2 3\n", b"x.obj"), ("/shape", "x.glb", mesh, b"x.glb"),
                                       ("/shape", "x.glb", os.urandom(5000), b"x.glb"), ("/shape", "x.jpg", mesh, b"x.jpg"),
                                       ("/shape", "../../../etc/x", mesh, b"x"), ("/grooves", "x.json", b"{}", b"x.json"),
                                       ("/grooves", "x.qjulia.json", b"[" * 20000, b"x.qjulia.json"), ("/grooves", "x.obj", mesh, b"x.obj"),
                                       ("/shape", "flat.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", b"")):
            status, _, body = send(path, name, body)
            check(status == 200 and body[:1] == b"!" and says in body and b"/tmp" not in body, f"{path} of a bad {name}: {body[:120]}")
        check(server.status("/shape?name=x.obj", token="0" * 32, method="POST", body=mesh) == 403, "no file without the token")
        check(server.status("/shape?name=x.obj") == 405 and send("/shape", "x.obj", b"")[0] == 413, "nor by GET, nor none")
        check(send("/shape", "x.obj", mesh, Origin="http://evil.example")[0] == 403, "nor from another site")
        check(send("/shape", "x.obj", mesh, Content_Type="multipart/form-data; boundary=x")[0] == 413 and
              send("/shape", "x.obj", mesh, Content_Encoding="gzip")[0] == 413, "nor packed in another way")
        head = f"POST /shape?name=x.obj HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Qjulia-Token: {server.token}\r\nX-Qjulia-Client: c\r\n"
        for more, what in ((f"Content-Length: {2 ** 26 + 1}\r\n\r\nv", "is too large"),
                           ("Transfer-Encoding: chunked\r\n\r\n5\r\nv 0 0\r\n0\r\n\r\n", "comes in chunks")):
            with socket.create_connection(("127.0.0.1", server.port), timeout=20) as connection:
                connection.sendall((head + more).encode())
                answer = connection.recv(4096)
            check(answer.startswith(b"HTTP/1.1 413 "), f"nor one that {what}: {answer[:30]}")
        server.raw((head + "Content-Length: 500\r\n\r\nv 0 0 0\n").encode())
        check(server.is_well(), "nor one that is cut off")

        def takes_one():
            with socket.create_connection(("127.0.0.1", server.port)) as half:  # refused while the one that was cut off is taken
                half.sendall((head + "Content-Length: 500\r\n\r\nv 0").encode())
                time.sleep(0.2)
                return send("/shape", "x.obj", mesh)[0] == 503 and server.is_well()

        check(comes_to(takes_one), "one at a time is taken, and pictures are drawn meanwhile")
        check(comes_to(lambda: send("/shape", "x.obj", mesh)[2] == b"=x.qjulia.json") and server.is_well(), "and then the next one")


def check_brush():
    """What the brush paints is what 'paint' paints there; copies are portals; what is wrong is said, and strokes can be taken back."""
    with Server(qjulia, folder, "ball.qjulia.json") as server:
        view = "size=80x60&samples=1&draft=1"
        map_now = lambda: without_provenance(server.get("/map")[2][1:])
        brush = lambda query: server.get(f"/brush?{query}", method="POST", client="brush")[2]
        own = map_now()
        point = json.loads(server.get(f"/point?{view}&at=0.5,0.45")[2][1:])
        radius = 0.15 * max(high - low for low, high in zip(*own["box"]))
        run("paint", "ball.qjulia.json", "-o", "painted.qjulia.json", "--ball", *point, repr(radius), 0.25, "--device", "cpu", "--quiet")
        said = brush(f"{view}&places=0.5,0.45&radius=0.15&share=0.25")
        check(said == b"=ball_painted.qjulia.json" and map_now() == without_provenance((folder / "painted.qjulia.json").read_text()),
              f"a stroke is a ball of 'paint': {said[:80]}")
        check(b'data-map="ball_painted.qjulia.json"' in server.get(f"/?token={server.token}")[2], "whose page is then served")
        once = map_now()
        said = brush(f"{view}&share=0")
        everywhere = map_now()
        shares = zlib.decompress(base64.b64decode(everywhere["paint"]["data"]))
        check(said[:1] == b"=" and len(shares) > 64 and set(shares) == {0} and everywhere["paint"] != once["paint"], "all of the set is painted")
        said = brush(f"{view}&places=0.5,0.3&copy=0.2")
        check(said == b"=ball_painted_portals.qjulia.json" and len(map_now()["portals"]) == 1, f"a copy is planted on it: {said[:80]}")
        taken = [server.get("/takeback", method="POST", client="brush")[2] for _ in range(4)]
        check(taken[0] == taken[1] == b"=ball_painted.qjulia.json" and taken[2] == b"=ball.qjulia.json" and taken[3][:1] == b"!" and map_now() == own,
              f"all of it is taken back: {taken[3][:80]}")
        planted = []
        for turned in ("azimuth=30", "azimuth=120&rotate=0,1,0,90"):
            check(brush(f"{view}&{turned}&places=0.5,0.3&copy=0.2")[:1] == b"=", f"a copy is planted with {turned}")
            planted.append(map_now()["portals"][0]["center"])
            server.get("/takeback", method="POST", client="brush")
        off = math.dist(*planted)
        check(off < 0.05, f"where the set is turned, a copy stands where it is seen: off by {off:.3f}")
        for query, says in ((f"{view}&places=0.01,0.01", b"missed the set"), (f"{view}&places=0.01,0.01&copy=0.2", b"missed the set"),
                            (f"{view}&places=0.5,0.45&copy=9", b"copy"), ("size=2000x2000&places=0.5,0.45", b"at most"), (f"{view}&places=0.5,0.45&rotate=0,0,1,30", b"rotate"),
                            (f"{view}&places=7,7", b"places"), (f"{view}&radius=x", b"radius"), ("zzz=1", b"unknown name")):
            said = brush(query)
            check(says in said and said[:1] != b"=", f"/brush?{query}: {said[:100]}")
        check(map_now() == own and server.is_well(), "and the map stays as it was")
        check(server.status("/brush") == 405 and server.status("/brush", token="0" * 32, method="POST") == 403, "it is no GET, and needs the token")


def check_backdrop(tab, server):
    """It is dark where the theme is, unless a light one is chosen."""
    for theme, chosen, is_dark in (("dark", "", True), ("dark", "&backdrop=light", False), ("light", "&backdrop=dark", True),
                                   ("dark", "&wears=gold&backdrop=light", False)):
        tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
        tab.open(f"{server.address}&size=48x36&samples=0#azimuth=50{chosen}")
        tab.wait(100)
        corner = tab.run("document.getElementById('canvas').getContext('2d').getImageData(0, 0, 1, 1).data[1]")
        command = tab.run("qjulia.renderCommand()")
        check((corner < 80) == is_dark and ("--background 1d1f24" in command) == is_dark,
              f"in the {theme} theme the backdrop is {'dark' if is_dark else 'light'}: {corner}; {command}")
    tab.call("Emulation.setEmulatedMedia", features=[])


def check_page(server):
    with browser.Browser(640, 480) as tab:
        check_backdrop(tab, server)
        tab.open(server.address + "&size=160x120&samples=1#azimuth=50")
        tab.wait(100)
        check(tab.run("qjulia.figures.frames.length") >= 2, f"the page draws: {tab.run('qjulia.figures.frames')}")
        times = []
        for k in range(6):
            tab.run(f"qjulia.change({{ azimuth: {60 + 10 * k}, phase1: {30 + k} }}); 0")
            tab.wait(100)
            times.append(tab.run("qjulia.figures.frames[0].ms"))
        print(f"        first frames after a change: {sorted(round(t) for t in times)} ms")
        tab.run("for (let k = 0; k < 30; ++k) qjulia.change({ azimuth: k }, false); qjulia.change({}); 0")
        tab.wait(100)
        tab.run("qjulia.change({ drift: 0.5, scale: 1.2, cutx: 70, material: 'trap' }); 0")
        tab.wait(100)
        tab.screenshot(folder / "page.png")
        check_command(tab, server)
        check_errors(tab)
        tab.run("qjulia.change({ zoom: 2 }); 0")  # and the browser closes in mid-frame
    check(server.is_well(), "a browser that is closed in mid-frame does no harm")


def check_command(tab, server):
    """The picture of the page is that of the command that it gives."""
    tab.open(f"{server.address}&size=320x240&samples=0#azimuth=50&phase1=30&detail=0.03&palette=ice&material=trap&cutx=60&lightaz=20&light=1.5&rotate=40&axis=y&drift=0.2&environment=evening&environturn=70&bounce=0.5")
    tab.wait(100)
    words = shlex.split(tab.run("qjulia.renderCommand()"))
    words[words.index("-o") + 1] = "command.png"
    run(*words[1:], "--samples", 1, "--device", "cpu", "--quiet")
    tab.run(f"globalThis.theirs = '{base64.b64encode((folder / 'command.png').read_bytes()).decode()}'; 0")
    off = tab.run("""(async () => {
      const bytes = Uint8Array.from(atob(theirs), (c) => c.charCodeAt(0)), picture = await createImageBitmap(new Blob([bytes]));
      const other = new OffscreenCanvas(320, 240).getContext("2d"), own = document.getElementById("canvas").getContext("2d");
      other.drawImage(picture, 0, 0);
      const a = other.getImageData(0, 0, 320, 240).data, b = own.getImageData(0, 0, 320, 240).data;
      return a.reduce((most, v, i) => Math.max(most, Math.abs(v - b[i])), 0);
    })()""")
    check(off == 0, f"the command copied makes the page's picture: bytes differ by {off}; {shlex.join(words)}")


def check_hosts():
    """Addresses in the form that browsers use; not those that stand for many."""
    for host in ("0.0.0.0", "::", "0"):
        done = subprocess.run([qjulia, "explore", "ball.qjulia.json", "--host", host, "--device", "cpu", "--quiet"], cwd=folder,
                              capture_output=True, text=True, timeout=100, check=False)
        check(done.returncode == 2 and done.stderr.startswith("qjulia: --host: "), f"--host {host}: {done.stderr.strip()}")
    hosts = {"127.1": "127.0.0.1", "LocalHost": "localhost"}
    if pathlib.Path("/proc/net/if_inet6").exists() and pathlib.Path("/proc/net/if_inet6").read_text():
        hosts["0:0:0:0:0:0:0:1"] = "::1"
    for given, usual in hosts.items():
        with Server(qjulia, folder, "ball.qjulia.json", "--host", given) as server:
            check(server.host == usual and server.is_well(), f"--host {given} is {server.address}")


def check_open():
    """The desktop is given a file that leads to the page, for this user alone."""
    tools, seen = folder / "desktop", folder / "opened.txt"
    tools.mkdir(exist_ok=True)
    seen.unlink(missing_ok=True)
    (tools / "xdg-open").write_text(
        f"#!/bin/sh\n{{ echo \"$*\"; stat -c %a \"$1\"; grep SigIgn /proc/self/status; cat \"$1\"; echo end; }} > '{seen.resolve()}'\n")
    (tools / "xdg-open").chmod(0o755)
    before = os.environ["PATH"]
    os.environ["PATH"] = f"{tools.resolve()}:{before}"
    server = Server(qjulia, folder, "ball.qjulia.json", "--open")
    os.environ["PATH"] = before
    begin = time.monotonic()
    while time.monotonic() < begin + 20 and not (seen.exists() and seen.read_text().endswith("end\n")):
        time.sleep(0.1)
    file, mode, ignored, *page = seen.read_text().splitlines()
    check(server.token not in file and mode == "600" and server.address in "".join(page), f"--open shows no token to others: {file}, {mode}")
    bits = int(ignored.split()[1], 16)
    check(not any(bits >> (number - 1) & 1 for number in (signal.SIGPIPE, signal.SIGXFSZ)), f"a browser ignores no signals: {ignored}")
    time.sleep(0.2)
    children = subprocess.run(["ps", "--ppid", str(server.process.pid), "-o", "stat="], capture_output=True, text=True, check=False).stdout
    check("Z" not in children, f"nothing is left of what opened it: '{children.strip()}'")
    check_ends(server, lambda: None, "Ctrl-C ends it")
    check(not pathlib.Path(file).exists(), "and takes the file away")


def check_ends(server, before, what):
    """Within two seconds of Ctrl-C."""
    before()
    begin = time.monotonic()
    server.process.send_signal(signal.SIGINT)
    try:
        code = server.process.wait(20)
    except subprocess.TimeoutExpired:
        server.process.kill()
        code = None
    seconds = time.monotonic() - begin
    check(code == 0 and seconds < 2, f"{what}: {code}, {seconds:.1f} s")


def main():
    fit_ball()
    server = Server(qjulia, folder, "ball.qjulia.json")
    try:
        check_refusals(server)
        check_pictures(server)
        check_files()
        check_brush()
        check_survival(server)
        check_page(server)
        check_ends(server, lambda: None, "Ctrl-C ends it")
        for path in ("/frame?size=3000x2000&samples=4", "/frame?size=1600x1200&iterations=16&drift=0.5"):
            server = Server(qjulia, folder, "ball.qjulia.json")
            asked = threading.Thread(target=server.get_or_nothing, args=(path,))
            check_ends(server, lambda: (asked.start(), time.sleep(0.4)), f"and while it draws: {path}")
            asked.join()
        server = Server(qjulia, folder, "ball.qjulia.json")
        slow = socket.create_connection(("127.0.0.1", server.port))
        def trickle():
            try:
                while True:
                    slow.sendall(b"G")
                    time.sleep(0.2)
            except OSError:
                pass
        sender = threading.Thread(target=trickle)
        check_ends(server, lambda: (sender.start(), time.sleep(0.4)), "and while a request comes byte by byte")
        sender.join()
        check_hosts()
        check_open()
        for number in range(20):
            server = Server(qjulia, folder, "ball.qjulia.json")
            check_ends(server, lambda: time.sleep(0.001 * (number % 4)), f"and at once: {number}")
    finally:
        server.process.kill()
        server.process.wait()


run_test(main)
