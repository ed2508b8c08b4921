// Brings everything together: controls, the player, and when what is drawn.

let viewers = [];
let waiting = false;
let timer = null;
/** Milliseconds from frame to frame. */
const pace = () => 1000 / element("speed").value;

/** Draws with the next picture of the screen. */
function redraw() {
  if (waiting || viewers.length === 0) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    draw();
  });
}

function draw() {
  viewers.forEach(viewer => viewer.fit(viewers.length > 1));
  viewers.forEach(viewer => viewer.draw());
  showClock();
  showBar();
  showProbe();
  moveNow();
}

function go(step) {
  state.step = Math.max(0, Math.min(times.length - 1, step));
  element("time").value = state.step;
  redraw();
}

/** Plays, or stops to play. */
function play() {
  const playing = timer === null;
  if (playing) {
    const last = () => state.step === times.length - 1;
    const next = () => {
      if (last() && !element("loop").checked) play();
      else go(last() ? 0 : state.step + 1);
    };
    if (last()) go(0);
    timer = setInterval(next, pace());
  } else {
    clearInterval(timer);
    timer = null;
  }
  element("play").setAttribute("aria-pressed", String(playing));
  element("play").textContent = playing ? "Pause" : "Play";
}

function showClock() {
  const text = `t = ${short(times[state.step])}, frame ${state.step + 1} of ${times.length}`;
  element("clock").textContent = text;
  element("time").setAttribute("aria-valuetext", text);
}

function showBar() {
  const { member } = viewers[0];
  const each = state.range === "frame" && viewers.length > 1;
  const [least, largest] = rangeAt(member, viewers[0].frame);
  element("bar-title").textContent = state.choice.title + (each ? " (range of each frame; numbers of the first run)" : "");
  const tick = value => (Math.abs(value) < 1e-6 * (largest - least) ? 0 : value);
  const ticks = [0, 0.25, 0.5, 0.75, 1].map(share => short(tick(least + share * (largest - least)), 4));
  element("bar-ticks").replaceChildren(...ticks.map(text => {
    const span = document.createElement("span");
    span.textContent = text;
    return span;
  }));
  element("bar").setAttribute("aria-label", `Colour bar of ${state.choice.title} from ${ticks[0]} to ${ticks[4]}`);
  if (state.range !== "fixed") {
    element("least").value = Number(least.toPrecision(6));
    element("largest").value = Number(largest.toPrecision(6));
  }
}

function setMap() {
  state.map = element("map").value;
  const map = colours(state.map);
  viewers[0].painter.paint(map);
  const context = element("bar-colours").getContext("2d");
  context.putImageData(new ImageData(new Uint8ClampedArray(map), 256, 1), 0, 0);
}

/** Fills a list of choices. */
function fill(select, texts) {
  select.replaceChildren(...texts.map((text, i) => new Option(text, i)));
}

function readControls() {
  state.choice = all[Number(element("field").value)];
  state.range = element("range").value;
  if (state.range === "fixed") state.fixed = [element("least"), element("largest")].map(input => Number(input.value));
  ["least", "largest"].forEach(id => { element(id).disabled = state.range !== "fixed"; });
  state.warp = element("warp").value;
  const factor = Number(element("factor").value);
  state.factor = Number.isFinite(factor) && element("factor").value !== "" ? factor : 1;
  state.clip = { axis: element("clip").value, share: element("cut").value / 1000, flip: element("flip").checked };
  ["cut", "flip"].forEach(id => { element(id).disabled = state.clip.axis === ""; });
  element("cut").setAttribute("aria-valuetext", state.clip.axis === "" ? "off" : clipText());
  element("cut").title = state.clip.axis === "" ? "" : clipText();
  state.light = element("light").checked;
  state.edges = element("wires").checked;
  setMap();
  redraw();
}

function connect() {
  element("controls").addEventListener("submit", event => event.preventDefault());
  ["field", "map", "range", "least", "largest", "warp", "factor", "clip", "cut", "flip", "light", "wires"]
    .forEach(id => element(id).addEventListener("input", readControls));
  ["vertex", "member"].forEach(id => element(id).addEventListener("input", probeNamed));
  element("time").addEventListener("input", event => go(Number(event.target.value)));
  element("back").addEventListener("click", () => go(state.step - 1));
  element("next").addEventListener("click", () => go(state.step + 1));
  element("play").addEventListener("click", play);
  element("shot").addEventListener("click", shot);
  element("movie").addEventListener("click", record);
  // A player under way takes up the new speed.
  element("speed").addEventListener("input", () => { if (timer !== null) [0, 1].forEach(play); });
  const buttons = { nearer: () => zoom(1.25), farther: () => zoom(0.8) };
  Object.entries(buttons).forEach(([id, act]) => element(id).addEventListener("click", () => { act(); redraw(); }));
  document.querySelectorAll("[data-view]").forEach(button => button.addEventListener("click", () => {
    look(button.dataset.view);
    redraw();
  }));
  new ResizeObserver(redraw).observe(element("grid"));
}

/** A run without frames, among others. */
function absent(member) {
  const figure = document.createElement("figure");
  figure.className = "absent";
  figure.textContent = `${member.name}: no frames` + (member.meta.status ? ` (${member.meta.status})` : "");
  return figure;
}

function start() {
  const painter = new Painter();
  const pictures = members.map(member => (member.frames.length ? new Viewer(member, painter) : absent(member)));
  viewers = pictures.filter(picture => picture instanceof Viewer);
  element("grid").append(...pictures.map(picture => picture.figure || picture));
  element("grid").style.gridTemplateColumns = members.length > 1 ? "repeat(auto-fill, minmax(min(100%, 15rem), 1fr))" : "";
  fill(element("field"), all.map(choice => choice.title));
  element("map").replaceChildren(...Object.keys(MAPS).map(name => new Option(name, name)));
  fill(element("member"), members.map(member => member.name));
  element("member").value = members.indexOf(drawn[0]);
  element("which").hidden = members.length === 1;
  element("vertex").max = drawn[0].vertices - 1;
  element("time").max = times.length - 1;
  if (!drawn.some(member => member.rest)) element("warp").querySelector("[value=rest]").remove();
  connect();
  readControls();
  go(times.length - 1);
  draw();
}

/** Writes what a program has asked for in place of the page. */
function answer(wanted) {
  const text = document.createElement("pre");
  text.id = "pictures";
  try {
    start();
    text.textContent = pictures(wanted).join("\n");
  } catch (error) {
    text.textContent = `error: ${error.message || error}`;
  }
  document.body.replaceChildren(text);
}

const all = drawn.length > 0 ? choices() : [];
showStudy();
showRecord();
// What is folded away is printed too.
window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(part => { part.open = true; }));
element("logarithmic").addEventListener("input", drawCurves);
drawCurves();
if (drawn.length === 0) {
  element("view").replaceChildren(paragraph("No frames: this result directory has no sheet to be drawn."));
} else if (about.pictures) {
  answer(about.pictures);
} else {
  try {
    start();
  } catch (error) {
    element("stage").replaceChildren(paragraph(String(error.message || error)));
  }
}
