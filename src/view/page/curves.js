// Columns of the ledger over time, one small plot each, as SVG.

const [WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT] = [300, 150, 8, 18, 16, 8];
const LINES = [
  ["#1d4ed8", ""], ["#b45309", "6 3"], ["#047857", "2 2"], ["#9d174d", "8 3 2 3"],
  ["#4b5563", "1 3"], ["#7c3aed", "10 4"], ["#0e7490", "4 1"], ["#111111", "6 2 1 2"],
];

function svg(name, attributes, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  Object.entries(attributes).forEach(([key, value]) => node.setAttribute(key, value));
  node.append(...children);
  return node;
}

/** The ledger of a run: columns by name. */
function ledgerOf(member) {
  const { ledger } = member.meta;
  if (!ledger) return new Map();
  const all = new Float32Array(bytesOf(ledger.block).buffer);
  return new Map(ledger.columns.map((name, c) => [name, all.subarray(c * ledger.rows, (c + 1) * ledger.rows)]));
}

const ledgers = members.map(ledgerOf);

/** Columns that change in some run. */
function columns() {
  const names = [...new Set(ledgers.flatMap(ledger => [...ledger.keys()]))];
  return names.filter(name => name !== "time" && name !== "step").filter(name => ledgers.some(ledger => {
    const [least, largest] = extent(ledger.get(name) || []);
    return largest > least;
  }));
}

// Columns of the computation; all others are of the sheet.
const COUNTS = new Set([
  "step size [time]", "error estimate", "substeps", "iterations", "newton iterations", "krylov iterations", "energies", "gradients",
  "hessians", "jacobians", "right hand sides", "law calls", "law sites", "factorisations", "solves", "force residual",
  "wall time [s]",
]);
const isWork = name => COUNTS.has(name) || name.startsWith("rejected");

const constant = () => [...new Set(ledgers.flatMap(ledger => [...ledger.keys()]))].length - 2 - columns().length;

function curveOf(ledger, name, logarithmic) {
  const [time, values] = [ledger.get("time"), ledger.get(name)];
  if (!time || !values) return [];
  const use = logarithmic ? Math.log10 : value => value;
  return [...time].map((t, i) => [t, values[i] > 0 || !logarithmic ? use(values[i]) : NaN]).filter(([t, v]) => isFinite(t) && isFinite(v));
}

function plot(name, logarithmic) {
  const curves = ledgers.map(ledger => curveOf(ledger, name, logarithmic));
  const all = curves.flat();
  if (all.length === 0) return null;
  const [early, late] = extent(all.map(p => p[0]));
  const [least, largest] = extent(all.map(p => p[1]));
  const across = t => LEFT + ((t - early) / (late - early || 1)) * (WIDTH - LEFT - RIGHT);
  const down = v => HEIGHT - BOTTOM - ((v - least) / (largest - least || 1)) * (HEIGHT - BOTTOM - TOP);
  const value = v => short(logarithmic ? 10 ** v : v, 4);
  const lines = curves.map((curve, i) => {
    const points = curve.map(([t, v]) => `${across(t).toFixed(1)},${down(v).toFixed(1)}`).join(" ");
    const [colour, dash] = LINES[i % LINES.length];
    return svg("polyline", { points, fill: "none", stroke: colour, "stroke-width": 1.5, "stroke-dasharray": dash });
  });
  const text = (content, x, y, anchor) => svg("text", { x, y, "text-anchor": anchor }, content);
  const now = svg("line", { y1: TOP, y2: HEIGHT - BOTTOM, stroke: "#1a1a1a", "stroke-dasharray": "3 3", class: "now" });
  now.dataset.early = early;
  now.dataset.late = late;
  const label = `${name}${logarithmic ? ", logarithmic" : ""}: from ${value(least)} to ${value(largest)} between times ${short(early)} and ${short(late)}`;
  const picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label },
    svg("rect", { x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - BOTTOM - TOP, fill: "none", stroke: "#ccc" }),
    ...lines, now,
    text(value(largest), LEFT, TOP - 4, "start"),
    text(value(least), LEFT + 3, HEIGHT - BOTTOM - 4, "start"),
    text(`t = ${short(early, 4)}`, LEFT, HEIGHT - 5, "start"),
    text(short(late, 4), WIDTH - RIGHT, HEIGHT - 5, "end"));
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.textContent = name;
  figure.append(caption, picture);
  readOut(picture, curves, { across, down }, (i, [t, v]) => {
    caption.textContent = i === null ? name : `${value(v)} at t = ${short(t)}${members.length > 1 ? `, ${members[i].name}` : ""}`;
  });
  return figure;
}

