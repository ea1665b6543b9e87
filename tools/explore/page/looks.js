// The looks as a strip of small pictures of the map as its file has it, drawn by the server one after the other.
import { canvasOf, element, root } from "./dom.js";
import { change, onChange, state, usual, words } from "./state.js";
import { recalled, remember } from "./session.js";

const size = [96, 72];

/** Adds the strip to the panel; it is drawn when it is first seen. @param small as drawSmall of picture.js. */
export function offerLooks(small) {
  const names = words.wears ?? [], pictures = recalled("looks");  // { name, picture: a data URL }
  const tiles = new Map(names.map((name) => {
    const tile = element("button", { type: "button", title: `Gives the set the look '${name}'; what is set under Look overrides it`, onclick: () => change({ wears: name }) },
                         element("img", { alt: "", width: size[0], height: size[1] }), element("span", {}, name));
    return [name, tile];
  }));
  const show = ({ name, picture }) => { if (tiles.has(name)) tiles.get(name).firstElementChild.src = picture; };
  async function drawLooks() {
    for (const name of names) {
      if (pictures.some((one) => one.name === name)) continue;
      while (root.dataset.state === "busy") await new Promise((resolve) => { setTimeout(resolve, 200); });  // the picture comes first
      const image = await small({ ...usual, wears: name }, ...size);
      if (!image) return;
      pictures.push({ name, picture: canvasOf(image).toDataURL("image/jpeg", 0.85) });
      show(pictures.at(-1));
      remember("looks", pictures);
    }
  }
  const strip = element("div", { className: "strip", id: "looks" }, ...tiles.values());
  document.querySelector("select[name='wears']").closest("label").after(strip);
  pictures.forEach(show);
  onChange(() => { for (const [name, tile] of tiles) tile.setAttribute("aria-pressed", String(state.wears === name)); });
  new IntersectionObserver((seen, observer) => {
    if (!seen.some((one) => one.isIntersecting)) return;
    observer.disconnect();
    drawLooks();
  }).observe(strip);
}
