// What the camera frames: points that reach as far in every direction as the set as the file has it, shape units.
import { byId } from "./dom.js";
import { axisOf } from "./vectors.js";
import { state } from "./state.js";

/** How a state turns the shape, as an option takes it; the outline turns with it. */
export const turnOf = ({ rotate = 0, axis = "x" }) => [...axisOf(axis), rotate].join(",");

const known = { turn: turnOf({}), points: JSON.parse(byId("outline").textContent) };

export const outline = () => known.points;
/** Whether the outline is that of the state's turn. */
export const isOutlined = () => known.turn === turnOf(state);
export const setOutline = (turn, points) => Object.assign(known, { turn, points });
