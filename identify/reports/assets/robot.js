// Shapes in 3D on plain canvases: the model at its posture, the measured points, or both; turned by dragging, zoomed by the wheel.
"use strict";

const ROBOT = (() => {
  const tip = $("robot-tip");
  const stages = ["model", "measured", "motion"].map(kind => ({kind, canvas: $(`robot-${kind}`)})).filter(stage => stage.canvas);
  if (!stages.length) return null;
  const home = {azimuth: -0.9, elevation: 0.35, zoom: 1};
  const view = {...home};
  let robot, mode, motion = null, corners, center, radius, reach, rise, feet, order, canvas, context, playing = true, phase = 0, last = 0;

  const drawn = DATA.measurements.filter(m => m.robot);
  const links = [...new Set(drawn.flatMap(m => m.robot.link))].filter(Boolean);
  const linkColor = name => PALETTE[Math.max(links.indexOf(name), 0) % PALETTE.length];
  const add = (a, b, f = 1) => a.map((x, i) => x + f * b[i]);
  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);

  // The place on the skeleton nearest to a point, so that a thin rib can join them: segment and part of it.
  function foot(point, skeleton) {
    let best = {distance: Infinity, segment: 0, part: 0};
    for (let i = 0; i + 1 < skeleton.length; i++) {
      const along = add(skeleton[i + 1], skeleton[i], -1), away = add(point, skeleton[i], -1), length = dot(along, along);
      const part = length ? Math.min(1, Math.max(0, dot(away, along) / length)) : 0;
      const gap = add(away, along, -part), distance = dot(gap, gap);
      if (distance < best.distance) best = {distance, segment: i, part};
    }
    return best;
  }

  function choose() {
    const chosen = drawn.find(m => m.name === $("robot-measurement").value), at = $("robot-mode").selectedIndex;
    robot = chosen.robot;
    corners = robot.bodies ? robot.bodies.vertices.map(p => p.map(x => x / 1000)) : [];
    const all = [...robot.points, ...robot.skeleton, ...corners];
    center = [0, 1, 2].map(i => (Math.min(...all.map(p => p[i])) + Math.max(...all.map(p => p[i]))) / 2);
    radius = Math.max(...all.map(p => Math.hypot(...add(p, center, -1)))) || 1;
    reach = Math.max(...all.map(p => Math.hypot(p[0] - center[0], p[1] - center[1]))) || radius;
    rise = Math.max(...all.map(p => Math.abs(p[2] - center[2])));
    feet = robot.points.map(point => foot(point, robot.skeleton));
    order = feet.map((_, i) => i).sort((a, b) => feet[a].segment - feet[b].segment || feet[a].part - feet[b].part);
    $("robot-mode").replaceChildren(...robot.modes.map((m, i) => new Option(m.label, i)));
    $("robot-mode").selectedIndex = Math.min(Math.max(at, 0), robot.modes.length - 1);
    const what = [chosen.name, chosen.use].filter(Boolean).join(", ");
    $("robot-about").textContent = `${what}. Drag or arrow keys turn, wheel or + and - zoom. Largest displacement of each mode drawn equally large; `
      + `dashed: at rest. ${hasArrows() ? "Arrows: channels' directions, longer at forces. " : ""}`
      + (stages.some(stage => stage.kind === "motion") ? "Measured motion: every response to one force at one line; a click in the plot of an FRF chooses its line. " : "")
      + (robot.bodies && robot.bodies.missing.length ? `Not drawn as they look: ${robot.bodies.missing.join("; ")}. ` : "")
      + (robot.ring.about && `Ringed: ${robot.ring.about} (${robot.ring.nodes.length ? robot.ring.nodes.join(", ") : "not stated"}).`);
    chooseMode();
  }

  const hasArrows = () => Object.values(robot.arrows).some(list => list.length);

  function chooseMode() {
    mode = robot.modes[$("robot-mode").selectedIndex];
    phase = 0;
    for (const {kind, canvas} of stages.filter(stage => stage.kind !== "motion"))
      canvas.previousElementSibling.textContent = `${(DATA.stages || {})[kind] || kind} ${mode[kind] || "has no such mode"}`;
    paint();
    window.dispatchEvent(new CustomEvent("mode"));
  }

  // What is chosen: name of the measurement, frequency of the mode, and which way each channel looks from which point.
  const chosen = () => ({name: $("robot-measurement").value, hz: mode.hz, ways: robot.ways || {}, points: robot.points.length});

  // Shows a motion that is no mode, with a sentence on it; null where nothing is known of it.
  function move(shape, said) {
    motion = shape;
    stages.find(stage => stage.kind === "motion").canvas.previousElementSibling.textContent = said;
    paint();
  }

  // Pixels a metre: the robot, turned however, fills its panel.
  function pixels() {
    const high = Math.cos(view.elevation) * rise + Math.abs(Math.sin(view.elevation)) * reach;
    return 0.42 * Math.min(canvas.clientWidth / reach, canvas.clientHeight / high) * view.zoom;
  }

  // Across and up on the panel, pixels, and how near to the eye, m.
  function project(p) {
    const [x, y, z] = add(p, center, -1), c = Math.cos(view.azimuth), s = Math.sin(view.azimuth);
    const across = -s * x + c * y, depth = c * x + s * y;
    const scale = pixels();
    const up = Math.cos(view.elevation) * z - Math.sin(view.elevation) * depth;
    return [canvas.clientWidth / 2 + scale * across, canvas.clientHeight / 2 - scale * up, Math.cos(view.elevation) * depth + Math.sin(view.elevation) * z];
  }

  function line(points, stroke, width, dash = []) {
    context.beginPath();
    points.map(project).forEach(([x, y], i) => i ? context.lineTo(x, y) : context.moveTo(x, y));
    Object.assign(context, {strokeStyle: stroke, lineWidth: width, lineJoin: "round", lineCap: "round"});
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  function disc([x, y], size, fill, stroke) {
    context.beginPath();
    context.arc(x, y, size, 0, 2 * Math.PI);
    context.fillStyle = fill;
    context.fill();
    if (stroke) { context.strokeStyle = stroke; context.lineWidth = 2; context.stroke(); }
  }

  function label(text, [x, y], fill) {
    context.fillStyle = fill;
    context.font = "12px system-ui, sans-serif";
    context.fillText(text, x, y);
  }

  function floor() {
    const step = [0.05, 0.1, 0.25, 0.5, 1, 2.5, 5].find(s => s > radius / 4) || 10, n = 4;
    for (let i = -n; i <= n; i++) {
      line([[i * step, -n * step, 0], [i * step, n * step, 0]], color("grid"), 1);
      line([[-n * step, i * step, 0], [n * step, i * step, 0]], color("grid"), 1);
    }
    ["X", "Y", "Z"].forEach((name, i) => {
      const end = [0, 0, 0];
      end[i] = 0.8 * step;
      line([[0, 0, 0], end], color("muted"), 1.5);
      label(name, project(end.map(v => 1.2 * v)), color("muted"));
    });
    label(`floor grid ${step} m`, [14, canvas.clientHeight - 14], color("muted"));
  }

  // Metres for each thousandth of a shape.
  const reachOfShapes = () => 0.5 * radius * $("robot-amplitude").value / 1000;

  // Places moved by a shape; null where the shape is not known, at rest without a shape.
  function moved(rest, shape) {
    if (!shape) return rest;
    const size = reachOfShapes(), c = size * Math.cos(phase), s = size * Math.sin(phase);
    return rest.map((p, i) => shape.real[i][0] === null ? null : p.map((x, k) => x + c * shape.real[i][k] - s * shape.imag[i][k]));
  }

  function paint() {
    for (const stage of stages) {
      ({canvas} = stage);
      context = canvas.getContext("2d");
      const ratio = window.devicePixelRatio || 1, wide = Math.round(canvas.clientWidth * ratio), high = Math.round(canvas.clientHeight * ratio);
      if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
      floor();
      line(robot.skeleton, color("muted"), 1.5, [5, 6]);
      for (const ends of robot.segments || []) line(ends.map(i => robot.points[i]), color("line"), 1, [4, 4]);
      stage.lines = stage.faces = [];
      stage.spots = stage.kind === "model" ? paintModel(stage) : paintMeasured(stage.kind === "motion" ? motion : mode.measured_points);
    }
  }

  // Links as capsules, thinner towards the tool: their outline first, so that they look like one body; not where their own body is drawn.
  function bodies(skeleton, stage) {
    const size = i => Math.max(6, pixels() * radius * 0.13 * (1 - 0.6 * i / Math.max(skeleton.length - 1, 1)));
    const bare = i => !robot.bodies || robot.bodies.bare[i];
    for (const [stroke, less] of [["muted", 0], ["neutral", 2.5]])
      for (let i = 0; i + 1 < skeleton.length; i++) if (bare(i)) line([skeleton[i], skeleton[i + 1]], color(stroke), size(i) - less);
    stage.lines = skeleton.slice(1).map((end, i) => [project(skeleton[i]), project(end), bare(i) ? size(i) : 0]);
  }

  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

  // How far each drawn body is shifted and turned now, as [shift, turn].
  function motions() {
    if (!mode.bodies) return null;
    const size = reachOfShapes(), c = size * Math.cos(phase), s = size * Math.sin(phase);
    return mode.bodies.real.map((real, i) => real.map((x, k) => c * x - s * mode.bodies.imag[i][k])).map(six => [six.slice(0, 3), six.slice(3)]);
  }

  // The bodies of the links, the farthest triangle first, each as light as it faces the eye.
  function solids(stage) {
    stage.faces = [];
    if (!robot.bodies) return;
    const {of_link, middle, triangles, names} = robot.bodies, moves = motions();
    const places = moves ? corners.map((p, i) => {
      const link = of_link[i], [shift, turn] = moves[link];
      return add(add(p, shift), cross(turn, add(p, middle[link], -1)));
    }) : corners;
    const seen = places.map(project), scale = pixels();
    stage.faces = triangles.map(rows => {
      const [a, b, c] = rows.map(i => seen[i]), u = [b[0] - a[0], b[1] - a[1], scale * (b[2] - a[2])], v = [c[0] - a[0], c[1] - a[1], scale * (c[2] - a[2])];
      const normal = cross(u, v), length = Math.hypot(...normal) || 1;
      return {corners: [a, b, c], depth: a[2] + b[2] + c[2], light: Math.min(1, Math.max(0, Math.sign(normal[2] || 1) * (0.75 * normal[2] - 0.45 * normal[1]) / length + 0.1)), link: names[of_link[rows[0]]]};
    }).sort((a, b) => a.depth - b.depth);
    const shades = shadesBetween(color("muted"), color("neutral"));
    context.lineWidth = 0.8;
    for (const {corners: [a, b, c], light} of stage.faces) {
      context.beginPath();
      context.moveTo(a[0], a[1]);
      context.lineTo(b[0], b[1]);
      context.lineTo(c[0], c[1]);
      context.closePath();
      context.fillStyle = context.strokeStyle = shades[Math.round(light * (shades.length - 1))];
      context.fill();
      context.stroke();
    }
  }

  // Sixteen colours between two, #rrggbb, the darker one first.
  function shadesBetween(...both) {
    const sum = list => list.reduce((a, b) => a + b);
    const [from, to] = both.map(text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16))).sort((a, b) => sum(a) - sum(b));
    return Array.from({length: 16}, (_, k) => `rgb(${from.map((x, i) => Math.round(x + (to[i] - x) * (0.35 + 0.65 * k / 15))).join(" ")})`);
  }

  function paintModel(stage) {
    const skeleton = moved(robot.skeleton, mode.skeleton), points = moved(robot.points, mode.points);
    points.forEach((point, i) => {
      const {segment, part} = feet[i];
      if (skeleton.length > 1) line([add(skeleton[segment], add(skeleton[segment + 1], skeleton[segment], -1), part), point], linkColor(robot.link[i]), 1.5);
    });
    bodies(skeleton, stage);
    solids(stage);
    skeleton.forEach(p => disc(project(p), 4.5, color("paper"), color("ink")));
    paintArrows(points);
    return paintPoints(points);
  }

  // Only points were measured: lines join them as the geometry says, or in their order along the robot.
  function paintMeasured(shape) {
    const points = moved(robot.points, shape), runs = robot.segments || [order];
    // Without lines, how far each point has moved.
    if (shape && !runs.length) points.forEach((p, i) => p && line([robot.points[i], p], color("muted"), 1.5));
    if (shape) for (const run of runs) line(run.map(i => points[i]).filter(Boolean), color("ink"), 2);
    paintArrows(points);
    return paintPoints(points);
  }

  // From every point in the directions of its channels: short ones of responses, longer ones of forces.
  function paintArrows(points) {
    if (!$("robot-arrows").checked) return;
    for (const [kind, length, stroke] of [["response", 0.11, color("fitted")], ["force", 0.24, color("initial")]])
      for (const [row, ...way] of robot.arrows[kind] || []) if (points[row]) arrow(points[row], add(points[row], way, length * radius), stroke, kind === "force" ? 2.5 : 1.5);
  }

  function arrow(from, to, stroke, width) {
    line([from, to], stroke, width);
    const [[x0, y0], [x1, y1]] = [project(from), project(to)], length = Math.hypot(x1 - x0, y1 - y0), head = Math.min(4 + 2 * width, 0.6 * length);
    if (length < 3) return;
    const [u, v] = [(x1 - x0) / length, (y1 - y0) / length];
    context.beginPath();
    context.moveTo(x1 + 2 * u, y1 + 2 * v);
    for (const side of [1, -1]) context.lineTo(x1 - head * u + side * 0.5 * head * v, y1 - head * v - side * 0.5 * head * u);
    context.fillStyle = stroke;
    context.fill();
  }

  function paintPoints(points) {
    return points.map((point, i) => {
      const spot = project(point || robot.points[i]);
      if (robot.ring.nodes.includes(robot.node[i])) disc(spot, 9, "transparent", color("ink"));
      disc(spot, 5, point ? linkColor(robot.link[i]) : "transparent", point ? color("sheet") : linkColor(robot.link[i]));
      return spot;
    });
  }

  function tick(time) {
    if (playing) {
      phase += Math.min(time - last, 100) / 1000 * 2 * Math.PI * 0.7;
      paint();
    }
    last = time;
    requestAnimationFrame(tick);
  }

  function play(on) {
    playing = on;
    $("robot-play").textContent = on ? "Pause" : "Play";
  }

  function hover(event, {canvas, spots, lines, faces}) {
    const box = canvas.getBoundingClientRect(), frame = tip.parentElement.getBoundingClientRect();
    const at = [event.clientX - box.left, event.clientY - box.top];
    const distances = spots.map(([a, b]) => Math.hypot(a - at[0], b - at[1])), i = distances.indexOf(Math.min(...distances));
    const near = distances[i] < 14;
    const name = near ? "" : linkAt(at, lines, faces);
    tip.hidden = !(near || name);
    if (tip.hidden) return;
    tip.style.left = `${Math.min(event.clientX - frame.left + 14, frame.width - 130)}px`;
    tip.style.top = `${event.clientY - frame.top + 14}px`;
    tip.textContent = name || about(i);
  }

  // What is said of a point.
  function about(i) {
    const measured = robot.measured.includes(robot.node[i]) ? "" : "\nwithout FRFs";
    const excited = robot.ring.nodes.includes(robot.node[i]) ? `\n${robot.ring.tip}` : "";
    const link = robot.link[i] && `\non ${robot.link[i]}`;
    return `${robot.node[i]} ${robot.name[i]}${link}${measured}${excited}`;
  }

  // The name of the link that is drawn there, or nothing.
  function linkAt([x, y], lines, faces) {
    const side = ([x0, y0], [x1, y1]) => (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0);
    const face = faces.findLast(({corners: [a, b, c]}) => {
      const sides = [side(a, b), side(b, c), side(c, a)];
      return sides.every(s => s >= 0) || sides.every(s => s <= 0);
    });
    if (face) return face.link;
    const found = lines.findLastIndex(([[x0, y0], [x1, y1], size]) => {
      const along = [x1 - x0, y1 - y0], length = dot(along, along);
      const part = length ? Math.min(1, Math.max(0, dot([x - x0, y - y0], along) / length)) : 0;
      return Math.hypot(x - x0 - part * along[0], y - y0 - part * along[1]) < size / 2;
    });
    return found < 0 ? "" : robot.links[found] || "";
  }

  for (const stage of stages) {
    const {canvas} = stage;
    canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", event => {
      if (!event.buttons) return hover(event, stage);
      view.azimuth -= event.movementX * 0.008;
      view.elevation = Math.min(1.57, Math.max(-0.3, view.elevation + event.movementY * 0.008));
      paint();
    });
    canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
    canvas.addEventListener("keydown", event => {
      const turn = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key], zoom = {"+": 1.1, "-": 1 / 1.1}[event.key];
      if (turn) { view.azimuth += turn[0]; view.elevation = Math.min(1.57, Math.max(-0.3, view.elevation + turn[1])); }
      else if (zoom) view.zoom = Math.min(8, Math.max(0.3, view.zoom * zoom));
      else if (event.key === " ") play(!playing);
      else return;
      event.preventDefault();
      paint();
    });
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      view.zoom = Math.min(8, Math.max(0.3, view.zoom * Math.exp(-event.deltaY * 0.001)));
      paint();
    }, {passive: false});
  }
  $("robot-reset").addEventListener("click", () => { Object.assign(view, home); paint(); });
  $("robot-play").addEventListener("click", () => play(!playing));
  $("robot-measurement").addEventListener("change", choose);
  $("robot-mode").addEventListener("change", chooseMode);
  $("robot-amplitude").addEventListener("input", paint);
  $("robot-arrows").addEventListener("change", paint);
  window.addEventListener("themed", paint);
  window.addEventListener("resize", paint);

  $("robot-links").replaceChildren(...links.map(name => {
    const item = document.createElement("li"), mark = document.createElement("i");
    mark.style.background = linkColor(name);
    item.append(mark, name);
    return item;
  }));
  if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) play(false);
  choose();
  requestAnimationFrame(tick);
  return {chosen, move};
})();
