// The plots of a fit alone: parameters, convergence, identifiability.
"use strict";

(() => {
  const {parameters, starts, history, free, correlation, singular} = DATA;
  const statusColor = {"determined": PALETTE[0], "weak": PALETTE[4], "not determined": PALETTE[1], "at its lower bound": PALETTE[3], "at its upper bound": PALETTE[3], "fixed": PALETTE[7]};
  const statusMark = {"determined": "circle", "weak": "diamond", "not determined": "x", "at its lower bound": "triangle-down", "at its upper bound": "triangle-up", "fixed": "square"};

  draw("parameter-plot", () => {
    const y = parameters.name, common = {y, mode: "markers", type: "scatter"};
    const marks = {size: 9, color: parameters.status.map(s => statusColor[s]), symbol: parameters.status.map(s => statusMark[s])};
    const reach = limits => parameters.value.map((v, i) => limits[i] === null ? 0 : Math.abs(v - limits[i]));
    const kinds = Object.keys(statusColor).filter(s => parameters.status.includes(s));
    const narrow = $("parameter-plot").clientWidth < 560;  // a telephone has room for one panel
    return [[
      {...common, x: parameters.initial, name: "start", marker: {size: 8, symbol: "circle-open", color: color("muted"), line: {width: 1.5}}, hovertemplate: "start<extra>%{y}</extra>"},
      {...common, x: parameters.value, name: "fitted", marker: marks, showlegend: false, error_x: {type: "data", symmetric: false, array: reach(parameters.high_95), arrayminus: reach(parameters.low_95), color: color("ink"), thickness: 1.5, width: 3}, hovertemplate: "fitted<extra>%{y}</extra>"},
      ...(narrow ? [] : [{...common, x: parameters.half, xaxis: "x2", marker: marks, showlegend: false, hovertemplate: "± %{x:.2g} %<extra>%{y}</extra>"}]),
      ...kinds.map(s => ({...common, x: [null], y: [y[0]], name: s, marker: {size: 9, color: statusColor[s], symbol: statusMark[s]}})),
    ], {
      height: (narrow ? 200 : 110) + 22 * y.length, margin: {l: 150, r: 16, t: narrow ? 130 : 40, b: 56}, legend: {orientation: "h", x: 0, y: 1, yanchor: "bottom"},
      xaxis: {title: {text: "Place between the bounds (–)"}, range: [-0.02, 1.02], domain: [0, narrow ? 1 : 0.56], tickvals: [0, 0.25, 0.5, 0.75, 1], ticktext: ["lower", "¼", "½", "¾", "upper"], zeroline: false},
      ...(!narrow && {xaxis2: {domain: [0.62, 1], ...logAxis(parameters.half, "Half the 95 % interval (% of the value)")}}),
      yaxis: {autorange: "reversed", anchor: "x"},
    }];
  });

  const best = Math.min(...starts.cost.filter(c => c !== null));
  const agrees = c => c !== null && c - best <= 1e-3 * Math.max(best, 1e-12);

  draw("history-plot", () => [history.map(([start, stage, evaluations, cost]) => ({
    x: evaluations, y: cost, name: `start ${start + 1}`, legendgroup: `${start}`, showlegend: stage === 0, mode: "lines",
    line: {shape: "hv", width: agrees(starts.cost[start]) ? 2 : 1.2, color: PALETTE[start % PALETTE.length], dash: ["solid", "dash", "dot"][stage % 3], simplify: false},
    hovertemplate: `stage ${stage + 1}, %{x} evaluations: %{y:.4g}`,
  })), {
    height: 340, legend: {orientation: "h", x: 0, y: 1.02, yanchor: "bottom"},
    xaxis: {title: {text: "Evaluations of the start (–)"}}, yaxis: logAxis(history.flatMap(line => line[3]), `Best cost, ${DATA.cost} (–)`),
  }]);

  draw("starts-plot", () => [[
    {x: starts.initial.flatMap(() => free), y: starts.initial.flat(), name: "before", mode: "markers", marker: {symbol: "circle-open", size: 7, color: color("muted")}},
    ...[true, false].map(same => {
      const rows = starts.final.filter((_, i) => agrees(starts.cost[i]) === same);
      return {x: rows.flatMap(() => free), y: rows.flat(), name: same ? "after, best cost" : "after, worse", mode: "markers", marker: {size: 8, symbol: same ? "circle" : "x", color: PALETTE[same ? 0 : 1]}};
    }),
  ], {
    height: 340, margin: {l: 64, r: 16, t: 34, b: 90}, legend: {orientation: "h", x: 0, y: 1.02, yanchor: "bottom"},
    xaxis: {tickangle: -50}, yaxis: {title: {text: "Place between the bounds (–)"}, range: [-0.03, 1.03]},
  }]);

  const LEAST = 0.01;

  draw("singular-plot", () => [[{
    x: singular.map((_, i) => i + 1), y: singular.map(s => Math.max(s, LEAST)), customdata: singular, mode: "markers",
    marker: {size: 9, color: singular.map(s => PALETTE[s >= 1 ? 0 : 1]), symbol: singular.map(s => s >= 1 ? "circle" : s >= LEAST ? "x" : "triangle-down")},
    hovertemplate: "direction %{x}: %{customdata:.4g}<extra></extra>",
  }], {
    height: 340, margin: {l: 64, r: 16, t: 16, b: 48}, showlegend: false,
    xaxis: {title: {text: "Direction (–)"}, dtick: Math.ceil(singular.length / 20)}, yaxis: logAxis([...singular.map(s => Math.max(s, LEAST)), 1], "Noise units per ln value (–)"),
    shapes: [{type: "line", xref: "paper", x0: 0, x1: 1, y0: 1, y1: 1, line: {color: color("warn"), dash: "dot", width: 1.5}}],
  }]);

  draw("correlation-plot", () => [[{
    type: "heatmap", z: correlation, x: free, y: free, zmin: -1, zmax: 1, xgap: 1, ygap: 1, colorscale: [[0, color("cold")], [0.25, color("cool")], [0.5, color("neutral")], [0.75, color("warm")], [1, color("hot")]],
    hovertemplate: "%{x}<br>%{y}<br>%{z:.3f}<extra></extra>", colorbar: colorBar("(–)"),
  }], {
    height: 436, margin: {l: 64, r: 16, t: 32, b: 48},
    xaxis: {tickangle: -50, showgrid: false}, yaxis: {autorange: "reversed", showgrid: false},
  }]);
})();
