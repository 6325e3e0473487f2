// Quantities at many postures: one over an angle with its intervals, the same as colour over two, and all frequencies; the tool's receptance of a map.
"use strict";

(() => {
  const {names, over, quantities, first, most} = DATA.postures;
  const quantity = $("posture-quantity"), along = $("posture-over"), across = $("posture-across"), up = $("posture-up");
  const groups = [...new Set(quantities.map(q => q.kind))];
  quantity.replaceChildren(...groups.map(kind => {
    const group = document.createElement("optgroup");
    group.label = kind;
    group.append(...quantities.flatMap((q, i) => q.kind === kind ? [new Option(q.name, i)] : []));
    return group;
  }));
  for (const select of [along, across, up]) select.replaceChildren(...over.map((o, i) => new Option(o.label, i)));
  const last = over.length - 1;
  quantity.value = first;
  [across.value, up.value] = most.length === 2 ? [Math.min(...most), Math.max(...most)] : [most.length ? most[0] : last, last];

  // A quantity is shown over the joint it changes with.
  function follow() {
    const joint = quantities[quantity.value].joint, at = over.findIndex(o => o.joint && o.joint === joint);
    along.value = at >= 0 ? at : most.length ? most[0] : last;
  }

  // Where one angle alone varies, a line joins the dots.
  const joined = o => Boolean(o.joint) && over.filter(other => other.joint).length === 1 && new Set(o.values).size === o.values.length;
  const sorted = (o, rows) => joined(o) ? [...rows].sort((a, b) => o.values[a] - o.values[b]) : rows;

  function trend() {
    const q = quantities[quantity.value], o = over[along.value], rows = sorted(o, names.map((_, i) => i));
    const counted = rows.filter(i => !(q.faint && q.faint[i]) && q.value[i] !== null), others = rows.filter(i => q.faint && q.faint[i] && q.value[i] !== null);
    const reach = limit => counted.map(i => limit && limit[i] !== null ? Math.abs(limit[i] - q.value[i]) : 0);
    const values = counted.map(i => q.value[i]), low = Math.min(...values), high = Math.max(...values), room = 0.3 * (high - low) || 0.05 * Math.abs(high) || 1;
    const level = q.level && {type: "rect", xref: "paper", x0: 0, x1: 1, y0: q.level[1], y1: q.level[2], fillcolor: color("initial"), opacity: 0.35, line: {width: 0}, layer: "below"};
    const line = q.level && {type: "line", xref: "paper", x0: 0, x1: 1, y0: q.level[0], y1: q.level[0], line: {color: color("initial"), width: 1.5}, layer: "below"};
    const dots = (at, marker) => ({x: at.map(i => o.values[i]), y: at.map(i => q.value[i]), text: at.map(i => names[i]), mode: "markers", type: "scatter", marker, hovertemplate: "%{text}<br>%{x:.4g}: %{y:.5g}<extra></extra>"});
    return [[
      {...dots(counted, {size: 6, color: color("fitted")}), ...(joined(o) && {mode: "lines+markers", line: {color: color("fitted"), width: 1.2}}), ...(q.low && {error_y: {type: "data", symmetric: false, array: reach(q.high), arrayminus: reach(q.low), color: color("muted"), thickness: 1, width: 0}})},
      ...(others.length ? [dots(others, {size: 6, symbol: "x-thin", color: color("muted"), line: {width: 1.5, color: color("muted")}})] : []),
    ], {
      height: 400, margin: {l: 70, r: 12, t: 40, b: 52}, showlegend: false, title: {text: q.name, font: {size: 14}, x: 0, xref: "paper", xanchor: "left"},
      xaxis: {title: {text: o.label}, zeroline: false}, yaxis: {title: {text: q.label}, zeroline: false, range: values.length ? [low - room, high + room] : undefined},
      shapes: q.level ? [level, line] : [],
    }];
  }

  function map() {
    const q = quantities[quantity.value], x = over[across.value], y = over[up.value], rows = names.map((_, i) => i).filter(i => q.value[i] !== null && !(q.faint && q.faint[i]));
    const metric = [x, y].every(o => o.label.endsWith("(m)"));
    return [[{
      x: rows.map(i => x.values[i]), y: rows.map(i => y.values[i]), text: rows.map(i => names[i]), customdata: rows.map(i => q.value[i]), mode: "markers", type: "scatter",
      marker: {size: rows.length > 300 ? 6 : 9, color: rows.map(i => q.value[i]), colorscale: "Cividis", showscale: true, colorbar: colorBar("")},
      hovertemplate: "%{text}<br>%{customdata:.5g}<extra></extra>",
    }], {
      height: 400, margin: {l: 60, r: 12, t: 40, b: 52}, title: {text: q.label, font: {size: 14}, x: 0, xref: "paper", xanchor: "left"},
      xaxis: {title: {text: x.label}, zeroline: false}, yaxis: {title: {text: y.label}, zeroline: false, ...(metric && {scaleanchor: "x"})},
    }];
  }

  function frequencies() {
    const o = over[along.value], rows = sorted(o, names.map((_, i) => i));
    return [quantities.filter(q => q.kind === "frequency").map((q, i) => ({
      x: rows.map(i => o.values[i]), y: rows.map(i => q.value[i]), text: rows.map(i => names[i]), name: q.name.replace("frequency of ", ""), mode: joined(o) ? "lines+markers" : "markers", line: {width: 1.2}, type: "scatter", marker: {size: 5, color: PALETTE[i % PALETTE.length]},
      hovertemplate: "%{text}: %{y:.4g} Hz<extra></extra>",
    })), {height: 380, margin: {l: 64, r: 12, t: 34, b: 52}, legend: {orientation: "h", x: 0, y: 1.02, yanchor: "bottom"}, xaxis: {title: {text: o.label}, zeroline: false}, yaxis: {title: {text: "Frequency (Hz)"}, rangemode: "tozero"}}];
  }

  function show() {
    draw("trend-plot", trend);
    draw("posture-plot", map);
    draw("frequency-plot", frequencies);
  }

  quantity.addEventListener("change", () => { follow(); show(); });
  for (const select of [along, across, up]) select.addEventListener("change", show);
  follow();
  show();
})();

