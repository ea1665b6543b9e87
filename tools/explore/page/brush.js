// A brush on the picture: where it goes, the set loses detail or gets it back; or it plants copies of the set. The server changes
// its map, and the page stays.
import { button, group, line, note, select } from "./controls.js";
import { byId, canvas, element, root } from "./dom.js";
import { frame } from "./map.js";
import { outline, setOutline } from "./outline.js";
import { ask } from "./server.js";

const mostPlaces = 256, apart = 0.4;  // of a stroke, whose places lie this share of the brush's radius apart

const range = (name, label, ...[min, max, step, value]) => {
  const input = element("input", { type: "range", name, min, max, step, value });
  input.setAttribute("aria-label", label);
  return input;
};

/** Adds the controls to the panel, where the map says its box.
 * @param view how a picture is asked for in which the server looks for points. @param redraw shows the map anew.
 * @returns what the pointer uses. */
export function offerBrush(view, redraw) {
  if (!frame.box) return null;
  const does = select("brush", [["look", "looks at the point"], ["paint", "paints"], ["plant", "plants a copy"]]);
  const width = range("brush-size", "size of the brush", 2, 60, 1, 20), shares = range("brush-share", "detail under the brush", 0, 1, 0.05, 0);
  let work = Promise.resolve(), stroke = null;  // { trail, drawing, radius, view, places }, CSS pixels of the canvas

  /** Has the server change its map, after what it was asked before. */
  async function change(path, query, trail) {
    root.dataset.state = "busy";
    try {
      const named = await ask(path, query, { method: "POST", as: "brush" });
      if (!named) throw new Error("The server is ending.");
      setOutline("", outline());  // it is asked for again
      root.dataset.map = document.title = byId("panel").querySelector("h1").textContent = await named.text();
    } catch (error) {
      note(error.message, 12);
    }
    trail?.remove();
    redraw();
  }
  const send = (path, query, trail = null) => { work = work.then(() => change(path, query, trail)); };

  function begin(pixel) {
    const [low, high] = frame.box, longest = Math.max(...high.map((v, axis) => v - low[axis]));
    const { left, top, width: wide, height } = canvas.getBoundingClientRect();
    const trail = element("canvas", { className: "trail", width: wide, height }), drawing = trail.getContext("2d");
    trail.style.cssText = `left:${left}px;top:${top}px`;
    drawing.fillStyle = does.value === "plant" ? "#e8833a55" : "#3a8ee855";
    document.body.append(trail);
    stroke = { trail, drawing, radius: 0.5 * width.value / 100 * longest / pixel, view: view(), places: [] };
  }

  function add(place) {
    const { drawing, radius, places } = stroke;
    places.push(place);
    drawing.beginPath();
    drawing.arc(...place, radius, 0, 2 * Math.PI);
    drawing.fill();
  }

  function end() {
    const { places, trail, view: seen } = stroke;
    stroke = null;
    const inside = places.map(([x, y]) => [x / canvas.clientWidth, y / canvas.clientHeight])
      .filter((place) => place.every((share) => share >= 0 && share <= 1)).map((place) => place.map((share) => share.toFixed(5)).join(","));
    if (inside.length === 0) return trail.remove();
    const tool = does.value === "plant" ? { copy: width.value / 100 } : { radius: width.value / 200, share: shares.value };
    send("brush", { ...seen, places: inside.join(";"), ...tool }, trail);
  }

  group("Brush", line("a click", "What a click on the set does: it looks at the point, paints detail on or off, or plants a copy of the set", does),
        line("size", "How wide the brush is, or how large a copy is, as a share of the set", width),
        line("detail", "How much of its detail the set has under the brush: none on the left, all on the right", shares),
        element("div", { className: "row" },
                button("Paint all", "Gives the whole set as much of its detail as the slider above says", () => send("brush", { ...view(), share: shares.value })),
                button("Take back", "Undoes the last stroke or copy", () => send("takeback", {}))));
  return {
    isOn: () => does.value !== "look",
    /** @param at CSS pixels of the canvas. @param pixel a pixel's width where the set is, shape units. */
    begin(at, pixel) {
      begin(pixel);
      add(at);
    },
    /** Goes on to a place; what is painted in between has no gaps. */
    move([x, y]) {
      if (does.value !== "paint") return;
      const [fromX, fromY] = stroke.places.at(-1), way = Math.hypot(x - fromX, y - fromY);
      const steps = Math.floor(way / Math.max(2, apart * stroke.radius));
      for (let i = 1; i <= steps && stroke.places.length < mostPlaces; ++i) add([fromX + (x - fromX) * i / steps, fromY + (y - fromY) * i / steps]);
    },
    end,
    cancel() {
      stroke.trail.remove();
      stroke = null;
    },
  };
}
