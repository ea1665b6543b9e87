// What the host says of this page's map: which knobs it bears, and what sets them.
import { byId } from "./dom.js";

/** { map, picture, escape }: settings with their option, type, group and controls (tools/explore/page_settings.hpp). */
export const settings = JSON.parse(byId("settings").textContent);

/** Radius beyond which orbits are taken to have escaped where no other is known, map units. */
export const usualEscape = settings.escape;

const borne = new Set(settings.map.map((setting) => setting.option));
/** Whether the map bears this knob. */
export const bears = (option) => borne.has(option);
