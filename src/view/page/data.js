// What the page holds: runs with frames of 16-bit numbers, decoded when they are shown.

const about = JSON.parse(document.getElementById("about").textContent);
const element = id => document.getElementById(id);

/** The bytes of an embedded block. */
function bytesOf(id) {
  const text = atob(element("block-" + id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; i += 1) bytes[i] = text.charCodeAt(i);
  return bytes;
}

const LEVELS = 65534;
const MISSING = 65535;
/** Decoded frames that are kept. */
const KEPT = 12;

/** Unsigned 16-bit levels as numbers of a range; NaN for what is missing. */
function numbers(levels, [least, largest]) {
  const out = new Float64Array(levels.length);
  const step = (largest - least) / LEVELS;
  for (let i = 0; i < out.length; i += 1) {
    out[i] = levels[i] === MISSING ? NaN : least + step * levels[i];
  }
  return out;
}

/** Signed 16-bit positions, x y z of each vertex, as numbers of a box. */
function positions(levels, box) {
  const out = new Float64Array(levels.length);
  for (let axis = 0; axis < 3; axis += 1) {
    const step = (box.largest[axis] - box.least[axis]) / LEVELS;
    for (let i = axis; i < out.length; i += 3) {
      out[i] = levels[i] === -32768 ? NaN : box.least[axis] + step * (levels[i] + 32767);
    }
  }
  return out;
}

/** Vectors `x - from`. */
function differences(x, from) {
  return x.map((value, i) => value - from[i]);
}

/** A run with its sheet. */
class Member {
  constructor(meta) {
    this.meta = meta;
    this.name = meta.name;
    this.sheet = meta.sheet;
    this.frames = this.sheet ? this.sheet.frames : [];
    this.times = this.frames.map(frame => frame.time);
    this.cache = new Map();
    if (this.sheet) {
      this.sheet.fields.forEach(field => { field.key = field.name + (field.at === "triangle" ? " (triangles)" : ""); });
      this.vertices = this.sheet.vertices;
      this.triangles = new Uint32Array(bytesOf(this.sheet.triangles).buffer);
      const rest = this.sheet.rest;
      this.rest = rest === null ? null : positions(new Int16Array(bytesOf(rest).buffer), this.sheet.box);
    }
  }

  /** Frame number `k` of those shown: its positions and the levels of its fields. */
  frame(k) {
    if (!this.cache.has(k)) {
      const bytes = bytesOf(this.frames[k].block);
      const count = 3 * this.vertices;
      const x = positions(new Int16Array(bytes.buffer, 0, count), this.sheet.box);
      if (this.cache.size >= KEPT) this.cache.delete(this.cache.keys().next().value);
      this.cache.set(k, { x, levels: new Uint16Array(bytes.buffer, 2 * count), values: new Map() });
    }
    return this.cache.get(k);
  }

  /** The frame that is shown at a time: the last one that is not later. */
  at(time) {
    let k = 0;
    while (k + 1 < this.times.length && this.times[k + 1] <= time) k += 1;
    return k;
  }

  count(field) {
    return field.at === "triangle" ? this.triangles.length / 3 : this.vertices;
  }

  /** Component `c` of stored field number `f` in frame `k`. */
  component(k, f, c) {
    let place = 0;
    let ranges = 0;
    this.sheet.fields.slice(0, f).forEach(field => {
      place += field.components * this.count(field);
      ranges += field.components;
    });
    const count = this.count(this.sheet.fields[f]);
    place += c * count;
    return numbers(this.frame(k).levels.subarray(place, place + count), this.frames[k].ranges[ranges + c]);
  }

  /** The components of a quantity in frame `k`; none where this run does not have it. */
  components(k, quantity) {
    const frame = this.frame(k);
    if (!frame.values.has(quantity)) frame.values.set(quantity, this.decoded(k, quantity));
    return frame.values.get(quantity);
  }

  decoded(k, quantity) {
    const x = this.frame(k).x;
    const split = v => [0, 1, 2].map(c => v.filter((_, i) => i % 3 === c));
    if (quantity === "position") return split(x);
    if (quantity === "displacement") return this.rest ? split(differences(x, this.rest)) : null;
    const f = this.sheet.fields.findIndex(field => field.key === quantity);
    if (f < 0) return null;
    return [...Array(this.sheet.fields[f].components).keys()].map(c => this.component(k, f, c));
  }

  /** Whether a quantity has a value for each triangle. */
  onTriangles(quantity) {
    const field = this.sheet.fields.find(f => f.key === quantity);
    return field !== undefined && field.at === "triangle";
  }

  /** What is coloured: a component of a quantity, or its magnitude. */
  values(k, choice) {
    const all = this.components(k, choice.quantity);
    if (!all) return null;
    if (choice.component !== null) return all[choice.component];
    return all[0].map((_, i) => Math.hypot(...all.map(c => c[i])));
  }

  /** Half the distance of two levels of a quantity's component in frame `k`. */
  resolution(k, quantity) {
    const box = this.sheet.box;
    if (quantity === "position" || quantity === "displacement") {
      return Math.max(...[0, 1, 2].map(c => box.largest[c] - box.least[c])) / LEVELS / 2;
    }
    let at = 0;
    for (const field of this.sheet.fields) {
      if (field.key === quantity) {
        const ranges = this.frames[k].ranges.slice(at, at + field.components);
        return Math.max(...ranges.map(([l, h]) => h - l)) / LEVELS / 2;
      }
      at += field.components;
    }
    return NaN;
  }
}

const members = about.members.map(meta => new Member(meta));
const drawn = members.filter(member => member.frames.length > 0);
/** Times at which some run has a frame. */
const times = [...new Set(drawn.flatMap(member => member.times))].sort((a, b) => a - b);

/** What a quantity is called; the positions themselves have no array. */
function named(quantity) {
  return ["position", "displacement"].includes(quantity) ? `${quantity} [length]` : quantity;
}

/** What can be coloured, in all runs. */
function choices() {
  const all = [];
  const add = (quantity, components) => {
    if (all.some(choice => choice.quantity === quantity)) return;
    const [, name, unit, at] = /^(.*?)(?: (\[.*\]))?( \(triangles\))?$/.exec(named(quantity));
    const title = part => [name + part, unit].filter(Boolean).join(" ") + (at || "");
    if (components === 1) {
      all.push({ quantity, component: 0, title: title("") });
      return;
    }
    all.push({ quantity, component: null, title: title(", magnitude") });
    for (let c = 0; c < components; c += 1) {
      all.push({ quantity, component: c, title: title(", " + ("xyz"[c] || c)) });
    }
  };
  drawn.forEach(member => member.sheet.fields.forEach(field => add(field.key, field.components)));
  if (drawn.some(member => member.rest)) add("displacement", 3);
  add("position", 3);
  return all.filter(choice => choice.quantity !== "position" || choice.component !== null);
}

/** The least and the largest of finite numbers. */
function extent(values) {
  let [least, largest] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < least && value !== -Infinity) least = value;
    if (value > largest && value !== Infinity) largest = value;
  }
  return [least, largest];
}

/** A number in few digits. */
function short(value, digits = 5) {
  if (!Number.isFinite(value)) return String(value);
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  return text.replace(/(\.\d*?)0+(e|$)/, "$1$2").replace(/\.(e|$)/, "$1").replace("e+", "e");
}
