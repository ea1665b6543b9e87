// Pictures and maps for the viewer to keep.
import { element, root } from "./dom.js";

const name = root.dataset.map.replace(/^.*\//, "").replace(/(\.qjulia)?\.[^.]*$/, "") || "map";

/** @param end of the file's name. */
export function download(blob, end) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name + end });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export async function savePicture(canvas) {
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  if (!blob) throw new Error("the browser cannot make a picture this large");
  download(blob, ".png");
}

export const saveMap = (text) => download(new Blob([text], { type: "application/json" }), "_turned.qjulia.json");
