// The map's file, and where its shape lies.
import { byId } from "./dom.js";
import { settings } from "./settings.js";
import { plus, times } from "./vectors.js";

/** The map's file as it was when the page was made. */
export const mapText = () => byId("qjulia-map").textContent;

/** { scale, translation, box }: from shape units to map coordinates, and the shape's box or null, shape units. */
export const frame = settings.frame;
export const toMap = (p) => plus(times(frame.scale, p), frame.translation);
export const toShape = (p) => times(1 / frame.scale, plus(p, frame.translation, -1));
