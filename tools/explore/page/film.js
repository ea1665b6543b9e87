// Keys of a film: collected here, played by the page, saved as a script.
import { viewOf } from "./camera.js";
import { button, group, note } from "./controls.js";
import { canvas, element } from "./dom.js";
import { sorted, stateAt } from "./keys.js";
import { frame, toShape } from "./map.js";
import { download } from "./save.js";
import { scriptOf } from "./script.js";
import { recalled, remember } from "./session.js";
import { change, state } from "./state.js";

/** The picture's sides, even as encoders want them, 720 pixels the shorter. */
function sizeOfFilm() {
  const scale = 720 / Math.min(canvas.width, canvas.height);
  return [canvas.width, canvas.height].map((side) => 2 * Math.round(scale * side / 2)).join("x");
}

/** Adds the controls to the panel. @return the state at a second of the film. */
export function offerFilm() {
  const keys = recalled("keys");  // { at: seconds, values: a state with a point to look at and a distance }
  const list = element("div", { id: "keys" }), secondsApart = 3;

  function showKeys() {
    keys.sort((a, b) => a.at - b.at);
    list.replaceChildren(...keys.map((key, i) => {
      const seconds = element("input", { type: "number", min: 0, max: 3600, step: 0.5, value: key.at, title: "The second of the film at which it is to look like this" });
      seconds.setAttribute("aria-label", `Seconds of key ${i + 1}`);
      seconds.addEventListener("change", () => {
        const at = Number(seconds.value);
        if (seconds.value !== "" && at >= 0 && at <= 3600 && !keys.some((other) => other !== key && other.at === at)) key.at = at;
        else note("Give a number of seconds from 0 to 3600 that no other key has.");
        showKeys();
      });
      return element("div", { className: "key" }, seconds, element("span", {}, "s"),
        button("Go there", "Shows what this key says", () => change(key.values)),
        button("×", "Removes this key", () => {
          keys.splice(keys.indexOf(key), 1);
          showKeys();
        }));
    }));
    for (const each of [play, save]) each.disabled = keys.length < 2;
    remember("keys", keys);
  }

  /** The state now, with where the camera stands, which would follow from the picture's size otherwise. */
  function keyHere() {
    const view = viewOf(state, canvas.width, canvas.height, 1);
    const at = keys.length > 0 ? keys.at(-1).at + secondsApart : 0;
    keys.push({ at, values: { ...state, look: toShape(view.middle), distance: view.distance / frame.scale } });
    showKeys();
  }

  let playing = 0;  // the newest play; others end
  function playKeys() {
    if (play.textContent === "Stop") return stop();
    const own = ++playing, all = sorted(keys), begin = performance.now();
    play.textContent = "Stop";
    const next = (now) => {
      if (own !== playing) return;
      const time = all[0].at + (now - begin) / 1000;
      change(stateAt(all, time), false);
      if (time >= all.at(-1).at) return stop();
      requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
  }
  function stop() {
    ++playing;
    play.textContent = "Play";
    change({});
  }

  const play = button("Play", "Plays the keys as fast as the page draws", playKeys);
  const save = button("Save script", "Saves a script for qjulia film. Looks, materials, the order of factors, and the lamp's height and strength are those of the first key throughout",
                      () => download(new Blob([scriptOf(sorted(keys), sizeOfFilm())], { type: "application/toml" }), "_film.toml"));
  group("Film", list, element("div", { className: "row" },
        button("Key here", "Adds a key: at its second the film looks as the page does now", keyHere), play, save));
  showKeys();
  return (seconds) => stateAt(sorted(keys), seconds);
}