/** Shows the point of the curves that is nearest to the pointer: `say` takes the number of its curve and the point, or none. */
function readOut(picture, curves, { across, down }, say) {
  const dot = svg("circle", { r: 3, fill: "#1a1a1a", visibility: "hidden", class: "readout" });
  picture.append(dot);
  picture.addEventListener("pointermove", event => {
    const box = picture.getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) / box.width) * WIDTH, ((event.clientY - box.top) / box.height) * HEIGHT];
    let best = null;
    curves.forEach((curve, i) => {
      // The point of a curve that is nearest in time, then the nearest curve.
      const at = curve.reduce((a, b) => (Math.abs(across(b[0]) - x) < Math.abs(across(a[0]) - x) ? b : a), curve[0]);
      const apart = at && Math.abs(across(at[0]) - x) + Math.abs(down(at[1]) - y);
      if (at && (!best || apart < best.apart)) best = { i, at, apart };
    });
    if (!best) return;
    dot.setAttribute("cx", across(best.at[0]));
    dot.setAttribute("cy", down(best.at[1]));
    dot.setAttribute("visibility", "visible");
    say(best.i, best.at);
  });
  picture.addEventListener("pointerleave", () => {
    dot.setAttribute("visibility", "hidden");
    say(null, []);
  });
}

/** Redraws all curves. */
function drawCurves() {
  const names = columns();
  const logarithmic = element("logarithmic").checked;
  const plots = all => all.map(name => plot(name, logarithmic)).filter(Boolean);
  element("curves").replaceChildren(...plots(names.filter(name => !isWork(name))));
  element("work-curves").replaceChildren(...plots(names.filter(name => isWork(name))));
  element("work").hidden = !names.some(isWork);
  element("ledger").hidden = names.length === 0;
  const ledger = members.map(member => member.meta.ledger).filter(Boolean);
  const thinned = ledger.filter(l => l.rows < l.of);
  const constants = constant();
  element("ledger-note").textContent = "One row a step"
    + (thinned.length ? `; ${thinned[0].rows} of ${thinned[0].of} rows are kept here${members.length > 1 ? " of the first long run" : ""}` : "")
    + (constants > 0 ? `; ${constants} columns that do not change are left out` : "")
    + ". The dashed line is the time of the frame.";
  element("legend").replaceChildren(...(members.length > 1 ? members.map(legendOf) : []));
  moveNow();
}

function legendOf(member, i) {
  const [colour, dash] = LINES[i % LINES.length];
  const line = svg("svg", { viewBox: "0 0 30 10", "aria-hidden": "true" },
    svg("line", { x1: 0, x2: 30, y1: 5, y2: 5, stroke: colour, "stroke-width": 2, "stroke-dasharray": dash }));
  const span = document.createElement("span");
  span.append(line, " " + member.name);
  return span;
}

/** Moves the lines at the time of the frame. */
function moveNow() {
  const time = times[state.step];
  document.querySelectorAll("#ledger .now").forEach(line => {
    const [early, late] = [Number(line.dataset.early), Number(line.dataset.late)];
    const x = LEFT + ((time - early) / (late - early || 1)) * (WIDTH - LEFT - RIGHT);
    line.setAttribute("x1", x);
    line.setAttribute("x2", x);
    line.setAttribute("visibility", time >= early && time <= late ? "visible" : "hidden");
  });
}
