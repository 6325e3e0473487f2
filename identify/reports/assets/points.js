// Nodes put on the surfaces of a robot: a plain canvas, a ray under the mouse, a list, and a CSV file to save.
"use strict";

const DATA = JSON.parse(document.getElementById("data").textContent);
const $ = id => document.getElementById(id);
const color = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7f7f7f"];
const AXES = ["#d55e00", "#009e73", "#0072b2"];
const add = (a, b, f = 1) => a.map((x, i) => x + f * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const unit = v => v.map(x => x / (Math.hypot(...v) || 1));
const times = (m, v) => m.map(row => dot(row, v));
const transposed = m => m[0].map((_, j) => m.map(row => row[j]));
const product = (a, b) => a.map(row => transposed(b).map(column => dot(row, column)));
const EYE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

// Links: the turn of their frame in the base's, its origin, and the corners of their surface in the base's frame.
const links = DATA.links.map(link => {
  const turn = link.pose.slice(0, 3).map(row => row.slice(0, 3)), origin = link.pose.slice(0, 3).map(row => row[3]);
  const corners = [];
  for (let i = 0; i < link.vertices.length; i += 3) corners.push(add(times(turn, link.vertices.slice(i, i + 3).map(x => x / 10000)), origin));
  return {...link, turn, origin, corners};
});
const linkOf = name => links.find(link => link.name === name);
const inBase = point => add(times(linkOf(point.link).turn, point.position), linkOf(point.link).origin);
const inLink = (link, place) => times(transposed(link.turn), add(place, link.origin, -1));
const triangles = links.flatMap((link, number) => {
  const found = [];
  for (let i = 0; i < link.triangles.length; i += 3) found.push({number, corners: [0, 1, 2].map(k => link.corners[link.triangles[i + k]])});
  return found;
});
for (const one of triangles) {
  const [a, b, c] = one.corners;
  one.normal = unit(cross(add(b, a, -1), add(c, a, -1)));
}
const nodes = DATA.nodes.map(node => ({name: "", about: "", link: "", position: null, axes: EYE, normal: null, ...node}));
let chosen = 0;

const every = [...links.flatMap(link => link.corners), ...links.map(link => link.origin), ...(DATA.overlay ? DATA.overlay.places : [])];
const ends = [0, 1, 2].map(i => every.reduce(([low, high], p) => [Math.min(low, p[i]), Math.max(high, p[i])], [Infinity, -Infinity]));
const center = ends.map(([low, high]) => (low + high) / 2), radius = Math.hypot(...ends.map(([low, high]) => high - low)) / 2 || 1;
const view = {azimuth: -0.9, elevation: 0.35, zoom: 1, shift: [0, 0]};
const mark = {x: 0.5, y: 0.5, shown: false};
const canvas = $("robot"), context = canvas.getContext("2d");

// Across, up and towards the eye.
function frame() {
  const [c, s, ce, se] = [Math.cos(view.azimuth), Math.sin(view.azimuth), Math.cos(view.elevation), Math.sin(view.elevation)];
  return [[-s, c, 0], [-se * c, -se * s, ce], [ce * c, ce * s, se]];
}
const pixels = () => 0.47 * Math.min(canvas.clientWidth, canvas.clientHeight) / radius * view.zoom;
function projector() {
  const axes = frame(), scale = pixels(), [w, h] = [canvas.clientWidth / 2 + view.shift[0], canvas.clientHeight / 2 + view.shift[1]];
  return p => {
    const away = [p[0] - center[0], p[1] - center[1], p[2] - center[2]];
    return [w + scale * dot(axes[0], away), h - scale * dot(axes[1], away), dot(axes[2], away)];
  };
}

let waiting = false;
function paint() {
  if (!waiting) requestAnimationFrame(() => { waiting = false; painted(); });
  waiting = true;
}

const rgb = text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16));
const mixed = (a, b, part) => a.map((x, i) => x + part * (b[i] - x));

