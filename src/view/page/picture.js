// Pictures and movies: the sheets with names, time and colour bar on one canvas.

/** Draws all runs without the probe, so many pixels each. */
function drawBare([width, height]) {
  viewers.forEach(({ canvas }) => { [canvas.width, canvas.height] = [width, height]; });
  viewers.forEach(viewer => viewer.draw(true));
}

/** The part of the height of a canvas between its first and last row that is not white all over. */
function drawnPart({ width, height }, context) {
  const { data } = context.getImageData(0, 0, width, height);
  const white = row => data.subarray(4 * width * row, 4 * width * (row + 1)).every(level => level === 255);
  let [top, bottom] = [0, height];
  while (top < bottom && white(top)) top += 1;
  while (bottom > top && white(bottom - 1)) bottom -= 1;
  return top < bottom ? [top / height, bottom / height] : [0, 1];
}

/** The part of the height of pictures that some run draws on in some of the frames, with a margin; looked for in small ones. */
function partOf(steps, size) {
  const parts = steps.flatMap(step => {
    state.step = step;
    drawBare(size.map(pixels => Math.ceil(pixels / 4)));
    return viewers.map(({ canvas }) => drawnPart(canvas, canvas.getContext("2d")));
  });
  const margin = 0.03;
  return [Math.max(0, Math.min(...parts.map(p => p[0])) - margin), Math.min(1, Math.max(...parts.map(p => p[1])) + margin)];
}

/** Pictures of all runs, so many pixels each, of which a part of the height is kept. */
function pictured({ size, title = "" }, part) {
  const [width, height] = size;
  drawBare(size);
  showBar();
  const [top, bottom] = part.map(share => Math.round(share * height));
  const across = Math.ceil(Math.sqrt(viewers.length));
  const letter = Math.max(14, Math.round((width * across) / 50));
  const [head, line] = [title ? 2 * letter : 0, viewers.length > 1 ? 1.6 * letter : 0];
  const each = Math.round(bottom - top + line);
  const from = head + each * Math.ceil(viewers.length / across);
  const picture = document.createElement("canvas");
  // Encoders of movies want even sizes.
  [picture.width, picture.height] = [width * across, from + 5 * letter].map(pixels => pixels + (pixels % 2));
  const context = picture.getContext("2d");
  context.fillStyle = "#ffffff";
  context.fillRect(0, 0, picture.width, picture.height);
  context.fillStyle = "#1a1a1a";
  context.font = `bold ${letter}px system-ui, sans-serif`;
  context.fillText(title, letter, 1.4 * letter);
  context.font = `${letter}px system-ui, sans-serif`;
  viewers.forEach(({ canvas, caption }, i) => {
    const [left, above] = [(i % across) * width, head + Math.floor(i / across) * each];
    context.drawImage(canvas, 0, top, width, bottom - top, left, above + line, width, bottom - top);
    if (line) context.fillText(caption.textContent, left + letter / 2, above + 1.1 * letter);
  });
  const room = picture.width - 2 * letter;
  context.fillText(`${element("bar-title").textContent}    t = ${short(times[state.step])}`, letter, from + 1.2 * letter);
  context.drawImage(element("bar-colours"), letter, from + 1.7 * letter, room, letter);
  [...element("bar-ticks").children].forEach((tick, i) => {
    context.textAlign = ["left", "center", "center", "center", "right"][i];
    context.fillText(tick.textContent, letter + (i / 4) * room, from + 3.9 * letter);
  });
  return picture;
}

const everyStep = () => times.map((_, k) => k);

/** Offers a file to be saved. */
function save(name, url) {
  const link = document.createElement("a");
  link.download = `${about.title.replace(/[^\w.-]+/g, "-")}${name}`;
  link.href = url;
  link.click();
}

/** The size of the pictures on the page, so many times as large. */
const sizeOnPage = times => [viewers[0].canvas.width, viewers[0].canvas.height].map(pixels => times * pixels);

/** The pictures as one PNG, twice as large as on the page. */
function shot() {
  const size = sizeOnPage(2);
  const picture = pictured({ size }, partOf([state.step], size));
  save(`-${String(state.step).padStart(6, "0")}.png`, picture.toDataURL("image/png"));
  redraw();
}

/** All frames as a movie, at the speed of the player. */
async function record() {
  const types = ["video/mp4;codecs=avc1.4d0032", "video/webm;codecs=vp9", "video/webm"];
  const type = window.MediaRecorder && types.find(name => MediaRecorder.isTypeSupported(name));
  if (!type) {
    element("told").textContent = "This browser records no movies; rumple movie writes them.";
    return;
  }
  if (timer !== null) play();
  element("movie").disabled = true;
  const [before, size] = [state.step, sizeOnPage(1)];
  const part = partOf(everyStep(), size);
  const movie = document.createElement("canvas");
  const stream = movie.captureStream(0);
  const parts = [];
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 16e6 });
  recorder.addEventListener("dataavailable", event => parts.push(event.data));
  const ended = new Promise(done => { recorder.onstop = done; });
  for (let k = 0; k <= times.length; k += 1) {
    // The last frame stays for as long as the others.
    state.step = Math.min(k, times.length - 1);
    const picture = pictured({ size }, part);
    if (k === 0) {
      [movie.width, movie.height] = [picture.width, picture.height];
      recorder.start();
    }
    movie.getContext("2d").drawImage(picture, 0, 0);
    stream.getVideoTracks()[0].requestFrame();
    element("told").textContent = `recording: frame ${state.step + 1} of ${times.length}`;
    await new Promise(done => { setTimeout(done, pace()); });
  }
  recorder.stop();
  await ended;
  const url = URL.createObjectURL(new Blob(parts, { type }));
  save(type.startsWith("video/mp4") ? ".mp4" : ".webm", url);
  setTimeout(() => URL.revokeObjectURL(url), 60000);
  element("told").textContent = "";
  element("movie").disabled = false;
  go(before);
}

/** The choice of this title, with or without its unit. */
function choiceNamed(name) {
  const plain = text => text.replace(/ \[.*?\]/, "").replaceAll("_", " ").toLowerCase();
  const found = all.findIndex(({ title }) => title === name || plain(title) === plain(name));
  if (found < 0) throw new Error(`no field "${name}"; there are: ${all.map(({ title }) => title).join("; ")}`);
  return found;
}

/** The pictures that a program has asked for, as text in place of the page: a data URL a line. */
function pictures(wanted) {
  const set = (id, value) => { element(id).value = value; };
  if (wanted.field !== null) set("field", choiceNamed(wanted.field));
  set("map", wanted.map);
  set("range", Array.isArray(wanted.range) ? "fixed" : wanted.range);
  if (Array.isArray(wanted.range)) ["least", "largest"].forEach((id, i) => set(id, wanted.range[i]));
  [element("wires").checked, element("light").checked] = [wanted.edges, wanted.light];
  readControls();
  if (typeof wanted.view === "string") look(wanted.view);
  else [camera.azimuth, camera.elevation] = wanted.view.map(degrees => (degrees * Math.PI) / 180);
  zoom(wanted.zoom);
  const nearest = time => times.reduce((best, t, k) => (Math.abs(t - time) < Math.abs(times[best] - time) ? k : best), 0);
  const steps = wanted.movie ? everyStep() : [wanted.time === null ? times.length - 1 : nearest(wanted.time)];
  const part = partOf(steps, wanted.size);
  return steps.map(step => {
    state.step = step;
    return `${times[step]} ${pictured(wanted, part).toDataURL("image/png")}`;
  });
}