(() => {
  if (!DATA.tool) return;
  const {names, line, magnitude, phase, band} = DATA.tool, posture = $("tool-posture"), axis = $("tool-axis");
  posture.replaceChildren(...names.map((name, i) => new Option(name, i)));
  posture.value = names.length - 1;

  function tool() {
    const m = magnitude[posture.value][axis.value], p = phase[posture.value][axis.value], b = band[posture.value][axis.value];
    const edge = {x: line, mode: "lines", line: {width: 0, simplify: false}, hoverinfo: "skip", showlegend: false};
    return [[
      {...edge, y: m.map((v, i) => Math.max(v - b[i], 1e-3 * v))},
      {...edge, y: m.map((v, i) => v + b[i]), fill: "tonexty", fillcolor: color("band"), name: "95 % band", showlegend: true},
      {x: line, y: m, mode: "lines", name: "receptance", line: {color: color("fitted"), width: 1.8, simplify: false}, hovertemplate: "%{x:.4g} Hz: %{y:.4g} µm/N<extra></extra>"},
      {x: line, y: p.map((v, i) => i && Math.abs(v - p[i - 1]) > 270 ? null : v), yaxis: "y2", mode: "lines", showlegend: false, line: {color: color("fitted"), width: 1.5, simplify: false}, hovertemplate: "%{y:.4g}°<extra></extra>"},
    ], {
      height: 480, legend: {orientation: "h", x: 0, y: 1.02, yanchor: "bottom"}, xaxis: {title: {text: "Frequency (Hz)"}, anchor: "y2"},
      yaxis: {...logAxis(m, "Receptance (µm/N)"), domain: [0.36, 1]}, yaxis2: {title: {text: "Phase (°)"}, domain: [0, 0.3], range: [-185, 185], tickvals: [-180, -90, 0, 90, 180]},
    }];
  }

  const show = () => draw("tool-plot", tool);
  for (const select of [posture, axis]) select.addEventListener("change", show);
  show();
})();