// For each link, tones from dark to light with a touch of its colour.
function shades() {
  const both = ["muted", "neutral"].map(name => rgb(color(name))), [dark, light] = both.sort((a, b) => a[1] - b[1]);
  return links.map((_, n) => Array.from({length: 24}, (_, k) => {
    const tone = mixed(mixed(dark, light, 0.3 + 0.7 * k / 23), rgb(PALETTE[n % PALETTE.length]), 0.22);
    return `rgb(${tone.map(Math.round).join(" ")})`;
  }));
}

function painted() {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const project = projector(), [, up, eye] = frame(), colors = shades();
  for (const one of triangles) {
    one.seen = one.corners.map(project);
    one.depth = one.seen[0][2] + one.seen[1][2] + one.seen[2][2];
  }
  context.lineWidth = 0.7;
  for (const {seen: [a, b, c], normal, number} of [...triangles].sort((p, q) => p.depth - q.depth)) {
    const facing = dot(normal, eye), side = facing < 0 ? -1 : 1;
    const light = Math.min(1, Math.max(0, side * (0.75 * facing + 0.35 * dot(normal, up)) + 0.1));
    context.beginPath();
    context.moveTo(a[0], a[1]);
    context.lineTo(b[0], b[1]);
    context.lineTo(c[0], c[1]);
    context.closePath();
    context.fillStyle = context.strokeStyle = colors[number][Math.round(light * 23)];
    context.fill();
    context.stroke();
  }
  if (DATA.overlay && $("overlay").checked) overlay(project);
  nodes.forEach((node, i) => node.position && spot(node, i, project, eye));
  axesOf(project);
  if (mark.shown) {
    const [x, y] = [mark.x * canvas.clientWidth, mark.y * canvas.clientHeight];
    line([[x - 12, y], [x + 12, y]], color("warn"), 1.5);
    line([[x, y - 12], [x, y + 12]], color("warn"), 1.5);
  }
}

function line(places, stroke, width) {
  context.beginPath();
  places.forEach(([x, y], i) => i ? context.lineTo(x, y) : context.moveTo(x, y));
  Object.assign(context, {strokeStyle: stroke, lineWidth: width});
  context.stroke();
}

// The analyser's geometry: its nodes as rings, joined by its lines.
function overlay(project) {
  const places = DATA.overlay.places.map(project);
  for (const pair of DATA.overlay.segments) line(pair.map(i => places[i]), color("initial"), 1);
  for (const [x, y] of places) {
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    Object.assign(context, {strokeStyle: color("initial"), lineWidth: 1.2});
    context.stroke();
  }
}

function spot(node, i, project, eye) {
  const [x, y] = project(inBase(node)), link = linkOf(node.link);
  const away = node.normal && dot(times(link.turn, node.normal), eye) < 0;
  context.beginPath();
  context.arc(x, y, i === chosen ? 6 : 4, 0, 2 * Math.PI);
  context.globalAlpha = away ? 0.45 : 1;
  context.fillStyle = PALETTE[links.indexOf(link) % PALETTE.length];
  context.fill();
  Object.assign(context, {strokeStyle: node.about ? color("warn") : color("paper"), lineWidth: node.about ? 2.5 : 1.2});
  context.stroke();
  context.fillStyle = color("ink");
  context.font = `${i === chosen ? "bold 13" : "11"}px system-ui, sans-serif`;
  context.fillText(node.node, x + 7, y - 5);
  context.globalAlpha = 1;
}

// The axes of the chosen node's sensor.
function axesOf(project) {
  const node = nodes[chosen];
  if (!node || !node.position) return;
  const from = inBase(node), turn = linkOf(node.link).turn;
  node.axes.forEach((axis, k) => {
    const end = add(from, times(turn, axis), 55 / pixels()), [x, y] = project(end);
    line([project(from), [x, y]], AXES[k], 2.5);
    context.fillStyle = AXES[k];
    context.font = "bold 12px system-ui, sans-serif";
    context.fillText("XYZ"[k], x + 3, y + 3);
  });
}

