// Pictures and movies: the sheets with names, time and colour bar on one canvas.

/** Least width of a picture on which the numbers of the colour bar do not touch, pixels. */
const LEAST_WIDTH = 360;

/** Draws all runs without the probe, so many pixels each. */
function drawBare([width, height]) {
  viewers.forEach(({ canvas }) => { [canvas.width, canvas.height] = [width, height]; });
  viewers.forEach(viewer => viewer.draw(true));
}

/** The rectangle of a canvas that is not white, as shares of its size: left, top, right, bottom; none of a white one. */
function drawnPart({ width, height }, context) {
  const { data } = context.getImageData(0, 0, width, height);
  let box = null;
  for (let i = 0; i < width * height; i += 1) {
    if (data[4 * i] === 255 && data[4 * i + 1] === 255 && data[4 * i + 2] === 255) continue;
    const [x, y] = [(i % width) / width, Math.floor(i / width) / height];
    box = box ? [Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y)] : [x, y, x, y];
  }
  return box;
}

/** The rectangle of pictures that some run draws on in some of the frames; looked for in small ones. */
function boxOf(steps, size) {
  const boxes = steps.flatMap(step => {
    state.step = step;
    drawBare(size.map(pixels => Math.ceil(pixels / 4)));
    return viewers.map(({ canvas }) => drawnPart(canvas, canvas.getContext("2d"))).filter(Boolean);
  });
  if (boxes.length === 0) throw new Error("nothing is seen from here: a flat sheet is seen from the top");
  return [Math.min, Math.min, Math.max, Math.max].map((best, c) => best(...boxes.map(box => box[c])));
}

/** The part of pictures that is drawn on, with a margin: left, top, right, bottom. */
function partOf(steps, size) {
  return boxOf(steps, size).map((share, c) => (c < 2 ? Math.max(0, share - 0.03) : Math.min(1, share + 0.03)));
}

/** The same in pixels; all of the width unless it is to be `narrow`, and then room for the numbers of the bar. */
function cropped(part, [width, height], narrow) {
  const [left, top, right, bottom] = part.map((share, c) => Math.round(share * (c % 2 ? height : width)));
  const room = Math.min(width, Math.max(right - left, LEAST_WIDTH));
  const from = Math.max(0, Math.min(width - room, Math.round((left + right - room) / 2)));
  return narrow ? [from, top, room, bottom - top] : [0, top, width, bottom - top];
}

/** Brings the camera so near that the sheets fill the pictures, by some of the frames. */
function approach(steps, size) {
  const some = steps.filter((_, k) => k === steps.length - 1 || k % Math.ceil(steps.length / 4) === 0);
  for (let k = 0; k < 8; k += 1) {
    const reach = Math.max(...boxOf(some, size).map(share => 2 * Math.abs(share - 0.5)));
    // What reaches the edge may lie beyond it.
    if (reach > 0.97) zoom(0.9);
    else if (reach < 0.9) zoom(Math.min(1.3, 0.94 / reach));
    else return;
  }
}

/** Writes a line in letters of this height, or smaller ones that fit between `left` and `right`. */
function write(context, text, height, [left, right], base) {
  context.font = context.font.replace(/\d+(\.\d+)?px/, `${height}px`);
  const share = Math.min(1, (right - left) / context.measureText(text).width);
  context.font = context.font.replace(/\d+(\.\d+)?px/, `${height * share}px`);
  context.fillText(text, left, base);
  context.font = context.font.replace(/\d+(\.\d+)?px/, `${height}px`);
}

