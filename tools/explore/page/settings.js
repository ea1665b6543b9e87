// What the host says of this page's map: which knobs it bears, and what sets them.
import { byId } from "./dom.js";

/** { map, picture }: settings with their option, type, group and controls (tools/explore/page_settings.hpp). */
export const settings = JSON.parse(byId("settings").textContent);

const borne = new Set(settings.map.map((setting) => setting.option));
/** Whether the map bears this knob. */
export const bears = (option) => borne.has(option);