// What is under a place of the canvas: link, place in the base's frame and normal towards the eye; null for nothing.
function under(x, y) {
  const axes = frame(), scale = pixels();
  const [u, v] = [(x - canvas.clientWidth / 2 - view.shift[0]) / scale, -(y - canvas.clientHeight / 2 - view.shift[1]) / scale];
  const from = add(add(add(center, axes[0], u), axes[1], v), axes[2], 10 * radius), way = axes[2].map(t => -t);
  let best = null, nearest = Infinity;
  for (const {corners: [a, b, c], number, normal} of triangles) {
    const p = add(b, a, -1), q = add(c, a, -1), h = cross(way, q), det = dot(p, h);
    if (Math.abs(det) < 1e-14) continue;
    const s = add(from, a, -1), first = dot(s, h) / det;
    if (first < 0 || first > 1) continue;
    const k = cross(s, p), second = dot(way, k) / det;
    if (second < 0 || first + second > 1) continue;
    const distance = dot(q, k) / det;
    if (distance < nearest) {
      nearest = distance;
      best = {link: links[number], place: add(from, way, distance), normal: dot(normal, way) > 0 ? normal.map(t => -t) : normal};
    }
  }
  return best;
}

function put(x, y) {
  const hit = under(x, y), node = nodes[chosen];
  if (!node) return say("No node is chosen: add one.");
  if (!hit) return say("Nothing is there.");
  Object.assign(node, {link: hit.link.name, position: inLink(hit.link, hit.place), normal: times(transposed(hit.link.turn), hit.normal), about: ""});
  say(`Node ${node.node} is on ${node.link} at ${node.position.map(t => t.toFixed(4)).join(", ")} m, normal ${node.normal.map(t => t.toFixed(2)).join(", ")}.`);
  const next = nodes.findIndex((one, i) => i > chosen && !one.position);
  if (next >= 0) chosen = next;
  show();
}

function say(text) { $("status").textContent = text; }

// Degrees about the fixed x, y, z axes in that order, of a sensor whose axes are rows.
function angles(axes) {
  const m = transposed(axes), steep = Math.hypot(m[0][0], m[1][0]) < 1e-9;
  const [rx, ry, rz] = steep ? [Math.atan2(-m[1][2], m[1][1]), Math.atan2(-m[2][0], 0), 0]
    : [Math.atan2(m[2][1], m[2][2]), Math.atan2(-m[2][0], Math.hypot(m[0][0], m[1][0])), Math.atan2(m[1][0], m[0][0])];
  return [rx, ry, rz].map(t => t * 180 / Math.PI || 0);
}
function axesAt(degrees) {
  let m = EYE;
  degrees.forEach((value, k) => { m = product(about(EYE[k], value * Math.PI / 180), m); });
  return transposed(m);
}
function about([x, y, z], angle) {
  const c = Math.cos(angle), s = Math.sin(angle), t = 1 - c;
  return [[t * x * x + c, t * x * y - s * z, t * x * z + s * y], [t * x * y + s * z, t * y * y + c, t * y * z - s * x], [t * x * z - s * y, t * y * z + s * x, t * z * z + c]];
}

const turnSensor = axis => change(node => { node.axes = product(transposed(about(EYE[axis], Math.PI / 2)), node.axes); });
const alongNormal = () => change(node => {
  if (!node.normal) return say("The normal is known where the node was clicked or laid on the surface.");
  const z = unit(node.normal), helper = EYE[[0, 1, 2].reduce((a, b) => Math.abs(z[a]) <= Math.abs(z[b]) ? a : b)];
  const x = unit(add(helper, z, -dot(helper, z)));
  node.axes = [x, cross(z, x), z];
});

function change(how) {
  const node = nodes[chosen];
  if (!node || !node.position) return say("The node has no place yet.");
  how(node);
  show();
}

function choose(i) {
  chosen = Math.min(Math.max(i, 0), nodes.length - 1);
  show();
}

const short = x => String(+x.toFixed(5));

