// One picture of one run, and what the mouse, fingers and keys do to it.

class Viewer {
  constructor(member, painter) {
    this.member = member;
    this.painter = painter;
    this.sheet = painter.sheet();
    this.figure = document.createElement("figure");
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", `${member.name}: sheet in 3D. Arrow keys rotate, plus and minus zoom, Space plays, `
      + "Page Up and Page Down change the frame, Enter probes the centre.");
    this.caption = document.createElement("figcaption");
    this.figure.append(this.canvas, this.caption);
    this.loaded = "";
    listen(this);
  }

  get frame() {
    return this.member.at(times[state.step]);
  }

  /** Size of the picture in pixels, after the room that the page gives. */
  fit(many) {
    const box = this.canvas.getBoundingClientRect();
    const scale = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(80, Math.round(box.width * scale));
    const height = Math.round(width * (many ? 0.8 : 0.66));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      [this.canvas.width, this.canvas.height] = [width, height];
    }
  }

  matrix() {
    return projection(centreOf(this.member), radius, this.canvas.width / this.canvas.height);
  }

  /** Fills the buffer of the painter where something of it has changed. */
  load() {
    const k = this.frame;
    const range = rangeAt(this.member, k);
    const key = JSON.stringify([k, state.choice, range, state.warp, state.factor]);
    if (key === this.loaded) return;
    const { member } = this;
    this.x = shown(member, k);
    const onTriangles = member.onTriangles(state.choice.quantity);
    const values = member.values(k, state.choice);
    this.painter.load(this.sheet, cornersOf(this.x, member.triangles, values, onTriangles, range));
    this.loaded = key;
  }

  /** Draws the sheet, `bare` without axes and probe. */
  draw(bare = false) {
    this.load();
    const { member, canvas } = this;
    const matrix = this.matrix();
    const context = this.painter.draw(this.sheet, canvas, {
      matrix, eye: axes()[2], clip: clipOf(member), light: state.light, edges: state.edges,
    });
    if (!bare) {
      this.triad(context);
      this.mark(context, matrix);
    }
    const k = this.frame;
    const lines = members.length > 1 ? [member.name, `t = ${short(member.times[k])}`] : [];
    if (member.meta.status && member.meta.status !== "complete" && members.length > 1) lines.push(member.meta.status);
    this.caption.textContent = lines.join(", ");
  }

  /** The directions of x, y and z. */
  triad(context) {
    const size = Math.max(16, Math.min(40, this.canvas.width / 16));
    const [cx, cy] = [1.6 * size, this.canvas.height - 1.6 * size];
    const [right, up] = axes();
    context.save();
    context.font = `${Math.round(0.42 * size)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.strokeStyle = context.fillStyle = "#1a1a1a";
    context.lineWidth = Math.max(1, size / 20);
    AXES.forEach((name, c) => {
      const [dx, dy] = [right[c] * size, -up[c] * size];
      context.beginPath();
      context.moveTo(cx, cy);
      context.lineTo(cx + dx, cy + dy);
      context.stroke();
      if (Math.hypot(dx, dy) > 0.2 * size) context.fillText(name, cx + 1.25 * dx, cy + 1.25 * dy);
    });
    context.restore();
  }

  /** A ring around the vertex that is probed. */
  mark(context, matrix) {
    if (!state.probe || state.probe.member !== this.member) return;
    const v = 3 * state.probe.vertex;
    const { width, height } = this.canvas;
    const [px, py] = project(matrix, this.x[v], this.x[v + 1], this.x[v + 2], width, height);
    context.save();
    [["#ffffff", 5], ["#111111", 2]].forEach(([colour, thick]) => {
      context.strokeStyle = colour;
      context.lineWidth = thick;
      context.beginPath();
      context.arc(px, py, 9, 0, 2 * Math.PI);
      context.stroke();
    });
    context.restore();
  }

  /** The vertex, and the triangle, at a place of the canvas. */
  pick(px, py) {
    const { width, height } = this.canvas;
    const matrix = this.matrix();
    const { x, member: { triangles } } = this;
    const plane = clipOf(this.member);
    const at = new Float64Array(x.length);
    for (let i = 0; i < x.length; i += 3) {
      const [sx, sy, depth] = project(matrix, x[i], x[i + 1], x[i + 2], width, height);
      [at[i], at[i + 1], at[i + 2]] = [sx, sy, depth];
    }
    let best = null;
    for (let t = 0; t < triangles.length; t += 3) {
      const corners = [0, 1, 2].map(c => 3 * triangles[t + c]);
      const shares = inside(at, corners, px, py);
      if (!shares) continue;
      const mix = (from, c) => corners.reduce((sum, v, k) => sum + shares[k] * from[v + c], 0);
      const depth = mix(at, 2);
      if (plane[0] * mix(x, 0) + plane[1] * mix(x, 1) + plane[2] * mix(x, 2) > plane[3]) continue;
      if (depth < -1 || (best && best.depth <= depth)) continue;
      best = { depth, triangle: t / 3, vertex: corners[shares.indexOf(Math.max(...shares))] / 3 };
    }
    return best;
  }
}

/** Barycentric coordinates of a place in a triangle on the canvas; none outside of it. */
function inside(at, [a, b, c], px, py) {
  const area = (at[b] - at[a]) * (at[c + 1] - at[a + 1]) - (at[c] - at[a]) * (at[b + 1] - at[a + 1]);
  if (!area) return null;
  const u = ((at[b] - px) * (at[c + 1] - py) - (at[c] - px) * (at[b + 1] - py)) / area;
  const v = ((at[c] - px) * (at[a + 1] - py) - (at[a] - px) * (at[c + 1] - py)) / area;
  const w = 1 - u - v;
  return u >= 0 && v >= 0 && w >= 0 ? [u, v, w] : null;
}

/** Degrees by which a key turns the sheet. */
const TURN = Math.PI / 24;

function listen(viewer) {
  const { canvas } = viewer;
  const fingers = new Map();
  let moved = 0;
  const place = event => {
    const box = canvas.getBoundingClientRect();
    const scale = canvas.width / box.width;
    return [(event.clientX - box.left - canvas.clientLeft) * scale, (event.clientY - box.top - canvas.clientTop) * scale];
  };
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size === 1) moved = 0;
  });
  canvas.addEventListener("pointermove", event => {
    if (!fingers.has(event.pointerId)) return;
    const before = [...fingers.values()];
    const [x, y] = fingers.get(event.pointerId);
    const [dx, dy] = [event.clientX - x, event.clientY - y];
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    moved += Math.hypot(dx, dy);
    const size = canvas.clientWidth;
    if (fingers.size === 2) {
      const apart = ([a, b]) => Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
      zoom(apart([...fingers.values()]) / apart(before));
      shift(dx / size, -dy / size);
    } else if (event.shiftKey || event.buttons & 2) shift((2 * dx) / size, (-2 * dy) / size);
    else rotate((5 * dx) / size, (5 * dy) / size);
    redraw();
  });
  const lift = event => {
    const single = fingers.size === 1 && fingers.delete(event.pointerId);
    fingers.delete(event.pointerId);
    if (single && moved < 4 && event.type === "pointerup") probeAt(viewer, ...place(event));
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 500));
    redraw();
  }, { passive: false });
  canvas.addEventListener("keydown", event => key(viewer, event));
}

function shift(across, up) {
  camera.move[0] += across / camera.zoom;
  camera.move[1] += up / camera.zoom;
}

function key(viewer, event) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const others = {
    "+": () => zoom(1.2),
    "=": () => zoom(1.2),
    "-": () => zoom(1 / 1.2),
    " ": () => play(),
    PageUp: () => go(state.step - 1),
    PageDown: () => go(state.step + 1),
    Home: () => look("oblique"),
    Enter: () => probeAt(viewer, viewer.canvas.width / 2, viewer.canvas.height / 2),
  };
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (arrows[event.key]) {
    const [x, y] = arrows[event.key];
    if (event.shiftKey) shift(0.1 * x, -0.1 * y);
    else rotate(TURN * x, TURN * y);
  } else if (others[event.key]) others[event.key]();
  else return;
  event.preventDefault();
  redraw();
}
