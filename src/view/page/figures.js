// What a study shows: paragraphs, tables and plots with axes, as SVG.

const PANEL = { width: 420, height: 300, left: 62, right: 14, top: 26, bottom: 44 };
const MARKS = { triangle: [[0, -7], [6, 5], [-6, 5]], square: [[-5, -5], [5, -5], [5, 5], [-5, 5]], diamond: [[0, -7], [7, 0], [0, 7], [-7, 0]] };
const GUIDES = ["12 6", "3 4", "20 4"];

/** Steps of 1, 2 or 5 times a power of ten; on a logarithmic axis powers of ten, and these where there are few. */
function ticksOf([least, largest], logarithmic) {
  if (logarithmic && largest - least < 0.8) return ticksOf([10 ** least, 10 ** largest], false).map(Math.log10);
  const ticks = [];
  if (logarithmic) {
    const every = Math.max(1, Math.ceil((largest - least) / 7));
    for (let p = Math.floor(least); p <= largest; p += 1) {
      if (p % every === 0) (largest - least > 2.5 ? [1] : [1, 2, 5]).forEach(d => ticks.push(p + Math.log10(d)));
    }
  } else {
    const size = 10 ** Math.floor(Math.log10((largest - least) / 5));
    const step = size * [1, 2, 5, 10].find(d => (largest - least) / (d * size) <= 6);
    for (let k = Math.ceil(least / step); k * step <= largest; k += 1) ticks.push(k * step);
  }
  return ticks.filter(t => t >= least && t <= largest);
}

/** An axis: the place of a value in pixels, and ticks. */
function axisOf(values, logarithmic, from, to) {
  const use = v => (logarithmic ? Math.log10(v) : v);
  const reached = v => Number.isFinite(v) && (!logarithmic || v > 0);
  let [least, largest] = extent(values.filter(v => v !== null && reached(v)).map(use));
  if (least > largest) [least, largest] = [0, 1];
  const room = 0.06 * (largest - least) || 0.5 * Math.abs(largest) || 0.5;
  const range = [least - room, largest + room];
  const place = v => from + ((use(v) - range[0]) / (range[1] - range[0])) * (to - from);
  const ticks = ticksOf(range, logarithmic).map(t => (logarithmic ? 10 ** t : t));
  return { place, ticks, reached: v => v !== null && reached(v) };
}

/** How the points of a name are drawn: a guide, marks, or a line with its colour. */
function styleOf(figure, name) {
  const guide = name - (figure.names.length - figure.guides);
  if (guide >= 0) return { colour: "#555", dash: GUIDES[guide % 3] };
  const mark = figure.marks.find(([marked]) => marked === name);
  return mark ? { colour: "#111", mark: MARKS[mark[1]] } : { colour: LINES[name % LINES.length][0], dash: LINES[Math.floor(name / LINES.length) % LINES.length][1] };
}

const polygon = (corners, x, y, fill) => svg("polygon", { points: corners.map(([a, b]) => `${(x + a).toFixed(1)},${(y + b).toFixed(1)}`).join(" "), fill });

function drawnCurve(figure, curve, k, count, x, y) {
  const { colour, dash, mark } = styleOf(figure, curve.name);
  const at = curve.points.filter(p => x.reached(p[0]) && y.reached(p[1])).map(p => [x.place(p[0]), y.place(p[1])]);
  if (mark) return at.map(p => polygon(mark, ...p, colour));
  // Earlier curves are broader: they show beside later ones that cover them.
  const broad = (3 * (count - 1 - k)) / count;
  const line = svg("polyline", {
    points: at.map(p => p.map(v => v.toFixed(1)).join(",")).join(" "), fill: "none", stroke: colour, "stroke-width": 1.5 + broad, "stroke-dasharray": dash,
  });
  if (curve.name >= figure.names.length - figure.guides) return [line];
  const r = at.length === 1 ? 5 : 2.5 + broad / 2;
  return [line, ...at.map(p => svg("circle", { cx: p[0].toFixed(1), cy: p[1].toFixed(1), r, fill: colour }))];
}