function show() {
  const node = nodes[chosen], placed = node && node.position;
  $("chosen").textContent = node ? `Node ${node.node}` : "No node";
  $("about").textContent = node ? node.about : "";
  $("name").value = node ? node.name : "";
  $("link").value = placed ? node.link : "";
  ["x", "y", "z"].forEach((id, k) => { $(id).value = placed ? short(node.position[k]) : ""; });
  ["rx", "ry", "rz"].forEach((id, k) => { $(id).value = placed ? String(+angles(node.axes)[k].toFixed(3)) : ""; });
  for (const input of document.querySelectorAll("#detail :is(input, select, button)")) input.disabled = input.id === "name" ? !node : !placed;
  $("rows").replaceChildren(...nodes.map((one, i) => {
    const row = document.createElement("tr");
    for (const text of [one.node, one.link, ...(one.position ? one.position.map(t => t.toFixed(3)) : ["", "", ""]), one.about]) row.insertCell().textContent = text;
    row.tabIndex = 0;
    row.setAttribute("aria-selected", i === chosen);
    row.addEventListener("click", () => choose(i));
    row.addEventListener("keydown", event => { if (event.key === "Enter") choose(i); });
    return row;
  }));
  const row = $("rows").rows[chosen];
  if (row) row.scrollIntoView({block: "nearest"});
  paint();
}

// The text of points.csv, of the nodes that have a place.
function csv() {
  const done = nodes.filter(node => node.position), turned = done.some(node => angles(node.axes).some(t => Math.abs(t) > 1e-4));
  const quoted = text => /[",;\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  const lines = done.map(node => [node.node, quoted(node.name), node.link, ...node.position.map(t => t.toFixed(5)), ...(turned ? angles(node.axes).map(t => t.toFixed(3)) : [])].join(","));
  return [`node,name,link,x_m,y_m,z_m${turned ? ",rx_deg,ry_deg,rz_deg" : ""}`, ...lines].join("\n") + "\n";
}

function read(text) {
  const cells = row => [...row.matchAll(/("([^"]|"")*"|[^,]*)(,|$)/g)].map(m => m[1].replace(/^"|"$/g, "").replaceAll('""', '"').trim());
  const [head, ...rows] = text.split(/\r?\n/).filter(row => row.trim() && !row.startsWith("#")).map(cells);
  const at = Object.fromEntries(head.map((name, k) => [name, k])), numbers = (row, names) => names.map(name => parseFloat(row[at[name]] ?? 0));
  const lost = [];
  for (const row of rows) {
    const number = parseInt(row[at.node]), link = row[at.link], position = numbers(row, ["x_m", "y_m", "z_m"]);
    if (!linkOf(link) || position.some(isNaN)) { lost.push(row[at.node]); continue; }
    const axes = axesAt("rx_deg" in at ? numbers(row, ["rx_deg", "ry_deg", "rz_deg"]) : [0, 0, 0]);
    const node = nodes.find(one => one.node === number) || nodes[nodes.push({node: number}) - 1];
    Object.assign(node, {name: row[at.name] || "", link, position, axes, normal: null, about: ""});
  }
  say(lost.length ? `Not read, on no link of this robot: ${lost.join(", ")}.` : `${rows.length} points were read.`);
  show();
}

canvas.addEventListener("pointerdown", event => {
  canvas.setPointerCapture(event.pointerId);
  mark.shown = false;
  canvas.pressed = {x: event.offsetX, y: event.offsetY, moved: false, shift: event.button === 1 || event.shiftKey};
});
canvas.addEventListener("pointermove", event => {
  if (!event.buttons) {
    const hit = under(event.offsetX, event.offsetY);
    canvas.title = hit ? `${hit.link.name}: ${inLink(hit.link, hit.place).map(t => t.toFixed(3)).join(", ")} m` : "";
    return;
  }
  const pressed = canvas.pressed;
  if (!pressed || (!pressed.moved && Math.hypot(event.offsetX - pressed.x, event.offsetY - pressed.y) < 4)) return;
  pressed.moved = true;
  if (pressed.shift) view.shift = [view.shift[0] + event.movementX, view.shift[1] + event.movementY];
  else turnView(-event.movementX * 0.008, event.movementY * 0.008);
  paint();
});
canvas.addEventListener("pointerup", event => {
  if (canvas.pressed && !canvas.pressed.moved && event.button === 0) put(event.offsetX, event.offsetY);
  canvas.pressed = null;
});
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  zoom(Math.exp(-event.deltaY * 0.001));
}, {passive: false});

function turnView(azimuth, elevation) {
  view.azimuth += azimuth;
  view.elevation = Math.min(1.57, Math.max(-1.57, view.elevation + elevation));
}
function zoom(factor) {
  view.zoom = Math.min(30, Math.max(0.3, view.zoom * factor));
  paint();
}

