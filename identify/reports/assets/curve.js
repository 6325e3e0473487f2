// Measured dynamic stiffnesses: real and imaginary part of each coordinate over frequency, with the law through them.
"use strict";

DATA.stiffness.forEach((curve, k) => draw(`stiffness-${k}`, () => {
  const narrow = $(`stiffness-${k}`).clientWidth < 560;  // a telephone: one panel above the other
  const columns = narrow ? 1 : 2, rows = curve.panels.length / columns, id = n => n ? String(n + 1) : "", gap = 0.08 / rows;
  const traces = curve.panels.flatMap((panel, n) => [
    {
      x: curve.frequency, y: panel.value, name: "measured, with 95 % interval", mode: "markers", marker: {size: 5, color: PALETTE[0]}, showlegend: n === 0, xaxis: `x${id(n)}`, yaxis: `y${id(n)}`,
      error_y: {type: "data", array: panel.spread, color: color("muted"), thickness: 0.8, width: 0}, hovertemplate: "%{x:.4g} Hz: %{y:.4g}<extra></extra>",
    },
    ...(panel.law ? [{
      x: curve.frequency, y: panel.law, name: "law of the added effect", mode: "lines", line: {width: 2.5, color: PALETTE[1], simplify: false}, showlegend: n === 0, xaxis: `x${id(n)}`, yaxis: `y${id(n)}`,
      hovertemplate: "law: %{y:.4g}<extra></extra>",
    }] : []),
  ]);
  const axes = Object.fromEntries(curve.panels.flatMap((panel, n) => {
    const row = Math.floor(n / columns), top = 1 - row / rows;
    return [
      [`xaxis${id(n)}`, {domain: narrow ? [0, 1] : n % 2 ? [0.56, 1] : [0, 0.44], anchor: `y${id(n)}`, title: {text: row === rows - 1 ? "Frequency (Hz)" : ""}}],
      [`yaxis${id(n)}`, {domain: [top - 1 / rows + gap, top - gap], anchor: `x${id(n)}`, title: {text: `${panel.title}<br>(${curve.unit})`, font: {size: 11.5}}, range: panel.range, zeroline: true}],
    ];
  }));
  return [traces, {height: 90 + (narrow ? 190 : 250) * rows, margin: {l: 80, r: 16, t: 40, b: 48}, legend: {orientation: "h", x: 0, y: 1.02, yanchor: "bottom"}, ...axes}];
}));
