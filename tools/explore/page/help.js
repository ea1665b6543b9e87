// Says in the panel what the control does that is touched or pointed at: phones have no tooltips.
import { byId } from "./dom.js";

export function offerHelp() {
  const usualWords = byId("hint").textContent;
  const say = (event) => { byId("hint").textContent = event.target.closest?.("[title]")?.title || usualWords; };
  for (const kind of ["pointerdown", "pointerover", "focusin"]) byId("panel").addEventListener(kind, say);
  byId("panel").addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse") byId("hint").textContent = usualWords;
  });
}
