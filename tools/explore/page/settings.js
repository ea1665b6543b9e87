// What the host says of this page's map: which knobs it bears, and what sets them.
import { byId } from "./dom.js";

/** { map, picture, frame, absent }: settings with their option, type, group and controls, where the shape lies, and what only
 * a server draws (tools/explore/page_settings.hpp). */
export const settings = JSON.parse(byId("settings").textContent);

const borne = new Set(settings.map.map((setting) => setting.option));
/** Whether the page sets this knob. */
export const bears = (option) => borne.has(option);
