"""Headless Chromium on SwiftShader, driven through a pipe by the DevTools protocol."""
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

NAMES = ("chromium", "chromium-browser", "google-chrome")


def find():
    """The browser's path; None where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """A browser with one tab. What the tab says in its console as errors is kept in `errors`."""

    def __init__(self, width, height):
        self.profile = tempfile.mkdtemp(prefix="qjulia_browser_")
        self.errors, self.inbox, self.buffer, self.number = [], {}, b"", 0
        to_browser, self.out = os.pipe()
        self.inp, from_browser = os.pipe()

        def as_3_and_4():
            # Descriptors of the pipe that the browser expects.
            a, b = os.dup(to_browser), os.dup(from_browser)
            os.dup2(a, 3), os.dup2(b, 4)

        self.process = subprocess.Popen(
            [find(), "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run", "--disable-extensions",
             "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
             f"--user-data-dir={self.profile}", f"--window-size={width},{height}", "about:blank"],
            preexec_fn=as_3_and_4, close_fds=False, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        os.close(to_browser), os.close(from_browser)
        self.session = None
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(t["targetId"] for t in targets if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.out)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.inp)
        shutil.rmtree(self.profile, ignore_errors=True)

    def _take(self, message):
        method, params = message.get("method"), message.get("params", {})
        if "id" in message:
            self.inbox[message["id"]] = message
        elif method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            text = params["entry"]["text"]
            if "GPU stall due to ReadPixels" not in text:  # a remark of slow drivers
                self.errors.append(text)
        elif method == "Network.requestWillBeSent":
            url = params["request"]["url"]
            if not url.startswith(("file:", "data:", "blob:", "about:")):
                self.errors.append("the page asked for " + url)

    def _read(self, seconds):
        ready, _, _ = select.select([self.inp], [], [], seconds)
        if not ready:
            return
        data = os.read(self.inp, 1 << 20)
        if not data:
            raise RuntimeError("the browser has ended")
        *whole, self.buffer = (self.buffer + data).split(b"\0")
        for message in whole:
            self._take(json.loads(message))

    def call(self, method, **params):
        """The answer to a call of the protocol."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.out, data):]
        end = time.monotonic() + 120
        while self.number not in self.inbox:
            if time.monotonic() > end:
                raise RuntimeError(f"no answer to {method}")
            self._read(1)
        answer = self.inbox.pop(self.number)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def run(self, script, keeps_policy=False):
        """What a script's value is, as JSON; of a promise, what it comes to."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True,
                           allowUnsafeEvalBlockedByCSP=not keeps_policy)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"]["exception"].get("description", script))
        return answer["result"].get("value")

    def offline(self):
        self.call("Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0)

    def open(self, address):
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=address)

    def state(self):
        """The page's data-state."""
        return self.run("document.documentElement?.dataset.state")

    def wait(self, seconds):
        """Seconds until the page is done. Raises where it fails, or is busy for longer."""
        start = time.monotonic()
        while time.monotonic() < start + seconds:
            state = self.state()
            if state == "done":
                return time.monotonic() - start
            if state == "error":
                raise RuntimeError("the page says: " + self.run("document.getElementById('note').textContent"))
            self._read(0.05)
        raise RuntimeError(f"the page is still {state} after {seconds} s; {self.errors}")

    def rest(self, seconds):
        """Hears what the tab says for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._read(max(0, end - time.monotonic()))

    def drag(self, x, y, to_x, to_y):
        """The left button pressed at one place and released at another."""
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=to_x, y=to_y, button="left", buttons=1)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=to_x, y=to_y, button="left", clickCount=1)

    def be_phone(self, width, height):
        """From now on the tab is that of a phone, with two of its pixels in one of the page's, and fingers."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2, mobile=True)
        self.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)

    def touch(self, *fingers, steps=8):
        """Fingers, each ((x, y) of where it is put down, (x, y) of where it is lifted), go straight at the same time."""
        def points(way):
            return [{"x": a[0] + way * (b[0] - a[0]), "y": a[1] + way * (b[1] - a[1]), "id": i} for i, (a, b) in enumerate(fingers)]
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=points(0))
        for step in range(1, steps + 1):
            self.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=points(step / steps))
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def drop(self, file, x, y):
        """A file dragged from outside and dropped."""
        data = {"items": [], "files": [str(file.resolve())], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=x, y=y, data=data)

    def choose(self, selector, file):
        """A file chosen in a field."""
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(file.resolve())])

    def tap(self, selector):
        """A finger on the middle of an element."""
        x, y = self.run(f"(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect(); "
                        "return [b.x + b.width / 2, b.y + b.height / 2]; })()")
        self.touch(((x, y), (x, y)), steps=0)

    def key(self, key, code, number, text=None):
        """A key pressed and released, by its names and its number in Windows."""
        for kind, more in (("keyDown", {"text": text} if text else {}), ("keyUp", {})):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode=number, **more)

    def until(self, script, seconds=60):
        """Waits until a script's value is true."""
        end = time.monotonic() + seconds
        while not self.run(script):
            if time.monotonic() > end:
                raise RuntimeError(f"not in {seconds} s: {script}")
            self.rest(0.05)

    def download(self, folder, script, seconds=200, meanwhile=lambda: None):
        """The file that a script has the page download, or what is done `meanwhile`."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder.resolve()))
        self.run(script + "; 0")
        meanwhile()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for file in folder.iterdir():
                if file.suffix != ".crdownload" and file.stat().st_size > 0:
                    return file
            self.rest(0.1)
        raise RuntimeError("nothing was downloaded: " + self.run("document.getElementById('note').textContent"))

    def screenshot(self, file):
        with open(file, "wb") as out:
            out.write(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
