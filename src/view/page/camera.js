// The camera that all pictures share: it is centred on each sheet, with z upwards.

const FIELD_OF_VIEW = 0.55;
/** Azimuth and elevation, and how near. */
const VIEWS = {
  oblique: [-0.9, 0.6, 1.2],
  top: [-Math.PI / 2, Math.PI / 2, 1],
  front: [-Math.PI / 2, 0, 1],
  side: [0, 0, 1],
};

const camera = { azimuth: 0, elevation: 0, zoom: 1, move: [0, 0] };

function look(view) {
  [camera.azimuth, camera.elevation, camera.zoom] = VIEWS[view];
  camera.move = [0, 0];
}
look("oblique");

function rotate(across, up) {
  camera.azimuth -= across;
  camera.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, camera.elevation + up));
}

function zoom(factor) {
  camera.zoom = Math.max(0.05, Math.min(100, camera.zoom * factor));
}

/** Right, up and towards the eye. */
function axes() {
  const [sa, ca] = [Math.sin(camera.azimuth), Math.cos(camera.azimuth)];
  const [se, ce] = [Math.sin(camera.elevation), Math.cos(camera.elevation)];
  return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
}

/** The matrix from positions around `centre` to clip space, column by column. */
function projection(centre, radius, aspect) {
  const [right, up, back] = axes();
  const distance = radius / Math.sin(FIELD_OF_VIEW / 2) / camera.zoom;
  const focus = 1 / Math.tan(FIELD_OF_VIEW / 2) / Math.max(1, 1 / aspect);
  const near = Math.max(distance - 4 * radius, distance * 0.01);
  const far = distance + 4 * radius;
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const shift = [
    camera.move[0] * radius - dot(right, centre),
    camera.move[1] * radius - dot(up, centre),
    -distance - dot(back, centre),
  ];
  const depth = [(far + near) / (near - far), (2 * far * near) / (near - far)];
  const columns = [0, 1, 2].map(i => [
    (focus / aspect) * right[i], focus * up[i], depth[0] * back[i], -back[i],
  ]);
  columns.push([(focus / aspect) * shift[0], focus * shift[1], depth[0] * shift[2] + depth[1], -shift[2]]);
  return columns.flat();
}

/** A position on a picture of `width` × `height`, with its depth. */
function project(matrix, x, y, z, width, height) {
  const row = r => matrix[r] * x + matrix[4 + r] * y + matrix[8 + r] * z + matrix[12 + r];
  const w = row(3);
  return [(0.5 + (0.5 * row(0)) / w) * width, (0.5 - (0.5 * row(1)) / w) * height, row(2) / w, w];
}