/** Pictures of all runs, so many pixels each, of which a part is kept, of a `narrow` one of the width too. */
function pictured({ size, title = "", narrow = false }, part) {
  drawBare(size);
  showBar();
  const [left, top, width, height] = cropped(part, size, narrow);
  const across = Math.ceil(Math.sqrt(viewers.length));
  const letter = Math.max(14, Math.round((width * across) / 50));
  const [head, line] = [title ? 2 * letter : 0, members.length > 1 ? 1.6 * letter : 0];
  const each = Math.round(height + line);
  const from = head + each * Math.ceil(viewers.length / across);
  const picture = document.createElement("canvas");
  // Encoders of movies want even sizes.
  [picture.width, picture.height] = [width * across, from + 5 * letter].map(pixels => pixels + (pixels % 2));
  const context = picture.getContext("2d");
  context.fillStyle = "#ffffff";
  context.fillRect(0, 0, picture.width, picture.height);
  context.fillStyle = "#1a1a1a";
  context.font = `bold ${letter}px system-ui, sans-serif`;
  write(context, title, letter, [letter, picture.width - letter], 1.4 * letter);
  context.font = `${letter}px system-ui, sans-serif`;
  viewers.forEach(({ canvas, member }, i) => {
    const [beside, above] = [(i % across) * width, head + Math.floor(i / across) * each];
    context.drawImage(canvas, left, top, width, height, beside, above + line, width, height);
    const name = member.name.replaceAll(",", ", ");
    if (line) write(context, name, letter, [beside + letter / 2, beside + width - letter / 2], above + 1.1 * letter);
  });
  const room = picture.width - 2 * letter;
  const absent = members.length - viewers.length;
  const words = [element("bar-title").textContent, `t = ${short(times[state.step])}`];
  if (absent > 0) words.push(`${absent} of ${members.length} runs have no frames`);
  write(context, words.join("    "), letter, [letter, letter + room], from + 1.2 * letter);
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

/** Pixels of an inch at which a picture is as large as on the page. */
const DPI = 96;

/** The checksum of a chunk of a PNG, CRC-32 (ISO 3309). */
function checksum(bytes) {
  let sum = -1;
  for (const byte of bytes) {
    sum ^= byte;
    for (let k = 0; k < 8; k += 1) sum = sum & 1 ? (sum >>> 1) ^ 0xedb88320 : sum >>> 1;
  }
  return (sum ^ -1) >>> 0;
}

/** A canvas as the data URL of a PNG with so many pixels an inch, which its chunk pHYs says. */
function png(canvas, dpi) {
  const file = atob(canvas.toDataURL("image/png").split(",")[1]);
  const chunk = new DataView(new ArrayBuffer(21));
  chunk.setUint32(0, 9);
  [..."pHYs"].forEach((letter, i) => chunk.setUint8(4 + i, letter.charCodeAt(0)));
  [8, 12].forEach(at => chunk.setUint32(at, Math.round(dpi / 0.0254)));
  chunk.setUint8(16, 1);
  chunk.setUint32(17, checksum(new Uint8Array(chunk.buffer, 4, 13)));
  // It follows the signature and the header.
  const parts = [file.slice(0, 33), String.fromCharCode(...new Uint8Array(chunk.buffer)), file.slice(33)];
  return `data:image/png;base64,${btoa(parts.join(""))}`;
}

/** The size of the pictures on the page. */
const sizeOnPage = () => [viewers[0].canvas.width, viewers[0].canvas.height];

/** What the form asks of pictures of a size on the page and a share of its width; without a number there so many times as large. */
function asked([width, height], factor, share = 1) {
  const given = Math.max(0, element("picture-width").value);
  const across = Math.ceil(Math.sqrt(viewers.length));
  const scale = given > 0 ? Math.min(8192 / width, given / (share * width * across)) : factor;
  const size = [width, height].map(pixels => Math.max(1, Math.round(scale * pixels)));
  return { size, scale, title: element("picture-title").value };
}

/** The pictures as one PNG, twice as large as on the page. */
function shot() {
  const shown = sizeOnPage();
  const part = partOf([state.step], shown);
  const { size, scale, title } = asked(shown, 2, part[2] - part[0]);
  const picture = pictured({ size, title, narrow: true }, part);
  save(`-${String(state.step).padStart(6, "0")}.png`, png(picture, DPI * scale));
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
  const [before, { size, title }] = [state.step, asked(sizeOnPage(), 1)];
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
    const picture = pictured({ size, title }, part);
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
  const nearest = time => times.reduce((best, t, k) => (Math.abs(t - time) < Math.abs(times[best] - time) ? k : best), 0);
  const steps = wanted.movie ? everyStep() : [wanted.time === null ? times.length - 1 : nearest(wanted.time)];
  approach(steps, wanted.size);
  zoom(wanted.zoom);
  const part = partOf(steps, wanted.size);
  return steps.map(step => {
    state.step = step;
    return `${times[step]} ${png(pictured(wanted, part), wanted.dpi)}`;
  });
}
