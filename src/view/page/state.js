// What is shown, and ranges.

const state = {
  step: 0,
  choice: null,
  map: "viridis",
  range: "all",
  fixed: [0, 1],
  warp: "z",
  factor: 1,
  clip: { axis: "", share: 0.5, flip: false },
  light: true,
  edges: false,
  probe: null,
};

const AXES = ["x", "y", "z"];

/** Ranges over all frames of all runs, by quantity and component; they are looked for once. */
const known = new Map();

function rangeOfAll(choice) {
  const key = choice.title;
  if (!known.has(key)) known.set(key, extent(drawn.flatMap(member => rangeOfRun(member, choice))));
  return known.get(key);
}

/** Extremes of one run: those that are stored, or those of all its frames. */
function rangeOfRun(member, choice) {
  let at = 0;
  for (const field of member.sheet.fields) {
    if (field.key === choice.quantity) {
      if (choice.component === null) break;
      return member.frames.flatMap(frame => frame.ranges[at + choice.component]);
    }
    at += field.components;
  }
  return member.frames.flatMap((_, k) => extent(member.values(k, choice) || []));
}

/** The range of the colours of a member's frame `k`. */
function rangeAt(member, k) {
  if (state.range === "fixed") return state.fixed;
  if (state.range === "all") return rangeOfAll(state.choice);
  return extent(member.values(k, state.choice) || []);
}

/** Positions as they are drawn: amplified. */
function shown(member, k) {
  const x = member.frame(k).x;
  const factor = state.factor;
  if (factor === 1) return x;
  const from = state.warp === "rest" && member.rest ? member.rest : member.frame(0).x;
  if (state.warp !== "z") return x.map((value, i) => from[i] + factor * (value - from[i]));
  const middle = (member.sheet.box.least[2] + member.sheet.box.largest[2]) / 2;
  return x.map((value, i) => (i % 3 === 2 ? middle + factor * (value - middle) : value));
}

function centreOf(member) {
  return AXES.map((_, c) => (member.sheet.box.least[c] + member.sheet.box.largest[c]) / 2);
}

/** The radius that every picture has room for. */
const radius = Math.max(
  Number.MIN_VALUE,
  ...drawn.map(({ sheet: { box } }) => Math.hypot(...box.least.map((l, c) => box.largest[c] - l)) / 2),
);

/** The clip plane of a member, as a normal and a bound. */
function clipOf(member) {
  const c = AXES.indexOf(state.clip.axis);
  if (c < 0) return [0, 0, 0, 1];
  const { least, largest } = member.sheet.box;
  const bound = least[c] + state.clip.share * (largest[c] - least[c]);
  const sign = state.clip.flip ? -1 : 1;
  return [...AXES.map((_, i) => (i === c ? sign : 0)), sign * bound];
}

/** The value of the clip plane, in the first run. */
function clipText() {
  const plane = clipOf(drawn[0]);
  const bound = plane[3] * (state.clip.flip ? -1 : 1);
  return state.clip.axis + (state.clip.flip ? " ≥ " : " ≤ ") + short(bound, 4);
}
