// Mouse, touch, wheel and keyboard on the picture.
import { cameraAxes } from "./camera.js";
import { canvas } from "./dom.js";
import { change, redo, settle, state, undo } from "./state.js";
import { toggleControls } from "./controls.js";
import { plus } from "./vectors.js";

const clickMs = 400, doubleMs = 300, stillPixels = 5;  // a press that is a click; until a second one makes a double click

/** @param does `whereNow` gives { middle, pixel }: the point in the middle and a pixel's width there, shape units; `lookAt` is called
 * with a place that is clicked, shares of the canvas's sides; `surprise` is what the key S does; `brush` is that of brush.js, or
 * none. */
export function listen({ whereNow, lookAt, surprise, brush = null }) {
  const fingers = new Map();
  let press = null, clicked = 0;  // { at, time } of what may become a click; a timer
  let isStroke = false;  // of the brush

  /** CSS pixels of the canvas. */
  const placeOf = ({ clientX, clientY }) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [clientX - left, clientY - top];
  };
  const turn = (x, y) => change({ azimuth: state.azimuth - 0.4 * x, elevation: state.elevation + 0.4 * y }, false);
  const move = (x, y) => {
    const { middle, pixel } = whereNow(), { right, up } = cameraAxes(state);
    change({ look: plus(plus(middle, right, -x * pixel), up, y * pixel) }, false);
  };
  const zoom = (ratio, settled = false) => change({ zoom: state.zoom * ratio }, settled);

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    clearTimeout(clicked);
    const isPlain = fingers.size === 1 && event.button === 0 && !event.shiftKey;
    if (isStroke) brush.cancel();  // a second finger
    isStroke = isPlain && Boolean(brush?.isOn());
    if (isStroke) brush.begin(placeOf(event), whereNow().pixel);
    press = isPlain && !isStroke ? { at: [event.clientX, event.clientY], time: event.timeStamp } : null;
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const now = [event.clientX, event.clientY];
    if (isStroke) {
      fingers.set(event.pointerId, now);
      return brush.move(placeOf(event));
    }
    if (press) {
      if (Math.hypot(now[0] - press.at[0], now[1] - press.at[1]) <= stillPixels) return;  // fingers tremble
      press = null;
    }
    const x = now[0] - last[0], y = now[1] - last[1];
    if (fingers.size === 2) {
      const [other] = [...fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const away = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]);
      if (away(last) > 0) zoom(away(now) / away(last));
      move(x / 2, y / 2);
    } else if (event.buttons & 6 || event.shiftKey) {
      move(x, y);
    } else {
      turn(x, y);
    }
    fingers.set(event.pointerId, now);
  });
  const end = (event) => {
    const wasStroke = isStroke;
    isStroke = false;
    if (wasStroke && event.type === "pointerup") brush.end();
    else if (wasStroke) brush.cancel();
    if (fingers.delete(event.pointerId) && fingers.size === 0) change({});
  };
  canvas.addEventListener("pointerup", (event) => {
    end(event);
    if (!press || event.timeStamp - press.time > clickMs) return;
    const [x, y] = placeOf(event);
    clicked = setTimeout(() => lookAt(x / canvas.clientWidth, y / canvas.clientHeight), doubleMs);
  });
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => {
    clearTimeout(clicked);
    if (brush?.isOn()) return;
    change({ look: null, distance: null, zoom: 1 });
  });

  let rest = 0;
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.03 : 0.001)));
    clearTimeout(rest);
    rest = setTimeout(() => change({}), 250);
  }, { passive: false });

  const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  addEventListener("keydown", (event) => {
    const isTyping = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range";
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !isTyping) {
      event.preventDefault();
      return event.shiftKey ? redo() : undo();
    }
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("dialog")) return;
    if (event.key in keys && event.target.type !== "range") {
      event.preventDefault();
      const [x, y] = keys[event.key];
      if (event.shiftKey) move(-40 * x, -40 * y);
      else turn(15 * x, 15 * y);
      settle();
    }
    if (event.key === "+" || event.key === "=") zoom(1.25, true);
    if (event.key === "-") zoom(0.8, true);
    if (event.key === "0") change({ look: null, distance: null, zoom: 1, azimuth: 30, elevation: 15 });
    if (event.key === "h") toggleControls();
    if (event.key === "s") surprise();
  });
}
