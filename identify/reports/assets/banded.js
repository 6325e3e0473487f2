// Lines with bands, panels under each other over the same axis, or each over its own.
"use strict";

DATA.banded.forEach(({id, x, log, columns: wanted, panels}) => draw(`${id}`, () => {
  const columns = $(id).clientWidth < 560 ? 1 : wanted;  // a telephone: one panel above the other
  const own = columns > 1 || panels.some(panel => panel.x), count = Math.ceil(panels.length / columns), gap = own ? 0.12 : 0.06, size = (1 - gap * (count - 1)) / count, named = new Set();
  const axis = row => row ? row + 1 : "", share = 0.88 / columns, place = column => [column * (1 - share) / (columns - 1), column * (1 - share) / (columns - 1) + share];
  const traces = panels.flatMap((panel, row) => panel.lines.flatMap(line => {
    const shade = PALETTE[line.number % PALETTE.length], common = {yaxis: `y${axis(row)}`, ...(own && {xaxis: `x${axis(row)}`}), legendgroup: line.name};
    const first = !named.has(line.name);
    named.add(line.name);
    const limit = {...common, x: line.x, mode: "lines", line: {width: 0, simplify: false}, showlegend: false, hoverinfo: "skip"};
    const bars = line.low && line.points && {error_y: {type: "data", array: line.high.map((v, k) => v - line.y[k]), color: color("muted"), thickness: 0.8, width: 0}};
    const band = line.low && !line.points ? [{...limit, y: line.low}, {...limit, y: line.high, fill: "tonexty", fillcolor: `${shade}40`}] : [];
    return [...band, {
      ...common, ...bars, x: line.x, y: line.y, name: line.name, showlegend: first, mode: line.points ? "markers" : "lines",
      line: line.look === "noisy" ? {color: color("ink"), width: 0.8, simplify: false}
        : {color: shade, width: 1.7, dash: line.dash.map(part => `${1.7 * part}px`).join() || "solid", simplify: false, shape: line.look === "steps" ? "hv" : "linear"},
      marker: {color: shade, size: line.x.length > 200 ? 2.5 : 7, symbol: line.mark[1], line: {width: 1.5}}, hovertemplate: `%{x:.5g}: %{y:.4g}<extra>${line.name}</extra>`,
    }];
  }));
  const axes = Object.fromEntries(panels.map((panel, k) => {
    const row = Math.floor(k / columns), values = panel.lines.flatMap(line => line.y).filter(v => v !== null), top = panel.top;
    const text = panel.title ? `${panel.y}<br>${panel.title}` : panel.y;
    const scale = panel.log ? logAxis(values, text) : {title: {text}, ...(top ? {range: [top].flat().length > 1 ? top : [0, top]} : {})};
    return [`yaxis${axis(k)}`, {...scale, ...(own && {anchor: `x${axis(k)}`}), domain: [1 - (row + 1) * size - row * gap, 1 - row * (size + gap)]}];
  }));
  const xs = panels.flatMap(panel => panel.lines.flatMap(line => line.x));
  const counts = xs.every(Number.isInteger) && Math.max(...xs) - Math.min(...xs) <= 12;
  const across = log ? logAxis(xs, x) : {title: {text: x}, ...(counts && {dtick: 1})};
  return [traces, {
    height: 90 + 270 * count, margin: {l: 72, r: 16, t: 34, b: 48}, legend: {orientation: "h", x: 0, y: 1.01, yanchor: "bottom"},
    ...(own ? Object.fromEntries(panels.map((panel, k) => [`xaxis${axis(k)}`, {
      ...(panel.log_x || log ? logAxis(panel.lines.flatMap(line => line.x), panel.x ?? (k < panels.length - columns ? "" : x)) : {title: {text: panel.x ?? (k < panels.length - columns ? "" : x)}}), anchor: `y${axis(k)}`, domain: columns > 1 ? place(k % columns) : [0, 1],
    }])) : {xaxis: {...across, anchor: `y${axis(count - 1)}`}}), ...axes,
  }];
}));