canvas.addEventListener("keydown", event => {
  const key = event.key, arrows = {ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[key];
  const steps = {w: [0, -1], a: [-1, 0], s: [0, 1], d: [1, 0]}[key.toLowerCase()];
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (arrows && event.shiftKey) view.shift = [view.shift[0] + 25 * arrows[0], view.shift[1] + 25 * arrows[1]];
  else if (arrows) turnView(0.1 * arrows[0], 0.1 * arrows[1]);
  else if (steps) {
    const step = event.shiftKey ? 20 : 4;
    mark.x = Math.min(1, Math.max(0, mark.x + step * steps[0] / canvas.clientWidth));
    mark.y = Math.min(1, Math.max(0, mark.y + step * steps[1] / canvas.clientHeight));
    mark.shown = true;
  } else if (key === "+" || key === "-") zoom(key === "+" ? 1.15 : 1 / 1.15);
  else if (key === "Enter") { mark.shown = true; put(mark.x * canvas.clientWidth, mark.y * canvas.clientHeight); }
  else if (key === "n" || key === "p") choose(chosen + (key === "n" ? 1 : -1));
  else if ("xyz".includes(key)) turnSensor("xyz".indexOf(key));
  else if (key === "Delete") $("clear").click();
  else return;
  event.preventDefault();
  paint();
});

for (const button of document.querySelectorAll("[data-turn]")) button.addEventListener("click", () => turnSensor(+button.dataset.turn));
$("normal").addEventListener("click", alongNormal);
$("along").addEventListener("click", () => change(node => { node.axes = EYE; }));
$("clear").addEventListener("click", () => change(node => Object.assign(node, {position: null, link: "", normal: null, axes: EYE, about: ""})));
$("name").addEventListener("change", () => { nodes[chosen].name = $("name").value; });
// Another link holds the node at the same place, with its sensor as it is.
$("link").addEventListener("change", () => change(node => {
  const [old, now, place] = [linkOf(node.link), linkOf($("link").value), inBase(node)], turn = product(transposed(now.turn), old.turn);
  Object.assign(node, {link: now.name, position: inLink(now, place), axes: node.axes.map(axis => times(turn, axis)), normal: node.normal && times(turn, node.normal), about: ""});
}));
["x", "y", "z"].forEach((id, k) => $(id).addEventListener("change", () => change(node => { node.position = node.position.map((t, i) => i === k && isFinite($(id).value) && $(id).value.trim() ? +$(id).value : t); })));
["rx", "ry", "rz"].forEach(id => $(id).addEventListener("change", () => change(node => {
  const given = ["rx", "ry", "rz"].map(name => parseFloat($(name).value));
  if (!given.some(isNaN)) node.axes = axesAt(given);
})));
$("overlay").addEventListener("change", paint);
$("overlay").parentElement.hidden = !DATA.overlay;
$("add").addEventListener("click", () => {
  const number = parseInt($("number").value) || Math.max(0, ...nodes.map(node => node.node)) + 1;
  if (nodes.some(node => node.node === number)) return say(`Node ${number} is in the list.`);
  nodes.push({node: number, name: "", about: "", link: "", position: null, axes: EYE, normal: null});
  $("number").value = "";
  choose(nodes.length - 1);
});
$("open").addEventListener("change", async () => { if ($("open").files[0]) read(await $("open").files[0].text()); });
$("save").addEventListener("click", () => {
  const left = nodes.filter(node => !node.position).map(node => node.node), link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([csv()], {type: "text/csv"}));
  link.download = "points.csv";
  link.click();
  URL.revokeObjectURL(link.href);
  say(left.length ? `Saved without nodes ${left.join(", ")}, which have no place.` : "Saved.");
});
$("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
function setTheme(name) {
  document.documentElement.dataset.theme = name;
  paint();
}

$("link").replaceChildren(...links.map(link => new Option(link.name)));
chosen = Math.max(0, nodes.findIndex(node => !node.position));
new ResizeObserver(paint).observe(canvas);
setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
show();
requestAnimationFrame(() => requestAnimationFrame(() => { document.documentElement.dataset.ready = "1"; }));
