// MAC matrices, and the sign that the page is there.
"use strict";

(() => {
  (DATA.measurements || []).forEach((m, i) => m.mac && draw(`mac-${i}`, () => [[{
    type: "heatmap", z: m.mac.values, zmin: 0, zmax: 1, colorscale: [[0, color("neutral")], [1, PALETTE[0]]], xgap: 1, ygap: 1,
    texttemplate: m.mac.values.length <= 16 ? "%{z:.2f}" : "", hovertemplate: "MAC %{z:.3f}<extra></extra>",
    showscale: m.mac.values.length > 16, colorbar: colorBar("MAC (–)"),
  }], {
    height: 144 + 36 * Math.min(m.mac.values.length, 16), margin: {l: 70, r: 10, t: 34, b: 60},
    xaxis: {title: {text: m.mac.across}, tickvals: m.mac.columns.map((_, k) => k), ticktext: m.mac.columns, showgrid: false, zeroline: false},
    yaxis: {title: {text: m.mac.down}, tickvals: m.mac.rows.map((_, k) => k), ticktext: m.mac.rows, autorange: "reversed", showgrid: false, zeroline: false},
  }]));

  Promise.resolve(FRF && FRF.ready).then(() => { document.documentElement.dataset.ready = Math.round(performance.now()); });
})();
