// Values at one vertex, in the frame that is shown.

function probeAt(viewer, px, py) {
  const found = viewer.pick(px, py);
  if (!found) return;
  state.probe = { member: viewer.member, vertex: found.vertex, triangle: found.triangle };
  element("vertex").value = found.vertex;
  element("member").value = members.indexOf(viewer.member);
  redraw();
}

/** From the boxes of the probe. */
function probeNamed() {
  const member = members[Number(element("member").value)];
  const vertex = Number(element("vertex").value);
  const valid = member && member.sheet && element("vertex").value !== "" && Number.isInteger(vertex)
    && vertex >= 0 && vertex < member.vertices;
  state.probe = valid ? { member, vertex, triangle: null } : null;
  if (!valid) {
    const most = member && member.sheet ? member.vertices - 1 : 0;
    element("values").replaceChildren(paragraph(`Expected the number of a vertex from 0 to ${most}.`));
  }
  redraw();
}

function paragraph(text) {
  const p = document.createElement("p");
  p.textContent = text;
  return p;
}

/** A row of a table: a heading and cells. */
function row(title, ...cells) {
  const tr = document.createElement("tr");
  const th = document.createElement("th");
  th.scope = "row";
  th.textContent = title;
  tr.append(th, ...cells.map(text => {
    const td = document.createElement("td");
    td.textContent = text;
    return td;
  }));
  return tr;
}

function showProbe() {
  if (!state.probe) return;
  const { member, vertex, triangle } = state.probe;
  const k = member.at(times[state.step]);
  const table = document.createElement("table");
  const place = triangle === null ? "" : `, triangle ${triangle}`;
  table.append(row("vertex", String(vertex) + place));
  const quantities = ["position", ...(member.rest ? ["displacement"] : []), ...member.sheet.fields.map(f => f.key)];
  for (const quantity of quantities) {
    const at = member.onTriangles(quantity) ? triangle : vertex;
    if (at === null) continue;
    const values = member.components(k, quantity).map(c => short(c[at], 6));
    const tr = row(named(quantity), values.join(", "));
    tr.dataset.quantity = quantity;
    tr.dataset.values = JSON.stringify(member.components(k, quantity).map(c => c[at]));
    tr.title = `resolution ±${short(member.resolution(k, quantity), 2)}`;
    table.append(tr);
  }
  const shownQuantity = state.choice.quantity;
  const note = paragraph(`Frame ${member.frames[k].number} at time ${short(member.times[k])}; 16-bit resolution of `
    + `${state.choice.title}: ±${short(member.resolution(k, shownQuantity), 2)}.`);
  element("values").replaceChildren(table, note);
}
