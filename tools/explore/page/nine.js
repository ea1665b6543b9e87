// "Surprise me": nine small pictures that are far apart, of which one is taken; then nine of its kin.
import { anyState, farthest, kinState, showsSomething, signature } from "./chance.js";
import { button } from "./controls.js";
import { canvasOf, element } from "./dom.js";
import { change, written } from "./state.js";

const lotSize = [120, 90], lots = 24;  // pictures that are drawn; nine of them are shown
const kinSpread = 0.2, closer = 0.75;     // of the first kin, and how much less that of their kin is
let generation = 0;  // how often one was taken since the last that differ widely

/** Adds the button. @param small draws a small picture of a state, as ImageData. @param redraw what that has ended.
 * @return what opens the pictures. */
export function offerNine(small, redraw) {
  const tiles = element("div", { className: "nine" }), words = element("p", { role: "status" });
  const bar = element("progress", { max: lots, ariaLabel: "How many are drawn" });
  let run = 0;  // the newest; those before it stop at their next picture

  function tile({ image, values }) {
    const made = button("", "Take this one", () => {
      ++generation;
      dialog.close();
      change(values);
    });
    made.append(canvasOf(image));
    return made;
  }

  async function fill(isKin) {
    const own = ++run, drawn = [];
    if (!isKin) generation = 0;
    let failed = null;
    tiles.replaceChildren();
    bar.hidden = false;
    for (let i = 0; i < lots; ++i) {
      bar.value = i;
      words.textContent = `Drawing ${lots}, of which the nine that differ most will stay: ${i + 1}`;
      const values = isKin ? kinState(kinSpread * closer ** (generation - 1)) : anyState();
      try {
        const image = await small(values, ...lotSize);
        if (own !== run) return;
        if (!image || !showsSomething(image)) continue;
        drawn.push({ values, image, signature: signature(image) });
      } catch (error) {
        if (own !== run) return;
        failed = error;
        continue;
      }
      if (tiles.children.length < 9) {
        tiles.append(tile(drawn.at(-1)));
        tiles.lastElementChild.disabled = true;  // another one may take its place
      }
    }
    bar.hidden = true;
    if (drawn.length === 0) {
      words.textContent = failed?.message ?? "Nothing was to be seen in any of them.";
      return;
    }
    const { chosen, least } = farthest(drawn.map((one) => one.signature), 9);
    tiles.replaceChildren(...chosen.map((i) => tile(drawn[i])));
    tiles.dataset.least = least.toFixed(1);
    words.textContent = `Tap one to take it. The two that are most alike differ by ${least.toFixed(0)} of 255 on average.`;
  }

  const dialog = element("dialog", { id: "surprise", ariaLabel: "Surprise me" }, element("h1", {}, "Surprise me"), tiles, bar, words,
    element("div", { className: "row" },
            button("Like the present one", "Draws nine that differ a little from the set as it is now", () => { generation = Math.max(1, generation); fill(true); }),
            button("Very different ones", "Draws nine that differ widely", () => fill(false)),
            button("Close", "Takes none of them", () => dialog.close())));
  dialog.addEventListener("close", () => {
    ++run;
    redraw();
  });
  document.body.append(dialog);
  return () => {
    if (dialog.open) return;
    if (written() === "") generation = 0;
    dialog.showModal();
    fill(generation > 0);
  };
}
