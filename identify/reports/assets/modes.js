// The plots of a modal analysis alone: poles of every order over the mode indicator, with the chosen modes.
"use strict";

DATA.measurements.forEach((m, i) => {
  const {poles, lines, indicator, unit, modes} = m.diagram;
  const kinds = {stable: {color: PALETTE[2], symbol: "circle", size: 4.5}, unstable: {color: PALETTE[7], symbol: "circle-open", size: 3.5, opacity: 0.5},
    "kept by hand": {color: PALETTE[0], symbol: "diamond-open", size: 8}, "dropped by hand": {color: PALETTE[1], symbol: "x-thin-open", size: 7}, "below the threshold": {color: PALETTE[4], symbol: "square-open", size: 7}};
  draw(`diagram-${i}`, () => [[
    ...indicator.map((curve, k) => ({
      x: lines, y: curve, yaxis: "y2", mode: "lines", name: "CMIF", showlegend: k === 0, line: {color: k ? color("line") : color("muted"), width: 1, simplify: false}, hoverinfo: "skip",
    })),
    ...Object.entries(kinds).filter(([kind]) => kind in poles).map(([kind, marker]) => ({
      x: poles[kind].frequency, y: poles[kind].order, customdata: poles[kind].damping, mode: "markers", type: "scatter", name: kind, marker,
      hovertemplate: `order %{y}: %{x:.4g} Hz, damping %{customdata:.3g} %<extra>${kind}</extra>`,
    })),
    {x: modes.map(mode => mode.frequency), y: modes.map(() => 1.02 * m.diagram.highest), text: modes.map(mode => mode.label), mode: "markers", name: "chosen mode", marker: {symbol: "triangle-down", size: 10, color: color("fitted")}, hovertemplate: "%{text}<extra></extra>"},
  ], {
    height: 460, margin: {l: 64, r: 70, t: 40, b: 48}, legend: {orientation: "h", x: 0, y: 1.01, yanchor: "bottom"},
    xaxis: {title: {text: "Frequency (Hz)"}, range: [lines[0], lines.at(-1)]},
    yaxis: {title: {text: "Model order (–)"}, range: [0, 1.06 * m.diagram.highest], overlaying: "y2", tickmode: "auto", showgrid: false, zeroline: false},
    yaxis2: {title: {text: `CMIF (${unit})`}, type: "log", side: "right", exponentformat: "power", dtick: 1, tickfont: {size: 10.5}},
    shapes: modes.map(mode => ({type: "line", x0: mode.frequency, x1: mode.frequency, yref: "paper", y0: 0, y1: 1, layer: "below", line: {color: color("fitted"), width: 1, dash: "dot"}})),
  }]);
});
