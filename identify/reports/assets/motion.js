// The plots of a motion: one record and one joint at a time, panels under each other over the same time.
"use strict";

(() => {
  const pickRecord = $("motion-record"), pickJoint = $("motion-joint");
  const looks = {
    command: {color: "muted", width: 1, dash: "dot"}, recorded: {color: "ink", width: 1.6},
    "start model": {color: "muted", width: 1, dash: "dash"}, simulated: {color: "fitted", width: 1.4},
  };
  pickRecord.append(...DATA.records.map((record, i) => new Option(record.name, i)));
  pickJoint.append(...DATA.joints.map((name, i) => new Option(name, i)));
  const record = () => DATA.records[pickRecord.value];

  function traces() {
    const named = new Set();
    return record().panels.flatMap((panel, row) => panel.curves.map(curve => {
      const first = !named.has(curve.name), look = looks[curve.name];
      named.add(curve.name);
      return {
        x: curve.time, y: curve.values[pickJoint.value], yaxis: `y${row + 1}`, name: curve.name, legendgroup: curve.name, showlegend: first, mode: "lines",
        line: {color: color(look.color), width: look.width, dash: look.dash || "solid", simplify: false}, hovertemplate: `%{y:.5g} ${panel.unit}<extra>${curve.name}</extra>`,
      };
    }));
  }

  function layout() {
    const narrow = $("motion-plot").clientWidth < 560, count = record().panels.length, gap = 0.035, size = (1 - gap * (count - 1)) / count;
    // Long names in two lines, or they reach into the panels above and below.
    const named = panel => panel.label.replace(/ (less|of) /, " $1<br>");
    const axes = Object.fromEntries(record().panels.map((panel, row) => [`yaxis${row + 1}`, {
      title: {text: narrow ? `${panel.label}<br>(${panel.unit})` : `${named(panel)} (${panel.unit})`, font: {size: narrow ? 11 : 13}}, domain: [1 - (row + 1) * size - row * gap, 1 - row * (size + gap)], zeroline: false,
    }]));
    return {
      height: 190 * count, margin: {l: 72, r: 16, t: 34, b: 48}, legend: {orientation: "h", x: 0, y: 1.01, yanchor: "bottom"}, hovermode: "x",
      xaxis: {title: {text: "Time (s)"}, anchor: `y${count}`}, ...axes,
    };
  }

  const show = () => draw("motion-plot", () => [traces(), layout()]);
  const follow = () => { pickJoint.value = record().moving; show(); };
  pickRecord.addEventListener("change", follow);
  pickJoint.addEventListener("change", show);
  follow();
})();
