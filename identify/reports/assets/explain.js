// The plots of an explained motion: histories with what is left of them, shares of the effects, gaps.
"use strict";

DATA.targets.forEach(target => {
  const {name, unit, joints, records, steps, shares, gap} = target;
  const pickRecord = $(`${name}-record`), pickJoint = $(`${name}-joint`);
  pickRecord.append(...records.map((record, i) => new Option(record.name, i)));
  pickJoint.append(...joints.map((joint, i) => new Option(`joint ${joint}`, i)));
  pickRecord.value = records.length - 1;

  const looks = {
    measured: ["measured", "ink", "y", 1, "solid"], known: ["from what is known", "initial", "y", 1.4, "dash"],
    explained: ["with the effects found", "fitted", "y", 1.4, "solid"],
    before: ["left before", "initial", "y2", 1, "solid"], after: ["left after", "fitted", "y2", 1, "solid"],
  };
  const show = () => draw(`${name}-history`, () => {
    const record = records[pickRecord.value], joint = record.joints[pickJoint.value];
    return [Object.entries(looks).map(([key, [label, hue, axis, width, dash]]) => ({
      x: record.time, y: joint[key], yaxis: axis, name: label, mode: "lines",
      line: {color: color(hue), width, dash, simplify: false}, hovertemplate: `%{y:.4g} ${unit}<extra>${label}</extra>`,
    })), {
      height: 520, margin: {l: 72, r: 16, t: 34, b: 48}, legend: {orientation: "h", x: 0, y: 1.01, yanchor: "bottom"}, hovermode: "x",
      xaxis: {title: {text: "Time (s)"}, anchor: "y2"},
      yaxis: {title: {text: `History (${unit})`}, domain: [0.42, 1], zeroline: false}, yaxis2: {title: {text: `Left (${unit})`}, domain: [0, 0.38]},
    }];
  });
  pickRecord.addEventListener("change", show);
  pickJoint.addEventListener("change", show);
  show();

  const narrow = () => $(`${name}-shares`).clientWidth < 560;  // a telephone: one panel above the other
  if (steps.length) draw(`${name}-shares`, () => [[
    ...joints.map((joint, i) => ({
      x: shares[i], y: steps, type: "bar", orientation: "h", name: `joint ${joint}`, marker: {color: PALETTE[i]},
      hovertemplate: "%{x:.3g} %<extra>%{y}, joint " + joint + "</extra>",
    })),
    ...["before", "after"].map((when, i) => ({
      x: gap[i], y: joints.map(joint => `joint ${joint} `), type: "bar", orientation: "h", name: `gap ${when}`, xaxis: "x2", yaxis: "y2",
      marker: {color: color(i ? "ink" : "line")}, hovertemplate: `%{x:.3g}<extra>gap ${when}</extra>`,
    })),
  ], {
    height: (narrow() ? 2.4 : 1) * (130 + 26 * Math.max(steps.length, 4)), margin: {l: narrow() ? 100 : 210, r: 16, t: narrow() ? 110 : 40, b: 56}, legend: {orientation: "h", x: 0, y: 1, yanchor: "bottom"}, barmode: "group",
    xaxis: {title: {text: "Of the squares at first (%)"}, domain: [0, narrow() ? 1 : 0.62]}, yaxis: {autorange: "reversed", domain: narrow() ? [0.5, 1] : [0, 1]},
    xaxis2: {domain: [narrow() ? 0 : 0.74, 1], anchor: "y2", ...logAxis(gap.flat(), "Gap (1 is noise)")}, yaxis2: {anchor: "x2", autorange: "reversed", domain: narrow() ? [0, 0.3] : [0.3, 1]},
  }]);
});
