// Scene, provenance, costs and how to reproduce a run.

function section(title, open, ...content) {
  const details = document.createElement("details");
  details.open = open;
  const summary = document.createElement("summary");
  summary.textContent = title;
  details.append(summary, ...content);
  return details;
}

function block(text) {
  const pre = document.createElement("pre");
  pre.tabIndex = 0;
  pre.textContent = text;
  return pre;
}

function table(heads, rows) {
  const wide = document.createElement("div");
  wide.className = "wide";
  const all = document.createElement("table");
  const head = document.createElement("tr");
  heads.forEach(text => {
    const th = document.createElement("th");
    th.scope = "col";
    th.textContent = text;
    head.append(th);
  });
  all.append(head, ...rows.map(cells => {
    const tr = document.createElement("tr");
    cells.forEach(text => {
      const td = document.createElement("td");
      td.textContent = text;
      if (/^-?[\d.,e+-]+ ?(%|s|ms|kB|MB|GB|B)?$/.test(text)) td.className = "number";
      tr.append(td);
    });
    return tr;
  }));
  wide.append(all);
  return wide;
}

function bytes(count) {
  const size = Math.abs(count);
  if (size < 1e3) return `${count} B`;
  if (size < 1e6) return `${short(count / 1e3, 3)} kB`;
  return size < 1e9 ? `${short(count / 1e6, 3)} MB` : `${short(count / 1e9, 3)} GB`;
}

function costs(costs) {
  const rows = costs.parts.filter(part => part.seconds > 0).map(part => [
    part.group, part.name, `${(100 * part.share).toFixed(2)} %`, `${short(part.seconds, 3)} s`,
    part.counts.map(([name, count]) => `${count} × ${name}`).join(", "),
  ]);
  const work = Object.entries(costs.work).filter(([, count]) => count > 0);
  return [
    paragraph(`${short(costs.seconds, 4)} s in all, ${costs.work.steps} steps, threads: ${costs.threads}`
      + (costs.peak_resident_bytes ? `, at most ${bytes(costs.peak_resident_bytes)} resident` : "") + "."),
    table(["group", "part", "share", "time", "counts"], rows),
    table(["work", "count"], work.map(([name, count]) => [name.replaceAll("_", " "), String(count)])),
  ];
}

function recordOf(member) {
  const { meta } = member;
  const all = [];
  if (meta.reproduce) all.push(section("How to reproduce", true, ...meta.reproduce.map(part => part.command ? block(part.text) : paragraph(part.text))));
  if (meta.scene) all.push(section("Scene, with every default", false, block(meta.scene)));
  if (meta.events) all.push(section("Events", false, block(meta.events)));
  if (meta.failure) all.push(section("Failure", true, block(meta.failure)));
  if (meta.provenance) all.push(section("Provenance", false, block(JSON.stringify(meta.provenance, null, 2))));
  if (meta.costs) all.push(section("Costs", false, ...costs(meta.costs)));
  return all;
}

/** Warnings that are shown before the others are folded away. */
const UNFOLDED = 2;

/** Warnings, each once, with the runs that have it. */
function warned() {
  const all = new Map();
  members.forEach(member => member.meta.warnings.forEach(text => all.set(text, [...(all.get(text) || []), member.name])));
  const runs = names => (names.length === members.length ? `all ${names.length} runs` : names.join("; "));
  return [...all].map(([text, names]) => (members.length > 1 ? `${runs(names)}: ${text}` : text));
}

function showRecord() {
  const record = element("record");
  for (const member of members) {
    if (members.length > 1) {
      record.append(section(member.name, false, ...recordOf(member)));
    } else {
      const heading = document.createElement("h2");
      heading.textContent = "Record";
      record.append(heading, ...recordOf(member));
    }
  }
  const item = content => {
    const node = document.createElement("li");
    node.append(content);
    return node;
  };
  const all = warned().map(item);
  // The sheet is to be seen without scrolling.
  const [first, more] = all.length > UNFOLDED + 1 ? [all.slice(0, UNFOLDED), all.slice(UNFOLDED)] : [all, []];
  element("warnings").append(...first);
  if (more.length === 0) return;
  const list = document.createElement("ul");
  list.append(...more);
  element("warnings").append(item(section(`${more.length} more`, false, list)));
}
