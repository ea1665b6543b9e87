// States that are kept with a picture: to go back to, and to compare with the present one.
import { button, group } from "./controls.js";
import { canvas, element } from "./dom.js";
import { change, read, usual, written } from "./state.js";
import { recalled, remember } from "./session.js";

const widest = 640, mostKept = 24, holdMs = 250;
const snapshots = recalled("snapshots");  // { text: as an address has it, picture: a data URL }
const shelf = element("div", { className: "strip", id: "snapshots" });
const over = element("img", { id: "over", alt: "The snapshot", hidden: true });

/** What is seen, not larger than it needs to be. */
function pictureNow() {
  const scale = Math.min(1, widest / Math.max(canvas.width, canvas.height));
  const copy = element("canvas", { width: Math.max(1, Math.round(scale * canvas.width)), height: Math.max(1, Math.round(scale * canvas.height)) });
  copy.getContext("2d").drawImage(canvas, 0, 0, copy.width, copy.height);
  return copy.toDataURL("image/jpeg", 0.85);
}

/** A tap goes back to the snapshot; holding it shows it over the picture. */
function tileOf(one) {
  const link = element("a", { href: `#${one.text}`, draggable: false, title: "Tap: goes back to this. Hold: shows it over the picture, to compare" },
                       element("img", { src: one.picture, alt: one.text || "as the map is", draggable: false }));
  let timer = 0, wasHeld = false;
  const hide = () => {
    clearTimeout(timer);
    over.hidden = true;
  };
  link.addEventListener("pointerdown", () => {
    wasHeld = false;
    timer = setTimeout(() => {
      wasHeld = true;
      const { left, top, width, height } = canvas.getBoundingClientRect();
      over.src = one.picture;
      over.style.cssText = `left:${left}px;top:${top}px;width:${width}px;height:${height}px`;
      over.hidden = false;
    }, holdMs);
  });
  for (const kind of ["pointerup", "pointercancel", "pointerleave"]) link.addEventListener(kind, hide);
  link.addEventListener("contextmenu", (event) => { if (wasHeld) event.preventDefault(); });
  link.addEventListener("click", (event) => {
    event.preventDefault();
    if (!wasHeld) change({ ...usual, ...read(one.text) });
    wasHeld = false;
  });
  const remove = button("×", "Removes this snapshot", () => {
    snapshots.splice(snapshots.indexOf(one), 1);
    showSnapshots();
  });
  return element("figure", {}, link, remove);
}

function showSnapshots() {
  shelf.replaceChildren(...snapshots.map(tileOf));
  shelf.hidden = snapshots.length === 0;
  remember("snapshots", snapshots);
}

function keep() {
  const text = written(), before = snapshots.findIndex((one) => one.text === text);
  if (before >= 0) snapshots.splice(before, 1);
  snapshots.push({ text, picture: pictureNow() });
  if (snapshots.length > mostKept) snapshots.shift();
  showSnapshots();
  shelf.scrollLeft = shelf.scrollWidth;
}

/** The picture is finished: if its state is kept, so is it. */
export function renewSnapshot() {
  const one = snapshots.find(({ text }) => text === written());
  if (!one) return;
  one.picture = pictureNow();
  // The tile stays: it may be held down just now.
  shelf.children[snapshots.indexOf(one)].querySelector("img").src = one.picture;
  remember("snapshots", snapshots);
}

/** Adds the controls to the panel. */
export function offerSnapshots() {
  group("Snapshots", shelf, element("div", { className: "row" },
        button("Keep this", "Keeps what is seen, with its picture, until the tab is closed: to go back to it and to compare", keep)));
  document.body.append(over);
  showSnapshots();
}
