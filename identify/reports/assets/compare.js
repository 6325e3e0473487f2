// The plot of a comparison alone: parameters over those of the first run.
"use strict";

(() => {
  const {name, runs, range, first} = DATA.parameters, labels = Object.keys(runs);
  const marks = ["circle", "square", "diamond", "triangle-up", "triangle-down", "x"];
  const look = i => ({size: 8, color: PALETTE[i % PALETTE.length], symbol: marks[i % marks.length]});

  draw("ratio-plot", () => [labels.map((label, i) => {
    const values = runs[label], reach = side => values.map(v => v[0] === null || v[side] === null ? 0 : Math.abs(v[side] - v[0]));
    return {
      x: values.map(v => v[0]), y: name.map((_, k) => k + 0.6 * ((i + 0.5) / labels.length - 0.5)), name: label, mode: "markers", type: "scatter", marker: look(i), text: name,
      error_x: {type: "data", symmetric: false, array: reach(2), arrayminus: reach(1), color: PALETTE[i % PALETTE.length], thickness: 1.5, width: 3},
      hovertemplate: `%{text}<br>%{x:.4g} of ${first}<extra>${label}</extra>`,
    };
  }), {
    height: 120 + (16 + 7 * labels.length) * name.length, margin: {l: 150, r: 16, t: 40, b: 56}, legend: {orientation: "h", x: 0, y: 1, yanchor: "bottom"},
    xaxis: range[1] < 3 * range[0] ? {title: {text: `Value over that of ${first} (–)`}, range} : {...logAxis(range, `Value over that of ${first} (–)`), range: range.map(Math.log10)},
    yaxis: {range: [name.length - 0.5, -0.5], tickvals: name.map((_, k) => k), ticktext: name, zeroline: false},
    shapes: [{type: "line", yref: "paper", x0: 1, x1: 1, y0: 0, y1: 1, line: {color: color("muted"), dash: "dot", width: 1}}],
  }]);
})();