function panelOf(figure, panel) {
  const { width, height, left, right, top, bottom } = PANEL;
  const points = panel.curves.flatMap(curve => curve.points);
  const [lx, ly] = panel.logarithmic;
  const both = points.filter(([a, b]) => a !== null && b !== null && (!lx || a > 0) && (!ly || b > 0));
  const x = axisOf([...both.map(p => p[0]), ...[...panel.failed, ...panel.zeros].map(p => p[1])], lx, left, width - right);
  const y = axisOf(both.map(p => p[1]), ly, height - bottom, top);
  const text = (content, px, py, anchor, more) => svg("text", { x: px, y: py, "text-anchor": anchor, ...more }, content);
  const grid = { stroke: "#e5e5e5", "stroke-width": 1 };
  const parts = [
    ...x.ticks.flatMap(v => [svg("line", { x1: x.place(v), x2: x.place(v), y1: top, y2: height - bottom, ...grid }), text(short(v, 4), x.place(v), height - bottom + 15, "middle")]),
    ...y.ticks.flatMap(v => [svg("line", { x1: left, x2: width - right, y1: y.place(v), y2: y.place(v), ...grid }), text(short(v, 4), left - 5, y.place(v) + 4, "end")]),
    svg("rect", { x: left, y: top, width: width - left - right, height: height - top - bottom, fill: "none", stroke: "#888" }),
    ...panel.curves.flatMap((curve, k) => drawnCurve(figure, curve, k, panel.curves.length, x, y)),
    ...panel.zeros.filter(([, v]) => x.reached(v)).map(([name, v]) => polygon([[0, 0], [-6, -10], [6, -10]], x.place(v), height - bottom, styleOf(figure, name).colour)),
  ];
  const seen = [];
  panel.failed.filter(([, v]) => x.reached(v)).forEach(([name, v]) => {
    // Those at one place lie below one another.
    const lower = 14 * seen.filter(other => other === v).length;
    seen.push(v);
    parts.push(text("×", x.place(v), top + 15 + lower, "middle", { fill: styleOf(figure, name).colour, style: "font-size: 20px; font-weight: bold" }));
  });
  parts.push(text(panel.title, (left + width - right) / 2, 16, "middle", { class: "title" }), text(panel.across, (left + width - right) / 2, height - 8, "middle"));
  return svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${panel.title} over ${panel.across}` }, ...parts);
}

function legendEntry(figure, name) {
  const { colour, dash, mark } = styleOf(figure, name);
  const sign = mark ? polygon(mark, 15, 8, colour) : svg("line", { x1: 0, x2: 30, y1: 8, y2: 8, stroke: colour, "stroke-width": 2.5, "stroke-dasharray": dash });
  const span = document.createElement("span");
  span.append(svg("svg", { viewBox: "0 0 30 16", "aria-hidden": "true" }, sign), " " + figure.names[name]);
  return span;
}

function plotOf({ name, caption, figure }) {
  const all = document.createElement("figure");
  all.className = "plot";
  all.id = `plot-${name}`;
  const panels = document.createElement("div");
  panels.className = "panels";
  panels.append(...figure.panels.map(panel => panelOf(figure, panel)));
  const legend = document.createElement("div");
  legend.className = "legend";
  const used = name => figure.panels.some(panel => panel.curves.some(curve => curve.name === name && curve.points.length > 0));
  const shown = figure.names.map((_, k) => k).filter(k => figure.names[k] && (k < figure.names.length - figure.guides || used(k)));
  legend.append(...shown.map(k => legendEntry(figure, k)));
  const words = document.createElement("figcaption");
  words.textContent = caption;
  all.append(panels, legend, words);
  return all;
}

function elementOf(kind, text) {
  const node = document.createElement(kind);
  node.textContent = text;
  return node;
}

const BLOCKS = {
  heading: ([depth, text]) => elementOf(`h${Math.min(depth + 1, 6)}`, text),
  text: paragraph,
  advice: text => Object.assign(paragraph(text), { className: "advice" }),
  code: block,
  list: items => {
    const list = document.createElement("ul");
    list.append(...items.map(text => elementOf("li", text)));
    return list;
  },
  table: rows => table(rows[0], rows.slice(1)),
  plot: plotOf,
};

/** Shows the results of a study. */
function showStudy() {
  const blocks = about.study || [];
  element("study").hidden = blocks.length === 0;
  element("study").append(...blocks.flatMap(part => Object.entries(part).map(([kind, content]) => BLOCKS[kind](content))));
}
