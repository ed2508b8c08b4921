// Follows a run in progress: the page is loaded again, with its camera and controls, when the results have changed.

/** Milliseconds between two questions. */
const QUESTIONS = 2000;
const CONTROLS = ["field", "map", "range", "least", "largest", "warp", "factor", "clip", "cut", "flip", "light", "wires", "speed", "loop"];

/** What is shown and how, for the page that comes next. */
function keep() {
  const controls = CONTROLS.map(id => [id, element(id).value, element(id).checked]);
  const last = state.step === times.length - 1;
  sessionStorage.setItem(location.pathname, JSON.stringify({ controls, camera, time: last ? null : times[state.step] }));
}

/** Shows what the page before has shown. */
function restore() {
  const kept = JSON.parse(sessionStorage.getItem(location.pathname));
  if (!kept || viewers.length === 0) return;
  kept.controls.forEach(([id, value, checked]) => { [element(id).value, element(id).checked] = [value, checked]; });
  Object.assign(camera, kept.camera);
  readControls();
  if (kept.time !== null) go(Math.max(0, times.findIndex(time => time >= kept.time)));
}

function watch(known) {
  restore();
  const asking = setInterval(async () => {
    if (timer !== null) return;
    try {
      if (await (await fetch("state")).text() === known) return;
      clearInterval(asking);
      keep();
      location.reload();
    } catch {
      clearInterval(asking);
      element("summary").textContent += "; the program that served this page has ended";
    }
  }, QUESTIONS);
}

watch(about.watch);
