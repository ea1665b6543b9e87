#!/usr/bin/python3
"""Requests to the server of `qjulia explore` that are too long, too slow or never end: they are refused in bounded time, and
what they sent is not kept. flood.py QJULIA MAP FOLDER"""
import concurrent.futures
import itertools
import pathlib
import select
import shutil
import socket
import time

from checks import check, folder, mesh as map_file, qjulia, run_test
from server import Server

ENDS_WITHIN = 60  # seconds: far more than the server's limits, which add up to four


def head(server, method, path, *headers):
    token = f"X-Qjulia-Token: {server.token}\r\n"
    return (f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n" + token + "".join(h + "\r\n" for h in headers)).encode()


def send(server, parts, pause=0):
    """Sends the parts until the server hangs up. Returns its answer, and whether it hung up in time."""
    begin, answer = time.monotonic(), b""
    with socket.create_connection(("127.0.0.1", server.port), timeout=ENDS_WITHIN) as connection:
        connection.setblocking(False)
        part = b""
        while time.monotonic() < begin + ENDS_WITHIN:
            part = part or next(parts, b"")
            readable, writable, _ = select.select([connection], [connection] if part else [], [], ENDS_WITHIN)
            try:
                if readable:
                    data = connection.recv(1 << 16)
                    answer += data
                    if not data:
                        return answer, True
                if writable:
                    part = part[connection.send(part):]
                    time.sleep(pause)
            except ConnectionError:
                return answer, True
    return answer, False


def big(data, count=64):
    """Yields a megabyte at a time."""
    return itertools.repeat(data * (1 << 20), count)


def requests(server):
    """For each kind of client: its name, the answer that it must get, how many there are, and what it sends."""
    long_body = head(server, "POST", "/", "Content-Length: 10000000000") + b"\r\n"
    chunk = b"10000\r\n" + b"x" * 0x10000 + b"\r\n"
    return [
        ("a body of 10 GB without a token", b"405", 8, lambda: itertools.chain([long_body.replace(server.token.encode(), b"")], big(b"x")), 0),
        ("a body of 10 GB", b"413", 130, lambda: [head(server, "GET", "/", "Content-Length: 10000000000") + b"\r\n" + b"x" * 100000], 0),
        ("a short body", b"413", 130, lambda: [head(server, "POST", "/stop", "Content-Length: 1") + b"\r\nx"], 0),
        ("a body that the client asks leave for", b"413", 130,
         lambda: [head(server, "POST", "/stop", "Content-Length: 10000000", "Expect: 100-continue") + b"\r\n"], 0),
        ("chunks without end", b"413", 8,
         lambda: itertools.chain([head(server, "POST", "/stop", "Transfer-Encoding: chunked") + b"\r\n"], itertools.repeat(chunk, 1000)), 0),
        ("a chunk of 256 GB", b"413", 130,
         lambda: [head(server, "POST", "/stop", "Transfer-Encoding: chunked") + b"\r\n4000000000\r\n" + b"x" * 100000], 0),
        ("a request line without end", b"", 8, lambda: big(b"x"), 0),
        ("a header without end", b"400", 8, lambda: itertools.chain([head(server, "GET", "/") + b"X: "], big(b"y")), 0),
        ("headers without end", b"400", 8, lambda: itertools.chain([head(server, "GET", "/")], big(b"X: y\r\n")), 0),
        ("half a request line", b"", 120, lambda: [b"GET / HT"], 0),
        ("half of the headers", b"400", 120, lambda: [head(server, "GET", "/")], 0),
        ("nothing at all", b"", 100, lambda: [], 0),
        ("a byte now and then", b"", 50, lambda: (b"G" for _ in itertools.count()), 0.2),
        ("headers that come slowly", b"400", 50, lambda: itertools.chain([head(server, "GET", "/")], (b"X: y\r\n" for _ in itertools.count())), 0.2),
    ]


def resident(server):
    """Megabytes."""
    lines = pathlib.Path(f"/proc/{server.process.pid}/status").read_text().splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith("VmRSS"))) / 1024


def main():
    shutil.copy(map_file, folder / "map.qjulia.json")
    with Server(qjulia, folder, "map.qjulia.json") as server, concurrent.futures.ThreadPoolExecutor(100) as pool:
        check(server.is_well(), "it draws")
        list(pool.map(lambda _: server.status("/"), range(300)))  # every thread has worked once
        before, kinds = resident(server), requests(server)
        sent = [(name, expected, [pool.submit(send, server, iter(parts()), pause) for _ in range(count)])
                for name, expected, count, parts, pause in kinds]
        total = 0
        for name, expected, ends in sent:
            answers = [end.result() for end in ends]
            total += len(answers)
            told = {answer[9:12] for answer, _ in answers}
            check(all(in_time for _, in_time in answers) and told <= {expected, b""} and expected in told,
                  f"{name}: {len(answers)} requests, answered {sorted(told)}, hung up on {sum(in_time for _, in_time in answers)}")
        check(server.is_well(), "it still draws")
        after = resident(server)
        check(total == 1000 and after - before < 20, f"{total} requests: from {before:.1f} to {after:.1f} MB of resident memory")


run_test(main, needs_browser=False)
