// Colour maps: colours at equal distances, linear in between.

const MAPS = {
  viridis: "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725",
  cividis: "00224e 123570 3b496c 575d6d 707173 8a8678 a59c74 c3b369 e1cc55 fee838",
  coolwarm: "3b4cc0 688aef 99baff c9d8ef edd1c2 f7a789 e26952 b40426",
};
/** What has no value. */
const GREY = [160, 160, 160];

/** 256 colours of a map, red green blue opaque. */
function colours(name) {
  const stops = MAPS[name].split(" ").map(hex => [0, 2, 4].map(i => parseInt(hex.slice(i, i + 2), 16)));
  const out = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; i += 1) {
    const place = (i / 255) * (stops.length - 1);
    const k = Math.min(Math.floor(place), stops.length - 2);
    const colour = stops[k].map((c, j) => Math.round(c + (place - k) * (stops[k + 1][j] - c)));
    out.set([...colour, 255], 4 * i);
  }
  return out;
}
