// Curves of a fit.

const wide = 300, high = 80, edge = 6;
const svgElement = (name, attributes, text = "") => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
};

const legible = (v) => Math.abs(v) < 0.001 ? v.toExponential(2) : v.toPrecision(4);

/** Draws lists of numbers one after the other, each as a line of its own, and says the least and the greatest.
 * @param isLog where all are above 0, equal ways stand for equal ratios. */
export function drawCurve(svg, lists, isLog) {
  const all = lists.flat().filter(Number.isFinite);
  svg.setAttribute("viewBox", `0 0 ${wide} ${high}`);
  svg.replaceChildren();
  if (all.length < 2) return;
  const least = Math.min(...all), most = Math.max(...all), byRatio = isLog && least > 0;
  const place = (v) => byRatio ? Math.log(v / least) / Math.log(most / least) : (v - least) / (most - least);
  let at = 0;
  const count = lists.flat().length;
  for (const list of lists) {
    const points = list.map((v) => [edge + (at++ / Math.max(1, count - 1)) * (wide - 2 * edge), v])
      .filter(([, v]) => Number.isFinite(v))
      .map(([x, v]) => `${x.toFixed(1)},${(high - edge - (place(v) || 0) * (high - 2 * edge)).toFixed(1)}`);
    svg.append(svgElement("polyline", { points: points.join(" ") }));
  }
  // Beside the curve, whichever way it goes.
  const left = { x: edge }, right = { x: wide - edge, "text-anchor": "end" }, falls = all[0] > all.at(-1);
  svg.append(svgElement("text", { ...(falls ? right : left), y: 14 }, legible(most)),
             svgElement("text", { ...(falls ? left : right), y: high - edge }, legible(least)));
}
