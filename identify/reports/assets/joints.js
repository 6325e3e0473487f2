// The plots of identified joints: what was measured, and the identified curve over it, panels under each other.
"use strict";

DATA.curves.forEach(({id, panels}) => draw(`${id}-plot`, () => {
  const count = panels.length, gap = 0.1, size = (1 - gap * (count - 1)) / count, axis = row => row ? row + 1 : "";
  const traces = panels.flatMap((panel, row) => {
    let lines = 0, points = 0;
    return panel.series.map(series => {
      const line = series.look === "line", noisy = series.look === "noisy";
      return {
        x: series.x, y: series.y, xaxis: `x${axis(row)}`, yaxis: `y${axis(row)}`, name: series.name, legendgroup: series.name, showlegend: !row,
        mode: line || noisy ? "lines" : "markers",
        ...(line ? {line: {color: PALETTE[lines], width: 1.6, dash: lines++ % 2 ? "dash" : "solid", simplify: false}}
          : noisy ? {line: {color: color("ink"), width: 0.8, simplify: false}}
          : {marker: {color: color("ink"), size: series.x.length > 200 ? 2.5 : 6, symbol: points++ % 2 ? "x" : "circle-open"}}),
        hovertemplate: "%{x:.5g}, %{y:.5g}<extra>" + series.name + "</extra>",
      };
    });
  });
  const axes = Object.fromEntries(panels.flatMap((panel, row) => {
    const top = 1 - row * (size + gap);
    return [[`xaxis${axis(row)}`, {title: {text: panel.x}, anchor: `y${axis(row)}`}],
      [`yaxis${axis(row)}`, {title: {text: panel.title ? `${panel.y}<br>${panel.title}` : panel.y}, domain: [top - size, top], anchor: `x${axis(row)}`}]];
  }));
  return [traces, {height: count > 1 ? 230 * count : 420, margin: {l: 80, r: 16, t: 34, b: 48}, legend: {orientation: "h", x: 0, y: 1.01, yanchor: "bottom"}, ...axes}];
}));
