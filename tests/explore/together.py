#!/usr/bin/python3
"""Two servers of `qjulia explore` on one map, ports that are in use, and clients that go away. together.py QJULIA MAP FOLDER"""
import pathlib
import shutil
import signal
import socket
import subprocess
import threading
import time

from checks import check, folder, mesh as map_file, qjulia, run_test
from server import Server

NAME = "map.qjulia.json"


def refused(*options):
    """Returns the result of a server that cannot start."""
    return subprocess.run([qjulia, "explore", NAME, *map(str, options), "--device", "cpu", "--quiet"], cwd=folder, capture_output=True,
                          text=True, timeout=100, check=False)


def check_ports(server):
    done = refused("--port", server.port)
    check(done.returncode == 2 and done.stderr == f"qjulia: --port: {server.port} of 127.0.0.1 is in use; give another one, or 0 for any "
          "that is free\n", f"a port in use is said to be: {done.stderr.strip()}")
    done = refused("--host", "192.0.2.1")  # reserved for documentation: RFC 5737
    check(done.returncode == 2 and done.stderr.startswith("qjulia: --host: '192.0.2.1' is no address of this machine"),
          f"and so is another machine's address: {done.stderr.strip()}")


def check_saved(first, second):
    """Both servers save at the same time, with different turns, and neither ends the other's job."""
    turned, asked = {}, []
    for server, turn in ((first, 0.1), (second, 0.2)):
        asked.append(threading.Thread(target=lambda s=server, t=turn: turned.update({t: s.get(f"/map?slice={t}")[2]})))
        asked[-1].start()
    for thread in asked:
        thread.join()
    check(all(b'"slice": ' + str(t).encode() in body and body[:2] == b"={" for t, body in turned.items()) and len(turned) == 2,
          "two servers on one map save what each page shows")


def check_restart(server):
    """A port whose connections the server itself has ended is free as soon as it has gone."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=100) as connection:
        connection.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nConnection: close\r\n\r\n".encode())
        while connection.recv(1 << 16):
            pass
    server.process.send_signal(signal.SIGINT)
    check(server.process.wait(100) == 0, "Ctrl-C ends one of them")
    with Server(qjulia, folder, NAME, "--port", server.port) as again:
        check(again.is_well(), "and another begins at once on its port")


def timers(port):
    """The kernel's timers of connections to a server's port: 0 where it waits for the peer for ever."""
    lines = [line.split() for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return {line[5].split(":")[0] for line in lines if line[1].endswith(f":{port:04X}") and line[3] == "01"}


def check_gone(server):
    """A client that goes away ends its job, even if it had sent surplus bytes."""
    for path, junk in (("/make?make=turntable&frames=120&size=1500x1400", b""), ("/frame?size=4000x4000&samples=4&iterations=16", b"junk")):
        with socket.create_connection(("127.0.0.1", server.port), timeout=100) as gone:
            gone.sendall((f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Qjulia-Token: {server.token}\r\n"
                          "X-Qjulia-Client: gone\r\n\r\n").encode() + junk)
            answer, data = b"", b"?"
            while b"~" not in answer and data:
                data = gone.recv(1 << 16)
                answer += data
            check("00" not in timers(server.port), f"a client that falls silent is asked whether it is there: {timers(server.port)}")
        begin = time.monotonic()
        made = server.get("/make?make=ply&resolution=16")[2]
        check(made[:4] == b"=ply", f"the device is free for others when a client has gone: {time.monotonic() - begin:.1f} s, {path}")


def main():
    shutil.copy(map_file, folder / NAME)
    before = (folder / NAME).read_bytes()
    with Server(qjulia, folder, NAME) as first, Server(qjulia, folder, NAME) as second:
        check(first.port != second.port and first.token != second.token, "two servers have addresses of their own")
        check(first.status("/map", token=second.token) == 403, "one's token is not the other's")
        check_ports(first)
        check_saved(first, second)
        check_gone(first)
        check_restart(first)
        check(second.is_well(), "the other goes on")
    check((folder / NAME).read_bytes() == before and sorted(p.name for p in folder.iterdir()) == [NAME], "and the map's file is as it was")


run_test(main, needs_browser=False)
